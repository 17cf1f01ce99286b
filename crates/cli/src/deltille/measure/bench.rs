//! `deltille bench`: run times on this machine.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;

use crate::deltille::files::images::Images;
use crate::deltille::see::detector_options::FinderArgs;
use crate::interrupt;
use crate::output::say;
use crate::run::Interrupted;
use crate::values::whole;
use deltille::{clock, photograph};
use deltille_core::statistics::quantile;
use deltille_lab::speed::{self, Row};

/// Arguments of `deltille bench`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    bench: Bench,
}

#[derive(Subcommand)]
enum Bench {
    /// Time detection, video, files and calibrations on one thread, with simulated photographs
    All(AllArgs),
    /// Time the stages of detection on one thread, without decoding files
    Detect(DetectArgs),
}

#[derive(clap::Args)]
struct AllArgs {
    /// Also calibrate from 5,000 views, and a board of 5,000 corners: minutes, and 2 GB of memory
    #[arg(long)]
    large: bool,
    /// Seed of the random number generator
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(0..=u64::MAX))]
    seed: u64,
}

#[derive(clap::Args)]
struct DetectArgs {
    /// Photographs: files, folders, patterns, or - for a list on standard input
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    finder: FinderArgs,
    /// Number of runs per image; the fastest is reported, because it is the one least slowed down
    /// by other processes
    #[arg(long, value_name = "N", default_value_t = 5,
          value_parser = whole(1..=1000u32))]
    repeat: u32,
}

/// Runs a benchmark.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    match args.bench {
        Bench::All(args) => all(&args),
        Bench::Detect(args) => detect(&args),
    }
}

/// Prints a table of run times, as it is measured.
fn all(args: &AllArgs) -> anyhow::Result<ExitCode> {
    let large = speed::LARGE.into_iter().filter(|_| args.large);
    say!("{:<46}{:>7}{:>12}{:>12}  result", "one thread", "number", "median ms", "longest ms");
    for group in speed::GROUPS.into_iter().chain(large) {
        if interrupt::is_raised() {
            return Err(Interrupted("the table is incomplete".to_owned()).into());
        }
        for Row { what, count, median_ms, worst_ms, result } in group(args.seed)? {
            say!("{what:<46}{count:>7}{median_ms:>12.1}{worst_ms:>12.1}  {result}");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints the run time of each stage of detection.
fn detect(args: &DetectArgs) -> anyhow::Result<ExitCode> {
    let detector = args.finder.detector()?.1.with_clock(clock::now);
    // Milliseconds of each stage, one number per image.
    let mut stages = BTreeMap::<String, Vec<f64>>::new();
    let mut total = Vec::new();
    let (mut pixels, mut corners) = (0, 0);
    for path in Images::of(&args.images)?.iter() {
        let path = path?;
        let image = photograph::read_within(&path, &args.finder.limits())?;
        let mut best: Option<BTreeMap<String, f64>> = None;
        for _ in 0..args.repeat {
            if interrupt::is_raised() {
                return Err(Interrupted("no measurement was completed".to_owned()).into());
            }
            let found = detector.detect(&image, "");
            corners += found.grids.iter().map(|grid| grid.corners.len()).sum::<usize>();
            let sum = |laps: &BTreeMap<String, f64>| laps.values().sum::<f64>();
            if best.as_ref().is_none_or(|best| sum(&found.timing_ms) < sum(best)) {
                best = Some(found.timing_ms);
            }
        }
        let best = best.unwrap_or_default();
        pixels += image.width() * image.height();
        total.push(best.values().sum());
        for (stage, ms) in best {
            stages.entry(stage).or_default().push(ms);
        }
    }
    let images = total.len();
    say!(
        "{images} images, {:.2} Mpx and {:.1} corners on average, one thread",
        pixels as f64 / 1e6 / images.max(1) as f64,
        corners as f64 / f64::from(args.repeat) / images.max(1) as f64
    );
    say!("{:<10}{:>10}{:>10}{:>10}  ms", "stage", "median", "5 %", "95 %");
    let rows = stages.iter_mut().map(|(stage, ms)| (stage.as_str(), ms));
    for (stage, ms) in rows.chain([("all", &mut total)]) {
        let [median, low, high] = quantiles(ms);
        say!("{stage:<10}{median:>10.2}{low:>10.2}{high:>10.2}");
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the median, 5 % and 95 % quantiles; zeros for an empty slice.
fn quantiles(values: &mut [f64]) -> [f64; 3] {
    [0.5, 0.05, 0.95].map(|part| quantile(values, part).unwrap_or(0.0))
}
