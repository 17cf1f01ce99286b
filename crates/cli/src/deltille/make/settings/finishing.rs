//! Finishing options of boards: mirror images, spot colours, laser drawings.

#![allow(rustdoc::invalid_html_tags)] // Option comments are help texts.

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::option_checks::{is_false, length, refuse_idle};
use crate::deltille::files::written::{File, bytes_file};
use deltille::artwork::CuttingError;
use deltille::export::artifacts::{MakeError, Making, What, make};
use deltille::layout::{Finish, Printing};

/// Heading of these options.
const FINISHING: &str = "Finishing: glass, print shops, lasers";

/// How a board is finished.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = FINISHING)]
pub struct Finishing {
    /// Print the mirror image, for the back of glass; the description and labels match the view through the glass
    #[arg(long)]
    #[serde(skip_serializing_if = "is_false")]
    mirrored: bool,
    /// Print a white underprint on each page of the PDF in a spot colour of this name, such as
    /// White or RDG_WHITE, and overprint everything else on it
    #[arg(long, value_name = "NAME")]
    white: Option<String>,
    /// Print a cut line along the middle of the margin, or between boards that share a sheet; the
    /// PDF uses the spot colour <NAME>, such as CutContour
    #[arg(long, value_name = "NAME")]
    contour: Option<String>,
}

/// Drawings for a laser.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
#[command(next_help_heading = FINISHING)]
pub struct Laser {
    /// Write <name>-laser.dxf or <name>-laser.svg: closed outlines of black areas to engrave, and the outline of each
    /// plate to cut (millimetres)
    #[arg(long, value_name = "FORMATS", value_delimiter = ',')]
    #[serde(rename = "formats", skip_serializing_if = "Vec::is_empty")]
    laser: Vec<LaserFormat>,
    /// Width of the material removed by the beam; engraved outlines shrink, and plates grow, by half of it on each
    /// side [default: 0mm]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    kerf: Option<String>,
}

/// Format of a laser drawing.
#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LaserFormat {
    Dxf,
    Svg,
}

impl Finishing {
    /// Returns this finish, completed by a template; spot colours of the template only if a PDF `is_kept`.
    pub fn or(self, template: Self, is_kept: bool) -> Self {
        Self {
            mirrored: self.mirrored || template.mirrored,
            white: self.white.or(template.white.filter(|_| is_kept)),
            contour: self.contour.or(template.contour.filter(|_| is_kept)),
        }
    }

    /// Applies this finish to a target that is laid out with this margin.
    pub fn applied(
        &self,
        printing: Printing,
        margin_mm: f64,
        pdf: bool,
        laser: &Laser,
    ) -> anyhow::Result<Printing> {
        laser.check_use()?;
        if self.mirrored && printing.sheets.is_empty() && !laser.is_any() {
            bail!("--mirrored does not apply to meshes: add --pdf or --laser, or remove it");
        }
        let spots = [("--white", self.white.is_some()), ("--contour", self.contour.is_some())];
        if let Some((option, _)) = spots.into_iter().find(|(_, given)| *given && !pdf) {
            bail!("{option} needs --pdf, because only PDF supports spot colours");
        }
        let (white, contour) = (self.white.clone(), self.contour.clone());
        let finish = Finish { mirrored: self.mirrored, white, contour };
        Ok(printing.finished(finish, margin_mm)?)
    }
}

impl Laser {
    /// Returns these drawings, completed by those of a template.
    pub fn or(self, template: Self) -> Self {
        let laser = if self.laser.is_empty() { template.laser } else { self.laser };
        Self { laser, kerf: self.kerf.or(template.kerf) }
    }

    /// Whether any drawing is requested.
    pub fn is_any(&self) -> bool {
        !self.laser.is_empty()
    }

    /// Rejects a kerf without a drawing.
    pub fn check_use(&self) -> anyhow::Result<()> {
        let needed = "--laser";
        refuse_idle(&[("--kerf", self.kerf.is_some(), self.is_any(), needed)])
    }

    /// How to order the drawings, as a line after the summary; empty without any.
    pub fn order(&self) -> String {
        let has = |format: &LaserFormat| self.laser.contains(format);
        let (fill, cut) = match (has(&LaserFormat::Dxf), has(&LaserFormat::Svg)) {
            (true, true) => ("layer ENGRAVE (SVG: black)", "layer CUT (red)"),
            (true, false) => ("layer ENGRAVE", "layer CUT"),
            (false, true) => ("black", "red"),
            (false, false) => return String::new(),
        };
        let kerf = match &self.kerf {
            Some(kerf) => format!("a kerf of {kerf} is compensated, so set none"),
            None => "no kerf is compensated".to_owned(),
        };
        format!("\nlaser: engrave {fill} as fill, then cut {cut}, in mm at actual size; {kerf}")
    }

    /// Returns the requested drawings.
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
