//! Deviations in the fold of a net.

use serde::Serialize;

use deltille_core::words::counted;

/// A deviation in the fold of a net. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum FoldFinding {
    /// No fold connects a face to another face.
    #[error("no fold connects board {panel} to another board")]
    FaceLoose {
        /// Panel id.
        panel: u32,
    },
    /// A face is printed at the location of another face.
    #[error("board {panel} is printed where board {instead} belongs")]
    FaceElsewhere {
        /// Panel id.
        panel: u32,
        /// Panel that belongs there.
        instead: u32,
    },
    /// A face is rotated at its location.
    #[error("board {panel} is rotated by {angle_deg:.0}°")]
    FaceTurned {
        /// Panel id.
        panel: u32,
        /// Angle, degrees, counter-clockwise.
        angle_deg: f64,
    },
    /// After folding, the corners of a face are not at their stated positions.
    #[error("board {panel} is off by {by_mm:.3} mm after folding")]
    FoldOff {
        /// Panel id.
        panel: u32,
        /// Largest distance from a stated position.
        by_mm: f64,
    },
    /// Two sides that should meet are apart.
    #[error(
        "the edges of boards {} and {} are {gap_mm:.3} mm apart when folded",
        panels[0], panels[1]
    )]
    EdgeOpen {
        /// Panels of the faces.
        panels: [u32; 2],
        /// Distance between the two sides.
        gap_mm: f64,
    },
    /// Two sides that meet do not carry one and the same number.
    #[error(
        "the edge between boards {} and {} carries {} on the first and {} on the second",
        panels[0], panels[1], enumerate(&numbers[0]), enumerate(&numbers[1])
    )]
    EdgeNumbers {
        /// Panels of the faces.
        panels: [u32; 2],
        /// The numbers found along each side.
        numbers: [Vec<usize>; 2],
    },
    /// A face does not carry its number exactly once.
    #[error("board {panel} carries {} instead of face number {stated}", enumerate(names))]
    FaceNumber {
        /// Panel id.
        panel: u32,
        /// The numbers found on the face.
        names: Vec<usize>,
        /// The number of the face.
        stated: usize,
    },
    /// A tab names the wrong face.
    #[error("a tab of board {panel} names face {named} instead of {stated}")]
    TabNames {
        /// Panel id of the face that the tab is attached to.
        panel: u32,
        /// The face that the tab names.
        named: usize,
        /// The face to which the tab must be glued.
        stated: usize,
    },
    /// A cut edge does not have exactly one tab.
    #[error(
        "the edge between boards {} and {} has {tabs} tabs instead of one",
        panels[0], panels[1]
    )]
    EdgeTabs {
        /// Panels of the faces.
        panels: [u32; 2],
        /// Number of tabs.
        tabs: usize,
    },
    /// More than two sides carry the same number.
    #[error("edge number {number} is on {}", counted(*sides, "side"))]
    EdgeNumberAgain {
        /// The number.
        number: usize,
        /// Number of sides.
        sides: usize,
    },
}

/// Joins numbers for use in a sentence.
fn enumerate(numbers: &[usize]) -> String {
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    if numbers.is_empty() { "no number".to_owned() } else { numbers.join(" and ") }
}
