//! Panels whose places on the target are found.
//!
//! The target frame is that of its file, held by the panel that was seen most, which stays; all others move
//! against it. Lengths are those of the panels, which are taken to be true in themselves.

use std::collections::BTreeSet;

use super::calibration::PanelPlace;
use super::gross_errors::Kept;
use super::problem::{Block, PanelUnknowns, Prior};

/// What is unknown of the panels.
pub(super) fn unknowns(
    blocks: &[Block],
    panels: &[PanelPlace],
    refine: bool,
) -> Vec<PanelUnknowns> {
    let (held, connected) = connected(blocks, panels);
    let unknown = |(index, place): (usize, &PanelPlace)| {
        let pose_free = refine && index != held && connected.contains(&index);
        let prior = place
            .covariance
            .filter(|_| pose_free)
            .and_then(|covariance| Prior::new(place.target_from_panel, covariance));
        PanelUnknowns { target_from_panel: place.target_from_panel, pose_free, prior }
    };
    panels.iter().enumerate().map(unknown).collect()
}

/// Holds a panel of those that take part. Where frames went, a panel may hang together with no other, or
/// another be held.
pub(super) fn hold(kept: &mut Kept, panels: &[PanelPlace], refine: bool) {
    let of_blocks = kept.problem.blocks.iter().zip(&kept.left_out);
    let taking_part = of_blocks.filter(|(_, out)| !**out).map(|(block, _)| block.clone());
    let unknowns = unknowns(&taking_part.collect::<Vec<_>>(), panels, refine);
    for (panel, unknown) in kept.problem.panels.iter_mut().zip(unknowns) {
        if panel.pose_free != unknown.pose_free {
            *panel = unknown;
        }
    }
}

/// The panel to be held: the one seen most of those that no measurement moves, which an earlier
/// refinement held too; and those that hang together with it by frames in which both were seen.
fn connected(blocks: &[Block], panels: &[PanelPlace]) -> (usize, BTreeSet<usize>) {
    let count = panels.len();
    let mut corners = vec![0; count];
    let mut frames = vec![BTreeSet::new(); count];
    for block in blocks {
        corners[block.panel.index()] += block.observations.len();
        frames[block.panel.index()].insert(block.frame);
    }
    let stated = |panel: usize| corners[panel] > 0 && panels[panel].covariance.is_none();
    let rank = |&panel: &usize| (stated(panel), corners[panel], std::cmp::Reverse(panel));
    let held = (0..count).max_by_key(rank).unwrap_or_default();
    let (mut found, mut open) = (BTreeSet::from([held]), vec![held]);
    while let Some(panel) = open.pop() {
        for other in 0..count {
            if !found.contains(&other) && !frames[other].is_disjoint(&frames[panel]) {
                found.insert(other);
                open.push(other);
            }
        }
    }
    (held, found)
}
