//! Trigonometric functions with bit-identical results on every system, including browsers: files must not depend on
//! the system's math library.

use glam::DVec2;

/// Returns the unit vector at an angle from the x axis.
pub fn direction(angle_rad: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle_rad);
    DVec2::new(cos, sin)
}

/// Returns the tangent.
pub fn tangent(angle_rad: f64) -> f64 {
    libm::tan(angle_rad)
}

/// Returns the angle with this sine and cosine, both scaled by any positive factor.
pub fn angle(sin: f64, cos: f64) -> f64 {
    libm::atan2(sin, cos)
}

/// Returns the angle from the x axis to a direction.
pub fn turn_of(direction: DVec2) -> f64 {
    angle(direction.y, direction.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_match_the_standard_library() {
        for degrees in [-150f64, -30.0, 0.0, 41.8, 90.0, 180.0] {
            let at = degrees.to_radians();
            assert!(direction(at).distance(DVec2::from_angle(at)) < 1e-15);
            let back = angle(direction(at).y, direction(at).x);
            assert!((back - at).abs() < 1e-15);
        }
        assert!((tangent(0.7) - 0.7f64.tan()).abs() < 1e-15);
    }
}
