//! The radius within the image at which a lens model folds back or has a pole.

use std::fmt;

use glam::DVec2;

use super::image_circle::ImageCircle;
use deltille_core::camera::Camera;

/// A lens model that folds back or has a pole within the image, which polynomials and rational
/// functions do where no corner constrains them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LensLimit {
    /// Radius from the principal point up to which the lens model is valid, px.
    pub monotonic_px: f64,
    /// Radius of the outermost detected corner, px.
    pub outermost_px: f64,
    /// Radius of the farthest corner of the image, px.
    pub farthest_px: f64,
}

impl LensLimit {
    /// Finds the fold or pole of a camera; `None` if it lies beyond the image, or beyond the image circle
    /// that the corners fill. `seen` are the positions of all corners.
    pub fn of(camera: &Camera, seen: &[DVec2]) -> Option<Self> {
        let (monotonic_px, farthest_px) = (camera.monotonic_px()?, camera.farthest_px());
        let rim_px = ImageCircle::filled(camera, seen).map_or(farthest_px, |c| c.radius_px);
        let outermost_px = seen.iter().map(|&at| camera.radius_px(at)).fold(0.0, f64::max);
        (monotonic_px < rim_px).then_some(Self { monotonic_px, outermost_px, farthest_px })
    }
}

impl fmt::Display for LensLimit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "the lens model is valid up to {:.0} px from the principal point, where it folds back or has a \
             pole; the outermost corner is at {:.0} px, the corner of the image at {:.0} px: ",
            self.monotonic_px, self.outermost_px, self.farthest_px
        )?;
        f.write_str(match self.outermost_px > self.monotonic_px {
            true => "avoid pixels near that radius, or choose another model",
            false => "avoid pixels beyond that radius, add corners there, or choose another model",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::camera::{BrownConrady, Lens};

    #[test]
    fn only_a_fold_within_the_image_is_reported() {
        // r (1 − r²/3) folds back at 2/3 of the focal length.
        let lens = BrownConrady { radial: [-1.0 / 3.0, 0.0, 0.0], ..BrownConrady::default() };
        let camera = |focal| Camera::centred(1600, 1200, focal, Lens::BrownConrady(lens));
        let seen = [DVec2::new(800.0, 600.0), DVec2::new(800.0, 100.0)];
        assert_eq!(LensLimit::of(&camera(1600.0), &seen), None);
        let end = LensLimit::of(&camera(900.0), &seen).unwrap();
        assert!((end.monotonic_px - 600.0).abs() < 1e-6 && end.farthest_px == 1000.0, "{end:?}");
        assert!((end.outermost_px - 499.5).abs() < 0.01, "{end:?}");
        assert!(end.to_string().contains("600 px") && end.to_string().contains("1000 px"), "{end}");
    }
}
