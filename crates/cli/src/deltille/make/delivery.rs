//! Last step of every command that makes a target: writes, reports and verifies its files.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};
use serde::Serialize;

use super::settings::board_settings::OUTPUT;
use super::verify::{self, Proof};
use crate::deltille::files::limits::FileLimits;
use crate::deltille::files::target_file;
use crate::deltille::files::written::{File, same_file, write_all};
use crate::output::{self, NamedFile, Overwrite, Place, ResultFormat, log, report};
use deltille::layout::{Printing, Reach};
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille::verify::{Format, whole_of};

/// Schema and version of the output of `--json`.
const SCHEMA: &str = "deltille/delivery/1";

/// Output of `--json` for a target.
#[derive(Serialize)]
struct Delivered<'a> {
    schema: &'static str,
    target: &'a str,
    /// Description in words.
    summary: &'a str,
    /// The files, in the order of writing.
    written: Vec<PathBuf>,
    /// Result of the verification; `None` if it was skipped.
    proof: Option<Proof>,
}

/// Options for the output files of a target, and for the checks before and after.
#[derive(clap::Args)]
#[command(next_help_heading = OUTPUT)]
pub struct Delivery {
    /// Description of another target to be used together with this one; shared ids are rejected. Repeatable
    #[arg(long, value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Output folder, or a file such as desk.pdf: its stem becomes the name, and its ending selects a format
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Do not read the written files back to verify them
    #[arg(long)]
    no_verify: bool,
    #[command(flatten)]
    result_format: ResultFormat,
    #[command(flatten)]
    limits: FileLimits,
}

impl Delivery {
    /// Rejects a target that cannot be used together with the given ones.
    pub fn check_beside(&self, target: &Target) -> anyhow::Result<()> {
        for path in &self.with {
            let other = target_file::read(path, &self.limits.limits()).context("--with")?;
            target.check_beside(&other.target)?;
        }
        Ok(())
    }

    /// Returns the file that `-o` names, if its ending is one of these; only its folder remains the output.
    pub fn take_file(&mut self, endings: &[&str]) -> anyhow::Result<Option<NamedFile>> {
        ensure!(
            self.output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("dxf"))
                || self.output.is_dir(),
            "-o: {} must be a folder: a DXF has the name of the target; request it with --laser dxf, or with --dxf for the \
             panels and the net of a solid",
            self.output.display()
        );
        let Place { folder, file } = output::place(&self.output, endings)?;
        self.output = folder;
        Ok(file)
    }

    /// Whether an output file of this name would replace another file.
    pub fn would_replace(&self, name: &str, other: &Path) -> bool {
        same_file(&self.output.join(name), other)
    }

    /// Returns the input limits.
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// Writes all files or none, prints `summary` and their paths, and verifies them.
    pub fn deliver(
        &self,
        printing: &Printing,
        files: &[File],
        summary: &str,
    ) -> anyhow::Result<ExitCode> {
        let target = &printing.target;
        warn_of_fine_print(printing)?;
        let written = write_all(&self.output, files, self.overwrite)?;
        if !self.result_format.is_json() {
            for line in summary.lines() {
                report!("{line}");
            }
            for path in &written {
                report!("{}", output::wrote(path));
            }
        }
        // A simulator model is verified together with the OBJ that it uses.
        let models = [Format::Sdf, Format::Urdf, Format::Mjcf].map(Some);
        let is_in_model = written.iter().any(|path| models.contains(&Format::of(path)));
        let artifacts: Vec<PathBuf> = written
            .iter()
            .filter(|path| is_proved(path, &target.name))
            .filter(|path| !(is_in_model && Format::of(path) == Some(Format::Obj)))
            .cloned()
            .collect();
        // No limits, because the files were just written.
        let prove = || verify::prove(printing, &artifacts, false, self.result_format, Limits::NONE);
        let proof = (!self.no_verify && !artifacts.is_empty()).then(prove).transpose()?;
        let code = proof.as_ref().map_or(ExitCode::SUCCESS, Proof::code);
        if self.result_format.is_json() {
            let name = &target.name;
            output::print_json(&Delivered {
                schema: SCHEMA,
                target: name,
                summary,
                written,
                proof,
            })?;
        } else if let Some(proof) = proof {
            proof.print_summary()?;
        }
        Ok(code)
    }
}

/// Smallest detail of a print without a warning, mm. Ink spreads by about 0.05 mm on each side, a fifth of this length.
const FINE_MM: f64 = 0.5;

/// Warns if details of the printed sheets are so small that ink spread changes their shape.
fn warn_of_fine_print(printing: &Printing) -> anyhow::Result<()> {
    let Reach { detail_mm, tags, .. } = Reach::of(&printing.target)?;
    if !printing.sheets.is_empty() && detail_mm < FINE_MM {
        let details = if tags > 0 { "cells of tags" } else { "tiles" };
        log!(
            "warning: {details} are {detail_mm:.2} mm wide: most printers cannot resolve them; use fewer rows and \
             columns, larger paper, or a film or glass master"
        );
    }
    Ok(())
}

/// Whether a file is verified on its own, and not as a part of another.
fn is_proved(path: &Path, target: &str) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Format::of(path).is_some() && whole_of(target, &name).is_none()
}
