//! Measures how far the edges of a grid have moved, without a model of the corners.
//!
//! A line of the lattice passes through its corners, and half-way between two of them nothing else is near. The step
//! from dark to bright across the line is displaced there by the shift of the edges. The model of the corners starts
//! from this value if it is larger than its range of convergence.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec2;

use super::shared_optics::REACH_PX;
use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, ROW_HEIGHT, Vertex};
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
    /// Common displacement of the corners from their edges, along the first two steps of the lattice: three edges that
    /// have moved cross in three points, each of which may be taken for the corner.
    offset: [f64; 2],
    kind: GridKind,
}

impl EdgeShift {
    /// Moves the corners of a grid back between their edges.
    pub(crate) fn centre(self, grid: &mut Grid) {
        let steps = grid.kind.steps();
        let before = positions(grid);
        let along = |vertex: Vertex, step: Vertex| {
            let ahead = before.get(&(vertex + step)).map(|next| *next - before[&vertex]);
            ahead.or_else(|| before.get(&(vertex - step)).map(|last| before[&vertex] - *last))
        };
        for corner in &mut grid.corners {
            let vertex = Vertex::new(corner.row, corner.col);
            let way =
                [0, 1].map(|i| along(vertex, steps[i]).unwrap_or(DVec2::ZERO) * self.offset[i]);
            corner.move_to(corner.position() - way[0] - way[1]);
        }
    }

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
    /// Its direction on the print, radians.
    across_rad: f64,
}

fn positions(grid: &Grid) -> BTreeMap<Vertex, DVec2> {
    let corners = grid.corners.iter();
    corners.map(|corner| (Vertex::new(corner.row, corner.col), corner.position())).collect()
}

/// Returns edges of a grid from all over it.
fn measured_edges(grid: &Grid) -> Vec<MeasuredEdge> {
    let corners = positions(grid);
    let steps = grid.kind.steps();
    let (half, quarter) = (steps.len() / 2, steps.len() / 4);
    let edge = |(vertex, from, k): (Vertex, DVec2, usize)| {
        let along = *corners.get(&(vertex + steps[k]))? - from;
        // On either side: a corner of the same tile.
        let beside = [(k + quarter, 0.5 * PI), (k + steps.len() - quarter, -0.5 * PI)]
            .map(|(side, turn)| Some((corners.get(&(vertex + steps[side % steps.len()]))?, turn)));
        let (beside, turn) = beside.into_iter().flatten().next()?;
        let beside = beside - from;
        let across_rad = PI * k as f64 / half as f64 + turn;
        let across = match grid.kind {
            GridKind::Deltille => (beside - along / 2.0) / ROW_HEIGHT,
            GridKind::Checker => beside,
        };
        Some(MeasuredEdge { from, along, across, across_rad })
    };
    let all = corners.iter().flat_map(|(&vertex, &from)| (0..half).map(move |k| (vertex, from, k)));
    let edges: Vec<MeasuredEdge> = all.filter_map(edge).collect();
    let every = edges.len().div_ceil(MAX_EDGES).max(1);
    edges.into_iter().step_by(every).collect()
}

fn shift_of_grid(image: ImageView, grid: &Grid) -> Option<EdgeShift> {
    let measured = |edge: &MeasuredEdge| {
        let displacement = displacement_of_edge(image, edge, 0.5, grid.kind)?;
        let turn = if displacement.is_backwards { PI } else { 0.0 };
        Some((displacement.to_bright, edge.across_rad + turn))
    };
    let shifts: Vec<(f64, f64)> = measured_edges(grid).iter().filter_map(measured).collect();
    let edge_px = grid.edge_px()?;
    let is_measured = shifts.len() >= MIN_EDGES;
    let edges = median(shifts.iter().map(|(shift, _)| *shift).collect()).filter(|_| is_measured)?;
    let offset = match grid.kind {
        GridKind::Deltille => offset(&shifts),
        // The edges of a line lie on both sides of it in turn.
        GridKind::Checker => [0.0; 2],
    };
    Some(EdgeShift { edges, px: edges.abs() * edge_px, offset, kind: grid.kind })
}

/// Returns the displacement of corners along the first two steps of a triangular lattice from the shifts of edges towards
/// directions on the print, of which there are three, 120° apart.
fn offset(shifts: &[(f64, f64)]) -> [f64; 2] {
    let third = |rad: f64| (rad / (2.0 * PI / 3.0)).floor().rem_euclid(3.0) as usize;
    let way: DVec2 = (0..3)
        .map(|k| {
            let some = || shifts.iter().filter(|(_, rad)| third(*rad) == k);
            let direction = some().next().map_or(DVec2::ZERO, |(_, rad)| DVec2::from_angle(*rad));
            let shift = median(some().map(|(shift, _)| *shift).collect()).unwrap_or(0.0);
            direction * (-2.0 / 3.0 * shift)
        })
        .sum();
    let second = way.y / ROW_HEIGHT;
    [way.x - second / 2.0, second]
}

/// The step across an edge.
struct Displacement {
    /// Towards its bright side, as a fraction of the edge length.
    to_bright: f64,
    /// Whether the bright side is opposite to the direction across the edge.
    is_backwards: bool,
}

fn shift_of_edge(image: ImageView, edge: &MeasuredEdge, part: f64, kind: GridKind) -> Option<f64> {
    displacement_of_edge(image, edge, part, kind).map(|displacement| displacement.to_bright)
}

/// Returns the displacement of the step across an edge at a fraction `part` of the edge.
fn displacement_of_edge(
    image: ImageView,
    edge: &MeasuredEdge,
    part: f64,
    kind: GridKind,
) -> Option<Displacement> {
    let MeasuredEdge { from, along, across, .. } = *edge;
    let middle = from + part * along;
    let reach = match kind {
        GridKind::Deltille => MAX_SHIFT * ROW_HEIGHT,
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
    let is_backwards = !is_bright(&profile[at]);
    Some(Displacement { to_bright: if is_backwards { -position } else { position }, is_backwards })
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

    /// Each of three edges seems to have moved by another distance if the corner between them is displaced.
    #[test]
    fn displaced_corners_are_found_by_three_edges() {
        let displaced = DVec2::new(0.08, -0.03);
        let directions = [-0.5, 5.0 / 6.0, 1.0 / 6.0].map(|part| PI * part);
        let seen = directions.map(|rad| (-0.1 - DVec2::from_angle(rad).dot(displaced), rad));
        let [first, second] = offset(&seen);
        let found = GridKind::Deltille.position(second, first);
        assert!(found.distance(displaced) < 1e-12, "{found}");
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
