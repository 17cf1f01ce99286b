//! Solves calibrations: checked arguments, and the work.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use deltille::calibrate::{
    Calibration, CalibrationError, Candidate, Constraint, ConstraintError, Diagnosis, Estimate,
    Excluded, Intrinsics, Loss, Messages, Model, PanelPrior, PoseUncertainty, Reference,
    UntaggedGrid, View, Weights, views,
};
use deltille::export::calibration::{Print, Residuals};
use deltille::export::sheet::Sheet;
use deltille::export::{calibration, rig};
use deltille::layout::Printing;
use deltille::raster::CameraNotes;
use deltille::report::{Report, camera_notes};
use deltille::{camera, detect, targets};
use deltille_core::quantity::{board_accuracy_mm, distance_mm, edge_mm, print_scale};
use pyo3::prelude::*;
use serde_json::Value;

use crate::boundary::arrays::{number, vector, whole};
use crate::boundary::errors::{self, Raise, raised, warn};
use crate::boundary::interrupt::interruptible;
use crate::see::detection::Detection;
use crate::see::detector::{size, tiling};
use crate::targets::target::Targets;

/// The photographed target.
pub enum Seen {
    /// At least one target.
    Targets {
        targets: Vec<targets::Target>,
        /// The targets with their sheets.
        printed: Vec<Printing>,
    },
    /// An untagged board.
    Grid(UntaggedGrid),
}

impl Seen {
    /// Checks the arguments: targets, or a grid with its edge.
    pub fn of(
        target: Option<Targets>,
        grid: Option<&str>,
        [rows, cols]: [Option<u32>; 2],
        edge_mm: Option<f64>,
    ) -> PyResult<Self> {
        let wrong = |what: &str| Err(raised::CalibrationError::new_err(what.to_owned()));
        match (target.map(|targets| targets.0).unwrap_or_default(), grid) {
            (found, None) if found.is_empty() => wrong(
                "pass a target, or grid=\"deltille\" or \"checker\" with edge_mm for untagged boards",
            ),
            (found, None) => {
                let own = |target: &crate::targets::target::Target| (*target.printing).clone();
                let printed: Vec<Printing> = found.iter().map(own).collect();
                let targets = printed.iter().map(|printing| printing.target.clone()).collect();
                Ok(Self::Targets { targets, printed })
            }
            (found, Some(grid)) if found.is_empty() => {
                let Some(edge_mm) = edge_mm else {
                    return wrong("grid needs edge_mm, the edge of its tiles in mm");
                };
                let edge_mm = number("edge_mm", edge_mm, edge_mm::RANGE, errors::calibration)?;
                let size = size(rows, cols)?.map(|(rows, cols)| [rows, cols]);
                Ok(Self::Grid(UntaggedGrid { kind: tiling(grid)?, edge_mm, size }))
            }
            _ => wrong("target and grid are mutually exclusive"),
        }
    }

    /// Returns the reference of the views.
    pub fn reference(&self) -> Reference<'_> {
        match self {
            Self::Targets { targets, .. } => match targets.as_slice() {
                [only] => Reference::Target(only),
                several => Reference::Scene(several),
            },
            Self::Grid(grid) => Reference::Grid(*grid),
        }
    }

    /// Returns the targets; none for a grid.
    pub fn targets(&self) -> &[targets::Target] {
        match self {
            Self::Targets { targets, .. } => targets,
            Self::Grid(_) => &[],
        }
    }

    /// Returns the targets with their sheets; none for a grid.
    pub fn printed(&self) -> &[Printing] {
        match self {
            Self::Targets { printed, .. } => printed,
            Self::Grid(_) => &[],
        }
    }
}

/// Options of a calibration.
#[derive(Clone)]
pub struct How {
    pub loss: Loss,
    pub weights: Weights,
    pub hold_out: Option<usize>,
    pub board_shape: bool,
    pub measure_target: bool,
    pub refine_target: bool,
    pub distances_mm: Vec<f64>,
    pub board_accuracy_mm: Option<f64>,
    pub assume_target: bool,
    pub covariance_of_all: bool,
    pub constraints: Vec<Constraint>,
    pub sheet: Sheet,
}

