//! Camera models and poses: where a point of the world appears in an image.
//!
//! The camera frame is right-handed: x right, y down, z forward, the origin at the centre of
//! projection. Pixel centres lie at integer coordinates.

mod brown_conrady;
pub mod file;
mod kannala_brandt;
mod pose;

use glam::DVec3;

pub use brown_conrady::BrownConrady;
pub use file::CameraFileError;
pub use kannala_brandt::KannalaBrandt;
pub use pose::Pose;

/// A camera: image size, focal lengths, principal point, and the law of its lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Focal lengths fx, fy, px.
    pub focal_px: [f64; 2],
    /// Principal point cx, cy, px.
    pub centre_px: [f64; 2],
    /// The lens.
    pub lens: Lens,
}

/// How a ray's direction becomes a point of the normalised image plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Perspective with polynomial distortion; sees less than 180°.
    BrownConrady(BrownConrady),
    /// Equidistant polynomial; sees more than 180° where its polynomial grows.
    KannalaBrandt(KannalaBrandt),
}

impl Camera {
    /// An ideal pinhole camera with the principal point in the middle and a horizontal field of
    /// view of `hfov_rad`.
    pub fn pinhole(width: u32, height: u32, hfov_rad: f64) -> Self {
        let focal = f64::from(width) / 2.0 / (hfov_rad / 2.0).tan();
        Self {
            width,
            height,
            focal_px: [focal; 2],
            centre_px: [f64::from(width) / 2.0 - 0.5, f64::from(height) / 2.0 - 0.5],
            lens: Lens::BrownConrady(BrownConrady::default()),
        }
    }

    /// Pixel position of a point of the camera frame; `None` where the model does not reach.
    /// The position may lie outside the image.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let [x, y] = match &self.lens {
            Lens::BrownConrady(lens) => lens.project(point)?,
            Lens::KannalaBrandt(lens) => lens.project(point)?,
        };
        let [fx, fy] = self.focal_px;
        let [cx, cy] = self.centre_px;
        let pixel = [fx * x + cx, fy * y + cy];
        pixel.iter().all(|v| v.is_finite()).then_some(pixel)
    }

    /// Whether a pixel position lies in the image, `margin` pixels inside its border.
    pub fn sees(&self, [x, y]: [f64; 2], margin: f64) -> bool {
        let low = margin - 0.5;
        x >= low
            && y >= low
            && x <= f64::from(self.width) - 1.0 - low
            && y <= f64::from(self.height) - 1.0 - low
    }
}
