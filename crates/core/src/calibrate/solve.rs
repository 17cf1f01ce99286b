//! From a calibration to its estimate: start, gross errors, bundle adjustment.

use super::adjust::gross_errors::{Gross, WrongFrame, within_pictures};
use super::adjust::reweighting::{Settled, settle, variance};
use super::equations::minimise::{Minimum, Until, minimise};
use super::error::CalibrationError;
use super::estimate::values::{CameraEstimate, Estimate};
use super::excluded::{Excluded, Reason};
use super::input::calibration::{Calibration, CameraViews, Intrinsics};
use super::problem::bundle::Problem;
use super::problem::corner_map::CornerMap;
use super::problem::panels;
use super::problem::shape::{self, Shape};
use super::start::alone::{self, enough};
use super::start::frames::{Frame, Start};
use super::start::together;
use crate::calibrate::adjust::reweighting::Kept;
use crate::calibrate::input::calibration::TargetPanels;
use crate::camera::PROJECTION_PARAMETERS;

/// Focal lengths and the principal point are not determined when a deviation is more than this part
/// of the focal length: equations that are linear near the solution, as deviations are computed from,
/// are then off by as much as they say, and the deviation means nothing.
const LOOSE_FOCAL: f64 = 0.1;

impl Calibration {
    /// Finds the cameras, where they are to each other, where the target was, and what else was asked for.
    ///
    /// Of a known camera that is the pose of the target:
    ///
    /// ```
    /// use deltille_core::calibrate::{Calibration, Observation, PanelRef, Sighting, View};
    /// use deltille_core::camera::{Camera, Pose};
    /// use glam::DVec3;
    ///
    /// let camera = Camera::pinhole(640, 480, 1.0);
    /// let eye = DVec3::new(30.0, -80.0, 300.0);
    /// let truth = Pose::looking_at(eye, DVec3::new(40.0, 40.0, 0.0), DVec3::Y);
    /// let corners = (0..25).map(|i| (i / 5, i % 5)).map(|(row, col)| {
    ///     let panel_mm = DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0);
    ///     let pixel = camera.project(truth.apply(panel_mm)).unwrap();
    ///     Observation { row, col, panel_mm, pixel, cov: None }
    /// });
    /// let sighting = Sighting { panel: PanelRef::ONLY, observations: corners.collect() };
    /// let name = "0".to_owned();
    /// let image = "0.png".to_owned();
    /// let view = View { name, image, size_px: [640, 480], sightings: vec![sighting] };
    /// let estimate = Calibration::new([Pose::IDENTITY]).camera("c", vec![view], camera).solve()?;
    /// let [turn, step] = estimate.frames[0].rig_from_target.off(&truth);
    /// assert!(turn.length() < 1e-6 && step.length() < 1e-4);
    /// # Ok::<(), deltille_core::calibrate::CalibrationError>(())
    /// ```
    ///
    /// # Errors
    /// Where views are too few, too much alike, of different sizes, or do not belong together.
    pub fn solve(&self) -> Result<Estimate, CalibrationError> {
        let found = self.solved();
        if self.stop.is_raised() { Err(CalibrationError::Stopped) } else { found }
    }

    fn solved(&self) -> Result<Estimate, CalibrationError> {
        let (own, test) = self.split()?;
        let estimate = own.adjusted().map_err(|error| match own.foreign_cameras().as_slice() {
            [] => error,
            foreign => CalibrationError::ForeignCameras {
                cameras: foreign
                    .iter()
                    .map(|&c| &*self.cameras[c].name)
                    .collect::<Vec<_>>()
                    .join(", "),
                error: Box::new(error),
            },
        })?;
        let held_out = test.map(|test| test.given(&estimate).adjusted()).transpose()?;
        let (held_out, calibrated_with) = (held_out.map(Box::new), self.identities.clone());
        Ok(Estimate { held_out, calibrated_with, ..estimate })
    }

