use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::{PanelPlace, RigViews};
use crate::calibrate::error::CalibrationError;
use crate::calibrate::excluded::Excluded;
use crate::calibrate::finding::Finding;
use crate::calibrate::lens_end::LensEnd;
use crate::calibrate::minimise::Minimum;
use crate::calibrate::misfit::{Misfit, misfits};
use crate::calibrate::normal::Covariances;
use crate::calibrate::panel::PanelRef;
use crate::calibrate::settle::{Settled, variance};
use crate::calibrate::solution::{Parameter, rms_px};
use crate::camera::{Camera, PROJECTION_PARAMETERS, Pose};
use crate::targets::{Name, PanelPose, Target};

/// Cameras fixed to each other, as their views have them.
#[derive(Clone, Debug, PartialEq)]
pub struct RigSolution {
    /// The cameras, in the order given.
    pub cameras: Vec<RigCamera>,
    /// The frames, by name.
    pub frames: Vec<RigFrame>,
    /// The panels of the target.
    pub panels: Vec<PanelPlace>,
    /// Parameters that the views cannot tell apart, see [`super::super::Solution::loose`].
    pub loose: Vec<String>,
    /// Views and frames that took no part, and why.
    pub excluded: Vec<Excluded>,
    /// What outliers share, and corners that were left out together.
    pub findings: Vec<Finding>,
    /// Root mean square error of a coordinate over all corners, px.
    pub rms_px: f64,
    /// The deviation that was added to every corner's covariance, px; see [`super::Weights`].
    pub common_px: Option<f64>,
    /// A-posteriori standard deviation of a coordinate, see [`super::super::Solution::sigma`].
    pub sigma: f64,
    /// Patterns in the residuals that noise does not make, the strongest first.
    pub misfits: Vec<Misfit>,
}

/// A camera of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigCamera {
    /// Its name.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Where it is on the rig.
    pub camera_from_rig: Pose,
    /// Standard deviations of that: of a turn (rad) and a move (mm) along the camera's axes; `None`
    /// for camera 0, which is the rig.
    pub pose_sd: Option<[f64; 6]>,
    /// Root mean square error of a coordinate, px.
    pub rms_px: f64,
    /// The same of the corners that are no outliers, px.
    pub inlier_rms_px: f64,
    /// How many corners it saw.
    pub corners: usize,
    /// How many of them are outliers.
    pub outliers: usize,
    /// Where its lens ends to be good, if that is within the image.
    pub lens_end: Option<LensEnd>,
}

/// A moment at which pictures were taken.
#[derive(Clone, Debug, PartialEq)]
pub struct RigFrame {
    /// Its name.
    pub name: String,
    /// Where the target was.
    pub rig_from_target: Pose,
    /// Standard deviations of that: of a turn (rad) and a move (mm) along the rig's axes.
    pub pose_sd: [f64; 6],
    /// Root mean square error of a coordinate over all cameras, px.
    pub rms_px: f64,
}

impl RigSolution {
    /// The target with its panels where they were found, named `<target>-refined`.
    pub fn refined(&self, target: &Target) -> Target {
        let poses = self.panels.iter();
        let poses =
            poses.map(|panel| PanelPose::from_pose(&panel.target_from_panel, panel.covariance));
        let name = Name::like(&format!("{}-refined", target.name.trim_end_matches("-refined")));
        Target { name, ..target.with_poses(&poses.collect::<Vec<_>>()) }
    }

