use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::ValueEnum;

use super::parameters::Parameters;
use crate::cli::{interrupt, output, progress};
use crate::family::best::{Best, Search};
use crate::family::lexicode::{Checkpoint, Lexicode};
use crate::family::{Construction, Control, Family, Progress, Rules, Screen, TagWords};
use crate::lattice::Dimension;

#[derive(clap::Args)]
pub(super) struct Args {
    /// Bits and distance, d<bits>h<distance> with 9, 16, 25, 36 or 49 bits, such as d25h7
    family: Parameters,
    /// How to search
    #[arg(long, value_enum, default_value_t = Method::Best)]
    method: Method,
    /// Seconds for the methods best and algebraic; more time finds larger families
    #[arg(long, default_value_t = 60.0)]
    time: f64,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Rounds of the method search
    #[arg(long, default_value_t = 3)]
    rounds: u32,
    /// Share of edge-adjacent cell pairs that must differ in every code, 0 to 1 [default: 0.5]
    #[arg(long)]
    min_complexity: Option<f64>,
    /// White cells that every code must have [default: the distance]
    #[arg(long)]
    black_distance: Option<u32>,
    /// Keep codes at the family's distance from the all-white tile too
    #[arg(long)]
    reject_white: bool,
    /// TOML file with min_complexity, black_distance, white_distance; options given here win
    #[arg(long)]
    rules: Option<PathBuf>,
    /// For a 36-bit lexicode: keep a checkpoint in this file, and go on from it if it is there
    #[arg(long)]
    resume: Option<PathBuf>,
    /// Number of codes at most, for the methods best and algebraic [default: as many as a file of
    /// 64 MiB holds]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    limit: Option<u64>,
    /// Name of the family, also the stem of its file [default: as the bits and distance]
    #[arg(long)]
    name: Option<String>,
    /// Folder for the file, or the file itself
    #[arg(short, long, default_value = "families")]
    output: PathBuf,
    /// Threads [default: one per processor]
    #[arg(short = 'j', long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Method {
    /// Algebraic codes, arranged and improved by local search, within --time
    Best,
    /// Algebraic codes arranged within --time, without local search
    Algebraic,
    /// Local search from nothing, up to 25 bits; the same for the same seed and rounds
    Search,
    /// The construction of the published families
    Lexicode,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let Parameters { dimension, distance } = args.family;
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let name = args.name.clone().unwrap_or_else(|| format!("d{}h{distance}", dimension.bits()));
    let path = output::file(&args.output, &name, "json");
    let family = search(&args, dimension, distance, &name)?;

    output::write(&path, family.to_json().as_bytes())?;
    println!(
        "{}: {} codes of {} bits, distance {}, fingerprint {}",
        path.display(),
        family.len(),
        dimension.bits(),
        family.distance(),
        family.fingerprint()
    );
    Ok(ExitCode::SUCCESS)
}

/// Size of a family file, roughly, at most.
const FILE_LIMIT: u64 = 64 << 20;

/// Length of a code's line: four spaces, quotes, 0x, digits, comma, line feed.
fn bytes_per_code(dimension: Dimension) -> u64 {
    u64::from(dimension.bits().div_ceil(4)) + 10
}

