//! Labels of a board that looks the same after a rotation, so that the cameras of a rig may label its corners
//! differently.
//!
//! The detector labels a board like this by its orientation in the image. If a camera is upside
//! down, or a board lies on its side in one image, the labels differ by one of the rotations Sₖ of
//! the board. The pose of camera b in camera a is the same in all frames only with the right
//! rotation,
//!
//! ```text
//!     b_from_a = b_from_target · Sₖ⁻¹ · a_from_target⁻¹
//! ```
//!
//! because any other makes it rotate with the board. In each frame, the poses for different k
//! differ by 90° or more, so the rotation in a frame is known as soon as the pose is known roughly.
//!
//! Limitations: cameras are compared by a board that both see. A rotation of all cameras' labels in
//! one frame changes only the pose of the board. It remains as labelled in the first camera.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;

use glam::{DQuat, DVec3};

use super::relative_poses::{ByFrame, MIN_SHARED, Seen};
use crate::input::calibration::Calibration;
use crate::input::observation::Observation;
use crate::input::sample::evenly;
use deltille_core::camera::Pose;
use deltille_core::lattice::{LatticeMap, Vertex};
use deltille_core::statistics::median;

/// Maximum number of frames whose poses are compared; more frames do not improve the decision.
const MAX_FRAMES: usize = 60;

/// Factor by which poses must scatter more with the detected labels before these are changed. The pose from a single
/// frame may scatter two to three times as much as that from other frames, and poses with wrong
/// labels scatter by the range of tilts of the board.
const DECISIVE: f64 = 3.0;

/// Half of the smallest difference between rotations of a board, 90°. It separates these rotations.
const OTHER_RAD: f64 = FRAC_PI_4;

/// The rotation of the labels of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LabelRotation {
    /// The smallest rotation after which the board looks the same, degrees.
    pub degrees: u32,
    /// Number of frames in which the labels were rotated.
    pub frames: usize,
    /// Number of frames in which the camera saw the board together with another camera.
    pub of: usize,
    /// Whether no other rotation of the labels fits.
    pub is_confirmed: bool,
}

/// The rotations after which each target looks the same.
pub(super) struct Symmetries {
    of_target: Vec<Vec<Symmetry>>,
    /// Positions of the corners of each target in the frame of its panel, by their labels, mm.
    places: Vec<BTreeMap<(i32, i32), DVec3>>,
}

/// A rotation of the labels of a target, and its effect on the pose of a view.
struct Symmetry {
    map: LatticeMap,
    /// The pose that maps the target with rotated labels to the target as it was labelled.
    labelled_from_rotated: Pose,
}

impl Symmetries {
    /// The symmetries of targets of one panel. Targets of several panels have none, because their
    /// tags are unique.
    pub(super) fn of(calibration: &Calibration) -> Self {
        let mut places = vec![BTreeMap::new(); calibration.targets.len()];
        let of_target = calibration.targets.iter().enumerate().map(|(target, of)| {
            let maps = match of.panels.len() {
                1 => calibration.symmetries.get(of.panels.start).map_or(&[][..], Vec::as_slice),
                _ => &[],
            };
            if maps.is_empty() {
                return Vec::new();
            }
            let views = calibration.cameras.iter().flat_map(|camera| &camera.views);
            let sightings = views.flat_map(|view| &view.sightings);
            let own = sightings.filter(|sighting| of.panels.contains(&sighting.panel.index()));
            let seen = own.flat_map(|sighting| &sighting.observations);
            places[target] = seen.map(|seen| ((seen.row, seen.col), seen.panel_mm)).collect();
            let panel = calibration.panels[of.panels.start].target_from_panel;
            maps.iter().filter_map(|&map| Symmetry::of(map, &places[target], &panel)).collect()
        });
        let of_target = of_target.collect();
        Self { of_target, places }
    }

    /// The poses of a view of a target: with the detected labels, then with rotated labels.
    pub(super) fn poses(&self, seen: &Seen) -> impl Iterator<Item = Pose> {
        let rotated = self.of_target[seen.target].iter();
        let rotated = rotated.map(|of| seen.camera_from_target.after(&of.labelled_from_rotated));
        std::iter::once(seen.camera_from_target).chain(rotated)
    }

    /// The poses of camera b in camera a from a target that both saw: with the detected labels, then with the labels of
    /// b rotated.
    pub(super) fn relative(&self, a: &Seen, b: &Seen) -> Vec<Pose> {
        let target_from_a = a.camera_from_target.inverse();
        self.poses(b).map(|b_from_target| b_from_target.after(&target_from_a)).collect()
    }

