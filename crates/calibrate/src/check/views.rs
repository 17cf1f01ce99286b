//! The normal equations of new views for changes of the cameras and errors of the board.
//!
//! They are formed for the residuals with the earlier parameters, at a minimum with a prior of a given width: a [`LOOSE`] one,
//! so that large changes are close to linear, or a [`TIGHT`] one, so that the equations are exact if nothing has changed.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector};

use super::answer::{Missing, Shown};
use super::earlier::{Earlier, Unknown};
use crate::adjust::reweighting::{Kept, Settled, settle};
use crate::equations::block::Local;
use crate::equations::frame::OfFrame;
use crate::equations::minimise::{Minimum, Until, minimise};
use crate::error::CalibrationError;
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::intrinsics::Intrinsics;
use crate::input::observation::View;
use crate::problem::bundle::Problem;
use crate::problem::camera_prior::CameraPrior;
use crate::problem::corner_map::CornerMap;
use crate::problem::unknowns::Block;
use crate::problem::whitening::Whitening;
use crate::start::pose::estimate_pose;
use crate::start::rig::{self, Alone};
use deltille_core::statistics::median;

/// Standard deviations of the loose prior, in those of the calibration: wide enough that the views determine most of a
/// change, and narrow enough that they do not drive parameters far where they hardly determine them.
pub(super) const LOOSE: f64 = 5.0;

/// The same of a prior that keeps the cameras as calibrated.
pub(super) const TIGHT: f64 = 0.01;

/// The normal equations of all new views. The poses of the target are eliminated.
pub(super) struct Views {
    /// JᵀJ, Jᵀr and rᵀr of the whitened residuals with the earlier parameters; the unknowns are those of the cameras,
    /// then the offsets of the corners.
    pub gram: DMatrix<f64>,
    pub right: DVector<f64>,
    pub squares: f64,
    /// Number of residuals, less the unknowns.
    pub freedom: f64,
    /// The smallest plausible variance of the residuals, in the unit of the weights: that of the earlier calibration.
    pub least: f64,
    /// The corners of the board.
    pub map: CornerMap,
    /// The minimum.
    pub problem: Problem,
    pub rms_px: f64,
    /// Number of used views.
    pub count: usize,
}

impl Views {
    /// Forms the equations of the views of all cameras; the prior is `width` times as wide as the calibration is uncertain.
    pub(super) fn of(views: &Calibration, earlier: &Earlier, width: f64) -> Result<Self, Missing> {
        let no_views = || Missing::Views { camera: String::new() };
        let problem = start(views, earlier, width)?;
        let left_out = vec![false; problem.blocks.len()];
        let kept = Kept { problem, left_out, some_stand_out: false, factor: None };
        let settled = settle(kept, views.weights, views.loss).map_err(|_| no_views())?;
        let Settled { minimum, whitening, .. } = settled;
        let (whitening, least) = at_least(&minimum.problem, whitening, earlier.common_px);
        // The equations assume that the poses are at their optimum for these weights.
        let minimum = minimise(minimum.problem, &whitening, views.loss, Until::Fine);
        let found = Self::at(minimum.ok_or_else(no_views)?, &whitening, views, earlier);
        Ok(Self { least, ..found.ok_or_else(no_views)? })
    }

