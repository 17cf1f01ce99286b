use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, anyhow};
use clap::ValueEnum;

use crate::output::{self, Overwrite, say};
use crate::values::{name, whole};
use deltille::family::{ImportSpec, import};
use deltille::lattice::GridKind;
use deltille::limits::{MAX_FAMILY_BYTES, read_short_text};
use deltille_core::words::counted;

/// Text at the end of `--help`.
pub const HELP: &str = "The codes are the hexadecimal literals of the table, in order; \
    in a table without literals, the lines that contain only hexadecimal digits. \
    Bits are read row by row from the upper left, in triangles from the \
    apex; AprilTag 3 tables define their own bit positions. \
    The distance is computed by comparing all codes.

Examples:
  deltag import tag36h11.c -o families
  deltag import codes.txt --shape square --bits 36 --name mine
  deltag import mine.py --shape triangle --distance 7";

#[derive(clap::Args)]
pub struct Args {
    /// Table of codes: C, Rust or Python source, or text with one code per line
    table: PathBuf,
    /// Shape of the tags; AprilTag 3 tables define it
    #[arg(long, value_enum)]
    shape: Option<Shape>,
    /// Number of cells of a tag: 9, 16, 25, 36, 49 or 64; not needed for tables with nbits or BITS
    #[arg(long, value_parser = whole(1..=64u32))]
    bits: Option<u32>,
    /// Declared distance between tags, at most the actual one [default: the actual distance]
    #[arg(long, value_parser = whole(1..=64u32))]
    distance: Option<u32>,
    /// Name of the family [default: the stem of the table's file name]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    /// Output folder or file
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

#[derive(Clone, Copy, ValueEnum)]
enum Shape {
    /// DelTags; distances include rotations by 120°
    Triangle,
    /// AprilTags and ArUco markers; distances include rotations by 90°
    Square,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let text = read_short_text(&args.table, MAX_FAMILY_BYTES)?;
    let of_file = |part: Option<&std::ffi::OsStr>| {
        part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let name = match args.name {
        Some(given) => given,
        None => name(&of_file(args.table.file_stem())).map_err(|problem| {
            anyhow!("{}: {problem}; set another name with --name", args.table.display())
        })?,
    };
    let spec = ImportSpec {
        name,
        source: format!("imported from {}", of_file(args.table.file_name())),
        kind: args.shape.map(|shape| match shape {
            Shape::Triangle => GridKind::Deltille,
            Shape::Square => GridKind::Checker,
        }),
        bits: args.bits,
        distance: args.distance,
    };
    let family = import(&text, &spec).with_context(|| args.table.display().to_string())?;
    let path = output::file(&args.output, family.name(), "json")?;
    output::write(&path, family.to_json().as_bytes(), args.overwrite).context("-o")?;
    say!(
        "{}: {} of {} bits, distance {}, corrects {}, fingerprint {}",
        family.name(),
        counted(family.len(), "code"),
        family.dimension().bits(),
        family.distance(),
        family.correctable(),
        family.fingerprint()
    );
    say!("{}", path.display());
    Ok(ExitCode::SUCCESS)
}
