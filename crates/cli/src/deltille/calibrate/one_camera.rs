//! `deltille calibrate`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};

use super::compensation::{self, prepare};
use super::reasons::no_board;
use super::report_page::{Outputs, check_images, note_missing};
use super::sightings::{Empty, Sightings, SightingsArgs};
use super::solving::{
    Calibrated, ModelChoice, SolveArgs, chosen, pose_uncertainty, projection_uncertainty, richest,
    sample, with_constraints, without_outliers,
};
use crate::deltille::files::camera_file;
use crate::deltille::files::written::{
    File, check_places, keep_inputs, same_file, sample_of, text_file,
};
use crate::output::{self, NamedFile, Overwrite, Place, log};
use crate::run::{FAILED, report};
use crate::values::format;
use deltille::calibrate::{CameraEstimate, Estimate, Intrinsics, Model, PoseUncertainty, Source};
use deltille::camera::{Camera, CameraFile, Lens, PROJECTION_PARAMETERS, Pose, SplineGrid};
use deltille::export::camera::FormatError;
use deltille::export::named::Format;
use deltille::export::{CAMERA_FORMATS, CameraFormat, Written, calibration, saved};
use deltille::targets::{Target, TargetIdentity};
use deltille_core::words::{counted, places, shown};

/// Correlations of at least this magnitude are reported: these parameters can hardly be separated.
const STRONG_CORRELATION: f64 = 0.98;

/// Arguments of `deltille calibrate`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    sightings: SightingsArgs,
    /// The camera model.
    #[arg(long, help = format!(
        "Camera model: {}. All except spline also estimate fx, fy, cx, cy. auto: the simplest model whose held-out error \
         no other clearly undercuts. Names of other programs, such as plumb_bob or fisheye, are accepted [default: auto]",
        Model::choice()
    ))]
    model: Option<ModelChoice>,
    /// Estimate only poses, with this fixed camera: a file that `deltille pose --camera` accepts
    #[arg(long, value_name = "CAMERA", conflicts_with_all = ["model", "holdout", "board_shape", "fix", "equal", "prior"])]
    fixed_intrinsics: Option<PathBuf>,
    #[command(flatten)]
    solve: SolveArgs,
    /// Output formats, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "own", value_parser = format(CAMERA_FORMATS))]
    format: Vec<&'static CameraFormat>,
    /// Folder of the photographs, for thumbnails in the report
    #[arg(long, value_name = "FOLDER", requires = "report")]
    images: Option<PathBuf>,
    /// Camera file (.yaml or .json), or a folder for camera.yaml; other files are written beside it with the same stem
    /// [default: camera.yaml, or poses.yaml with --fixed-intrinsics]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Calibrates, writes the camera, and prints its quality.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (folder, stem) = args.place()?;
    let candidates = args.candidates();
    let (intrinsics, known_with) = args.intrinsics(&candidates)?;
    args.solve.constraints.check_cameras(&[])?;
    args.solve.constraints.check(&stem, &intrinsics, &candidates)?;
    args.check_files(&folder, &stem, &intrinsics)?;
    let target_files = args.sightings.target_files();
    let outputs = Outputs::of(&args.solve, &folder, &stem, target_files, args.overwrite)?;
    let measure = args.solve.measures_target();
    let Sightings { calibration, views, printed, empty, left_out, print, detections, unnamed } =
        args.sightings.read(&intrinsics, measure, args.solve.estimate_timing)?;
    let frames = args.solve.estimate_timing.then(|| args.sightings.all_frames(&detections));
    let frames = frames.transpose()?;
    let targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
    if let (Some(known), false) = (&args.fixed_intrinsics, targets.is_empty()) {
        let is_assumed = args.sightings.assumes_target();
        camera_file::check_or_note(known, &known_with, &targets, is_assumed)?;
    }
    note_empty(&empty, views.len());
    if let Some(folder) = &args.images {
        note_missing(folder, &views);
    }
    let constraints = args.solve.constraints.of(&stem, &intrinsics);
    let mut calibration = calibration.camera(&stem, views, intrinsics);
    calibration.set_constraints(0, constraints);
    let model = args.model.unwrap_or(ModelChoice::Auto);
    let prepared =
        prepare(&mut calibration, model, &candidates, &[String::new()], frames.as_ref())?;
    let listed = chosen(&prepared.tried[0]) + &prepared.describe();
    let timing = prepared.file(&stem);
    let mut solved = args.solve.solve(calibration, print, prepared.tried)?;
    solved.add_notes(0, &detections);
    unnamed.iter().for_each(|note| log!("{note}"));
    ensure!(!solved.estimate.frames.is_empty(), "no view is consistent with this camera");
    for out in solved.excluded() {
        log!("{}: excluded: {}", out.view, out.reason);
    }
    solved.estimate.excluded.splice(0..0, left_out);
    if let Err(foreign) = solved.print_diagnoses() {
        let camera = args.fixed_intrinsics.as_deref().unwrap_or(Path::new(""));
        report(&foreign.context(format!("--fixed-intrinsics: {}", camera.display())));
        return Ok(ExitCode::from(FAILED));
    }
    let poses = solved.estimate.pose_uncertainties(&targets);
    let (mut files, refused) = args.files_of(&solved, &stem, &known_with, &poses);
    files.extend(solved.measured(&stem, printed.first()).into_iter().chain(timing));
    let folders = [args.images.as_deref()];
    let written = outputs.write(&solved, &files, &folders, &poses)?;
    output::print(&(listed + &summary(&solved, &poses)))?;
    solved.end(&written, &refused)
}

