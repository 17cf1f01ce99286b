//! Predicts positions far from a grid, as if board and image were planes.
//!
//! ```text
//!     x(p) = (a + B p) / (1 + w · p)
//! ```
//!
//! is fitted to all corners, where p are positions of columns and rows ([`Spacing`]) relative to the size of the grid.
//! Unlike a Taylor series ([`LocalMap`]), it follows any perspective. Distortion and curl remain in the residuals.
//! Beyond the grid, their effect grows by one power of the distance more than that of noise, so the standard deviation
//! is multiplied by the distance.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

use super::local_map::{LocalMap, Shape};
use deltille_core::lattice::Vertex;

/// Number of parameters of the map.
const PARAMS: usize = 8;

/// Minimum number of corners: two equations of each leave half as many degrees of freedom as there are parameters.
const LEAST: usize = 6;

/// Number of linear fits; each uses the denominators of the one before as weights.
const FITS: usize = 3;

/// Smallest denominator of a visible position. At 0, the board is seen edge-on.
const MIN_DENOMINATOR: f64 = 0.1;

/// The homography of a grid.
#[derive(Clone, Debug)]
pub(crate) struct PlaneMap {
    /// A vertex of the grid, and the middle of all relative to it and their RMS distance from the middle, in mean
    /// spacings.
    origin: Vertex,
    middle: DVec2,
    size: f64,
    /// a, the rows of B, and w; positions in px relative to `place`.
    params: SVector<f64, PARAMS>,
    place: DVec2,
    /// Covariance of the parameters.
    cov: SMatrix<f64, PARAMS, PARAMS>,
    shape: Shape,
}

/// Derivatives of x and y by the parameters at p, times the denominator, given the position.
fn equations(p: DVec2, at: DVec2) -> [SVector<f64, PARAMS>; 2] {
    let DVec2 { x: u, y: v } = p;
    [
        [1.0, u, v, 0.0, 0.0, 0.0, -u * at.x, -v * at.x].into(),
        [0.0, 0.0, 0.0, 1.0, u, v, -u * at.y, -v * at.y].into(),
    ]
}

impl PlaneMap {
    /// Fits the map to the corners of a grid: their vertices and positions. Returns `None` if they are too few or nearly
    /// collinear.
    pub(crate) fn of(corners: &[(Vertex, DVec2)], shape: Shape) -> Option<Self> {
        if corners.len() < LEAST {
            return None;
        }
        let (origin, _) = corners[0];
        let count = corners.len() as f64;
        let ways: Vec<DVec2> =
            corners.iter().map(|&(v, _)| shape.spacing.way(origin, v - origin)).collect();
        let middle = ways.iter().sum::<DVec2>() / count;
        let size =
            (ways.iter().map(|way| way.distance_squared(middle)).sum::<f64>() / count).sqrt();
        let place = corners.iter().map(|(_, place)| place).sum::<DVec2>() / count;
        let points: Vec<(DVec2, DVec2)> = ways
            .iter()
            .zip(corners)
            .map(|(way, (_, at))| ((way - middle) / size, at - place))
            .collect();
        let (mut params, mut inverse) = (SVector::zeros(), SMatrix::zeros());
        for _ in 0..FITS {
            let mut normal = SMatrix::<f64, PARAMS, PARAMS>::zeros();
            let mut right = SVector::<f64, PARAMS>::zeros();
            for &(p, at) in &points {
                let weight = denominator(&params, p).powi(-2);
                for (row, value) in equations(p, at).into_iter().zip([at.x, at.y]) {
                    normal += weight * row * row.transpose();
                    right += weight * value * row;
                }
            }
            let solver = normal.cholesky()?;
            params = solver.solve(&right);
            if points.iter().any(|&(p, _)| denominator(&params, p) < MIN_DENOMINATOR) {
                return None;
            }
            inverse = solver.inverse();
        }
        let squares: f64 =
            points.iter().map(|&(p, at)| position(&params, p).distance_squared(at)).sum();
        let freedom = (2 * points.len() - PARAMS) as f64;
        let cov = inverse * (squares / freedom).max(shape.place_px().powi(2));
        Some(Self { origin, middle, size, params, place, cov, shape })
    }

    /// Returns the position of a vertex, px.
    pub(crate) fn place(&self, vertex: Vertex) -> DVec2 {
        let way = self.shape.spacing.way(self.origin, vertex - self.origin);
        self.place + position(&self.params, (way - self.middle) / self.size)
    }

