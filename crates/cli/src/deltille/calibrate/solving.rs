//! Options and output that the calibration commands share.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::{anyhow, bail};
use clap::ValueEnum;

use super::constraints::ConstraintArgs;
use super::covariance_file::CovarianceArgs;
use crate::deltille::files::written::{File, sample_of, text_file};
use crate::interrupt;
use crate::output::{self, fixed, log, report};
use crate::progress::Spinner;
use crate::run::FAILED;
use crate::values::{distance, whole};
use deltille::calibrate::{
    BoardShape, Calibration, CalibrationError, CameraEstimate, Candidate, Diagnosis, Estimate,
    Excluded, Intrinsics, Loss, MIN_VIEWS_TO_MEASURE, Messages, Model, ModelError, PanelPrior,
    PoseUncertainty, Source, TargetMap, Weights,
};
use deltille::camera::Camera;
use deltille::detect::Detection;
use deltille::export::calibration::{Print, Residuals};
use deltille::export::camera::FormatError;
use deltille::layout::Printing;
use deltille::raster::CameraNotes;
use deltille::report::{Report, camera_notes, target_map_svg};
use deltille::targets::{self, parse_length_mm};
use deltille_core::quantity::board_accuracy_mm;
use deltille_core::words::counted;

/// Options of the solver and the report.
#[derive(clap::Args)]
pub struct SolveArgs {
    /// Hold out every N-th view (N, 2N, …), or every N-th frame of a rig, estimate only its pose,
    /// and report its reprojection error
    #[arg(long, value_name = "N", value_parser = whole(2..=u32::MAX))]
    holdout: Option<u32>,
    /// Robust loss for outliers
    #[arg(long, value_name = "LOSS", default_value = "huber")]
    robust: Robust,
    /// Weights of the corners
    #[arg(long, value_name = "BY", default_value = "covariance")]
    weights: Weighting,
    /// Also estimate how the board is bent, stretched and sheared, and test whether this is significant
    #[arg(long, conflicts_with = "shape")]
    board_shape: bool,
    /// Also estimate the position of every target corner, and write a measured target
    #[arg(long, conflicts_with_all = ["shape", "board_shape"])]
    measure_target: bool,
    /// The target moves in the recording: also estimate the readout of rolling shutters, and of a rig the offsets and drifts of the
    /// clocks, from all frames; compensate the corners for what is significant, and write <stem>-timing.json
    #[arg(long)]
    pub estimate_timing: bool,
    /// Standard uncertainty per axis of the corner positions in the description, such as 0.05mm, or 0 for an exact
    /// board. It contributes to the standard deviations reported as observed [default: that of a
    /// measured target, otherwise 0.1 mm, at most 0.5 % of an edge]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = accuracy)]
    board_accuracy: Option<f64>,
    /// Distances at which to report the projection uncertainty in addition to infinity, such as 2m, separated by
    /// commas [default: the median distance of the corners]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_delimiter = ',', value_parser = distance)]
    uncertainty_at: Vec<f64>,
    /// Include every corner with its residual in the .json (150 bytes each)
    #[arg(long)]
    pub residuals: bool,
    #[command(flatten)]
    pub constraints: ConstraintArgs,
    #[command(flatten)]
    pub covariance: CovarianceArgs,
    /// Write an HTML report on the quality of the calibration, and how to improve it
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
}

/// Robust loss of corners.
#[derive(Clone, Copy, ValueEnum)]
enum Robust {
    /// Least squares: all residuals have full influence
    None,
    /// Residuals beyond 3σ have constant influence
    Huber,
    /// The influence of a residual is largest at 3σ and decreases beyond it
    Cauchy,
}

/// Weights of corners.
#[derive(Clone, Copy, ValueEnum)]
enum Weighting {
    /// Equal weights for all corners
    Equal,
    /// Weights from the covariances of the detections, scaled by a common estimated factor
    Covariance,
}

/// How models are selected, for errors.
const AUTO: &str = "--model auto tests each model on a third of the views; name a model, such as radtan, if there are few";

/// A model, or automatic selection.
#[derive(Clone, Copy, PartialEq)]
pub enum ModelChoice {
    Auto,
    Model(Model),
}

