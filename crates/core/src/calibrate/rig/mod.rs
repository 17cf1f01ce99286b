//! Several cameras that are fixed to each other.
//!
//! ```text
//!   each camera by itself ─→ camera_from_target in its own views
//!   two cameras, one frame ─→ camera_from_camera: the middle one of all such frames
//!   from camera 0 on to all others ─→ camera_from_rig, rig_from_target(frame)
//!   all together ─→ bundle adjustment
//! ```
//!
//! Gauge: the rig frame is that of camera 0. The target frame is that of its file, held by the
//! panel that was seen most, which stays; where panels are refined, all others move against it.
//! Lengths are those of the panels, which are taken to be true in themselves.

mod solution;
mod start;

use std::collections::BTreeSet;

use super::error::CalibrationError;
use super::excluded::Excluded;
use super::gross::{Gross, Kept, WrongFrame, within_pictures};
use super::loss::Loss;
use super::minimise::{Until, minimise};
use super::model::Model;
use super::problem::{Block, CameraUnknowns, PanelUnknowns, Prior};
use super::remedy::{Instead, remedy_of_given};
use super::settle::scale;
use super::solve::{self, Options};
use super::view::{MIRRORED, View};
use super::weights::Weights;
use crate::camera::{Camera, Pose};
use crate::targets::PanelPose;
use start::Start;
pub(super) use start::middle;

pub use solution::{RigCamera, RigFrame, RigSolution};

/// What a camera of a rig saw.
#[derive(Clone, Debug, PartialEq)]
pub struct RigViews {
    /// Name of the camera.
    pub name: String,
    /// Its views; those of the same name in different cameras were taken at the same moment.
    pub views: Vec<View>,
    /// The camera, where it is known and to be kept.
    pub known: Option<Camera>,
}

/// How a rig is calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RigOptions {
    /// What is to be found of cameras that are not known.
    pub model: Model,
    /// How corners far off count.
    pub loss: Loss,
    /// How corners are weighted.
    pub weights: Weights,
    /// Whether the poses of the target's panels are found too.
    pub refine_target: bool,
}

/// Where a panel is on its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelPlace {
    /// target_from_panel.
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

/// Finds the cameras, where they are to each other, where the target was, and on request where its
/// panels are on it. What an earlier measurement says of these counts as an observation.
pub fn calibrate_rig(
    cameras: &[RigViews],
    panels: &[PanelPlace],
    options: RigOptions,
) -> Result<RigSolution, CalibrationError> {
    let mut findings = Vec::new();
    let within = cameras.iter().enumerate().map(|(index, camera)| {
        let (views, beyond) = within_pictures(&camera.views, index);
        findings.extend(beyond);
        RigViews { views, ..camera.clone() }
    });
    let cameras: Vec<RigViews> = within.collect();
    let cameras = cameras.as_slice();
    let start = Start::new(cameras, panels, options)?;
    let mut excluded = start.excluded.clone();
    let problem = start.problem(cameras, panels, options);
    // A first pass in which frames that were not taken at one moment hardly count.
    let whitening = scale(&problem);
    let first = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)
        .ok_or(CalibrationError::NoStart)?;
    let gross = Gross::of(first.problem).ok_or(CalibrationError::NoStart)?;
    check_rigid(cameras, &gross)?;
    let prepare = |kept: &mut Kept| hold_panels(kept, panels, options.refine_target);
    let (gross, settled) = gross.settled(options.weights, options.loss, prepare)?;
    for (&frame, why) in &gross.frames {
        let reason = match why {
            WrongFrame::Off { camera, off_px } => format!(
                "the corners of camera {} are off by {off_px:.1} px: not taken at the same moment, or \
                 wrong labels",
                cameras[*camera].name
            ),
            WrongFrame::Mirrored => MIRRORED.to_owned(),
            WrongFrame::Stranger { deviations } => format!(
                "it speaks for other cameras than the other frames do, and would move theirs by \
                 {deviations:.1} deviations: not taken at the same moment, or one had moved"
            ),
            WrongFrame::OnlyWrongPanels => solve::ONLY_WRONG_PANELS.to_owned(),
        };
        let of_frame = gross.problem.blocks.iter().filter(|block| block.frame == frame);
        excluded.push(Excluded {
            camera: None,
            view: start.frames[frame].clone(),
            image: String::new(),
            panel: None,
            corners: of_frame.map(|block| block.observations.len()).sum(),
            reason,
        });
    }
    let kept: Vec<usize> = gross.belonging().collect();
    findings.extend(gross.findings(&settled, |frame| start.frames[frame].clone()));
    let names = |index: usize| start.frames[kept[index]].clone();
    let solution = RigSolution::new(cameras, names, &settled)?;
    Ok(RigSolution { excluded, findings, ..solution })
}

