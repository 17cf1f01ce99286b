//! Deviations outside the tiles of a sheet.

use glam::DVec2;
use serde::Serialize;

use deltille_layout::{Label, LineKind};

/// A deviation outside the tiles of a sheet. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum MarkFinding {
    /// A check bar has the wrong length or is missing.
    #[error("check bar {bar} {}", measured(*found_mm, *stated_mm))]
    CheckBar {
        /// Number of the bar, from 1.
        bar: usize,
        /// Measured length; `None` when an end was not found.
        found_mm: Option<f64>,
        /// Stated length.
        stated_mm: f64,
    },
    /// A check bar has the stated length but is drawn differently.
    #[error("check bar {bar} differs from the description")]
    CheckBarDiffers {
        /// Number of the bar, from 1.
        bar: usize,
    },
    /// A text is missing or differs.
    #[error("label {text} differs from the description")]
    TextDiffers {
        /// Number of the text on the sheet, from 1.
        text: usize,
        /// The stated text.
        stated: Label,
    },
    /// A logo is missing or differs.
    #[error("logo {logo} differs from the description")]
    LogoDiffers {
        /// Number of the logo on the sheet, from 1.
        logo: usize,
    },
    /// A line is missing or differs.
    #[error("{} line {line} differs from the description", purpose.name())]
    LineDiffers {
        /// Number of the line on the sheet, from 1.
        line: usize,
        /// Its purpose.
        purpose: LineKind,
    },
    /// A disc is not round or not solid.
    #[error("circle at row {row} col {col} differs from the description")]
    DiscDiffers {
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// Ink outside the tiles, texts, check bars and logos, or missing ink on a black field.
    #[error("spot of {area_mm2:.3} mm² at ({:.2}, {:.2}) mm", at_mm.x, at_mm.y)]
    Spot {
        /// Centre of the spot.
        at_mm: DVec2,
        /// Its area, mm².
        area_mm2: f64,
    },
}

impl MarkFinding {
    /// Returns the finding with its position converted to another frame.
    pub(crate) fn moved(self, place: impl Fn(DVec2) -> DVec2) -> Self {
        match self {
            Self::Spot { at_mm, area_mm2 } => Self::Spot { at_mm: place(at_mm), area_mm2 },
            other => other,
        }
    }
}

/// Describes the measurement of a check bar.
fn measured(found_mm: Option<f64>, stated_mm: f64) -> String {
    match found_mm {
        Some(found_mm) => format!("measures {found_mm:.3} mm instead of {stated_mm:.3} mm"),
        None => "was not found".to_owned(),
    }
}