impl FromStr for ModelChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(model) = Model::named_elsewhere(text) {
            log!("note: --model {text} is {} here", model.described());
            return Ok(Self::Model(model));
        }
        match text {
            "auto" => Ok(Self::Auto),
            _ => text.parse().map(Self::Model).map_err(|error: ModelError| {
                format!(
                    "{error}, or auto, which selects the simplest model whose held-out error no other clearly \
                     undercuts"
                )
            }),
        }
    }
}

impl ModelChoice {
    /// Returns the candidates: those of a selection that the requested formats support, or all if they support none of them
    /// in common.
    pub fn candidates(self, is_supported: impl Fn(&Camera) -> bool) -> Vec<Model> {
        let all = match self {
            Self::Auto => Model::CANDIDATES.to_vec(),
            Self::Model(model) => return vec![model],
        };
        let is_supported = |model: &Model| is_supported(&sample(&Intrinsics::Unknown(*model)));
        let supported: Vec<Model> = all.iter().copied().filter(is_supported).collect();
        if supported.is_empty() { all } else { supported }
    }

    /// Returns the name as typed on the command line.
    pub fn name(self) -> String {
        match self {
            Self::Auto => "auto".to_owned(),
            Self::Model(model) => model.to_string(),
        }
    }

    /// Sets the model of an unknown camera; returns the candidates if it was selected automatically.
    pub fn choose(
        self,
        calibration: &mut Calibration,
        camera: usize,
        candidates: &[Model],
    ) -> anyhow::Result<Vec<Candidate>> {
        let (Self::Auto, Some(_)) = (self, calibration.cameras()[camera].intrinsics.model()) else {
            return Ok(Vec::new());
        };
        let chosen = calibration.choose_model(camera, candidates);
        let (model, tried) = chosen.map_err(|error| match error {
            // No model can be calibrated.
            CalibrationError::TooFewViews { all, .. }
                if all == calibration.cameras()[camera].views.len() =>
            {
                error.into()
            }
            CalibrationError::WrongConstraints { .. } | CalibrationError::Parallel { .. } => {
                error.into()
            }
            CalibrationError::TooFewViews { .. } => anyhow!(
                "{} are too few for --model auto, which tests each model on a third of them: name a model, such as radtan",
                counted(calibration.cameras()[camera].views.len(), "view")
            ),
            _ => anyhow!(error).context(AUTO),
        })?;
        calibration.set_intrinsics(camera, model);
        Ok(tried)
    }
}

/// Returns the model with the most parameters, for which the files are planned; a spline only if there is no other.
pub fn richest(candidates: &[Model]) -> Model {
    let other = candidates.iter().rev().find(|model| **model != Model::SPLINE);
    other.copied().unwrap_or(Model::SPLINE)
}

/// Formats the held-out errors of the candidate models, one per line; empty without candidates.
pub fn chosen(tried: &[Candidate]) -> String {
    if tried.is_empty() {
        return String::new();
    }
    let mut text = "model            parameters  held-out px\n".to_owned();
    for candidate in tried {
        let held_out =
            candidate.held_out_px.map_or("did not converge".to_owned(), |px| format!("{px:.4}"));
        let note = match (candidate.chosen, candidate.is_adequate) {
            (true, _) => "  selected",
            (_, true) => "  equally good",
            _ if candidate.held_out_px.is_some() && !candidate.is_stable => "  ill-conditioned",
            _ => "",
        };
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:16} {:10}  {held_out:>11}{note}",
            candidate.model.to_string(),
            candidate.parameters
        );
    }
    text
}

/// Result of a calibration.
pub struct Calibrated {
    pub estimate: Estimate,
    pub diagnoses: Vec<Diagnosis>,
    /// Panel positions in the target's file.
    pub stated: Vec<PanelPrior>,
    pub print: Print,
    /// Candidate models, by camera.
    pub models: Vec<Vec<Candidate>>,
    /// Metadata of the photographs, by camera.
    pub notes: BTreeMap<usize, CameraNotes>,
}

