//! Calibrates a camera from corners and writes its report.

#![allow(unreachable_pub, reason = "the page is the only user of this interface")]

use deltille_calibrate::{
    self, Calibration, HoldStatus, HoldTracker, Intrinsics, Model, NextView, Reference, Source,
    View, views,
};
use deltille_core::camera::{CameraFile, Pose};
use deltille_core::detection::{Detection, InkEstimate};
use deltille_core::quantity::print_scale;
use deltille_core::targets::Target;
use deltille_files::export::calibration::{Print, Residuals};
use deltille_files::export::sheet::Sheet;
use deltille_files::export::{CAMERA_FORMATS, Written, calibration, detection, next_view, saved};
use deltille_files::report::{Report, Survey, camera_notes};
use deltille_layout::Printing;
use wasm_bindgen::prelude::*;

use deltille_web::errors::{Raise, one_line};

/// A calibrated camera with its files and report.
#[wasm_bindgen]
pub struct Solved {
    json: String,
    formats: Vec<String>,
    page: String,
    said: Vec<String>,
    figures: String,
}

#[wasm_bindgen]
impl Solved {
    /// Calibrates a camera from detections of a target, one JSON text per image. `print_scale` contains the ratios of the
    /// measured to the stated length of the check bars, across and up the sheet, if they were measured.
    ///
    /// # Errors
    /// Throws if there are too few views, if they are too similar, if they do not belong together, or if the print scale is not
    /// valid or does not apply to the target.
    #[wasm_bindgen(constructor)]
    pub fn new(
        target: &str,
        detections: Vec<String>,
        names: Vec<String>,
        model: &str,
        print_scale: Option<Vec<f64>>,
    ) -> Result<Self, JsError> {
        let Printing { target, sheets, .. } = Printing::from_json(target).raise()?;
        let sheet = Sheet { print_scale: checked(print_scale)?, shape: None, sheets };
        let reference = Reference::Target(&target);
        let model: Model = model.parse().raise()?;
        let read = read(names, &detections)?;
        let found: Vec<_> = read.iter().filter_map(|(_, found)| found.ink).collect();
        let print = Print { scale: sheet.print_scale, ink: InkEstimate::of_all(&found) };
        let mut shown = views(&read, &reference).raise()?;
        sheet.put_on(Some(&target), &mut shown.views).raise()?;
        let panels = sheet.panels(&reference).raise()?;
        let calibration = Calibration::of(&reference, panels).camera(
            "camera",
            shown.views,
            Intrinsics::Unknown(model),
        );
        let mut estimate = calibration.solve().raise()?;
        let diagnoses = calibration.explain(&estimate);
        estimate.excluded.splice(0..0, shown.excluded.into_iter().map(|(_, out)| out));
        let found =
            estimate.cameras.first().ok_or_else(|| JsError::new("no camera was calibrated"))?;
        let poses = estimate.pose_uncertainties(std::slice::from_ref(&target));
        let mut page = Report::new("camera", &estimate);
        // Having too few views to compare models is not an error.
        let models = [calibration.compare_models(0).unwrap_or_default()];
        (page.diagnoses, page.stated) = (&diagnoses, calibration.panels());
        (page.print, page.models, page.poses) = (print, &models, &poses);
        page.notes
            .extend(camera_notes(read.iter().map(|(_, found)| found)).map(|notes| (0, notes)));
        let noise_sd = || found.parameters.iter().map(|parameter| parameter.sd).collect();
        let observed_sd = Some(found.observed_sd()).filter(|all| all.iter().any(Option::is_some));
        let observed_px = found.projection_sd_px(None, Source::Observed);
        let noise_px = || found.projection_sd_px(None, Source::Noise);
        let figures = serde_json::json!({
            "rms_px": found.rms_px, "views": found.views.len(), "corners": found.corner_count(),
            "names": found.camera.parameter_names(), "values": found.camera.parameters(),
            "sd": observed_sd.unwrap_or_else(noise_sd),
            "is_observed": observed_px.is_some(),
            "projection_sd_px": observed_px.or_else(noise_px),
        });
        let json = calibration::write(&estimate, &diagnoses, print, Residuals::Omitted, &poses)
            .unwrap_or_default();
        let file = CameraFile {
            camera: found.camera.clone(),
            calibrated_with: estimate.calibrated_with.clone(),
            failed: saved::failures(&json).into_iter().next(),
        };
        let views: Vec<(&str, Pose)> =
            found.views.iter().map(|view| (view.image.as_str(), view.pose)).collect();
        let written = Written { file: &file, name: "camera", views: &views };
        // Files of other formats cannot state the reason for a failure.
        let formats =
            CAMERA_FORMATS.iter().filter(|format| format.is_own() || file.failed.is_none());
        let formats =
            formats.filter_map(|format| Some([format.end.to_owned(), format.text(&written).ok()?]));
        Ok(Self {
            json,
            formats: formats.flatten().collect(),
            said: page.remedies().iter().map(one_line).collect(),
            page: page.html(),
            figures: figures.to_string(),
        })
    }

