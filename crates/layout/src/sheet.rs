//! Sheets: what lies where on a page of a print, in millimetres from its lower-left corner, y up.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::{Label, LogoPlacement};
use deltille_core::{angles, quantity};

/// One printed page: its size, where panels lie on it, and its check bars.
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
    /// Lines of stated length, to be measured with a ruler.
    pub check_bars: Vec<CheckBar>,
    /// Marks to cut and fold along.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<SheetLine>,
    /// The label and the words on the check bars.
    pub texts: Vec<SheetText>,
    /// Where the logo of the target lies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub logos: Vec<LogoPlacement>,
    /// The pages that show this sheet in parts, where it is larger than the paper; it is then
    /// printed on none of its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pages: Vec<SheetPage>,
}

impl SheetLayout {
    /// On how many pages it is printed.
    pub fn page_count(&self) -> usize {
        self.pages.len().max(1)
    }
}

/// A page that shows a window onto a sheet that is larger than the paper.
///
/// ```text
///    ┌──────────────┐
///    │┌────────────┐│   in the window the sheet, cut off at its rim: the same
///    ││            ││   paper position, `sheet_at_mm` less, is that on the sheet;
///    ││            ││   around it the marks of the page
///    │└────────────┘│
///    │ ├──────────┤ │
///    └──────────────┘
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetPage {
    /// Its place among the pages: rows are letters from the top, columns numbers from the left.
    pub label: String,
    /// Left, lower, right and upper end of the window on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub window_mm: [f64; 4],
    /// Position of the sheet's lower-left corner on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub sheet_at_mm: DVec2,
    /// Size of the page, and what is printed around the window.
    pub marks: SheetLayout,
}

/// `page = turn(angle) · panel + origin`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Id of the panel.
    pub panel: u32,
    /// Counter-clockwise turn of the panel on the page, radians.
    #[serde(deserialize_with = "quantity::angle_rad::de")]
    pub angle_rad: f64,
    /// Page position of the panel's origin, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub origin_mm: DVec2,
}

impl Placement {
    /// Page position of a point of the panel, mm.
    pub fn page_from_panel(&self, point: DVec2) -> DVec2 {
        let right = angles::direction(self.angle_rad);
        self.origin_mm + right * point.x + right.perp() * point.y
    }

    /// A point of the page in the frame of the panel, mm.
    pub fn panel_from_page(&self, point: DVec2) -> DVec2 {
        let right = angles::direction(self.angle_rad);
        let from_origin = point - self.origin_mm;
        DVec2::new(from_origin.dot(right), from_origin.dot(right.perp()))
    }
}

/// A straight line of a page.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetLine {
    /// What it is for.
    pub kind: LineKind,
    /// One end on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub from_mm: DVec2,
    /// The other end on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub to_mm: DVec2,
    /// Its width, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub width_mm: f64,
}

/// What a line of a page is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LineKind {
    /// To cut along; drawn through.
    Cut,
    /// To fold along, away from the print; dashed.
    Fold,
    /// To fold along, towards the print; dash-dotted.
    Valley,
    /// Between two faces in one plane, not to be folded; dotted.
    Flat,
    /// A stroke of a registration cross: pages that share it are laid on one another, single faces
    /// on their seats; a mark at a corner of a plate; or of the overview of such pages, or another picture. Drawn through.
    Align,
}

impl LineKind {
    /// Whether paper goes on beyond it, to another face or to a tab.
    pub fn joins_faces(self) -> bool {
        matches!(self, Self::Fold | Self::Valley | Self::Flat)
    }

    /// Its name in files.
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

/// A check bar: the distance between the outer edges of its two end strokes is its length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckBar {
    /// One end on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub from_mm: DVec2,
    /// The other end on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub to_mm: DVec2,
}

impl CheckBar {
    /// The length that it states and has, mm.
    pub fn length_mm(&self) -> f64 {
        let way = self.to_mm - self.from_mm;
        way.x.hypot(way.y)
    }
}

/// One line of text on a page, set in the built-in font.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetText {
    /// What it says.
    pub text: Label,
    /// Left end of the base line on the page, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub at_mm: DVec2,
    /// Counter-clockwise turn of the base line, radians.
    #[serde(deserialize_with = "quantity::angle_rad::de")]
    pub angle_rad: f64,
    /// Height of a capital letter, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub cap_height_mm: f64,
    /// The line is set smaller where it would be longer than this, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub max_width_mm: f64,
}
