//! Measures how far the edges of a grid have moved, without a model of the corners.
//!
//! A line of the lattice passes through its corners, and half-way between two of them nothing else is near. The step
//! from dark to bright across the line is displaced there by the shift of the edges. The model of the corners starts
//! from this value if it is larger than its range of convergence.

use std::collections::BTreeMap;

use glam::DVec2;

use super::shared_optics::REACH_PX;
use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

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

/// Maximum median deviation of the middle of an edge from its quarters, as a fraction of its length. A disc that reaches
/// its diagonal neighbours has 0.046.
const MAX_BOW: f64 = 0.025;

/// Number of samples across an edge, to each side.
const SAMPLES: i32 = 24;

/// Growth of dark areas on every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeShift {
    /// As a fraction of the edge length.
    pub edges: f64,
    /// Absolute value, px.
    pub px: f64,
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

/// Returns the shift of the edges of these grids, the median; `None` if the model converges without it.
pub(crate) fn large_shift(image: ImageView, grids: &[Grid]) -> Option<EdgeShift> {
    let mut shifts: Vec<EdgeShift> =
        grids.iter().filter_map(|grid| shift_of_grid(image, grid)).collect();
    shifts.sort_by(|a, b| a.edges.total_cmp(&b.edges));
    shifts.get(shifts.len() / 2).copied().filter(|shift| shift.px > MIN_SHIFT_PX)
}

/// Returns whether the edges of an untagged grid are straight. Dots that touch diagonally look like squares that have
/// grown or shrunk, but their outlines are round.
pub(crate) fn has_straight_edges(image: ImageView, grid: &Grid) -> bool {
    let bow = |edge: &MeasuredEdge| {
        let [first, middle, last] =
            [0.25, 0.5, 0.75].map(|part| shift_of_edge(image, edge, part, grid.kind));
        Some(middle? - (first? + last?) / 2.0)
    };
    let bows: Vec<f64> = measured_edges(grid).iter().filter_map(bow).collect();
    let is_measured = bows.len() >= MIN_EDGES;
    is_measured && median(bows).is_some_and(|bow| bow.abs() < MAX_BOW)
}

/// An edge of a tile.
struct MeasuredEdge {
    from: DVec2,
    along: DVec2,
    /// Image of the direction that is perpendicular to the edge on the print, as long as the edge there.
    across: DVec2,
}

/// Returns edges of a grid from all over it.
fn measured_edges(grid: &Grid) -> Vec<MeasuredEdge> {
    let corners: BTreeMap<Vertex, DVec2> = grid
        .corners
        .iter()
        .map(|corner| (Vertex::new(corner.row, corner.col), corner.position()))
        .collect();
    let steps = grid.kind.steps();
    let (half, quarter) = (steps.len() / 2, steps.len() / 4);
    let edge = |(vertex, from, k): (Vertex, DVec2, usize)| {
        let along = *corners.get(&(vertex + steps[k]))? - from;
        // On either side: a corner of the same tile.
        let beside = [k + quarter, k + steps.len() - quarter]
            .map(|side| corners.get(&(vertex + steps[side % steps.len()])));
        let beside = beside.into_iter().flatten().next()? - from;
        let across = match grid.kind {
            GridKind::Deltille => (beside - along / 2.0) / deltille_core::lattice::ROW_HEIGHT,
            GridKind::Checker => beside,
        };
        Some(MeasuredEdge { from, along, across })
    };
    let all = corners.iter().flat_map(|(&vertex, &from)| (0..half).map(move |k| (vertex, from, k)));
    let edges: Vec<MeasuredEdge> = all.filter_map(edge).collect();
    let every = edges.len().div_ceil(MAX_EDGES).max(1);
    edges.into_iter().step_by(every).collect()
}

fn shift_of_grid(image: ImageView, grid: &Grid) -> Option<EdgeShift> {
    let shifts: Vec<f64> = measured_edges(grid)
        .iter()
        .filter_map(|edge| shift_of_edge(image, edge, 0.5, grid.kind))
        .collect();
    let edge_px = grid.edge_px()?;
    let is_measured = shifts.len() >= MIN_EDGES;
    let edges = median(shifts).filter(|_| is_measured)?;
    Some(EdgeShift { edges, px: edges.abs() * edge_px, kind: grid.kind })
}

/// Returns the displacement of the step across an edge towards its bright side, as a fraction of the edge length.
/// It is measured at a fraction `part` of the edge.
fn shift_of_edge(image: ImageView, edge: &MeasuredEdge, part: f64, kind: GridKind) -> Option<f64> {
    let MeasuredEdge { from, along, across } = *edge;
    let middle = from + part * along;
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

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::detection::GridCorner;
    use deltille_core::raster::Gray;

    const EDGE_PX: usize = 30;

    /// A board whose dark tiles are the points within `is_dark` of their centres, in edges, and its corners.
    fn board(is_dark: impl Fn(f64, f64) -> bool) -> (Gray<u8>, Grid) {
        let side = 9 * EDGE_PX;
        let image = Gray::from_fn(side, side, |x, y| {
            let [u, v] = [x, y].map(|c| (c as f64 + 0.5) / EDGE_PX as f64);
            let near = |at: f64| [at.floor() - 1.0, at.floor(), at.floor() + 1.0];
            let dark = near(u).into_iter().any(|col| {
                near(v).into_iter().any(|row| {
                    (col + row).rem_euclid(2.0) == 0.0 && is_dark(u - col - 0.5, v - row - 0.5)
                })
            });
            if dark { 40 } else { 220 }
        });
        let place = |i: i32| f64::from(i) * EDGE_PX as f64 - 0.5;
        let corners = (1..64).map(|i| (i / 8, i % 8)).filter(|(row, col)| *row > 0 && *col > 0);
        let corners = corners.map(|(row, col)| {
            let (id, cov) = (None, None);
            GridCorner { row, col, id, x: place(col), y: place(row), cov }
        });
        let grid = Grid {
            kind: GridKind::Checker,
            target: None,
            panel: None,
            mirrored: false,
            corners: corners.collect(),
            tags: Vec::new(),
        };
        (image, grid)
    }

    #[test]
    fn squares_are_measured_and_dots_are_not_squares() {
        for shift in [-0.15, -0.05, 0.1] {
            let (image, grid) = board(|u, v| u.abs().max(v.abs()) < 0.5 + shift);
            let found = large_shift((&image).into(), std::slice::from_ref(&grid)).unwrap();
            assert!((found.edges - shift).abs() < 0.03, "{shift}: {found:?}");
            assert!(has_straight_edges((&image).into(), &grid), "{shift}");
        }
        for radius in [0.6, 0.69, 0.75] {
            let (image, grid) = board(|u, v| u.hypot(v) < radius);
            assert!(!has_straight_edges((&image).into(), &grid), "{radius}");
        }
    }
}
