//! Functions shared by the equidistant models: an odd polynomial of the angle from the axis, and the image of a point
//! at that angle.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::law::Imaged;
use super::reach::{sign_changes, stays_positive};

/// Steps of the angle in the search for a root, rad. Polynomials with the few terms in use do not have two extrema
/// within a step.
const ANGLE_STEP: f64 = 0.02;

/// Newton iterations from a start within [`ANGLE_STEP`].
const ITERATIONS: usize = 8;

/// Returns r = θ (1 + k1 θ² + k2 θ⁴ + …) and ∂r/∂θ.
pub(super) fn radius(k: &[f64], theta: f64) -> (f64, f64) {
    let t2 = theta * theta;
    let (mut sum, mut slope) = (0.0, 0.0);
    for (i, &k) in k.iter().enumerate().rev() {
        sum = (sum + k) * t2;
        slope = (slope + (2 * i + 3) as f64 * k) * t2;
    }
    (theta * (1.0 + sum), 1.0 + slope)
}

/// Returns the smallest θ up to π with r(θ) = `wanted`, in the range where the polynomial increases.
pub(super) fn angle(k: &[f64], wanted: f64) -> Option<f64> {
    let mut low = 0.0;
    loop {
        let high = f64::min(low + ANGLE_STEP, PI);
        let (value, slope) = radius(k, high);
        if value >= wanted {
            break;
        }
        if slope <= 0.0 || high >= PI {
            return None;
        }
        low = high;
    }
    let mut theta = low + ANGLE_STEP / 2.0;
    for _ in 0..ITERATIONS {
        let (value, slope) = radius(k, theta);
        theta -= (value - wanted) / slope;
    }
    (0.0..=PI).contains(&theta).then_some(theta)
}

/// Returns r at the smallest θ up to π where the polynomial stops increasing.
pub(super) fn monotonic_radius(k: &[f64]) -> Option<f64> {
    let turn = sign_changes(&slope(k), PI * PI).first().copied()?;
    Some(radius(k, turn.sqrt()).0)
}

/// Returns whether r increases from the axis up to an angle θ.
pub(super) fn increases_to(k: &[f64], theta: f64) -> bool {
    stays_positive(&slope(k), theta * theta)
}

/// Returns ∂r/∂θ as a polynomial in θ².
fn slope(k: &[f64]) -> Vec<f64> {
    let terms = k.iter().enumerate().map(|(i, k)| (2 * i + 3) as f64 * k);
    std::iter::once(1.0).chain(terms).collect()
}

/// Angle of a point and its derivatives with respect to the position.
pub(super) struct Angle {
    pub theta: f64,
    /// Derivative ∂θ/∂R, with R = ‖(X, Y)‖.
    pub by_radius: f64,
    /// Derivative ∂θ/∂Z.
    pub by_z: f64,
}

/// Returns the image (u, v) = r(θ) · (X, Y)/R of a point; `None` if r does not increase with θ.
pub(super) fn image(k: &[f64], point: DVec3, angle: &Angle) -> Option<Imaged> {
    let (r, slope) = radius(k, angle.theta);
    if slope <= 0.0 {
        return None;
    }
    let big_r = point.x.hypot(point.y);
    // On the axis, r/R has a limit: the slope there.
    let (cos, sin) = direction(point);
    let across = if big_r > 0.0 { r / big_r } else { angle.by_radius };
    let along = slope * angle.by_radius;
    let mixed = cos * sin * (along - across);
    let forward = slope * angle.by_z;
    Some(Imaged {
        at: DVec2::new(r * cos, r * sin),
        by_point: [
            [cos * cos * along + sin * sin * across, mixed, cos * forward],
            [mixed, sin * sin * along + cos * cos * across, sin * forward],
        ],
    })
}

/// Returns cos φ and sin φ of a point's direction around the axis.
pub(super) fn direction(point: DVec3) -> (f64, f64) {
    let big_r = point.x.hypot(point.y);
    if big_r > 0.0 { (point.x / big_r, point.y / big_r) } else { (1.0, 0.0) }
}
