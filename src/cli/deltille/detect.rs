//! `deltille detect`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::{Context, bail};
use clap::ValueEnum;
use rayon::prelude::*;

use super::refine::Method;
use super::target_file;
use crate::cli::run::{self, BAD_INPUT, FAILED};
use crate::cli::{interrupt, progress};
use crate::detect::{Detection, Detector, DetectorConfig};
use crate::export::{atomic, csv, detection, orpc, overlay};
use crate::raster;
use crate::target::{GridKind, Target};

/// Arguments of `deltille detect`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs: PNG, JPEG, TIFF, BMP, PGM or WebP
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    /// Description of the target: the .json of `deltille board`, or a .dsc
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    target: Option<PathBuf>,
    /// Find untagged boards of this tiling instead
    #[arg(long, value_name = "KIND")]
    grid: Option<Kind>,
    /// Rows of corners of the untagged board: labels boards seen whole from their lower left
    #[arg(long, conflicts_with = "target", requires = "cols", value_parser = side())]
    rows: Option<u32>,
    /// Corners in each row of the untagged board
    #[arg(long, conflicts_with = "target", requires = "rows", value_parser = side())]
    cols: Option<u32>,
    /// Family file, where the target names a family that is not shipped
    #[arg(long, conflicts_with = "grid")]
    family: Option<String>,
    /// Most bits of a tag that may be corrected [default: ⌊(h−1)/2⌋ of its family]
    #[arg(long, value_name = "BITS", conflicts_with = "grid")]
    max_errors: Option<u32>,
    /// How corners are refined
    #[arg(long, value_name = "METHOD", default_value = "model")]
    refine: Method,
    /// Folder for the results, named after the images
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    /// What to write; several may be given, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "json")]
    format: Vec<Format>,
    /// Write <image>.overlay.png too: corners, grid and ids drawn over the photograph
    #[arg(long)]
    overlay: bool,
    /// Images at a time [default: one per processor]
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// Triangles
    Deltille,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Everything, one file per image
    Json,
    /// The corner list of the reference detector
    Orpc,
    /// One corner a line, with a header
    Csv,
}

/// A range that boards have.
fn side() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(2..=500)
}

/// Detects in all images; an image that cannot be read is reported, and the rest go on.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.target.is_none() && args.grid.is_none() {
        bail!("give --target FILE, or --grid deltille for untagged boards");
    }
    let target = args.target.as_deref().map(target_file::read).transpose().context("--target")?;
    let detector = detector(&args, target.as_ref())?;
    let stems = stems(&args)?;
    fs::create_dir_all(&args.output)
        .with_context(|| format!("-o: cannot write to {}", args.output.display()))?;

    let interrupted = interrupt::flag();
    let bar = progress::bar(args.images.len() as u64, "images");
    let threads = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0).into());
    let results: Vec<anyhow::Result<String>> = threads.build()?.install(|| {
        let one = |(image, stem): (&PathBuf, &String)| {
            if interrupted.load(Ordering::Relaxed) {
                bail!("interrupted before {}", image.display());
            }
            let result = one_image(&args, target.as_ref(), &detector, image, stem);
            bar.inc(1);
            result
        };
        args.images.par_iter().zip(&stems).map(one).collect()
    });
    bar.finish_and_clear();
    if interrupted.load(Ordering::Relaxed) {
        bail!("interrupted; results of finished images are in {}", args.output.display());
    }
    report(results)
}

/// Prints a line per image, and tells from the failures how the command ends.
fn report(results: Vec<anyhow::Result<String>>) -> anyhow::Result<ExitCode> {
    let (failed, all) = (results.iter().filter(|result| result.is_err()).count(), results.len());
    for result in results {
        match result {
            Ok(line) => println!("{line}"),
            Err(error) if all == 1 => return Err(error),
            Err(error) => run::report(&error),
        }
    }
    if failed == 0 {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("error: {failed} of {all} images failed");
    Ok(ExitCode::from(if failed == all { BAD_INPUT } else { FAILED }))
}

fn detector(args: &Args, target: Option<&Target>) -> anyhow::Result<Detector> {
    let config = DetectorConfig { max_bit_errors: args.max_errors, refinement: args.refine.into() };
    let Some(target) = target else {
        return Ok(Detector::for_grid(GridKind::Deltille, args.rows.zip(args.cols), config));
    };
    let family = target_file::family(target, args.family.as_deref())?;
    if let (Some(limit), Some(family)) = (args.max_errors, &family)
        && limit > family.correctable()
    {
        bail!(
            "--max-errors: {limit} is more than the {} bits that {} can correct",
            family.correctable(),
            family.name()
        );
    }
    if target.panels.iter().any(|panel| panel.kind != GridKind::Deltille) {
        bail!("--target: {} has checkerboards, which cannot be detected yet", target.name);
    }
    Ok(Detector::for_target(target, family.as_ref(), config))
}

/// Stems of the results, one per image; no result may overwrite another or an input.
fn stems(args: &Args) -> anyhow::Result<Vec<String>> {
    let mut taken = BTreeMap::<String, &Path>::new();
    let mut stems = Vec::new();
    for image in &args.images {
        let Some(stem) = image.file_stem().map(|stem| stem.to_string_lossy().into_owned()) else {
            bail!("{} is not a file name", image.display());
        };
        if let Some(other) = taken.insert(stem.clone(), image) {
            bail!(
                "{} and {} would both write {stem}.json: detect them into different folders with -o",
                other.display(),
                image.display()
            );
        }
        let same = |path: &Path| match (path.canonicalize(), args.target.as_ref()?.canonicalize()) {
            (Ok(a), Ok(b)) => Some(a == b),
            _ => None,
        };
        let result = args.output.join(format!("{stem}.json"));
        if args.format.contains(&Format::Json) && same(&result) == Some(true) {
            bail!("{} would overwrite the target: choose another folder with -o", result.display());
        }
        stems.push(stem);
    }
    Ok(stems)
}

/// Detects in one image, writes its results, and says what was found.
fn one_image(
    args: &Args,
    target: Option<&Target>,
    detector: &Detector,
    path: &Path,
    stem: &str,
) -> anyhow::Result<String> {
    let image = raster::read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let found = detector.detect_any(&image, &name);
    let save = |extension: &str, content: &[u8]| {
        let path = args.output.join(format!("{stem}.{extension}"));
        atomic::write(&path, |out| out.write_all(content))
    };
    for format in &args.format {
        match format {
            Format::Json => save("json", detection::write(&found).as_bytes())?,
            Format::Orpc => save("orpc", orpc::write(&found, target).as_bytes())?,
            Format::Csv => save("csv", csv::write(&found).as_bytes())?,
        }
    }
    if args.overlay {
        save("overlay.png", &overlay::png(&image, &found)?)?;
    }
    Ok(summary(path, &found))
}

/// One line on what was found in an image.
fn summary(path: &Path, found: &Detection) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let corners: usize = found.grids.iter().map(|grid| grid.corners.len()).sum();
    let tags: usize = found.grids.iter().map(|grid| grid.tags.len()).sum();
    let mut line = format!(
        "{}: {}, {}",
        path.display(),
        count(found.grids.len(), "grid"),
        count(corners, "corner")
    );
    if tags > 0 {
        line += &format!(", {}", count(tags, "tag"));
    }
    line
}
