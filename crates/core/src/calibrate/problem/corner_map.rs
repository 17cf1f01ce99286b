//! Offsets of single corners from their places in the plan of the target.
//!
//! The prior of an offset is normal, with one standard deviation in the plane of the panels and one
//! out of it. Both are estimated from the data by maximising the marginal likelihood (empirical
//! Bayes, MacKay 1992): with γ the number of offsets that the views determine better than the
//! prior, σ² = Σ offset² / γ.

use std::collections::BTreeMap;

use glam::DVec3;
use nalgebra::{DMatrix, Matrix3};

use super::bundle::Problem;
use crate::calibrate::input::observation::Observation;
use crate::calibrate::input::panel::PanelRef;
use crate::statistics::median;

/// First prior standard deviation, in edges: more than the error of any print.
const FIRST_PRIOR: f64 = 0.01;

/// Least prior standard deviation, mm: a hundredth of what the best print resolves.
const LEAST_PRIOR_MM: f64 = 1e-4;

/// A corner of a panel: index of the panel, row, column.
type Label = (usize, i32, i32);

/// Offsets of corners on their panels.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::calibrate) struct CornerMap {
    index: BTreeMap<Label, usize>,
    /// The corners, ordered by label.
    pub corners: Vec<MappedCorner>,
    /// The offset of each corner from its place in the plan, in the frame of its panel, mm.
    pub offsets_mm: Vec<DVec3>,
    /// The prior standard deviation of an offset along x, y and z of the panel, mm.
    pub prior_mm: DVec3,
    /// The number of offsets that the views determine, γ; zero before that is known.
    pub determined: f64,
}

/// A corner whose place is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::calibrate) struct MappedCorner {
    pub panel: PanelRef,
    pub row: i32,
    pub col: i32,
    /// Its place in the plan, in the frame of its panel, mm.
    pub panel_mm: DVec3,
}

impl CornerMap {
    /// All corners that a problem has observations of, with zero offsets and the first prior.
    pub fn flat(problem: &Problem) -> Self {
        let mut index = BTreeMap::new();
        let mut corners: Vec<MappedCorner> = Vec::new();
        for block in &problem.blocks {
            for &Observation { row, col, panel_mm, .. } in &block.observations {
                let at = *index.entry((block.panel.index(), row, col)).or_insert(corners.len());
                if at == corners.len() {
                    let panel = block.panel;
                    corners.push(MappedCorner { panel, row, col, panel_mm });
                }
            }
        }
        // By label.
        corners.sort_by_key(|corner| (corner.panel, corner.row, corner.col));
        let labels = corners.iter().map(|corner| (corner.panel.index(), corner.row, corner.col));
        let index = labels.enumerate().map(|(at, label)| (label, at)).collect();
        let offsets_mm = vec![DVec3::ZERO; corners.len()];
        let prior_mm = DVec3::splat(FIRST_PRIOR * nearest_mm(&corners));
        Self { index, corners, offsets_mm, prior_mm, determined: 0.0 }
    }

    /// The same map with another prior, mm, and the number of offsets that the views determine.
    pub fn expecting(self, (prior_mm, determined): (DVec3, f64)) -> Self {
        Self { prior_mm, determined, ..self }
    }

    /// The distance of neighbours in a row, mm.
    pub fn edge_mm(&self) -> f64 {
        nearest_mm(&self.corners)
    }

    /// Number of corners.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// For each corner the number of blocks that observe it.
    pub fn views(&self, problem: &Problem) -> Vec<usize> {
        let mut views = vec![0; self.len()];
        for block in &problem.blocks {
            block.observations.iter().for_each(|seen| views[self.index(block.panel, seen)] += 1);
        }
        views
    }

    /// The index of a corner, which the map must have.
    pub fn index(&self, panel: PanelRef, seen: &Observation) -> usize {
        self.index[&(panel.index(), seen.row, seen.col)]
    }

    /// The offset of a corner, mm; zero for a corner that the map does not have.
    pub fn offset(&self, panel: PanelRef, seen: &Observation) -> DVec3 {
        let index = self.index.get(&(panel.index(), seen.row, seen.col));
        index.map_or(DVec3::ZERO, |&index| self.offsets_mm[index])
    }

    /// The prior that maximises the marginal likelihood of the offsets, mm, and the number γ of offsets that
    /// the views determine; `covariances` and `sigma` are as in [`Self::without_gauge`].
    pub fn fitted_prior(&self, covariances: &[Matrix3<f64>], sigma: f64) -> (DVec3, f64) {
        let of_axes = |axes: &[usize]| {
            let (mut squares, mut determined) = (0.0, 0.0);
            for (offset, covariance) in self.offsets_mm.iter().zip(covariances) {
                for &k in axes {
                    squares += offset[k] * offset[k];
                    determined += 1.0 - covariance[(k, k)] * (sigma / self.prior_mm[k]).powi(2);
                }
            }
            ((squares / determined.max(1.0)).sqrt().max(LEAST_PRIOR_MM), determined)
        };
        let [(plane, in_plane), (out, out_of_plane)] = [of_axes(&[0, 1]), of_axes(&[2])];
        (DVec3::new(plane, plane, out), in_plane + out_of_plane)
    }

