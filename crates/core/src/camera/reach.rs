//! The valid range of a lens: the distance from the axis up to which its curve has no fold (reversal) or pole
//! (divergence).

use glam::DVec2;

use super::Camera;

/// Number of bisections of an interval: enough for full precision.
const HALVINGS: usize = 100;

impl Camera {
    /// Returns the distance from the principal point, px, up to which it increases monotonically
    /// with the angle. Returns `None` if it does so over the whole field of view. Ignores
    /// tangential terms, which change the radius only slightly.
    ///
    /// ```
    /// use deltille_core::camera::{BrownConrady, Camera, Lens};
    ///
    /// // r (1 − r²/3) folds back at r = 1, where its value is 2/3.
    /// let lens = BrownConrady { radial: [-1.0 / 3.0, 0.0, 0.0], ..BrownConrady::default() };
    /// let camera = Camera::centred(1600, 1200, 900.0, Lens::BrownConrady(lens));
    /// assert!((camera.monotonic_px().unwrap() - 600.0).abs() < 1e-6);
    /// ```
    pub fn monotonic_px(&self) -> Option<f64> {
        self.lens.monotonic_radius().map(|radius| radius * self.focal_px.min_element())
    }

    /// Returns the distance of a pixel position from the principal point, px.
    pub fn radius_px(&self, pixel: DVec2) -> f64 {
        let from_centre = pixel - self.centre_px;
        from_centre.x.hypot(from_centre.y)
    }

    /// Returns the distance of the farthest image corner from the principal point, px.
    pub fn farthest_px(&self) -> f64 {
        self.corners_px().map(|corner| self.radius_px(corner)).into_iter().fold(0.0, f64::max)
    }

    /// Returns the centres of the four corner pixels of the image, px.
    pub fn corners_px(&self) -> [DVec2; 4] {
        let [right, low] = [self.width, self.height].map(|side| f64::from(side) - 0.5);
        [[-0.5, -0.5], [right, -0.5], [-0.5, low], [right, low]].map(DVec2::from)
    }
}

/// Evaluates c₀ + c₁ q + c₂ q² + …
pub(super) fn value(polynomial: &[f64], q: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, c| sum * q + c)
}

/// Returns the product of two polynomials.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

/// Returns q times the derivative of a polynomial.
pub(super) fn slope_times_q(polynomial: &[f64]) -> Vec<f64> {
    polynomial.iter().enumerate().map(|(power, c)| power as f64 * c).collect()
}

/// Returns the positions between 0 and `end` where a polynomial changes its sign, in order. Its
/// extrema are the sign changes of the derivative. Between two adjacent extrema there is at most
/// one sign change.
pub(super) fn sign_changes(polynomial: &[f64], end: f64) -> Vec<f64> {
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> = slope_times_q(polynomial).split_off(1);
    let mut bounds = vec![0.0];
    bounds.extend(sign_changes(&derivative, end));
    bounds.push(end);
    let changes = bounds.windows(2).filter_map(|bounds| {
        let (mut low, mut high) = (bounds[0], bounds[1]);
        let sign = |q: f64| value(polynomial, q) > 0.0;
        let before = sign(low);
        if before == sign(high) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if sign(middle) == before { &mut low } else { &mut high }) = middle;
        }
        Some(low)
    });
    changes.collect()
}

/// Returns whether a polynomial with a positive constant term stays positive between 0 and `end`.
pub(super) fn stays_positive(polynomial: &[f64], end: f64) -> bool {
    // Without its positive terms, a polynomial is smallest at the end.
    let falling = polynomial[1..].iter().rev().fold(0.0, |sum, k| (sum + k.min(0.0)) * end);
    polynomial[0] + falling > 0.0 || sign_changes(polynomial, end).is_empty()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::{BrownConrady, KannalaBrandt, Lens};

    fn steady(lens: Lens) -> Option<f64> {
        Camera::centred(1600, 1200, 1000.0, lens).monotonic_px()
    }

    #[test]
    fn sign_changes_are_all_found() {
        // (q − 1)(q − 2)(q − 4)
        let found = sign_changes(&[-8.0, 14.0, -7.0, 1.0], 10.0);
        assert_eq!(found.len(), 3, "{found:?}");
        for (found, root) in found.iter().zip([1.0, 2.0, 4.0]) {
            assert!((found - root).abs() < 1e-12);
        }
        assert_eq!(sign_changes(&[-8.0, 14.0, -7.0, 1.0], 3.0).len(), 2);
    }

    #[test]
    fn points_beyond_a_fold_have_no_image() {
        // r (1 − 0.35 r² + 0.02 r⁴) folds at r = 1.03 and increases again from r = 3.07.
        let radial = [-0.35, 0.02, 0.0];
        // θ (1 − θ²/3 + θ⁴/40) folds at θ = 1.13 and increases again from θ = 2.51.
        let k = vec![-1.0 / 3.0, 0.025, 0.0, 0.0];
        let plane = BrownConrady { radial, ..BrownConrady::default() };
        let fisheye = KannalaBrandt { k };
        for lens in [Lens::BrownConrady(plane), Lens::KannalaBrandt(fisheye)] {
            let camera = Camera::centred(1600, 1200, 100.0, lens);
            for (angle, seen) in
                [(0.5, true), (0.79, true), (1.2, false), (1.3, false), (3.0, false)]
            {
                let image = camera.project(DVec3::new(f64::sin(angle), 0.0, f64::cos(angle)));
                assert_eq!(image.is_some(), seen, "{angle} rad: {image:?}, {:?}", camera.lens);
            }
            for x in 0..800 {
                let pixel = DVec2::new(f64::from(x), 600.0);
                let Some(ray) = camera.unproject(pixel) else { continue };
                assert!(camera.project(ray.direction).unwrap().distance(pixel) < 1e-9);
            }
        }
    }

    #[test]
    fn folds_and_narrow_poles_are_found() {
        let lens = |radial, denominator| {
            Lens::BrownConrady(BrownConrady { radial, denominator, ..BrownConrady::default() })
        };
        // A pole at r² = 0.25 with a zero of the numerator next to it, on either side.
        for zero in [0.25 + 1e-7, 0.25 - 1e-7] {
            let found = steady(lens([-1.0 / zero, 0.0, 0.0], [-4.0, 0.0, 0.0])).unwrap();
            assert!((found - 500.0).abs() < 2.0, "{found}");
        }
        assert_eq!(steady(lens([-0.1, 0.02, 0.0], [0.0; 3])), None);
        assert_eq!(steady(lens([0.3, 0.1, 0.2], [0.0; 3])), None);
        assert_eq!(steady(lens([0.4, 0.1, 0.0], [0.7, 0.05, 0.0])), None);
        // r = θ (1 − θ²/3) folds back at 1 rad.
        let fisheye = |k: f64| Lens::KannalaBrandt(KannalaBrandt { k: vec![k, 0.0, 0.0, 0.0] });
        assert!((steady(fisheye(-1.0 / 3.0)).unwrap() - 2000.0 / 3.0).abs() < 1e-6);
        assert_eq!(steady(fisheye(-0.02)), None);
    }
}
