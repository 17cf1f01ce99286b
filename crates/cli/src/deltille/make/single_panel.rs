//! Paper and file options of all targets with a single panel.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::delivery::Delivery;
use super::settings::board_settings::{DEFAULT_DPI, DPI, OUTPUT, PAPER, PRINT};
use super::settings::finishing::{Finishing, Laser};
use super::settings::logo;
use super::settings::meshes::Meshes;
use super::settings::option_checks::refuse_idle;
use crate::deltille::files::written::{File, Formats, drawn, text_file};
use crate::output::{named_by, request};
use crate::values::{name, whole};
use deltille::family::Family;
use deltille::layout::{self, DEFAULT_MARGIN_MM, PaperSize, PaperSpec};
use deltille::targets::{TargetSpec, parse_length_mm};

/// Options of paper and print files.
#[derive(clap::Args)]
pub struct PrintingArgs {
    /// The paper.
    #[arg(long, help_heading = PAPER, value_name = "SIZE", help = format!(
        "{} [default: the smallest of A4 to A0 that fits the target]", PaperSize::choice()
    ))]
    paper: Option<String>,
    /// Page orientation: auto, portrait or landscape
    #[arg(long, help_heading = PAPER, default_value = "auto")]
    orientation: String,
    /// Add a page with a picture of the target, instructions for the sheet, and a ruler
    #[arg(long, help_heading = PAPER)]
    guide_page: bool,
    /// Blank margin along the edges of the paper; at least 0.5 mm are kept blank [default: 5mm]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true, value_parser = parse_length_mm)]
    margin: Option<f64>,
    /// Write <name>.pdf (default unless --svg or --png is given)
    #[arg(long, help_heading = PRINT)]
    pdf: bool,
    /// Write <name>.svg
    #[arg(long, help_heading = PRINT)]
    svg: bool,
    /// Write <name>.png
    #[arg(long, help_heading = PRINT)]
    png: bool,
    /// Resolution of the PNG, 200 to 2400 dots per inch [default: 300]
    #[arg(long, help_heading = PRINT, value_parser = whole(DPI))]
    dpi: Option<u32>,
    /// Text for the label of every sheet, next to the name, such as the owner
    #[arg(long, help_heading = PAPER, value_name = "TEXT")]
    note: Option<String>,
    /// SVG logo, printed in black opposite the label: filled paths and strokes; white areas stay unprinted
    #[arg(long, help_heading = PAPER, value_name = "FILE")]
    logo: Option<PathBuf>,
    /// Height of the logo [default: the height of the label strip]
    #[arg(long, help_heading = PAPER, value_name = "LENGTH", allow_hyphen_values = true, value_parser = parse_length_mm)]
    logo_height: Option<f64>,
    /// Stem of the file names, also printed on the sheet [default: the name of the command]
    #[arg(long, help_heading = OUTPUT, value_parser = name)]
    name: Option<String>,
    #[command(flatten)]
    delivery: Delivery,
    #[command(flatten)]
    finishing: Finishing,
    #[command(flatten)]
    laser: Laser,
}

impl PrintingArgs {
    /// Sets the folder, the name and the format of the file that `-o` names, which may be one of the meshes.
    pub fn take_file(&mut self, meshes: Option<&mut Meshes>) -> anyhow::Result<()> {
        let of_meshes = if meshes.is_some() { Meshes::ENDINGS.as_slice() } else { &[] };
        let file =
            self.delivery.take_file(&[&["json", "pdf", "svg", "png"], of_meshes].concat())?;
        let ending = named_by(&mut self.name, file)?;
        let Self { pdf, svg, png, .. } = self;
        request(&ending, [("pdf", pdf), ("svg", svg), ("png", png)]);
        meshes.into_iter().for_each(|meshes| meshes.request(&ending));
        Ok(())
    }

    /// Whether a PDF is written: also if no other format is requested and no mesh `is_made`.
    fn is_pdf(&self, is_made: bool) -> bool {
        self.pdf || !(self.svg || self.png || self.laser.is_any() || is_made)
    }

    /// Lays the target out on its paper.
    pub fn build(
        &self,
        command: &str,
        spec: &TargetSpec,
        family: Option<&Family>,
        is_made: bool,
    ) -> anyhow::Result<layout::Printing> {
        if self.dpi.is_some() && !self.png {
            bail!("--dpi needs --png");
        }
        let paper = PaperSpec {
            size: self.paper.as_deref().map(str::parse).transpose().context("--paper")?,
            orientation: self.orientation.parse().context("--orientation")?,
            margin_mm: self.margin.unwrap_or(DEFAULT_MARGIN_MM),
            note: self.note.clone(),
            guide_page: self.guide_page,
            ..PaperSpec::default()
        };
        let paper = logo::on(paper, self.logo.as_deref(), self.logo_height)?;
        let name = self.name.as_deref().unwrap_or(command);
        let is_printed = self.is_pdf(is_made) || self.svg || self.png;
        if !is_printed {
            idle_without_pages(&paper)?;
        }
        let paper_of_print = is_printed.then_some(&paper);
        let printing = layout::Printing::build(name, spec, family, paper_of_print)?;
        let pdf = self.is_pdf(is_made);
        let printing = self.finishing.applied(printing, paper.margin_mm, pdf, &self.laser)?;
        self.delivery.check_beside(&printing.target)?;
        Ok(printing)
    }

    /// Returns the description of a target, and its pages; the PDF is omitted by default if a mesh `is_made`.
    pub fn files(&self, printing: &layout::Printing, is_made: bool) -> anyhow::Result<Vec<File>> {
        let formats = Formats { pdf: self.is_pdf(is_made), svg: self.svg, png: self.png };
        let dpi = self.dpi.unwrap_or(DEFAULT_DPI);
        let name = &printing.target.name;
        let mut files = vec![text_file(format!("{name}.json"), printing.to_json())];
        if !printing.sheets.is_empty() {
            files.extend(drawn(name, printing.draw()?, formats, dpi));
        }
        files.extend(self.laser.files(printing)?);
        Ok(files)
    }

    /// Writes and verifies the files, and reports them with the summary and how to order drawings for a laser.
    pub fn deliver(
        &self,
        printing: &layout::Printing,
        files: &[File],
        summary: &str,
    ) -> anyhow::Result<ExitCode> {
        self.delivery.deliver(printing, files, &(summary.to_owned() + &self.laser.order()))
    }
}

/// Rejects page options without pages.
pub fn idle_without_pages(paper: &PaperSpec) -> anyhow::Result<()> {
    let needed = "--pdf, --svg or --png";
    refuse_idle(&[
        ("--guide-page", paper.guide_page, false, needed),
        ("--tag-ids", paper.tag_ids, false, needed),
        ("--note", paper.note.is_some(), false, needed),
        ("--logo", paper.logo.is_some(), false, needed),
        ("--logo-height", paper.logo_height_mm.is_some(), false, "--logo"),
    ])
}

/// Describes the paper of a target, to be appended to other words.
pub fn page(printing: &layout::Printing) -> String {
    let pages = printing.pages_in_words();
    if pages.is_empty() { pages } else { format!(", {pages}") }
}
