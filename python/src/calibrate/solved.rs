//! A solved calibration: its file, its report and its diagnoses.

use std::collections::BTreeMap;

use deltille::calibrate::{Candidate, Diagnosis, Estimate, Messages, PanelPrior, PoseUncertainty};
use deltille::export::calibration::{Print, Residuals};
use deltille::export::{calibration, rig};
use deltille::layout::Printing;
use deltille::raster::CameraNotes;
use deltille::report::Report;
use pyo3::prelude::*;
use serde_json::Value;

use crate::boundary::errors;

/// The result of a calibration.
pub struct Solved {
    pub estimate: Estimate,
    pub diagnoses: Vec<Diagnosis>,
    pub print: Print,
    /// Poses of the panels in the target's file.
    pub stated: Vec<PanelPrior>,
    /// The models compared, by camera.
    pub models: Vec<Vec<Candidate>>,
    /// Metadata of the photographs, by camera; absent if it was read from a file.
    pub notes: BTreeMap<usize, CameraNotes>,
    pub targets: Vec<Printing>,
    /// Uncertainties of poses of the targets; empty if it was read from a file, which lists them.
    pub poses: Vec<PoseUncertainty>,
    pub model: String,
    /// Whether it is a rig, which may have a single camera.
    pub is_rig: bool,
    /// The text and content of the file it was read from.
    pub file: Option<(String, Value)>,
}

impl Solved {
    /// Creates a result from the content of a file.
    pub fn read(estimate: Estimate, targets: Vec<Printing>, model: String, text: &str) -> Self {
        let whole: Option<Value> = serde_json::from_str(text).ok();
        let file = whole.map(|whole| (text.to_owned(), whole));
        let (diagnoses, models) = (Vec::new(), Vec::new());
        Self {
            estimate,
            diagnoses,
            print: Print::default(),
            stated: Vec::new(),
            models,
            notes: BTreeMap::new(),
            targets,
            poses: Vec::new(),
            model,
            is_rig: file.as_ref().is_some_and(|(_, whole)| whole.get("cameras").is_some()),
            file,
        }
    }

    /// Returns the content of the file it was read from, restricted to a camera if there are several.
    pub fn in_file(&self, camera: Option<usize>) -> Option<&Value> {
        let (_, whole) = self.file.as_ref()?;
        Some(camera.and_then(|camera| whole["cameras"].get(camera)).unwrap_or(whole))
    }

    /// Whether all data for a report is known. A file contains the sentences of diagnoses, but not their data.
    pub fn is_whole(&self) -> bool {
        let is_said =
            |file: &Value| file["diagnoses"].as_array().is_some_and(|all| !all.is_empty());
        let is_lost = |file| self.targets.is_empty() || is_said(file);
        self.has_corners() && !self.in_file(None).is_some_and(is_lost)
    }

    /// Whether the corners it was calibrated from are known.
    pub fn has_corners(&self) -> bool {
        self.estimate.cameras.iter().any(|camera| camera.corner_count() > 0)
    }

    /// Returns the text that the programs write.
    pub fn json(&self, residuals: Residuals) -> String {
        if let Some((text, _)) = &self.file {
            return text.clone();
        }
        let Self { estimate, diagnoses, print, poses, .. } = self;
        match self.is_rig {
            true => rig::write(estimate, diagnoses, &self.model, *print, residuals, poses),
            false => calibration::write(estimate, diagnoses, *print, residuals, poses)
                .unwrap_or_default(),
        }
    }

    /// Whether two results are equal, corner by corner if the corners of both are known.
    pub fn is_same(&self, other: &Self) -> bool {
        let has_corners = self.has_corners() && other.has_corners();
        let content = |solved: &Self| {
            let listed = if has_corners { Residuals::Listed } else { Residuals::Omitted };
            let mut whole: Value = serde_json::from_str(&solved.json(listed)).unwrap_or_default();
            if !has_corners {
                forget_corners(&mut whole);
            }
            whole
        };
        content(self) == content(other)
    }

    /// Fails if the result, read from a file, lacks what a report shows.
    pub fn check_whole(&self) -> PyResult<()> {
        if self.is_whole() {
            return Ok(());
        }
        let what = "this calibration lacks data for a report: write the report directly after calibrating; if there are \
                    no diagnoses, you can instead save with residuals=True and load with the target";
        Err(errors::calibration(what.to_owned()))
    }

    /// Returns the report.
    pub fn page<'a>(&'a self, title: &'a str) -> Report<'a> {
        let mut page = Report::new(title, &self.estimate);
        page.poses = &self.poses;
        (page.diagnoses, page.stated) = (&self.diagnoses, &self.stated);
        (page.print, page.models) = (self.print, &self.models);
        page.notes = self.notes.clone();
        page
    }

    /// Returns the diagnoses as plain data with a sentence each, and whether each is a failure.
    pub fn said(&self) -> Vec<(Value, bool)> {
        if let Some(file) = self.in_file(None) {
            let is_failure =
                |record: &Value| record["kind"].as_str().is_some_and(calibration::is_failure);
            return records_of(file)
                .into_iter()
                .map(|record| (record.clone(), is_failure(&record)))
                .collect();
        }
        let file = serde_json::from_str(&self.json(Residuals::Omitted)).unwrap_or_default();
        let records = records_of(&file);
        let words = Messages::new(&self.estimate, self.print.scale);
        let said = |diagnosis: &Diagnosis| {
            let text = words.sentence(diagnosis);
            let record = records.iter().find(|record| record["text"] == text.as_str());
            let record = record.cloned().unwrap_or_else(|| serde_json::json!({ "text": text }));
            (record, diagnosis.is_failure())
        };
        self.diagnoses.iter().map(said).collect()
    }
}

/// Removes the lists of corners from the content of a file.
fn forget_corners(of: &mut Value) {
    for view in of["views"].as_array_mut().into_iter().flatten() {
        view.as_object_mut().map(|view| view.remove("corners"));
    }
    of["cameras"].as_array_mut().into_iter().flatten().for_each(forget_corners);
}

/// Returns the findings and diagnoses in a file.
fn records_of(file: &Value) -> Vec<Value> {
    let all = ["findings", "diagnoses"].map(|list| file[list].as_array().cloned());
    all.into_iter().flatten().flatten().collect()
}
