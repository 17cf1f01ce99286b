//! Why a calibration fails, in sentences.

use std::fmt;

use deltille_core::setting::Setting::CalibrationRefinePanels;

/// How a rig moved too plainly to place cameras that do not see the same target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TooPlain {
    /// It did not turn.
    NoTurn,
    /// It turned about one axis.
    OneAxis,
}

impl fmt::Display for TooPlain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoTurn => {
                "and the rig was moved without being turned: how far the camera is from the others is not \
                 determined; turn the rig, or the targets before it, by 20° and more about two axes"
            }
            Self::OneAxis => {
                "and the rig was turned about one axis only: where the camera is along that axis is not \
                 determined; turn the rig, or the targets before it, about a second axis too"
            }
        })
    }
}

/// Why a camera was not calibrated. Messages say what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Images of different sizes.
    #[error(
        "{first} is {} × {} px, {other} is {} × {} px: calibrate one camera in one mode at a time",
        first_px[0], first_px[1], other_px[0], other_px[1]
    )]
    MixedSizes {
        /// A view.
        first: String,
        /// Its size.
        first_px: [u32; 2],
        /// A view of another size.
        other: String,
        /// Its size.
        other_px: [u32; 2],
    },
    /// Pictures of another size than the camera that is given for them.
    #[error(
        "the camera is of {} × {} px, {view} has {} × {} px: it is another camera's, or of another mode",
        camera_px[0], camera_px[1], view_px[0], view_px[1]
    )]
    OtherSize {
        /// Width and height that the camera has.
        camera_px: [u32; 2],
        /// A view.
        view: String,
        /// Its width and height.
        view_px: [u32; 2],
    },
    /// A detection of another target, or with labels that run the wrong way round.
    #[error("{view}: {problem}")]
    WrongDetection {
        /// The view.
        view: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Most detections are wrong in themselves.
    #[error("{first} ({wrong} of {all} detections are wrong)")]
    MostWrong {
        /// What is wrong with the first of them.
        first: Box<CalibrationError>,
        /// How many are wrong.
        wrong: usize,
        /// How many show something.
        all: usize,
    },
    /// Cameras that were given and did not take their pictures, which may be why nothing was found.
    #[error("the camera given for {cameras} did not take its pictures: {error}")]
    ForeignCameras {
        /// Their names.
        cameras: String,
        /// Why nothing was found.
        error: Box<CalibrationError>,
    },
    /// More frames than there are would have to be held out.
    #[error(
        "there are only {all} {}, so that none is the {every}-th",
        if *is_rig { "frames" } else { "views" }
    )]
    NothingHeldOut {
        /// Whether frames of several cameras are meant.
        is_rig: bool,
        /// Every how many-th was to be held out.
        every: usize,
        /// How many there are.
        all: usize,
    },
    /// Not enough views.
    #[error(
        "usable views: {found} of {all}; a calibration needs at least {needed}, tilted differently \
         (20 or more are better)"
    )]
    TooFewViews {
        /// How many can be used.
        found: usize,
        /// How many there are.
        all: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The board was never tilted.
    #[error(
        "all views are parallel (the board's tilt differs by at most {spread_deg:.1}°): focal \
         length and distance cannot be told apart; tilt the board by 20° to 45° in some views"
    )]
    Parallel {
        /// The largest angle between a view's board and the mean, degrees.
        spread_deg: f64,
    },
    /// A camera of a rig that saw nothing of the target.
    #[error("camera {camera}: no detection shows the target")]
    NotSeen {
        /// Its name.
        camera: String,
    },
    /// A camera of a rig by itself.
    #[error("camera {camera}: {error}")]
    OfCamera {
        /// Its name.
        camera: String,
        /// Why it was not calibrated.
        error: Box<CalibrationError>,
    },
    /// Cameras that nothing ties to the others.
    #[error(
        "{cameras}: {} the target in these and in another camera, {needed} are needed: pictures of \
         one moment must have the same file name in each folder, and some must show the target in \
         both cameras",
        match shared {
            0 => "no frame shows".to_owned(),
            1 => "only one frame shows".to_owned(),
            n => format!("no more than {n} frames show"),
        }
    )]
    Apart {
        /// Their names.
        cameras: String,
        /// How many frames are shared.
        shared: usize,
        /// How many are needed.
        needed: usize,
    },
    /// One of several targets that no camera saw.
    #[error("no detection shows target {target}")]
    TargetNotSeen {
        /// Its name.
        target: String,
    },
    /// One of several targets that nothing ties to the others.
    #[error(
        "target {target}: fewer than {needed} frames show it together with another target, in whichever \
         cameras: where it is to the others is not known"
    )]
    TargetApart {
        /// Its name.
        target: String,
        /// How many frames are needed.
        needed: usize,
    },
    /// A camera that sees a target of its own only, on a rig that moved too plainly.
    #[error("camera {camera} alone sees target {target}, {why}")]
    PlainMotion {
        /// The camera's name.
        camera: String,
        /// The target's name.
        target: String,
        /// What was missing.
        why: TooPlain,
    },
    /// Cameras that moved against each other.
    #[error(
        "in {wrong} of {all} frames the cameras do not agree where the target is, most of all camera \
         {camera}: they moved against each other, or pictures of the same name were not taken at the \
         same moment"
    )]
    NotRigid {
        /// The camera that is off in most of them.
        camera: String,
        /// Frames that do not fit.
        wrong: usize,
        /// All frames.
        all: usize,
    },
    /// The shape of a target of several panels.
    #[error(
        "the target has {panels} panels: the shape of a sheet is found for one board; the places of \
         the panels are found by {CalibrationRefinePanels}"
    )]
    ShapeOfMany {
        /// How many.
        panels: usize,
    },
    /// No focal length explains the views.
    #[error(
        "no camera explains the views: most corners must be wrongly labelled, or the target is not \
         the one that was photographed"
    )]
    NoStart,
    /// Somebody has ended it, see [`Calibration::stopped_by`](crate::Calibration::stopped_by).
    #[error("interrupted before it was solved")]
    Stopped,
    /// The views leave parameters open.
    #[error(
        "the views do not determine {parameters}: tilt the board more, fill the corners of the \
         image, or choose another model: this one has too many parameters, or does not hold the lens"
    )]
    Undetermined {
        /// The parameters' names.
        parameters: String,
    },
}
