//! `deltag gen-family`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;

use super::checkpoint::CheckpointFile;
use super::frontier::{self, ChoiceArgs};
use super::parameters::Parameters;
use super::rules::RuleArgs;
use crate::deltag::about::verify_family::proof_of;
use crate::deltag::named::resolve;
use crate::interrupt;
use crate::output::{self, Overwrite, log, say};
use crate::progress::SearchProgress;
use crate::run::FAILED;
use crate::values::{name, number, whole};
use deltille::clock;
use deltille::export::kind::Kind;
use deltille::family::lexicode::{self, Lexicode};
use deltille::family::search::best::{self, Best, Budget, Start};
use deltille::family::search::{self, Search};
use deltille::family::{
    self, Control, Family, FamilyError, PAIRS_COUNTED, Progress, Rules, Screen, TagWords,
    certify_codes, check_name,
};
use deltille::lattice::Dimension;
use deltille_core::words::counted;

/// Text at the end of `--help`.
pub const HELP: &str = "Ctrl-C ends a search early. The methods best and algebraic then write the best family so far \
    (exit code 0). The method search writes the result of its finished rounds, and lexicode writes \
    nothing (both with exit code 130). With --resume, running the same command again continues \
    the search and gives the same result as an uninterrupted run; \
    with --time, it uses the remaining time. If nothing has been found yet, nothing is written \
    (130). A second Ctrl-C ends the program immediately.";

/// Help text of `--force`.
pub const FORCE: &str = "Also overwrite a family file that has more codes, a different number of bits or a \
    different distance, and existing files of any other type";

#[derive(clap::Args)]
pub struct Args {
    /// Bits and distance as d<bits>h<distance>, with 9, 16, 25, 36, 49 or 64 bits, such as d25h7
    family: Parameters,
    /// Search method
    #[arg(long, value_enum, default_value_t = Method::Best)]
    method: Method,
    /// Time limit in seconds, for best, algebraic and search; longer searches can find larger
    /// families. The method `search` starts no new round after this time [default: 60 for best and
    /// algebraic, unlimited for search]
    #[arg(long, value_name = "SECONDS",
          value_parser = number(0.001..=1e6))]
    time: Option<f64>,
    /// Number of work steps for best and algebraic, instead of a time limit: the same seed gives the same codes on
    /// every machine
    #[arg(long, value_name = "STEPS", conflicts_with = "time",
          value_parser = whole(1..=1_000_000u32))]
    work: Option<u32>,
    /// Start from an empty family instead of the shipped one (methods best and algebraic)
    #[arg(long, alias = "from-nothing")]
    from_scratch: bool,
    /// Extend this family without a search: keep its codes and ids, and append the known codes that satisfy the rules
    /// (methods best and algebraic)
    #[arg(long, value_name = "FAMILY", conflicts_with_all = ["time", "work", "from_scratch", "seed"])]
    extend: Option<String>,
    /// Seed of the random number generator of best, algebraic and search [default: 1]
    #[arg(long, value_parser = whole(0..=u64::MAX))]
    seed: Option<u64>,
    /// Maximum number of rounds with --method search [default: 3, or unlimited with --time]
    #[arg(long, value_parser = whole(1..=1_000_000u32))]
    rounds: Option<u32>,
    /// Maximum number of codes, for best and algebraic [default: as many as fit in a file of 64
    /// MiB; 20,000 for 49 and 64 bits with --robust-to]
    #[arg(long, value_name = "CODES",
          value_parser = whole(1..=u64::MAX))]
    limit: Option<u64>,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// Save checkpoints to this file, and resume from it if it exists; removed at the end
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Name of the family, also the stem of its file [default: derived from the bits and distance]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    /// Output folder or file
    #[arg(short, long, default_value = "families")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Number of threads [default: one per processor]
    #[arg(short = 'j', long, value_name = "N",
          value_parser = whole(1..=1024u16))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Method {
    /// Known and newly constructed codes, rearranged and improved by local search within --time
    Best,
    /// Algebraic codes; only the assignment of code positions to cells is optimised, within --time
    Algebraic,
    /// Local search from an empty family, up to 25 bits; reproducible for the same seed and number
    /// of rounds
    Search,
    /// Construction of the published families, up to 36 bits
    Lexicode,
}

