//! `deltille experiment`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::{Context, bail};
use clap::Subcommand;

use crate::deltille::files::images::Images;
use crate::deltille::files::target_file;
use crate::deltille::files::written::{bytes_file, text_file, write_all};
use crate::output::{self, Overwrite, report, say};
use crate::run::Interrupted;
use crate::values::whole;
use crate::{interrupt, progress};
use deltille::detect::Tone;
use deltille::family;
use deltille::limits::Limits;
use deltille_lab::photographs::axes::Axis;
use deltille_lab::photographs::result::table;
use deltille_lab::photographs::{self, Kind, Subject};
use deltille_lab::states::Scene;
use deltille_lab::{corners, guide, plot, rig, states, table2};

/// Arguments of `deltille experiment`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    /// Precision of refined corners against blur, noise and tilt, with the Cramér–Rao bound: corners.csv, corners.svg
    /// and corners.png
    Corners(CornersArgs),
    /// Calibration errors with proposed and with random views, compared with the predicted uncertainty: guide.csv
    Guide(GuideArgs),
    /// Detection on simulated photographs of a printed page with known ground truth, degraded in one way at a time:
    /// photographs.csv, .json, .svg and .png
    Photographs(PhotographsArgs),
    /// §4.4 of Ha et al.: a rig of four cameras, calibrated with an icosahedron and with a cube.
    /// The panels of both are misplaced; the calibration assumes their nominal poses or estimates
    /// them: rig.csv
    Rig(RigArgs),
    /// Detection and false-alarm rates of the checks for a changed camera, in simulations with and
    /// without a change, with a rolling shutter, or with a wrong aspect ratio of the board:
    /// states.csv
    States(StatesArgs),
    /// Table 2 of Ha et al.: calibrate on the first half of a sequence of photographs, and estimate
    /// poses on the second
    Table2(Table2Args),
}

#[derive(clap::Args)]
struct GuideArgs {
    /// Number of proposed views
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = whole(4..=100u32))]
    views: u32,
    /// Number of random views
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = whole(4..=1000u32))]
    random: u32,
    /// Number of runs with each camera
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole(1..=10_000u32))]
    runs: u32,
    /// Standard deviation of the corner noise per axis, px
    #[arg(long, value_name = "PX", default_value = "0.1", value_parser = noise_px)]
    noise: f64,
    /// Render every image with pixel noise and detect its corners, instead of adding --noise to
    /// projected corners
    #[arg(long, conflicts_with = "noise")]
    pictures: bool,
    /// Cameras to simulate [default: all]
    #[arg(long, value_name = "CAMERA", value_delimiter = ',',
          value_parser = ["webcam", "fisheye", "long"])]
    camera: Vec<String>,
    #[command(flatten)]
    simulation: SimulationArgs,
}

/// Parses a standard deviation in px at which corners can still be distinguished.
fn noise_px(text: &str) -> Result<f64, String> {
    let px: Option<f64> = text.parse().ok().filter(|px| (0.001..=1.0).contains(px));
    px.ok_or_else(|| "expected px from 0.001 to 1".to_owned())
}

#[derive(clap::Args)]
struct Table2Args {
    /// Folder with the photographs of the 10 × 11 board of Ha et al., read in order of their
    /// names
    folder: PathBuf,
}

#[derive(clap::Args)]
struct RigArgs {
    /// Width of the images, px; the paper uses 4000
    #[arg(long, value_name = "PX", default_value_t = 1600,
          value_parser = whole(800..=8000u32))]
    width: u32,
    /// Number of frames (simultaneous images of all cameras); the paper uses 150
    #[arg(long, value_name = "N", default_value_t = 30,
          value_parser = whole(5..=1000u32))]
    frames: u32,
    #[command(flatten)]
    simulation: SimulationArgs,
}

#[derive(clap::Args)]
struct StatesArgs {
    /// Number of runs of the scene without a fault
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = whole(1..=100_000u32))]
    clean: u32,
    /// Number of runs per scene with a fault
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole(1..=100_000u32))]
    runs: u32,
    /// Scenes to simulate [default: all]
    #[arg(long, value_name = "SCENE", value_delimiter = ',',
          value_parser = Scene::ALL.map(Scene::name))]
    scene: Vec<String>,
    #[command(flatten)]
    simulation: SimulationArgs,
}

#[derive(clap::Args)]
struct CornersArgs {
    /// Number of simulated images per plotted point; each is refined from four initial positions
    #[arg(long, value_name = "N", default_value_t = 1000,
          value_parser = whole(1..=1_000_000u32))]
    images: u32,
    /// Tone curve of the simulated camera, unless it is varied: linear, srgb, or a gamma such as 2.2
    #[arg(long, value_name = "CURVE", default_value = "linear")]
    tone: Tone,
    #[command(flatten)]
    simulation: SimulationArgs,
}