    /// The same with nothing to be found but where the target was: all else is as an estimate has it.
    fn given(&self, estimate: &Estimate) -> Self {
        let cameras = self.cameras.iter().zip(&estimate.cameras).map(|(camera, found)| {
            let mut views = camera.views.clone();
            for sighting in views.iter_mut().flat_map(|view| &mut view.sightings) {
                estimate.shape.iter().for_each(|found| sighting.bend(&found.shape));
                estimate.map.iter().for_each(|map| sighting.correct(map));
            }
            CameraViews {
                name: camera.name.clone(),
                views,
                intrinsics: found.camera.clone().into(),
                camera_from_rig: Some(found.camera_from_rig),
            }
        });
        let panels = estimate.panels.iter().map(|panel| panel.target_from_panel.into());
        let panels = panels.collect();
        let targets = self.targets.iter().zip(&estimate.targets).map(|(target, found)| {
            TargetPanels { scene_from_target: Some(found.scene_from_target), ..target.clone() }
        });
        Self {
            panels,
            targets: targets.collect(),
            identities: self.identities.clone(),
            cameras: cameras.collect(),
            stop: self.stop.clone(),
            refine_panels: false,
            board_shape: false,
            measure_target: false,
            distances_mm: Vec::new(),
            order: self.order.clone(),
            delays: Some(estimate.cameras.iter().map(|camera| camera.delay).collect()),
            symmetries: self.symmetries.clone(),
            ..*self
        }
    }

    /// Refuses views of panels whose places are not given.
    fn check_panels(&self) -> Result<(), CalibrationError> {
        let views = self.cameras.iter().flat_map(|camera| &camera.views);
        let mut seen = views.flat_map(|view| view.sightings.iter().map(move |of| (view, of.panel)));
        let Some((view, panel)) = seen.find(|(_, panel)| panel.index() >= self.panels.len()) else {
            return Ok(());
        };
        let problem = format!("panel {panel} is none of those whose places are given");
        Err(CalibrationError::WrongDetection { view: view.name.clone(), problem })
    }

    /// [`Self::solve`] without holding anything out.
    pub(super) fn adjusted(&self) -> Result<Estimate, CalibrationError> {
        if self.board_shape && self.panels.len() > 1 {
            return Err(CalibrationError::ShapeOfMany { panels: self.panels.len() });
        }
        self.check_panels()?;
        if self.stop.is_raised() {
            return Err(CalibrationError::Stopped);
        }
        let mut findings = Vec::new();
        let cameras = self.cameras.iter().enumerate().map(|(index, camera)| {
            let (views, beyond) = within_pictures(&camera.views, index);
            findings.extend(beyond);
            CameraViews { views, ..camera.clone() }
        });
        let own = self.of_cameras(cameras.collect());
        let Start { mut problem, frames, mut excluded, delays, rotations } = start(&own)?;
        problem.stop = self.stop.clone();
        let gross = Gross::of(problem).ok_or(CalibrationError::NoStart)?;
        own.check_frames(&gross)?;
        let prepare = |kept: &mut Kept| panels::hold(&mut kept.problem, &kept.left_out, &own);
        let (gross, settled) = gross.settled(own.weights, own.loss, prepare)?;
        let of_frames = gross.frames.iter();
        excluded.extend(of_frames.map(|(&frame, why)| {
            (frames[frame].place, own.without_frame(&frames[frame], &gross, frame, why))
        }));
        excluded.sort_by_key(|(place, _)| *place);
        let settled = own.smoothed(&gross, settled)?;
        let (settled, f_ratio) = match own.board_shape {
            true => own.bent(&gross, settled)?,
            false => (settled, 0.0),
        };
        let settled = match own.measure_target {
            true => own.measured(&gross, settled)?,
            false => settled,
        };
        findings.extend(gross.findings(&settled, |frame| frames[frame].name.clone()));
        let kept: Vec<&Frame> = gross.belonging().map(|frame| &frames[frame]).collect();
        let mut estimate = Estimate::new(&own, &kept, &settled, f_ratio)?;
        let of_cameras = estimate.cameras.iter_mut().zip(delays);
        for ((camera, delay), rotation) in of_cameras.zip(rotations) {
            (camera.delay, camera.label_rotation) = (delay, rotation);
        }
        if let ([camera], [CameraViews { intrinsics: Intrinsics::Unknown(_), .. }]) =
            (estimate.cameras.as_slice(), own.cameras.as_slice())
        {
            check_focal(camera)?;
        }
        let excluded = excluded.into_iter().map(|(_, out)| out).collect();
        Ok(Estimate { excluded, findings, ..estimate })
    }

