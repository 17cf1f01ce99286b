//! What commands that calibrate have in common: how they solve, and what they tell.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::{Context, anyhow, bail, ensure};
use clap::ValueEnum;

use crate::deltille::files::written::{File, sample_of, text_file};
use crate::output::{self, Overwrite, tell};
use crate::run::FAILED;
use crate::values::{distance, whole};
use deltille::calibrate::{
    BoardShape, Calibration, CalibrationError, CameraEstimate, Candidate, Diagnosis, Estimate,
    Intrinsics, LEAST_TO_MEASURE, Loss, Model, ModelError, PanelPlace, Source, TargetMap, Weights,
    Words,
};
use deltille::camera::Camera;
use deltille::export::calibration::{Print, Residuals};
use deltille::export::camera::FormatError;
use deltille::export::kind::Kind;
use deltille::layout::Printing;
use deltille::report::target_map_svg;
use deltille::targets::{self, parse_length_mm};
use deltille_core::quantity::board_accuracy_mm;
use deltille_core::words::counted;

/// How a calibration is solved, and the page about it.
#[derive(clap::Args)]
pub struct SolveArgs {
    /// Keep every N-th view (the N-th, 2N-th, …), of a rig every N-th frame, out of the calibration and tell
    /// the error there, where only poses are found
    #[arg(long, value_name = "N", value_parser = whole(2..=u32::MAX))]
    holdout: Option<u32>,
    /// How corners far off their prediction count
    #[arg(long, value_name = "LOSS", default_value = "huber")]
    robust: Robust,
    /// How corners are weighted
    #[arg(long, value_name = "BY", default_value = "covariance")]
    weights: Weighting,
    /// Find how the sheet of the board is bent, stretched and sheared, too, and whether that is more
    /// than chance
    #[arg(long, conflicts_with = "shape")]
    board_shape: bool,
    /// Find the place of every corner of the target, too, and write it as a measured target
    #[arg(long, conflicts_with_all = ["shape", "board_shape"])]
    measure_target: bool,
    /// Standard deviation of a coordinate of the board's corners from the description, such as 0.05mm, or 0 of
    /// an exact board; it is in the observed deviations [default: what a measured target says of itself, else
    /// 0.1 mm, at most 0.5 % of an edge]
    #[arg(long, value_name = "LENGTH", value_parser = accuracy)]
    board_accuracy: Option<f64>,
    /// Distance of points for which the uncertainty of projections is told beside that at infinity, such as 2m;
    /// several may be given, separated by commas [default: the median distance of the corners]
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', value_parser = distance)]
    uncertainty_at: Vec<f64>,
    /// List every corner with its residual in the .json, too, 150 bytes each
    #[arg(long)]
    residuals: bool,
    /// Write a page that shows what the calibration is worth, and what would make it better
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

/// How corners far off count.
#[derive(Clone, Copy, ValueEnum)]
enum Robust {
    /// In full: least squares
    None,
    /// Beyond three standard deviations with a constant force
    Huber,
    /// Beyond three standard deviations hardly
    Cauchy,
}

/// How corners are weighted.
#[derive(Clone, Copy, ValueEnum)]
enum Weighting {
    /// All corners alike
    Equal,
    /// By the detections' covariances, with a common deviation found beside them
    Covariance,
}

/// A model, or the choice of one.
#[derive(Clone, Copy, PartialEq)]
pub enum ModelChoice {
    Auto,
    Model(Model),
}

impl FromStr for ModelChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => text.parse().map(Self::Model).map_err(|error: ModelError| {
                format!(
                    "{error}, or auto, which takes the one that holds views best that took no part"
                )
            }),
        }
    }
}

impl ModelChoice {
    /// The model with the most parameters that may be chosen.
    pub fn richest(self) -> Model {
        match self {
            Self::Auto => Model::ThinPrism,
            Self::Model(model) => model,
        }
    }

    /// As it was given.
    pub fn name(self) -> String {
        match self {
            Self::Auto => "auto".to_owned(),
            Self::Model(model) => model.to_string(),
        }
    }

    /// Sets the model of a camera that is not known; returns what was tried where it was to be chosen.
    pub fn choose(
        self,
        calibration: &mut Calibration,
        camera: usize,
    ) -> anyhow::Result<Vec<Candidate>> {
        let (Self::Auto, Some(_)) = (self, calibration.cameras()[camera].intrinsics.model()) else {
            return Ok(Vec::new());
        };
        let (model, tried) = calibration.choose_model(camera).context("--model auto")?;
        calibration.set_intrinsics(camera, model);
        Ok(tried)
    }
}