impl How {
    /// Checks the options that `calibrate` and `rig` share.
    pub fn of(
        loss: &str,
        weights: &str,
        hold_out: Option<i64>,
        distances_mm: Option<Vec<f64>>,
        print_scale: Option<&Bound<'_, PyAny>>,
        accuracy_mm: Option<f64>,
    ) -> PyResult<Self> {
        let wrong = |what: &str| raised::CalibrationError::new_err(what.to_owned());
        let loss = match loss {
            "huber" => Loss::Huber,
            "cauchy" => Loss::Cauchy,
            "none" => Loss::Squared,
            _ => return Err(wrong(&format!("unknown loss {loss} (known: huber, cauchy, none)"))),
        };
        let weights = match weights {
            "covariance" => Weights::Covariance,
            "equal" => Weights::Equal,
            _ => {
                return Err(wrong(&format!(
                    "unknown weights {weights} (known: covariance, equal)"
                )));
            }
        };
        if hold_out.is_some_and(|every| every < 2) {
            return Err(wrong("hold_out must be at least 2"));
        }
        let hold_out = hold_out.map(|every| whole("hold_out", every, errors::calibration));
        let distances_mm = distances_mm.unwrap_or_default();
        for &mm in &distances_mm {
            number("distances_mm", mm, distance_mm::RANGE, errors::calibration)?;
        }
        let print_scale = print_scale.map(print_scale_of).transpose()?;
        let accuracy_mm = accuracy_mm.map(|mm| {
            number("board_accuracy_mm", mm, board_accuracy_mm::RANGE, errors::calibration)
        });
        Ok(Self {
            loss,
            weights,
            hold_out: hold_out.transpose()?,
            board_shape: false,
            measure_target: false,
            refine_target: false,
            distances_mm,
            board_accuracy_mm: accuracy_mm.transpose()?,
            assume_target: false,
            covariance_of_all: false,
            constraints: Vec::new(),
            sheet: Sheet { print_scale, ..Sheet::default() },
        })
    }
}

/// One text or several.
#[derive(FromPyObject)]
pub enum Texts {
    One(String),
    Several(Vec<String>),
}

/// Parses constraints on a camera: fixed, equal and measured parameters.
pub fn constraints(
    fix: Option<Texts>,
    equal: Option<Texts>,
    prior: Option<Texts>,
) -> PyResult<Vec<Constraint>> {
    type Parse = fn(&str) -> Result<Constraint, ConstraintError>;
    let all: [(&str, Option<Texts>, Parse, bool); 3] = [
        ("fix", fix, Constraint::fixed, true),
        ("equal", equal, Constraint::equal, false),
        ("prior", prior, Constraint::prior, true),
    ];
    let mut found = Vec::new();
    for (keyword, texts, parse, is_list) in all {
        let texts = match texts {
            None => Vec::new(),
            Some(Texts::One(text)) => vec![text],
            Some(Texts::Several(texts)) => texts,
        };
        for text in &texts {
            let parts: Vec<&str> = if is_list { text.split(',').collect() } else { vec![text] };
            for part in parts {
                let parsed = parse(part).map_err(|error| {
                    errors::calibration(format!("{keyword}: {}", errors::one_line(&error)))
                });
                found.push(parsed?);
            }
        }
    }
    Ok(found)
}

/// Reads the print scale across and up the sheet: measured over nominal length, one number or two.
pub fn print_scale_of(given: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    match given.extract::<f64>() {
        Ok(both) => Ok([number("print_scale", both, print_scale::RANGE, errors::calibration)?; 2]),
        Err(_) => vector("print_scale", given, print_scale::RANGE, errors::calibration),
    }
}

/// A model, or `None` for automatic selection.
#[derive(Clone, Copy)]
pub struct ModelChoice(pub Option<Model>);