impl SolveArgs {
    /// Returns placeholders for the files of [`Calibrated::measured`].
    pub fn planned(&self, stem: &str) -> Vec<File> {
        let file = |end: &str, text: String| text_file(format!("{stem}-measured.{end}"), text);
        let empty = || target_map_svg(&TargetMap::new(Vec::new(), [0.0; 2]));
        match self.measure_target {
            true => vec![file("json", sample_of(targets::SCHEMA)), file("svg", empty())],
            false => Vec::new(),
        }
    }

    /// Whether the positions of the target's corners are estimated.
    pub fn measures_target(&self) -> bool {
        self.measure_target
    }

    /// Whether files include every corner with its residual.
    pub fn residuals(&self) -> Residuals {
        if self.residuals { Residuals::Listed } else { Residuals::Omitted }
    }

    /// Calibrates; `tried` contains the candidate models by camera.
    pub fn solve(
        &self,
        calibration: Calibration,
        print: Print,
        tried: Vec<Vec<Candidate>>,
    ) -> anyhow::Result<Calibrated> {
        let loss = match self.robust {
            Robust::None => Loss::Squared,
            Robust::Huber => Loss::Huber,
            Robust::Cauchy => Loss::Cauchy,
        };
        let weights = match self.weights {
            Weighting::Equal => Weights::Equal,
            Weighting::Covariance => Weights::Covariance,
        };
        let calibration = match self.board_accuracy {
            Some(mm) => calibration.board_accuracy_mm(Some(mm)),
            None => calibration,
        };
        let calibration = calibration
            .loss(loss)
            .weights(weights)
            .board_shape(self.board_shape)
            .measure_target(self.measure_target)
            .distances_mm(self.uncertainty_at.clone())
            .covariance_of_all(self.covariance.is_wanted())
            .hold_out(self.holdout.map(|every| every as usize));
        let _spinner = Spinner::new("calibrating");
        let estimate = calibration.solve().map_err(|error| {
            let option = match error {
                CalibrationError::NothingHeldOut { .. } => Some("--holdout"),
                CalibrationError::ShapeOfMany { .. } => Some("--board-shape"),
                CalibrationError::WrongCameras { .. } => Some("--known"),
                _ => None,
            };
            match option {
                Some(option) => anyhow!(error).context(option),
                None => anyhow!(error),
            }
        })?;
        let diagnoses = calibration.explain(&estimate);
        let stated = calibration.panels().to_vec();
        // The report compares models even if none was selected automatically; too few views for this are not an
        // error.
        let compared = |(camera, tried): (usize, Vec<Candidate>)| match tried.is_empty() {
            true if self.report.is_some() => calibration.compare_models(camera).unwrap_or_default(),
            _ => tried,
        };
        let models = tried.into_iter().enumerate().map(compared).collect();
        Ok(Calibrated { estimate, diagnoses, stated, print, models, notes: BTreeMap::new() })
    }
}

/// Prints diagnoses on standard error.
pub fn print_diagnoses(words: &Messages<'_>, diagnoses: &[Diagnosis]) {
    for diagnosis in diagnoses {
        let kind = if diagnosis.is_failure() { "error" } else { "warning" };
        log!("{kind}: {}", words.sentence(diagnosis));
    }
}

impl Calibrated {
    /// Adds the metadata of a camera's photographs that state its focal length.
    pub fn add_notes(&mut self, camera: usize, detections: &[(String, Detection)]) {
        let notes = camera_notes(detections.iter().map(|(_, found)| found));
        self.notes.extend(notes.map(|notes| (camera, notes)));
    }

    /// Prints the diagnoses on standard error. Fails if the images were not taken by a fixed camera.
    pub fn print_diagnoses(&self) -> anyhow::Result<()> {
        let words = Messages::new(&self.estimate, self.print.scale);
        let is_foreign = |said: &&Diagnosis| matches!(said, Diagnosis::WrongCamera { .. });
        if let Some(foreign) = self.diagnoses.iter().find(is_foreign) {
            bail!("{}; nothing was written", words.sentence(foreign));
        }
        print_diagnoses(&words, &self.diagnoses);
        for text in Report::new("", &self.estimate).view_warnings() {
            log!("warning: {text}");
        }
        Ok(())
    }

