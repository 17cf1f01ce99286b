//! Several cameras, or one with panels that are not where they are stated to be: each camera by itself, laid
//! together.

use std::collections::{BTreeMap, BTreeSet};

use super::super::calibration::{Calibration, CameraViews, Intrinsics};
use super::super::error::CalibrationError;
use super::super::estimate::Estimate;
use super::super::excluded::Excluded;
use super::super::loss::Loss;
use super::super::minimise::{Until, minimise};
use super::super::panels::unknowns;
use super::super::problem::{Block, CameraUnknowns, Problem};
use super::super::reweighting::scale;
use super::{Frame, Start};
use crate::camera::Pose;
use crate::statistics::median;

/// Frames that two cameras must share: one may be wrong, of three the middle one is not.
const LEAST_SHARED: usize = 3;

/// A view of a camera by itself.
struct Seen {
    camera_from_target: Pose,
    /// Its index among the camera's views.
    view: usize,
    corners: usize,
}

/// What each camera saw, by the name of the frame.
type ByFrame<'a> = Vec<BTreeMap<&'a str, Seen>>;

pub(super) fn start(calibration: &Calibration) -> Result<Start, CalibrationError> {
    let Calibration { cameras, panels, .. } = calibration;
    let mut excluded = Vec::new();
    let mut seen = ByFrame::new();
    let mut found = Vec::with_capacity(cameras.len());
    for (index, camera) in cameras.iter().enumerate() {
        let alone = alone(calibration, index)?;
        let name = Some(camera.name.clone());
        let of_camera = alone.excluded.into_iter();
        excluded.extend(of_camera.map(|view| (0, Excluded { camera: name.clone(), ..view })));
        let poses: BTreeMap<String, Pose> =
            alone.cameras[0].views.iter().map(|view| (view.name.clone(), view.pose)).collect();
        let of_views = camera.views.iter().enumerate().filter_map(|(view, of)| {
            let camera_from_target = *poses.get(&of.name)?;
            Some((of.name.as_str(), Seen { camera_from_target, view, corners: of.corner_count() }))
        });
        seen.push(of_views.collect());
        found.extend(alone.cameras.into_iter().map(|alone| alone.camera));
    }
    let camera_from_rig = lay_together(cameras, &seen)?;
    let names: BTreeSet<&str> =
        seen.iter().flat_map(|of_camera| of_camera.keys().copied()).collect();
    let (mut problem, mut frames) = (Problem::default(), Vec::new());
    for (place, name) in names.into_iter().enumerate() {
        let of_frame = seen.iter().enumerate();
        let of_frame: Vec<(usize, &Seen)> =
            of_frame.filter_map(|(camera, seen)| Some((camera, seen.get(name)?))).collect();
        // Of all cameras the one with the most corners has the best pose.
        let best = of_frame.iter().max_by_key(|(_, seen)| seen.corners);
        problem.frames.extend(best.map(|(camera, seen)| {
            camera_from_rig[*camera].inverse().after(&seen.camera_from_target)
        }));
        let views = of_frame.iter().map(|(camera, seen)| (*camera, seen.view)).collect();
        frames.push(Frame { name: name.to_owned(), place, views });
    }
    let mut blocks = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        for (frame, of_frame) in frames.iter().enumerate() {
            let Some((_, view)) = of_frame.views.iter().find(|(of, _)| *of == index) else {
                continue;
            };
            blocks.extend(camera.views[*view].sightings.iter().map(|sighting| Block {
                camera: index,
                frame,
                panel: sighting.panel,
                observations: sighting.observations.clone(),
            }));
        }
    }
    let unknown =
        |((index, given), (camera, pose)): ((usize, &CameraViews), (_, &Pose))| CameraUnknowns {
            camera,
            free: given.intrinsics.free(),
            camera_from_rig: *pose,
            pose_free: index > 0 && given.camera_from_rig.is_none(),
        };
    let of_cameras = cameras.iter().enumerate().zip(found.into_iter().zip(&camera_from_rig));
    problem.cameras = of_cameras.map(unknown).collect();
    problem.panels = unknowns(&blocks, panels, calibration.refine_panels);
    // What is out of a camera's reach from this start cannot be walked to.
    blocks.retain(|block| problem.residuals(block).is_some());
    problem.blocks = blocks;
    // A first pass in which frames that were not taken at one moment hardly count.
    let whitening = scale(&problem);
    let first = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)
        .ok_or(CalibrationError::NoStart)?;
    Ok(Start { problem: first.problem, frames, excluded })
}