impl Method {
    /// Returns the name as typed on the command line.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

/// Result of a search.
struct Outcome {
    /// The codes, if any are to be written.
    family: Option<Family>,
    /// Message about an interruption.
    interrupted: Option<String>,
    exit: ExitCode,
}

impl Outcome {
    fn whole(family: Family) -> Self {
        Self { family: Some(family), interrupted: None, exit: ExitCode::SUCCESS }
    }

    fn interrupted(family: Option<Family>, message: String) -> Self {
        Self { family, interrupted: Some(message), exit: ExitCode::from(interrupt::exit_code()) }
    }

    /// Creates the result of a search with checkpoints that ended without any codes.
    fn nothing(error: FamilyError, file: &CheckpointFile) -> anyhow::Result<Self> {
        match error {
            FamilyError::Cancelled => {
                let message = format!("no family was written; {}", file.advice());
                Ok(Self::interrupted(None, message))
            }
            error => Err(error.into()),
        }
    }
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    args.check_options()?;
    let Parameters { dimension, distance } = args.family;
    let name = args.name.clone().unwrap_or_else(|| format!("d{}h{distance}", dimension.bits()));
    let path = output::file(&args.output, &name, "json")?;
    interrupt::set_status("no codes were found; nothing was written");
    if let Err(FamilyError::Claim { problem, .. }) = check_name(&name, dimension, distance) {
        bail!("--name: {problem}");
    }
    let rules = args.chosen_rules()?;
    args.check_replaced(&path)?;
    output::check_writable("-o", &path)?;
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let (total, unit) = match args.method {
        Method::Lexicode => (dimension.mask() + 1, "candidates"),
        Method::Search => (u64::from(args.rounds()), "rounds"),
        Method::Best | Method::Algebraic => (1000, ""),
    };
    let shown = SearchProgress::new(total, unit);
    let report = |progress: Progress| shown.show(progress);
    let control = Control::default().cancel(interrupt::flag()).report(&report);
    let file = CheckpointFile::new(args.resume.as_deref(), args.identity(&rules));
    let outcome = match args.method {
        Method::Lexicode => args.lexicode(&name, rules, &file, control),
        Method::Search => args.search(&name, rules, &file, control),
        Method::Best | Method::Algebraic => args.best(&name, rules, &file, control),
    };
    shown.end();
    let Outcome { family, interrupted, mut exit } = outcome?;

