//! Camera models and poses: the projection of points into an image, and the lines of sight of pixels.
//!
//! The camera frame is right-handed: x right, y down, z forward. Its origin is the centre of projection; for a lens
//! that is not central, the position of its pupil for rays along the axis. Pixel centres are at integer coordinates.
//!
//! 1. `law` is the trait that each lens model implements; `lens` is the enum of models;
//! 2. `pose`: a rotation and a translation;
//! 3. `reach`: the largest angle at which a lens is valid;
//! 4. `undistortion`, `rectification`: positions of the pixels of corrected images;
//! 5. `file`: camera files.
//!
//! Each model has its own file with its formula and derivatives. `deltille_calibrate::Model` defines which of its
//! parameters a calibration estimates, and their initial values.

mod brown_conrady;
mod double_sphere;
mod equidistant;
mod extended_unified;
#[cfg(feature = "yaml")]
pub mod file;
mod kannala_brandt;
mod law;
mod lens;
mod pose;
mod pupil;
mod reach;
mod rectification;
mod spline;
mod undistortion;

use glam::{DVec2, DVec3};

pub use brown_conrady::BrownConrady;
pub use double_sphere::DoubleSphere;
pub use extended_unified::ExtendedUnified;
#[cfg(feature = "yaml")]
pub use file::{CameraFile, CameraFileError};
pub use kannala_brandt::KannalaBrandt;
pub use law::{Imaged, Ray};
pub use lens::{Lens, LensKind, MAX_LENS_PARAMETERS};
pub use pose::{Pose, is_rotation};
pub use pupil::Pupil;
pub use rectification::{Rectification, RectificationError};
pub use spline::{Knots, Spline, SplineGrid, SplineGridError};
#[doc(hidden)]
pub use spline::{MAX_TOUCHED, direction as stereographic_direction};
pub use undistortion::{Field, PixelMap, Undistortion, UndistortionError};

/// The parameters that every camera has. They precede those of its lens.
pub const PROJECTION_PARAMETERS: [&str; 4] = ["fx", "fy", "cx", "cy"];

/// Largest number of parameters of a camera whose lens is not a spline.
pub const MAX_PARAMETERS: usize = PROJECTION_PARAMETERS.len() + MAX_LENS_PARAMETERS;

/// A camera: image size, focal lengths, principal point, and lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Focal lengths fx and fy: pixels per unit of the normalised image plane.
    pub focal_px: DVec2,
    /// Principal point cx, cy, px; the centre of the upper left pixel is (0, 0).
    pub centre_px: DVec2,
    /// Lens distortion: the projection of directions onto the normalised image plane.
    pub lens: Lens,
}

/// A pixel position with all its derivatives; rows are x and y of the pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Position in the image, px.
    pub pixel: DVec2,
    /// Derivatives with respect to the coordinates X, Y, Z of the point in the camera frame, px/mm.
    pub by_point: [[f64; 3]; 2],
    /// Derivatives of x and y with respect to each parameter, in the order of
    /// [`Camera::parameter_names`]. Entries beyond the
    /// number of parameters are not filled. For a spline, only the first four are: see [`Self::by_parameter`].
    pub by_parameters: [[f64; 2]; MAX_PARAMETERS],
    /// Knots of a spline that affect the position.
    pub knots: Option<Knots>,
    /// Focal lengths, px: derivatives of the pixel with respect to the normalised image.
    focal_px: DVec2,
}

impl Projection {
    /// A projection to overwrite by [`Camera::project_into`].
    pub const EMPTY: Self = Self {
        pixel: DVec2::ZERO,
        by_point: [[0.0; 3]; 2],
        by_parameters: [[0.0; 2]; MAX_PARAMETERS],
        knots: None,
        focal_px: DVec2::ZERO,
    };

    /// Returns the derivative of a pixel coordinate with respect to the same coordinate of the
    /// normalised image.
    #[doc(hidden)]
    pub fn by_image(&self, coordinate: usize) -> f64 {
        self.focal_px[coordinate]
    }

    /// Returns the derivatives of x and y with respect to a parameter of the camera, for any lens.
    pub fn by_parameter(&self, index: usize) -> [f64; 2] {
        let of_lens = index.checked_sub(PROJECTION_PARAMETERS.len());
        match (self.knots, of_lens) {
            (Some(knots), Some(of_lens)) => {
                let part = knots.part(of_lens / 2);
                match of_lens % 2 {
                    0 => [self.focal_px.x * part, 0.0],
                    _ => [0.0, self.focal_px.y * part],
                }
            }
            _ => self.by_parameters[index],
        }
    }
}

impl Camera {
    /// Creates an ideal pinhole camera with the principal point in the centre and a horizontal field of view of
    /// `hfov_rad`.
    pub fn pinhole(width: u32, height: u32, hfov_rad: f64) -> Self {
        let focal = f64::from(width) / 2.0 / (hfov_rad / 2.0).tan();
        Self::centred(width, height, focal, Lens::BrownConrady(BrownConrady::default()))
    }

