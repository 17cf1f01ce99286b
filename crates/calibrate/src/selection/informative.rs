//! The frames that together lower the projection uncertainty most.
//!
//! A provisional calibration of all views of a camera gives their poses and the information of each on the camera, see
//! [`gain`](crate::next_view::gain). Frames are selected one after the other: always the one with which the projection
//! uncertainty over the image is lowest, RMS over the cameras of a rig. Coverage of the image and tilt need no rules of their
//! own, because they determine this uncertainty. Blur and motion enter as the variance of the corners.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::estimate::values::{Estimate, ViewEstimate};
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::intrinsics::Intrinsics;
use crate::input::observation::View;
use crate::input::order::in_order;
use crate::input::sample::evenly;
use crate::model::Model;
use crate::next_view::gain::{Gain, ViewGain};

/// Models of the provisional calibration, the better fitting one is used: one for normal lenses, one for
/// fisheyes.
const PROVISIONAL: [Model; 2] = [Model::Radtan5, Model::KannalaBrandt(4)];

/// Standard deviation of a corner from the motion of the target, as a fraction of its displacement from frame to frame. A
/// rolling shutter, uneven exposure and compression displace the corners of a moving target against each other.
const MOTION_SD: f64 = 0.1;

/// Least relative reduction of the uncertainty by another view. The last of sixty equal views reduces it by 0.8 %; frames in
/// fast motion reduce it less, and their errors are not only noise.
const MIN_GAIN: f64 = 0.002;

/// Number of frames that are selected however little they reduce the uncertainty: enough for standard deviations from the
/// scatter between views. Of a rig, at least two cameras see the target in them, if there are as many such frames, because only
/// these determine the relative poses.
const MIN_FRAMES: usize = 15;

/// Variance of a corner without a covariance, px².
const PLAIN_VARIANCE: f64 = 0.01;

impl Calibration {
    /// Selects frames for a calibration, at most `most`, and returns their names. Frames that are not consistent with the others,
    /// or hardly reduce the uncertainty, are not selected. `motion_px` is the motion in each frame, see [`Keyframe::motion_px`](crate::Keyframe::motion_px).
    ///
    /// If no camera can be calibrated from all views, an even sample is returned.
    pub fn informative_frames(
        &self,
        motion_px: &BTreeMap<String, f64>,
        most: usize,
    ) -> BTreeSet<String> {
        let views = self.cameras.iter().flat_map(|camera| &camera.views);
        let all = in_order(views.map(|view| view.name.as_str()).collect());
        let cameras = (0..self.cameras.len()).into_par_iter();
        let cameras = cameras.filter_map(|camera| self.candidates(camera, motion_px));
        let selected = greedy(cameras.collect(), most);
        match selected.is_empty() {
            true => evenly(&all, most).cloned().collect(),
            false => selected,
        }
    }

    /// The information on a camera without views, and that of each of its views by frame.
    fn candidates(
        &self,
        camera: usize,
        motion_px: &BTreeMap<String, f64>,
    ) -> Option<(Gain, BTreeMap<String, ViewGain>)> {
        let estimate = self.provisional(camera)?;
        let gain = Gain::without_views(&estimate)?;
        let explained = estimate.cameras.iter().flat_map(|camera| &camera.views);
        let explained: BTreeMap<&str, &ViewEstimate> =
            explained.map(|view| (view.name.as_str(), view)).collect();
        let common = estimate.common_px.unwrap_or(0.0).powi(2);
        let of_view = |view: &View| {
            let added = common + (MOTION_SD * motion_px.get(&view.name)?).powi(2);
            let mut corners = Vec::new();
            // Each target in the image has its own pose.
            for part in self.by_target(view) {
                let Some(pose) = explained.get(part.name.as_str()).map(|view| view.pose) else {
                    continue;
                };
                for sighting in &part.sightings {
                    let panel = estimate.panels.get(sighting.panel.index())?;
                    corners.extend(sighting.observations.iter().map(|seen| {
                        let point = pose.apply(panel.target_from_panel.apply(seen.panel_mm));
                        let own = seen.cov.map_or(PLAIN_VARIANCE, |[xx, _, yy]| (xx + yy) / 2.0);
                        (point, own + added)
                    }));
                }
            }
            Some((view.name.clone(), gain.of_corners(corners.into_iter())?))
        };
        let views = self.cameras[camera].views.iter().filter_map(of_view).collect();
        Some((gain, views))
    }

    /// The best calibration of a camera alone, without other unknowns.
    pub(crate) fn provisional(&self, camera: usize) -> Option<Estimate> {
        let tried = match &self.cameras[camera].intrinsics {
            Intrinsics::Unknown(_) => PROVISIONAL.map(Intrinsics::from).to_vec(),
            Intrinsics::Known(camera) | Intrinsics::Near { camera, .. } => {
                let free = vec![true; camera.parameters().len()];
                vec![Intrinsics::Near { camera: camera.clone(), free }]
            }
        };
        let alone = self.alone(camera, &self.panels);
        let solved = tried.into_par_iter().filter_map(|intrinsics| {
            let only = CameraViews { intrinsics, ..alone.cameras[0].clone() };
            let calibration = alone.of_cameras(vec![only]).hold_out(None);
            calibration.board_shape(false).measure_target(false).solve().ok()
        });
        // A model that excludes views fits the others better.
        let cost = |estimate: &Estimate| {
            let seen = estimate.corner_count().max(1) as f64;
            estimate.inlier_rms_px() / (seen - estimate.outlier_count() as f64).max(1.0)
        };
        solved.min_by(|one, other| cost(one).total_cmp(&cost(other)))
    }
}