    /// Returns the views that were excluded, also from the held-out frames.
    pub fn excluded(&self) -> impl Iterator<Item = &Excluded> {
        let of_test = self.estimate.held_out.iter().flat_map(|test| &test.excluded);
        self.estimate.excluded.iter().chain(of_test)
    }

    /// Reports the written files and the formats that cannot represent the result. Returns exit code 1 if the output is
    /// incomplete, or must not be used unchanged.
    pub fn end(&self, written: &[PathBuf], refused: &[FormatError]) -> anyhow::Result<ExitCode> {
        for path in written {
            report!("{}", output::wrote(path));
        }
        if interrupt::has_ended_input() {
            return Ok(ExitCode::from(interrupt::exit_code()));
        }
        for error in refused {
            log!("error: --format: {error}; skipped, all other files were written");
        }
        Ok(match !refused.is_empty() || self.has_failed() {
            true => ExitCode::from(FAILED),
            false => ExitCode::SUCCESS,
        })
    }

    /// Whether the result must not be used unchanged.
    pub fn has_failed(&self) -> bool {
        self.diagnoses.iter().any(Diagnosis::is_failure)
    }

    /// Returns the measured target and its drawing, `<stem>-measured.json` and `.svg`; empty if it was not measured.
    pub fn measured(&self, stem: &str, printing: Option<&Printing>) -> Vec<File> {
        let Some((map, printing)) = self.estimate.map.as_ref().zip(printing) else {
            return Vec::new();
        };
        if self.has_failed() {
            log!(
                "warning: --measure-target: no target was written, because the calibration failed"
            );
            return Vec::new();
        }
        let file = |end: &str, text: String| text_file(format!("{stem}-measured.{end}"), text);
        let measured = Printing { target: map.on(&printing.target), ..printing.clone() };
        vec![file("json", measured.to_json()), file("svg", target_map_svg(map))]
    }

    /// Describes the relative poses of several targets, the print and the sheet, one property per line.
    pub fn lines(&self) -> Vec<String> {
        let targets = &self.estimate.targets;
        let poses = targets.iter().filter(|_| targets.len() > 1).map(|target| {
            let at = target.scene_from_target.translation.to_array().map(|mm| fixed(mm, 2));
            let deviation = target.pose_sd.map_or(String::new(), |sd| within(&sd));
            format!("target {}: at ({}) mm{deviation}", target.name, at.join(", "))
        });
        let shape = self.estimate.shape.as_ref().map(describe_shape);
        let ink = self.print.ink.filter(|ink| ink.used);
        let ink = ink.map(|ink| format!("ink: {ink}; corners are corrected for it"));
        let views = self.estimate.views_of_a_corner();
        let map = self.estimate.map.as_ref().map(|map| mapped(map, views));
        poses.chain(shape).chain(map).chain(ink).collect()
    }
}

/// Parses the standard deviation of a board's corners, mm.
pub fn accuracy(text: &str) -> Result<f64, String> {
    if text.trim() == "0" {
        return Ok(0.0);
    }
    let mm = parse_length_mm(text).map_err(|error| error.to_string())?;
    board_accuracy_mm::RANGE.check(mm).map_err(|error| error.to_string())
}

/// Describes the projection uncertainty in the region of the corners; `None` if unknown.
pub fn projection_uncertainty(camera: &CameraEstimate) -> Option<String> {
    let far = |mm: Option<f64>| mm.map_or("infinity".to_owned(), |mm| format!("{mm:.0} mm"));
    let distances = camera.projection.iter().flat_map(|known| &known.distances_mm);
    let distances = distances.map(|&mm| Some(mm)).chain([None]);
    let listed = distances.filter_map(|mm| {
        let noise = camera.projection_sd_px(mm, Source::Noise)?;
        let observed = camera.projection_sd_px(mm, Source::Observed);
        let observed = observed.map_or(String::new(), |sd| format!(", {sd:.4} px observed"));
        Some(format!("at {} {noise:.4} px from noise{observed}", far(mm)))
    });
    let listed: Vec<String> = listed.collect();
    let observed = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
    let board = match observed.is_some_and(|observed| observed.of_board.is_some()) {
        true => "; observed uncertainty includes errors of the board (--board-accuracy)",
        false => "",
    };
    (!listed.is_empty())
        .then(|| format!("projection uncertainty (1σ): {}{board}", listed.join("; ")))
}

