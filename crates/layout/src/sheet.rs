//! Sheets: the positions of all marks on a printed page, in millimetres from its lower-left corner, y up.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::{Label, LogoPlacement};
use deltille_core::{angles, quantity};

/// One printed page: its size, the positions of its panels, and its check bars.
///
/// The page frame has its origin at the lower-left corner of the page, x right, y up, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetLayout {
    /// Page width, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub width_mm: f64,
    /// Page height, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub height_mm: f64,
    /// Panels on the page.
    pub placements: Vec<Placement>,
    /// Lines of known length, to be measured with a ruler.
    pub check_bars: Vec<CheckBar>,
    /// Lines to cut and fold along, and alignment marks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<SheetLine>,
    /// The label, and the texts of check bars and lines.
    pub texts: Vec<SheetText>,
    /// Positions of the logo of the target.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub logos: Vec<LogoPlacement>,
    /// Pages that show parts of this sheet if it is larger than the paper. The sheet itself is then not printed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pages: Vec<SheetPage>,
}

impl SheetLayout {
    /// Returns the first printed page: the sheet itself, or the first of its pages.
    pub fn first_page(&self) -> &Self {
        self.pages.first().map_or(self, |page| &page.marks)
    }

    /// Returns the number of pages on which the sheet is printed.
    pub fn page_count(&self) -> usize {
        self.pages.len().max(1)
    }
}

/// A page that shows a window onto a sheet larger than the paper.
///
/// ```text
///    ┌──────────────┐
///    │┌────────────┐│   The window shows the sheet, clipped at its border.
///    ││            ││   Subtract `sheet_at_mm` from a page position to get
///    ││            ││   the position on the sheet. The marks of the page
///    │└────────────┘│   surround the window.
///    │ ├──────────┤ │
///    └──────────────┘
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetPage {
    /// Page number, counted from 1, row by row from the upper left.
    pub label: String,
    /// Left, lower, right and upper edge of the window on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub window_mm: [f64; 4],
    /// Page position of the lower-left corner of the sheet, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub sheet_at_mm: DVec2,
    /// Size of the page, and the marks around the window.
    pub marks: SheetLayout,
}

/// Pose of a panel on its page: `page = rotation(angle) · panel + origin`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Panel id.
    pub panel: u32,
    /// Counter-clockwise rotation of the panel on the page, radians.
    #[serde(deserialize_with = "quantity::angle_rad::de")]
    pub angle_rad: f64,
    /// Page position of the panel's origin, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub origin_mm: DVec2,
}

impl Placement {
    /// Returns the page position of a point of the panel, mm.
    pub fn page_from_panel(&self, point: DVec2) -> DVec2 {
        let right = angles::direction(self.angle_rad);
        self.origin_mm + right * point.x + right.perp() * point.y
    }

    /// Returns the panel coordinates of a point of the page, mm.
    pub fn panel_from_page(&self, point: DVec2) -> DVec2 {
        let right = angles::direction(self.angle_rad);
        let from_origin = point - self.origin_mm;
        DVec2::new(from_origin.dot(right), from_origin.dot(right.perp()))
    }
}

/// A straight line on a page.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetLine {
    /// Its purpose.
    pub kind: LineKind,
    /// One end on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub from_mm: DVec2,
    /// The other end on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub to_mm: DVec2,
    /// Line width, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub width_mm: f64,
}

/// Purpose of a line on a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LineKind {
    /// Cutting line; drawn solid.
    Cut,
    /// Line to fold away from the print (mountain fold); dashed.
    Fold,
    /// Line to fold towards the print (valley fold); dash-dotted.
    Valley,
    /// Line between two coplanar faces, not to be folded; dotted.
    Flat,
    /// Alignment mark; drawn solid. It is a stroke of a registration cross for aligning shared
    /// pages or single faces, or a mark at the corner of a plate. Lines of the page overview and of
    /// other figures have this kind too.
    Align,
}

impl LineKind {
    /// Returns whether the paper continues beyond the line, to another face or to a tab.
    pub fn joins_faces(self) -> bool {
        matches!(self, Self::Fold | Self::Valley | Self::Flat)
    }

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cut => "cut",
            Self::Fold => "fold",
            Self::Valley => "valley",
            Self::Flat => "flat",
            Self::Align => "align",
        }
    }
}

/// A check bar. Its length is the distance between the outer edges of its two end strokes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckBar {
    /// One end on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub from_mm: DVec2,
    /// The other end on the page, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub to_mm: DVec2,
}

impl CheckBar {
    /// Returns its nominal length, mm.
    pub fn length_mm(&self) -> f64 {
        let way = self.to_mm - self.from_mm;
        way.x.hypot(way.y)
    }
}

/// One line of text on a page, set in the built-in font.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetText {
    /// Content of the text.
    pub text: Label,
    /// Page position of the left end of the baseline, mm.
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub at_mm: DVec2,
    /// Counter-clockwise rotation of the baseline, radians.
    #[serde(deserialize_with = "quantity::angle_rad::de")]
    pub angle_rad: f64,
    /// Height of a capital letter, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub cap_height_mm: f64,
    /// Maximum width of the line, mm; longer text is scaled down.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub max_width_mm: f64,
}
