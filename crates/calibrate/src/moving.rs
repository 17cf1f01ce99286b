//! Calibration from recordings of a moving target: compensation for rolling shutters and clocks.
//!
//! 1. Each camera is calibrated from a sample of its views as they are.
//! 2. With these cameras, the timing is estimated from all frames, and the corners are compensated for it.
//! 3. Of the compensated views, the most informative ones are selected, once.
//! 4. The cameras are calibrated from these. 2 and 4 are repeated until the corners remain.
//!
//! The timing and the cameras hardly depend on each other if the target moves in all directions, so a few rounds suffice.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use super::error::CalibrationError;
use super::input::calibration::{Calibration, CameraViews};
use super::input::intrinsics::Intrinsics;
use super::input::observation::View;
use super::input::sample::evenly;
use super::model::Model;
use super::start::pose::estimate_pose;
use super::timing::compensated::Compensated;
use super::timing::values::{TimedCamera, Timing, TimingError};
use deltille_core::camera::{Camera, Pose};
use deltille_core::statistics::median;

/// Number of views of the first calibration of a camera, and of pairs of views that give its first pose on the rig.
const FIRST_VIEWS: usize = 60;

/// Number of frames from which views are selected; as many as are kept of other recordings.
const CANDIDATES: usize = 300;

/// Maximum number of rounds.
const MAX_ROUNDS: usize = 10;

/// Offsets are searched in half intervals, up to this number on both sides; as with known cameras.
const SEARCHED: i64 = 8;

/// Change of the corners (RMS), in their standard deviations, below which they remain: the parameters of a camera change by
/// less than this fraction of their standard deviations.
const SETTLED: f64 = 0.05;

/// A standard deviation of corners without covariance, px.
const PLAIN_PX: f64 = 0.1;

/// Why views cannot be compensated for the timing of their cameras.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompensationError {
    /// The timing cannot be estimated.
    #[error(transparent)]
    Timing(#[from] TimingError),
    /// The cameras cannot be calibrated.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// No image of a camera was taken together with one of the first camera.
    #[error(
        "{camera} and {first} never see the target at the same time; offset and pose of {camera} are unknown"
    )]
    Alone {
        /// Name of the camera.
        camera: String,
        /// Name of the first camera.
        first: String,
    },
    /// Cameras and timing do not agree after the maximum number of rounds.
    #[error(
        "the corners still change by {change_px:.3} px when readout and camera are estimated in turn; move the target in all \
         directions, and tilt it"
    )]
    Unsettled {
        /// RMS change of the corners in the last round, px.
        change_px: f64,
    },
}

/// Time stamps of the views of a camera by name, ns.
type Times = BTreeMap<String, i64>;

impl Calibration {
    /// The model for normal lenses or that for fisheyes with which a sample of the views of a camera is calibrated best; `None`
    /// if neither can be calibrated.
    pub fn provisional_model(&self, camera: usize) -> Option<Model> {
        let sampled = self.of_cameras(vec![sampled(&self.cameras[camera])]);
        sampled.provisional(0)?.cameras[0].model
    }