/// Refuses cameras of which most frames do not belong together.
fn check_rigid(cameras: &[RigViews], gross: &Gross) -> Result<(), CalibrationError> {
    let (wrong, all) = (gross.frames.len(), gross.problem.frames.len());
    if 2 * wrong <= all {
        return Ok(());
    }
    let of_camera = |camera: usize| {
        let off =
            |why: &&WrongFrame| matches!(why, WrongFrame::Off { camera: c, .. } if *c == camera);
        gross.frames.values().filter(off).count()
    };
    let most = (0..cameras.len()).max_by_key(|&camera| of_camera(camera)).unwrap_or_default();
    Err(CalibrationError::NotRigid { camera: cameras[most].name.clone(), wrong, all })
}

/// Holds a panel of those that take part. Where frames went, a panel may hang together with no other, or
/// another be held.
fn hold_panels(kept: &mut Kept, panels: &[PanelPlace], refine: bool) {
    let of_blocks = kept.problem.blocks.iter().zip(&kept.left_out);
    let taking_part = of_blocks.filter(|(_, out)| !**out).map(|(block, _)| block.clone());
    let unknowns = panel_unknowns(&taking_part.collect::<Vec<_>>(), panels, refine);
    for (panel, unknown) in kept.problem.panels.iter_mut().zip(unknowns) {
        if panel.pose_free != unknown.pose_free {
            *panel = unknown;
        }
    }
}

/// The panel to be held: the one seen most of those that no measurement moves, which an earlier
/// refinement held too; and those that hang together with it by frames in which both were seen.
fn connected_panels(blocks: &[Block], panels: &[PanelPlace]) -> (usize, BTreeSet<usize>) {
    let count = panels.len();
    let mut corners = vec![0; count];
    let mut frames = vec![BTreeSet::new(); count];
    for block in blocks {
        corners[block.panel.index()] += block.observations.len();
        frames[block.panel.index()].insert(block.frame);
    }
    let stated = |panel: usize| corners[panel] > 0 && panels[panel].covariance.is_none();
    let rank = |&panel: &usize| (stated(panel), corners[panel], std::cmp::Reverse(panel));
    let held = (0..count).max_by_key(rank).unwrap_or_default();
    let (mut found, mut open) = (BTreeSet::from([held]), vec![held]);
    while let Some(panel) = open.pop() {
        for other in 0..count {
            if !found.contains(&other) && !frames[other].is_disjoint(&frames[panel]) {
                found.insert(other);
                open.push(other);
            }
        }
    }
    (held, found)
}

/// A camera by itself: as it is known, or as its views have it.
fn alone(
    views: &RigViews,
    panels: &[PanelPlace],
    options: RigOptions,
) -> Result<super::Solution, CalibrationError> {
    let RigOptions { model, loss, weights, .. } = options;
    let panels: Vec<Pose> = panels.iter().map(|panel| panel.target_from_panel).collect();
    if views.views.is_empty() {
        return Err(CalibrationError::NotSeen { camera: views.name.clone() });
    }
    let found = match &views.known {
        Some(camera) => solve::poses(&views.views, &panels, camera, loss, weights),
        None => solve::calibrate(&views.views, &panels, Options { model, loss, weights }),
    };
    found.map_err(|error| CalibrationError::OfCamera {
        camera: views.name.clone(),
        error: Box::new(error),
    })
}

/// The cameras that were given and that their own pictures speak against: other ones, or changed since.
pub fn wrong_cameras(
    cameras: &[RigViews],
    panels: &[PanelPlace],
    options: RigOptions,
) -> Vec<usize> {
    let poses: Vec<Pose> = panels.iter().map(|panel| panel.target_from_panel).collect();
    let is_wrong = |views: &RigViews| {
        let (Some(camera), Ok(alone)) = (&views.known, alone(views, panels, options)) else {
            return false;
        };
        let RigOptions { loss, weights, .. } = options;
        let remedy = remedy_of_given(&views.views, &poses, camera, loss, weights, &alone);
        remedy.is_some_and(|remedy| remedy.instead == Instead::Camera)
    };
    (0..cameras.len()).filter(|&index| is_wrong(&cameras[index])).collect()
}

/// What is unknown of the cameras: the poses of all but the first.
fn camera_unknowns(
    views: &[RigViews],
    cameras: &[Camera],
    camera_from_rig: &[Pose],
    options: RigOptions,
) -> Vec<CameraUnknowns> {
    let unknowns = views.iter().zip(cameras).zip(camera_from_rig).enumerate();
    unknowns
        .map(|(index, ((views, camera), pose))| CameraUnknowns {
            camera: camera.clone(),
            free: match views.known {
                Some(_) => vec![false; camera.parameters().len()],
                None => options.model.free(),
            },
            camera_from_rig: *pose,
            pose_free: index > 0,
        })
        .collect()
}

/// What is unknown of the panels.
fn panel_unknowns(blocks: &[Block], panels: &[PanelPlace], refine: bool) -> Vec<PanelUnknowns> {
    let (held, connected) = connected_panels(blocks, panels);
    let unknown = |(index, place): (usize, &PanelPlace)| {
        let pose_free = refine && index != held && connected.contains(&index);
        let prior = place
            .covariance
            .filter(|_| pose_free)
            .and_then(|covariance| Prior::new(place.target_from_panel, covariance));
        PanelUnknowns { target_from_panel: place.target_from_panel, pose_free, prior }
    };
    panels.iter().enumerate().map(unknown).collect()
}