    /// The observations of a target with rotated labels.
    pub(super) fn rotated(
        &self,
        target: usize,
        rotation: Option<usize>,
        observations: &[Observation],
    ) -> Vec<Observation> {
        let Some(rotation) = rotation else { return observations.to_vec() };
        let Symmetry { map, .. } = self.of_target[target][rotation];
        let relabelled = observations.iter().filter_map(|seen| {
            let Vertex { row, col } = map.apply(Vertex::new(seen.row, seen.col));
            // A position that no view has belongs to no corner of the board.
            let panel_mm = *self.places[target].get(&(row, col))?;
            Some(Observation { row, col, panel_mm, ..*seen })
        });
        relabelled.collect()
    }

    /// Rotates the labels of all cameras except the first so that the cameras agree. It proceeds
    /// from camera to camera, along the pairs that share the most frames. Returns the rotation to
    /// report for each camera.
    pub(super) fn agree(
        &self,
        calibration: &Calibration,
        seen: &mut ByFrame,
    ) -> Vec<Option<LabelRotation>> {
        let mut said = vec![None; seen.len()];
        if self.of_target.iter().all(Vec::is_empty) {
            return said;
        }
        let given = |camera: usize| calibration.cameras[camera].camera_from_rig;
        let mut placed: Vec<(usize, Pose)> = vec![(0, given(0).unwrap_or(Pose::IDENTITY))];
        let mut open: Vec<usize> = (1..seen.len()).collect();
        while !open.is_empty() {
            let pairs = placed.iter().flat_map(|&(from, pose)| {
                open.iter().map(move |&to| (from, pose, to)).collect::<Vec<_>>()
            });
            let pairs = pairs.map(|(from, pose, to)| (self.common(seen, from, to), from, pose, to));
            let most = pairs.max_by_key(|(frames, from, _, to)| {
                (frames.len(), std::cmp::Reverse(*from), std::cmp::Reverse(*to))
            });
            let Some((frames, from, from_rig, to)) = most else { break };
            let known = given(from).zip(given(to)).map(|(from, to)| to.after(&from.inverse()));
            let found = match known {
                Some(pose) => Some(Agreed { pose, spread_mm: 0.0, is_confirmed: true }),
                None if frames.len() < MIN_SHARED => break,
                None => agreed(&frames),
            };
            let Some(found) = found else { break };
            let to_rig = found.pose.after(&from_rig);
            let (frames, of) = self.rotate(seen, &placed, to, to_rig);
            let degrees = self.least_degrees(&seen[to]);
            let is_of_note = degrees.is_some() && (frames > 0 || !found.is_confirmed);
            said[to] = degrees.filter(|_| is_of_note).map(|degrees| LabelRotation {
                degrees,
                frames,
                of,
                is_confirmed: found.is_confirmed,
            });
            placed.push((to, to_rig));
            open.retain(|&camera| camera != to);
        }
        said
    }

    /// The smallest symmetry rotation of the targets that a camera saw, degrees.
    fn least_degrees(&self, seen: &BTreeMap<String, Vec<Seen>>) -> Option<u32> {
        let targets = seen.values().flatten().map(|seen| seen.target);
        let maps = targets.flat_map(|target| &self.of_target[target]).map(|of| of.map);
        let degrees = maps.map(|map| map.angle_rad().to_degrees().round() as u32);
        degrees.map(|degrees| degrees.min(360 - degrees)).min()
    }

    /// The relative poses of two cameras in the frames in which both saw one target.
    fn common(&self, seen: &ByFrame, from: usize, to: usize) -> Vec<Vec<Pose>> {
        let both = seen[from].iter().filter_map(|(name, a)| Some((a, seen[to].get(name)?)));
        let relative = both.flat_map(|(a, b)| {
            let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
            pairs.filter(|(a, b)| a.target == b.target).map(|(a, b)| self.relative(a, b))
        });
        relative.collect()
    }

