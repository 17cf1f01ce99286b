use glam::DVec3;

/// Points nearer to the image plane than this part of their distance are not projected: beyond
/// 89.9° from the axis perspective loses its meaning.
const MIN_FORWARD: f64 = 0.002;

/// Perspective with radial and tangential distortion (Brown 1966, Conrady 1919), as in OpenCV:
///
/// ```text
///     x = X/Z, y = Y/Z, r² = x² + y²
///     x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 xy + p2 (r² + 2x²)
///     y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2y²) + 2 p2 xy
/// ```
///
/// Valid where the radial term still grows with r.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrownConrady {
    /// k1, k2, k3.
    pub radial: [f64; 3],
    /// p1, p2.
    pub tangential: [f64; 2],
}

impl BrownConrady {
    /// Normalised image point of a camera point; `None` behind the camera or where distortion
    /// folds back.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        if point.z <= MIN_FORWARD * point.length() {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let r2 = x * x + y * y;
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3));
        if slope <= 0.0 {
            return None;
        }
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        Some([
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ])
    }
}
