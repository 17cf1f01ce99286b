//! Where cameras are on their rig and targets in their scene, from what each camera saw by itself.
//!
//! ```text
//!   two cameras that see one target in one frame  ─→ camera_from_camera
//!   a frame that is known, and another target in it ─→ scene_from_target
//!   a camera and a target that only it sees         ─→ both, from how the rig moves
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::motion::{Moment, placed_by_motion};
use super::pose::middle;
use crate::error::{CalibrationError, TooPlain};
use crate::input::calibration::Calibration;
use deltille_core::camera::Pose;

/// Frames that two cameras must share: one may be wrong, of three the middle one is not.
pub(super) const LEAST_SHARED: usize = 3;

/// A target as a camera by itself sees it.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Index of the target.
    pub target: usize,
    pub camera_from_target: Pose,
    /// Its index among the camera's views.
    pub view: usize,
    pub corners: usize,
    /// Which of the [`Symmetries`](super::symmetry::Symmetries) of the target its labels are rotated by.
    pub rotated: Option<usize>,
}

/// What each camera saw, by the name of the frame.
pub(super) type ByFrame = Vec<BTreeMap<String, Vec<Seen>>>;

/// Where everything is that does not move.
pub(super) struct Places {
    pub camera_from_rig: Vec<Pose>,
    pub scene_from_target: Vec<Pose>,
}

impl Places {
    /// # Errors
    /// Where something hangs together with nothing else.
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

    /// Where the scene was in a frame: of all that was seen in it, what shows the most corners has the best pose.
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

/// What is placed so far.
struct Linking<'a> {
    calibration: &'a Calibration,
    seen: &'a ByFrame,
    cameras: Vec<Option<Pose>>,
    targets: Vec<Option<Pose>>,
    /// A camera and a target that motion does not place, and why.
    plain: Option<(usize, usize, TooPlain)>,
}

impl Linking<'_> {
    /// Refuses targets that no camera sees.
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

    /// Without a target whose place is known, the scene is that of the first one that a placed camera sees.
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

    /// Places a camera by the one with which it shares the most frames.
    fn by_common_target(&mut self) -> bool {
        let from = Self::indices(&self.cameras, true);
        let to = |from: usize| Self::indices(&self.cameras, false).map(move |to| (from, to));
        let pairs = from.flat_map(to).map(|(from, to)| (self.common(from, to), from, to));
        let most = pairs.max_by_key(|((frames, _), from, to)| {
            (*frames, std::cmp::Reverse(*from), std::cmp::Reverse(*to))
        });
        let Some(((frames, relative), from, to)) = most else { return false };
        if frames < LEAST_SHARED {
            return false;
        }
        self.cameras[to] = self.cameras[from].map(|from_rig| middle(&relative).after(&from_rig));
        true
    }

    /// How many frames show the same target to two cameras, and where the one is to the other by each.
    fn common(&self, from: usize, to: usize) -> (usize, Vec<Pose>) {
        common(&self.seen[from], &self.seen[to])
    }

    /// Where the scene was in the frames that are known.
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

    /// Places the target that placed cameras see in the most frames that are known.
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
        if places.len() < LEAST_SHARED {
            return false;
        }
        self.targets[target] = Some(middle(&places));
        true
    }

    /// Places the camera that sees placed targets in the most frames that are known.
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
        if places.len() < LEAST_SHARED {
            return false;
        }
        self.cameras[camera] = Some(middle(&places));
        true
    }

    /// Places a camera together with a target that only such cameras see.
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
        pairs.retain(|(_, _, moments)| moments.len() >= LEAST_SHARED);
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

    /// Everything relative to the first target; an error where something is not placed.
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
                needed: LEAST_SHARED,
            });
        }
        if let Some(target) = Self::indices(&self.targets, false).next() {
            return Err(CalibrationError::TargetApart {
                target: calibration.targets[target].name.clone(),
                needed: LEAST_SHARED,
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

/// How many frames show the same target to two cameras, and where the second is to the first by each.
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

/// Where a camera saw a target, by frame.
fn sightings(
    of_camera: &BTreeMap<String, Vec<Seen>>,
    target: usize,
) -> impl Iterator<Item = (&str, &Seen)> {
    let all = of_camera.iter().flat_map(|(name, seen)| seen.iter().map(move |seen| (name, seen)));
    all.filter(move |(_, seen)| seen.target == target).map(|(name, seen)| (name.as_str(), seen))
}
