//! Views, frames and panels that take no part, and why.

use std::fmt;

use serde::{Serialize, Serializer};

/// A view, a frame or a panel in a view that took no part in a calibration, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excluded {
    /// Name of the camera, in a rig; `None` where all its cameras are meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Name of the view, or of the frame of a rig.
    pub view: String,
    /// File name of the picture; empty where pictures of several cameras are meant.
    pub image: String,
    /// Id of the panel that is wrong in itself; `None` where the view does not fit as a whole.
    pub panel: Option<u32>,
    /// How many corners were left out by it.
    pub corners: usize,
    /// Why it was left out.
    pub reason: Reason,
}

/// Why something takes no part.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// A detection that is not of the target, and what is wrong with it.
    Foreign(String),
    /// The picture of another view once more, which tells nothing new.
    Copy {
        /// Name of the other view.
        of: String,
    },
    /// A view for which there is no pose.
    NoPose,
    /// A view whose corners are too far off.
    Off {
        /// The median error of its corners, px.
        off_px: f64,
        /// That of other views, px.
        usual_px: f64,
    },
    /// A frame of a rig in which one camera's corners are too far off.
    AnotherMoment {
        /// Name of the camera.
        camera: String,
        /// The median error of its corners, px.
        off_px: f64,
    },
    /// A frame that speaks for other cameras than all others do.
    Stranger {
        /// Whether there are several cameras.
        is_rig: bool,
        /// By how many of their deviations the cameras would move.
        deviations: f64,
    },
    /// Labels that run the wrong way round.
    Mirrored,
    /// A frame that shows only panels that take no part.
    OnlyWrongPanels,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign(problem) => f.write_str(problem),
            Self::Copy { of } => write!(f, "it is the picture of {of} once more, and counts once"),
            Self::NoPose => f.write_str(
                "no pose explains its corners: wrong labels, another target, or corners where the lens \
                 model has ended",
            ),
            Self::Off { off_px, usual_px } => write!(
                f,
                "its corners are off by {off_px:.1} px where those of other views are by {usual_px:.2} px: \
                 wrong labels, or another target"
            ),
            Self::AnotherMoment { camera, off_px } => write!(
                f,
                "the corners of camera {camera} are off by {off_px:.1} px: not taken at the same moment, or \
                 wrong labels"
            ),
            Self::Stranger { is_rig: false, deviations } => write!(
                f,
                "it speaks for another camera than the other views do, and would move theirs by \
                 {deviations:.1} deviations: another zoom, focus or crop, or a board that was bent"
            ),
            Self::Stranger { is_rig: true, deviations } => write!(
                f,
                "it speaks for other cameras than the other frames do, and would move theirs by \
                 {deviations:.1} deviations: not taken at the same moment, or one had moved"
            ),
            Self::Mirrored => f.write_str(
                "the labels are mirrored: rows and columns are exchanged, or the image was flipped",
            ),
            Self::OnlyWrongPanels => f.write_str(
                "it shows only panels that are not where the target's file has them",
            ),
        }
    }
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Excluded {
    /// The view's name, in a rig with its camera's.
    pub fn shown(&self) -> String {
        match &self.camera {
            Some(camera) => format!("{} of camera {camera}", self.view),
            None => self.view.clone(),
        }
    }
}