    /// How many corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.cameras.iter().map(|camera| camera.outliers).sum()
    }

    /// [`Self::rms_px`] of the corners that are no outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        let inliers = |camera: &RigCamera| (camera.corners - camera.outliers) as f64;
        let all: f64 = self.cameras.iter().map(inliers).sum();
        let squares = self.cameras.iter().map(|c| inliers(c) * c.inlier_rms_px.powi(2));
        (squares.sum::<f64>() / all.max(1.0)).sqrt()
    }

    pub(super) fn new(
        views: &[RigViews],
        frame_name: impl Fn(usize) -> String,
        settled: &Settled,
    ) -> Result<Self, CalibrationError> {
        let Settled { minimum, whitening, problem: all, outliers } = settled;
        let Minimum { problem, normal, layout, .. } = minimum;
        let open = |parameters: &[String]| CalibrationError::Undetermined {
            parameters: parameters.join(", "),
        };
        let covariances = normal.covariances().ok_or_else(|| open(&["the poses".to_owned()]))?;
        let Covariances { shared, frames, loose, tied } = covariances;
        let is_loose = |first: &Option<usize>| {
            first.is_some_and(|first| (first..first + 6).any(|column| loose.contains(&column)))
        };
        let of_cameras = views.iter().zip(&problem.cameras).zip(&layout.parameters);
        let of_cameras = of_cameras.flat_map(|((views, found), parameters)| {
            let names = found.camera.parameter_names();
            let loose = parameters.iter().filter(|(i, column)| {
                loose.contains(column) || *i >= PROJECTION_PARAMETERS.len() && tied.contains(column)
            });
            loose.map(move |&(i, _)| format!("{} of {}", names[i], views.name))
        });
        let loose_parameters = of_cameras.collect();
        let mut poses = Vec::new();
        for (views, _) in views.iter().zip(&layout.cameras).filter(|(_, first)| is_loose(first)) {
            poses.push(format!("the pose of {}", views.name));
        }
        let seen = problem.blocks.iter().map(|block| block.panel);
        let seen: BTreeSet<PanelRef> = seen.collect();
        for panel in seen.into_iter().filter(|panel| is_loose(&layout.panels[panel.index()])) {
            poses.push(format!("the pose of panel {panel}"));
        }
        if !poses.is_empty() {
            return Err(open(&poses));
        }
        let variance = variance(minimum);
        let covariance = shared * variance;
        // Residual, and whether it is an outlier, of every corner within reach.
        let residuals_of = |belongs: &dyn Fn(&super::Block) -> bool| -> Vec<([f64; 2], bool)> {
            let of_blocks = all.blocks.iter().zip(outliers).filter(|(block, _)| belongs(block));
            let corners = of_blocks.flat_map(|(block, outliers)| {
                let corners = block.observations.iter().zip(outliers);
                corners.filter_map(|(seen, &far)| Some((all.residual(block, seen)?, far)))
            });
            corners.collect()
        };
        let rms_of = |belongs: &dyn Fn(&super::Block) -> bool| {
            rms_px(residuals_of(belongs).iter().map(|(residual, _)| residual))
        };
        let cameras =
            views.iter().zip(&problem.cameras).enumerate().map(|(index, (views, found))| {
                let mut columns = layout.parameters[index].iter().map(|&(_, column)| column);
                let names = found.camera.parameter_names().into_iter();
                let values = names.zip(found.camera.parameters()).zip(&found.free);
                let parameters = values.map(|((name, value), &free)| {
                    let column = if free { columns.next() } else { None };
                    Parameter { name, value, sd: column.map(|c| covariance[(c, c)].sqrt()) }
                });
                let of_camera = |block: &&super::Block| block.camera == index;
                let blocks = || all.blocks.iter().filter(of_camera);
                let seen = blocks().flat_map(|block| &block.observations).map(|seen| seen.pixel);
                let seen: Vec<[f64; 2]> = seen.collect();
                let corners = residuals_of(&|block| block.camera == index);
                let inliers = corners.iter().filter(|(_, far)| !far);
                RigCamera {
                    name: views.name.clone(),
                    camera: found.camera.clone(),
                    parameters: parameters.collect(),
                    camera_from_rig: found.camera_from_rig,
                    pose_sd: layout.cameras[index].map(|first| deviations(&covariance, first)),
                    rms_px: rms_of(&|block| block.camera == index),
                    inlier_rms_px: rms_px(inliers.map(|(residual, _)| residual)),
                    corners: corners.len(),
                    outliers: corners.iter().filter(|(_, far)| *far).count(),
                    lens_end: LensEnd::of(&found.camera, &seen),
                }
            });
        let cameras = cameras.collect();
        let of_frames = problem.frames.iter().zip(&frames).enumerate();
        let of_frames = of_frames.map(|(index, (pose, own))| RigFrame {
            name: frame_name(index),
            rig_from_target: *pose,
            pose_sd: std::array::from_fn(|i| (own[(i, i)] * variance).sqrt()),
            rms_px: rms_of(&|block| block.frame == index),
        });
        let panels = problem.panels.iter().zip(&layout.panels).map(|(panel, first)| PanelPlace {
            target_from_panel: panel.target_from_panel,
            covariance: first.map(|first| {
                std::array::from_fn(|i| std::array::from_fn(|j| covariance[(first + i, first + j)]))
            }),
        });
        Ok(Self {
            cameras,
            frames: of_frames.collect(),
            panels: panels.collect(),
            loose: loose_parameters,
            excluded: Vec::new(),
            findings: Vec::new(),
            rms_px: rms_of(&|_| true),
            common_px: whitening.common_px,
            sigma: variance.sqrt(),
            misfits: misfits(problem, whitening),
        })
    }
}

/// Standard deviations of six unknowns.
fn deviations(covariance: &DMatrix<f64>, first: usize) -> [f64; 6] {
    std::array::from_fn(|i| covariance[(first + i, first + i)].sqrt())
}