    /// Creates a camera with square pixels and the principal point in the centre.
    pub fn centred(width: u32, height: u32, focal_px: f64, lens: Lens) -> Self {
        Self {
            width,
            height,
            focal_px: DVec2::splat(focal_px),
            centre_px: DVec2::new(f64::from(width), f64::from(height)) / 2.0 - 0.5,
            lens,
        }
    }

    /// Returns the names of all parameters: fx, fy, cx, cy, then those of the lens.
    pub fn parameter_names(&self) -> Vec<String> {
        let projection = PROJECTION_PARAMETERS.map(str::to_owned).into_iter();
        projection.chain(self.lens.names()).collect()
    }

    /// Returns the values of all parameters, in the order of [`Self::parameter_names`].
    pub fn parameters(&self) -> Vec<f64> {
        let (focal, centre) = (self.focal_px, self.centre_px);
        let mut values = vec![focal.x, focal.y, centre.x, centre.y];
        values.extend(self.lens.parameters());
        values
    }

    /// Returns the camera with new parameter values; `values` has one entry per parameter.
    pub fn with_parameters(&self, values: &[f64]) -> Self {
        Self {
            width: self.width,
            height: self.height,
            focal_px: DVec2::new(values[0], values[1]),
            centre_px: DVec2::new(values[2], values[3]),
            lens: self.lens.with_parameters(&values[4..]),
        }
    }

    /// Projects a point of the camera frame to a pixel position, which may lie outside the image. Returns `None`
    /// outside the domain of the model.
    ///
    /// ```
    /// use deltille_core::camera::Camera;
    /// use glam::{DVec2, DVec3};
    ///
    /// let camera = Camera::pinhole(640, 480, std::f64::consts::FRAC_PI_2);
    /// // The field of view is 90°, so a point 45° to the right is at the middle of the right edge.
    /// let pixel = camera.project(DVec3::new(200.0, 0.0, 200.0)).unwrap();
    /// assert!(pixel.abs_diff_eq(DVec2::new(639.5, 239.5), 1e-9));
    /// let ray = camera.unproject(pixel).unwrap();
    /// assert!(ray.direction.angle_between(DVec3::new(1.0, 0.0, 1.0)) < 1e-6);
    /// ```
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        self.image(point).filter(|_| self.lens.covers(point))
    }

    /// Projects a point like [`Self::project`], but ignores gaps in the domain of a rational lens, because an optimiser
    /// must cross them.
    pub fn image(&self, point: DVec3) -> Option<DVec2> {
        let Imaged { at, .. } = self.lens.image(point, &mut [[0.0; 2]; MAX_LENS_PARAMETERS])?;
        let pixel = self.focal_px * at + self.centre_px;
        pixel.is_finite().then_some(pixel)
    }

    /// Projects a point like [`Self::image`], and computes the derivatives with respect to the point and to every
    /// parameter.
    pub fn project_with_derivatives(&self, point: DVec3) -> Option<Projection> {
        let mut found = Projection::EMPTY;
        self.project_into(point, &mut found)?;
        Some(found)
    }

    /// The same with a projection to overwrite, because copying one takes as long as computing it.
    pub fn project_into(&self, point: DVec3, found: &mut Projection) -> Option<()> {
        let focal = self.focal_px;
        let by_parameters = &mut found.by_parameters;
        let Imaged { at, by_point } = self.lens.image(point, &mut by_parameters[4..])?;
        for [by_x, by_y] in &mut by_parameters[4..] {
            (*by_x, *by_y) = (focal.x * *by_x, focal.y * *by_y);
        }
        by_parameters[..4].copy_from_slice(&[[at.x, 0.0], [0.0, at.y], [1.0, 0.0], [0.0, 1.0]]);
        found.pixel = focal * at + self.centre_px;
        found.by_point = [by_point[0].map(|v| focal.x * v), by_point[1].map(|v| focal.y * v)];
        found.knots = self.lens.knots(point);
        found.focal_px = focal;
        found.pixel.is_finite().then_some(())
    }

    /// Returns the line of sight of a pixel; `None` outside the domain of the model.
    pub fn unproject(&self, pixel: DVec2) -> Option<Ray> {
        self.lens.ray((pixel - self.centre_px) / self.focal_px)
    }

    /// Returns whether a pixel position lies in the image, at least `margin` pixels inside its border.
    pub fn sees(&self, DVec2 { x, y }: DVec2, margin: f64) -> bool {
        let low = margin - 0.5;
        x >= low
            && y >= low
            && x <= f64::from(self.width) - 1.0 - low
            && y <= f64::from(self.height) - 1.0 - low
    }
}
