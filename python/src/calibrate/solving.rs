//! Solves calibrations: checked arguments, and the work.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use deltille::calibrate::{
    Calibration, CalibrationError, CameraViews, Candidate, Constraint, ConstraintError, Diagnosis,
    Excluded, Intrinsics, Loss, Messages, Model, Reference, UntaggedGrid, Weights, views,
};
use deltille::export::calibration::Print;
use deltille::export::sheet::Sheet;
use deltille::layout::Printing;
use deltille::raster::CameraNotes;
use deltille::report::camera_notes;
use deltille::targets::TargetIdentity;
use deltille::{camera, detect, targets};
use deltille_core::quantity::{board_accuracy_mm, distance_mm, edge_mm, print_scale};
use pyo3::prelude::*;

use super::solved::Solved;
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

    /// Returns a calibration with these options.
    fn applied_to(self, calibration: Calibration) -> Calibration {
        let calibration = calibration
            .loss(self.loss)
            .weights(self.weights)
            .board_shape(self.board_shape)
            .measure_target(self.measure_target)
            .refine_panels(self.refine_target)
            .distances_mm(self.distances_mm)
            .covariance_of_all(self.covariance_of_all)
            .hold_out(self.hold_out);
        match self.board_accuracy_mm {
            Some(mm) => calibration.board_accuracy_mm(Some(mm)),
            None => calibration,
        }
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

    /// Sets the models of unknown cameras; returns the candidates by camera, if they were selected automatically.
    fn choose(
        self,
        calibration: &mut Calibration,
    ) -> Result<Vec<Vec<Candidate>>, CalibrationError> {
        let mut models = vec![Vec::new(); calibration.cameras().len()];
        for (camera, tried) in models.iter_mut().enumerate() {
            if self.0.is_none() && calibration.cameras()[camera].intrinsics.model().is_some() {
                let (chosen, candidates) = calibration.choose_model(camera, &Model::CANDIDATES)?;
                calibration.set_intrinsics(camera, chosen);
                *tried = candidates;
            }
        }
        Ok(models)
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

/// A known or unknown camera with its detections.
pub struct OneCamera {
    pub name: String,
    pub detections: Named,
    pub known: Option<camera::Camera>,
}

/// What the detections of all cameras give.
#[derive(Default)]
struct Input {
    cameras: Vec<CameraViews>,
    /// The targets that detections name.
    named: Vec<TargetIdentity>,
    left_out: Vec<Excluded>,
    ink: Vec<detect::InkEstimate>,
    notes: BTreeMap<usize, CameraNotes>,
}

impl Input {
    /// Adds a camera, with unknown intrinsics unless they are known; `is_of_many` if there are several.
    fn add(
        &mut self,
        py: Python<'_>,
        OneCamera { name, mut detections, known }: OneCamera,
        is_of_many: bool,
        unknown: Model,
        seen: &Seen,
        how: &How,
    ) -> PyResult<()> {
        let wrong = |what: String| Err(errors::calibration(format!("{name}: {what}")));
        let reference = seen.reference();
        let mut taken = BTreeSet::new();
        let mut names = detections.iter().map(|(name, _)| name);
        if let (true, Some(twice)) = (is_of_many, names.find(|&name| !taken.insert(name))) {
            return wrong(format!("two images are named {twice}"));
        }
        self.ink.extend(detections.iter().filter_map(|(_, found)| {
            let ink = found.ink?;
            Some(if let Seen::Grid(grid) = seen { ink.on_print(grid.edge_mm) } else { ink })
        }));
        let notes = camera_notes(detections.iter().map(|(_, found)| found));
        self.notes.extend(notes.map(|notes| (self.cameras.len(), notes)));
        if how.assume_target {
            assume(&mut detections, reference.targets());
        }
        self.named.extend(detections.iter().flat_map(|(_, found)| found.targets.clone()));
        let shown = views(&detections, &reference).raise(errors::calibration)?;
        if let Some(mixed) = &shown.mixed {
            warn(py, &format!("{name}: {mixed}"))?;
        }
        let camera = is_of_many.then(|| name.clone());
        let left_out = shown.excluded.into_iter();
        self.left_out.extend(left_out.map(|(_, out)| Excluded { camera: camera.clone(), ..out }));
        let mut views = shown.views;
        how.sheet.put_on(seen.targets().first(), &mut views).raise(errors::calibration)?;
        if views.is_empty() {
            return wrong("no image shows the target".to_owned());
        }
        let intrinsics = known.map_or(Intrinsics::Unknown(unknown), Intrinsics::Known);
        self.cameras.push(CameraViews::new(&name, views, intrinsics));
        Ok(())
    }
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
    if let [only] = seen.printed() {
        how.sheet.sheets = only.sheets.clone();
    }
    let seen = Arc::new(seen);
    let stated = how.sheet.panels(&seen.reference()).raise(errors::calibration)?;
    let (mut input, is_of_many) = (Input::default(), cameras.len() > 1);
    for camera in cameras {
        input.add(py, camera, is_of_many, model.richest(), &seen, &how)?;
    }
    let Input { mut cameras, named, left_out, ink, notes } = input;
    // Only `calibrate` has constraints, with one camera.
    if let [only] = cameras.as_mut_slice() {
        only.constraints = std::mem::take(&mut how.constraints);
    }
    let print = Print { scale: how.sheet.print_scale, ink: detect::InkEstimate::of_all(&ink) };
    let (of, panels) = (seen.clone(), stated.clone());
    let solved = interruptible(py, move |stop| {
        let calibration = Calibration::of(&of.reference(), panels).named_by(named);
        let mut calibration = how.applied_to(calibration).cancelled_by(stop.clone());
        for camera in cameras {
            calibration = calibration.with(camera);
        }
        let models = model.choose(&mut calibration)?;
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
    let (model, file) = (model.name(), None);
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
        file,
    })
}