    /// Estimates readouts, offsets and drifts of the cameras from all frames of recordings of one moving target, see
    /// [`timing`](crate::timing()). Returns the calibration with the most informative views, at most `most`, as a global shutter
    /// and synchronous clocks would have seen them: each corner is at its position at the time of the middle row; of a rig, of the
    /// middle row of the first camera, after whose frames the views are named. Views without four neighbours in time are not
    /// used. What is not significant is not compensated.
    ///
    /// The views of this calibration are those of all frames in which a camera sees the target; `times_ns` has their time stamps
    /// by camera and name.
    ///
    /// # Errors
    /// Returns an error if the timing or the cameras cannot be estimated, or do not agree.
    pub fn compensated_for_timing(
        &self,
        times_ns: &[Times],
        most: usize,
    ) -> Result<(Self, Timing), CompensationError> {
        let mut cameras = self.first_cameras(times_ns)?;
        let mut panels = self.panel_poses();
        let (mut selected, mut change_px) = (None, f64::INFINITY);
        let mut before = BTreeMap::new();
        for _ in 0..MAX_ROUNDS {
            let Compensated { timing, views, mut motion_px } = Compensated::of(&cameras, &panels)?;
            if timing.is_determined() {
                // Motion is no error of compensated corners.
                motion_px.values_mut().for_each(|px| *px = 0.0);
            }
            let select = || self.with_views(&views).selected_frames(&motion_px, most);
            let selected = selected.get_or_insert_with(select);
            let views = views.into_iter().map(|mut of_camera| {
                of_camera.retain(|view| selected.contains(&view.name));
                of_camera
            });
            let found = self.with_views(&views.collect::<Vec<_>>());
            let now = found.positions();
            change_px = change(&before, &now);
            let corner_px = if timing.corner_sd_px > 0.0 { timing.corner_sd_px } else { PLAIN_PX };
            if change_px < SETTLED * corner_px {
                return Ok((Self { is_compensated: true, ..found }, timing));
            }
            before = now;
            let estimate = found.clone().hold_out(None).solve()?;
            for (camera, of) in cameras.iter_mut().zip(&estimate.cameras) {
                (camera.camera, camera.camera_from_rig) = (of.camera.clone(), of.camera_from_rig);
            }
            panels = estimate.panels.iter().map(|of| of.target_from_panel).collect();
        }
        Err(CompensationError::Unsettled { change_px })
    }

    /// The cameras with all their views, calibrated from a sample of the views as they are.
    fn first_cameras(&self, times_ns: &[Times]) -> Result<Vec<TimedCamera>, CompensationError> {
        let panels = self.panel_poses();
        let mut cameras: Vec<TimedCamera> = Vec::new();
        for (of, times_ns) in self.cameras.iter().zip(times_ns) {
            let camera = match &of.intrinsics {
                Intrinsics::Known(camera) => camera.clone(),
                _ => self.first_camera(of)?,
            };
            let stamped = |view: &View| Some((*times_ns.get(&view.name)?, view.clone()));
            let mut camera = TimedCamera {
                name: of.name.clone(),
                camera,
                camera_from_rig: Pose::IDENTITY,
                views: of.views.iter().filter_map(stamped).collect(),
            };
            camera.views.sort_by_key(|(ns, _)| *ns);
            if let Some(first) = cameras.first() {
                let pose = relative(first, &camera, &panels);
                camera.camera_from_rig = pose.ok_or_else(|| CompensationError::Alone {
                    camera: of.name.clone(),
                    first: first.name.clone(),
                })?;
            }
            cameras.push(camera);
        }
        Ok(cameras)
    }

    fn first_camera(&self, of: &CameraViews) -> Result<Camera, CalibrationError> {
        let sampled = self.of_cameras(vec![CameraViews { camera_from_rig: None, ..sampled(of) }]);
        let mut estimate = sampled.refine_panels(false).hold_out(None).solve()?;
        Ok(estimate.cameras.remove(0).camera)
    }

    /// The same calibration with these views of each camera.
    fn with_views(&self, views: &[Vec<View>]) -> Self {
        let cameras = self.cameras.iter().zip(views);
        let cameras = cameras.map(|(of, views)| CameraViews { views: views.clone(), ..of.clone() });
        self.of_cameras(cameras.collect())
    }

    /// The most informative of the frames, with these motions.
    fn selected_frames(&self, motion_px: &BTreeMap<String, f64>, most: usize) -> BTreeSet<String> {
        let all = self.moments();
        let with_motion = |name: &String| Some((name.clone(), *motion_px.get(name)?));
        let some: BTreeMap<String, f64> =
            evenly(&all, CANDIDATES).filter_map(with_motion).collect();
        let views = self.cameras.iter().map(|of| {
            of.views.iter().filter(|view| some.contains_key(&view.name)).cloned().collect()
        });
        self.with_views(&views.collect::<Vec<_>>()).informative_frames(&some, most)
    }

    /// The corners of all views.
    fn positions(&self) -> BTreeMap<(usize, String, usize, [i32; 2]), DVec2> {
        let mut positions = BTreeMap::new();
        for (camera, of) in self.cameras.iter().enumerate() {
            for view in &of.views {
                for sighting in &view.sightings {
                    for seen in &sighting.observations {
                        let corner = (sighting.panel.index(), [seen.row, seen.col]);
                        let key = (camera, view.image.clone(), corner.0, corner.1);
                        positions.insert(key, seen.pixel);
                    }
                }
            }
        }
        positions
    }
}

