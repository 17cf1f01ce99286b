use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::brown_conrady::solve;
use super::equidistant::{self, Angle};
use super::law::{Imaged, LensLaw, Ray};

/// Newton iterations for the angle and for the tangential terms. The start is off only by the small
/// effects of pupil and tilt; five iterations give full precision.
const ITERATIONS: usize = 30;

/// Convergence threshold of Newton steps, rad: the rounding error of an angle.
const CONVERGED_RAD: f64 = 1e-14;

/// A fisheye lens whose entrance pupil moves along the axis with the angle of the ray, so that rays do not meet in
/// one point:
///
/// ```text
///     E(θ) = e1 θ² + e2 θ⁴ + e3 θ⁶                          mm along the axis
///     θ    : R cos θ = (Z − E(θ)) sin θ,   R = ‖(X, Y)‖     the ray passes (0, 0, E(θ))
///     r    = θ (1 + k1 θ² + … + k5 θ¹⁰),   (u, v) = r · (X, Y)/R
///     x' = u + 2 p1 uv + p2 (r² + 2u²)
///     y' = v + p1 (r² + 2v²) + 2 p2 uv
/// ```
///
/// Valid up to θ = π, as long as r increases with θ and no other nearby ray passes through the
/// point. Parameters are
/// in the order k1 … k5, p1, p2, e1, e2, e3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pupil {
    /// Coefficients k1 … k5 of the polynomial in θ.
    pub k: [f64; 5],
    /// Tangential coefficients p1, p2.
    pub tangential: [f64; 2],
    /// Coefficients e1, e2, e3 of the shift of the entrance pupil along the axis, mm.
    pub shift_mm: [f64; 3],
}

impl Pupil {
    /// Returns E and ∂E/∂θ, mm.
    fn shift(&self, theta: f64) -> (f64, f64) {
        let [e1, e2, e3] = self.shift_mm;
        let t2 = theta * theta;
        (t2 * (e1 + t2 * (e2 + t2 * e3)), theta * (2.0 * e1 + t2 * (4.0 * e2 + t2 * 6.0 * e3)))
    }

    /// Returns the angle of the ray through a point. With g = R cos θ − (Z − E) sin θ, ∂θ/∂a = −g_a / g_θ.
    fn angle(&self, point: DVec3) -> Option<(Angle, f64)> {
        let radius = point.x.hypot(point.y);
        let mut theta = radius.atan2(point.z);
        for _ in 0..ITERATIONS {
            let (sin, cos) = theta.sin_cos();
            let (shift, shift_slope) = self.shift(theta);
            let g = radius * cos - (point.z - shift) * sin;
            let g_theta = -radius * sin - (point.z - shift) * cos + shift_slope * sin;
            // If the slope is not negative, several rays pass through the point.
            if g_theta >= 0.0 {
                return None;
            }
            let step = g / g_theta;
            theta -= step;
            if step.abs() <= CONVERGED_RAD {
                let angle = Angle { theta, by_radius: -cos / g_theta, by_z: sin / g_theta };
                return (0.0..PI).contains(&theta).then_some((angle, g_theta));
            }
        }
        None
    }

    /// Returns x', y' and ∂(x', y')/∂(u, v).
    fn tilt(&self, DVec2 { x: u, y: v }: DVec2) -> (DVec2, [[f64; 2]; 2]) {
        let [p1, p2] = self.tangential;
        let r2 = u * u + v * v;
        let mixed = 2.0 * (p1 * u + p2 * v);
        (
            DVec2::new(
                u + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u),
                v + p1 * (r2 + 2.0 * v * v) + 2.0 * p2 * u * v,
            ),
            [
                [1.0 + 2.0 * p1 * v + 6.0 * p2 * u, mixed],
                [mixed, 1.0 + 6.0 * p1 * v + 2.0 * p2 * u],
            ],
        )
    }
}

impl LensLaw for Pupil {
    fn names(&self) -> Vec<String> {
        ["k1", "k2", "k3", "k4", "k5", "p1", "p2", "e1", "e2", "e3"].map(str::to_owned).to_vec()
    }

    fn parameters(&self) -> Vec<f64> {
        [self.k.as_slice(), &self.tangential, &self.shift_mm].concat()
    }

    fn set_parameters(&mut self, values: &[f64]) {
        self.k.copy_from_slice(&values[..5]);
        self.tangential.copy_from_slice(&values[5..7]);
        self.shift_mm.copy_from_slice(&values[7..10]);
    }

    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        let (angle, g_theta) = self.angle(point)?;
        let Imaged { at: plane, by_point } = equidistant::image(&self.k, point, &angle)?;
        let DVec2 { x: u, y: v } = plane;
        let (at, tilt) = self.tilt(plane);
        let (cos, sin) = equidistant::direction(point);
        let radially = |amount: f64| tilt.map(|[by_u, by_v]| amount * (by_u * cos + by_v * sin));
        let Angle { theta, .. } = angle;
        let t2 = theta * theta;
        let (r, slope) = equidistant::radius(&self.k, theta);
        let mut power = theta;
        for by in &mut by_parameters[..5] {
            power *= t2;
            *by = radially(power);
        }
        by_parameters[5] = [2.0 * u * v, r * r + 2.0 * v * v];
        by_parameters[6] = [r * r + 2.0 * u * u, 2.0 * u * v];
        let mut power = 1.0;
        for by in &mut by_parameters[7..10] {
            power *= t2;
            *by = radially(-slope * power * theta.sin() / g_theta);
        }
        let by_point = tilt
            .map(|[by_u, by_v]| [0, 1, 2].map(|i| by_u * by_point[0][i] + by_v * by_point[1][i]));
        Some(Imaged { at, by_point })
    }

    fn covers(&self, point: DVec3) -> bool {
        self.angle(point).is_some_and(|(angle, _)| equidistant::increases_to(&self.k, angle.theta))
    }

    fn ray(&self, at: DVec2) -> Option<Ray> {
        let mut plane = at;
        for _ in 0..ITERATIONS {
            let (image, by_plane) = self.tilt(plane);
            let step = solve(by_plane, at - image)?;
            plane += step;
            if step.length() <= 1e-15 {
                break;
            }
        }
        let r = plane.x.hypot(plane.y);
        if r == 0.0 {
            return Ray::central(DVec3::Z);
        }
        let theta = equidistant::angle(&self.k, r)?;
        let (sin, cos) = theta.sin_cos();
        let direction = (sin * plane / r).extend(cos);
        Some(Ray { origin: DVec3::Z * self.shift(theta).0, direction })
    }

    fn monotonic_radius(&self) -> Option<f64> {
        equidistant::monotonic_radius(&self.k)
    }
}
