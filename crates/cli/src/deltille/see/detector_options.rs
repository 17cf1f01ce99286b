//! Detector options shared by `detect` and `bench detect`.

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

/// Options that select the target and the method.
#[derive(clap::Args)]
pub struct FinderArgs {
    /// Target description: the .json of `deltille board`, or a .dsc; repeatable for several targets
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    pub target: Vec<PathBuf>,
    /// Detect untagged boards of this tiling instead
    #[arg(long, value_name = "KIND")]
    grid: Option<Kind>,
    /// Number of corner rows of the untagged board. With --cols, a fully visible board is labelled:
    /// corner (0, 0) is at the lower left, for a checkerboard in the orientation in which the
    /// square in its lower left corner is dark (if two orientations are possible, in the one in
    /// which corner (0, 0) is lower in the image)
    #[arg(long, conflicts_with = "target", requires = "cols", value_parser = whole(SIDES))]
    rows: Option<u32>,
    /// Number of corners per row of the untagged board
    #[arg(long, conflicts_with = "target", requires = "rows", value_parser = whole(SIDES))]
    cols: Option<u32>,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long, conflicts_with = "grid")]
    family: Option<String>,
    /// Maximum number of corrected bits per tag [default: ⌊(h−1)/2⌋, with h the distance of the
    /// family]
    #[arg(long, value_name = "BITS", conflicts_with = "grid", value_parser = whole(0..=u32::MAX))]
    max_errors: Option<u32>,
    /// Also label mirror images of boards
    #[arg(long)]
    allow_mirrored: bool,
    /// Corner refinement method
    #[arg(long, value_name = "METHOD", default_value = "model")]
    refine: Method,
    /// Tone curve of the camera: linear, srgb, a gamma such as 2.2, or auto (estimated from the corners of each
    /// image)
    #[arg(long, value_name = "CURVE", default_value = "auto")]
    tone: Tone,
    /// Ink spread of the print, the growth of dark areas on every side: µm, none, or auto
    /// (estimated from the corners of each image)
    #[arg(long, value_name = "UM", default_value = "auto")]
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
    /// Returns the input limits.
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// Returns the given targets, and the detector.
    pub fn detector(&self) -> anyhow::Result<(Vec<Target>, Detector)> {
        if self.target.is_empty() && self.grid.is_none() {
            bail!("--target FILE is needed, or --grid deltille or checker for untagged boards");
        }
        if self.allow_mirrored && self.target.is_empty() && self.rows.is_none() {
            bail!("--allow-mirrored needs --target FILE, or --rows and --cols, to label corners");
        }
        let config = DetectorConfig::default()
            .max_bit_errors(self.max_errors)
            .allow_mirrored(self.allow_mirrored)
            .refinement(self.refine.into())
            .tone(self.tone)
            .ink(self.ink);
        if self.target.is_empty() {
            if matches!(self.ink, Ink::Um(um) if um != 0.0) {
                bail!(
                    "--ink in µm needs --target FILE for the size of the tiles; otherwise use --ink none"
                );
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
                    "--max-errors: {limit} exceeds the {} bits that {} can correct",
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