/// Describes the uncertainty of poses of a target, one line each.
pub fn pose_uncertainty(
    found: &Estimate,
    poses: &[PoseUncertainty],
) -> impl Iterator<Item = String> {
    poses.iter().map(|of| {
        let camera = found.camera_name(of.camera).map_or(String::new(), |name| format!("{name}: "));
        let [calibration, noise] = [of.calibration, of.per_px].map(|sd| {
            format!(
                "{:.4}°, {:.4} mm across and {:.4} mm along the line of sight",
                sd.rotation_rad.to_degrees(),
                sd.across_mm,
                sd.along_mm
            )
        });
        format!(
            "{camera}pose uncertainty (1σ) of {} at {:.0} mm: {calibration} from the calibration; {noise} for each px of noise",
            of.target, of.distance_mm
        )
    })
}

/// Adds the constraints on a camera to its file, as a comment.
pub fn with_constraints(yaml: &str, camera: Option<&CameraEstimate>) -> String {
    let said = camera.and_then(CameraEstimate::described_constraints);
    match (said, yaml.split_once('\n')) {
        (Some(said), Some((first, rest))) => format!("{first}\n# constraints: {said}\n{rest}"),
        _ => yaml.to_owned(),
    }
}

/// Returns a camera with nonzero values for all estimated parameters, to reject formats that cannot represent it
/// before the work starts.
pub fn sample(intrinsics: &Intrinsics) -> Camera {
    match intrinsics {
        Intrinsics::Unknown(model) => {
            let camera = Camera::centred(100, 100, 100.0, model.lens());
            let values = camera.parameters().into_iter().zip(model.free());
            let values = values.map(|(value, free)| if free { value + 1e-3 } else { value });
            camera.with_parameters(&values.collect::<Vec<_>>())
        }
        Intrinsics::Known(camera) | Intrinsics::Near { camera, .. } => camera.clone(),
    }
}

/// Describes the estimated corner positions, and their significance.
fn mapped(map: &TargetMap, views: usize) -> String {
    let [plane, out] = map.rms_mm();
    let few = match views >= MIN_VIEWS_TO_MEASURE {
        true => String::new(),
        false => {
            format!(
                "; the median corner was seen in {}, but {MIN_VIEWS_TO_MEASURE} or more are recommended",
                counted(views, "view")
            )
        }
    };
    let left = match map.not_measured.len() {
        0 => String::new(),
        left => format!("; {} not measured", counted(left, "corner")),
    };
    format!(
        "target: corners deviate by {plane:.3} mm in the plane and {out:.3} mm out of it (RMS per axis), {} of {} \
         significantly{few}{left}",
        map.significant().count(),
        map.corners().len()
    )
}

/// Describes the shape of a sheet, and its significance.
fn describe_shape(found: &BoardShape) -> String {
    let significance = match found.is_significant() {
        true => "significant",
        false => "not significant: calibrate without --board-shape",
    };
    format!(
        "sheet: bent by {:.3} mm, corners displaced by up to {:.3} mm, F = {:.1}, {significance}",
        found.bent_mm, found.stretched_mm, found.f_ratio
    )
}

/// Formats the RMS without outliers for the end of a line, if there are any.
pub fn without_outliers(outliers: usize, inlier_rms_px: f64) -> String {
    match outliers {
        0 => String::new(),
        n => format!(", {inlier_rms_px:.4} px without {}", counted(n, "outlier")),
    }
}

/// Returns the largest standard deviations of a position and a rotation.
pub fn within(sd: &[f64; 6]) -> String {
    let largest = |sd: &[f64]| sd.iter().copied().fold(0.0, f64::max);
    format!(" ± {:.3} mm, {:.4}°", largest(&sd[3..]), largest(&sd[..3]).to_degrees())
}
