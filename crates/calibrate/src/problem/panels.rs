//! Choice of the panels and targets whose poses are estimated.
//!
//! The target frame is that of the target file. The panel that was seen most often fixes it; all
//! other panels move relative to that panel. The scene frame is that of the first used target. The
//! scale comes from the panels, whose lengths are assumed to be exact.

use std::collections::BTreeSet;

use super::bundle::Problem;
use super::unknowns::{Block, PanelUnknowns, Prior, TargetUnknowns};
use crate::input::calibration::Calibration;
use deltille_core::camera::Pose;

/// The unknowns of the panels.
pub(crate) fn unknowns(blocks: &[Block], calibration: &Calibration) -> Vec<PanelUnknowns> {
    let Calibration { panels, targets, refine_panels, .. } = calibration;
    let mut unknowns = Vec::with_capacity(panels.len());
    for (target, of_target) in targets.iter().enumerate() {
        let (held, connected) = connected(blocks, calibration, target);
        for index in of_target.panels.clone() {
            let place = &panels[index];
            let pose_free = *refine_panels && index != held && connected.contains(&index);
            let prior = place
                .covariance
                .filter(|_| pose_free)
                .and_then(|covariance| Prior::new(place.target_from_panel, covariance));
            let target_from_panel = place.target_from_panel;
            unknowns.push(PanelUnknowns { target, target_from_panel, pose_free, prior });
        }
    }
    unknowns
}

/// The unknowns of the targets, from their initial poses.
pub(crate) fn targets_unknown(
    blocks: &[Block],
    calibration: &Calibration,
    places: &[Pose],
) -> Vec<TargetUnknowns> {
    let seen: BTreeSet<usize> =
        blocks.iter().map(|block| calibration.target_of(block.panel)).collect();
    let is_known = |target: usize| calibration.targets[target].scene_from_target.is_some();
    let held = seen.iter().copied().find(|&target| is_known(target)).or(seen.first().copied());
    let unknown = |(target, &scene_from_target): (usize, &Pose)| {
        let is_open = seen.contains(&target) && held != Some(target);
        TargetUnknowns { scene_from_target, pose_free: is_open && !is_known(target) }
    };
    places.iter().enumerate().map(unknown).collect()
}

/// Fixes one of the used panels, and a target. After the exclusion of frames, a panel may no longer be connected to the
/// others, or another panel may have to be fixed.
pub(crate) fn fix_gauge(problem: &mut Problem, left_out: &[bool], calibration: &Calibration) {
    let of_blocks = problem.blocks.iter().zip(left_out);
    let taking_part = of_blocks.filter(|(_, out)| !**out).map(|(block, _)| block.clone());
    let taking_part: Vec<Block> = taking_part.collect();
    let unknowns = unknowns(&taking_part, calibration);
    for (panel, unknown) in problem.panels.iter_mut().zip(unknowns) {
        if panel.pose_free != unknown.pose_free {
            *panel = unknown;
        }
    }
    let places: Vec<Pose> = problem.targets.iter().map(|t| t.scene_from_target).collect();
    problem.targets = targets_unknown(&taking_part, calibration, &places);
}

/// The panel of a target to fix, and the panels connected with it by frames in which both were
/// seen. It is the one seen most often among those without an earlier measurement, because an
/// earlier refinement fixed it, too.
fn connected(
    blocks: &[Block],
    calibration: &Calibration,
    target: usize,
) -> (usize, BTreeSet<usize>) {
    let Calibration { panels, targets, .. } = calibration;
    let of_target = || targets[target].panels.clone();
    let mut corners = vec![0; panels.len()];
    let mut frames = vec![BTreeSet::new(); panels.len()];
    for block in blocks {
        corners[block.panel.index()] += block.observations.len();
        frames[block.panel.index()].insert(block.frame);
    }
    let stated = |panel: usize| corners[panel] > 0 && panels[panel].covariance.is_none();
    let rank = |&panel: &usize| (stated(panel), corners[panel], std::cmp::Reverse(panel));
    let held = of_target().max_by_key(rank).unwrap_or_default();
    let (mut found, mut open) = (BTreeSet::from([held]), vec![held]);
    while let Some(panel) = open.pop() {
        for other in of_target() {
            if !found.contains(&other) && !frames[other].is_disjoint(&frames[panel]) {
                found.insert(other);
                open.push(other);
            }
        }
    }
    (held, found)
}
