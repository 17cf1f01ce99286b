//! Functions of angles whose last digit is the same on every system, in a browser too: files must not depend on the library
//! that a system brings along.

use glam::DVec2;

/// The unit vector that a turn from the x axis leads to.
pub fn direction(angle_rad: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle_rad);
    DVec2::new(cos, sin)
}

/// The tangent.
pub fn tangent(angle_rad: f64) -> f64 {
    libm::tan(angle_rad)
}

/// The angle between two directions, from their sine and cosine times anything.
pub fn angle(sin: f64, cos: f64) -> f64 {
    libm::atan2(sin, cos)
}

/// The turn from the x axis to a direction.
pub fn turn_of(direction: DVec2) -> f64 {
    angle(direction.y, direction.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_what_they_are_called() {
        for degrees in [-150f64, -30.0, 0.0, 41.8, 90.0, 180.0] {
            let at = degrees.to_radians();
            assert!(direction(at).distance(DVec2::from_angle(at)) < 1e-15);
            let back = angle(direction(at).y, direction(at).x);
            assert!((back - at).abs() < 1e-15);
        }
        assert!((tangent(0.7) - 0.7f64.tan()).abs() < 1e-15);
    }
}