    /// The covariances of the offsets less the share of the directions that poses and distances
    /// absorb (the gauge): in these directions only the prior determines the offsets, and holds
    /// them at zero. `covariances` are 3 × 3 for each corner, from the normal equations; `sigma` is
    /// the standard deviation of a whitened coordinate, the unit in which costs are counted.
    ///
    /// These directions are a translation and a rotation of the whole target, or of each panel by
    /// itself where panel poses are estimated, and a common scale where nothing else determines
    /// lengths.
    pub fn without_gauge(
        &self,
        covariances: &[Matrix3<f64>],
        sigma: f64,
        problem: &Problem,
    ) -> Vec<Matrix3<f64>> {
        let groups = self.rigid_groups(problem);
        let mut modes: Vec<Vec<DVec3>> = Vec::new();
        for group in 0..=groups.iter().copied().max().unwrap_or_default() {
            let of_group = |field: &dyn Fn(DVec3) -> DVec3| {
                let corners = self.corners.iter().zip(&groups);
                let of_corner = corners.enumerate().map(|(index, (_, &of))| match of == group {
                    true => self.on_panel(problem, index, field),
                    false => DVec3::ZERO,
                });
                of_corner.collect::<Vec<_>>()
            };
            for axis in DVec3::AXES {
                modes.push(of_group(&|_| axis));
                modes.push(of_group(&|at| axis.cross(at)));
            }
        }
        if has_free_scale(problem) {
            let corners = 0..self.len();
            modes.push(corners.map(|index| self.on_panel(problem, index, &|at| at)).collect());
        }
        let scaled = DMatrix::from_fn(3 * self.len(), modes.len(), |i, mode| {
            modes[mode][i / 3][i % 3] / self.prior_mm[i % 3]
        });
        let basis = scaled.qr().q();
        let prior = self.prior_mm / sigma;
        let of_corner = |(index, covariance): (usize, &Matrix3<f64>)| {
            let of_corner = basis.fixed_rows::<3>(3 * index);
            let held = of_corner * of_corner.transpose();
            covariance - Matrix3::from_fn(|i, j| held[(i, j)] * prior[i] * prior[j])
        };
        covariances.iter().enumerate().map(of_corner).collect()
    }

    /// The displacement of a corner, in the frame of its panel, that a vector field in the frame of
    /// the target gives at its present place.
    fn on_panel(&self, problem: &Problem, index: usize, field: &dyn Fn(DVec3) -> DVec3) -> DVec3 {
        let MappedCorner { panel, panel_mm, .. } = self.corners[index];
        let pose = problem.panels[panel.index()].target_from_panel;
        pose.rotation.conjugate() * field(pose.apply(panel_mm + self.offsets_mm[index]))
    }

    /// For each corner the index of the group of panels that moves rigidly.
    fn rigid_groups(&self, problem: &Problem) -> Vec<usize> {
        let mut groups: Vec<(usize, Option<PanelRef>)> = Vec::new();
        let is_free = |panel: PanelRef| problem.panels[panel.index()].pose_free;
        let any_is_free = self.corners.iter().any(|corner| is_free(corner.panel));
        let of_corner = |corner: &MappedCorner| {
            let target = problem.panels[corner.panel.index()].target;
            let own = (target, any_is_free.then_some(corner.panel));
            groups.iter().position(|group| *group == own).unwrap_or_else(|| {
                groups.push(own);
                groups.len() - 1
            })
        };
        self.corners.iter().map(of_corner).collect()
    }
}

/// The median distance of a corner to the next in its row, mm; 1 without such pairs.
fn nearest_mm(corners: &[MappedCorner]) -> f64 {
    let pairs = corners.iter().zip(corners.iter().skip(1));
    let in_a_row = pairs.filter(|(a, b)| (a.panel, a.row, a.col + 1) == (b.panel, b.row, b.col));
    let distances = in_a_row.map(|(a, b)| a.panel_mm.distance(b.panel_mm)).collect();
    median(distances).unwrap_or(1.0)
}

/// Whether only the plan of the target determines lengths: no distance between cameras is known.
fn has_free_scale(problem: &Problem) -> bool {
    problem.cameras.iter().filter(|camera| !camera.pose_free).count() <= 1
}
