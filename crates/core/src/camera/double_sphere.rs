use glam::{DVec2, DVec3};

use super::extended_unified::{by_height, limit, quotient};
use super::law::{Imaged, LensLaw, Ray};
use crate::quantity::{self, Range};

/// Double sphere model (Usenko, Demmel and Cremers 2018):
///
/// ```text
///     d1 = √(X² + Y² + Z²),   γ = ξ d1 + Z,   d2 = √(X² + Y² + γ²)
///     h = α d2 + (1 − α) γ
///     (x', y') = (X, Y)/h
/// ```
///
/// Valid for 0 ≤ α ≤ 1 and |ξ| < 1, where Z > −w2 d1 with w2 = (w + ξ)/√(2 w ξ + ξ² + 1). Here w = α/(1 − α) for α ≤
/// ½, and (1 − α)/α otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleSphere {
    /// Distance ξ between the centres of the two spheres, in radii.
    pub xi: f64,
    /// Weight α of the second projection, 0 to 1.
    pub alpha: f64,
}

impl Default for DoubleSphere {
    /// Returns the stereographic projection, which approximates fisheye lenses of all kinds.
    fn default() -> Self {
        Self { xi: 0.0, alpha: 0.5 }
    }
}

impl LensLaw for DoubleSphere {
    fn names(&self) -> Vec<String> {
        ["xi", "alpha"].map(str::to_owned).to_vec()
    }

    fn parameters(&self) -> Vec<f64> {
        vec![self.xi, self.alpha]
    }

    fn set_parameters(&mut self, values: &[f64]) {
        [self.xi, self.alpha] = [values[0], values[1]];
    }

    fn ranges(&self) -> &'static [Range] {
        &[quantity::xi::RANGE, quantity::alpha::RANGE]
    }

    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        let Self { xi, alpha } = *self;
        let DVec3 { x, y, z } = point;
        let d1 = point.length();
        let w = limit(alpha);
        let w2 = (w + xi) / (2.0 * w * xi + xi * xi + 1.0).sqrt();
        if !((0.0..=1.0).contains(&alpha) && xi.abs() < 1.0 && z > -w2 * d1) {
            return None;
        }
        let gamma = xi * d1 + z;
        let d2 = (x * x + y * y + gamma * gamma).sqrt();
        let h = alpha * d2 + (1.0 - alpha) * gamma;
        let by_gamma = alpha * gamma / d2 + (1.0 - alpha);
        let h_point = [
            alpha * x / d2 + by_gamma * xi * x / d1,
            alpha * y / d2 + by_gamma * xi * y / d1,
            by_gamma * (xi * z / d1 + 1.0),
        ];
        by_parameters[0] = by_height(point, h, by_gamma * d1);
        by_parameters[1] = by_height(point, h, d2 - gamma);
        quotient(point, h, h_point)
    }

    fn ray(&self, at: DVec2) -> Option<Ray> {
        let Self { xi, alpha } = *self;
        let r2 = at.length_squared();
        let under = 1.0 - (2.0 * alpha - 1.0) * r2;
        if under < 0.0 {
            return None;
        }
        let z = (1.0 - alpha * alpha * r2) / (alpha * under.sqrt() + 1.0 - alpha);
        let root = z * z + (1.0 - xi * xi) * r2;
        if root < 0.0 {
            return None;
        }
        let length = (z * xi + root.sqrt()) / (z * z + r2);
        Ray::central((length * at).extend(length * z - xi))
    }
}
