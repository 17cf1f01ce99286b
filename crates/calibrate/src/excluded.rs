//! Views, frames and panels excluded from a calibration, with the reasons.

use std::fmt;

use serde::{Serialize, Serializer};

/// A view, a frame or a panel in a view that was excluded from a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excluded {
    /// Name of the camera in a rig; `None` if the whole frame was excluded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Name of the view, or of the frame of a rig.
    pub view: String,
    /// File name of the image; empty if images of several cameras were excluded.
    pub image: String,
    /// Id of the panel that does not fit; `None` if the view as a whole does not fit.
    pub panel: Option<u32>,
    /// Number of excluded corners.
    pub corners: usize,
    /// Why it was excluded.
    pub reason: Reason,
}

/// Why a view, a frame or a panel was excluded.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// A detection that is not of the target; the text states the problem.
    Foreign(String),
    /// An image identical to that of another view, which adds no information.
    Copy {
        /// Name of the other view.
        of: String,
    },
    /// A view that no pose fits.
    NoPose,
    /// A view whose residuals are too large.
    Off {
        /// Median residual of its corners, px.
        off_px: f64,
        /// Median residual of the corners of other views, px.
        usual_px: f64,
    },
    /// A frame of a rig in which the residuals of one camera are too large.
    AnotherMoment {
        /// Name of the camera.
        camera: String,
        /// Median residual of its corners, px.
        off_px: f64,
    },
    /// A frame that contradicts the cameras estimated from the remaining frames.
    Stranger {
        /// Whether the calibration has several cameras.
        is_rig: bool,
        /// Shift of the cameras that the frame would cause, in standard deviations.
        deviations: f64,
    },
    /// Mirrored labels.
    Mirrored,
    /// A frame that shows only excluded panels.
    OnlyWrongPanels,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign(problem) => f.write_str(problem),
            Self::Copy { of } => write!(f, "it is a copy of the image of {of}, which is counted once"),
            Self::NoPose => f.write_str(
                "no pose fits its corners: wrong labels, another target, or corners beyond the valid range \
                 of the lens model",
            ),
            Self::Off { off_px, usual_px } => write!(
                f,
                "its corners are off by {off_px:.1} px, those of other views by only {usual_px:.2} px: \
                 wrong labels, another target, or a lens that the model does not fit there"
            ),
            Self::AnotherMoment { camera, off_px } => write!(
                f,
                "the corners of camera {camera} are off by {off_px:.1} px: its image was taken at another \
                 time, or its labels are wrong"
            ),
            Self::Stranger { is_rig: false, deviations } => write!(
                f,
                "this view implies a different camera: it would shift the intrinsics by {deviations:.1}σ \
                 (zoom, focus or crop changed, the board bent, or the model does not fit the lens there)"
            ),
            Self::Stranger { is_rig: true, deviations } => write!(
                f,
                "this frame implies different cameras: it would shift their parameters by {deviations:.1}σ \
                 (its images were not taken at the same time, or a camera moved)"
            ),
            Self::Mirrored => f.write_str(
                "the labels are mirrored: rows and columns are swapped, or the image was flipped",
            ),
            Self::OnlyWrongPanels => f.write_str(
                "it shows only panels that are not where the target file places them",
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
    /// Whether the lens may depart from its model where the corners lie, so that the view itself is right.
    pub(crate) fn may_be_of_lens(&self) -> bool {
        let is_of_lens = match self.reason {
            Reason::NoPose | Reason::Off { .. } | Reason::Stranger { .. } => true,
            Reason::Foreign(_)
            | Reason::Copy { .. }
            | Reason::AnotherMoment { .. }
            | Reason::Mirrored
            | Reason::OnlyWrongPanels => false,
        };
        self.panel.is_none() && is_of_lens
    }

    /// The name of the view, followed in a rig by that of the camera.
    pub fn shown(&self) -> String {
        match &self.camera {
            Some(camera) => format!("{} of camera {camera}", self.view),
            None => self.view.clone(),
        }
    }
}
