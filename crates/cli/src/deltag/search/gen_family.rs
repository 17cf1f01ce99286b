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
use crate::output::{self, Overwrite, say, tell};
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

/// Told at the end of `--help`.
pub const HELP: &str = "Ctrl-C ends a search early. The methods best and algebraic write \
    the best family so far (exit code 0). The method search writes what its finished rounds found, \
    and lexicode nothing (exit code 130). With --resume the same command goes on later, and finds \
    exactly what it would have found without a break, except by --time, of which it has what is \
    left. Where nothing was found yet, nothing is written (130). A second Ctrl-C ends the program \
    at once.";

/// Told of `--force`.
pub const FORCE: &str = "Replace a family file also by one with fewer codes, other bits or \
    another distance, and a file of another kind";

#[derive(clap::Args)]
pub struct Args {
    /// Bits and distance, d<bits>h<distance> with 9, 16, 25, 36, 49 or 64 bits, such as d25h7
    family: Parameters,
    /// How to search
    #[arg(long, value_enum, default_value_t = Method::Best)]
    method: Method,
    /// Seconds for the methods best and algebraic, more find larger families [default: 60]; search
    /// begins no round after them
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true,
          value_parser = number(0.001..=1e6))]
    time: Option<f64>,
    /// Steps of work for the methods best and algebraic instead of a time: the same seed gives the
    /// same codes on every machine
    #[arg(long, value_name = "STEPS", conflicts_with = "time", allow_negative_numbers = true,
          value_parser = whole(1..=1_000_000u32))]
    work: Option<u32>,
    /// For the methods best and algebraic: do not start from the family that ships, but search from
    /// nothing
    #[arg(long)]
    from_nothing: bool,
    /// For the methods best and algebraic: no search, but what is on record as far as it satisfies the
    /// rules, after the codes of this family, which keep their ids
    #[arg(long, value_name = "FAMILY", conflicts_with_all = ["time", "work", "from_nothing", "seed"])]
    extend: Option<String>,
    /// Seed of the random choices of best, algebraic and search [default: 1]
    #[arg(long, allow_negative_numbers = true, value_parser = whole(0..=u64::MAX))]
    seed: Option<u64>,
    /// Rounds of the method search, at most [default: 3; with --time as many as it gives]
    #[arg(long, allow_negative_numbers = true, value_parser = whole(1..=1_000_000u32))]
    rounds: Option<u32>,
    /// Number of codes at most, for the methods best and algebraic [default: as many as a file of
    /// 64 MiB holds, of 49 and 64 bits with --robust-to 20,000]
    #[arg(long, value_name = "CODES", allow_negative_numbers = true,
          value_parser = whole(1..=u64::MAX))]
    limit: Option<u64>,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// Keep a checkpoint in this file, and go on from it if it is there; removed at the end
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Name of the family, also the stem of its file [default: as the bits and distance]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    /// Folder for the file, or the file itself
    #[arg(short, long, default_value = "families")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Threads [default: one per processor]
    #[arg(short = 'j', long, value_name = "N", allow_negative_numbers = true,
          value_parser = whole(1..=1024u16))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Method {
    /// The best codes on record and others, arranged and improved by local search, within --time
    Best,
    /// Algebraic codes arranged within --time, without local search
    Algebraic,
    /// Local search from nothing, up to 25 bits; the same for the same seed and rounds
    Search,
    /// The construction of the published families, up to 36 bits
    Lexicode,
}

impl Method {
    /// The name as it is typed.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

/// What became of a search.
struct Outcome {
    /// The codes, if there are any to be written.
    family: Option<Family>,
    /// What to say of an interruption.
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

    /// What became of a search with checkpoints that ended before it found anything.
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
    interrupt::stands("nothing was found yet, and nothing was written");
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
        // What took hours is not lost, and neither is what was there.
        if let Some(there) =
            there(&path).filter(|f| !args.overwrite.is_forced() && f.len() > family.len())
        {
            let beside = free_name(&path);
            tell!(
                "error: {} keeps its {} codes, more than these {}, which go to {}; --force replaces \
                 it, -o names another place",
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
        Some(message) => tell!("interrupted: {message}"),
        None => file.finish()?,
    }
    if let Some(family) = family.as_ref().filter(|f| !is_whole && f.len() > PAIRS_COUNTED) {
        say!(
            "{}: {} of {} bits, which `deltag verify-family` proves; fingerprint {}",
            path.display(),
            counted(family.len(), "code"),
            dimension.bits(),
            family.fingerprint()
        );
    } else if let Some(family) = family {
        let certificate = certify_codes(&family);
        ensure!(certificate.holds(), "{}: {}", path.display(), certificate.failures.join("; "));
        say!(
            "{}: {} of {} bits; {}; fingerprint {}",
            path.display(),
            counted(family.len(), "code"),
            dimension.bits(),
            proof_of(&certificate, distance),
            family.fingerprint()
        );
    }
    Ok(exit)
}

/// The codes on record after those of an older family.
fn extended_by(
    name: &str,
    best: &Best,
    start: Option<&Start>,
    older: &str,
) -> anyhow::Result<Family> {
    let older = resolve(older).context("--extend")?;
    let Some(start) = start else { bail!("--extend: nothing is on record to extend with") };
    match best.family_of(name, start)?.extending(&older) {
        Err(FamilyError::Field { problem, .. }) => {
            bail!("--extend: {problem}; their ids could not stay")
        }
        extended => Ok(extended?),
    }
}

/// The family that a file holds, if it holds one.
fn there(path: &Path) -> Option<Family> {
    path.exists().then(|| family::read(path).ok()).flatten()
}

/// A name beside that of a file, with a number, that nothing has yet.
fn free_name(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = (2u32..).map(|n| path.with_file_name(format!("{stem}-{n}.json")));
    numbered.into_iter().find(|path| !path.exists()).unwrap_or_else(|| path.to_owned())
}

/// Size of a family file at most: 64 MiB, of which a little is for what is not codes.
pub const FILE_LIMIT: u64 = (64 << 20) - (64 << 10);

/// Codes of 49 and 64 bits that are listed where cells may be hidden.
const ROBUST_LIMIT: u64 = 20_000;

/// Length of a code's line: four spaces, quotes, 0x, digits, comma, line feed.
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

