use glam::{DVec2, DVec3};

use super::law::{Imaged, LensLaw, Ray};
use crate::quantity::{self, Range};

/// Extended unified camera model, EUCM (Khomutenko, Garcia and Martinet 2016):
///
/// ```text
///     d = √(β (X² + Y²) + Z²),   h = α d + (1 − α) Z
///     (x', y') = (X, Y)/h
/// ```
///
/// Valid for 0 ≤ α ≤ 1 and β > 0, where Z > −w d. Here w = α/(1 − α) for α ≤ ½, and (1 − α)/α otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedUnified {
    /// Weight α of the distance from the centre, 0 to 1; 0 is a pinhole camera.
    pub alpha: f64,
    /// Shape β of the surface that points are projected onto; 1 is a sphere.
    pub beta: f64,
}

impl Default for ExtendedUnified {
    /// Returns the stereographic projection, which approximates fisheye lenses of all kinds.
    fn default() -> Self {
        Self { alpha: 0.5, beta: 1.0 }
    }
}

impl LensLaw for ExtendedUnified {
    fn names(&self) -> Vec<String> {
        ["alpha", "beta"].map(str::to_owned).to_vec()
    }

    fn parameters(&self) -> Vec<f64> {
        vec![self.alpha, self.beta]
    }

    fn set_parameters(&mut self, values: &[f64]) {
        [self.alpha, self.beta] = [values[0], values[1]];
    }

    fn ranges(&self) -> &'static [Range] {
        &[quantity::alpha::RANGE, quantity::beta::RANGE]
    }

    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        let Self { alpha, beta } = *self;
        let DVec3 { x, y, z } = point;
        let across = x * x + y * y;
        let d = (beta * across + z * z).sqrt();
        let valid = (0.0..=1.0).contains(&alpha) && beta > 0.0 && z > -limit(alpha) * d;
        if !valid {
            return None;
        }
        let h = alpha * d + (1.0 - alpha) * z;
        let h_point = [alpha * beta * x / d, alpha * beta * y / d, alpha * z / d + (1.0 - alpha)];
        by_parameters[0] = by_height(point, h, d - z);
        by_parameters[1] = by_height(point, h, alpha * across / (2.0 * d));
        quotient(point, h, h_point)
    }

    fn ray(&self, at: DVec2) -> Option<Ray> {
        let Self { alpha, beta } = *self;
        let r2 = at.length_squared();
        let under = 1.0 - (2.0 * alpha - 1.0) * beta * r2;
        if under < 0.0 {
            return None;
        }
        let z = (1.0 - beta * alpha * alpha * r2) / (alpha * under.sqrt() + 1.0 - alpha);
        Ray::central(at.extend(z))
    }
}

/// Returns w, which limits the domain. Beyond the limit, two points on the line of a ray would
/// share an image.
pub(super) fn limit(alpha: f64) -> f64 {
    if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha }
}

/// Returns (X, Y)/h with its derivatives, from those of h.
pub(super) fn quotient(point: DVec3, h: f64, h_point: [f64; 3]) -> Option<Imaged> {
    let at = point.truncate() / h;
    let mut by_point = [at.x, at.y].map(|v| h_point.map(|h_i| -v * h_i / h));
    by_point[0][0] += 1.0 / h;
    by_point[1][1] += 1.0 / h;
    (h > 0.0).then_some(Imaged { at, by_point })
}

/// Returns the derivatives of (X, Y)/h with respect to a parameter, from the derivative of h.
pub(super) fn by_height(point: DVec3, h: f64, h_parameter: f64) -> [f64; 2] {
    [-point.x * h_parameter / (h * h), -point.y * h_parameter / (h * h)]
}
