use glam::{DVec2, DVec3};

use super::equidistant::{self, Angle};
use super::law::{Imaged, LensLaw, Ray};

/// Minimum number of terms of the polynomial; a file may have fewer.
pub(super) const MIN_TERMS: usize = 4;

/// Equidistant fisheye polynomial (Kannala and Brandt 2006), with four terms as in OpenCV's fisheye module, or more:
///
/// ```text
///     θ = ∠(point, axis),  r = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸ + …)
///     (x', y') = r · (X, Y)/‖(X, Y)‖
/// ```
///
/// Valid up to θ = π, as long as r increases with θ.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KannalaBrandt {
    /// Coefficients k1, k2, … of θ³, θ⁵, …, at most [`MAX_LENS_PARAMETERS`](super::MAX_LENS_PARAMETERS).
    pub k: Vec<f64>,
}

impl LensLaw for KannalaBrandt {
    fn names(&self) -> Vec<String> {
        (1..=self.k.len()).map(|i| format!("k{i}")).collect()
    }

    fn parameters(&self) -> Vec<f64> {
        self.k.clone()
    }

    fn set_parameters(&mut self, values: &[f64]) {
        self.k.copy_from_slice(values);
    }

    fn least_coefficients(&self) -> Option<usize> {
        Some(MIN_TERMS)
    }

    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        let radius = point.x.hypot(point.y);
        let squared = radius * radius + point.z * point.z;
        if radius == 0.0 && point.z <= 0.0 {
            return None;
        }
        let theta = radius.atan2(point.z);
        let angle = Angle { theta, by_radius: point.z / squared, by_z: -radius / squared };
        let (cos, sin) = equidistant::direction(point);
        let mut power = theta;
        for by in &mut by_parameters[..self.k.len()] {
            power *= theta * theta;
            *by = [power * cos, power * sin];
        }
        equidistant::image(&self.k, point, &angle)
    }

    fn covers(&self, point: DVec3) -> bool {
        equidistant::increases_to(&self.k, point.x.hypot(point.y).atan2(point.z))
    }

    fn ray(&self, at: DVec2) -> Option<Ray> {
        let r = at.x.hypot(at.y);
        if r == 0.0 {
            return Ray::central(DVec3::Z);
        }
        let (sin, cos) = equidistant::angle(&self.k, r)?.sin_cos();
        Ray::central((sin * at / r).extend(cos))
    }

    fn monotonic_radius(&self) -> Option<f64> {
        equidistant::monotonic_radius(&self.k)
    }
}
