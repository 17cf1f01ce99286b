//! The start of several cameras, or of one camera with unknown panel poses: each camera is solved
//! separately, and the results are combined.
//!
//! ```text
//!   each camera separately ─→ camera_from_target in its own views
//!   images of all cameras ─→ lag of each camera in frames
//!   two cameras, one frame ─→ camera_from_camera: the medoid over all such frames
//!   a camera and a target that only it sees ─→ both, from the motion of the rig
//!   from camera 0 to all others ─→ camera_from_rig, scene_from_target, rig_from_scene(frame)
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::delay::{delays, in_time};
use super::frames::{Frame, Start};
use super::relative_poses::{ByFrame, Places, Seen};
use super::symmetry::Symmetries;
use crate::equations::minimise::{Until, minimise};
use crate::error::CalibrationError;
use crate::excluded::Excluded;
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::intrinsics::Intrinsics;
use crate::input::loss::Loss;
use crate::input::panel::PanelRef;
use crate::problem::bundle::Problem;
use crate::problem::panels::{targets_unknown, unknowns};
use crate::problem::roughness::Roughness;
use crate::problem::unknowns::{Block, CameraUnknowns};
use crate::problem::whitening::scale;
use deltille_core::camera::{Camera, Pose};

/// The separate result of a camera.
pub(crate) struct Alone {
    pub camera: Camera,
    /// The prior of the knots of a spline.
    pub roughness: Option<Roughness>,
    /// The pose of the target in each view, by its name.
    pub poses: BTreeMap<String, Pose>,
    /// Excluded views.
    pub excluded: Vec<Excluded>,
}

/// Combines the cameras; `by_itself` solves a calibration of one camera.
pub(crate) fn start(
    calibration: &Calibration,
    by_itself: impl Fn(&Calibration) -> Result<Alone, CalibrationError>,
) -> Result<Start, CalibrationError> {
    let cameras = &calibration.cameras;
    let mut excluded = Vec::new();
    let mut seen = ByFrame::new();
    let mut found = Vec::with_capacity(cameras.len());
    for (index, camera) in cameras.iter().enumerate() {
        let alone = alone(calibration, index, &by_itself)?;
        let name = Some(camera.name.clone());
        let of_camera = alone.excluded.into_iter();
        excluded.extend(of_camera.map(|view| (0, Excluded { camera: name.clone(), ..view })));
        seen.push(by_frame(calibration, camera, &alone.poses));
        found.push((alone.camera, alone.roughness));
    }
    let symmetries = Symmetries::of(calibration);
    let known = calibration.delays.clone();
    let delays = known.unwrap_or_else(|| delays(calibration, &seen, &symmetries));
    in_time(calibration, &delays, &mut seen);
    let rotations = symmetries.agree(calibration, &mut seen);
    let places = Places::of(calibration, &seen)?;
    let mut problem = Problem::default();
    let frames = frames(&seen, &places, &mut problem);
    let mut blocks = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        for (frame, of_frame) in frames.iter().enumerate() {
            let Some((_, view)) = of_frame.views.iter().find(|(of, _)| *of == index) else {
                continue;
            };
            let seen = seen[index].get(&of_frame.name).map_or(&[][..], Vec::as_slice);
            blocks.extend(camera.views[*view].sightings.iter().map(|sighting| {
                let target = calibration.target_of(sighting.panel);
                let of_target = seen.iter().find(|s| (s.target, s.view) == (target, *view));
                let rotated = of_target.and_then(|seen| seen.rotated);
                Block {
                    camera: index,
                    frame,
                    panel: sighting.panel,
                    observations: symmetries
                        .rotated(target, rotated, &sighting.observations)
                        .into(),
                }
            }));
        }
    }
    let unknown =
        |((index, given), (found, pose)): ((usize, &CameraViews), ((Camera, _), &Pose))| {
            let (camera, roughness) = found;
            let by = given.constrained()?;
            Ok(CameraUnknowns {
                roughness,
                camera_from_rig: *pose,
                pose_free: index > 0 && given.camera_from_rig.is_none(),
                ..CameraUnknowns::constrained(&camera, by.free.clone(), &by)
            })
        };
    let of_cameras = cameras.iter().enumerate().zip(found.into_iter().zip(&places.camera_from_rig));
    problem.cameras = of_cameras.map(unknown).collect::<Result<_, CalibrationError>>()?;
    problem.targets = targets_unknown(&blocks, calibration, &places.scene_from_target);
    problem.panels = unknowns(&blocks, calibration);
    // If the camera cannot image a corner at these initial values, no step can reach it.
    blocks.retain(|block| problem.residuals(block).all(|off| off.is_some()));
    problem.blocks = blocks;
    // A first pass in which frames that were not taken at the same time have almost no influence.
    let whitening = scale(&problem);
    let first = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)
        .ok_or(CalibrationError::NoStart)?;
    Ok(Start { problem: first.problem, frames, excluded, delays, rotations })
}