    fn at(
        minimum: Minimum,
        whitening: &Whitening,
        views: &Calibration,
        earlier: &Earlier,
    ) -> Option<Self> {
        let (layout, mut problem) = (minimum.layout, minimum.problem);
        let map = CornerMap::flat(&problem.blocks);
        let n = layout.shared;
        if n != earlier.unknowns.len() {
            return None;
        }
        let count = n + 3 * map.len();
        problem.map = Some(map.clone());
        let (mut gram, mut right, mut squares) =
            (DMatrix::zeros(count, count), DVector::zeros(count), 0.0);
        for frame in 0..problem.frames.len() {
            let of_frame = problem.blocks.iter().zip(&whitening.blocks);
            let of_frame = of_frame.filter(|(block, _)| block.frame == frame);
            let locals = of_frame.map(|(block, weights)| {
                Local::of(&problem, &layout, block, weights, views.loss, whitening.sigma)
            });
            let locals = locals.collect::<Option<Vec<Local>>>()?;
            squares += locals.iter().map(|local| local.cost).sum::<f64>();
            let frame = OfFrame::of(locals, n)?;
            frame.add_to(&mut gram);
            right += frame.right(count);
        }
        let mut off = DVector::zeros(count);
        off.rows_mut(0, n).copy_from(&change(&problem, earlier));
        let moved = &gram * &off;
        squares += 2.0 * off.dot(&right) + off.dot(&moved);
        right += moved;
        let freedom = 2.0 * problem.count() as f64 - 6.0 * problem.frames.len() as f64 - n as f64;
        let residuals = problem.blocks.iter().flat_map(|block| problem.residuals(block)).flatten();
        let (sum, all) =
            residuals.fold((0.0, 0.0), |(sum, all), off| (sum + off.length_squared(), all + 2.0));
        let rms_px = (sum / f64::max(all, 1.0)).sqrt();
        Some(Self {
            gram,
            right,
            squares,
            freedom,
            least: 0.0,
            map,
            count: of_views(&problem),
            problem,
            rms_px,
        })
    }

    /// How the views of a camera show the board.
    pub(super) fn shown(&self, camera: usize) -> Shown {
        let problem = &self.problem;
        let of = &problem.cameras[camera];
        let size = DVec2::new(of.camera.width.into(), of.camera.height.into());
        let blocks = || problem.blocks.iter().filter(|block| block.camera == camera);
        let tilt = |block: &Block| {
            let pose = of
                .camera_from_rig
                .after(&problem.frames[block.frame])
                .after(&problem.scene_from_panel(block.panel));
            let points: Vec<DVec3> = problem.camera_points(block).collect();
            let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
            let cosine = (pose.rotation * DVec3::Z).dot(middle.normalize_or(DVec3::Z)).abs();
            cosine.min(1.0).acos().to_degrees()
        };
        let corners = blocks().flat_map(|block| block.observations.iter());
        let reach =
            corners.map(|seen| (seen.pixel - (size - 1.0) / 2.0).length() / (0.5 * size.length()));
        Shown { tilt_deg: blocks().map(tilt).fold(0.0, f64::max), reach: reach.fold(0.0, f64::max) }
    }
}

/// Number of views: pairs of camera and frame.
fn of_views(problem: &Problem) -> usize {
    let views: BTreeSet<_> = problem.blocks.iter().map(|of| (of.camera, of.frame)).collect();
    views.len()
}

/// The whitening with a common standard deviation of at least the earlier one, and the smallest plausible s².
fn at_least(problem: &Problem, whitening: Whitening, earlier_px: Option<f64>) -> (Whitening, f64) {
    let Some((own, earlier)) = whitening.common_px.zip(earlier_px) else { return (whitening, 0.0) };
    let of_corners = problem.blocks.iter().flat_map(|block| block.observations.iter());
    let variances = of_corners.filter_map(|seen| seen.cov).map(|[xx, _, yy]| 0.5 * (xx + yy));
    let typical = median(variances.collect()).unwrap_or(0.0);
    let floor = (typical + earlier * earlier) / (typical + own * own);
    if own >= earlier {
        return (whitening, floor);
    }
    (Whitening { common_px: Some(earlier), ..whitening }.of(problem), 1.0)
}

