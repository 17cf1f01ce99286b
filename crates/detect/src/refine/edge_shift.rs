//! Measures how far the edges of a grid have moved, without a model of the corners.
//!
//! A line of the lattice passes through its corners, and half-way between two of them nothing else is near. The step
//! from dark to bright across the line is displaced there by the shift of the edges. The model of the corners starts
//! from this value if it is larger than its range of convergence.

use glam::DVec2;

use super::shared_optics::REACH_PX;
use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;
use std::collections::BTreeMap;

/// Shift below which the model converges from zero, px: less than one blur.
const MIN_SHIFT_PX: f64 = 0.5;

/// Distance from a corner to the farthest point of the gap or overlap of the tiles there, in shifts of the edges.
const fn gap(kind: GridKind) -> f64 {
    match kind {
        GridKind::Deltille => 2.0,
        GridKind::Checker => std::f64::consts::SQRT_2,
    }
}

/// Minimum number of edges that are measured.
const MIN_EDGES: usize = 6;

/// Maximum number of edges that are measured; the median of so many is accurate to a tenth of a pixel.
const MAX_EDGES: usize = 48;

/// Largest measured shift, as a fraction of the edge length. Tiles that have lost or gained 30 % on each side are no
/// longer adjacent to their corners.
const MAX_SHIFT: f64 = 0.3;

/// Number of samples across an edge, to each side.
const SAMPLES: i32 = 24;

/// Growth of dark areas on every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeShift {
    /// As a fraction of the edge length.
    pub edges: f64,
    /// Absolute value, px.
    px: f64,
    kind: GridKind,
}

impl EdgeShift {
    /// Returns the finest level of the pyramid, of `levels`, on which the windows of the first fits extend beyond the
    /// gaps at the corners.
    pub(crate) fn level(self, levels: usize) -> usize {
        let gap_px = gap(self.kind) * self.px;
        let fits = |level: &usize| gap_px <= REACH_PX * f64::from(1u32 << level);
        (0..levels).find(fits).unwrap_or(levels.saturating_sub(1))
    }
}

/// Returns the shift of the edges of these grids, the median; `None` if it is small.
pub(crate) fn large_shift(image: ImageView, grids: &[Grid]) -> Option<EdgeShift> {
    let mut shifts: Vec<EdgeShift> =
        grids.iter().filter_map(|grid| shift_of_grid(image, grid)).collect();
    shifts.sort_by(|a, b| a.edges.total_cmp(&b.edges));
    shifts.get(shifts.len() / 2).copied().filter(|shift| shift.px > MIN_SHIFT_PX)
}

fn shift_of_grid(image: ImageView, grid: &Grid) -> Option<EdgeShift> {
    let corners: BTreeMap<Vertex, DVec2> = grid
        .corners
        .iter()
        .map(|corner| (Vertex::new(corner.row, corner.col), corner.position()))
        .collect();
    let steps = grid.kind.steps();
    let half = &steps[..steps.len() / 2];
    let edges: Vec<[DVec2; 2]> = corners
        .iter()
        .flat_map(|(&vertex, &from)| half.iter().map(move |&step| (vertex + step, from)))
        .filter_map(|(next, from)| Some([from, *corners.get(&next)?]))
        .collect();
    let every = edges.len().div_ceil(MAX_EDGES).max(1);
    let measured = edges.iter().step_by(every);
    let shifts: Vec<f64> =
        measured.filter_map(|&[from, to]| shift_of_edge(image, from, to, grid.kind)).collect();
    let edge_px = grid.edge_px()?;
    let is_measured = shifts.len() >= MIN_EDGES;
    let edges = median(shifts).filter(|_| is_measured)?;
    Some(EdgeShift { edges, px: edges.abs() * edge_px, kind: grid.kind })
}

/// Returns the displacement of the step across an edge towards its bright side, as a fraction of the edge length.
fn shift_of_edge(image: ImageView, from: DVec2, to: DVec2, kind: GridKind) -> Option<f64> {
    let along = to - from;
    let middle = (from + to) / 2.0;
    let across = along.perp();
    let reach = match kind {
        GridKind::Deltille => MAX_SHIFT * deltille_core::lattice::ROW_HEIGHT,
        GridKind::Checker => MAX_SHIFT,
    };
    let inside = |place: DVec2| {
        place.min_element() >= 0.0
            && place.x < image.width() as f64 - 1.0
            && place.y < image.height() as f64 - 1.0
    };
    let place = |i: i32| middle + across * (reach * f64::from(i) / f64::from(SAMPLES));
    if !(inside(place(-SAMPLES)) && inside(place(SAMPLES))) {
        return None;
    }
    let profile: Vec<f64> = (-SAMPLES..=SAMPLES)
        .map(|i| {
            let DVec2 { x, y } = place(i);
            f64::from(image.bilinear(x, y))
        })
        .collect();
    let low = profile.iter().copied().fold(f64::INFINITY, f64::min);
    let high = profile.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let level = (low + high) / 2.0;
    let is_bright = |value: &f64| *value > level;
    // Exactly one step: tags and neighbouring tiles are farther away.
    let steps: Vec<usize> = (1..profile.len())
        .filter(|&i| is_bright(&profile[i - 1]) != is_bright(&profile[i]))
        .collect();
    let &[at] = &steps[..] else { return None };
    let part = (level - profile[at - 1]) / (profile[at] - profile[at - 1]);
    let position = (at as f64 - 1.0 + part - f64::from(SAMPLES)) * reach / f64::from(SAMPLES);
    Some(if is_bright(&profile[at]) { position } else { -position })
}