/// The frames by name. Adds their poses to the problem.
fn frames(seen: &ByFrame, places: &Places, problem: &mut Problem) -> Vec<Frame> {
    let names: BTreeSet<&str> =
        seen.iter().flat_map(|of_camera| of_camera.keys().map(String::as_str)).collect();
    let mut frames = Vec::new();
    for (place, name) in names.into_iter().enumerate() {
        let of_frame = seen.iter().enumerate();
        let of_frame: Vec<(usize, &Seen)> = of_frame
            .flat_map(|(camera, seen)| {
                seen.get(name).into_iter().flatten().map(move |s| (camera, s))
            })
            .collect();
        problem.frames.extend(places.rig_from_scene(&of_frame));
        let mut views: Vec<(usize, usize)> =
            of_frame.iter().map(|(camera, seen)| (*camera, seen.view)).collect();
        views.dedup();
        frames.push(Frame { name: name.to_owned(), place, views });
    }
    frames
}

/// The separate result of a camera: given, or estimated from its views.
fn alone(
    calibration: &Calibration,
    index: usize,
    by_itself: impl Fn(&Calibration) -> Result<Alone, CalibrationError>,
) -> Result<Alone, CalibrationError> {
    let camera = &calibration.cameras[index];
    if camera.views.is_empty() && !matches!(camera.intrinsics, Intrinsics::Known(_)) {
        return Err(CalibrationError::NotSeen { camera: camera.name.clone() });
    }
    let alone = calibration.alone(index, &calibration.panels).board_shape(false);
    by_itself(&alone).map_err(|error| CalibrationError::OfCamera {
        camera: camera.name.clone(),
        error: Box::new(error),
    })
}

/// The views of a camera by frame, with the poses from its separate result.
fn by_frame(
    calibration: &Calibration,
    camera: &CameraViews,
    poses: &BTreeMap<String, Pose>,
) -> BTreeMap<String, Vec<Seen>> {
    let mut seen: BTreeMap<String, Vec<Seen>> = BTreeMap::new();
    for (view, of) in camera.views.iter().enumerate() {
        let mut of_view = Vec::new();
        for (target, of_target) in calibration.targets.iter().enumerate() {
            let is_of = |panel: PanelRef| calibration.target_of(panel) == target;
            let sightings = of.sightings.iter().filter(|sighting| is_of(sighting.panel));
            let corners = sightings.map(|sighting| sighting.observations.len()).sum();
            let name = calibration.name_on(&of.name, of_target);
            let pose = poses.get(&name).filter(|_| corners > 0);
            of_view.extend(pose.map(|&camera_from_target| Seen {
                target,
                camera_from_target,
                view,
                corners,
                rotated: None,
            }));
        }
        if !of_view.is_empty() {
            seen.insert(of.name.clone(), of_view);
        }
    }
    seen
}
