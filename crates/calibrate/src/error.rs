//! Errors of a calibration and their messages.

use deltille_core::quantity::OutOfRange;
use std::fmt;

use deltille_core::setting::Setting::CalibrationRefinePanels;

/// Why the motion of a rig does not determine the pose of a camera that shares no target with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DegenerateMotion {
    /// The rig did not rotate.
    NoRotation,
    /// The rig rotated about one axis only.
    OneAxis,
}

impl fmt::Display for DegenerateMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoRotation => {
                "and the rig did not rotate, so the position of the camera relative to the others is \
                 undetermined; rotate the rig, or the targets in front of it, by at least 20° about two axes"
            }
            Self::OneAxis => {
                "and the rig rotated about one axis only, so the position of the camera along that axis is \
                 undetermined; also rotate the rig, or the targets in front of it, about a second axis"
            }
        })
    }
}

/// Why a constraint is unusable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConstraintError {
    /// A text that is not a constraint.
    #[error("`{text}` must be {expected}")]
    Syntax {
        /// The text.
        text: String,
        /// The expected form, with an example.
        expected: &'static str,
    },
    /// A parameter that the model does not estimate.
    #[error("{model} has no parameter {parameter} to estimate; it has {known}")]
    Unknown {
        /// The name that was given.
        parameter: String,
        /// The model.
        model: String,
        /// The parameters of the model, separated by commas.
        known: String,
    },
    /// A parameter fixed without a value that has no default value.
    #[error("{parameter} has no default value; give one, such as {parameter}=1.5")]
    NoDefault {
        /// Name of the parameter.
        parameter: String,
    },
    /// A parameter with two constraints that exclude each other.
    #[error(
        "{parameter} has two constraints; it may be fixed, equal to others, or have a prior (one prior is \
         allowed for equal parameters)"
    )]
    Twice {
        /// Name of the parameter.
        parameter: String,
    },
    /// A value of a parameter outside the range of camera files.
    #[error("{parameter}: {problem}")]
    Value {
        /// Name of the parameter.
        parameter: String,
        /// Its value and the range.
        problem: OutOfRange,
    },
    /// Equal parameters of different kinds.
    #[error(
        "{parameters} are different quantities and cannot be equal; parameters of one kind can, such as fx,fy"
    )]
    DifferentKinds {
        /// Their names.
        parameters: String,
    },
    /// A focal length or a standard deviation that is not positive.
    #[error("{what} of {parameter} must be a positive finite number, not {value}")]
    OutOfRange {
        /// Name of the parameter.
        parameter: String,
        /// The quantity: the value of a focal length, or a standard deviation.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl CalibrationError {
    /// Whether a constraint is unusable, whatever the views show.
    pub(crate) fn is_of_constraint(&self) -> bool {
        match self {
            Self::Constraint(_) => true,
            Self::OfCamera { error, .. } => error.is_of_constraint(),
            _ => false,
        }
    }
}

