//! `deltille calibrate`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail, ensure};
use clap::ValueEnum;

use super::camera_file;
use super::files::{File, text_file, write_all};
use super::sightings::{Sightings, SightingsArgs};
use crate::calibrate::{self, BoardShape, Loss, Model, Options, Remedy, Solution, View, Weights};
use crate::camera::Pose;
use crate::cli::output::{self, Overwrite, tell};
use crate::cli::run::{FAILED, report};
use crate::export::calibration::{self, Print};
use crate::export::camera::{colmap, kalibr, nerfstudio, opencv, ros};
use crate::name::is_within;
use crate::photograph;
use crate::raster::AnyGray;
use crate::report::{Given, Named, Report, cannot_tell_apart, causes, thumbnail};
use crate::words::{counted, shown};

/// Correlations from here on are told: such parameters are hardly told apart.
const STRONG_CORRELATION: f64 = 0.98;

/// A known camera that leaves more than this part of the image's width did not take the pictures: poses
/// take up most of what focal lengths and principal point are off by, and so much is left by another
/// lens, zoom or crop only.
const WRONG_CAMERA: f64 = 0.005;

/// Arguments of `deltille calibrate`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    sightings: SightingsArgs,
    /// What is to be found beside fx, fy, cx, cy: radtan (k1 k2 p1 p2), radtan5 (and k3), rational
    /// (and k4 k5 k6), thin-prism (and s1 … s4), kannala-brandt (4 terms; kannala-brandt-5 …),
    /// eucm, double-sphere, or pupil (fisheye with a moving entrance pupil)
    #[arg(long, required_unless_present = "fixed_intrinsics")]
    model: Option<Model>,
    /// Find only the poses of this camera: its file, as written by this command, ROS or OpenCV
    #[arg(long, value_name = "CAMERA", conflicts_with = "model")]
    fixed_intrinsics: Option<PathBuf>,
    /// Keep every N-th view (the N-th, 2N-th, …) out of the calibration and tell the error there,
    /// where only poses are found
    #[arg(long, value_name = "N", conflicts_with = "fixed_intrinsics",
          value_parser = clap::value_parser!(u32).range(2..))]
    holdout: Option<u32>,
    /// How corners far off their prediction count
    #[arg(long, value_name = "LOSS", default_value = "huber")]
    robust: Robust,
    /// How corners are weighted
    #[arg(long, value_name = "BY", default_value = "covariance")]
    weights: Weighting,
    /// What to write; several may be given, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "own")]
    format: Vec<Format>,
    /// Find how the sheet of the board is bent, stretched and sheared, too, and whether that is more
    /// than chance
    #[arg(long, conflicts_with_all = ["fixed_intrinsics", "shape"])]
    board_shape: bool,
    /// Write a page that shows what the calibration is worth, and what would make it better
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Folder of the photographs, for small pictures on the page
    #[arg(long, value_name = "FOLDER", requires = "report")]
    images: Option<PathBuf>,
    /// The camera file, .yaml, or a folder for camera.yaml; other files are written beside it and
    /// named after it [default: camera.yaml, or poses.yaml with --fixed-intrinsics]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// How corners far off count.
#[derive(Clone, Copy, ValueEnum)]
pub enum Robust {
    /// In full: least squares
    None,
    /// Beyond three standard deviations with a constant force
    Huber,
    /// Beyond three standard deviations hardly
    Cauchy,
}

/// How corners are weighted.
#[derive(Clone, Copy, ValueEnum)]
pub enum Weighting {
    /// All corners alike
    Equal,
    /// By the detections' covariances, with a common deviation found beside them
    Covariance,
}

impl From<Robust> for Loss {
    fn from(robust: Robust) -> Self {
        match robust {
            Robust::None => Self::Squared,
            Robust::Huber => Self::Huber,
            Robust::Cauchy => Self::Cauchy,
        }
    }
}

