//! Predicts the position of an unseen vertex from the corners around it.
//!
//! About the vertex at (0, 0), a view of a board is a smooth map of lattice coordinates p = (col, row):
//!
//! ```text
//!     x(p) = x₀ + J p + ½ pᵀ H p + O(|p|³)
//! ```
//!
//! fitted to the nearest corners. All lengths are in edges of the board as seen here. Three corners in a line give the
//! size of the second derivatives ([`Bend`]). The weight of a corner decreases with the displacement that third
//! derivatives may cause. So x₀ has a standard deviation for any number and arrangement of corners. A few corners on
//! one side predict little, and the standard deviation is large.

use std::sync::LazyLock;

use glam::DVec2;
use nalgebra::{Matrix6, Vector6};

use crate::tiling::kind;
use deltille_core::lattice::{GridKind, Vertex};

/// Standard deviation of the second derivatives, in edges, of a grid that shows no bend. Over one
/// tile, a steep view or a wide lens changes the next edge by this much (1σ).
const TYPICAL_BEND: f64 = 0.1;

/// Weight of [`TYPICAL_BEND`] in lines of three corners.
const TYPICAL_WEIGHT: f64 = 0.25;

/// Information, in edges⁻², that is less than a billionth of that of a corner.
const NO_PRIOR: f64 = 1e-9;

/// Standard deviation of a corner from the smooth map, px of its level. Fits are at least this
/// accurate.
const PLACE_PX: f64 = 0.3;

/// Maximum number of fitted corners. Further ones are farther away and contribute little.
const MOST: usize = 20;

/// Half the side of the square of vertices that is searched.
const REACH: i32 = 5;

/// Steps to all vertices of that square with their lengths on the print, shortest first.
static STEPS: LazyLock<[Vec<(f64, Vertex)>; 2]> = LazyLock::new(|| {
    [GridKind::Deltille, GridKind::Checker].map(|kind| {
        let offsets = (-REACH..=REACH).flat_map(|r| (-REACH..=REACH).map(move |c| (r, c)));
        let mut steps: Vec<(f64, Vertex)> = offsets
            .map(|(row, col)| (length(kind, Vertex::new(row, col)), Vertex::new(row, col)))
            .collect();
        steps.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        steps
    })
});

/// Returns the length of a step on the print, in edges.
fn length(kind: GridKind, step: Vertex) -> f64 {
    let way = kind.position(step.row.into(), step.col.into());
    way.x.hypot(way.y)
}

/// Bend of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    /// Standard deviation of the second derivatives, in edges.
    second: f64,
    /// Standard deviation of a corner, px.
    place_px: f64,
}

impl Bend {
    /// Returns the bend of a grid of few corners.
    pub(crate) fn usual() -> Self {
        Self { second: TYPICAL_BEND, place_px: PLACE_PX }
    }

    /// Returns the bend of a grid of corners with N rays. `at` returns their positions, found on levels up to `level`.
    pub(crate) fn of<const N: usize>(
        vertices: impl Iterator<Item = Vertex>,
        at: impl Fn(Vertex) -> Option<DVec2>,
        level: usize,
    ) -> Self {
        let (mut sum, mut count) = (TYPICAL_WEIGHT * TYPICAL_BEND * TYPICAL_BEND, TYPICAL_WEIGHT);
        for vertex in vertices {
            for step in &kind::<N>().steps()[..N / 2] {
                let line = [vertex - *step, vertex, vertex + *step].map(&at);
                let [Some(a), Some(b), Some(c)] = line else {
                    continue;
                };
                let edge = (c.x - a.x).hypot(c.y - a.y) / 2.0;
                let second = a - 2.0 * b + c;
                let second = second.x.hypot(second.y);
                sum += (second / edge).powi(2);
                count += 1.0;
            }
        }
        Self { second: (sum / count).sqrt(), place_px: PLACE_PX * f64::from(1u32 << level) }
    }
}

/// The map about a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalMap {
    /// Position of the vertex, px.
    pub place: DVec2,
    /// Derivatives of the position, px per step along a row and from row to row: columns.
    pub jacobian: [DVec2; 2],
    /// Standard deviation of the position, in edges.
    pub sigma: f64,
}

