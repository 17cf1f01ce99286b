//! `deltag sheet`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::deltag::named::resolve;
use crate::deltille::files::written::{Formats, drawn, write_all};
use crate::interrupt;
use crate::output::{self, Overwrite, Place, named_by, report, request, say};
use crate::run::{FAILED, Interrupted};
use crate::values::{Ids, name, whole};
use deltille::layout::{DEFAULT_MARGIN_MM, PaperSize, PaperSpec, Printing};
use deltille::limits::Limits;
use deltille::targets::{TagSheetSpec, TargetSpec, parse_length_mm};
use deltille::verify::{Verifier, VerifyError};

/// Largest number of pages; more are probably a mistake.
const MAX_PAGES: usize = 200;

#[derive(clap::Args)]
pub struct Args {
    /// A name from `deltag list`, or a family file
    family: String,
    /// Tags to print: ids and ranges such as 0-99 or 3,7,20-25 [default: all]
    #[arg(long, allow_hyphen_values = true)]
    ids: Option<Ids>,
    /// Edge length of a tag, such as 30mm or 1.5in
    #[arg(long, value_name = "LENGTH", default_value = "30mm", allow_hyphen_values = true)]
    edge: String,
    /// Width of a tag's black border in cells, as on boards
    #[arg(long, value_name = "BITS", default_value_t = 1.5,
          value_parser = crate::values::number(0.6..=10.0))]
    tag_border: f64,
    /// Paper size
    #[arg(long, help = format!("Paper: {}", PaperSize::choice()), default_value = "A4", allow_hyphen_values = true)]
    paper: String,
    /// Page orientation: auto (fits the most tags), portrait or landscape
    #[arg(long, default_value = "auto")]
    orientation: String,
    /// Blank margin along the edges of the paper [default: 5mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    margin: Option<String>,
    /// Write a PDF of all pages (default unless --svg or --png is given)
    #[arg(long)]
    pdf: bool,
    /// Write an SVG of each page
    #[arg(long)]
    svg: bool,
    /// Write a PNG of each page
    #[arg(long)]
    png: bool,
    /// Resolution of the PNG, dots per inch [default: 300]
    #[arg(long, value_parser = whole(150..=2400u32))]
    dpi: Option<u32>,
    /// Output folder, or a file: its ending selects the format
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    /// Stem of the file names [default: the family's name followed by -sheet]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Do not read the files back to verify every cell
    #[arg(long)]
    no_verify: bool,
}

/// Lays out the tags, writes the pages, and verifies them.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = resolve(&args.family)?;
    let length =
        |option: &'static str, text: &str| parse_length_mm(text).with_context(|| option.to_owned());
    let paper = PaperSpec {
        size: Some(args.paper.parse().context("--paper")?),
        orientation: args.orientation.parse().context("--orientation")?,
        margin_mm: match &args.margin {
            Some(text) => length("--margin", text)?,
            None => DEFAULT_MARGIN_MM,
        },
        ..PaperSpec::default()
    };
    let Place { folder, file } = output::place(&args.output, &["pdf", "svg", "png"])?;
    let (mut named, mut pdf, mut svg, mut png) = (args.name, args.pdf, args.svg, args.png);
    let ending = named_by(&mut named, file)?;
    request(&ending, [("pdf", &mut pdf), ("svg", &mut svg), ("png", &mut png)]);
    ensure!(args.dpi.is_none() || png, "--dpi needs --png");
    if let Some(ids) = &args.ids {
        ids.check(&family)?;
    }
    let ids = match args.ids {
        Some(Ids(ids)) => ids,
        None => (0..).take(family.len()).collect(),
    };
    let spec = TagSheetSpec {
        family: args.family,
        ids,
        edge_mm: length("--edge", &args.edge)?,
        border_bits: args.tag_border,
    };
    let count = spec.ids.len();
    let name = named.unwrap_or_else(|| format!("{}-sheet", family.name()));
    let target = Printing::build(&name, &TargetSpec::Tags(spec), Some(&family), Some(&paper))?;
    let pages = target.sheets.len();
    ensure!(
        pages <= MAX_PAGES,
        "--ids: {count} tags need {pages} pages, but at most {MAX_PAGES} are allowed: print fewer tags (such as \
         --ids 0-99), or use a smaller --edge or larger --paper"
    );

    let formats = Formats { pdf: pdf || !(svg || png), svg, png };
    let artwork = target.draw()?;
    let files = drawn(&name, artwork, formats, args.dpi.unwrap_or(300));
    let written = write_all(&folder, &files, args.overwrite)?;
    for path in &written {
        report!("{}", output::wrote(path));
    }
    if args.no_verify {
        return Ok(ExitCode::SUCCESS);
    }
    let verifier = Verifier::new(&target)?;
    let verifier = verifier.within(Limits::NONE).cancelled_by(interrupt::flag());
    let mut passed = true;
    for path in &written {
        let verdict = match verifier.verify_path(path) {
            Err(VerifyError::Cancelled) => {
                return Err(Interrupted(
                    "the files are complete, but not all were verified".to_owned(),
                )
                .into());
            }
            verdict => verdict?,
        };
        say!("{verdict}");
        passed &= verdict.passed;
    }
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
