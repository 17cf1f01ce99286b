//! The result of a check.

use std::fmt;

use deltille_core::setting::Setting::{CalibrationMeasureTarget, CalibrationWrite};

/// Whether a camera or a rig is still as calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Answer {
    /// The views agree with the calibration, and a relevant change would have been found.
    Unchanged,
    /// The views contradict the calibration.
    Changed,
    /// The views agree with the calibration, but would agree with a relevantly changed camera too; or a necessary
    /// input is missing.
    CannotTell,
}

impl Answer {
    /// The word for the answer in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unchanged => "unchanged",
            Self::Changed => "changed",
            Self::CannotTell => "cannot_tell",
        }
    }
}

/// What may have changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Both focal lengths by the same factor: zoom or focus.
    FocalLength,
    /// The principal point: the mount of the lens or of the sensor, image stabilisation, or a crop of equal size.
    PrincipalPoint,
    /// The other parameters of the lens.
    Distortion,
    /// Stretch, shear and bend of the board: it is bent, or another print.
    Board,
    /// The pose of the camera on the rig, relative to the first camera.
    Pose,
    /// The number of pixels in the image.
    Resolution,
    /// The shape of the image: a part of the sensor.
    Crop,
    /// Width and height are exchanged: the images are rotated by 90°.
    Orientation,
}

impl Quantity {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::FocalLength => "focal_length",
            Self::PrincipalPoint => "principal_point",
            Self::Distortion => "distortion",
            Self::Board => "board",
            Self::Pose => "pose",
            Self::Resolution => "resolution",
            Self::Crop => "crop",
            Self::Orientation => "orientation",
        }
    }

    /// The unit of a change.
    pub fn unit(self) -> &'static str {
        match self {
            Self::FocalLength => "%",
            Self::Board => "mm",
            _ => "px",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(match self {
            Self::FocalLength => "focal length (zoom or focus)",
            Self::PrincipalPoint => {
                "principal point (mount of lens or sensor, stabilisation, crop)"
            }
            Self::Distortion => "distortion",
            Self::Board => "board (bent, or another print)",
            Self::Pose => "pose on the rig",
            Self::Resolution => "resolution",
            Self::Crop => "crop",
            Self::Orientation => "orientation (images rotated by 90°)",
        })
    }
}

/// A quantity of a camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Suspect {
    /// Name of the camera; empty for a single camera, and for the board.
    pub camera: String,
    /// The quantity.
    pub quantity: Quantity,
}

impl fmt::Display for Suspect {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.camera.is_empty() {
            true => self.quantity.fmt(to),
            false => write!(to, "{}: {}", self.camera, self.quantity),
        }
    }
}

/// The test of one quantity.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct QuantityTest {
    /// The quantity.
    pub of: Suspect,
    /// The estimated change if nothing else changed, in the unit of the quantity: a signed percentage for the focal
    /// length; the length of the shift of the principal point; the RMS displacement in the calibrated part of the image
    /// for distortion; the RMS displacement of corners for the board; the RMS displacement of the detected corners in
    /// the image for the pose.
    pub change: f64,
    /// Probability that an unchanged camera and board show at least this change.
    pub p_value: f64,
    /// The change that would have been found with a probability of 90 %, along the least visible direction.
    pub detectable: f64,
    /// The change that would be found if the views determined the camera without an error: the calibration has errors, too.
    pub(crate) attainable: f64,
    /// The largest detectable change that suffices for the answer `unchanged`; `None` if any does.
    pub limit: Option<f64>,
}

impl QuantityTest {
    /// Whether a relevant change would have been found.
    pub fn is_determined(&self) -> bool {
        self.limit.is_none_or(|limit| self.detectable <= limit)
    }
}

/// How the views show the board.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Shown {
    /// The largest angle between the line of sight and the normal of a panel, degrees.
    pub tilt_deg: f64,
    /// The largest distance of a corner from the image centre, in half diagonals of the image.
    pub reach: f64,
}

/// The largest tilt with which the distance of the board is hardly distinguishable from a focal length, degrees.
const HEAD_ON_DEG: f64 = 15.0;

/// The reach in half diagonals below which corners do not show the outer half of the image's area.
const CENTRAL: f64 = 0.7;

/// The remedy for the most limiting property of the views.
impl fmt::Display for Shown {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.tilt_deg < HEAD_ON_DEG {
            return write!(
                to,
                "the board is tilted by at most {:.0}°: tilt it by 30° or more, about different axes",
                self.tilt_deg
            );
        }
        if self.reach < CENTRAL {
            return write!(
                to,
                "the corners reach only {:.0} % of the distance from the image centre to its corners: place the board \
                 near the borders, too",
                100.0 * self.reach
            );
        }
        to.write_str("take more photographs, with the board large and tilted")
    }
}

