//! Solves a calibration: holds out frames, and reports given cameras that contradict their images.

use super::error::CalibrationError;
use super::estimate::values::Estimate;
use super::input::calibration::{Calibration, CameraViews, TargetPanels};

/// A measured target is tested with every third view, as the models are.
const HELD_OUT: usize = 3;

impl Calibration {
    /// Estimates the cameras, their relative poses, the poses of the target, and everything else that was requested.
    ///
    /// For a known camera, the result is the pose of the target:
    ///
    /// ```
    /// use deltille_calibrate::{Calibration, Observation, PanelRef, Sighting, View};
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
    /// # Ok::<(), deltille_calibrate::CalibrationError>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error if there are too few views, or they are too similar, differ in size, or contradict each other.
    pub fn solve(&self) -> Result<Estimate, CalibrationError> {
        let found = self.solved();
        if self.stop.is_raised() { Err(CalibrationError::Stopped) } else { found }
    }

    fn solved(&self) -> Result<Estimate, CalibrationError> {
        let (own, test) = self.split()?;
        let estimate = own.adjusted().map_err(|error| own.with_cause(error))?;
        let held_out = match test {
            Some(test) => Some(Box::new(test.given(&estimate).adjusted()?)),
            None if self.measure_target => self.cross_validated(),
            None => None,
        };
        let calibrated_with = self.identities.clone();
        let mut estimate = Estimate { held_out, calibrated_with, ..estimate };
        estimate.findings.extend(estimate.of_measured_corners());
        Ok(estimate)
    }

    /// A failure with what was stated about the cameras and contradicts the images: given intrinsics, or constraints.
    fn with_cause(&self, error: CalibrationError) -> CalibrationError {
        if let foreign @ [_, ..] = self.foreign_cameras().as_slice() {
            let names: Vec<&str> = foreign.iter().map(|&c| &*self.cameras[c].name).collect();
            let (cameras, error) = (names.join(", "), Box::new(error));
            return CalibrationError::WrongCameras { cameras, error };
        }
        let is_free = || self.unconstrained().is_some_and(|free| free.adjusted().is_ok());
        if error.is_of_constraint() || !is_free() {
            return error;
        }
        let of_camera = |camera: &CameraViews| match self.cameras.len() {
            1 => String::new(),
            _ => format!("{}:", camera.name),
        };
        let constraints = self.cameras.iter().flat_map(|camera| {
            camera.constraints.iter().map(|of| format!("{}{of}", of_camera(camera)))
        });
        let constraints = constraints.collect::<Vec<_>>().join("; ");
        CalibrationError::WrongConstraints { constraints, error: Box::new(error) }
    }

    /// Every third view with the map and the cameras of the others; `None` if these do not suffice for a calibration.
    fn cross_validated(&self) -> Option<Box<Estimate>> {
        self.clone().hold_out(Some(HELD_OUT)).covariance_of_all(false).solved().ok()?.held_out
    }

    /// The same calibration with everything fixed to the estimate except the poses of the target.
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
                constraints: Vec::new(),
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
            covariance_of_all: false,
            order: self.order.clone(),
            delays: Some(estimate.cameras.iter().map(|camera| camera.delay).collect()),
            symmetries: self.symmetries.clone(),
            ..*self
        }
    }
}
