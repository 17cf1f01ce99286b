//! The affine map between where corners are stated and where they were found.

use nalgebra::{Matrix3, Vector3};

/// `found = linear · stated + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AffineMap {
    /// Row-major.
    pub linear: [[f64; 2]; 2],
    /// Translation, in the unit of the points.
    pub shift: [f64; 2],
}

impl AffineMap {
    pub const IDENTITY: AffineMap = AffineMap { linear: [[1.0, 0.0], [0.0, 1.0]], shift: [0.0; 2] };

    /// Least squares over pairs (stated, found); `None` unless three pairs span the plane.
    pub fn fit(pairs: &[([f64; 2], [f64; 2])]) -> Option<Self> {
        if pairs.len() < 3 {
            return None;
        }
        let n = pairs.len() as f64;
        let centre = |i: usize| pairs.iter().map(|(stated, _)| stated[i]).sum::<f64>() / n;
        let (cx, cy) = (centre(0), centre(1));
        let mut normal = Matrix3::zeros();
        let mut right = [Vector3::zeros(), Vector3::zeros()];
        for (stated, found) in pairs {
            let row = Vector3::new(stated[0] - cx, stated[1] - cy, 1.0);
            normal += row * row.transpose();
            right[0] += row * found[0];
            right[1] += row * found[1];
        }
        let inverse = normal.cholesky()?.inverse();
        let [x, y] = right.map(|r| inverse * r);
        let linear = [[x[0], x[1]], [y[0], y[1]]];
        let shift = [x[2] - x[0] * cx - x[1] * cy, y[2] - y[0] * cx - y[1] * cy];
        Some(Self { linear, shift })
    }

    pub fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.linear[i][0] * x + self.linear[i][1] * y + self.shift[i])
    }

    /// The map back; `None` of one that leaves no area.
    pub fn inverse(&self) -> Option<Self> {
        let [[a, b], [c, d]] = self.linear;
        let det = a * d - b * c;
        let linear = [[d / det, -b / det], [-c / det, a / det]];
        let back = Self { linear, shift: [0.0; 2] };
        let shift = back.apply(self.shift).map(|v| -v);
        (det != 0.0 && det.is_finite()).then_some(Self { linear, shift })
    }

    /// Lengths of the images of the unit vectors.
    pub fn scales(&self) -> [f64; 2] {
        [0, 1].map(|i| self.linear[0][i].hypot(self.linear[1][i]))
    }

    /// Counter-clockwise turn of the mean of both axes, radians.
    pub fn turn_rad(&self) -> f64 {
        let [[a, b], [c, d]] = self.linear;
        (c - b).atan2(a + d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scaled_turned_and_shifted_grid_is_recovered() {
        let (scale, turn) = (0.99, 0.02_f64);
        let truth = AffineMap {
            linear: [
                [scale * turn.cos(), -scale * turn.sin()],
                [scale * turn.sin(), scale * turn.cos()],
            ],
            shift: [3.0, -4.0],
        };
        let stated = (0..12).map(|i| [f64::from(i % 4) * 20.0, f64::from(i / 4) * 17.0]);
        let pairs: Vec<_> = stated.map(|p| (p, truth.apply(p))).collect();
        let fitted = AffineMap::fit(&pairs).unwrap();
        assert!((fitted.scales()[0] - scale).abs() < 1e-12);
        assert!((fitted.scales()[1] - scale).abs() < 1e-12);
        assert!((fitted.turn_rad() - turn).abs() < 1e-12);
        assert!((fitted.shift[0] - 3.0).abs() < 1e-9);
        assert!(AffineMap::fit(&pairs[..2]).is_none());
    }
}
