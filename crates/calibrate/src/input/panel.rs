//! Panels of a target: which one, and where it is.

use std::fmt;

use serde::{Serialize, Serializer};

use deltille_core::camera::Pose;
use deltille_core::targets::PanelPose;

/// One of the panels of what was photographed.
///
/// It has a place among them, by which everything that is kept for each is found, and an id, which stands
/// in the target's file and on the print. Only the id is shown and written, and only the place finds anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PanelRef {
    index: usize,
    id: u32,
}

impl PanelRef {
    /// The only panel of an untagged board that no file describes.
    pub const ONLY: Self = Self { index: 0, id: 0 };

    /// The panel with this place and this id.
    pub fn new(index: usize, id: u32) -> Self {
        Self { index, id }
    }

    /// Its place among the panels of the target.
    pub fn index(self) -> usize {
        self.index
    }

    /// Its id.
    pub fn id(self) -> u32 {
        self.id
    }
}

impl fmt::Display for PanelRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.id.fmt(f)
    }
}

impl Serialize for PanelRef {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.id.serialize(serializer)
    }
}

/// The pose of a panel on its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelPlace {
    /// The pose, from the panel frame to the target frame, mm.
    pub target_from_panel: Pose,
    /// Covariance of a turn (rad) and a move (mm) along the target's axes, where it was measured;
    /// `None` where it is as stated.
    pub covariance: Option<[[f64; 6]; 6]>,
}

impl From<&PanelPose> for PanelPlace {
    fn from(pose: &PanelPose) -> Self {
        Self { target_from_panel: pose.to_pose(), covariance: pose.covariance }
    }
}

impl From<Pose> for PanelPlace {
    fn from(target_from_panel: Pose) -> Self {
        Self { target_from_panel, covariance: None }
    }
}
