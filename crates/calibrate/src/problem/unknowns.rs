//! The unknowns of cameras, targets and panels, and the observations of a block.

use std::sync::Arc;

use nalgebra::{Matrix6, Vector6};

use super::camera_prior::CameraPrior;
use super::roughness::Roughness;
use crate::input::constraint::Constrained;
use crate::input::observation::Observation;
use crate::input::panel::PanelRef;
use crate::model::without_gauge;
use deltille_core::camera::{Camera, Pose};

/// A camera and its unknowns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraUnknowns {
    /// The camera.
    pub camera: Camera,
    /// Which of its parameters are unknown, in the order of [`Camera::parameter_names`].
    pub free: Vec<bool>,
    /// Its pose on the rig.
    pub camera_from_rig: Pose,
    /// Whether the pose is unknown; one camera must stay fixed.
    pub pose_free: bool,
    /// The prior of the knots of a spline.
    pub roughness: Option<Roughness>,
    /// Groups of parameters that share one unknown.
    pub equal: Vec<Vec<usize>>,
    /// The prior of its parameters.
    pub prior: Option<CameraPrior>,
}

/// A target, whose panels move together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TargetUnknowns {
    /// Its pose in the scene.
    pub scene_from_target: Pose,
    /// Whether the pose is unknown; one target must stay fixed.
    pub pose_free: bool,
}

/// A panel of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PanelUnknowns {
    /// Index of its target.
    pub target: usize,
    /// Its pose on the target.
    pub target_from_panel: Pose,
    /// Whether the pose is unknown; one panel must stay fixed.
    pub pose_free: bool,
    /// The prior of the pose.
    pub prior: Option<Prior>,
}

/// A pose that was measured before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    pose: Pose,
    /// Inverse of the covariance of (ω, τ).
    information: Matrix6<f64>,
}

impl Prior {
    /// Creates the prior of a measured pose; `None` if the covariance has no inverse.
    pub(crate) fn new(pose: Pose, covariance: [[f64; 6]; 6]) -> Option<Self> {
        let covariance = Matrix6::from_fn(|i, j| covariance[i][j]);
        // Rotations and translations have different units. Scaling keeps this from looking like a
        // rank deficiency.
        let scale = Vector6::from_fn(|i, _| covariance[(i, i)].sqrt().recip());
        let scaled = Matrix6::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let information = Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        information.iter().all(|v| v.is_finite()).then_some(Self { pose, information })
    }

    /// Deviation (ω, τ) of a pose from the measured one, and its inverse covariance.
    pub(crate) fn off(&self, pose: &Pose) -> (Vector6<f64>, Matrix6<f64>) {
        let [turn, moved] = pose.off(&self.pose);
        let off = Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z);
        (off, self.information)
    }
}

/// The observations of one panel by one camera in one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Block {
    /// Index of the camera.
    pub camera: usize,
    /// Index of the frame.
    pub frame: usize,
    /// The panel.
    pub panel: PanelRef,
    /// The corners, which copies of a problem share.
    pub observations: Arc<[Observation]>,
}

impl CameraUnknowns {
    /// A single camera, which defines the rig frame.
    pub(crate) fn alone(camera: Camera, free: Vec<bool>) -> Self {
        let free = without_gauge(&camera.lens, free);
        let roughness = Roughness::of(&camera, &free);
        let camera_from_rig = Pose::IDENTITY;
        let equal = Vec::new();
        Self { camera, free, camera_from_rig, pose_free: false, roughness, equal, prior: None }
    }

    /// The same with constraints on those of its parameters that are unknown.
    pub(crate) fn constrained(camera: &Camera, free: Vec<bool>, by: &Constrained) -> Self {
        let mut unknowns = Self::alone(by.apply(camera), free);
        unknowns.equal.clone_from(&by.equal);
        unknowns.prior = CameraPrior::measured(&by.priors, &unknowns.camera, &unknowns.free);
        unknowns
    }

    /// The parameters of each unknown, in the order of the first of them.
    pub(crate) fn groups(&self) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for i in (0..self.free.len()).filter(|&i| self.free[i]) {
            let equal = self.equal.iter().find(|equal| equal.contains(&i));
            let other = equal.and_then(|equal| groups.iter_mut().find(|of| equal.contains(&of[0])));
            match other {
                Some(other) => other.push(i),
                None => groups.push(vec![i]),
            }
        }
        groups
    }

    /// Removes the prior of its knots.
    pub(crate) fn forget_expected(&mut self) {
        self.roughness = None;
    }
}

impl TargetUnknowns {
    /// The target that defines the scene frame.
    pub(crate) const SCENE: Self = Self { scene_from_target: Pose::IDENTITY, pose_free: false };
}
