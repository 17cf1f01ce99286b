//! Deviations of a board: as a whole, or of its corners and tags.

use glam::DVec2;
use serde::Serialize;

use crate::finding::shown::shown;
use deltille_core::words::counted;

/// A deviation of a board or of its corners. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum BoardFinding {
    /// The panel was not recognised.
    #[error("board {panel} not recognised")]
    PanelMissing {
        /// Its id.
        panel: u32,
    },
    /// The picture shows another board: its corners are not those of the target.
    #[error("shows another board: {} instead of {stated}", counted(*found, "corner"))]
    AnotherBoard {
        /// Corners that were found.
        found: usize,
        /// Corners that the target has on the sheet.
        stated: usize,
    },
    /// Black and white are exchanged.
    #[error("board {panel} is inverted (black and white exchanged)")]
    Inverted {
        /// Panel id.
        panel: u32,
    },
    /// Black and white tiles differ too little.
    #[error(
        "contrast of board {panel} too low: black tiles have {:.0} % ink, white ones {:.0} %",
        100.0 * ink[1], 100.0 * ink[0]
    )]
    Contrast {
        /// Panel id.
        panel: u32,
        /// Ink of white and black tiles, 0 to 1.
        ink: [f64; 2],
    },
    /// A panel was recognised that belongs on another sheet.
    #[error("shows board {panel} of another sheet")]
    PanelForeign {
        /// Its id.
        panel: u32,
    },
    /// The panel is seen as in a mirror.
    #[error("board {panel} is mirrored")]
    Mirrored {
        /// Its id.
        panel: u32,
    },
    /// The panel is not the mirror image that it should be.
    #[error("board {panel} is not mirrored, as it should be")]
    NotMirrored {
        /// Its id.
        panel: u32,
    },
    /// The panel is larger or smaller than stated.
    #[error("scale {scale:.4}")]
    Scale {
        /// Its id.
        panel: u32,
        /// Found over stated length.
        scale: f64,
    },
    /// The panel is stretched: its scales along the page's axes differ.
    #[error("stretched: scale {:.4} along x, {:.4} along y", scale[0], scale[1])]
    Stretched {
        /// Its id.
        panel: u32,
        /// Found over stated length along x and y.
        scale: [f64; 2],
    },
    /// The panel is rotated on the page.
    #[error("turned by {:.3}°", shown_angle(*angle_deg))]
    Turned {
        /// Its id.
        panel: u32,
        /// Angle, degrees, counter-clockwise.
        angle_deg: f64,
    },
    /// The panel is shifted on the page.
    #[error("shifted by ({:.3}, {:.3}) mm", shown(by_mm.x), shown(by_mm.y))]
    Shifted {
        /// Its id.
        panel: u32,
        /// Found minus stated position of its middle.
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
        "corner {id} at row {row} col {col} off by ({:.3}, {:.3}) mm",
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
    /// A disc has another size.
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
        /// That of a disc with as much ink.
        found_mm: f64,
        /// Stated.
        stated_mm: f64,
    },
    /// A corner was found where the target has none.
    #[error("a corner at ({:.2}, {:.2}) mm where none should be", at_mm.x, at_mm.y)]
    CornerExtra {
        /// Its position.
        at_mm: DVec2,
    },
    /// The detector reads a tag that the target does not have there.
    #[error("tag {id} is read at row {row} col {col}, where it should not be")]
    TagExtra {
        /// The id that it reads.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
}

/// An angle in degrees as it is shown: half a turn is that in either direction.
fn shown_angle(angle_deg: f64) -> f64 {
    let angle_deg = shown(angle_deg);
    if angle_deg == -180.0 { 180.0 } else { angle_deg }
}

impl BoardFinding {
    /// Whether the board is as stated but for a corner or a tag.
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