/// What models that were tried leave on views that took no part, in lines; none where none were.
pub fn chosen(tried: &[Candidate]) -> String {
    if tried.is_empty() {
        return String::new();
    }
    let mut text = "model            parameters  held out px\n".to_owned();
    for candidate in tried {
        let held_out =
            candidate.held_out_px.map_or("no camera".to_owned(), |px| format!("{px:.4}"));
        let note = match (candidate.chosen, candidate.holds) {
            (true, _) => "  taken",
            (_, true) => "  as good",
            _ if candidate.held_out_px.is_some() && !candidate.is_stable => "  not told apart",
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

/// What came of a calibration.
pub struct Calibrated {
    pub estimate: Estimate,
    pub diagnoses: Vec<Diagnosis>,
    /// Where the target's file has its panels.
    pub stated: Vec<PanelPlace>,
    pub print: Print,
    /// Models that were tried, by camera.
    pub models: Vec<Vec<Candidate>>,
}

impl SolveArgs {
    /// Samples of what [`Calibrated::measured`] will be.
    pub fn planned(&self, stem: &str) -> Vec<File> {
        let file = |end: &str, text: String| text_file(format!("{stem}-measured.{end}"), text);
        let empty = || target_map_svg(&TargetMap::new(Vec::new(), [0.0; 2]));
        match self.measure_target {
            true => vec![file("json", sample_of(targets::SCHEMA)), file("svg", empty())],
            false => Vec::new(),
        }
    }

    /// Whether the places of the target's corners are to be found.
    pub fn measures_target(&self) -> bool {
        self.measure_target
    }

    /// Whether files list every corner with its residual.
    pub fn residuals(&self) -> Residuals {
        if self.residuals { Residuals::Listed } else { Residuals::LeftOut }
    }

    /// Solves, and says what is to be said about it; `tried` are the models that were tried, by camera.
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
            .hold_out(self.holdout.map(|every| every as usize));
        let estimate = calibration.solve().map_err(|error| {
            let option = match error {
                CalibrationError::NothingHeldOut { .. } => Some("--holdout"),
                CalibrationError::ShapeOfMany { .. } => Some("--board-shape"),
                CalibrationError::ForeignCameras { .. } => Some("--known"),
                _ => None,
            };
            match option {
                Some(option) => anyhow!(error).context(option),
                None => anyhow!(error),
            }
        })?;
        let diagnoses = calibration.explain(&estimate);
        let stated = calibration.panels().to_vec();
        // The page compares models where none were to be chosen from; too few views for that are no error.
        let compared = |(camera, tried): (usize, Vec<Candidate>)| match tried.is_empty() {
            true if self.report.is_some() => calibration.compare_models(camera).unwrap_or_default(),
            _ => tried,
        };
        let models = tried.into_iter().enumerate().map(compared).collect();
        Ok(Calibrated { estimate, diagnoses, stated, print, models })
    }

    /// Where the page goes, `<stem>-report.html` in a folder. What would be refused is refused here, before the
    /// work.
    pub fn page(&self, stem: &str, overwrite: Overwrite) -> anyhow::Result<Option<PathBuf>> {
        let Some(page) = &self.report else { return Ok(None) };
        let is_page = page.is_dir() || page.extension().is_some_and(|end| end == "html");
        ensure!(is_page, "--report: {} must end in .html, or be a folder", page.display());
        let page = output::file(page, &format!("{stem}-report"), "html")?;
        output::check_writable("--report", &page)?;
        overwrite.check(&page, &Kind::own_page()).context("--report")?;
        Ok(Some(page))
    }
}

impl Calibrated {
    /// Tells the diagnoses on standard error; an error where a known camera did not take its pictures.
    pub fn tell(&self) -> anyhow::Result<()> {
        let words = Words::new(&self.estimate, self.print.scale);
        for diagnosis in &self.diagnoses {
            let text = words.sentence(diagnosis);
            if matches!(diagnosis, Diagnosis::ForeignCamera { .. }) {
                bail!("{text}; nothing was written");
            }
            let kind = if diagnosis.is_failure() { "error" } else { "warning" };
            tell!("{kind}: {text}");
        }
        Ok(())
    }

    /// Exit code 1 where what was found is not to be used as it is.
    pub fn exit_code(&self) -> ExitCode {
        match self.has_failed() {
            true => ExitCode::from(FAILED),
            false => ExitCode::SUCCESS,
        }
    }

    fn has_failed(&self) -> bool {
        self.diagnoses.iter().any(Diagnosis::is_failure)
    }

    /// The measured target and its picture, `<stem>-measured.json` and `.svg`; none where it was not measured.
    pub fn measured(&self, stem: &str, printing: Option<&Printing>) -> Vec<File> {
        let Some((map, printing)) = self.estimate.map.as_ref().zip(printing) else {
            return Vec::new();
        };
        if self.has_failed() {
            tell!("warning: --measure-target: no target is written, as the calibration failed");
            return Vec::new();
        }
        let file = |end: &str, text: String| text_file(format!("{stem}-measured.{end}"), text);
        let measured = Printing { target: map.on(&printing.target), ..printing.clone() };
        vec![file("json", measured.to_json()), file("svg", target_map_svg(map))]
    }

    /// What is known of the print and the sheet, a line each.
    pub fn lines(&self) -> Vec<String> {
        let shape = self.estimate.shape.as_ref().map(told);
        let ink = self.print.ink.filter(|ink| ink.used);
        let ink = ink.map(|ink| format!("ink: {ink}, which the corners allow for"));
        let views = self.estimate.views_of_a_corner();
        let map = self.estimate.map.as_ref().map(|map| mapped(map, views));
        shape.into_iter().chain(map).chain(ink).collect()
    }
}

/// Tells formats that cannot carry what was found; exit code 1 where there are such, as not all is there that was asked for.
pub fn left_out(refused: &[FormatError]) -> Option<ExitCode> {
    for error in refused {
        tell!("error: --format: {error}: left out, all else is written");
    }
    (!refused.is_empty()).then(|| ExitCode::from(FAILED))
}

/// How far corners of a board are off, mm.
fn accuracy(text: &str) -> Result<f64, String> {
    if text.trim() == "0" {
        return Ok(0.0);
    }
    let mm = parse_length_mm(text).map_err(|error| error.to_string())?;
    board_accuracy_mm::RANGE.check(mm).map_err(|error| error.to_string())
}

/// How sure projections are where corners were, a line for each camera of which it is known.
pub fn sureness(camera: &CameraEstimate) -> Option<String> {
    let far = |mm: Option<f64>| mm.map_or("infinity".to_owned(), |mm| format!("{mm:.0} mm"));
    let distances = camera.projection.iter().flat_map(|known| &known.distances_mm);
    let distances = distances.map(|&mm| Some(mm)).chain([None]);
    let told = distances.filter_map(|mm| {
        let noise = camera.projection_sd_px(mm, Source::Noise)?;
        let observed = camera.projection_sd_px(mm, Source::Observed);
        let observed = observed.map_or(String::new(), |sd| format!(", {sd:.4} px observed"));
        Some(format!("at {} {noise:.4} px from noise{observed}", far(mm)))
    });
    let told: Vec<String> = told.collect();
    let observed = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
    let board = match observed.is_some_and(|observed| observed.of_board.is_some()) {
        true => "; observed deviations allow for errors of the board (--board-accuracy)",
        false => "",
    };
    (!told.is_empty()).then(|| format!("projections are known to: {}{board}", told.join("; ")))
}

/// A camera that has all parameters that are found, and none of them zero: what a format cannot carry of it is
/// told before the work.
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

/// The places of the corners, and whether they are more than chance.
fn mapped(map: &TargetMap, views: usize) -> String {
    let [plane, out] = map.rms_mm();
    let few = match views >= LEAST_TO_MEASURE {
        true => String::new(),
        false => {
            format!("; a corner is in {}, take {LEAST_TO_MEASURE} or more", counted(views, "view"))
        }
    };
    let left = match map.few {
        0 => String::new(),
        few => format!(
            "; {} not measured, as most of the observations are outliers or fewer than two count",
            counted(few, "corner")
        ),
    };
    format!(
        "target: corners are {plane:.3} mm beside their places and {out:.3} mm above or below (rms a \
         coordinate), {} of {} by more than chance makes{few}{left}",
        map.significant().count(),
        map.corners().len()
    )
}

/// The shape of a sheet, and whether it is to be believed.
fn told(found: &BoardShape) -> String {
    let significance = match found.is_significant() {
        true => "more than chance makes",
        false => "no more than chance makes: take the calibration without",
    };
    format!(
        "sheet: bent by {:.3} mm, corners up to {:.3} mm beside their places, F = {:.1}, {significance}",
        found.bent_mm, found.stretched_mm, found.f_ratio
    )
}

/// What is left where corners are outliers, for the end of a line.
pub fn without_outliers(outliers: usize, inlier_rms_px: f64) -> String {
    match outliers {
        0 => String::new(),
        n => format!(", {inlier_rms_px:.4} px without {}", counted(n, "outlier")),
    }
}