/// A camera by itself: as it is known, or as its views have it.
fn alone(calibration: &Calibration, index: usize) -> Result<Estimate, CalibrationError> {
    let camera = &calibration.cameras[index];
    if camera.views.is_empty() && !matches!(camera.intrinsics, Intrinsics::Known(_)) {
        return Err(CalibrationError::NotSeen { camera: camera.name.clone() });
    }
    let alone = calibration.alone(index, &calibration.panels).board_shape(false);
    alone.adjusted().map_err(|error| CalibrationError::OfCamera {
        camera: camera.name.clone(),
        error: Box::new(error),
    })
}

/// camera_from_rig of every camera, along the pairs of cameras that share the most frames.
fn lay_together(cameras: &[CameraViews], seen: &ByFrame) -> Result<Vec<Pose>, CalibrationError> {
    let known = |(index, camera): (usize, &CameraViews)| {
        camera.camera_from_rig.or((index == 0).then_some(Pose::IDENTITY))
    };
    let mut placed: Vec<Option<Pose>> = cameras.iter().enumerate().map(known).collect();
    let shared = |a: usize, b: usize| {
        seen[a].keys().filter(|name| seen[b].contains_key(*name)).collect::<Vec<_>>()
    };
    loop {
        let from = (0..cameras.len()).filter(|&c| placed[c].is_some());
        let to =
            |c: usize| (0..cameras.len()).filter(|&d| placed[d].is_none()).map(move |d| (c, d));
        let pairs = from.flat_map(to).map(|(c, d)| (shared(c, d), c, d));
        let Some((common, from, to)) = pairs.max_by_key(|(common, c, d)| {
            (common.len(), std::cmp::Reverse(*c), std::cmp::Reverse(*d))
        }) else {
            return Ok(placed.into_iter().flatten().collect());
        };
        if common.len() < LEAST_SHARED {
            let names = (0..cameras.len()).filter(|&c| placed[c].is_none());
            return Err(CalibrationError::Apart {
                cameras: names.map(|c| cameras[c].name.clone()).collect::<Vec<_>>().join(", "),
                shared: common.len(),
                needed: LEAST_SHARED,
            });
        }
        let pose = |camera: usize, name: &str| seen[camera][name].camera_from_target;
        let relative: Vec<Pose> =
            common.iter().map(|name| pose(to, name).after(&pose(from, name).inverse())).collect();
        placed[to] = placed[from].map(|from_rig| middle(&relative).after(&from_rig));
    }
}

/// The pose that lies in the middle of others: its median distance from them is the least. A turn
/// counts by how far it moves a point as far away as the translations reach.
pub(in crate::calibrate) fn middle(poses: &[Pose]) -> Pose {
    let arm = median(poses.iter().map(|pose| pose.translation.length()).collect())
        .unwrap_or(0.0)
        .max(1.0);
    let apart = |a: &Pose, b: &Pose| {
        let turn = a.rotation.angle_between(b.rotation);
        (a.translation - b.translation).length() + arm * turn
    };
    let spread =
        |pose: &Pose| median(poses.iter().map(|other| apart(pose, other)).collect()).unwrap_or(0.0);
    let best = poses.iter().min_by(|a, b| spread(a).total_cmp(&spread(b)));
    best.copied().unwrap_or(Pose::IDENTITY)
}
