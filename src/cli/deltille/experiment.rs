//! `deltille experiment`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::{Context, bail};
use clap::Subcommand;

use super::images::Images;
use crate::cli::{interrupt, output, progress};
use crate::experiment::{corners, plot, rig, table2};

/// Arguments of `deltille experiment`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    /// Precision of refined corners against blur, noise and tilt, with the Cramér–Rao bound:
    /// corners.csv, corners.svg and corners.png
    Corners(CornersArgs),
    /// The paper's §4.4: a rig of four cameras, calibrated with an icosahedron and with a cube whose
    /// panels are misplaced, with and without refining them: rig.csv
    Rig(RigArgs),
    /// The paper's Table 2: calibrate on the first half of a sequence of photographs, find poses
    /// on the second
    Table2(Table2Args),
}

#[derive(clap::Args)]
struct Table2Args {
    /// Folder with the photographs of the paper's 10 × 11 board, in the order of their names
    folder: PathBuf,
}

#[derive(clap::Args)]
struct RigArgs {
    /// Width of the pictures, px; 4000 is the paper's
    #[arg(long, value_name = "PX", default_value_t = 1600,
          value_parser = clap::value_parser!(u32).range(800..=8000))]
    width: u32,
    /// Moments at which pictures are taken; 150 is the paper's
    #[arg(long, value_name = "N", default_value_t = 30,
          value_parser = clap::value_parser!(u32).range(5..=1000))]
    frames: u32,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads [default: one per processor]
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for the results
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
}

#[derive(clap::Args)]
struct CornersArgs {
    /// Simulated images at every point; each is refined from four starts
    #[arg(long, value_name = "N", default_value_t = 1000,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    images: u32,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads [default: one per processor]
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for the results
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
}

/// Runs an experiment; nothing is written when it is interrupted.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    match args.experiment {
        Experiment::Corners(args) => run_corners(args),
        Experiment::Rig(args) => run_rig(args),
        Experiment::Table2(args) => {
            let images = Images::of(std::slice::from_ref(&args.folder))?;
            let rows = table2::run(images.named());
            let rows = rows.with_context(|| args.folder.display().to_string())?;
            output::print(&table2::text(&rows))?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

fn run_rig(args: RigArgs) -> anyhow::Result<ExitCode> {
    output::check_folder(&args.output).context("-o")?;
    let setup = rig::Setup { width: args.width, frames: args.frames as usize, seed: args.seed };
    let pictures = rig::Object::ALL.len() * rig::CAMERAS * setup.frames;
    let bar = progress::bar(pictures as u64, "pictures");
    let threads = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0).into());
    let outcomes = threads.build()?.install(|| rig::run(setup, interrupt::flag(), &|| bar.inc(1)));
    bar.finish_and_clear();
    let Some(outcomes) = outcomes? else { bail!("interrupted; nothing was written") };
    let path = args.output.join("rig.csv");
    output::write(&path, rig::csv(&outcomes).as_bytes())?;
    output::print(&format!("{}{}\n", rig::text(&outcomes), path.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn run_corners(args: CornersArgs) -> anyhow::Result<ExitCode> {
    output::check_folder(&args.output).context("-o")?;
    let bar = progress::bar(corners::rows_count() as u64, "rows");
    let interrupted = interrupt::flag();
    let threads = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0).into());
    let rows = threads
        .build()?
        .install(|| corners::run(args.images as usize, args.seed, interrupted, &|| bar.inc(1)));
    bar.finish_and_clear();
    let Some(rows) = rows.filter(|_| !interrupted.load(Ordering::Relaxed)) else {
        bail!("interrupted; nothing was written");
    };
    let svg = plot::svg(&rows);
    let png = plot::png(&svg).context("the plot cannot be drawn")?;
    for (name, content) in [
        ("corners.csv", corners::csv(&rows).into_bytes()),
        ("corners.svg", svg.into_bytes()),
        ("corners.png", png),
    ] {
        output::write(&args.output.join(name), &content)?;
    }
    println!(
        "{}: {} fits a point, seed {}",
        args.output.join("corners.csv").display(),
        4 * args.images,
        args.seed
    );
    Ok(ExitCode::SUCCESS)
}