impl ModelChoice {
    pub fn of(text: &str) -> PyResult<Self> {
        if let Some(model) = Model::named_elsewhere(text) {
            return Ok(Self(Some(model)));
        }
        match text {
            "auto" => Ok(Self(None)),
            _ => match text.parse() {
                Ok(model) => Ok(Self(Some(model))),
                Err(error) => {
                    let what =
                        format!("{}, or auto for automatic selection", errors::one_line(&error));
                    Err(errors::calibration(what))
                }
            },
        }
    }

    /// Returns the model with the most parameters among the choices.
    pub fn richest(self) -> Model {
        self.0.unwrap_or(Model::ThinPrism)
    }

    pub fn name(self) -> String {
        self.0.map_or("auto".to_owned(), |model| model.to_string())
    }
}

/// Detections with the names of their views.
pub type Named = Vec<(String, detect::Detection)>;

/// Names the views of detections: by `names`, otherwise after their images, otherwise by their index. Duplicate images are
/// skipped with a warning.
pub fn named(
    py: Python<'_>,
    detections: &[PyRef<'_, Detection>],
    names: Option<Vec<String>>,
) -> PyResult<Named> {
    if names.as_ref().is_some_and(|names| names.len() != detections.len()) {
        let what = "names must have one entry per detection";
        return Err(raised::CalibrationError::new_err(what));
    }
    let mut all: Named = Vec::new();
    for (index, detection) in detections.iter().enumerate() {
        let found = &detection.found;
        let stem = Path::new(&found.image).file_stem().map(|stem| stem.to_string_lossy());
        let name = names.as_ref().map(|names| names[index].clone());
        let name = name.or(stem.map(|stem| stem.into_owned())).filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| format!("{index:04}"));
        let is_same = |(_, other): &&(String, detect::Detection)| {
            !found.grids.is_empty() && found.grids == other.grids
        };
        if let Some((first, _)) = all.iter().find(is_same) {
            errors::warn(
                py,
                &format!("{name} has the same corners as {first}; it is counted once"),
            )?;
            continue;
        }
        all.push((name, (**found).clone()));
    }
    Ok(all)
}

/// Assigns detections to the given targets, even if they name others.
pub fn assume(detections: &mut Named, targets: &[targets::Target]) {
    let given: Vec<_> = targets.iter().map(targets::Target::identity).collect();
    for (_, found) in detections {
        found.assume_targets(&given);
    }
}

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

/// A known or unknown camera with its detections.
pub struct OneCamera {
    pub name: String,
    pub detections: Named,
    pub known: Option<camera::Camera>,
}