    let mut path = path;
    if let Some(family) = &family {
        // Keeps both the existing file and the result of a long search.
        if let Some(there) =
            there(&path).filter(|f| !args.overwrite.is_forced() && f.len() > family.len())
        {
            let beside = free_name(&path);
            log!(
                "error: {} was kept, because its {} codes are more than the {} found, which were written to {}; use \
                 --force to replace it, or -o to set another path",
                path.display(),
                there.len(),
                family.len(),
                beside.display()
            );
            path = beside;
            exit = ExitCode::from(FAILED);
        }
        output::write(&path, family.to_json().as_bytes(), args.overwrite)?;
    }
    let is_whole = interrupted.is_none();
    match interrupted {
        Some(message) => log!("interrupted: {message}"),
        None => file.finish()?,
    }
    if let Some(family) = &family {
        describe(family, &path, distance, is_whole)?;
    }
    Ok(exit)
}

/// Prints the properties of a written family, certified unless it is large and its search was interrupted.
fn describe(family: &Family, path: &Path, distance: u32, is_whole: bool) -> anyhow::Result<()> {
    let proof = if is_whole || family.len() <= PAIRS_COUNTED {
        let certificate = certify_codes(family);
        ensure!(certificate.is_valid(), "{}: {}", path.display(), certificate.failures.join("; "));
        proof_of(&certificate, distance)
    } else {
        "verify with `deltag verify-family`".to_owned()
    };
    say!(
        "{}: {} of {} bits; {proof}; fingerprint {}",
        path.display(),
        counted(family.len(), "code"),
        family.dimension().bits(),
        family.fingerprint()
    );
    let shipped = Family::shipped(family.name());
    if is_whole && shipped.is_ok_and(|shipped| shipped.fingerprint() == family.fingerprint()) {
        log!("note: the same codes ship with the program as {}", family.name());
    }
    Ok(())
}

/// Appends the known codes to those of an older family.
fn extended_by(
    name: &str,
    best: &Best,
    start: Option<&Start>,
    older: &str,
) -> anyhow::Result<Family> {
    let older = resolve(older).context("--extend")?;
    let Some(start) = start else { bail!("--extend: no known codes to extend the family with") };
    match best.family_of(name, start)?.extending(&older) {
        Err(FamilyError::Field { problem, .. }) => {
            bail!("--extend: {problem}, so the ids could not be kept")
        }
        extended => Ok(extended?),
    }
}

/// Reads the family in a file, if it contains one.
fn there(path: &Path) -> Option<Family> {
    path.exists().then(|| family::read(path).ok()).flatten()
}

/// Returns an unused path beside a file, made unique by a number.
fn free_name(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = (2u32..).map(|n| path.with_file_name(format!("{stem}-{n}.json")));
    numbered.into_iter().find(|path| !path.exists()).unwrap_or_else(|| path.to_owned())
}

/// Largest size of the codes in a family file: 64 MiB, less 64 KiB for everything else.
pub const FILE_LIMIT: u64 = (64 << 20) - (64 << 10);

/// Largest number of codes of 49 and 64 bits that are listed if cells may be hidden.
const ROBUST_LIMIT: u64 = 20_000;

/// Length of a code's line: four spaces, quotes, 0x, digits, comma and line feed.
pub fn bytes_per_code(dimension: Dimension) -> u64 {
    u64::from(dimension.bits().div_ceil(4)) + 10
}

impl Args {
    fn rounds(&self) -> u32 {
        self.rounds.unwrap_or(if self.time.is_some() { 1_000_000 } else { 3 })
    }

    fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    /// Refuses to replace a file of other tags, or one that is not a family file.
    fn check_replaced(&self, path: &Path) -> anyhow::Result<()> {
        // Checked before a search that may take hours.
        self.overwrite.check(path, &Kind::of_schema(family::SCHEMA))?;
        if self.overwrite.is_forced() || !path.exists() {
            return Ok(());
        }
        let Parameters { dimension, distance } = self.family;
        let file = path.display();
        match there(path) {
            Some(family) if family.dimension() == dimension && family.distance() == distance => {
                Ok(())
            }
            Some(family) => bail!(
                "-o: {file} contains {} codes of {} bits, distance {}; use --force to replace it, or --name to set \
                 another name",
                family.len(),
                family.dimension().bits(),
                family.distance()
            ),
            None => bail!("-o: {file} is not a family file; use --force to replace it"),
        }
    }

    /// Returns the rules; with `--false-positives`, the complexity rule is the best one for the known construction.
    fn chosen_rules(&self) -> anyhow::Result<Rules> {
        let rules = self.rules.rules(self.family)?;
        if self.choice.false_positives.is_none() {
            return Ok(rules);
        }
        ensure!(
            !self.rules.has_complexity(),
            "--false-positives sets the complexity; remove --min-complexity"
        );
        ensure!(
            !self.rules.has_free_cells(),
            "--false-positives does not support free cells; remove --free, or use --min-complexity"
        );
        let distance = self.family.distance;
        let choices = frontier::choices(self.family, &rules)?;
        let Some(best) = self.choice.best(&choices, distance)? else { return Ok(rules) };
        let corrected = self.choice.corrected(distance)?;
        log!(
            "rule: at least {} pairs of cells differ, satisfied by {} of the known codes; natural false-positive rate {:.1e} with \
             {corrected} corrected",
            best.min_pairs,
            best.codes,
            best.natural[corrected as usize]
        );
        Ok(Rules { min_complexity: best.min_complexity, ..rules })
    }

