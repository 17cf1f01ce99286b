//! The file with the covariance of a calibration.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};

use crate::deltille::files::written::same_file;
use crate::output::{self, Overwrite, log};
use deltille::calibrate::{Estimate, JointCovariance};
use deltille::export::covariance::CovarianceFormat;
use deltille::export::kind::Kind;

/// The option with the file.
#[derive(clap::Args)]
pub struct CovarianceArgs {
    /// Write the covariance of all estimated parameters, poses and measured corners, with names and units: a .csv, .npz or .json
    /// file
    #[arg(long, value_name = "FILE")]
    covariance: Option<PathBuf>,
}

const OPTION: &str = "--covariance";

impl CovarianceArgs {
    /// Rejects a file that cannot be written, before the work starts; `own` are the other files that the command reads or writes.
    pub fn check(&self, overwrite: Overwrite, own: &[&Path]) -> anyhow::Result<()> {
        let Some(path) = &self.covariance else { return Ok(()) };
        let format = format_of(path)?;
        ensure!(
            !own.iter().any(|other| *other == path || same_file(other, path)),
            "{OPTION}: {} is another file of this command; use another name",
            path.display()
        );
        output::check_writable(OPTION, path)?;
        overwrite.check(path, &Kind::of(&format.sample())).context(OPTION)
    }

    /// Whether the covariance is to be written.
    pub fn is_wanted(&self) -> bool {
        self.covariance.is_some()
    }

    /// Writes the file and returns its path. A failed calibration has no covariance.
    pub fn write(
        &self,
        estimate: &Estimate,
        has_failed: bool,
        overwrite: Overwrite,
    ) -> anyhow::Result<Option<PathBuf>> {
        let Some(path) = &self.covariance else { return Ok(None) };
        if has_failed {
            log!("warning: {OPTION}: not written, because the calibration failed");
            return Ok(None);
        }
        let Some(covariance) = &estimate.covariance else {
            log!("warning: {OPTION}: not written, because only poses of views were estimated");
            return Ok(None);
        };
        if covariance.shared == covariance.unknowns.len() {
            log!(
                "note: {OPTION}: without poses of views and offsets of corners, because these are more than {} unknowns",
                JointCovariance::MOST_UNKNOWNS
            );
        }
        output::write(path, &format_of(path)?.write(covariance), overwrite).context(OPTION)?;
        Ok(Some(path.clone()))
    }
}

fn format_of(path: &Path) -> anyhow::Result<CovarianceFormat> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    CovarianceFormat::of_extension(&extension)
        .with_context(|| format!("{OPTION}: {} must end in .csv, .npz or .json", path.display()))
}
