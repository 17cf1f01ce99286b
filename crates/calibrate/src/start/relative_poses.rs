//! Poses of cameras on the rig and of targets in the scene, from the separate results of each
//! camera.
//!
//! ```text
//!   two cameras that see one target in one frame  ─→ camera_from_camera
//!   a known frame, and another target in it ─→ scene_from_target
//!   a camera and a target that only it sees         ─→ both, from the motion of the rig
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::pose::middle;
use super::rig_motion::{Moment, placed_by_motion};
use crate::error::{CalibrationError, DegenerateMotion};
use crate::input::calibration::Calibration;
use deltille_core::camera::Pose;

/// Minimum number of frames that two cameras must share. One frame may be wrong, but the median of
/// three is correct.
pub(super) const MIN_SHARED: usize = 3;

/// The view of a target by a single camera.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Index of the target.
    pub target: usize,
    pub camera_from_target: Pose,
    /// Its index among the camera's views.
    pub view: usize,
    pub corners: usize,
    /// Index of the rotation of its labels among the [`Symmetries`](super::symmetry::Symmetries) of the target.
    pub rotated: Option<usize>,
}

/// The views of each camera, by the name of the frame.
pub(super) type ByFrame = Vec<BTreeMap<String, Vec<Seen>>>;

/// The fixed relative poses: of all cameras in the rig, and of all targets in the scene.
pub(super) struct Places {
    pub camera_from_rig: Vec<Pose>,
    pub scene_from_target: Vec<Pose>,
}

impl Places {
    /// # Errors
    /// Returns an error if a camera or a target is not connected with the others.
    pub(super) fn of(calibration: &Calibration, seen: &ByFrame) -> Result<Self, CalibrationError> {
        let known = |(index, camera): (usize, &crate::input::calibration::CameraViews)| {
            camera.camera_from_rig.or((index == 0).then_some(Pose::IDENTITY))
        };
        let cameras = calibration.cameras.iter().enumerate().map(known).collect();
        let targets = calibration.targets.iter().map(|target| target.scene_from_target).collect();
        let mut linking = Linking { calibration, seen, cameras, targets, plain: None };
        linking.check_seen()?;
        linking.place_first_target();
        while linking.by_common_target()
            || linking.target_in_known_frames()
            || linking.camera_in_known_frames()
            || linking.by_motion()
        {}
        linking.placed()
    }

    /// The pose of the scene in a frame, from the view with the most corners, because its pose is
    /// the most accurate.
    pub(super) fn rig_from_scene(&self, of_frame: &[(usize, &Seen)]) -> Option<Pose> {
        let best = of_frame.iter().max_by_key(|(_, seen)| seen.corners);
        best.map(|(camera, seen)| {
            let scene = self.scene_from_target[seen.target];
            rig_from_scene(&self.camera_from_rig[*camera], seen, &scene)
        })
    }
}

fn rig_from_scene(camera_from_rig: &Pose, seen: &Seen, scene_from_target: &Pose) -> Pose {
    let rig_from_target = camera_from_rig.inverse().after(&seen.camera_from_target);
    rig_from_target.after(&scene_from_target.inverse())
}

/// The poses known so far.
struct Linking<'a> {
    calibration: &'a Calibration,
    seen: &'a ByFrame,
    cameras: Vec<Option<Pose>>,
    targets: Vec<Option<Pose>>,
    /// A camera and a target whose poses the motion does not determine, and the reason.
    plain: Option<(usize, usize, DegenerateMotion)>,
}