    /// Rejects options that the method ignores or does not support.
    fn check_options(&self) -> anyhow::Result<()> {
        use Method::{Algebraic, Best, Lexicode, Search};
        let method = self.method;
        let refuse = |option: &str, given: bool, methods: &[Method]| {
            if !given || methods.contains(&method) {
                return Ok(());
            }
            let [last, others @ ..] = methods else { return Ok(()) };
            let others: String = others.iter().map(|m| m.name() + " and ").collect();
            bail!(
                "{option} has no effect with --method {}, only with {others}{}; remove it",
                method.name(),
                last.name()
            )
        };
        refuse("--time", self.time.is_some(), &[Algebraic, Best, Search])?;
        refuse("--work", self.work.is_some(), &[Algebraic, Best])?;
        refuse("--from-scratch", self.from_scratch, &[Algebraic, Best])?;
        refuse("--extend", self.extend.is_some(), &[Algebraic, Best])?;
        refuse("--false-positives", self.choice.false_positives.is_some(), &[Algebraic, Best])?;
        refuse("--limit", self.limit.is_some(), &[Algebraic, Best])?;
        refuse("--rounds", self.rounds.is_some(), &[Search])?;
        ensure!(
            self.seed.is_none() || method != Lexicode,
            "--seed has no effect on a lexicode; remove it"
        );
        let bits = self.family.dimension.bits();
        ensure!(
            !(method == Lexicode && bits > 25 && self.rules.is_robust()),
            "--robust-to: lexicodes support it up to 25 bits, not with {bits}; use --method best"
        );
        let limit = match method {
            Search => 25,
            Lexicode => 36,
            Best | Algebraic => bits,
        };
        ensure!(
            bits <= limit,
            "--method {} supports up to {limit} bits, not {bits}; use best or algebraic",
            method.name()
        );
        Ok(())
    }

    /// Returns every setting that affects the result of a search with checkpoints.
    fn identity(&self, rules: &Rules) -> String {
        let Parameters { dimension, distance } = self.family;
        let seed = match self.method {
            Method::Lexicode => String::new(),
            _ => format!(", seed {}", self.seed()),
        };
        let from = if self.from_scratch { ", from nothing" } else { "" };
        let counted = if self.work.is_some() { ", by work" } else { "" };
        let limit = self.limit.map(|limit| format!(", limit {limit}")).unwrap_or_default();
        let Rules { min_complexity, black_distance, white_distance, robust, free } = rules;
        let robust: String = robust.iter().map(|robust| format!(", robust to {robust}")).collect();
        let free = free.map_or(String::new(), |free| format!(", {} free", free.name()));
        format!(
            "{:?} d{}h{distance}, complexity {min_complexity}, black {black_distance}, \
             white {white_distance}{robust}{free}{seed}{from}{counted}{limit}",
            self.method,
            dimension.bits()
        )
    }

    fn lexicode(
        &self,
        name: &str,
        rules: Rules,
        file: &CheckpointFile,
        control: Control,
    ) -> anyhow::Result<Outcome> {
        let Parameters { dimension, distance } = self.family;
        let lexicode = Lexicode::published(dimension, distance).rules(rules);
        let mut checkpoint: lexicode::Checkpoint = file.load()?;
        interrupt::keeps_results();
        match lexicode.resume(&mut checkpoint, &|c| file.save(c), control) {
            Ok(codes) => {
                self.check_found(codes.len())?;
                Ok(Outcome::whole(lexicode.family_of(name, codes)?))
            }
            Err(error) => Outcome::nothing(error, file),
        }
    }

