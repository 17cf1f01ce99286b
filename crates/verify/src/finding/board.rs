//! Deviations of a whole board, or of its corners and tags.

use glam::DVec2;
use serde::Serialize;

use crate::finding::shown::shown;
use deltille_core::words::counted;

/// A deviation of a board or of its corners. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum BoardFinding {
    /// The panel was not detected.
    #[error("board {panel} was not detected")]
    PanelMissing {
        /// Panel id.
        panel: u32,
    },
    /// The page shows another board: its corners are not those of the target.
    #[error("shows a different board: {} instead of {stated}", counted(*found, "corner"))]
    AnotherBoard {
        /// Corners that were found.
        found: usize,
        /// Corners that the target has on the sheet.
        stated: usize,
    },
    /// Black and white are swapped.
    #[error("board {panel} is inverted (black and white swapped)")]
    Inverted {
        /// Panel id.
        panel: u32,
    },
    /// Black and white tiles have too little contrast.
    #[error(
        "contrast of board {panel} is too low: {:.0} % ink in black tiles, {:.0} % in white tiles",
        100.0 * ink[1], 100.0 * ink[0]
    )]
    Contrast {
        /// Panel id.
        panel: u32,
        /// Ink of white and black tiles, 0 to 1.
        ink: [f64; 2],
    },
    /// A detected panel belongs on another sheet.
    #[error("shows board {panel}, which belongs on another sheet")]
    PanelForeign {
        /// Panel id.
        panel: u32,
    },
    /// The panel is mirrored.
    #[error("board {panel} is mirrored")]
    Mirrored {
        /// Panel id.
        panel: u32,
    },
    /// The panel is not mirrored, although the target states a mirrored panel.
    #[error("board {panel} is not mirrored, but should be")]
    NotMirrored {
        /// Panel id.
        panel: u32,
    },
    /// The panel is larger or smaller than stated.
    #[error("scale {scale:.4}")]
    Scale {
        /// Panel id.
        panel: u32,
        /// Found length divided by stated length.
        scale: f64,
    },
    /// The panel is stretched: its scales along the page's axes differ.
    #[error("stretched: scale {:.4} along x, {:.4} along y", scale[0], scale[1])]
    Stretched {
        /// Panel id.
        panel: u32,
        /// Found length divided by stated length, along x and y.
        scale: [f64; 2],
    },
    /// The panel is rotated on the page.
    #[error("rotated by {:.3}°", shown_angle(*angle_deg))]
    Turned {
        /// Panel id.
        panel: u32,
        /// Angle, degrees, counter-clockwise.
        angle_deg: f64,
    },
    /// The panel is shifted on the page.
    #[error("shifted by ({:.3}, {:.3}) mm", shown(by_mm.x), shown(by_mm.y))]
    Shifted {
        /// Panel id.
        panel: u32,
        /// Found minus stated position of its centre.
        by_mm: DVec2,
    },
    /// A corner was not found.
    #[error("corner {id} at row {row} col {col} not found")]
    CornerMissing {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// A single corner is displaced on an otherwise correct panel.
    #[error(
        "corner {id} at row {row} col {col} is off by ({:.3}, {:.3}) mm",
        shown(by_mm.x), shown(by_mm.y)
    )]
    CornerOff {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Found minus stated position.
        by_mm: DVec2,
    },
    /// A disc has the wrong diameter.
    #[error(
        "circle {id} at row {row} col {col} has a diameter of {found_mm:.3} mm instead of {stated_mm:.3} mm"
    )]
    DiscDiameter {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Diameter of a disc with the same amount of ink.
        found_mm: f64,
        /// Stated diameter.
        stated_mm: f64,
    },
    /// A corner was found where the target has none.
    #[error("unexpected corner at ({:.2}, {:.2}) mm", at_mm.x, at_mm.y)]
    CornerExtra {
        /// Its position.
        at_mm: DVec2,
    },
    /// The detector reads a tag where the target has none, or a different one.
    #[error("unexpected tag {id} at row {row} col {col}")]
    TagExtra {
        /// The detected id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
}

/// Rounds an angle in degrees for display, and shows −180° as 180°.
fn shown_angle(angle_deg: f64) -> f64 {
    let angle_deg = shown(angle_deg);
    if angle_deg == -180.0 { 180.0 } else { angle_deg }
}

impl BoardFinding {
    /// Whether only a corner or a tag is wrong and the rest of the board is as stated.
    pub(crate) fn is_local(&self) -> bool {
        matches!(
            self,
            Self::TagExtra { .. }
                | Self::CornerMissing { .. }
                | Self::CornerOff { .. }
                | Self::CornerExtra { .. }
                | Self::DiscDiameter { .. }
        )
    }
}
