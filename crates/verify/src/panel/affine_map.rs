//! Least-squares affine map from stated to found corner positions.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

/// `found = linear · stated + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AffineMap {
    /// Row-major.
    pub linear: [[f64; 2]; 2],
    /// Translation, in the unit of the points.
    pub shift: DVec2,
}

impl AffineMap {
    pub(crate) const IDENTITY: AffineMap =
        AffineMap { linear: [[1.0, 0.0], [0.0, 1.0]], shift: DVec2::ZERO };

    /// Fits the map by least squares to pairs (stated, found). Returns `None` unless the stated points span the
    /// plane.
    pub(crate) fn fit(pairs: &[(DVec2, DVec2)]) -> Option<Self> {
        if pairs.len() < 3 {
            return None;
        }
        let centre = pairs.iter().map(|(stated, _)| stated).sum::<DVec2>() / pairs.len() as f64;
        let mut normal = Matrix3::zeros();
        let mut right = [Vector3::zeros(), Vector3::zeros()];
        for (stated, found) in pairs {
            let row = Vector3::new(stated.x - centre.x, stated.y - centre.y, 1.0);
            normal += row * row.transpose();
            right[0] += row * found.x;
            right[1] += row * found.y;
        }
        let inverse = normal.cholesky()?.inverse();
        let [x, y] = right.map(|r| inverse * r);
        let linear = [[x[0], x[1]], [y[0], y[1]]];
        let shift = [x, y].map(|row| row[2] - row[0] * centre.x - row[1] * centre.y);
        Some(Self { linear, shift: shift.into() })
    }

    pub(crate) fn apply(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        DVec2::from(self.linear.map(|[by_x, by_y]| by_x * x + by_y * y)) + self.shift
    }

    /// Returns the inverse map, `None` for a degenerate map.
    pub(crate) fn inverse(&self) -> Option<Self> {
        let [[a, b], [c, d]] = self.linear;
        let det = a * d - b * c;
        let linear = [[d / det, -b / det], [-c / det, a / det]];
        let back = Self { linear, shift: DVec2::ZERO };
        let shift = -back.apply(self.shift);
        (det != 0.0 && det.is_finite()).then_some(Self { linear, shift })
    }

    /// Returns the lengths of the images of the unit vectors: the scales along x and y.
    pub(crate) fn scales(&self) -> [f64; 2] {
        [0, 1].map(|i| self.linear[0][i].hypot(self.linear[1][i]))
    }

    /// Returns the counter-clockwise rotation of the mean of both axes, rad.
    pub(crate) fn rotation_rad(&self) -> f64 {
        let [[a, b], [c, d]] = self.linear;
        (c - b).atan2(a + d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scaled_rotated_and_shifted_grid_is_recovered() {
        let (scale, turn) = (0.99, 0.02_f64);
        let truth = AffineMap {
            linear: [
                [scale * turn.cos(), -scale * turn.sin()],
                [scale * turn.sin(), scale * turn.cos()],
            ],
            shift: DVec2::new(3.0, -4.0),
        };
        let stated = (0..12).map(|i| DVec2::new(f64::from(i % 4) * 20.0, f64::from(i / 4) * 17.0));
        let pairs: Vec<_> = stated.map(|p| (p, truth.apply(p))).collect();
        let fitted = AffineMap::fit(&pairs).unwrap();
        assert!((fitted.scales()[0] - scale).abs() < 1e-12);
        assert!((fitted.scales()[1] - scale).abs() < 1e-12);
        assert!((fitted.rotation_rad() - turn).abs() < 1e-12);
        assert!((fitted.shift.x - 3.0).abs() < 1e-9);
        assert!(AffineMap::fit(&pairs[..2]).is_none());
    }
}