    /// Returns the calibration as JSON, as `deltille calibrate` writes it.
    pub fn json(&self) -> String {
        self.json.clone()
    }

    /// Returns the camera file in each format that supports the model, that of the programs first: the end of its name, then
    /// its text.
    pub fn formats(&self) -> Vec<String> {
        self.formats.clone()
    }

    /// Returns the report as HTML.
    pub fn page(&self) -> String {
        self.page.clone()
    }

    /// Returns what to improve, in sentences, the most important first.
    pub fn said(&self) -> Vec<String> {
        self.said.clone()
    }

    /// Returns the results as JSON.
    pub fn figures(&self) -> String {
        self.figures.clone()
    }
}

/// Returns the image coverage of detections as JSON: the image size, columns and rows of cells, the number of corners in each
/// cell row by row, and the fraction of cells with corners. For each image it gives the tilt of the board and the direction in
/// which the board is farther away, rad from right towards down; `null` for solids. Nothing if no image shows the target.
///
/// # Errors
/// Throws if a detection is invalid, if the images have different sizes, or if the model is unknown.
#[wasm_bindgen]
pub fn survey(
    target: &str,
    detections: Vec<String>,
    names: Vec<String>,
    model: &str,
) -> Result<Option<String>, JsError> {
    let target = Target::from_json(target).raise()?;
    let reference = Reference::Target(&target);
    let model: Model = model.parse().raise()?;
    let views = views(&read(names, &detections)?, &reference).raise()?.views;
    let Some(size_px) = views.first().map(|view| view.size_px) else { return Ok(None) };
    let solve = |intrinsics: Intrinsics| {
        let calibration = Calibration::of(&reference, reference.panels());
        calibration.camera("camera", views.clone(), intrinsics).solve().ok()
    };
    // With too few images, or too similar ones, use the camera that the guide assumes at first.
    let estimate = solve(model.into()).or_else(|| {
        let assumed = deltille_calibrate::Guide::new(&target, size_px, model)?.next(0, None).camera;
        solve(Intrinsics::Known(assumed))
    });
    let Some(camera) = estimate.as_ref().and_then(|estimate| estimate.cameras.first()) else {
        return Ok(None);
    };
    let survey = Survey::new(camera);
    let tilts = survey.views.iter().map(|view| view.tilt_rad.zip(view.tilt_direction_rad));
    let json = serde_json::json!({
        "size_px": size_px, "cells": survey.cells, "counts": survey.counts, "covered": survey.covered(),
        "tilts": tilts.collect::<Vec<_>>(),
    });
    Ok(Some(json.to_string()))
}

/// Checks that a print scale, if given, consists of two ratios in the range of the programs.
fn checked(print_scale: Option<Vec<f64>>) -> Result<Option<[f64; 2]>, JsError> {
    let Some(given) = print_scale else { return Ok(None) };
    let range = print_scale::RANGE;
    let is_ratio = |ratio: f64| (range.least..=range.most).contains(&ratio);
    match given[..] {
        [across, up] if is_ratio(across) && is_ratio(up) => Ok(Some([across, up])),
        _ => Err(JsError::new("not a valid ratio of measured to stated length (near 1)")),
    }
}