impl From<Weighting> for Weights {
    fn from(weighting: Weighting) -> Self {
        match weighting {
            Weighting::Equal => Self::Equal,
            Weighting::Covariance => Self::Covariance,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// <name>.yaml, which every command here reads, and <name>.json with uncertainties, poses and
    /// residuals
    Own,
    /// <name>-opencv.yaml
    Opencv,
    /// <name>-ros.yaml
    Ros,
    /// <name>-camchain.yaml
    Kalibr,
    /// <name>-cameras.txt
    Colmap,
    /// <name>-transforms.json
    Nerfstudio,
}

/// Calibrates, writes the camera, and tells how good it is.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    // Poses of a known camera do not take the place of its calibration.
    let stem = if args.fixed_intrinsics.is_some() { "poses" } else { "camera" };
    let path = output::file(args.output.as_deref().unwrap_or(Path::new(".")), stem, "yaml")?;
    let Sightings { views, panels, empty, left_out, print } = args.sightings.read()?;
    ensure!(!views.is_empty(), "no board of this kind in {}", counted(empty.len(), "picture"));
    for picture in &empty {
        tell!("{}: no board, left out", picture.display());
    }
    if let Some(folder) = &args.images {
        ensure!(folder.is_dir(), "--images: {} is no folder", folder.display());
        warn_of_missing(folder, &views);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let page = args.report.as_ref().map(|page| {
        let is_page = page.is_dir() || page.extension().is_some_and(|end| end == "html");
        ensure!(is_page, "--report: {} must end in .html, or be a folder", page.display());
        let page = output::file(page, &format!("{stem}-report"), "html")?;
        output::check_writable("--report", &page)?;
        Ok(page)
    });
    let page = page.transpose()?;
    let mut solution = args.solve(&views, &panels)?;
    let of_test = solution.held_out.iter().flat_map(|test| &test.excluded);
    for out in solution.calibrated.excluded.iter().chain(of_test) {
        tell!("{}: left out: {}", out.view, out.reason);
    }
    solution.calibrated.excluded.splice(0..0, left_out);
    if let (Some(camera), Some(cause)) =
        (&args.fixed_intrinsics, wrong_camera(&solution.calibrated))
    {
        report(&anyhow!("--fixed-intrinsics: {}: {cause}", camera.display()));
        return Ok(ExitCode::from(FAILED));
    }
    if let Some(end) = solution.calibrated.lens_end() {
        tell!("warning: {end}");
    }
    let named = Named { cameras: &[] };
    for finding in &solution.calibrated.findings {
        tell!("warning: {}", named.sentence(finding));
    }
    let given = Given { model: args.model, print_scale: print.scale, remedy: solution.remedy };
    for cause in causes(&solution.calibrated, given) {
        tell!("warning: {cause}");
    }
    if !solution.calibrated.loose.is_empty() {
        let text = cannot_tell_apart(&solution.calibrated.loose, solution.sufficient);
        tell!("warning: {text}");
    }
    let texts = args.format.iter().map(|&format| format.texts(&stem, &solution, print));
    let texts = texts.collect::<anyhow::Result<Vec<_>>>().context("--format")?;
    let files = texts.into_iter().flatten().map(|(name, text)| text_file(name, text));
    let files: Vec<File> = files.collect();
    let mut written = write_all(output::folder_of(&path), &files, args.overwrite)?;
    if let Some(page) = page {
        let html = args.page(&stem, &solution, print);
        output::write(&page, html.as_bytes(), args.overwrite).context("--report")?;
        written.push(page);
    }
    let mut text = table(&solution.calibrated);
    if let Some(shape) = &solution.calibrated.shape {
        let _ = writeln!(text, "{}", told(shape));
    }
    if let Some(ink) = print.ink.filter(|ink| ink.used) {
        let _ = writeln!(text, "ink: {ink}, which the corners allow for");
    }
    if let Some(test) = &solution.held_out {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "held out: {}", headline(test));
    }
    for path in written {
        let _ = writeln!(text, "wrote {}", shown(&path.display().to_string()));
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Why a known camera cannot have taken the pictures.
fn wrong_camera(solution: &Solution) -> Option<String> {
    let (rms_px, width) = (solution.inlier_rms_px(), f64::from(solution.camera.width));
    (rms_px > WRONG_CAMERA * width).then(|| {
        format!(
            "with this camera corners are off by {rms_px:.1} px, more than {} % of the image's width: \
             it did not take these pictures, or not with this lens, zoom or crop; nothing was written",
            100.0 * WRONG_CAMERA
        )
    })
}

/// The picture of a view in a folder, or in one within it. What a file calls the picture leads nowhere else.
fn picture_of(image: &str, folder: &Path) -> Option<PathBuf> {
    is_within(image).then(|| folder.join(image)).filter(|path| path.is_file())
}

/// Tells which pictures of the views are not in a folder.
fn warn_of_missing(folder: &Path, views: &[View]) {
    let missing = views.iter().filter(|view| picture_of(&view.image, folder).is_none());
    let missing: Vec<&str> = missing.map(|view| view.image.as_str()).collect();
    if let Some(first) = missing.first() {
        tell!(
            "warning: --images: {} of {} are not in {}, such as {first}",
            missing.len(),
            counted(views.len(), "picture"),
            folder.display()
        );
    }
}

/// What came of a command.
struct Solved {
    /// Name of the model, or `fixed`.
    model: String,
    calibrated: Solution,
    held_out: Option<Solution>,
    /// A smaller model that does as well, sought where parameters cannot be told apart.
    sufficient: Option<Model>,
    remedy: Option<Remedy>,
}

impl Args {
    /// The page of a calibration.
    fn page(&self, stem: &str, solved: &Solved, print: Print) -> String {
        let mut thumbnails = BTreeMap::new();
        for view in &solved.calibrated.views {
            let Some(folder) = &self.images else { break };
            // A picture that is not there leaves its place to the corners.
            let picture =
                picture_of(&view.image, folder).and_then(|path| photograph::read(&path).ok());
            let picture = picture.and_then(|image| match image {
                AnyGray::U8(image) => thumbnail(&image),
                AnyGray::U16(image) => thumbnail(&image.map(|v| (v >> 8) as u8)),
            });
            thumbnails.extend(picture.map(|picture| (view.name.clone(), picture)));
        }
        let report = Report {
            title: stem,
            model: &solved.model,
            solution: &solved.calibrated,
            holdout: solved.held_out.as_ref(),
            print,
            sufficient: solved.sufficient,
            remedy: solved.remedy,
            thumbnails,
        };
        report.html()
    }

    fn solve(&self, views: &[View], panels: &[Pose]) -> anyhow::Result<Solved> {
        let (loss, weights) = (self.robust.into(), self.weights.into());
        let Some(model) = self.model else {
            let path = self.fixed_intrinsics.as_deref().unwrap_or(Path::new(""));
            let camera = camera_file::read("--fixed-intrinsics", path)?;
            let calibrated = calibrate::poses(views, panels, &camera, loss, weights)?;
            ensure!(
                !calibrated.views.is_empty(),
                "no view shows the target as this camera sees it"
            );
            let remedy =
                calibrate::remedy_of_given(views, panels, &camera, loss, weights, &calibrated);
            return Ok(Solved {
                model: "fixed".to_owned(),
                calibrated,
                held_out: None,
                sufficient: None,
                remedy,
            });
        };
        let options = Options { model, loss, weights };
        let every = self.holdout.map(|n| n as usize);
        let is_held_out = |index: usize| every.is_some_and(|n| (index + 1).is_multiple_of(n));
        let part = |held_out: bool| -> Vec<View> {
            let views = views.iter().enumerate();
            views.filter(|(i, _)| is_held_out(*i) == held_out).map(|(_, v)| v.clone()).collect()
        };
        if let Some(every) = every
            && every > views.len()
        {
            bail!(
                "--holdout: there are only {}, so that none is the {every}-th",
                counted(views.len(), "view")
            );
        }
        let calibrated = match self.board_shape {
            true => calibrate::calibrate_with_shape(&part(false), panels, options)
                .context("--board-shape")?,
            false => calibrate::calibrate(&part(false), panels, options)?,
        };
        let mut test = part(true);
        if let Some(BoardShape { shape, .. }) = &calibrated.shape {
            let sightings = test.iter_mut().flat_map(|view| &mut view.sightings);
            sightings.for_each(|sighting| sighting.bend(shape));
        }
        let held_out = match test.is_empty() {
            true => None,
            false => Some(calibrate::poses(&test, panels, &calibrated.camera, loss, weights)?),
        };
        let remedy = calibrate::remedy(&part(false), panels, options, &calibrated);
        let sufficient = match calibrated.loose.is_empty() {
            true => None,
            false => calibrate::sufficient(&part(false), panels, options, &calibrated),
        };
        Ok(Solved { model: model.to_string(), calibrated, held_out, sufficient, remedy })
    }
}

impl Format {
    /// The names and texts of its files.
    fn texts(
        self,
        stem: &str,
        solved: &Solved,
        print: Print,
    ) -> anyhow::Result<Vec<(String, String)>> {
        let solution = &solved.calibrated;
        let camera = &solution.camera;
        let one = |end: &str, text: String| vec![(format!("{stem}{end}"), text)];
        Ok(match self {
            Self::Own => vec![
                (format!("{stem}.yaml"), camera.to_yaml()),
                (
                    format!("{stem}.json"),
                    calibration::write(solution, &solved.model, solved.held_out.as_ref(), print),
                ),
            ],
            Self::Opencv => one("-opencv.yaml", opencv(camera)?),
            Self::Ros => one("-ros.yaml", ros(camera, stem)?),
            Self::Kalibr => one("-camchain.yaml", kalibr(&[(camera, Pose::IDENTITY)])?),
            Self::Colmap => one("-cameras.txt", colmap(&[camera])?),
            Self::Nerfstudio => {
                let views = solution.views.iter().map(|view| (view.image.as_str(), view.pose));
                let views: Vec<_> = views.collect();
                one("-transforms.json", nerfstudio(camera, &views)?)
            }
        })
    }
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

/// Parameters with their deviations, views with their errors.
fn table(solution: &Solution) -> String {
    let mut text = String::new();
    for parameter in solution.parameters.iter() {
        let Some(sd) = parameter.sd else { continue };
        // As many places as two digits of the deviation need.
        let places = (1.0 - sd.log10().floor()).clamp(1.0, 12.0) as usize;
        let _ =
            writeln!(text, "{:5} {:>14.places$} ± {sd:.places$}", parameter.name, parameter.value);
    }
    let found: Vec<&str> = solution.found().collect();
    for i in 0..found.len() {
        for j in i + 1..found.len() {
            let correlation = solution.correlation(i, j);
            if correlation.abs() >= STRONG_CORRELATION {
                let _ =
                    writeln!(text, "{} and {}: correlation {correlation:.3}", found[i], found[j]);
            }
        }
    }
    let _ = writeln!(text, "view             corners  rms px  outliers");
    for view in &solution.views {
        let (corners, outliers) = (view.corners.len(), view.outlier_count());
        let name = shown(&view.name);
        let _ = writeln!(text, "{name:16} {corners:7}  {:.4}  {outliers:8}", view.rms_px);
    }
    text += &headline(solution);
    text.push('\n');
    text
}

/// What a calibration is worth, in a line.
fn headline(solution: &Solution) -> String {
    let mut text = format!(
        "{}, {}, rms {:.4} px a coordinate",
        counted(solution.views.len(), "view"),
        counted(solution.corner_count(), "corner"),
        solution.rms_px
    );
    text += &without_outliers(solution.outlier_count(), solution.inlier_rms_px());
    text
}

/// What is left where corners are outliers, for the end of a line.
pub fn without_outliers(outliers: usize, inlier_rms_px: f64) -> String {
    match outliers {
        0 => String::new(),
        n => format!(", {inlier_rms_px:.4} px without {}", counted(n, "outlier")),
    }
}