#[derive(clap::Args)]
struct PhotographsArgs {
    #[arg(long, value_name = "AXIS", value_delimiter = ',', help = format!(
        "Parameters to vary: {} [default: all]", Axis::ALL.map(Axis::name).join(", ")
    ))]
    axis: Vec<Axis>,
    /// Boards with 20 mm tiles: deltille and checker, with tags; deltille-untagged, checker-untagged; all
    #[arg(long, value_name = "KIND", value_delimiter = ',', default_value = "deltille",
          value_parser = ["deltille", "deltille-untagged", "checker", "checker-untagged", "all"])]
    kind: Vec<String>,
    /// Simulate photographs of the first page of this target instead: the .json of `deltille board`
    /// or of another command that makes targets
    #[arg(long, value_name = "FILE", conflicts_with = "kind")]
    target: Option<PathBuf>,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long, requires = "target")]
    family: Option<String>,
    /// Number of photographs per level
    #[arg(long, value_name = "N", default_value_t = 6,
          value_parser = whole(1..=10_000u32))]
    views: u32,
    /// Write all images with their ground truth to this folder
    #[arg(long, value_name = "FOLDER")]
    images: Option<PathBuf>,
    #[command(flatten)]
    simulation: SimulationArgs,
}

/// Options of every simulation.
#[derive(clap::Args)]
struct SimulationArgs {
    /// Seed of the random number generator
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(0..=u64::MAX))]
    seed: u64,
    /// Number of threads [default: one per processor]
    #[arg(short, value_name = "N", value_parser = whole(1..=1024u16))]
    jobs: Option<u16>,
    /// Output folder
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Runs an experiment; nothing is written if it is interrupted.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    interrupt::set_status("no result was written");
    match args.experiment {
        Experiment::Corners(args) => run_corners(args),
        Experiment::Guide(args) => run_guide(args),
        Experiment::Photographs(args) => run_photographs(args),
        Experiment::Rig(args) => run_rig(args),
        Experiment::States(args) => run_states(args),
        Experiment::Table2(args) => {
            let images = Images::of(std::slice::from_ref(&args.folder))?;
            let rows = table2::run(images.named());
            let rows = rows.with_context(|| args.folder.display().to_string())?;
            output::print(&table2::text(&rows))?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

impl SimulationArgs {
    /// Runs a simulation with a callback that advances a progress bar.
    fn run<T: Send>(
        &self,
        steps: usize,
        unit: &str,
        simulation: impl FnOnce(&(dyn Fn() + Sync)) -> T + Send,
    ) -> anyhow::Result<T> {
        output::check_folder(&self.output).context("-o")?;
        let bar = progress::bar(steps as u64, unit);
        let threads = rayon::ThreadPoolBuilder::new().num_threads(self.jobs.unwrap_or(0).into());
        let result = threads.build()?.install(|| simulation(&|| bar.inc(1)));
        bar.finish_and_clear();
        Ok(result)
    }
}

fn run_guide(args: GuideArgs) -> anyhow::Result<ExitCode> {
    let GuideArgs { views, random, runs, noise, pictures, camera, simulation } = args;
    let noise_px = (!pictures).then_some(noise);
    let (guided, random) = (views as usize, random as usize);
    let setup =
        guide::Setup { guided, random, runs: runs as usize, noise_px, seed: simulation.seed };
    let mut subjects = guide::subjects();
    subjects.retain(|subject| camera.is_empty() || camera.iter().any(|name| name == subject.name));
    let outcome = simulation.run(setup.runs * subjects.len(), "runs", |tick| {
        guide::run(setup, &subjects, interrupt::flag(), tick)
    })?;
    let Some(outcome) = outcome? else {
        return Err(Interrupted("nothing was written".to_owned()).into());
    };
    let path = simulation.output.join("guide.csv");
    output::write(&path, guide::csv(&outcome).as_bytes(), simulation.overwrite)?;
    output::print(&guide::text(setup, &outcome))?;
    report!("{}", output::wrote(&path));
    Ok(ExitCode::SUCCESS)
}

fn run_rig(args: RigArgs) -> anyhow::Result<ExitCode> {
    let RigArgs { width, frames, simulation } = args;
    let setup = rig::Setup { width, frames: frames as usize, seed: simulation.seed };
    let pictures = rig::Object::ALL.len() * rig::CAMERAS * setup.frames;
    let outcomes =
        simulation.run(pictures, "images", |tick| rig::run(setup, interrupt::flag(), tick))?;
    let Some(outcomes) = outcomes? else {
        return Err(Interrupted("nothing was written".to_owned()).into());
    };
    let path = simulation.output.join("rig.csv");
    output::write(&path, rig::csv(&outcomes).as_bytes(), simulation.overwrite)?;
    output::print(&rig::text(&outcomes))?;
    report!("{}", output::wrote(&path));
    Ok(ExitCode::SUCCESS)
}

fn run_states(args: StatesArgs) -> anyhow::Result<ExitCode> {
    let StatesArgs { clean, runs, scene, simulation } = args;
    let is_wanted = |of: &Scene| scene.is_empty() || scene.iter().any(|name| name == of.name());
    let count = |of: Scene| if of == Scene::Clean { clean } else { runs } as usize;
    let scenes = Scene::ALL.into_iter().filter(is_wanted).map(|of| (of, count(of)));
    let scenes: Vec<(Scene, usize)> = scenes.collect();
    let steps = scenes.iter().map(|(_, runs)| runs).sum();
    let outcome = simulation.run(steps, "runs", |tick| {
        states::run(&scenes, simulation.seed, interrupt::flag(), tick)
    })?;
    let Some(outcome) = outcome else {
        return Err(Interrupted("nothing was written".to_owned()).into());
    };
    let path = simulation.output.join("states.csv");
    output::write(&path, states::csv(&outcome).as_bytes(), simulation.overwrite)?;
    output::print(&states::text(&outcome))?;
    report!("{}", output::wrote(&path));
    Ok(ExitCode::SUCCESS)
}

fn run_corners(args: CornersArgs) -> anyhow::Result<ExitCode> {
    let CornersArgs { images, tone, simulation } = args;
    if tone == Tone::Auto {
        bail!("--tone: a simulated camera needs a known curve: linear, srgb or a gamma");
    }
    let SimulationArgs { seed, output: folder, .. } = &simulation;
    let interrupted = interrupt::flag();
    let rows = simulation.run(corners::rows_count(), "rows", |tick| {
        corners::run(images as usize, *seed, tone, interrupted, tick)
    })?;
    let Some(rows) = rows.filter(|_| !interrupted.load(Ordering::Relaxed)) else {
        return Err(Interrupted("nothing was written".to_owned()).into());
    };
    let svg = plot::svg(&rows);
    let png = plot::png(&svg).context("the plot cannot be drawn")?;
    say!("{} fits per point, seed {seed}", 4 * images);
    let files = [
        text_file("corners.csv".to_owned(), corners::csv(&rows)),
        text_file("corners.svg".to_owned(), svg),
        bytes_file("corners.png".to_owned(), png),
    ];
    for path in write_all(folder, &files, simulation.overwrite)? {
        report!("{}", output::wrote(&path));
    }
    Ok(ExitCode::SUCCESS)
}

fn run_photographs(args: PhotographsArgs) -> anyhow::Result<ExitCode> {
    let subjects = args.subjects()?;
    let PhotographsArgs { axis, views, images, simulation, .. } = args;
    if let Some(folder) = &images {
        output::check_folder(folder).context("--images")?;
        std::fs::create_dir_all(folder).context("--images")?;
    }
    let setup = photographs::Setup {
        views: views.into(),
        seed: simulation.seed,
        axes: if axis.is_empty() { &Axis::ALL } else { &axis },
        images: images.as_deref(),
    };
    let interrupted = interrupt::flag();
    let steps = subjects.len() * setup.photographs();
    let rows = simulation.run(steps, "photographs", |tick| {
        subjects.iter().try_fold(Some(Vec::new()), |rows, subject| {
            let Some(mut rows) = rows else { return Ok(None) };
            let more = photographs::run(subject, &setup, interrupted, tick)?;
            Ok::<_, photographs::PhotographError>(more.map(|more| {
                rows.extend(more);
                rows
            }))
        })
    })?;
    let Some(rows) = rows? else {
        return Err(Interrupted("no result was written".to_owned()).into());
    };
    output::print(&table::text(&rows))?;
    let svg = photographs::result::plot::svg(&rows);
    let png = plot::png(&svg).context("the plot cannot be drawn")?;
    let files = [
        text_file("photographs.csv".to_owned(), table::csv(&rows)),
        text_file("photographs.json".to_owned(), table::json(&rows, simulation.seed)),
        bytes_file("photographs.png".to_owned(), png),
        text_file("photographs.svg".to_owned(), svg),
    ];
    for path in write_all(&simulation.output, &files, simulation.overwrite)? {
        report!("{}", output::wrote(&path));
    }
    Ok(ExitCode::SUCCESS)
}

impl PhotographsArgs {
    /// Returns the targets to photograph.
    fn subjects(&self) -> anyhow::Result<Vec<Subject>> {
        if let Some(path) = &self.target {
            let mut printing = target_file::read(path, &Limits::default())?;
            target_file::set_family(&mut printing.target, self.family.as_deref())?;
            let subject = Subject::new(&printing.target.name, &printing);
            return Ok(vec![subject.with_context(|| path.display().to_string())?]);
        }
        let wanted =
            |kind: &Kind| self.kind.iter().any(|name| name == kind.name() || name == "all");
        let subject = |kind: Kind| {
            let tags = kind.spec().tags;
            let family = tags.map(|tags| family::resolve(&tags.family)).transpose()?;
            Ok(Subject::of_kind(kind, family.as_ref())?)
        };
        Kind::ALL.into_iter().filter(wanted).map(subject).collect()
    }
}