/// Reports images that do not show the target; `seen` others do.
fn note_empty(empty: &[Empty], seen: usize) {
    for Empty { path, reason } in empty {
        log!("{}: excluded: {}", path.display(), no_board(reason.as_ref()));
    }
    if empty.len() > seen {
        let all = counted(empty.len() + seen, "image");
        log!("warning: the target was found in only {seen} of {all}");
    }
}

impl Args {
    /// Returns the folder and the stem of the files.
    fn place(&self) -> anyhow::Result<(PathBuf, String)> {
        let output = self.output.as_deref().unwrap_or(Path::new("."));
        let Place { folder, file } = output::place(output, &["yaml", "json"])?;
        let writes_own = self.format.iter().any(|format| format.is_own());
        if let (Some(NamedFile { stem, ending }), false) = (&file, writes_own) {
            log!("note: {stem}.{ending} is not written, because --format does not contain own");
        }
        check_images(self.images.iter())?;
        ensure!(
            !self.solve.residuals || writes_own,
            "--residuals: the .json that lists them is written with --format own"
        );
        // Poses with a fixed camera must not replace its calibration.
        let stem = if self.fixed_intrinsics.is_some() { "poses" } else { "camera" };
        let stem = file.map_or(stem.to_owned(), |file| file.stem);
        let path = folder.join(format!("{stem}.yaml"));
        ensure!(
            !self.fixed_intrinsics.as_ref().is_some_and(|known| same_file(&path, known)),
            "-o: {} is the camera of --fixed-intrinsics, and its uncertainties would be lost; use another name",
            path.display()
        );
        Ok((folder, stem))
    }

    /// Rejects files that could not be written, before the work starts.
    fn check_files(&self, folder: &Path, stem: &str, camera: &Intrinsics) -> anyhow::Result<()> {
        let json = sample_of(calibration::SCHEMA);
        let (mut files, refused) = self.files(stem, (&sample(camera), None), &[], &[], &json);
        if let (true, Some(refused)) = (files.is_empty(), refused.into_iter().next()) {
            return Err(refused).context("--format");
        }
        files.extend(self.solve.planned(stem));
        files.extend(self.solve.estimate_timing.then(|| compensation::planned(stem)));
        check_places(folder, &files, self.overwrite)?;
        keep_inputs(folder, &files, self.sightings.target_files())
    }

    /// Returns the intrinsics, and the targets that the camera was calibrated with.
    fn intrinsics(
        &self,
        candidates: &[Model],
    ) -> anyhow::Result<(Intrinsics, Vec<TargetIdentity>)> {
        if let Some(path) = &self.fixed_intrinsics {
            let known = camera_file::read_to_keep("--fixed-intrinsics", path)?;
            return Ok((Intrinsics::Known(known.camera), known.calibrated_with));
        }
        Ok((Intrinsics::Unknown(richest(candidates)), Vec::new()))
    }

    /// Returns the models that are compared.
    fn candidates(&self) -> Vec<Model> {
        let is_supported = |camera: &Camera| {
            self.files("", (camera, None), &[], &[], &sample_of(calibration::SCHEMA)).1.is_empty()
        };
        self.model.unwrap_or(ModelChoice::Auto).candidates(is_supported)
    }

    /// Returns the estimated camera in all requested formats, and errors for those that failed; a known camera was
    /// calibrated with the targets `known_with`.
    fn files_of(
        &self,
        solved: &Calibrated,
        stem: &str,
        known_with: &[TargetIdentity],
        poses: &[PoseUncertainty],
    ) -> (Vec<File>, Vec<FormatError>) {
        let Calibrated { estimate, diagnoses, print, .. } = solved;
        let Some(camera) = estimate.cameras.first() else { return (Vec::new(), Vec::new()) };
        let residuals = self.solve.residuals();
        let json = calibration::write(estimate, diagnoses, *print, residuals, poses);
        let views = camera.views.iter().map(|view| (view.image.as_str(), view.pose));
        let calibrated_with = match camera.model {
            Some(_) => &estimate.calibrated_with,
            None => known_with,
        };
        let of_camera = (&camera.camera, Some(camera));
        let json = json.unwrap_or_default();
        self.files(stem, of_camera, calibrated_with, &views.collect::<Vec<_>>(), &json)
    }