/// A camera with a sample of its views.
fn sampled(of: &CameraViews) -> CameraViews {
    let views = evenly(&of.views, FIRST_VIEWS).cloned().collect();
    CameraViews { views, ..of.clone() }
}

/// RMS distance per axis between common corners, px; infinite if there are none.
fn change<K: Ord>(before: &BTreeMap<K, DVec2>, now: &BTreeMap<K, DVec2>) -> f64 {
    let moved = now.iter().filter_map(|(key, at)| Some(at.distance_squared(*before.get(key)?)));
    let (sum, count) = moved.fold((0.0, 0), |(sum, count), squared| (sum + squared, count + 1));
    if count == 0 { f64::INFINITY } else { (sum / f64::from(2 * count)).sqrt() }
}

/// The pose of a camera relative to the first one, from pairs of views next to each other in time. The offset of the clocks is
/// searched in half intervals: with a wrong one, the poses of pairs differ by the motion in it. Of these poses, the one to which
/// the others are closest is used.
fn relative(first: &TimedCamera, camera: &TimedCamera, panels: &[Pose]) -> Option<Pose> {
    let intervals = first.views.windows(2).map(|two| (two[1].0 - two[0].0) as f64).collect();
    let half_ns = (median(intervals)? / 2.0) as i64;
    let pose = |of: &TimedCamera, (ns, view): &(i64, View)| {
        Some((*ns, estimate_pose(&of.camera, panels, &view.sightings)?))
    };
    let path: Vec<(i64, Pose)> = first.views.iter().filter_map(|of| pose(first, of)).collect();
    let some = evenly(&camera.views, FIRST_VIEWS).filter_map(|of| pose(camera, of));
    let some: Vec<(i64, Pose)> = some.collect();
    let with_offset = |halves: i64| {
        let pair = |(ns, own): &(i64, Pose)| {
            let ns = ns + halves * half_ns;
            let next = path.partition_point(|(other, _)| *other < ns);
            let near = path[next.saturating_sub(1)..].iter().take(2);
            let (at, of_first) = near.min_by_key(|(at, _)| (at - ns).abs())?;
            let is_near = (at - ns).abs() <= half_ns;
            is_near.then(|| (of_first.translation.length(), own.after(&of_first.inverse())))
        };
        let pairs: Vec<(f64, Pose)> = some.iter().filter_map(pair).collect();
        // A few pairs agree by chance.
        if 2 * pairs.len() > some.len() { closest(&pairs) } else { None }
    };
    let found = (-SEARCHED..=SEARCHED).filter_map(with_offset);
    found.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, pose)| pose)
}