/// Why a calibration failed. Each message says what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Images of different sizes.
    #[error(
        "{first} is {} × {} px, {other} is {} × {} px: calibrate one camera in one mode at a time",
        first_px[0], first_px[1], other_px[0], other_px[1]
    )]
    MixedSizes {
        /// Name of the first view.
        first: String,
        /// Its width and height.
        first_px: [u32; 2],
        /// Name of a view of a different size.
        other: String,
        /// Its width and height.
        other_px: [u32; 2],
    },
    /// Images whose size differs from that of the given camera.
    #[error(
        "the given camera has {} × {} px, but {view} has {} × {} px: it comes from another camera or mode",
        camera_px[0], camera_px[1], view_px[0], view_px[1]
    )]
    OtherSize {
        /// Width and height of the given camera.
        camera_px: [u32; 2],
        /// Name of the view.
        view: String,
        /// Its width and height.
        view_px: [u32; 2],
    },
    /// A detection of another target, or one with mirrored labels.
    #[error("{view}: {problem}")]
    WrongDetection {
        /// Name of the view.
        view: String,
        /// The problem with it.
        problem: String,
    },
    /// More than half of the detections are wrong.
    #[error("{first} ({wrong} of {all} detections are wrong)")]
    MostWrong {
        /// The error of the first wrong detection.
        first: Box<CalibrationError>,
        /// Number of wrong detections.
        wrong: usize,
        /// Number of detections that are not empty.
        all: usize,
    },
    /// Given intrinsics that contradict the images, which may be the reason for the failure.
    #[error("the intrinsics given for {cameras} do not match the images: {error}")]
    WrongCameras {
        /// Names of the cameras.
        cameras: String,
        /// The failure.
        error: Box<CalibrationError>,
    },
    /// Constraints without which the calibration succeeds.
    #[error(
        "the constraints ({constraints}) contradict the views, which can be calibrated without them; with them: {error}"
    )]
    WrongConstraints {
        /// The constraints.
        constraints: String,
        /// The failure.
        error: Box<CalibrationError>,
    },
    /// Too few frames to hold out any.
    #[error(
        "cannot hold out one in {every} {}: there are only {all}",
        if *is_rig { "frames" } else { "views" }
    )]
    NothingHeldOut {
        /// Whether the calibration has several cameras.
        is_rig: bool,
        /// One frame in this many was to be held out.
        every: usize,
        /// Number of frames.
        all: usize,
    },
    /// Too few usable views.
    #[error(
        "usable views: {found} of {all}; a calibration needs at least {needed}, tilted differently \
         (20 or more are better)"
    )]
    TooFewViews {
        /// Number of usable views.
        found: usize,
        /// Number of all views.
        all: usize,
        /// Minimum number of usable views.
        needed: usize,
    },
    /// The board was never tilted.
    #[error(
        "all views are parallel (the board's tilt differs by at most {spread_deg:.1}°): focal \
         length and distance cannot be distinguished; tilt the board by 20° to 45° in some views"
    )]
    Parallel {
        /// Largest angle between the board in a view and its mean orientation, degrees.
        spread_deg: f64,
    },
    /// A camera of a rig that did not see the target.
    #[error("camera {camera}: no detection shows the target")]
    NotSeen {
        /// Name of the camera.
        camera: String,
    },
    /// An error of one camera of a rig.
    #[error("camera {camera}: {error}")]
    OfCamera {
        /// Name of the camera.
        camera: String,
        /// Why its calibration failed.
        error: Box<CalibrationError>,
    },
    /// Cameras that share too few frames with the others.
    #[error(
        "{cameras}: {} the target in these and in another camera, but at least {needed} are needed; \
         images taken at the same time must have the same file name in each folder, and some must show \
         the target in both cameras",
        match shared {
            0 => "no frame shows".to_owned(),
            1 => "only one frame shows".to_owned(),
            n => format!("only {n} frames show"),
        }
    )]
    Apart {
        /// Names of the cameras.
        cameras: String,
        /// Number of shared frames.
        shared: usize,
        /// Minimum number of shared frames.
        needed: usize,
    },
    /// One of several targets, seen by no camera.
    #[error("no detection shows target {target}")]
    TargetNotSeen {
        /// Name of the target.
        target: String,
    },
    /// One of several targets that shares too few frames with the others.
    #[error(
        "target {target}: fewer than {needed} frames show it together with another target (in any of the \
         cameras), so its pose relative to the others is undetermined"
    )]
    TargetApart {
        /// Name of the target.
        target: String,
        /// Minimum number of shared frames.
        needed: usize,
    },
    /// A camera that shares no target with the others, on a rig whose motion does not determine its pose.
    #[error("only camera {camera} sees target {target}, {why}")]
    PlainMotion {
        /// Name of the camera.
        camera: String,
        /// Name of the target.
        target: String,
        /// The rotation that was missing.
        why: DegenerateMotion,
    },
    /// Cameras that moved relative to each other.
    #[error(
        "in {wrong} of {all} frames the cameras disagree about the pose of the target, most often camera \
         {camera}: the cameras moved relative to each other, or images of the same name were not taken at \
         the same time"
    )]
    NotRigid {
        /// The camera that disagrees in most of these frames.
        camera: String,
        /// Number of frames that do not fit.
        wrong: usize,
        /// Number of all frames.
        all: usize,
    },
    /// A board shape requested for a target of several panels.
    #[error(
        "the target has {panels} panels, but a board shape can be estimated for a single board only; \
         {CalibrationRefinePanels} estimates the poses of the panels"
    )]
    ShapeOfMany {
        /// Number of panels.
        panels: usize,
    },
    /// A constraint on a parameter that is unusable.
    #[error("{0}")]
    Constraint(#[from] ConstraintError),
    /// No focal length fits the views.
    #[error(
        "no camera fits the views: most corners are mislabelled, or the target is not the one that was \
         photographed"
    )]
    NoStart,
    /// Stopped by the caller, see [`Calibration::cancelled_by`](crate::Calibration::cancelled_by).
    #[error("interrupted before the calibration was finished")]
    Stopped,
    /// Parameters that the views do not determine.
    #[error(
        "the views do not determine {parameters}: tilt the board more, place it in the four corners of the image, \
         or choose another model (this one has too many parameters, or does not fit the lens)"
    )]
    Undetermined {
        /// Names of the parameters.
        parameters: String,
    },
}
