//! The result of a check.

use std::fmt;

use deltille_core::setting::Setting::CalibrationWrite;

/// Whether a camera is still as calibrated.
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
    /// The number of pixels in the image.
    Resolution,
    /// The shape of the image: a part of the sensor.
    Crop,
}

impl Quantity {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::FocalLength => "focal_length",
            Self::PrincipalPoint => "principal_point",
            Self::Distortion => "distortion",
            Self::Board => "board",
            Self::Resolution => "resolution",
            Self::Crop => "crop",
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
            Self::Resolution => "resolution",
            Self::Crop => "crop",
        })
    }
}

/// The test of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct QuantityTest {
    /// The quantity.
    pub quantity: Quantity,
    /// The estimated change if nothing else changed, in the unit of the quantity: a signed percentage for the focal
    /// length; the length of the shift of the principal point; the RMS displacement in the calibrated part of the image
    /// for distortion; the RMS displacement of corners for the board.
    pub change: f64,
    /// Probability that an unchanged camera and board show at least this change.
    pub p_value: f64,
    /// The change that would have been found with a probability of 90 %, along the least visible direction.
    pub detectable: f64,
    /// The largest detectable change that suffices for the answer `unchanged`; `None` if any does.
    pub limit: Option<f64>,
}

impl QuantityTest {
    /// Whether a relevant change would have been found.
    pub fn is_determined(&self) -> bool {
        self.limit.is_none_or(|limit| self.detectable <= limit)
    }
}

/// How to determine a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedial {
    /// The board is seen head-on in all views.
    Tilt,
    /// The corners cover only the central part of the image.
    Spread,
    /// Neither: more views are needed.
    More,
}

impl fmt::Display for Remedial {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(match self {
            Self::Tilt => "the board is seen head-on: tilt it by 30° or more",
            Self::Spread => {
                "there are corners only in the central part of the image: place the board near its borders"
            }
            Self::More => "take more photographs, with the board large and tilted",
        })
    }
}

/// Why a check has no answer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Missing {
    /// The calibration has no covariance.
    Covariance,
    /// The calibration has no observed covariance, because it has too few views.
    Observed,
    /// The lens is a spline, whose knots are not separate quantities.
    Spline,
    /// No view shows enough of the target.
    Views,
    /// Neither the camera nor a changed camera fits the views.
    Fit {
        /// RMS residual of the best fit per axis, px.
        rms_px: f64,
    },
    /// The views would hardly show a change of this quantity.
    Undetermined {
        /// The quantity.
        quantity: Quantity,
        /// The change that would have been found.
        detectable: f64,
        /// The largest useful value of it.
        limit: f64,
        /// The remedy.
        remedy: Remedial,
    },
}

impl Missing {
    /// The word for it in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Covariance => "covariance",
            Self::Observed => "observed_covariance",
            Self::Spline => "spline",
            Self::Views => "views",
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
                "the camera was calibrated with too few views for an observed covariance: calibrate with 10 views or more",
            ),
            Self::Spline => to.write_str(
                "the camera model is a spline, which has no focal length and principal point to test: use a parametric model",
            ),
            Self::Views => to.write_str("no photograph shows enough corners of the target"),
            Self::Fit { rms_px } => write!(
                to,
                "neither the camera nor a changed camera fits the photographs (RMS {rms_px:.2} px): check the target and the \
                 camera file"
            ),
            Self::Undetermined { quantity, detectable, limit, remedy } => {
                let unit = quantity.unit();
                let name = match quantity {
                    Quantity::FocalLength => "focal length",
                    Quantity::PrincipalPoint => "principal point",
                    _ => "distortion",
                };
                let far = match detectable.is_finite() && *detectable < 1e3 * limit {
                    true => format!("{detectable:.2} {unit}"),
                    false => "any size".to_owned(),
                };
                write!(
                    to,
                    "a change of the {name} of {far} could go unnoticed (at most {limit:.2} {unit} is useful): {remedy}"
                )
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
    pub changed: Vec<Quantity>,
    /// Other quantities, each alone explaining the views as well as [`changed`](Self::changed).
    pub or: Vec<Quantity>,
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
    /// Image size of the camera and of the views, px.
    pub sizes_px: [[u32; 2]; 2],
}
