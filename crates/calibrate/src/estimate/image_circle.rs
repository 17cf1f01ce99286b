//! The image circle of a fisheye, estimated from the detected corners.

use std::f64::consts::TAU;

use glam::DVec2;

use deltille_core::camera::{Camera, Lens};

/// The image circle of a fisheye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageCircle {
    /// Its centre, px.
    pub centre_px: DVec2,
    /// Its radius, px.
    pub radius_px: f64,
}

/// Number of directions from the centre in which the outermost corners are compared; several of
/// them lie between a side of the image and its corner.
const DIRECTIONS: usize = 16;

/// Fraction of the radius beyond which corners count as being on the rim of the circle. It is less
/// than 1 because the paper of a board extends beyond its last row of corners.
const RIM: f64 = 0.85;

impl ImageCircle {
    /// Finds the image circle of a camera from the detected corners; `None` if the lens covers the whole image, as
    /// perspective lenses do. There is a circle if the detected corners fill one, or if the lens
    /// model does not reach the corners of the image.
    pub fn of(camera: &Camera, seen: &[DVec2]) -> Option<Self> {
        if camera.lens.is_perspective() {
            return None;
        }
        let by_lens = || {
            // A spline ends at its outermost knots, and these where the corners end.
            if matches!(camera.lens, Lens::Spline(_)) {
                return None;
            }
            let radii = camera.corners_px().map(|corner| seen_towards(camera, corner));
            let radius_px = radii.into_iter().flatten().reduce(f64::min)?;
            Some(Self { centre_px: camera.centre_px, radius_px })
        };
        Self::filled(camera, seen).or_else(by_lens)
    }

    /// Finds the circle that the detected corners fill; `None` unless it reaches the nearest side
    /// and leaves the corners of the image empty.
    pub(crate) fn filled(camera: &Camera, seen: &[DVec2]) -> Option<Self> {
        if camera.lens.is_perspective() {
            return None;
        }
        let centre_px = camera.centre_px;
        let mut outermost = [0.0; DIRECTIONS];
        for &pixel in seen {
            let angle = (pixel - centre_px).to_angle().rem_euclid(TAU) / TAU;
            let direction = (angle * DIRECTIONS as f64) as usize % DIRECTIONS;
            outermost[direction] = camera.radius_px(pixel).max(outermost[direction]);
        }
        let farthest = outermost.iter().copied().fold(0.0, f64::max);
        let DVec2 { x, y } = centre_px;
        let sides = [x, y, f64::from(camera.width) - x, f64::from(camera.height) - y];
        let side = sides.into_iter().fold(f64::INFINITY, f64::min);
        let filled = outermost.iter().all(|&radius| radius >= RIM * farthest);
        let radius_px = farthest.max(side);
        let is_circle = filled && farthest >= RIM * side && radius_px < camera.farthest_px();
        is_circle.then_some(Self { centre_px, radius_px })
    }

    /// Distance of a pixel position from the centre, px.
    pub fn radius_of(&self, pixel: DVec2) -> f64 {
        let from_centre = pixel - self.centre_px;
        from_centre.x.hypot(from_centre.y)
    }
}

/// Radius from the principal point, in the direction of a corner of the image, up to which the lens
/// model is valid; `None` if it is valid up to the corner.
fn seen_towards(camera: &Camera, corner: DVec2) -> Option<f64> {
    let centre = camera.centre_px;
    let at = |part: f64| centre + part * (corner - centre);
    if camera.unproject(corner).is_some() {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    // Bisects to a fraction of a pixel.
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        *(if camera.unproject(at(middle)).is_some() { &mut low } else { &mut high }) = middle;
    }
    Some(camera.radius_px(at(low)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::camera::{BrownConrady, KannalaBrandt, Lens};

    #[test]
    fn a_fisheye_has_a_circle_if_corners_fill_one_or_the_lens_ends() {
        let fisheye = |k: f64| {
            let lens = Lens::KannalaBrandt(KannalaBrandt { k: vec![k, 0.0, 0.0, 0.0] });
            Camera::centred(1600, 1200, 380.0, lens)
        };
        let disc = |camera: &Camera, radius: f64| -> Vec<DVec2> {
            let at =
                |i: i32| (radius * f64::from(i / 100) / 10.0, f64::from(i % 100) / 100.0 * TAU);
            let on_disc = |(r, a): (f64, f64)| camera.centre_px + r * DVec2::from_angle(a);
            (0..=1099).map(at).map(on_disc).collect()
        };
        let lens = fisheye(-0.01);
        let filled = ImageCircle::of(&lens, &disc(&lens, 590.0)).unwrap();
        assert!((filled.radius_px - 600.0).abs() < 1.0, "{filled:?}");
        // A small disc does not imply a circle. Detected corners in the corners of the image do not
        // imply one, either.
        assert_eq!(ImageCircle::of(&lens, &disc(&lens, 300.0)), None);
        let mut all = disc(&lens, 590.0);
        all.extend([DVec2::new(20.0, 20.0), DVec2::new(1580.0, 1180.0)]);
        assert_eq!(ImageCircle::of(&lens, &all), None);
        // r = θ (1 − θ²/10) ends at 463 px.
        let ends = fisheye(-0.1);
        let ended = ImageCircle::of(&ends, &disc(&ends, 300.0)).unwrap();
        assert!((ended.radius_px - ends.monotonic_px().unwrap()).abs() < 1.0, "{ended:?}");
        let perspective = Lens::BrownConrady(BrownConrady::default());
        let perspective = Camera::centred(1200, 1200, 900.0, perspective);
        assert_eq!(ImageCircle::of(&perspective, &disc(&perspective, 590.0)), None);
    }
}