    /// Refuses views of which too few belong together.
    fn check_frames(&self, gross: &Gross) -> Result<(), CalibrationError> {
        let (wrong, all) = (gross.frames.len(), gross.problem.frames.len());
        match self.cameras.as_slice() {
            [only] if only.intrinsics.free().contains(&true) => {
                enough(all - wrong, only.views.len())
            }
            [_] => Ok(()),
            // Cameras whose places are known can only be held against the frames.
            cameras if gross.problem.cameras.iter().any(|camera| camera.pose_free) => {
                if 2 * wrong <= all {
                    return Ok(());
                }
                let of_camera = |camera: usize| {
                    let is_off = |why: &&WrongFrame| matches!(why, WrongFrame::Off { camera: c, .. } if *c == camera);
                    gross.frames.values().filter(is_off).count()
                };
                let most = (0..cameras.len()).max_by_key(|&camera| of_camera(camera));
                let camera = cameras[most.unwrap_or_default()].name.clone();
                Err(CalibrationError::NotRigid { camera, wrong, all })
            }
            _ => Ok(()),
        }
    }

    /// What is told of a frame that does not belong.
    fn without_frame(
        &self,
        frame: &Frame,
        gross: &Gross,
        index: usize,
        why: &WrongFrame,
    ) -> Excluded {
        let is_rig = self.cameras.len() > 1;
        let reason = match *why {
            WrongFrame::Off { camera, off_px } if is_rig => {
                Reason::AnotherMoment { camera: self.cameras[camera].name.clone(), off_px }
            }
            WrongFrame::Off { off_px, .. } => Reason::Off { off_px, usual_px: gross.usual_px },
            WrongFrame::Mirrored => Reason::Mirrored,
            WrongFrame::Stranger { deviations } => Reason::Stranger { is_rig, deviations },
            WrongFrame::OnlyWrongPanels => Reason::OnlyWrongPanels,
        };
        if let (false, [(camera, view)]) = (is_rig, frame.views.as_slice()) {
            return self.cameras[*camera].views[*view].excluded(reason);
        }
        let of_frame = gross.problem.blocks.iter().filter(|block| block.frame == index);
        Excluded {
            camera: None,
            view: frame.name.clone(),
            image: String::new(),
            panel: None,
            corners: of_frame.map(|block| block.observations.len()).sum(),
            reason,
        }
    }

    /// Finds the shape of the sheet too, and the F ratio of what that explains.
    fn bent(&self, gross: &Gross, settled: Settled) -> Result<(Settled, f64), CalibrationError> {
        let flat = settled.minimum.normal.cost;
        let mut problem = settled.minimum.problem;
        let observations = problem.blocks.iter().flat_map(|block| &block.observations);
        problem.shape = Some(Shape::flat(observations.map(|seen| seen.panel_mm)));
        // Compared under the same weights.
        let bent = minimise(problem, &settled.whitening, self.loss, Until::Fine)
            .ok_or(CalibrationError::NoStart)?;
        let variance = variance(&bent, &settled.whitening, self.loss);
        let f_ratio = (flat - bent.normal.cost) / shape::COUNT as f64 / variance;
        let problem = settled.problem.at(&bent.problem);
        let settled = settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)?;
        Ok((settled, f_ratio))
    }
}

