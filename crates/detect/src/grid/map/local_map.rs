//! Predicts the position of an unseen vertex from the corners around it.
//!
//! About the vertex at (0, 0), a view of a board is a smooth map of p, the positions of columns and rows ([`Spacing`]):
//!
//! ```text
//!     x(p) = x₀ + J p + ½ pᵀ H p + O(|p|³)
//! ```
//!
//! fitted to the nearest corners. All lengths are in edges of the board as seen here. Three corners in a line give the
//! size of the second derivatives ([`Shape`]). The weight of a corner decreases with the displacement that third
//! derivatives may cause. So x₀ has a standard deviation for any number and arrangement of corners. A few corners on
//! one side predict little, and the standard deviation is large.

use std::sync::LazyLock;

use glam::DVec2;
use nalgebra::{Matrix6, Vector6};

use super::spacing::Spacing;
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

/// Steps to all vertices of that square, those that are shortest with equal spacing first.
static STEPS: LazyLock<[Vec<Vertex>; 2]> = LazyLock::new(|| {
    [GridKind::Deltille, GridKind::Checker].map(|kind| {
        let offsets = (-REACH..=REACH).flat_map(|r| (-REACH..=REACH).map(move |c| (r, c)));
        let mut steps: Vec<Vertex> = offsets.map(|(row, col)| Vertex::new(row, col)).collect();
        let far = |step: &Vertex| length(kind, DVec2::new(step.col.into(), step.row.into()));
        steps.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
        steps
    })
});

/// Returns the length on the print of a displacement along columns and rows, in edges.
fn length(kind: GridKind, DVec2 { x: col, y: row }: DVec2) -> f64 {
    let way = kind.position(row, col);
    way.x.hypot(way.y)
}

/// Spacing and bend of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Spacing of its rows and columns.
    pub spacing: Spacing,
    /// Standard deviation of the second derivatives, in edges.
    second: f64,
    /// Standard deviation of a corner, px.
    place_px: f64,
}

impl Shape {
    /// Returns the shape of a grid of few corners.
    pub(crate) fn usual(spacing: Spacing) -> Self {
        Self { spacing, second: TYPICAL_BEND, place_px: PLACE_PX }
    }

    /// Returns the shape of a grid of corners with N rays. `at` returns their positions, found on levels up to `level`.
    pub(crate) fn of<const N: usize>(
        vertices: impl Iterator<Item = Vertex> + Clone,
        at: impl Fn(Vertex) -> Option<DVec2>,
        level: usize,
    ) -> Self {
        let spacing = Spacing::of(kind::<N>(), vertices.clone(), &at);
        let (mut sum, mut count) = (TYPICAL_WEIGHT * TYPICAL_BEND * TYPICAL_BEND, TYPICAL_WEIGHT);
        for vertex in vertices {
            for step in &kind::<N>().steps()[..N / 2] {
                let line = [vertex - *step, vertex, vertex + *step].map(&at);
                let [Some(a), Some(b), Some(c)] = line else {
                    continue;
                };
                let edge = (c.x - a.x).hypot(c.y - a.y) / 2.0;
                let before = spacing.width(vertex - *step, *step);
                let after = spacing.width(vertex, *step);
                let second = 2.0 * ((a - b) / before + (c - b) / after) / (before + after);
                let second = second.x.hypot(second.y);
                sum += (second / edge).powi(2);
                count += 1.0;
            }
        }
        let place_px = PLACE_PX * f64::from(1u32 << level);
        Self { spacing, second: (sum / count).sqrt(), place_px }
    }

    /// Returns the standard deviation of a corner, px.
    pub(super) fn place_px(self) -> f64 {
        self.place_px
    }
}

/// The map about a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalMap {
    /// Position of the vertex, px.
    pub place: DVec2,
    /// Derivatives of the position, px per mean step along a row and from row to row: columns.
    jacobian: [DVec2; 2],
    /// The vertex, and the spacing of the rows and columns around it.
    vertex: Vertex,
    spacing: Spacing,
    /// Standard deviation of the position, in edges.
    pub sigma: f64,
}

