//! What to look for, and how: the options that `detect` and `bench detect` share.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::ValueEnum;

use super::refine::Method;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::target_file;
use crate::values::whole;
use deltille::detect::{Detector, DetectorConfig, Ink, Tone};
use deltille::lattice::GridKind;
use deltille::limits::Limits;
use deltille::targets::{SIDES, Target};

/// Options that say what to look for.
#[derive(clap::Args)]
pub struct FinderArgs {
    /// Description of the target: the .json of `deltille board`, or a .dsc; may be given for each of several targets
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    pub target: Vec<PathBuf>,
    /// Find untagged boards of this tiling instead
    #[arg(long, value_name = "KIND")]
    grid: Option<Kind>,
    /// Rows of corners of the untagged board: labels boards seen whole from their lower left, on a
    /// checkerboard the corner whose square is dark
    #[arg(long, conflicts_with = "target", requires = "cols", value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Corners in each row of the untagged board
    #[arg(long, conflicts_with = "target", requires = "rows", value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Family file, where the target names a family that is not shipped
    #[arg(long, conflicts_with = "grid")]
    family: Option<String>,
    /// Most bits of a tag that may be corrected [default: ⌊(h−1)/2⌋ of its family]
    #[arg(long, value_name = "BITS", conflicts_with = "grid", value_parser = whole(0..=u32::MAX))]
    max_errors: Option<u32>,
    /// Label boards that are seen as in a mirror too
    #[arg(long)]
    allow_mirrored: bool,
    /// How corners are refined
    #[arg(long, value_name = "METHOD", default_value = "model")]
    refine: Method,
    /// The camera's tone curve: linear, srgb, a gamma such as 2.2, or auto: estimated from the corners of
    /// each picture
    #[arg(long, value_name = "CURVE", default_value = "auto")]
    tone: Tone,
    /// How far ink has spread on the print, on every side of what is dark: µm, none, or auto: estimated from
    /// the corners of each picture
    #[arg(long, value_name = "UM", default_value = "auto", allow_negative_numbers = true)]
    ink: Ink,
    #[command(flatten)]
    limits: ImageLimits,
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// Triangles
    Deltille,
    /// Squares
    Checker,
}

impl FinderArgs {
    /// What is read of a file.
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// The targets that are named, and the detector.
    pub fn detector(&self) -> anyhow::Result<(Vec<Target>, Detector)> {
        if self.target.is_empty() && self.grid.is_none() {
            bail!("give --target FILE, or --grid deltille or checker for untagged boards");
        }
        if self.allow_mirrored && self.target.is_empty() && self.rows.is_none() {
            bail!("--allow-mirrored needs labels: give --target FILE, or --rows and --cols");
        }
        let config = DetectorConfig::default()
            .max_bit_errors(self.max_errors)
            .allow_mirrored(self.allow_mirrored)
            .refinement(self.refine.into())
            .tone(self.tone)
            .ink(self.ink);
        if self.target.is_empty() {
            if matches!(self.ink, Ink::Um(um) if um != 0.0) {
                bail!("--ink: µm need the size of the tiles: give --target FILE, or --ink none");
            }
            let kind = match self.grid {
                Some(Kind::Checker) => GridKind::Checker,
                _ => GridKind::Deltille,
            };
            let size = self.rows.zip(self.cols);
            return Ok((Vec::new(), Detector::for_grid(kind, size, config)));
        }
        let mut targets =
            target_file::read_all(&self.target, &self.limits()).context("--target")?;
        target_file::set_families(&mut targets, self.family.as_deref())?;
        for target in &targets {
            let Some(family) = target.family()? else { continue };
            if let Some(limit) = self.max_errors.filter(|limit| *limit > family.correctable()) {
                bail!(
                    "--max-errors: {limit} is more than the {} bits that {} can correct",
                    family.correctable(),
                    family.name()
                );
            }
        }
        let each: Vec<&Target> = targets.iter().collect();
        let detector = Detector::for_targets(&each, config).context("--target")?;
        Ok((targets, detector))
    }
}
