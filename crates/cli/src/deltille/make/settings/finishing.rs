//! Options of boards that are not plain prints: mirror images, spot colours, drawings for a laser.

#![allow(rustdoc::invalid_html_tags)] // The comments on options are the help of the program, too.

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::option_checks::{is_false, length, refuse_idle};
use crate::deltille::files::written::{File, bytes_file};
use deltille::artwork::CuttingError;
use deltille::export::artifacts::{MakeError, Making, What, make};
use deltille::layout::{Finish, Printing};

/// Heading of these options.
const FINISHING: &str = "Glass, print shops, lasers";

/// How a board is finished.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = FINISHING)]
pub struct Finishing {
    /// Print the mirror image, for the back of glass: the description, and labels, are what is seen through the
    /// glass
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    mirrored: bool,
    /// A white spot colour of that name, such as White or RDG_WHITE, beneath all of each page of the PDF, and
    /// everything overprints
    #[arg(long, value_name = "NAME")]
    white: Option<String>,
    /// A line to cut along in the middle of the margin, in the PDF in a spot colour of that name, such as CutContour;
    /// with --pack the lines between boards
    #[arg(long, value_name = "NAME")]
    contour: Option<String>,
}

/// Drawings for a laser.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = FINISHING)]
pub struct Laser {
    /// Write <name>-laser.dxf or <name>-laser.svg: what is black as closed outlines to engrave, and the outline of
    /// each plate to cut (millimetres)
    #[arg(long, value_name = "FORMATS", value_delimiter = ',')]
    #[serde(rename = "formats", skip_serializing_if = "Vec::is_empty")]
    laser: Vec<LaserFormat>,
    /// Width that the beam takes away: engraved outlines are drawn smaller by half of it on each side, plates larger
    /// [default: 0mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    kerf: Option<String>,
}

/// Format of a drawing for a laser.
#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LaserFormat {
    Dxf,
    Svg,
}

impl Finishing {
    /// This finish, and what a template says of it where it says nothing; its spot colours where a PDF `is_kept`.
    pub fn or(self, template: Self, is_kept: bool) -> Self {
        Self {
            mirrored: self.mirrored || template.mirrored,
            white: self.white.or(template.white.filter(|_| is_kept)),
            contour: self.contour.or(template.contour.filter(|_| is_kept)),
        }
    }

    /// The target with this finish, which is laid out within this margin.
    pub fn applied(
        &self,
        printing: Printing,
        margin_mm: f64,
        pdf: bool,
        laser: &Laser,
    ) -> anyhow::Result<Printing> {
        laser.check_use()?;
        if self.mirrored && printing.sheets.is_empty() && !laser.is_any() {
            bail!("--mirrored: a mesh is never mirrored: add --pdf or --laser, or leave it out");
        }
        let spots = [("--white", self.white.is_some()), ("--contour", self.contour.is_some())];
        if let Some((option, _)) = spots.into_iter().find(|(_, given)| *given && !pdf) {
            bail!("{option}: only a PDF has spot colours: add --pdf, or leave it out");
        }
        let (white, contour) = (self.white.clone(), self.contour.clone());
        let finish = Finish { mirrored: self.mirrored, white, contour };
        Ok(printing.finished(finish, margin_mm)?)
    }
}

impl Laser {
    /// These drawings, and what a template says of them where these say nothing.
    pub fn or(self, template: Self) -> Self {
        let laser = if self.laser.is_empty() { template.laser } else { self.laser };
        Self { laser, kerf: self.kerf.or(template.kerf) }
    }

    /// Whether any is asked for.
    pub fn is_any(&self) -> bool {
        !self.laser.is_empty()
    }

    /// Refuses a kerf of nothing.
    pub fn check_use(&self) -> anyhow::Result<()> {
        let needed = "a drawing for a laser: add --laser";
        refuse_idle(&[("--kerf", self.kerf.is_some(), self.is_any(), needed)])
    }

    /// The drawings that are asked for.
    pub fn files(&self, printing: &Printing) -> anyhow::Result<Vec<File>> {
        let mut making = Making::default();
        making.kerf_mm = length("kerf", &self.kerf)?.unwrap_or(0.0);
        let formats = [(LaserFormat::Dxf, What::LaserDxf), (LaserFormat::Svg, What::LaserSvg)];
        let asked = formats.into_iter().filter(|(format, _)| self.laser.contains(format));
        let mut files = Vec::new();
        for (_, what) in asked {
            let made = make(printing, what, making);
            let is_kerf = matches!(made, Err(MakeError::Cutting(CuttingError::Kerf { .. })));
            let made = made.context(if is_kerf { "--kerf" } else { "--laser" })?;
            files.extend(made.into_iter().map(|(name, bytes)| bytes_file(name, bytes)));
        }
        Ok(files)
    }
}
