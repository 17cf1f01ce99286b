//! The views that together lower the projection uncertainty most.
//!
//! A provisional calibration of all views gives their poses and the information of each on the camera, see
//! [`gain`](crate::next_view::gain). Views are selected one after the other: always the one with which the projection
//! uncertainty over the image is lowest. Coverage of the image and tilt need no rules of their own, because they determine
//! this uncertainty. Blur and motion enter as the variance of the corners.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::estimate::values::{Estimate, ViewEstimate};
use crate::input::calibration::{Calibration, CameraViews, Intrinsics};
use crate::input::observation::View;
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

/// Number of views that are selected however little they reduce the uncertainty: enough for standard deviations from the
/// scatter between views.
const MIN_VIEWS: usize = 15;

/// Variance of a corner without a covariance, px².
const PLAIN_VARIANCE: f64 = 0.01;

impl Calibration {
    /// Selects views of the first camera for a calibration, at most `most`, and returns their indices in ascending order. Views
    /// that are not consistent with the others are not selected. `motion_px` is the motion of each view, see
    /// [`Keyframe::motion_px`](crate::Keyframe::motion_px).
    ///
    /// If the camera cannot be calibrated from all views, an even sample is returned.
    pub fn informative_views(&self, motion_px: &[f64], most: usize) -> Vec<usize> {
        let views = &self.cameras[0].views;
        let all: Vec<usize> = (0..views.len()).collect();
        if all.len() <= most {
            return all;
        }
        let selected = self.provisional().and_then(|estimate| {
            let gain = Gain::without_views(&estimate)?;
            let candidates = gains(&gain, &estimate, views, motion_px);
            Some(greedy(gain, candidates, most))
        });
        let selected = selected.filter(|selected| !selected.is_empty());
        selected.unwrap_or_else(|| evenly(&all, most).copied().collect())
    }

    /// The best calibration of the first camera alone, without other unknowns.
    fn provisional(&self) -> Option<Estimate> {
        let CameraViews { views, intrinsics, .. } = &self.cameras[0];
        let tried = match intrinsics {
            Intrinsics::Unknown(_) => PROVISIONAL.map(Intrinsics::from).to_vec(),
            Intrinsics::Known(camera) | Intrinsics::Near { camera, .. } => {
                let free = vec![true; camera.parameters().len()];
                vec![Intrinsics::Near { camera: camera.clone(), free }]
            }
        };
        let alone = self.alone(0, &self.panels);
        let solved = tried.into_par_iter().filter_map(|intrinsics| {
            let only = CameraViews::new("", views.clone(), intrinsics);
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

/// The information of each view that the estimate explains, with its index.
fn gains(
    gain: &Gain,
    estimate: &Estimate,
    views: &[View],
    motion_px: &[f64],
) -> Vec<(usize, ViewGain)> {
    let explained = estimate.cameras.iter().flat_map(|camera| &camera.views);
    let explained: BTreeMap<&str, &ViewEstimate> =
        explained.map(|view| (view.name.as_str(), view)).collect();
    let common = estimate.common_px.unwrap_or(0.0).powi(2);
    let of_view = |(index, view): (usize, &View)| {
        let pose = explained.get(view.name.as_str())?.pose;
        let added = common + (MOTION_SD * motion_px[index]).powi(2);
        let corners = view.sightings.iter().flat_map(|sighting| {
            let panel = estimate.panels.get(sighting.panel.index());
            let corner = move |panel: &crate::PanelPrior, seen: &crate::Observation| {
                let point = pose.apply(panel.target_from_panel.apply(seen.panel_mm));
                let own = seen.cov.map_or(PLAIN_VARIANCE, |[xx, _, yy]| (xx + yy) / 2.0);
                (point, own + added)
            };
            let seen = sighting.observations.iter();
            seen.filter_map(move |seen| Some(corner(panel?, seen)))
        });
        Some((index, gain.of_corners(corners)?))
    };
    views.iter().enumerate().filter_map(of_view).collect()
}

/// Selects one view after the other, while they reduce the uncertainty, and returns their indices in ascending order.
fn greedy(mut gain: Gain, mut candidates: Vec<(usize, ViewGain)>, most: usize) -> Vec<usize> {
    let (mut selected, mut before_px) = (Vec::new(), f64::INFINITY);
    while selected.len() < most {
        let judged = candidates.par_iter().enumerate();
        let judged = judged.filter_map(|(place, (_, view))| Some((place, gain.px_with(view)?)));
        let best = judged.min_by(|one, other| one.1.total_cmp(&other.1).then(one.0.cmp(&other.0)));
        let Some((place, px)) = best else { break };
        if selected.len() >= MIN_VIEWS && px > (1.0 - MIN_GAIN) * before_px {
            break;
        }
        before_px = px;
        let (index, view) = candidates.swap_remove(place);
        gain.add(&view);
        selected.push(index);
    }
    selected.sort_unstable();
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
        let motion_px: Vec<f64> =
            (0..40).map(|index| if index % 5 == 0 { 10.0 } else { 0.1 }).collect();
        let reference = Reference::Target(&target);
        let calibration = Calibration::of(&reference, reference.panels());
        let calibration = calibration.camera("camera", views, Model::Radtan);
        let selected = calibration.informative_views(&motion_px, 12);
        assert_eq!(selected.len(), 12);
        assert!(selected.iter().all(|index| index % 5 != 0), "{selected:?}");
        // Only tilted views determine the focal length. Once a few do, others determine the distortion as well as they do.
        let first = calibration.informative_views(&motion_px, 5);
        assert!(first.iter().all(|&index| is_tilted(index) && index % 5 != 0), "{first:?}");
        assert_eq!(calibration.informative_views(&motion_px, 40).len(), 40);
    }
}