    fn search(
        &self,
        name: &str,
        rules: Rules,
        file: &CheckpointFile,
        control: Control,
    ) -> anyhow::Result<Outcome> {
        let Parameters { dimension, distance } = self.family;
        let search = Search::new(self.seed(), self.rounds());
        let screen = Screen::new(TagWords::new(dimension), distance, &rules);
        let mut checkpoint: search::Checkpoint = file.load()?;
        ensure!(
            checkpoint.rounds_done <= search.rounds,
            "--rounds: the checkpoint of --resume already has {} rounds",
            checkpoint.rounds_done
        );
        let start = Instant::now();
        let save = |c: &search::Checkpoint| {
            file.save(c);
            self.time.is_none_or(|time| start.elapsed().as_secs_f64() < time)
        };
        interrupt::keeps_results();
        let ended = search.resume(&screen, &mut checkpoint, &save, control);
        let rounds = checkpoint.rounds_done;
        let family = || {
            let codes = checkpoint.family_codes(&screen);
            Family::new(name, dimension, distance, codes, rules, search.construction(rounds))
        };
        match ended {
            Ok(()) => {
                self.check_found(checkpoint.codes.len())?;
                Ok(Outcome::whole(family()?))
            }
            Err(FamilyError::Cancelled) if !checkpoint.codes.is_empty() => {
                let message = format!(
                    "wrote the result of {rounds} of {} rounds; {}",
                    search.rounds,
                    file.advice()
                );
                Ok(Outcome::interrupted(Some(family()?), message))
            }
            Err(error) => Outcome::nothing(error, file),
        }
    }

    fn best(
        &self,
        name: &str,
        rules: Rules,
        file: &CheckpointFile,
        control: Control,
    ) -> anyhow::Result<Outcome> {
        let Parameters { dimension, distance } = self.family;
        // With hidden cells, every code is compared with all previous ones.
        let most = match rules.robust.as_slice() {
            [] => FILE_LIMIT / bytes_per_code(dimension),
            _ => ROBUST_LIMIT,
        };
        let limit = self.limit.or((dimension.bits() > 36).then_some(most));
        let budget = match self.work {
            Some(steps) => Budget::Work(steps),
            None => Budget::Time(Duration::from_secs_f64(self.time.unwrap_or(60.0)), clock::now),
        };
        let best = Best::new(dimension, distance, budget).rules(rules).seed(self.seed());
        let best = best.limit(limit).exchange(self.method == Method::Best);
        let stopped = || interrupt::flag().load(Ordering::Relaxed);
        let mut checkpoint: best::Checkpoint = file.load()?;
        if let Some(steps) = self.work {
            ensure!(
                checkpoint.legs_done <= steps,
                "--work: the checkpoint of --resume already has {} steps",
                checkpoint.legs_done
            );
        }
        let start = if self.from_scratch { None } else { best.start() };
        let extended = self.extend.as_deref();
        let extended = extended.map(|older| extended_by(name, &best, start.as_ref(), older));
        let extended = extended.transpose()?;
        if checkpoint.construction.is_some() {
            log!("resuming from {} of the checkpoint", counted(checkpoint.codes.len(), "code"));
        } else if let Some(start) = &start {
            let codes = best.family_of(name, start)?;
            let proof = proof_of(&certify_codes(&codes), distance);
            log!("starting from {} of {}: {proof}", counted(codes.len(), "code"), start.family);
        }
        if let Some(family) = extended {
            return Ok(Outcome::whole(family));
        }
        interrupt::keeps_results();
        match best.resume(name, start, &mut checkpoint, &|c| file.save(c), control) {
            Ok(family) if stopped() => Ok(Outcome {
                family: Some(family),
                interrupted: Some(format!("wrote the best family so far; {}", file.advice())),
                exit: ExitCode::SUCCESS,
            }),
            Ok(family) => Ok(Outcome::whole(family)),
            Err(FamilyError::Cancelled) if stopped() => {
                let message = "no codes were found; nothing was written".to_owned();
                Ok(Outcome::interrupted(None, message))
            }
            // The time limit passed before the first code was found.
            Err(FamilyError::Cancelled) => Err(self.none_found()),
            // The name and the rules have been checked, so the codes are missing.
            Err(FamilyError::Field { field, .. }) if field == "codes" => Err(self.none_found()),
            Err(error) => Err(error.into()),
        }
    }

    fn check_found(&self, codes: usize) -> anyhow::Result<()> {
        if codes == 0 { Err(self.none_found()) } else { Ok(()) }
    }

    fn none_found(&self) -> anyhow::Error {
        let Parameters { dimension, distance } = self.family;
        anyhow::anyhow!(
            "no word of {} bits satisfies the rules at distance {distance}; use a smaller distance, or relax the \
             rules (for example with --min-complexity)",
            dimension.bits()
        )
    }
}
