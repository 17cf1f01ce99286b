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
pub(crate) const MAX_SHIFT: f64 = 0.3;

/// Maximum median deviation of the middle of an edge from two places beside it, as a fraction of its length. A disc that
/// reaches its diagonal neighbours has 0.046 on a checkerboard, and one that reaches its neighbours 0.053 on a deltille
/// board.
const MAX_BOW: f64 = 0.025;

/// Distance of these places from the ends of an edge, as a fraction of its length. A triangle whose edges have moved by
/// 0.1 is too narrow to be measured at a quarter.
const fn bow_place(kind: GridKind) -> f64 {
    match kind {
        GridKind::Deltille => 1.0 / 3.0,
        GridKind::Checker => 0.25,
    }
}

/// Number of times that corners are moved between their edges. Each edge depends on the corners at both ends.
const CENTRINGS: usize = 4;

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

/// Moves the corners of a deltille grid between their edges: three edges that have moved cross in three points, each of
/// which may be taken for the corner, at twice the shift from it. No corner is moved by more than that for a `shift`, as a
/// fraction of the edge length. The edges of a checkerboard lie on both sides of a line in turn and need none of this.
pub(crate) fn centre(image: ImageView, grid: &mut Grid, shift: f64) {
    if grid.kind == GridKind::Checker {
        return;
    }
    let steps = grid.kind.steps();
    for _ in 0..CENTRINGS {
        let mut shifts: BTreeMap<Vertex, Vec<(f64, f64)>> = BTreeMap::new();
        for edge in edges(grid) {
            let shift = edge.shift(image);
            for end in edge.ends {
                shifts.entry(end).or_default().extend(shift);
            }
        }
        let is_near = |&[first, second]: &[f64; 2]| {
            grid.kind.position(second, first).length() <= gap(grid.kind) * shift.abs()
        };
        let common = offset(shifts.values().flatten()).filter(is_near);
        let before = positions(grid);
        let along = |vertex: Vertex, step: Vertex| {
            let ahead = before.get(&(vertex + step)).map(|next| *next - before[&vertex]);
            ahead.or_else(|| before.get(&(vertex - step)).map(|last| before[&vertex] - *last))
        };
        for corner in &mut grid.corners {
            let vertex = Vertex::new(corner.row, corner.col);
            let here = shifts.get(&vertex).and_then(|shifts| offset(shifts.iter()));
            let here = here.filter(is_near);
            let Some(offset) = here.or(common) else { continue };
            let way = [0, 1].map(|i| along(vertex, steps[i]).unwrap_or(DVec2::ZERO) * offset[i]);
            corner.move_to(corner.position() - way[0] - way[1]);
        }
    }
}

/// Returns whether the edges of an untagged grid are straight. Dots that touch diagonally look like squares that have
/// grown or shrunk, but their outlines are round.
pub(crate) fn has_straight_edges(image: ImageView, grid: &Grid) -> bool {
    let beside = bow_place(grid.kind);
    let bow = |edge: Edge| {
        let [first, middle, last] =
            [beside, 0.5, 1.0 - beside].map(|part| Some(edge.displacement(image, part)?.to_bright));
        Some(middle? - (first? + last?) / 2.0)
    };
    let bows: Vec<f64> = some_edges(grid).filter_map(bow).collect();
    let is_measured = bows.len() >= MIN_EDGES;
    is_measured && median(bows).is_some_and(|bow| bow.abs() < MAX_BOW)
}

/// An edge of a tile.
struct Edge {
    kind: GridKind,
    ends: [Vertex; 2],
    from: DVec2,
    along: DVec2,
    /// Image of the direction that is perpendicular to the edge on the print, as long as the edge there.
    across: DVec2,
    /// Its direction on the print, radians.
    across_rad: f64,
}

/// Returns the corners of a grid by their vertices.
pub(crate) fn positions(grid: &Grid) -> BTreeMap<Vertex, DVec2> {
    let corners = grid.corners.iter();
    corners.map(|corner| (Vertex::new(corner.row, corner.col), corner.position())).collect()
}

/// Returns all edges of a grid with a tile beside them.
fn edges(grid: &Grid) -> Vec<Edge> {
    let corners = positions(grid);
    let steps = grid.kind.steps();
    let (half, quarter) = (steps.len() / 2, steps.len() / 4);
    let edge = |(vertex, from, k): (Vertex, DVec2, usize)| {
        let ends = [vertex, vertex + steps[k]];
        let along = *corners.get(&ends[1])? - from;
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
        Some(Edge { kind: grid.kind, ends, from, along, across, across_rad })
    };
    let all = corners.iter().flat_map(|(&vertex, &from)| (0..half).map(move |k| (vertex, from, k)));
    all.filter_map(edge).collect()
}

/// Returns some edges of a grid from all over it.
fn some_edges(grid: &Grid) -> impl Iterator<Item = Edge> {
    let edges = edges(grid);
    let every = edges.len().div_ceil(MAX_EDGES).max(1);
    edges.into_iter().step_by(every)
}

fn shift_of_grid(image: ImageView, grid: &Grid) -> Option<EdgeShift> {
    let shifts: Vec<f64> = some_edges(grid).filter_map(|edge| Some(edge.shift(image)?.0)).collect();
    let edge_px = grid.edge_px()?;
    let is_measured = shifts.len() >= MIN_EDGES;
    let edges = median(shifts).filter(|_| is_measured)?;
    Some(EdgeShift { edges, px: edges.abs() * edge_px, kind: grid.kind })
}

/// Returns the displacement of corners along the first two steps of a triangular lattice from the shifts of edges towards
/// directions on the print, of which there are three, 120° apart; `None` if one of them is missing.
fn offset<'a>(shifts: impl Iterator<Item = &'a (f64, f64)>) -> Option<[f64; 2]> {
    let mut by_direction: [(f64, Vec<f64>); 3] = Default::default();
    for &(shift, rad) in shifts {
        let third = (rad / (2.0 * PI / 3.0)).floor().rem_euclid(3.0) as usize;
        by_direction[third].0 = rad;
        by_direction[third].1.push(shift);
    }
    let mut way = DVec2::ZERO;
    for (rad, shifts) in by_direction {
        way -= DVec2::from_angle(rad) * (2.0 / 3.0 * median(shifts)?);
    }
    let second = way.y / ROW_HEIGHT;
    Some([way.x - second / 2.0, second])
}

impl Edge {
    /// Returns the shift of the middle of the edge, as a fraction of its length, and its direction on the print, radians.
    fn shift(&self, image: ImageView) -> Option<(f64, f64)> {
        let Displacement { to_bright, is_backwards } = self.displacement(image, 0.5)?;
        Some((to_bright, self.across_rad + if is_backwards { PI } else { 0.0 }))
    }

    /// Returns the displacement of the step across the edge at a fraction `part` of it.
    fn displacement(&self, image: ImageView, part: f64) -> Option<Displacement> {
        let Self { kind, from, along, across, .. } = *self;
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
        Some(Displacement {
            to_bright: if is_backwards { -position } else { position },
            is_backwards,
        })
    }
}

/// The step across an edge.
struct Displacement {
    /// Towards its bright side, as a fraction of the edge length.
    to_bright: f64,
    /// Whether the bright side is opposite to the direction across the edge.
    is_backwards: bool,
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
        let [first, second] = offset(seen.iter()).unwrap();
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