fn search(args: &Args, dimension: Dimension, distance: u32, name: &str) -> anyhow::Result<Family> {
    let rules = rules(args, distance)?;
    let lexicode = Lexicode { rules: rules.clone(), ..Lexicode::published(dimension, distance) };
    let (total, unit) = match args.method {
        Method::Lexicode => (lexicode.candidates, "candidates"),
        Method::Search => (u64::from(args.rounds), "rounds"),
        Method::Best | Method::Algebraic => (1000, "‰ of the time"),
    };
    let bar = progress::bar(total, unit);
    let report = |p: Progress| {
        bar.set_position(p.done);
        bar.set_message(format!("{} codes", p.codes));
    };
    let control = Control { cancel: Some(interrupt::flag()), report: Some(&report) };
    let family = match args.method {
        Method::Lexicode => {
            const LIMIT: u32 = 36;
            anyhow::ensure!(
                dimension.bits() <= LIMIT,
                "--method lexicode: 2^{} candidates are too many; use best or algebraic",
                dimension.bits()
            );
            lexicode.family_of(name, lexicode_codes(&lexicode, args.resume.as_deref(), control)?)?
        }
        Method::Search => {
            const LIMIT: u32 = 25;
            anyhow::ensure!(
                dimension.bits() <= LIMIT,
                "--method search: works up to {LIMIT} bits; use best or algebraic"
            );
            const STEPS: u64 = 200_000;
            let search = Search { seed: args.seed, rounds: args.rounds, steps: STEPS };
            let screen = Screen::new(TagWords::new(dimension), distance, &rules);
            let codes = search.codes(&screen, control)?;
            let Search { seed, rounds, steps } = search;
            let construction = Construction::Search { seed, rounds, steps };
            Family::new(name, dimension, distance, codes, rules, construction)?
        }
        Method::Best | Method::Algebraic => {
            let valid = args.time.is_finite() && args.time > 0.0 && args.time <= 1e6;
            anyhow::ensure!(valid, "--time {}: give seconds above 0, up to a million", args.time);
            let time = Duration::from_secs_f64(args.time);
            let exchange = args.method == Method::Best;
            let seed = args.seed;
            let limit = args
                .limit
                .or((dimension.bits() > 36).then(|| FILE_LIMIT / bytes_per_code(dimension)));
            Best { dimension, distance, rules, time, seed, limit, exchange }
                .family(name, control)?
        }
    };
    bar.finish_and_clear();
    Ok(family)
}

/// The rules of the published families, changed by a file, then by options.
fn rules(args: &Args, distance: u32) -> anyhow::Result<Rules> {
    let mut rules = Rules::published(distance);
    if let Some(path) = &args.rules {
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct RulesFile {
            min_complexity: Option<f64>,
            black_distance: Option<u32>,
            white_distance: Option<u32>,
        }
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let file: RulesFile = toml::from_str(&text)
            .map_err(|e| anyhow::anyhow!("{}: {}", path.display(), e.message()))?;
        rules.min_complexity = file.min_complexity.unwrap_or(rules.min_complexity);
        rules.black_distance = file.black_distance.unwrap_or(rules.black_distance);
        rules.white_distance = file.white_distance.unwrap_or(rules.white_distance);
    }
    rules.min_complexity = args.min_complexity.unwrap_or(rules.min_complexity);
    rules.black_distance = args.black_distance.unwrap_or(rules.black_distance);
    if args.reject_white {
        rules.white_distance = distance;
    }
    Ok(rules)
}

/// Runs a lexicode, with a checkpoint file if one is named; the file is removed at the end.
fn lexicode_codes(
    lexicode: &Lexicode,
    path: Option<&Path>,
    control: Control,
) -> anyhow::Result<Vec<u64>> {
    let Some(path) = path else { return Ok(lexicode.codes(control)?) };
    let mut checkpoint = Checkpoint::default();
    if path.exists() {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let saved: SavedCheckpoint = serde_json::from_str(&text).with_context(|| {
            format!("{}: not a checkpoint; remove it to start anew", path.display())
        })?;
        anyhow::ensure!(
            saved.search == format!("{lexicode:?}"),
            "{}: belongs to another search; remove it, or name another file with --resume",
            path.display()
        );
        checkpoint = saved.checkpoint;
    }
    let failed = std::sync::Mutex::new(None);
    let save = |checkpoint: &Checkpoint| {
        let saved =
            SavedCheckpoint { search: format!("{lexicode:?}"), checkpoint: checkpoint.clone() };
        let written = serde_json::to_vec(&saved)
            .map_err(anyhow::Error::from)
            .and_then(|bytes| output::write(path, &bytes));
        if let Err(error) = written {
            failed.lock().expect("no thread panics here").get_or_insert(error);
        }
    };
    let codes = lexicode.resume(&mut checkpoint, &save, control)?;
    if let Some(error) = failed.into_inner().expect("no thread panics here") {
        return Err(error);
    }
    if path.exists() {
        std::fs::remove_file(path).with_context(|| format!("cannot remove {}", path.display()))?;
    }
    Ok(codes)
}

/// A checkpoint, and of which search it is.
#[derive(serde::Serialize, serde::Deserialize)]
struct SavedCheckpoint {
    search: String,
    checkpoint: Checkpoint,
}