/// The pose to which the others are closest, and their median distance as an angle; poses have the distance of the target, mm.
fn closest(poses: &[(f64, Pose)]) -> Option<(f64, Pose)> {
    let off = |&(distance_mm, pose): &(f64, Pose)| {
        let off = poses.iter().map(|(_, other)| {
            let [turn, step] = pose.off(other);
            turn.length() + step.length() / distance_mm
        });
        (median(off.collect()).unwrap_or(f64::INFINITY), pose)
    };
    poses.iter().map(off).min_by(|one, other| one.0.total_cmp(&other.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::values::CameraEstimate;
    use crate::timing::simulated::{NOISE_PX, filmed, filmed_in, resting, right_from_left};
    use deltille_core::camera::{BrownConrady, Lens};

    fn truth() -> Camera {
        let lens = Lens::BrownConrady(BrownConrady::default());
        let camera = Camera::centred(1280, 960, 1300.0, lens);
        let mut values = camera.parameters();
        // k1 and k2.
        (values[4], values[5]) = (-0.18, 0.06);
        camera.with_parameters(&values)
    }

    /// The calibration of the first `count` cameras, and the time stamps of their frames.
    fn recorded(count: usize, clocks: [[f64; 3]; 2], seed: u64) -> (Calibration, Vec<Times>) {
        given(filmed(&truth(), clocks, seed).into_iter().take(count))
    }

    fn given(cameras: impl Iterator<Item = TimedCamera>) -> (Calibration, Vec<Times>) {
        let (mut calibration, mut times_ns) = (Calibration::new([Pose::IDENTITY]), Vec::new());
        for of in cameras {
            times_ns.push(of.views.iter().map(|(ns, view)| (view.name.clone(), *ns)).collect());
            let views = of.views.into_iter().map(|(_, view)| view).collect();
            calibration = calibration.camera(&of.name, views, Model::Radtan);
        }
        (calibration.board_accuracy_mm(Some(0.0)), times_ns)
    }

    /// Squared errors of the intrinsics in observed standard deviations.
    fn squares(camera: &CameraEstimate) -> Vec<f64> {
        let truth = truth().parameters();
        let of = camera.parameters.iter().zip(camera.observed_sd()).zip(truth);
        let of = of.filter_map(|((found, sd), truth)| {
            let sd = sd.filter(|_| found.sd.is_some())?;
            Some(((found.value - truth) / sd).powi(2))
        });
        of.collect()
    }

    #[test]
    fn rolling_shutters_do_not_bias_intrinsics() {
        // Of up to 30 px and 10 px between the first and the last row.
        for (seed, readout_s) in [(0, 0.036), (1, -0.012)] {
            let (all, times_ns) = recorded(1, [[readout_s, 0.0, 0.0]; 2], seed);
            let plain = all.with_views(&[sampled(&all.cameras[0]).views]).solve().unwrap();
            let (found, timing) = all.compensated_for_timing(&times_ns, 60).unwrap();
            let estimate = found.solve().unwrap();
            let with = squares(&estimate.cameras[0]);
            let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
            assert!(largest(&with) < 12.0, "{with:?}");
            // The scatter of the uncompensated views hides their bias.
            assert!(plain.rms_px > 2.0 * estimate.rms_px, "{} {}", plain.rms_px, estimate.rms_px);
            assert!(estimate.rms_px < 1.1 * NOISE_PX, "{}", estimate.rms_px);
            let readout = timing.cameras[0].readout_s.unwrap();
            assert!((readout.value - readout_s).abs() < 4.0 * readout.sd, "{readout:?}");
        }
    }

    #[test]
    fn a_board_may_rest_most_of_the_time() {
        for (seed, readout_s) in [(0, 0.012), (1, -0.03)] {
            let cameras = filmed_in(&truth(), [[readout_s, 0.0, 0.0]; 2], seed, resting);
            let (all, times_ns) = given(cameras.into_iter().take(1));
            let (found, timing) = all.compensated_for_timing(&times_ns, 60).unwrap();
            let estimate = found.solve().unwrap();
            let squares = squares(&estimate.cameras[0]);
            assert!(squares.iter().all(|square| *square < 12.0), "{squares:?}");
            assert!(estimate.rms_px < 1.1 * NOISE_PX, "{}", estimate.rms_px);
            // The path between frames is not quite that of its model.
            let readout = timing.cameras[0].readout_s.unwrap().value;
            assert!((readout / readout_s - 1.0).abs() < 0.005, "{readout}");
        }
    }

    #[test]
    fn frames_at_rest_are_selected_where_motion_counts() {
        let [left, _] = filmed_in(&truth(), [[0.0; 3]; 2], 0, resting);
        let Compensated { motion_px, .. } =
            Compensated::of(std::slice::from_ref(&left), &[Pose::IDENTITY]).unwrap();
        let (all, _) = given(std::iter::once(left));
        let fastest =
            |of: BTreeSet<String>| of.iter().map(|name| motion_px[name]).fold(0.0, f64::max);
        let at_rest = fastest(all.selected_frames(&motion_px, 20));
        let none = motion_px.keys().map(|name| (name.clone(), 0.0)).collect();
        let any = fastest(all.selected_frames(&none, 20));
        assert!(at_rest < 1.0 && any > 10.0, "{at_rest} {any}");
    }

    #[test]
    fn corners_of_global_shutters_remain() {
        let (all, times_ns) = recorded(1, [[0.0; 3]; 2], 2);
        let (found, _) = all.compensated_for_timing(&times_ns, 40).unwrap();
        assert_eq!(found.cameras[0].views.len(), 40);
        let [before, now] = [all.positions(), found.positions()];
        assert!(change(&before, &now) < 1e-9, "{}", change(&before, &now));
    }

    #[test]
    fn clocks_do_not_bias_relative_poses() {
        let clocks = [[0.016, 0.0, 0.0], [-0.009, 0.0213, 2e-4]];
        let (all, times_ns) = recorded(2, clocks, 3);
        let (found, timing) = all.compensated_for_timing(&times_ns, 60).unwrap();
        let offset = timing.cameras[1].offset_s.unwrap();
        assert!((offset.value - clocks[1][1]).abs() < 4.0 * offset.sd, "{offset:?}");
        let estimate = found.solve().unwrap();
        assert!(estimate.rms_px < 1.1 * NOISE_PX, "{}", estimate.rms_px);
        let right = &estimate.cameras[1];
        let [turn, step] = right.camera_from_rig.off(&right_from_left());
        let off = turn.to_array().into_iter().chain(step.to_array());
        for (off, sd) in off.zip(right.observed_pose_sd.unwrap()) {
            assert!(off.abs() < 4.0 * sd, "{off} {sd}");
        }
    }

    /// Mean of squares, and how many exceed 9.
    fn rates(squares: &[f64]) -> String {
        let over = squares.iter().filter(|square| **square > 9.0).count();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        format!("{mean:.2}, beyond 3σ {over} of {}", squares.len())
    }

    #[test]
    #[ignore = "half an hour; prints the rates"]
    fn errors_in_standard_deviations() {
        for readout_s in [0.0, 0.0025, -0.0025, 0.012, -0.012, 0.036, -0.036] {
            let (mut with, mut without, mut readouts) = (Vec::new(), Vec::new(), Vec::new());
            for seed in 0..20 {
                let (all, times_ns) = recorded(1, [[readout_s, 0.0, 0.0]; 2], seed);
                let plain = all.with_views(&[sampled(&all.cameras[0]).views]).solve().unwrap();
                without.extend(squares(&plain.cameras[0]));
                let (found, timing) = all.compensated_for_timing(&times_ns, 60).unwrap();
                with.extend(squares(&found.solve().unwrap().cameras[0]));
                let readout = timing.cameras[0].readout_s.unwrap();
                readouts.push(((readout.value - readout_s) / readout.sd).powi(2));
            }
            let [with, without, readouts] = [&with, &without, &readouts].map(|of| rates(of));
            println!("{readout_s} s: {with}; not compensated: {without}; readout: {readouts}");
        }
        let (mut intrinsics, mut poses, mut clocks) = (Vec::new(), Vec::new(), Vec::new());
        for seed in 0..20 {
            let of = |period: u64| (seed % period) as f64 / (period - 1) as f64 - 0.5;
            let truths = [[0.03 * of(7), 0.0, 0.0], [0.03 * of(5), 0.2 * of(11), 4e-4 * of(3)]];
            let (all, times_ns) = recorded(2, truths, seed);
            let (found, timing) = match all.compensated_for_timing(&times_ns, 60) {
                Ok(found) => found,
                Err(error) => {
                    println!("{truths:?}: {error}");
                    continue;
                }
            };
            let estimate = found.solve().unwrap();
            intrinsics.extend(estimate.cameras.iter().flat_map(squares));
            let right = &estimate.cameras[1];
            let [turn, step] = right.camera_from_rig.off(&right_from_left());
            let off = turn.to_array().into_iter().chain(step.to_array());
            let sds = right.observed_pose_sd.unwrap();
            poses.extend(off.zip(sds).map(|(off, sd)| (off / sd).powi(2)));
            for (of, [readout, offset, drift]) in timing.cameras.iter().zip(truths) {
                let pairs = [(of.readout_s, readout), (of.offset_s, offset), (of.drift, drift)];
                let pairs = pairs.into_iter().filter_map(|(of, truth)| Some((of?, truth)));
                clocks.extend(pairs.map(|(of, truth)| ((of.value - truth) / of.sd).powi(2)));
            }
        }
        let [intrinsics, poses, clocks] = [&intrinsics, &poses, &clocks].map(|of| rates(of));
        println!("rigs: intrinsics {intrinsics}; relative poses {poses}; clocks {clocks}");
    }
}