    /// Refuses to lose a file of other tags, or one that is no family file at all.
    fn check_replaced(&self, path: &Path) -> anyhow::Result<()> {
        // Before the hours that a search takes.
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
                "-o: {file} holds {} codes of {} bits, distance {}; --force replaces it, --name \
                 gives another name",
                family.len(),
                family.dimension().bits(),
                family.distance()
            ),
            None => bail!("-o: {file} is no family file; --force replaces it"),
        }
    }

    /// The rules asked for; with `--false-positives` that for complexity is the best for the construction on record.
    fn chosen_rules(&self) -> anyhow::Result<Rules> {
        let rules = self.rules.rules(self.family)?;
        if self.choice.false_positives.is_none() {
            return Ok(rules);
        }
        ensure!(
            !self.rules.has_complexity(),
            "--false-positives: chooses the complexity; leave --min-complexity out"
        );
        ensure!(
            !self.rules.has_free_cells(),
            "--false-positives: is about tags without free cells; leave --free out, or choose with --min-complexity"
        );
        let distance = self.family.distance;
        let choices = frontier::choices(self.family, &rules)?;
        let Some(best) = self.choice.best(&choices, distance)? else { return Ok(rules) };
        let corrected = self.choice.corrected(distance)?;
        tell!(
            "rule: {} pairs of cells differ at least, which {} of the codes on record satisfy; natural false positives {:.1e} with \
             {corrected} corrected",
            best.min_pairs,
            best.codes,
            best.natural[corrected as usize]
        );
        Ok(Rules { min_complexity: best.min_complexity, ..rules })
    }

    /// Refuses what the method would ignore or cannot do.
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
                "{option}: does nothing with --method {}, only with {others}{}; leave it out",
                method.name(),
                last.name()
            )
        };
        refuse("--time", self.time.is_some(), &[Algebraic, Best, Search])?;
        refuse("--work", self.work.is_some(), &[Algebraic, Best])?;
        refuse("--from-nothing", self.from_nothing, &[Algebraic, Best])?;
        refuse("--extend", self.extend.is_some(), &[Algebraic, Best])?;
        refuse("--false-positives", self.choice.false_positives.is_some(), &[Algebraic, Best])?;
        refuse("--limit", self.limit.is_some(), &[Algebraic, Best])?;
        refuse("--rounds", self.rounds.is_some(), &[Search])?;
        ensure!(
            self.seed.is_none() || method != Lexicode,
            "--seed: a lexicode has no random choices; leave it out"
        );
        let bits = self.family.dimension.bits();
        ensure!(
            !(method == Lexicode && bits > 25 && self.rules.is_robust()),
            "--robust-to: a lexicode takes it up to 25 bits, not with {bits}; use --method best"
        );
        let limit = match method {
            Search => 25,
            Lexicode => 36,
            Best | Algebraic => bits,
        };
        ensure!(
            bits <= limit,
            "--method {}: works up to {limit} bits, not with {bits}; use best or algebraic",
            method.name()
        );
        Ok(())
    }

    /// All that decides what a search with checkpoints finds.
    fn identity(&self, rules: &Rules) -> String {
        let Parameters { dimension, distance } = self.family;
        let seed = match self.method {
            Method::Lexicode => String::new(),
            _ => format!(", seed {}", self.seed()),
        };
        let from = if self.from_nothing { ", from nothing" } else { "" };
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
            "--rounds: the checkpoint of --resume has {} rounds already",
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
                    "kept what {rounds} of {} rounds found; {}",
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
        // With hidden cells every code is compared with all that were taken before.
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
                "--work: the checkpoint of --resume has {} steps already",
                checkpoint.legs_done
            );
        }
        let start = if self.from_nothing { None } else { best.start() };
        let extended = self.extend.as_deref();
        let extended = extended.map(|older| extended_by(name, &best, start.as_ref(), older));
        let extended = extended.transpose()?;
        if checkpoint.construction.is_some() {
            tell!("goes on from {} of the checkpoint", counted(checkpoint.codes.len(), "code"));
        } else if let Some(start) = &start {
            let codes = best.family_of(name, start)?;
            let proof = proof_of(&certify_codes(&codes), distance);
            tell!("starts from {} of {}: {proof}", counted(codes.len(), "code"), start.family);
        }
        if let Some(family) = extended {
            return Ok(Outcome::whole(family));
        }
        interrupt::keeps_results();
        match best.resume(name, start, &mut checkpoint, &|c| file.save(c), control) {
            Ok(family) if stopped() => Ok(Outcome {
                family: Some(family),
                interrupted: Some(format!("kept the best family so far; {}", file.advice())),
                exit: ExitCode::SUCCESS,
            }),
            Ok(family) => Ok(Outcome::whole(family)),
            Err(FamilyError::Cancelled) if stopped() => {
                let message = "nothing was found yet, and nothing was written".to_owned();
                Ok(Outcome::interrupted(None, message))
            }
            // The time was over before there was a code.
            Err(FamilyError::Cancelled) => Err(self.none_found()),
            // The name and the rules were checked before: it is the codes that are missing.
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
            "no word of {} bits was found that satisfies the rules at distance {distance}; take a \
             smaller distance, or loosen the rules, such as with --min-complexity",
            dimension.bits()
        )
    }
}
