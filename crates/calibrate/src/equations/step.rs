//! A step of all unknowns, and a problem after it.

use glam::DVec3;
use nalgebra::{DVector, Vector3, Vector6};

use super::layout::Layout;
use crate::problem::bundle::Problem;
use deltille_core::camera::Pose;

/// A step of all unknowns.
pub(crate) struct Step {
    pub shared: DVector<f64>,
    pub frames: Vec<Vector6<f64>>,
    pub corners: Vec<Vector3<f64>>,
}

impl Problem {
    /// The problem after a step.
    pub(crate) fn after(&self, layout: &Layout, step: &Step) -> Problem {
        let mut problem = self.clone();
        for (i, camera) in problem.cameras.iter_mut().enumerate() {
            let mut values = camera.camera.parameters();
            for &(parameter, column) in &layout.parameters[i] {
                values[parameter] += step.shared[column];
            }
            camera.camera = camera.camera.with_parameters(&values);
            if let Some(first) = layout.cameras[i] {
                let change = &step.shared.as_slice()[first..first + 6];
                camera.camera_from_rig = moved(&camera.camera_from_rig, change);
            }
        }
        for (panel, first) in problem.panels.iter_mut().zip(&layout.panels) {
            if let Some(first) = *first {
                let change = &step.shared.as_slice()[first..first + 6];
                panel.target_from_panel = moved(&panel.target_from_panel, change);
            }
        }
        for (target, first) in problem.targets.iter_mut().zip(&layout.targets) {
            if let Some(first) = *first {
                let change = &step.shared.as_slice()[first..first + 6];
                target.scene_from_target = moved(&target.scene_from_target, change);
            }
        }
        if let (Some(shape), Some(first)) = (&mut problem.shape, layout.shape) {
            for (mm, change) in
                shape.coefficients_mm.iter_mut().zip(&step.shared.as_slice()[first..])
            {
                *mm += change;
            }
        }
        if let (Some(robot), Some(first)) = (&mut problem.robot, layout.robot) {
            let change = &step.shared.as_slice()[first..first + robot.columns()];
            robot.mount_from_camera = moved(&robot.mount_from_camera, &change[..6]);
            robot.ground_from_board = moved(&robot.ground_from_board, &change[6..12]);
            robot.scale += change.get(12).unwrap_or(&0.0);
        }
        for (frame, step) in problem.frames.iter_mut().zip(&step.frames) {
            *frame = moved(frame, step.as_slice());
        }
        if let Some(map) = &mut problem.map {
            for (offset, step) in map.offsets_mm.iter_mut().zip(&step.corners) {
                *offset += DVec3::from_slice(step.as_slice());
            }
        }
        problem
    }
}

/// A pose after a small change (ω, τ).
fn moved(pose: &Pose, change: &[f64]) -> Pose {
    let turn = glam::DQuat::from_scaled_axis(DVec3::from_slice(&change[..3]));
    Pose {
        rotation: (turn * pose.rotation).normalize(),
        translation: pose.translation + DVec3::from_slice(&change[3..6]),
    }
}