impl LocalMap {
    /// Creates a map from a position, its derivatives, px per mean step, and its standard deviation in edges.
    pub(super) fn new(
        place: DVec2,
        jacobian: [DVec2; 2],
        vertex: Vertex,
        spacing: Spacing,
        sigma: f64,
    ) -> Self {
        Self { place, jacobian, vertex, spacing, sigma }
    }

    /// Returns the map about `vertex` of corners with N rays, whose positions `at` returns; `None` if they are
    /// collinear.
    pub(crate) fn about<const N: usize>(
        vertex: Vertex,
        at: impl Fn(Vertex) -> Option<DVec2>,
        Shape { spacing, second, place_px }: Shape,
    ) -> Option<Self> {
        let steps = match kind::<N>() {
            GridKind::Deltille => &STEPS[0],
            GridKind::Checker => &STEPS[1],
        };
        let known = steps.iter().filter_map(|&step| Some((step, at(vertex + step)?)));
        let known = known.map(|(step, place)| (spacing.way(vertex, step), place));
        let known: Vec<(DVec2, DVec2)> = known.take(MOST).collect();
        let edge_px = edge_px(&known, |way| length(kind::<N>(), way))?;
        // Prior of the second derivatives. The others have almost none, just enough to solve the equations of collinear
        // corners.
        let mut normal = Matrix6::from_diagonal(&Vector6::from_fn(|i, _| match i {
            0..3 => NO_PRIOR,
            _ => second.powi(-2),
        }));
        let mut right = [Vector6::zeros(); 2];
        let origin = known.first()?.1;
        for (way, place) in known {
            let (DVec2 { x: c, y: r }, distance) = (way, length(kind::<N>(), way));
            let phi = Vector6::new(1.0, c, r, 0.5 * c * c, c * r, 0.5 * r * r);
            // Third derivatives are of the order of the square of the second ones; Taylor's term has d³/3!.
            let sigma = place_px / edge_px + second.powi(2) * distance.powi(3) / 6.0;
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
            vertex,
            spacing,
            sigma: variance.sqrt(),
        })
    }

    /// Returns the direction of a lattice step, px.
    pub(crate) fn along(&self, step: Vertex) -> DVec2 {
        let [col, row] = self.jacobian;
        let way = self.spacing.way(self.vertex, step);
        way.x * col + way.y * row
    }

    /// Returns the lattice coordinates (col, row) of a position, relative to the vertex; to first order.
    pub(crate) fn steps_to(&self, place: DVec2) -> Option<DVec2> {
        Some(self.spacing.steps(self.vertex, self.way_to(place)?))
    }

    /// Returns the displacement of a position from the vertex along columns and rows, in edges; to first order.
    fn way_to(&self, place: DVec2) -> Option<DVec2> {
        let [col, row] = self.jacobian;
        let determinant = col.perp_dot(row);
        let off = place - self.place;
        (determinant != 0.0).then(|| DVec2::new(off.perp_dot(row), col.perp_dot(off)) / determinant)
    }

    /// Returns the distance of a position from the vertex in edges of the print; to first order.
    pub(crate) fn distance<const N: usize>(&self, place: DVec2) -> Option<f64> {
        Some(length(kind::<N>(), self.way_to(place)?))
    }
}

/// Returns the mean length of an edge among known corners, px.
fn edge_px(known: &[(DVec2, DVec2)], distance: impl Fn(DVec2) -> f64) -> Option<f64> {
    let (first, at) = *known.first()?;
    let others = || known.iter().skip(1);
    let px: f64 = others().map(|(_, p)| (p.x - at.x).hypot(p.y - at.y)).sum();
    let edges: f64 = others().map(|&(way, _)| distance(way - first)).sum();
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

    fn bend(known: impl Fn(Vertex) -> Option<DVec2>) -> Shape {
        let square = (-5..=5).flat_map(|row| (-5..=5).map(move |col| Vertex::new(row, col)));
        Shape::of::<6>(square, known, 0)
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