/// Reads detections and pairs them with their names.
fn read(names: Vec<String>, detections: &[String]) -> Result<Vec<(String, Detection)>, JsError> {
    let read = detections.iter().map(|text| detection::read(text));
    Ok(names.into_iter().zip(read.collect::<Result<Vec<_>, _>>().raise()?).collect())
}

/// Returns the poses of the panels of a target.
fn places(reference: &Reference) -> impl Iterator<Item = Pose> {
    reference.panels().into_iter().map(|panel| panel.target_from_panel)
}

/// Proposes the next webcam image, and reports when the board is held as proposed.
#[wasm_bindgen]
pub struct Guide {
    target: Target,
    guide: deltille_calibrate::Guide,
    views: Vec<View>,
    refused: Vec<NextView>,
    next: NextView,
    holding: HoldTracker,
}

#[wasm_bindgen]
impl Guide {
    /// Makes a guide for a target, an image size and a camera model.
    ///
    /// # Errors
    /// Throws if the model is unknown, or if no images can be proposed for it.
    #[wasm_bindgen(constructor)]
    pub fn new(target: &str, width: u32, height: u32, model: &str) -> Result<Self, JsError> {
        let target = Target::from_json(target).raise()?;
        let model: Model = model.parse().raise()?;
        let guide = deltille_calibrate::Guide::new(&target, [width, height], model)
            .ok_or_else(|| JsError::new("guided capture does not support this target and model"))?;
        let next = guide.next(0, None);
        let holding = HoldTracker::new(&next, places(&Reference::Target(&target)));
        Ok(Self { target, guide, views: Vec::new(), refused: Vec::new(), next, holding })
    }

    /// Adds a captured image, given as the JSON of its detection.
    ///
    /// # Errors
    /// Throws if `found` is not a valid detection.
    pub fn take(&mut self, name: &str, found: &str) -> Result<(), JsError> {
        let view = self.view(name, found)?;
        self.views.extend(view);
        self.propose();
        Ok(())
    }

    /// Skips the proposed pose.
    pub fn refuse(&mut self) {
        self.refused.push(self.next.clone());
        self.propose();
    }

    /// Returns the next proposal, as `deltille guide` writes it.
    pub fn next(&self) -> String {
        next_view::write(&self.next, &self.target.name, self.views.len(), self.next.is_enough(None))
    }

    /// Returns how the board is held in a frame taken at `time_s`: a word, and the fraction of the required holding time that
    /// has passed.
    ///
    /// # Errors
    /// Throws if `found` is not a valid detection.
    pub fn observe(&mut self, time_s: f64, found: &str) -> Result<String, JsError> {
        let view = self.view("frame", found)?;
        let held = self.holding.observe(time_s, view.as_ref(), None);
        let (word, part) = match held {
            HoldStatus::Elsewhere { .. } => ("elsewhere", 0.0),
            HoldStatus::Turned { .. } => ("turned", 0.0),
            HoldStatus::Moving { .. } => ("moving", 0.0),
            HoldStatus::Blurred => ("blurred", 0.0),
            HoldStatus::Steady { part } => ("steady", part),
            HoldStatus::Taken => ("taken", 1.0),
            _ => ("unseen", 0.0),
        };
        Ok(serde_json::json!({ "held": word, "part": part }).to_string())
    }

    fn view(&self, name: &str, found: &str) -> Result<Option<View>, JsError> {
        let named = [(name.to_owned(), detection::read(found).raise()?)];
        // An image without corners of the target is not a view, but not an error either.
        let shown = views(&named, &Reference::Target(&self.target)).ok();
        Ok(shown.and_then(|shown| shown.views.into_iter().next()))
    }

    fn propose(&mut self) {
        let reference = Reference::Target(&self.target);
        let guide = self.guide.clone().avoiding(&self.refused);
        self.next = guide.after(&reference, &self.views).next;
        self.holding = HoldTracker::new(&self.next, places(&reference));
    }
}
