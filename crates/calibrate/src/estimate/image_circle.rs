//! The image circle of a fisheye, from the corners that were seen.

use std::f64::consts::TAU;

use glam::DVec2;

use deltille_core::camera::Camera;

/// The image circle of a fisheye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageCircle {
    /// Its middle, px.
    pub centre_px: DVec2,
    /// Its radius, px.
    pub radius_px: f64,
}

/// Directions from the middle in which the outermost corners are compared: between a side of the image
/// and its corner lie several.
const DIRECTIONS: usize = 16;

/// Corners lie on the rim of a circle from this part of its radius on: boards reach the rim with their
/// last row of corners, not with their paper.
const RIM: f64 = 0.85;

impl ImageCircle {
    /// The image circle of a camera that saw these corners; `None` where its lens shows all of the
    /// image, as perspective ones do. There is one where corners fill one, and where corners of the
    /// image are beyond what the lens sees.
    pub fn of(camera: &Camera, seen: &[DVec2]) -> Option<Self> {
        if camera.lens.is_perspective() {
            return None;
        }
        let by_lens = || {
            let radii = camera.corners_px().map(|corner| seen_towards(camera, corner));
            let radius_px = radii.into_iter().flatten().reduce(f64::min)?;
            Some(Self { centre_px: camera.centre_px, radius_px })
        };
        Self::filled(camera, seen).or_else(by_lens)
    }

    /// The circle that corners fill: it reaches the nearest side and leaves the corners of the image
    /// empty.
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

    /// Distance of a pixel position from the middle, px.
    pub fn radius_of(&self, pixel: DVec2) -> f64 {
        let from_centre = pixel - self.centre_px;
        from_centre.x.hypot(from_centre.y)
    }
}

/// How far from the principal point a lens sees towards a corner of the image that it does not see.
fn seen_towards(camera: &Camera, corner: DVec2) -> Option<f64> {
    let centre = camera.centre_px;
    let at = |part: f64| centre + part * (corner - centre);
    if camera.unproject(corner).is_some() {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    // To a fraction of a pixel.
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
    fn a_fisheye_has_a_circle_where_corners_fill_one_or_the_lens_ends() {
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
        // A small disc says nothing, nor do corners in the corners of the image.
        assert_eq!(ImageCircle::of(&lens, &disc(&lens, 300.0)), None);
        let mut all = disc(&lens, 590.0);
        all.extend([DVec2::new(20.0, 20.0), DVec2::new(1580.0, 1180.0)]);
        assert_eq!(ImageCircle::of(&lens, &all), None);
        // r = θ (1 − θ²/10) ends at 463 px.
        let ends = fisheye(-0.1);
        let ended = ImageCircle::of(&ends, &disc(&ends, 300.0)).unwrap();
        assert!((ended.radius_px - ends.steady_px().unwrap()).abs() < 1.0, "{ended:?}");
        let perspective = Lens::BrownConrady(BrownConrady::default());
        let perspective = Camera::centred(1200, 1200, 900.0, perspective);
        assert_eq!(ImageCircle::of(&perspective, &disc(&perspective, 590.0)), None);
    }
}