/// Why a check has no answer.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Missing {
    /// The calibration has no covariance.
    Covariance,
    /// The calibration has no observed covariance, because it has too few views or was written by an earlier version.
    Observed,
    /// The lens is a spline, whose knots are not separate quantities.
    Spline,
    /// No view of a camera shows enough of the target.
    Views {
        /// Name of the camera; empty for a single camera.
        camera: String,
    },
    /// No views of several cameras at the same time relate the cameras to each other.
    Link,
    /// Neither the camera nor a changed camera fits the views.
    Fit {
        /// RMS residual of the best fit per axis, px.
        rms_px: f64,
    },
    /// The views would hardly show a change of this quantity.
    Undetermined {
        /// The quantity.
        of: Suspect,
        /// The change that would have been found.
        detectable: f64,
        /// The largest useful value of it.
        limit: f64,
        /// How the views of this camera show the board; `None` if no views would suffice, because the calibration is too
        /// uncertain.
        shown: Option<Shown>,
    },
}

impl Missing {
    /// The word for it in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Covariance => "covariance",
            Self::Observed => "observed_covariance",
            Self::Spline => "spline",
            Self::Views { .. } => "views",
            Self::Link => "link",
            Self::Fit { .. } => "fit",
            Self::Undetermined { .. } => "undetermined",
        }
    }
}

impl fmt::Display for Missing {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Covariance => write!(
                to,
                "the camera file has no uncertainties: use the .json written by {CalibrationWrite}, with estimated \
                 intrinsics"
            ),
            Self::Observed => to.write_str(
                "the calibration has no observed covariance: calibrate again, with 10 views or more",
            ),
            Self::Spline => to.write_str(
                "the camera model is a spline, which has no focal length and principal point to test: use a parametric model",
            ),
            Self::Views { camera } if camera.is_empty() => {
                to.write_str("no photograph shows enough corners of the target")
            }
            Self::Views { camera } => {
                write!(to, "no photograph of {camera} shows enough corners of the target")
            }
            Self::Link => to.write_str(
                "the photographs do not relate all cameras to each other: photograph the board with several cameras at the \
                 same time, and give photographs of the same time the same file name",
            ),
            Self::Fit { rms_px } => write!(
                to,
                "neither the camera nor a changed camera fits the photographs (RMS {rms_px:.2} px): check the target and the \
                 camera file"
            ),
            Self::Undetermined { of, detectable, limit, shown } => {
                let unit = of.quantity.unit();
                let name = of.quantity.name().replace('_', " ");
                let camera = match of.camera.as_str() {
                    "" => String::new(),
                    camera => format!(" of {camera}"),
                };
                let far = match detectable.is_finite() && *detectable < 1e3 * limit {
                    true => format!("{detectable:.2} {unit}"),
                    false => "any size".to_owned(),
                };
                write!(
                    to,
                    "a change of the {name}{camera} of {far} could go unnoticed (at most {limit:.2} {unit} is useful): "
                )?;
                match shown {
                    Some(shown) => shown.fmt(to),
                    None => write!(
                        to,
                        "the calibration itself is too uncertain; calibrate again with more views, and measure the target \
                         ({CalibrationMeasureTarget}) or state the accuracy of the board there"
                    ),
                }
            }
        }
    }
}

/// Whether a camera is still as calibrated, and the evidence.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Check {
    /// The answer.
    pub answer: Answer,
    /// What has changed: these quantities together. Empty if nothing has.
    pub changed: Vec<Suspect>,
    /// Other quantities, each alone explaining the views as well as [`changed`](Self::changed).
    pub or: Vec<Suspect>,
    /// Why there is no answer.
    pub missing: Vec<Missing>,
    /// The tests of single quantities.
    pub tests: Vec<QuantityTest>,
    /// Probability that an unchanged camera and board differ at least as much in all quantities together.
    pub p_value: Option<f64>,
    /// Number of views that were used.
    pub views: usize,
    /// Number of corners that were used.
    pub corners: usize,
    /// RMS residual of the best fit per axis, px.
    pub rms_px: f64,
    /// Image size of the camera and of its views, px: of the first camera for which they differ, else of the first.
    pub sizes_px: [[u32; 2]; 2],
    /// Two cameras whose views contradict the calibration, and agree with it if they are exchanged.
    pub exchanged: Option<[String; 2]>,
}
