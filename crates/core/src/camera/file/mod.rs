//! Camera files. The project's own YAML (or JSON) format supports every model. Files of OpenCV, ROS, Kalibr, COLMAP and
//! mrcal can be read too.
//!
//! 1. `fields`: the camera from the numbers of a file, each in its range;
//! 2. `foreign`: files of other programs;
//! 3. `own`: the project's own format, and the choice between all formats.
//!
//! ```
//! let text = "
//! width: 1280
//! height: 960
//! focal_px: [1100, 1100]
//! centre_px: [639.5, 479.5]
//! model: pinhole
//! distortion: [-0.1, 0.02]
//! ";
//! let camera = deltille_core::camera::Camera::from_yaml(text)?;
//! assert_eq!(camera.width, 1280);
//! assert_eq!(deltille_core::camera::Camera::from_yaml(&camera.to_yaml())?, camera);
//! # Ok::<(), deltille_core::camera::CameraFileError>(())
//! ```
//!
//! | `model` | `distortion` |
//! |---|---|
//! | `pinhole` | k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; omitted ones at the end are zero |
//! | `fisheye` | k1 k2 k3 k4 or more; omitted ones are zero |
//! | `eucm` | α β |
//! | `double-sphere` | ξ α |
//! | `pupil` | k1 k2 k3 k4 k5 p1 p2 e1 e2 e3 |
//! | `spline` | dx dy of each knot, row by row; `spline` has `degree`, `columns`, `rows`, `fov_x_deg` |
//!
//! Limits: a lens that no model here represents exactly is rejected, such as OpenCV's tilted sensor and the FOV models of
//! Kalibr and COLMAP.

mod fields;
mod foreign;
mod own;

pub use fields::CameraFileError;
pub use own::CameraFile;