    /// Rotates the labels of a camera with this pose on the rig to match those of the located
    /// cameras. Returns the number of rotated frames and of all frames.
    fn rotate(
        &self,
        seen: &mut ByFrame,
        placed: &[(usize, Pose)],
        to: usize,
        to_rig: Pose,
    ) -> (usize, usize) {
        let (mut rotated, mut all) = (0, 0);
        let mut own = std::mem::take(&mut seen[to]);
        for (name, of_frame) in &mut own {
            let (mut is_rotated, mut is_shared) = (false, false);
            for view in of_frame {
                // The view with the most corners has the most accurate pose.
                let others = placed.iter().flat_map(|(camera, from_rig)| {
                    let of_camera = seen[*camera].get(name).into_iter().flatten();
                    of_camera.map(move |seen| (from_rig, seen))
                });
                let same = others.filter(|(_, other)| other.target == view.target);
                let Some((from_rig, other)) = same.max_by_key(|(_, other)| other.corners) else {
                    continue;
                };
                is_shared = true;
                let expected = to_rig.after(&from_rig.inverse()).after(&other.camera_from_target);
                let arm_mm = expected.translation.length().max(1.0);
                let poses: Vec<Pose> = self.poses(view).collect();
                let off = |index: usize| apart_mm(&poses[index], &expected, arm_mm);
                let nearest = (0..poses.len()).min_by(|&a, &b| off(a).total_cmp(&off(b)));
                let nearest = nearest.filter(|&index| DECISIVE * off(index) < off(0));
                if let Some(rotation) = nearest.and_then(|index| index.checked_sub(1)) {
                    view.rotated = Some(rotation);
                    view.camera_from_target = poses[rotation + 1];
                    is_rotated = true;
                }
            }
            rotated += usize::from(is_rotated);
            all += usize::from(is_shared);
        }
        seen[to] = own;
        (rotated, all)
    }
}

impl Symmetry {
    /// `None` if no view shows two corners that the rotation maps to each other.
    fn of(
        map: LatticeMap,
        places: &BTreeMap<(i32, i32), DVec3>,
        target_from_panel: &Pose,
    ) -> Option<Self> {
        let rotation = DQuat::from_rotation_z(map.angle_rad());
        // The corner with the rotated label takes the position of the corner with the detected label.
        let shifts = places.iter().filter_map(|(&(row, col), &at)| {
            let Vertex { row, col } = map.apply(Vertex::new(row, col));
            Some(*places.get(&(row, col))? - rotation * at)
        });
        let shifts: Vec<DVec3> = shifts.collect();
        let translation = shifts.iter().sum::<DVec3>() / shifts.len() as f64;
        let rotated_from_labelled = Pose { rotation, translation };
        let labelled_from_rotated = target_from_panel
            .after(&rotated_from_labelled.inverse())
            .after(&target_from_panel.inverse());
        (!shifts.is_empty()).then_some(Self { map, labelled_from_rotated })
    }
}

/// The relative pose on which most frames agree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreed {
    pub pose: Pose,
    /// The median distance of the frames from it, mm.
    pub spread_mm: f64,
    /// Whether no pose from other labels fits.
    pub is_confirmed: bool,
}

/// Distance of two poses; a rotation counts by the displacement of a point at the end of an arm.
fn apart_mm(a: &Pose, b: &Pose, arm_mm: f64) -> f64 {
    (a.translation - b.translation).length() + arm_mm * a.rotation.angle_between(b.rotation)
}

/// Finds the pose on which most frames agree. Each frame has the pose with the detected labels and those with rotated
/// labels; the detected labels are kept unless others agree decisively better. `None` without
/// frames.
pub(super) fn agreed(frames: &[Vec<Pose>]) -> Option<Agreed> {
    let frames: Vec<&Vec<Pose>> = evenly(frames, MAX_FRAMES).collect();
    let labelled = || frames.iter().filter_map(|poses| poses.first());
    let arm_mm = median(labelled().map(|pose| pose.translation.length()).collect())?.max(1.0);
    let spread_mm = |pose: &Pose, most: usize| {
        let nearest = frames.iter().map(|poses| {
            let poses = poses.iter().take(most);
            poses.map(|other| apart_mm(pose, other, arm_mm)).fold(f64::INFINITY, f64::min)
        });
        median(nearest.collect()).unwrap_or(f64::INFINITY)
    };
    let least = |found: Vec<(Pose, f64)>| found.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let as_labelled = least(labelled().map(|pose| (*pose, spread_mm(pose, 1))).collect())?;
    let all = frames.iter().flat_map(|poses| poses.iter());
    let all: Vec<(Pose, f64)> = all.map(|pose| (*pose, spread_mm(pose, usize::MAX))).collect();
    let best = least(all.clone())?;
    let is_better = DECISIVE * best.1 < as_labelled.1;
    let (pose, spread_mm) = if is_better { best } else { as_labelled };
    let fits_too = |&(other, spread): &(Pose, f64)| {
        spread < DECISIVE * spread_mm && other.rotation.angle_between(pose.rotation) > OTHER_RAD
    };
    Some(Agreed { pose, spread_mm, is_confirmed: !all.iter().any(fits_too) })
}