    /// Returns the map about a vertex; `None` if it is not in front of the camera.
    pub(crate) fn about(&self, vertex: Vertex) -> Option<LocalMap> {
        let way = self.shape.spacing.way(self.origin, vertex - self.origin);
        let p = (way - self.middle) / self.size;
        let below = denominator(&self.params, p);
        if below < MIN_DENOMINATOR {
            return None;
        }
        let at = position(&self.params, p);
        let [_, bxu, bxv, _, byu, byv, wu, wv] = self.params.into();
        let jacobian = [(bxu, byu, wu), (bxv, byv, wv)]
            .map(|(x, y, w)| (DVec2::new(x, y) - w * at) / (below * self.size));
        let variance: f64 =
            equations(p, at).iter().map(|row| (self.cov * row).dot(row)).sum::<f64>() / 2.0;
        let edge_px = (jacobian[0].length() + jacobian[1].length()) / 2.0;
        let sigma = variance.sqrt() / below * p.length().max(1.0) / edge_px;
        Some(LocalMap::new(self.place + at, jacobian, vertex, self.shape.spacing, sigma))
    }

    /// Returns the vertex nearest to a position, px.
    pub(crate) fn nearest(&self, place: DVec2) -> Option<Vertex> {
        let at = place - self.place;
        let [ax, bxu, bxv, ay, byu, byv, wu, wv] = self.params.into();
        // (B − at wᵀ) p = at − a.
        let [u, v] = [DVec2::new(bxu, byu) - wu * at, DVec2::new(bxv, byv) - wv * at];
        let determinant = u.perp_dot(v);
        let off = at - DVec2::new(ax, ay);
        let p = DVec2::new(off.perp_dot(v), u.perp_dot(off)) / determinant;
        if !p.is_finite() || denominator(&self.params, p) < MIN_DENOMINATOR {
            return None;
        }
        let steps = self.shape.spacing.steps(self.origin, p * self.size + self.middle);
        Some(self.origin + Vertex::new(steps.y.round() as i32, steps.x.round() as i32))
    }
}

fn denominator(params: &SVector<f64, PARAMS>, p: DVec2) -> f64 {
    1.0 + params[6] * p.x + params[7] * p.y
}

fn position(params: &SVector<f64, PARAMS>, p: DVec2) -> DVec2 {
    let row = |i: usize| params[i] + params[i + 1] * p.x + params[i + 2] * p.y;
    DVec2::new(row(0), row(3)) / denominator(params, p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::map::spacing::Spacing;
    use crate::tiling::kind;

    /// A steep view of a lattice through a lens with distortion.
    fn seen(v: Vertex) -> DVec2 {
        let DVec2 { x, y } = kind::<6>().position(v.row.into(), v.col.into());
        let depth = 1.0 + 0.03 * x - 0.02 * y;
        let off = DVec2::new(40.0 * x / depth, -40.0 * y / depth);
        DVec2::new(500.0, 400.0) + off * (1.0 - 1e-7 * off.length_squared())
    }

    #[test]
    fn far_predictions_are_within_their_uncertainty() {
        let square = (-2..=2).flat_map(|row| (-3..=3).map(move |col| Vertex::new(row, col)));
        let corners: Vec<_> = square.map(|v| (v, seen(v))).collect();
        let map = PlaneMap::of(&corners, Shape::usual(Spacing::EQUAL)).unwrap();
        for far in 4..12 {
            let vertex = Vertex::new(far / 2, far);
            let about = map.about(vertex).unwrap();
            let off = about.distance::<6>(seen(vertex)).unwrap();
            assert!(off < 3.0 * about.sigma, "{off} at {far}, σ {}", about.sigma);
            if about.sigma < 0.08 {
                assert_eq!(map.nearest(seen(vertex)), Some(vertex));
            }
        }
        // The prediction is not vacuous.
        assert!(map.about(Vertex::new(0, 8)).unwrap().sigma < 0.08);
    }

    #[test]
    fn corners_in_a_line_have_no_plane() {
        let corners: Vec<_> =
            (0..9).map(|col| (Vertex::new(0, col), seen(Vertex::new(0, col)))).collect();
        assert!(PlaneMap::of(&corners, Shape::usual(Spacing::EQUAL)).is_none());
    }
}
