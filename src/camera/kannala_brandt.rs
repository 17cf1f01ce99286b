use glam::DVec3;

/// Equidistant fisheye polynomial (Kannala and Brandt 2006), as in OpenCV's fisheye module:
///
/// ```text
///     θ = ∠(point, axis),  θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
///     (x', y') = θ_d · (X, Y)/‖(X, Y)‖
/// ```
///
/// Valid up to θ = π, where θ_d still grows with θ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KannalaBrandt {
    /// k1 … k4.
    pub k: [f64; 4],
}

impl KannalaBrandt {
    /// Normalised image point of a camera point; `None` where the polynomial folds back.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let radius = point.x.hypot(point.y);
        if radius == 0.0 {
            return (point.z > 0.0).then_some([0.0, 0.0]);
        }
        let theta = radius.atan2(point.z);
        let t2 = theta * theta;
        let [k1, k2, k3, k4] = self.k;
        let slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)));
        if slope <= 0.0 {
            return None;
        }
        let distorted = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
        Some([distorted * point.x / radius, distorted * point.y / radius])
    }
}