impl Linking<'_> {
    /// Rejects targets that no camera sees.
    fn check_seen(&self) -> Result<(), CalibrationError> {
        let all = self.seen.iter().flat_map(BTreeMap::values).flatten();
        let seen: BTreeSet<usize> = all.map(|seen| seen.target).collect();
        let is_missing =
            |&target: &usize| self.targets[target].is_none() && !seen.contains(&target);
        match (0..self.targets.len()).find(is_missing) {
            Some(target) if self.targets.len() > 1 => Err(CalibrationError::TargetNotSeen {
                target: self.calibration.targets[target].name.clone(),
            }),
            _ => Ok(()),
        }
    }

    /// Without a target of known pose, the scene frame is that of the first target seen by a camera
    /// of known pose.
    fn place_first_target(&mut self) {
        if self.targets.iter().any(Option::is_some) {
            return;
        }
        let placed = self.seen.iter().zip(&self.cameras).filter(|(_, place)| place.is_some());
        let seen = placed.flat_map(|(seen, _)| seen.values().flatten()).map(|seen| seen.target);
        let first = seen.min().unwrap_or_default();
        self.targets[first] = Some(Pose::IDENTITY);
    }

    fn indices(places: &[Option<Pose>], is_placed: bool) -> impl Iterator<Item = usize> {
        (0..places.len()).filter(move |&index| places[index].is_some() == is_placed)
    }

    /// Locates a camera relative to the one with which it shares the most frames.
    fn by_common_target(&mut self) -> bool {
        let from = Self::indices(&self.cameras, true);
        let to = |from: usize| Self::indices(&self.cameras, false).map(move |to| (from, to));
        let pairs = from.flat_map(to).map(|(from, to)| (self.common(from, to), from, to));
        let most = pairs.max_by_key(|((frames, _), from, to)| {
            (*frames, std::cmp::Reverse(*from), std::cmp::Reverse(*to))
        });
        let Some(((frames, relative), from, to)) = most else { return false };
        if frames < MIN_SHARED {
            return false;
        }
        self.cameras[to] = self.cameras[from].map(|from_rig| middle(&relative).after(&from_rig));
        true
    }

    /// The number of frames that show the same target to two cameras, and the relative pose from each.
    fn common(&self, from: usize, to: usize) -> (usize, Vec<Pose>) {
        common(&self.seen[from], &self.seen[to])
    }

    /// The poses of the scene in the known frames.
    fn known_frames(&self) -> BTreeMap<&str, Pose> {
        let mut best: BTreeMap<&str, (usize, Pose)> = BTreeMap::new();
        for (of_camera, place) in self.seen.iter().zip(&self.cameras) {
            let Some(camera_from_rig) = place else { continue };
            for (name, seen) in
                of_camera.iter().flat_map(|(n, seen)| seen.iter().map(move |s| (n, s)))
            {
                let Some(scene_from_target) = &self.targets[seen.target] else { continue };
                let entry = best.entry(name).or_insert((0, Pose::IDENTITY));
                if seen.corners > entry.0 {
                    *entry =
                        (seen.corners, rig_from_scene(camera_from_rig, seen, scene_from_target));
                }
            }
        }
        best.into_iter().map(|(name, (_, pose))| (name, pose)).collect()
    }

    /// Locates the target that located cameras see in the largest number of known frames.
    fn target_in_known_frames(&mut self) -> bool {
        let frames = self.known_frames();
        let of_target = |target: usize| {
            let placed = self.seen.iter().zip(&self.cameras);
            let places = placed.filter_map(|(seen, place)| Some((seen, (*place)?))).flat_map(
                |(of_camera, camera_from_rig)| {
                    let frames = &frames;
                    sightings(of_camera, target).filter_map(move |(name, seen)| {
                        let rig_from_target =
                            camera_from_rig.inverse().after(&seen.camera_from_target);
                        Some(frames.get(name)?.inverse().after(&rig_from_target))
                    })
                },
            );
            (target, places.collect::<Vec<Pose>>())
        };
        let open = Self::indices(&self.targets, false).map(of_target);
        let Some((target, places)) = open.max_by_key(|(_, places)| places.len()) else {
            return false;
        };
        if places.len() < MIN_SHARED {
            return false;
        }
        self.targets[target] = Some(middle(&places));
        true
    }

    /// Locates the camera that sees located targets in the largest number of known frames.
    fn camera_in_known_frames(&mut self) -> bool {
        let frames = self.known_frames();
        let of_camera = |camera: usize| {
            let all = self.seen[camera].iter();
            let all = all.flat_map(|(name, seen)| seen.iter().map(move |seen| (name, seen)));
            let places = all.filter_map(|(name, seen)| {
                let scene_from_target = self.targets[seen.target]?;
                let rig_from_target = frames.get(name.as_str())?.after(&scene_from_target);
                Some(seen.camera_from_target.after(&rig_from_target.inverse()))
            });
            (camera, places.collect::<Vec<Pose>>())
        };
        let open = Self::indices(&self.cameras, false).map(of_camera);
        let Some((camera, places)) = open.max_by_key(|(_, places)| places.len()) else {
            return false;
        };
        if places.len() < MIN_SHARED {
            return false;
        }
        self.cameras[camera] = Some(middle(&places));
        true
    }

    /// Locates a camera together with a target, if only cameras of unknown pose see the target.
    fn by_motion(&mut self) -> bool {
        let frames = self.known_frames();
        let of_pair = |camera: usize, target: usize| {
            let moments = sightings(&self.seen[camera], target).filter_map(|(name, seen)| {
                let rig_from_scene = *frames.get(name)?;
                Some(Moment { rig_from_scene, camera_from_target: seen.camera_from_target })
            });
            (camera, target, moments.collect::<Vec<Moment>>())
        };
        let of_camera =
            |camera: usize| Self::indices(&self.targets, false).map(move |target| (camera, target));
        let open = Self::indices(&self.cameras, false).flat_map(of_camera);
        let mut pairs: Vec<_> = open.map(|(camera, target)| of_pair(camera, target)).collect();
        pairs.retain(|(_, _, moments)| moments.len() >= MIN_SHARED);
        pairs.sort_by_key(|(_, _, moments)| std::cmp::Reverse(moments.len()));
        for (camera, target, moments) in pairs {
            match placed_by_motion(&moments) {
                Ok([camera_from_rig, scene_from_target]) => {
                    self.cameras[camera] = Some(camera_from_rig);
                    self.targets[target] = Some(scene_from_target);
                    return true;
                }
                Err(why) => self.plain = self.plain.or(Some((camera, target, why))),
            }
        }
        false
    }

    /// Returns all poses relative to the first target, or an error if a pose is still unknown.
    fn placed(self) -> Result<Places, CalibrationError> {
        let calibration = self.calibration;
        let open: Vec<usize> = Self::indices(&self.cameras, false).collect();
        if let Some((camera, target, why)) = self.plain.filter(|(camera, ..)| open.contains(camera))
        {
            return Err(CalibrationError::PlainMotion {
                camera: calibration.cameras[camera].name.clone(),
                target: calibration.targets[target].name.clone(),
                why,
            });
        }
        if !open.is_empty() {
            let placed = Self::indices(&self.cameras, true);
            let pairs = placed.flat_map(|from| open.iter().map(move |&to| (from, to)));
            let shared = pairs.map(|(from, to)| self.common(from, to).0).max().unwrap_or_default();
            let names = open.iter().map(|&camera| calibration.cameras[camera].name.clone());
            return Err(CalibrationError::Apart {
                cameras: names.collect::<Vec<_>>().join(", "),
                shared,
                needed: MIN_SHARED,
            });
        }
        if let Some(target) = Self::indices(&self.targets, false).next() {
            return Err(CalibrationError::TargetApart {
                target: calibration.targets[target].name.clone(),
                needed: MIN_SHARED,
            });
        }
        let is_given = calibration.targets.iter().any(|target| target.scene_from_target.is_some());
        let camera_from_rig = self.cameras.into_iter().flatten().collect();
        let mut scene_from_target: Vec<Pose> = self.targets.into_iter().flatten().collect();
        if let (false, Some(first)) = (is_given, scene_from_target.first().map(Pose::inverse)) {
            scene_from_target.iter_mut().for_each(|pose| *pose = first.after(pose));
            scene_from_target[0] = Pose::IDENTITY;
        }
        Ok(Places { camera_from_rig, scene_from_target })
    }
}

/// The number of frames that show the same target to two cameras, and the pose of the second
/// relative to the first from each frame.
pub(super) fn common(
    from: &BTreeMap<String, Vec<Seen>>,
    to: &BTreeMap<String, Vec<Seen>>,
) -> (usize, Vec<Pose>) {
    let (mut frames, mut relative) = (0, Vec::new());
    for (name, of_from) in from {
        let Some(of_to) = to.get(name) else { continue };
        let before = relative.len();
        for seen in of_from {
            let same = of_to.iter().filter(|other| other.target == seen.target);
            let from_target = seen.camera_from_target.inverse();
            relative.extend(same.map(|other| other.camera_from_target.after(&from_target)));
        }
        frames += usize::from(relative.len() > before);
    }
    (frames, relative)
}

/// The poses of a target seen by a camera, by frame.
fn sightings(
    of_camera: &BTreeMap<String, Vec<Seen>>,
    target: usize,
) -> impl Iterator<Item = (&str, &Seen)> {
    let all = of_camera.iter().flat_map(|(name, seen)| seen.iter().map(move |seen| (name, seen)));
    all.filter(move |(_, seen)| seen.target == target).map(|(name, seen)| (name.as_str(), seen))
}