/// An expectation is found when it changes by less than this part.
const SAME_PRIOR: f64 = 0.05;

/// Rounds in which offsets and what is expected of them are fitted to one another.
const PRIOR_ROUNDS: usize = 10;

/// The same of the knots of a spline, whose rounds are shorter.
const KNOT_ROUNDS: usize = 15;

/// A size of second differences is found when it changes by less than this part.
const SAME_SIZE: f64 = 0.1;

impl Calibration {
    /// With splines as smooth as the corners have them.
    fn smoothed(&self, gross: &Gross, settled: Settled) -> Result<Settled, CalibrationError> {
        let has_splines = |problem: &Problem| problem.cameras.iter().any(|c| c.roughness.is_some());
        if !has_splines(&settled.problem) {
            return Ok(settled);
        }
        let Settled { minimum, whitening, problem: all, .. } = settled;
        let (mut minimum, mut rounds) = (minimum, 0);
        loop {
            let Minimum { problem, normal, layout, .. } = &minimum;
            let covariance = normal.covariance_of_kept().ok_or(CalibrationError::NoStart)?;
            let (mut next, mut change): (_, f64) = (problem.clone(), 0.0);
            for (camera, parameters) in next.cameras.iter_mut().zip(&layout.parameters) {
                let Some(now) = &camera.roughness else { continue };
                let found = now.fitted(&camera.camera, parameters, whitening.sigma, &covariance);
                change = change.max(now.change(&found));
                camera.roughness = Some(found);
            }
            rounds += 1;
            if change < SAME_SIZE || rounds > KNOT_ROUNDS {
                break;
            }
            minimum = minimise(next, &whitening, self.loss, Until::Rough)
                .ok_or(CalibrationError::NoStart)?;
        }
        let problem = all.at(&minimum.problem);
        settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)
    }

    /// Finds the place of every corner of the target too.
    fn measured(&self, gross: &Gross, settled: Settled) -> Result<Settled, CalibrationError> {
        let mut problem = settled.problem.clone();
        let map = CornerMap::flat(&problem.blocks);
        problem.map = Some(map);
        let mut settled = settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)?;
        for _ in 0..PRIOR_ROUNDS {
            let Minimum { problem, normal, layout, .. } = &settled.minimum;
            let Some(map) = &problem.map else { break };
            let found = normal.covariances(layout).ok_or(CalibrationError::NoStart)?;
            let fitted = map.fitted_prior(&found.corners, settled.whitening.sigma);
            let change = (fitted.0 - map.prior_mm).abs() / map.prior_mm;
            if change.max_element() < SAME_PRIOR {
                break;
            }
            let mut problem = settled.problem.clone();
            problem.map = Some(map.clone().expecting(fitted));
            settled = settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)?;
        }
        Ok(settled)
    }
}

/// # Errors
/// Where no start is found, or the views cannot determine what is sought.
fn start(calibration: &Calibration) -> Result<Start, CalibrationError> {
    match calibration.is_single() {
        true => alone::start(calibration),
        false => together::start(calibration),
    }
}

/// Refuses a camera that the views leave open. Parameters of the lens that cannot be told apart are
/// no reason: within the image they make the same camera.
fn check_focal(found: &CameraEstimate) -> Result<(), CalibrationError> {
    let of_every_lens = &found.parameters[..PROJECTION_PARAMETERS.len()];
    let loose = of_every_lens.iter().filter(|p| {
        let focal = if p.name.starts_with('f') { p.value } else { found.camera.focal_px.x };
        found.ill_conditioned.contains(&p.name) || p.sd.is_some_and(|sd| sd > LOOSE_FOCAL * focal)
    });
    let loose: Vec<&str> = loose.map(|p| p.name.as_str()).collect();
    match loose.is_empty() {
        true => Ok(()),
        false => Err(CalibrationError::Undetermined { parameters: loose.join(", ") }),
    }
}