/// The problem with the poses of all frames, and priors of the cameras.
fn start(views: &Calibration, earlier: &Earlier, width: f64) -> Result<Problem, Missing> {
    for (of, known) in views.cameras.iter().zip(earlier.cameras) {
        if of.views.is_empty() {
            return Err(Missing::Views { camera: known.name.clone() });
        }
    }
    if earlier.cameras.len() > 1 && !are_linked(&views.cameras) {
        return Err(Missing::Link);
    }
    // Relative poses are estimated from three times or more; from fewer, they start at the earlier ones.
    let started = started(views, earlier, false).or_else(|_| started(views, earlier, true));
    let mut problem =
        started.map_err(|_| Missing::Views { camera: earlier.cameras[0].name.clone() })?;
    for (index, (of, known)) in problem.cameras.iter_mut().zip(earlier.cameras).enumerate() {
        if !problem.blocks.iter().any(|block| block.camera == index) {
            return Err(Missing::Views { camera: known.name.clone() });
        }
        let free = known.free();
        of.free = (0..of.free.len()).map(|index| free.contains(&index)).collect();
        of.pose_free = known.pose_sd.is_some();
        let prior = earlier.parameters(index) * (width * width);
        of.prior = Some(CameraPrior::new(&known.camera, &prior).ok_or(Missing::Covariance)?);
    }
    Ok(problem)
}

/// The problem with the earlier intrinsics, and with the earlier relative poses if they are `placed`.
fn started(
    views: &Calibration,
    earlier: &Earlier,
    placed: bool,
) -> Result<Problem, CalibrationError> {
    let cameras = views.cameras.iter().zip(earlier.cameras).map(|(of, known)| {
        let mut of = CameraViews {
            intrinsics: Intrinsics::Known(known.camera.clone()),
            camera_from_rig: placed.then_some(known.camera_from_rig),
            ..of.clone()
        };
        if earlier.cameras.len() == 1 {
            // Names relate the views of several cameras.
            (0..).zip(&mut of.views).for_each(|(index, view)| view.name = format!("{index:09}"));
        }
        of
    });
    let mut own = views.of_cameras(cameras.collect());
    own.delays = Some(earlier.cameras.iter().map(|camera| camera.delay).collect());
    let seen = rig::start(&own, |of| {
        let [CameraViews { views, intrinsics: Intrinsics::Known(camera), .. }] = &of.cameras[..]
        else {
            return Err(CalibrationError::NoStart);
        };
        let panels = of.panel_poses();
        let pose = |view: &View| {
            let pose = estimate_pose(camera, &panels, &view.sightings)?;
            Some((view.name.clone(), pose))
        };
        let poses = views.iter().filter_map(pose).collect();
        Ok(Alone { camera: camera.clone(), roughness: None, poses, excluded: Vec::new() })
    });
    Ok(seen?.problem)
}

/// Returns whether views of the same time relate all cameras to each other.
fn are_linked(cameras: &[CameraViews]) -> bool {
    let names = |camera: &CameraViews| {
        camera.views.iter().map(|view| view.name.clone()).collect::<BTreeSet<_>>()
    };
    let mut left: Vec<BTreeSet<String>> = cameras.iter().map(names).collect();
    let Some(mut linked) = left.pop() else { return true };
    while let Some(next) = left.iter().position(|names| !names.is_disjoint(&linked)) {
        linked.extend(left.swap_remove(next));
    }
    left.is_empty()
}

/// The change of the cameras' unknowns since the earlier calibration.
fn change(problem: &Problem, earlier: &Earlier) -> DVector<f64> {
    let poses: Vec<[f64; 6]> = problem
        .cameras
        .iter()
        .zip(earlier.cameras)
        .map(|(now, before)| {
            let [turn, moved] = now.camera_from_rig.off(&before.camera_from_rig);
            [turn.x, turn.y, turn.z, moved.x, moved.y, moved.z]
        })
        .collect();
    let mut next = vec![0; poses.len()];
    let off = earlier.unknowns.iter().map(|unknown| match *unknown {
        Unknown::Parameter { camera, index } => {
            let [now, before] = [&problem.cameras[camera].camera, &earlier.cameras[camera].camera];
            now.parameters()[index] - before.parameters()[index]
        }
        Unknown::Pose { camera } => {
            next[camera] += 1;
            poses[camera][next[camera] - 1]
        }
    });
    DVector::from_iterator(earlier.unknowns.len(), off)
}