impl LocalMap {
    /// Returns the map about `vertex` of corners with N rays, whose positions `at` returns; `None` if they are
    /// collinear.
    pub(crate) fn about<const N: usize>(
        vertex: Vertex,
        at: impl Fn(Vertex) -> Option<DVec2>,
        bend: Bend,
    ) -> Option<Self> {
        let steps = match kind::<N>() {
            GridKind::Deltille => &STEPS[0],
            GridKind::Checker => &STEPS[1],
        };
        let known = steps.iter().filter_map(|&(far, step)| Some((far, step, at(vertex + step)?)));
        let known: Vec<(f64, Vertex, DVec2)> = known.take(MOST).collect();
        let edge_px = edge_px(&known, |step| length(kind::<N>(), step))?;
        // Prior of the second derivatives. The others have almost none, just enough to solve the equations of collinear
        // corners.
        let mut normal = Matrix6::from_diagonal(&Vector6::from_fn(|i, _| match i {
            0..3 => NO_PRIOR,
            _ => bend.second.powi(-2),
        }));
        let mut right = [Vector6::zeros(); 2];
        let origin = known.first()?.2;
        for (distance, step, place) in known {
            let (c, r) = (f64::from(step.col), f64::from(step.row));
            let phi = Vector6::new(1.0, c, r, 0.5 * c * c, c * r, 0.5 * r * r);
            // Third derivatives are of the order of the square of the second ones; Taylor's term has d³/3!.
            let sigma = bend.place_px / edge_px + bend.second.powi(2) * distance.powi(3) / 6.0;
            let weight = sigma.powi(-2);
            normal += weight * phi * phi.transpose();
            for k in 0..2 {
                right[k] += weight * ((place[k] - origin[k]) / edge_px) * phi;
            }
        }
        let solver = normal.cholesky()?;
        let [x, y] = right.map(|right| edge_px * solver.solve(&right));
        // For collinear corners, only the prior determines the map away from the line.
        let mut unit = Vector6::zeros();
        unit[0] = 1.0;
        let variance = solver.solve(&unit)[0];
        let across = [1, 2].map(|i| {
            let mut unit = Vector6::zeros();
            unit[i] = 1.0;
            solver.solve(&unit)[i]
        });
        (across.into_iter().all(|variance| variance < 1.0)).then_some(Self {
            place: origin + DVec2::new(x[0], y[0]),
            jacobian: [DVec2::new(x[1], y[1]), DVec2::new(x[2], y[2])],
            sigma: variance.sqrt(),
        })
    }

    /// Returns the direction of a lattice step, px.
    pub(crate) fn along(&self, step: Vertex) -> DVec2 {
        let [col, row] = self.jacobian;
        f64::from(step.col) * col + f64::from(step.row) * row
    }

    /// Returns the lattice coordinates (col, row) of a position, relative to the vertex; to first order.
    pub(crate) fn steps_to(&self, place: DVec2) -> Option<DVec2> {
        let [col, row] = self.jacobian;
        let determinant = col.perp_dot(row);
        let off = place - self.place;
        (determinant != 0.0).then(|| DVec2::new(off.perp_dot(row), col.perp_dot(off)) / determinant)
    }

    /// Returns the distance of a position from the vertex in edges of the print; to first order.
    pub(crate) fn distance<const N: usize>(&self, place: DVec2) -> Option<f64> {
        let DVec2 { x: col, y: row } = self.steps_to(place)?;
        let way = kind::<N>().position(row, col);
        Some(way.x.hypot(way.y))
    }
}

/// Returns the mean length of an edge among known corners, px.
fn edge_px(known: &[(f64, Vertex, DVec2)], distance: impl Fn(Vertex) -> f64) -> Option<f64> {
    let (_, first, at) = *known.first()?;
    let others = || known.iter().skip(1);
    let px: f64 = others().map(|(.., p)| (p.x - at.x).hypot(p.y - at.y)).sum();
    let edges: f64 = others().map(|&(_, v, _)| distance(v - first)).sum();
    (edges > 0.0 && px > 0.0).then(|| px / edges)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steep view of a lattice.
    fn seen(v: Vertex) -> DVec2 {
        let DVec2 { x, y } = kind::<6>().position(v.row.into(), v.col.into());
        let depth = 1.0 + 0.05 * x - 0.03 * y;
        DVec2::new(500.0 + 40.0 * x / depth, 400.0 - 40.0 * y / depth)
    }

    fn bend(known: impl Fn(Vertex) -> Option<DVec2>) -> Bend {
        let square = (-5..=5).flat_map(|row| (-5..=5).map(move |col| Vertex::new(row, col)));
        Bend::of::<6>(square, known, 0)
    }

    #[test]
    fn prediction_errors_match_the_stated_uncertainty() {
        for beyond in 1..=3 {
            let known = |v: Vertex| (v.col <= 0 && v.row.abs() < 4).then(|| seen(v));
            let vertex = Vertex::new(0, beyond);
            let map = LocalMap::about::<6>(vertex, known, bend(known)).unwrap();
            let off = map.distance::<6>(seen(vertex)).unwrap();
            assert!(off < 2.0 * map.sigma, "{off} at {beyond}, σ {}", map.sigma);
            // Uncertainty due to the bend grows with the square of the distance.
            assert!(map.sigma < 0.06 * f64::from(beyond).powi(2), "σ {} at {beyond}", map.sigma);
        }
    }

    #[test]
    fn corners_in_a_line_predict_nothing() {
        let known = |v: Vertex| (v.row == 0 && v.col < 0).then(|| seen(v));
        assert!(LocalMap::about::<6>(Vertex::new(0, 0), known, bend(known)).is_none());
    }
}
