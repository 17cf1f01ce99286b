//! From views to an estimate: start, outliers, adjustment, added unknowns, uncertainties.

use super::adjust::reweighting::{Kept, Settled};
use super::adjust::wrong_views::{Gross, WrongFrame, within_pictures};
use super::error::CalibrationError;
use super::estimate::values::{CameraEstimate, Estimate};
use super::excluded::{Excluded, Reason};
use super::input::calibration::{Calibration, CameraViews};
use super::input::intrinsics::Intrinsics;
use super::problem::panels;
use super::start::frames::{Frame, Start};
use super::start::rig::{self, Alone};
use super::start::single_camera::{self, enough};
use deltille_core::camera::PROJECTION_PARAMETERS;

/// Largest standard deviation of focal lengths and principal point, as a fraction of the focal
/// length. Beyond it, the parameter counts as undetermined: standard deviations come from
/// linearised equations, whose error is then as large as the standard deviation itself.
const LOOSE_FOCAL: f64 = 0.1;

impl Calibration {
    /// Computes the estimate from all views: start, outliers, adjustment, added unknowns, uncertainties.
    pub(super) fn adjusted(&self) -> Result<Estimate, CalibrationError> {
        self.settled().map(|(estimate, _)| estimate)
    }

    /// The same with the adjustment that it comes from, which has the same frames.
    pub(super) fn settled(&self) -> Result<(Estimate, Settled), CalibrationError> {
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
        let mut own = self.of_cameras(cameras.collect());
        let Start { mut problem, frames, mut excluded, delays, rotations } = start(&own)?;
        problem.stop = self.stop.clone();
        let gross = Gross::of(problem).ok_or(CalibrationError::NoStart)?;
        own.check_frames(&gross)?;
        let prepare = |kept: &mut Kept| panels::fix_gauge(&mut kept.problem, &kept.left_out, &own);
        let (gross, settled) = gross.settled(own.weights, own.loss, prepare)?;
        let of_frames = gross.frames.iter();
        excluded.extend(of_frames.map(|(&frame, why)| {
            (frames[frame].place, own.without_frame(&frames[frame], &gross, frame, why))
        }));
        excluded.sort_by_key(|(place, _)| *place);
        // The problem has a copy of the corners.
        let views = own.cameras.iter_mut().flat_map(|camera| &mut camera.views);
        views.for_each(|view| view.sightings = Vec::new());
        let settled = own.smoothed(&gross, settled)?;
        let settled = own.with_weighted_priors(&gross, settled)?;
        let (settled, f_ratio) = match own.board_shape {
            true => own.bent(&gross, settled)?,
            false => (settled, 0.0),
        };
        let (mut settled, found) = match own.measure_target {
            true => own.measured(&gross, settled)?,
            false => (settled, None),
        };
        findings.extend(gross.findings(&settled, |frame| frames[frame].name.clone()));
        let kept: Vec<&Frame> = gross.belonging().map(|frame| &frames[frame]).collect();
        let mut estimate = Estimate::new(&own, &kept, &mut settled, found, f_ratio)?;
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
        Ok((Estimate { excluded, findings, ..estimate }, settled))
    }

    /// Rejects views of panels whose poses are unknown.
    fn check_panels(&self) -> Result<(), CalibrationError> {
        let views = self.cameras.iter().flat_map(|camera| &camera.views);
        let mut seen = views.flat_map(|view| view.sightings.iter().map(move |of| (view, of.panel)));
        let Some((view, panel)) = seen.find(|(_, panel)| panel.index() >= self.panels.len()) else {
            return Ok(());
        };
        let problem = format!("the calibration has no pose for panel {panel}");
        Err(CalibrationError::WrongDetection { view: view.name.clone(), problem })
    }

    /// Rejects the calibration if too few of its views or frames agree.
    fn check_frames(&self, gross: &Gross) -> Result<(), CalibrationError> {
        let (wrong, all) = (gross.frames.len(), gross.problem.frames.len());
        match self.cameras.as_slice() {
            [only] if only.intrinsics.free().contains(&true) => {
                enough(all - wrong, only.views.len())
            }
            [_] => Ok(()),
            // Cameras of known pose can only be compared with the frames.
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

    /// The record of an excluded frame.
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
            WrongFrame::Inconsistent { deviations } => Reason::Stranger { is_rig, deviations },
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
}

/// # Errors
/// Returns an error if no initial values are found, or the views do not determine the unknowns.
fn start(calibration: &Calibration) -> Result<Start, CalibrationError> {
    match calibration.is_single() {
        true => single_camera::start(calibration),
        false => rig::start(calibration, by_itself),
    }
}

/// Calibrates a single camera; returns its estimate in the form needed for the initial values of
/// a rig.
fn by_itself(calibration: &Calibration) -> Result<Alone, CalibrationError> {
    let Estimate { cameras, excluded, .. } = calibration.adjusted()?;
    let only = cameras.into_iter().next().ok_or(CalibrationError::NoStart)?;
    let CameraEstimate { camera, roughness, views, .. } = only;
    let poses = views.into_iter().map(|view| (view.name, view.pose)).collect();
    Ok(Alone { camera, roughness, poses, excluded })
}

/// Rejects a camera if the views do not determine its focal length or principal point.
/// Ill-conditioned parameters of the lens are accepted: within the image they describe the same
/// camera.
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
