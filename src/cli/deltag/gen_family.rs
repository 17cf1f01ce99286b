use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use clap::ValueEnum;

use crate::cli::{interrupt, output, progress};
use crate::family::lexicode::Lexicode;
use crate::family::{Control, Progress};
use crate::lattice::Dimension;

#[derive(clap::Args)]
pub(super) struct Args {
    /// Bits and distance, d<bits>h<distance> with 9, 16, 25, 36 or 49 bits, such as d25h7
    family: Parameters,
    /// How to search
    #[arg(long, value_enum, default_value_t = Method::Lexicode)]
    method: Method,
    /// Name of the family, also the stem of its file [default: as the bits and distance]
    #[arg(long)]
    name: Option<String>,
    /// Folder for the file, or the file itself
    #[arg(short, long, default_value = "families")]
    output: PathBuf,
    /// Threads [default: one per processor]
    #[arg(short = 'j', long)]
    threads: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Method {
    /// The construction of the published families
    Lexicode,
}

/// Bits and distance, written d25h7.
#[derive(Clone, Copy)]
struct Parameters {
    dimension: Dimension,
    distance: u32,
}

impl FromStr for Parameters {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (bits, distance) = text
            .strip_prefix('d')
            .and_then(|rest| rest.split_once('h'))
            .and_then(|(b, h)| Some((b.parse().ok()?, h.parse().ok()?)))
            .ok_or("write bits and distance such as d25h7")?;
        let dimension = Dimension::from_bits(bits).map_err(|e| e.to_string())?;
        if !(1..=bits).contains(&distance) {
            return Err(format!("the distance must be between 1 and the {bits} bits"));
        }
        Ok(Self { dimension, distance })
    }
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let Parameters { dimension, distance } = args.family;
    if let Some(threads) = args.threads {
        anyhow::ensure!(threads > 0, "--threads 0: at least one thread is needed");
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    let name = args.name.unwrap_or_else(|| format!("d{}h{distance}", dimension.bits()));
    let path = output::file(&args.output, &name, "json");

    let Method::Lexicode = args.method;
    let search = Lexicode::published(dimension, distance);
    let bar = progress::bar(search.candidates, "candidates");
    let report = |p: Progress| {
        bar.set_position(p.done);
        bar.set_message(format!("{} codes", p.codes));
    };
    let control = Control { cancel: Some(interrupt::flag()), report: Some(&report) };
    let family = search.family(&name, control)?;
    bar.finish_and_clear();

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
