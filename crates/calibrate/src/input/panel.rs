//! Panels of a target: their identity and pose.

use std::fmt;

use serde::{Serialize, Serializer};

use deltille_core::camera::Pose;
use deltille_core::targets::PanelPose;

/// A reference to one of the photographed panels.
///
/// The index is the key of all data that are stored per panel. The id is in the target file and on
/// the print. Only the id is displayed and written, and only the index is used for lookup.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PanelRef {
    index: usize,
    id: u32,
}

impl PanelRef {
    /// The only panel of an untagged board without a description file.
    pub const ONLY: Self = Self { index: 0, id: 0 };

    /// Creates the reference to the panel of this index and id.
    pub fn new(index: usize, id: u32) -> Self {
        Self { index, id }
    }

    /// Its index among the panels of the target.
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
pub struct PanelPrior {
    /// The pose, from the panel frame to the target frame, mm.
    pub target_from_panel: Pose,
    /// Covariance of rotation (rad) and translation (mm) along the axes of the target, if the pose
    /// was measured; `None` if the pose is exactly as stated.
    pub covariance: Option<[[f64; 6]; 6]>,
}

impl From<&PanelPose> for PanelPrior {
    fn from(pose: &PanelPose) -> Self {
        Self { target_from_panel: pose.to_pose(), covariance: pose.covariance }
    }
}

impl From<Pose> for PanelPrior {
    fn from(target_from_panel: Pose) -> Self {
        Self { target_from_panel, covariance: None }
    }
}