/// Calibrates cameras.
pub fn solve(
    py: Python<'_>,
    seen: Seen,
    cameras: Vec<OneCamera>,
    is_rig: bool,
    model: ModelChoice,
    mut how: How,
) -> PyResult<Solved> {
    let seen = Arc::new(seen);
    let (mut all, mut named) = (Vec::new(), Vec::new());
    let (mut left_out, mut ink, mut panels) = (Vec::new(), Vec::new(), Vec::new());
    let is_named = cameras.len() > 1;
    let mut notes = BTreeMap::new();
    {
        if let [only] = seen.printed() {
            how.sheet.sheets = only.sheets.clone();
        }
        let reference = seen.reference();
        panels.extend(how.sheet.panels(&reference).raise(errors::calibration)?);
        let mut taken: BTreeSet<(usize, String)> = BTreeSet::new();
        for (index, mut camera) in cameras.into_iter().enumerate() {
            if is_named
                && let Some((twice, _)) =
                    camera.detections.iter().find(|(name, _)| !taken.insert((index, name.clone())))
            {
                let what = format!("{}: two images are named {twice}", camera.name);
                return Err(raised::CalibrationError::new_err(what));
            }
            ink.extend(camera.detections.iter().filter_map(|(_, found)| {
                let ink = found.ink?;
                Some(if let Seen::Grid(grid) = &*seen { ink.on_print(grid.edge_mm) } else { ink })
            }));
            let photographs = camera.detections.iter().map(|(_, found)| found);
            notes.extend(camera_notes(photographs).map(|notes| (all.len(), notes)));
            if how.assume_target {
                assume(&mut camera.detections, reference.targets());
            }
            named.extend(camera.detections.iter().flat_map(|(_, found)| found.targets.clone()));
            let shown = views(&camera.detections, &reference).raise(errors::calibration)?;
            if let Some(mixed) = &shown.mixed {
                warn(py, &format!("{}: {mixed}", camera.name))?;
            }
            let mut of_camera: Vec<View> = shown.views;
            let name = is_named.then(|| camera.name.clone());
            left_out.extend(
                shown.excluded.into_iter().map(|(_, out)| Excluded { camera: name.clone(), ..out }),
            );
            let target = seen.targets().first();
            how.sheet.put_on(target, &mut of_camera).raise(errors::calibration)?;
            if of_camera.is_empty() {
                let what = format!("{}: no image shows the target", camera.name);
                return Err(raised::CalibrationError::new_err(what));
            }
            let known = camera.known.map(Intrinsics::Known);
            let intrinsics = known.unwrap_or(Intrinsics::Unknown(model.richest()));
            all.push((camera.name, of_camera, intrinsics));
        }
    }
    let print = Print { scale: how.sheet.print_scale, ink: detect::InkEstimate::of_all(&ink) };
    let stated = panels.clone();
    let of = seen.clone();
    let solved = interruptible(py, move |stop| {
        let mut calibration = Calibration::of(&of.reference(), panels)
            .named_by(named)
            .loss(how.loss)
            .weights(how.weights)
            .board_shape(how.board_shape)
            .measure_target(how.measure_target)
            .refine_panels(how.refine_target)
            .distances_mm(how.distances_mm)
            .covariance_of_all(how.covariance_of_all)
            .hold_out(how.hold_out)
            .cancelled_by(stop.clone());
        if let Some(mm) = how.board_accuracy_mm {
            calibration = calibration.board_accuracy_mm(Some(mm));
        }
        let count = all.len();
        for (name, views, intrinsics) in all {
            calibration = calibration.camera(&name, views, intrinsics);
        }
        // Only `calibrate` has constraints, with one camera.
        if count == 1 {
            calibration.set_constraints(0, how.constraints);
        }
        let mut models = vec![Vec::new(); count];
        for (index, tried) in models.iter_mut().enumerate() {
            if model.0.is_none() && calibration.cameras()[index].intrinsics.model().is_some() {
                let (chosen, candidates) = calibration.choose_model(index, &Model::CANDIDATES)?;
                calibration.set_intrinsics(index, chosen);
                *tried = candidates;
            }
        }
        let estimate = calibration.solve()?;
        let diagnoses = calibration.explain(&estimate);
        Ok::<_, CalibrationError>((estimate, diagnoses, models))
    })?;
    let (mut estimate, diagnoses, models) = solved.raise(errors::calibration)?;
    let foreign = diagnoses.iter().find(|said| matches!(said, Diagnosis::WrongCamera { .. }));
    if let Some(foreign) = foreign {
        let text = Messages::new(&estimate, print.scale).sentence(foreign);
        return Err(raised::CalibrationError::new_err(text));
    }
    if estimate.frames.is_empty() {
        let what = "no view is consistent with this camera";
        return Err(raised::CalibrationError::new_err(what));
    }
    estimate.excluded.splice(0..0, left_out);
    let targets = match &*seen {
        Seen::Targets { printed, .. } => printed.clone(),
        Seen::Grid(grid) => {
            grid.target("board").and_then(Result::ok).map(Printing::from).into_iter().collect()
        }
    };
    let described: Vec<_> = targets.iter().map(|one| one.target.clone()).collect();
    let poses = estimate.pose_uncertainties(&described);
    let model = model.name();
    Ok(Solved {
        estimate,
        diagnoses,
        print,
        stated,
        models,
        notes,
        targets,
        poses,
        model,
        is_rig,
        file: None,
    })
}
