//! The end of every command that makes a target: its files are written, reported and verified.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use serde::Serialize;

use super::verify::{self, Proof};
use crate::deltille::files::limits::FileLimits;
use crate::deltille::files::target_file;
use crate::deltille::files::written::{File, same_file, write_all};
use crate::output::{self, Overwrite, Telling, say};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille::verify::{Format, whole_of};

/// Schema and version of what `--json` prints.
const SCHEMA: &str = "deltille/delivery/1";

/// What `--json` prints of a target that was made.
#[derive(Serialize)]
struct Delivered<'a> {
    schema: &'static str,
    target: &'a str,
    /// In words.
    summary: &'a str,
    /// The files, in the order of writing.
    written: Vec<PathBuf>,
    /// What came of their proof; nothing where none was made.
    proof: Option<Proof>,
}

/// Where the files of a target go, and what is checked before and after.
#[derive(clap::Args)]
pub struct Delivery {
    /// Description of another target to be used together with this one: ids that both have are
    /// refused; may be repeated
    #[arg(long, value_name = "FILE")]
    with: Vec<PathBuf>,
    /// Folder to write to
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Do not read the written files back to compare them with the description
    #[arg(long)]
    no_verify: bool,
    #[command(flatten)]
    telling: Telling,
    #[command(flatten)]
    limits: FileLimits,
}

impl Delivery {
    /// Refuses a target that cannot be used together with those named.
    pub fn check_beside(&self, target: &Target) -> anyhow::Result<()> {
        for path in &self.with {
            let other = target_file::read(path, &self.limits.limits()).context("--with")?;
            target.check_beside(&other.target)?;
        }
        Ok(())
    }

    /// Whether a file of that name would be written over another one.
    pub fn would_replace(&self, name: &str, other: &Path) -> bool {
        same_file(&self.output.join(name), other)
    }

    /// What is read of a file.
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// Writes all files or none, says so after `summary`, and compares them with the target.
    pub fn deliver(
        &self,
        printing: &Printing,
        files: &[File],
        summary: &str,
    ) -> anyhow::Result<ExitCode> {
        let target = &printing.target;
        let written = write_all(&self.output, files, self.overwrite)?;
        if !self.telling.is_json() {
            for line in summary.lines() {
                say!("{line}");
            }
            for path in &written {
                say!("wrote {}", path.display());
            }
        }
        // A model for a simulator is proved together with the OBJ that it names.
        let models = [Format::Sdf, Format::Urdf, Format::Mjcf].map(Some);
        let is_in_model = written.iter().any(|path| models.contains(&Format::of(path)));
        let artifacts: Vec<PathBuf> = written
            .iter()
            .filter(|path| is_proved(path, &target.name))
            .filter(|path| !(is_in_model && Format::of(path) == Some(Format::Obj)))
            .cloned()
            .collect();
        // They were just made, however large.
        let prove = || verify::prove(printing, &artifacts, false, self.telling, Limits::NONE);
        let proof = (!self.no_verify && !artifacts.is_empty()).then(prove).transpose()?;
        let code = proof.as_ref().map_or(ExitCode::SUCCESS, Proof::code);
        if self.telling.is_json() {
            let name = &target.name;
            output::print_json(&Delivered {
                schema: SCHEMA,
                target: name,
                summary,
                written,
                proof,
            })?;
        } else if let Some(proof) = proof {
            proof.tell()?;
        }
        Ok(code)
    }
}

/// Whether a file is compared by itself, and not as a part of another.
fn is_proved(path: &Path, target: &str) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Format::of(path).is_some() && whole_of(target, &name).is_none()
}
