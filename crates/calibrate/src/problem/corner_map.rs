//! Offsets of single corners from their planned positions.
//!
//! The prior of an offset is normal, with one standard deviation in the plane of the panels and one
//! out of it. Both are estimated from the data by maximising the marginal likelihood (empirical
//! Bayes, MacKay 1992): with γ the number of offsets that the views determine better than the
//! prior, σ² = Σ offset² / γ.

use std::collections::BTreeMap;

use glam::DVec3;
use nalgebra::Matrix3;

use super::unknowns::Block;
use crate::input::observation::Observation;
use crate::input::panel::PanelRef;
use deltille_core::statistics::median;

/// Initial prior standard deviation, in edges: more than the error of any print.
const FIRST_PRIOR: f64 = 0.01;

/// Minimum prior standard deviation, mm: a hundredth of the resolution of the best print.
const MIN_PRIOR_MM: f64 = 1e-4;

/// Offsets of corners on their panels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CornerMap {
    /// The corners, ordered by label.
    pub corners: Vec<MappedCorner>,
    /// The offset of each corner from its planned position, in the frame of its panel, mm.
    pub offsets_mm: Vec<DVec3>,
    /// The prior standard deviation of an offset along x, y and z of the panel, mm.
    pub prior_mm: DVec3,
    /// The number of offsets that the views determine, γ; zero before that is known.
    pub determined: f64,
}

/// A corner of unknown position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MappedCorner {
    pub panel: PanelRef,
    pub row: i32,
    pub col: i32,
    /// Planned position in the frame of its panel, mm.
    pub panel_mm: DVec3,
}

/// A corner of a panel: panel, row, column.
type Label = (PanelRef, i32, i32);

impl MappedCorner {
    fn label(&self) -> Label {
        (self.panel, self.row, self.col)
    }
}

impl CornerMap {
    /// All corners that the blocks observe, with zero offsets and the initial prior.
    pub(crate) fn flat(blocks: &[Block]) -> Self {
        Self::of(blocks.iter().map(|block| (block.panel, &block.observations[..])))
    }

    /// All corners of these panels, with zero offsets and the initial prior.
    pub(crate) fn of<'a>(seen: impl Iterator<Item = (PanelRef, &'a [Observation])>) -> Self {
        let mut corners: BTreeMap<Label, MappedCorner> = BTreeMap::new();
        for (panel, observations) in seen {
            for &Observation { row, col, panel_mm, .. } in observations {
                let corner = MappedCorner { panel, row, col, panel_mm };
                corners.entry(corner.label()).or_insert(corner);
            }
        }
        let corners: Vec<MappedCorner> = corners.into_values().collect();
        let offsets_mm = vec![DVec3::ZERO; corners.len()];
        let prior_mm = DVec3::splat(FIRST_PRIOR * nearest_mm(&corners));
        Self { corners, offsets_mm, prior_mm, determined: 0.0 }
    }

    /// The same map with another prior, mm, and the number of offsets that the views determine.
    pub(crate) fn expecting(self, prior_mm: DVec3, determined: f64) -> Self {
        Self { prior_mm, determined, ..self }
    }

    /// The distance of neighbours in a row, mm.
    pub(crate) fn edge_mm(&self) -> f64 {
        nearest_mm(&self.corners)
    }

    /// Number of corners.
    pub(crate) fn len(&self) -> usize {
        self.corners.len()
    }

    /// For each corner, the number of blocks that observe it.
    pub(crate) fn views(&self, blocks: &[Block]) -> Vec<usize> {
        let mut views = vec![0; self.len()];
        for block in blocks {
            self.indices(block).flatten().for_each(|index| views[index] += 1);
        }
        views
    }

    /// The index of each corner of a block; `None` for a corner that is not in the map. A corner that follows the one
    /// before it in the order of labels is found without a search.
    pub(crate) fn indices<'a>(
        &'a self,
        block: &'a Block,
    ) -> impl Iterator<Item = Option<usize>> + 'a {
        let mut next = 0;
        block.observations.iter().map(move |seen| {
            let own = (block.panel, seen.row, seen.col);
            let found = match self.corners.get(next) {
                Some(corner) if corner.label() == own => Some(next),
                _ => self.corners.binary_search_by_key(&own, MappedCorner::label).ok(),
            };
            next = found.map_or(next, |index| index + 1);
            found
        })
    }

    /// The prior that maximises the marginal likelihood of the offsets, mm, and the number γ of offsets that
    /// the views determine; `covariances` and `sigma` are as in [`Self::without_gauge`].
    pub(crate) fn fitted_prior(&self, covariances: &[Matrix3<f64>], sigma: f64) -> (DVec3, f64) {
        let of_axes = |axes: &[usize]| {
            let (mut squares, mut determined) = (0.0, 0.0);
            for (offset, covariance) in self.offsets_mm.iter().zip(covariances) {
                for &k in axes {
                    squares += offset[k] * offset[k];
                    determined += 1.0 - covariance[(k, k)] * (sigma / self.prior_mm[k]).powi(2);
                }
            }
            ((squares / determined.max(1.0)).sqrt().max(MIN_PRIOR_MM), determined)
        };
        let [(plane, in_plane), (out, out_of_plane)] = [of_axes(&[0, 1]), of_axes(&[2])];
        (DVec3::new(plane, plane, out), in_plane + out_of_plane)
    }
}

/// The median distance of a corner to the next in its row, mm; 1 if there are no neighbours.
fn nearest_mm(corners: &[MappedCorner]) -> f64 {
    let pairs = corners.iter().zip(corners.iter().skip(1));
    let in_a_row = pairs.filter(|(a, b)| (a.panel, a.row, a.col + 1) == (b.panel, b.row, b.col));
    let distances = in_a_row.map(|(a, b)| a.panel_mm.distance(b.panel_mm)).collect();
    median(distances).unwrap_or(1.0)
}