/// Selects one frame after the other, while they reduce the uncertainty, and returns their names.
fn greedy(mut cameras: Vec<(Gain, BTreeMap<String, ViewGain>)>, most: usize) -> BTreeSet<String> {
    let mut left: BTreeSet<String> =
        cameras.iter().flat_map(|(_, views)| views.keys().cloned()).collect();
    let (mut selected, mut before) = (BTreeSet::new(), f64::INFINITY);
    while selected.len() < most {
        // A camera without any view is uncertain by the whole image.
        let size = |gain: &Gain| f64::from(gain.camera.width.max(gain.camera.height));
        let now = cameras.iter().map(|(gain, _)| gain.now_px().unwrap_or(size(gain)));
        let now: Vec<f64> = now.collect();
        let seen_by =
            |frame: &String| cameras.iter().filter(|(_, of)| of.contains_key(frame)).count();
        let is_first = selected.len() < MIN_FRAMES;
        let are_shared = is_first && left.iter().any(|frame| seen_by(frame) >= 2);
        let judged = left.par_iter().filter(|frame| !are_shared || seen_by(frame) >= 2);
        let judged = judged.filter_map(|frame| {
            let of_camera =
                cameras.iter().zip(&now).map(|((gain, views), &now)| match views.get(frame) {
                    Some(view) => gain.px_with(view),
                    None => Some(now),
                });
            let squares = of_camera.map(|px| Some(px?.powi(2))).sum::<Option<f64>>()?;
            Some((frame, squares))
        });
        let best = judged.min_by(|one, other| one.1.total_cmp(&other.1).then(one.0.cmp(other.0)));
        let Some((frame, squares)) = best.map(|(frame, squares)| (frame.clone(), squares)) else {
            break;
        };
        if !is_first && squares > (1.0 - MIN_GAIN).powi(2) * before {
            break;
        }
        before = squares;
        for (gain, views) in &mut cameras {
            if let Some(view) = views.remove(&frame) {
                gain.add(&view);
            }
        }
        left.remove(&frame);
        selected.insert(frame);
    }
    selected
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec2, DVec3};
    use rand::{Rng, SeedableRng};

    use super::*;
    use crate::input::observation::{Observation, Sighting};
    use crate::input::panel::PanelRef;
    use crate::input::reference::Reference;
    use deltille_core::camera::{BrownConrady, Camera, Lens, Pose};
    use deltille_core::targets::{BoardSpec, Target};

    /// A view of a board that is tilted about the horizontal axis and moved, with noise of 0.05 px.
    fn view(target: &Target, index: usize, tilt: f64, random: &mut impl Rng) -> View {
        let camera =
            Camera::centred(1280, 960, 1100.0, Lens::BrownConrady(BrownConrady::default()));
        let turn = std::f64::consts::PI + tilt * if index.is_multiple_of(4) { 1.0 } else { -1.0 };
        let rotation = DQuat::from_rotation_z(0.8 * index as f64) * DQuat::from_rotation_x(turn);
        let aside = 40.0 * DVec2::from_angle(2.4 * index as f64);
        let centre = DVec3::new(aside.x, aside.y, 420.0);
        let translation = centre - rotation * target.panels[0].middle_mm();
        let pose = Pose { rotation, translation };
        let seen = target.panels[0].corners.iter().filter_map(|corner| {
            let noise =
                DVec2::new(random.random_range(-0.09..0.09), random.random_range(-0.09..0.09));
            Some(Observation {
                row: corner.row,
                col: corner.col,
                panel_mm: corner.panel_mm.extend(0.0),
                pixel: camera.project(pose.apply(corner.target_mm))? + noise,
                cov: Some([0.0025, 0.0, 0.0025]),
            })
        });
        let panel = PanelRef::new(0, target.panels[0].id);
        let sightings = vec![Sighting { panel, observations: seen.collect() }];
        View { name: index.to_string(), image: String::new(), size_px: [1280, 960], sightings }
    }

    #[test]
    fn still_and_tilted_views_are_selected() {
        let target = Target::new("board", BoardSpec::deltille(8, 10, 20.0)).unwrap();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let is_tilted = |index: usize| index.is_multiple_of(2);
        let views: Vec<View> = (0..40)
            .map(|index| {
                view(&target, index, if is_tilted(index) { 0.7 } else { 0.02 }, &mut random)
            })
            .collect();
        let motion_px =
            (0..40).map(|index| (index.to_string(), if index % 5 == 0 { 10.0 } else { 0.1 }));
        let motion_px = motion_px.collect();
        let reference = Reference::Target(&target);
        let calibration = Calibration::of(&reference, reference.panels());
        let calibration = calibration.camera("camera", views, Model::Radtan);
        let number = |name: &String| name.parse::<usize>().unwrap();
        let selected = calibration.informative_frames(&motion_px, 12);
        assert_eq!(selected.len(), 12);
        assert!(selected.iter().map(number).all(|index| index % 5 != 0), "{selected:?}");
        // Only tilted views determine the focal length. Once a few do, others determine the distortion as well as they do.
        let first = calibration.informative_frames(&motion_px, 5);
        assert!(
            first.iter().map(number).all(|index| is_tilted(index) && index % 5 != 0),
            "{first:?}"
        );
        // The others move too much to reduce the uncertainty.
        let all = calibration.informative_frames(&motion_px, 40);
        assert!(all.len() > 20 && all.iter().map(number).all(|index| index % 5 != 0), "{all:?}");
    }
}
