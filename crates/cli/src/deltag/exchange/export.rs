use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::ValueEnum;

use crate::deltag::named::resolve;
use crate::output::{self, Overwrite, say};
use crate::values::name;
use deltille::family::{ExportFormat, export};

#[derive(clap::Args)]
pub struct Args {
    /// A shipped family, or a family file
    family: String,
    /// Output format
    #[arg(long, value_enum)]
    format: Format,
    /// Output folder or file [default: standard output]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Stem of the file name in the folder given by -o [default: the family's name]
    #[arg(long, value_parser = name, allow_hyphen_values = true)]
    name: Option<String>,
    #[command(flatten)]
    overwrite: Overwrite,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// C header
    C,
    /// Rust module
    Rust,
    /// Python module
    Python,
    /// Family file of this program
    Json,
    /// Text with one hexadecimal code per line
    Txt,
    /// YAML for cv::FileStorage, with the codes as strings; not an ArUco dictionary, because the tags are triangular
    Opencv,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let family = resolve(&args.family)?;
    let format = match args.format {
        Format::C => ExportFormat::C,
        Format::Rust => ExportFormat::Rust,
        Format::Python => ExportFormat::Python,
        Format::Json => ExportFormat::Json,
        Format::Txt => ExportFormat::Text,
        Format::Opencv => ExportFormat::OpenCv,
    };
    anyhow::ensure!(args.name.is_none() || args.output.is_some(), "--name needs -o");
    let text = export(&family, format);
    match args.output {
        None => output::print(&text)?,
        Some(place) => {
            let stem = args.name.as_deref().unwrap_or(family.name());
            let path = output::file(&place, stem, format.extension())?;
            output::write(&path, text.as_bytes(), args.overwrite).context("-o")?;
            say!("{}", path.display());
        }
    }
    Ok(ExitCode::SUCCESS)
}
