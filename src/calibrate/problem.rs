use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use super::shape::Shape;
use crate::camera::{Camera, Pose, Projection};

/// A corner that a camera saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Lattice row on its panel.
    pub row: i32,
    /// Lattice column on its panel.
    pub col: i32,
    /// Its place in the panel frame, mm.
    pub panel_mm: DVec3,
    /// Where it was seen, px.
    pub pixel: [f64; 2],
    /// Covariance xx, xy, yy of that, px²; `None` where it is not known.
    pub cov: Option<[f64; 3]>,
}

/// A camera and what of it is unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraUnknowns {
    /// The camera.
    pub camera: Camera,
    /// Which of its parameters are unknown, in the order of [`Camera::parameter_names`].
    pub free: Vec<bool>,
    /// Where it is on the rig.
    pub camera_from_rig: Pose,
    /// Whether that is unknown; one camera must stay where it is.
    pub pose_free: bool,
}

/// A panel of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelUnknowns {
    /// Where it is on the target.
    pub target_from_panel: Pose,
    /// Whether that is unknown; one panel must stay where it is.
    pub pose_free: bool,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
}

/// A pose that was measured before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    pose: Pose,
    /// Inverse of the covariance of (ω, τ).
    information: Matrix6<f64>,
}

impl Prior {
    /// A measured pose; `None` where the covariance has no inverse.
    pub fn new(pose: Pose, covariance: [[f64; 6]; 6]) -> Option<Self> {
        let covariance = Matrix6::from_fn(|i, j| covariance[i][j]);
        // Turns and moves have different units: their scale must not look like a lack of rank.
        let scale = Vector6::from_fn(|i, _| covariance[(i, i)].sqrt().recip());
        let scaled = Matrix6::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let information = Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        information.iter().all(|v| v.is_finite()).then_some(Self { pose, information })
    }

    /// How far a pose is from the measured one, as (ω, τ), and the inverse covariance of that.
    pub(super) fn off(&self, pose: &Pose) -> (Vector6<f64>, Matrix6<f64>) {
        let [turn, moved] = pose.off(&self.pose);
        let off = Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z);
        (off, self.information)
    }
}

/// What one camera saw of one panel in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Index of the camera.
    pub camera: usize,
    /// Index of the frame.
    pub frame: usize,
    /// Index of the panel.
    pub panel: usize,
    /// The corners.
    pub observations: Vec<Observation>,
}

/// Unknowns and observations. The pose of every frame is unknown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problem {
    /// Cameras.
    pub cameras: Vec<CameraUnknowns>,
    /// rig_from_target, for each moment at which pictures were taken.
    pub frames: Vec<Pose>,
    /// Panels.
    pub panels: Vec<PanelUnknowns>,
    /// Observations.
    pub blocks: Vec<Block>,
    /// How the panels' sheets differ from their plan, where that is unknown too; of one panel.
    pub shape: Option<Shape>,
}

impl CameraUnknowns {
    /// A single camera, which is the rig.
    pub fn alone(camera: Camera, free: Vec<bool>) -> Self {
        Self { camera, free, camera_from_rig: Pose::IDENTITY, pose_free: false }
    }
}

impl Problem {
    /// Where a corner is in the frame of the camera that saw it, mm.
    pub fn camera_point(&self, block: &Block, observation: &Observation) -> DVec3 {
        let shape = self.shape.map_or(DVec3::ZERO, |shape| shape.offset(observation.panel_mm));
        let at = observation.panel_mm + shape;
        let target = self.panels[block.panel].target_from_panel.apply(at);
        let rig = self.frames[block.frame].apply(target);
        self.cameras[block.camera].camera_from_rig.apply(rig)
    }

    /// Seen less predicted positions of a block's corners, px; `None` where one is out of the
    /// model's reach.
    pub fn residuals(&self, block: &Block) -> Option<Vec<[f64; 2]>> {
        let camera = &self.cameras[block.camera].camera;
        let residual = |seen: &Observation| {
            let Projection { pixel: [x, y], .. } =
                camera.project_with_derivatives(self.camera_point(block, seen))?;
            Some([seen.pixel[0] - x, seen.pixel[1] - y])
        };
        block.observations.iter().map(residual).collect()
    }

    /// How many corners there are in all.
    pub fn count(&self) -> usize {
        self.blocks.iter().map(|block| block.observations.len()).sum()
    }

    /// The same with the frames for which `keep` holds, and their observations.
    pub(super) fn with_frames(&self, keep: impl Fn(usize) -> bool) -> Problem {
        let mut places = vec![None; self.frames.len()];
        let mut frames = Vec::new();
        for (index, pose) in self.frames.iter().enumerate().filter(|&(index, _)| keep(index)) {
            places[index] = Some(frames.len());
            frames.push(*pose);
        }
        let blocks = self
            .blocks
            .iter()
            .filter_map(|block| Some(Block { frame: places[block.frame]?, ..block.clone() }));
        let blocks = blocks.collect();
        let (cameras, panels) = (self.cameras.clone(), self.panels.clone());
        Problem { cameras, frames, panels, blocks, shape: self.shape }
    }
}

/// A pose after a small change (ω, τ).
pub(super) fn moved(pose: &Pose, change: &[f64]) -> Pose {
    let turn = glam::DQuat::from_scaled_axis(DVec3::from_slice(&change[..3]));
    Pose {
        rotation: (turn * pose.rotation).normalize(),
        translation: pose.translation + DVec3::from_slice(&change[3..6]),
    }
}