    /// Returns the camera in all requested formats, and errors for those that failed; `found` is its estimate, and `json`
    /// the complete result.
    fn files(
        &self,
        stem: &str,
        (camera, found): (&Camera, Option<&CameraEstimate>),
        calibrated_with: &[TargetIdentity],
        views: &[(&str, Pose)],
        json: &str,
    ) -> (Vec<File>, Vec<FormatError>) {
        let (mut files, mut refused) = (Vec::new(), Vec::new());
        let file = CameraFile {
            camera: camera.clone(),
            calibrated_with: calibrated_with.to_vec(),
            failed: saved::failures(json).into_iter().next(),
        };
        for format in &self.format {
            if file.failed.is_some() && !format.is_own() {
                // Files of other formats cannot state the reason for the failure.
                log!(
                    "warning: --format {}: not written, because the calibration failed",
                    format.name()
                );
                continue;
            }
            match format.text(&Written { file: &file, name: stem, views }) {
                Ok(text) => {
                    let text = if format.is_own() { with_constraints(&text, found) } else { text };
                    files.push(text_file(format!("{stem}{}", format.end), text));
                }
                Err(error) => refused.push(error),
            }
            if format.is_own() {
                files.push(text_file(format!("{stem}.json"), json.to_owned()));
            }
        }
        (files, refused)
    }
}

/// Formats the parameters with their standard deviations, the views with their errors, and the properties of the target.
fn summary(solved: &Calibrated, poses: &[PoseUncertainty]) -> String {
    let estimate = &solved.estimate;
    let poses: String = pose_uncertainty(estimate, poses).map(|line| line + "\n").collect();
    let mut text: String =
        estimate.cameras.iter().map(|camera| of_camera(camera, &poses)).collect();
    let held_out = estimate.held_out.iter().map(|test| format!("held out: {}", headline(test)));
    for line in [headline(estimate)].into_iter().chain(solved.lines()).chain(held_out) {
        text += &(line + "\n");
    }
    text
}

fn of_camera(camera: &CameraEstimate, poses: &str) -> String {
    let mut text = String::new();
    let is_observed = camera.covariance_from(Source::Observed).is_some();
    let spline = match &camera.camera.lens {
        Lens::Spline(spline) => Some(spline.grid()),
        _ => None,
    };
    if camera.covariance_from(Source::Noise).is_some() && spline.is_none() {
        let observed = if is_observed { "    observed" } else { "" };
        let _ = writeln!(text, "                        σ from noise{observed}");
    }
    for (parameter, observed) in camera.parameters.iter().zip(camera.observed_sd()) {
        if spline.is_some() {
            break;
        }
        let Some(sd) = parameter.sd else { continue };
        let digits = places(sd).max(1);
        let observed = observed
            .map_or(String::new(), |sd| format!(" {sd:>11.digits$}", digits = places(sd).max(1)));
        let _ = writeln!(
            text,
            "{:5} {:>16.digits$} ± {sd:>11.digits$}{observed}",
            parameter.name, parameter.value
        );
    }
    if let Some(SplineGrid { degree, columns, rows, fov_x_deg }) = spline {
        for parameter in &camera.parameters[..PROJECTION_PARAMETERS.len()] {
            let _ = writeln!(text, "{:5} {:>16.3}, kept", parameter.name, parameter.value);
        }
        let _ = writeln!(
            text,
            "spline of degree {degree} with {columns} × {rows} knots, {fov_x_deg}° across"
        );
    }
    if let Some(constraints) = camera.described_constraints() {
        let _ = writeln!(text, "constraints: {constraints}");
    }
    if let Some(line) = projection_uncertainty(camera) {
        let _ = writeln!(text, "{line}");
    }
    text += poses;
    // Correlations of neighbouring knots are not of interest.
    let found: Vec<&str> = camera.estimated_parameters().filter(|_| spline.is_none()).collect();
    for i in 0..found.len() {
        for j in i + 1..found.len() {
            let correlation = camera.correlation(i, j);
            // Equal parameters have a correlation of 1.
            if (STRONG_CORRELATION..1.0 - 1e-9).contains(&correlation.abs()) {
                let _ =
                    writeln!(text, "{} and {}: correlation {correlation:.3}", found[i], found[j]);
            }
        }
    }
    let _ = writeln!(text, "view             corners  RMS px  outliers");
    for view in &camera.views {
        let (corners, outliers) = (view.corners.len(), view.outlier_count());
        let name = shown(&view.name);
        let _ = writeln!(text, "{name:16} {corners:7}  {:.4}  {outliers:8}", view.rms_px);
    }
    text
}

/// Summarizes the quality of a calibration in one line.
fn headline(estimate: &Estimate) -> String {
    let mut text = format!(
        "{}, {}, RMS {:.4} px per axis",
        counted(estimate.frames.len(), "view"),
        counted(estimate.corner_count(), "corner"),
        estimate.rms_px
    );
    text += &without_outliers(estimate.outlier_count(), estimate.inlier_rms_px());
    text
}
