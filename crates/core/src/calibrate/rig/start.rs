use std::collections::{BTreeMap, BTreeSet};

use super::{PanelPlace, RigOptions, RigViews, alone, camera_unknowns, panel_unknowns};
use crate::calibrate::error::CalibrationError;
use crate::calibrate::excluded::Excluded;
use crate::calibrate::problem::{Block, Problem};
use crate::camera::{Camera, Pose};
use crate::statistics::median;

/// Frames that two cameras must share: one may be wrong, of three the middle one is not.
const LEAST_SHARED: usize = 3;

/// The cameras by themselves, laid together.
pub(super) struct Start {
    /// Names of the frames.
    pub frames: Vec<String>,
    /// Views that do not belong, and why.
    pub excluded: Vec<Excluded>,
    cameras: Vec<Camera>,
    camera_from_rig: Vec<Pose>,
    rig_from_target: Vec<Pose>,
    /// For each camera the views that take part: frame, and index of the view.
    used: Vec<Vec<(usize, usize)>>,
}

impl Start {
    pub(super) fn new(
        views: &[RigViews],
        panels: &[PanelPlace],
        options: RigOptions,
    ) -> Result<Self, CalibrationError> {
        let mut cameras = Vec::with_capacity(views.len());
        let mut excluded = Vec::new();
        // camera_from_target by the name of the frame.
        let mut seen: Vec<BTreeMap<String, Pose>> = Vec::with_capacity(views.len());
        for camera in views {
            let solution = alone(camera, panels, options)?;
            let name = Some(camera.name.clone());
            let of_camera = solution.excluded.into_iter();
            excluded.extend(of_camera.map(|view| Excluded { camera: name.clone(), ..view }));
            seen.push(solution.views.into_iter().map(|view| (view.name, view.pose)).collect());
            cameras.push(solution.camera);
        }
        let camera_from_rig = lay_together(views, &seen)?;
        let frames: BTreeSet<&String> =
            seen.iter().flat_map(|of_camera| of_camera.keys()).collect();
        let frames: Vec<String> = frames.into_iter().cloned().collect();
        let of_frame = |name: &String| {
            // Of all cameras the one with the most corners has the best pose.
            let best = (0..views.len()).filter(|&c| seen[c].contains_key(name)).max_by_key(|&c| {
                let view = views[c].views.iter().find(|view| view.name == *name);
                view.map_or(0, |v| v.sightings.iter().map(|s| s.observations.len()).sum::<usize>())
            });
            let best = best.unwrap_or_default();
            camera_from_rig[best].inverse().after(&seen[best][name])
        };
        let rig_from_target = frames.iter().map(of_frame).collect();
        let used = views.iter().zip(&seen).map(|(camera, seen)| {
            let views = camera.views.iter().enumerate();
            let used = views.filter(|(_, view)| seen.contains_key(&view.name));
            used.filter_map(|(index, view)| Some((frames.binary_search(&view.name).ok()?, index)))
                .collect()
        });
        let used = used.collect();
        Ok(Self { frames, excluded, cameras, camera_from_rig, rig_from_target, used })
    }

    /// The problem of all cameras together.
    pub(super) fn problem(
        &self,
        views: &[RigViews],
        panels: &[PanelPlace],
        options: RigOptions,
    ) -> Problem {
        let mut blocks = Vec::new();
        for (camera, (of_camera, used)) in views.iter().zip(&self.used).enumerate() {
            for &(frame, view) in used {
                let sightings = &of_camera.views[view].sightings;
                blocks.extend(sightings.iter().map(|sighting| Block {
                    camera,
                    frame,
                    panel: sighting.panel,
                    observations: sighting.observations.clone(),
                }));
            }
        }
        let mut problem = Problem {
            cameras: camera_unknowns(views, &self.cameras, &self.camera_from_rig, options),
            frames: self.rig_from_target.clone(),
            panels: panel_unknowns(&blocks, panels, options.refine_target),
            blocks: Vec::new(),
            shape: None,
        };
        // What is out of a camera's reach from this start cannot be walked to.
        blocks.retain(|block| problem.residuals(block).is_some());
        problem.blocks = blocks;
        problem
    }
}

/// camera_from_rig of every camera, along the pairs of cameras that share the most frames.
fn lay_together(
    views: &[RigViews],
    seen: &[BTreeMap<String, Pose>],
) -> Result<Vec<Pose>, CalibrationError> {
    let mut placed: Vec<Option<Pose>> = vec![None; views.len()];
    if let Some(first) = placed.first_mut() {
        *first = Some(Pose::IDENTITY);
    }
    let shared = |a: usize, b: usize| {
        seen[a].keys().filter(|name| seen[b].contains_key(*name)).collect::<Vec<_>>()
    };
    loop {
        let from = (0..views.len()).filter(|&c| placed[c].is_some());
        let to = |c: usize| (0..views.len()).filter(|&d| placed[d].is_none()).map(move |d| (c, d));
        let pairs = from.flat_map(to).map(|(c, d)| (shared(c, d), c, d));
        let Some((common, from, to)) = pairs.max_by_key(|(common, c, d)| {
            (common.len(), std::cmp::Reverse(*c), std::cmp::Reverse(*d))
        }) else {
            return Ok(placed.into_iter().flatten().collect());
        };
        if common.len() < LEAST_SHARED {
            let names = (0..views.len()).filter(|&c| placed[c].is_none());
            return Err(CalibrationError::Apart {
                cameras: names.map(|c| views[c].name.clone()).collect::<Vec<_>>().join(", "),
                shared: common.len(),
                needed: LEAST_SHARED,
            });
        }
        let relative: Vec<Pose> =
            common.iter().map(|&name| seen[to][name].after(&seen[from][name].inverse())).collect();
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
