//! Deviations in the fold of a net.

use serde::Serialize;

use deltille_core::words::counted;

/// A deviation in the fold of a net. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum FoldFinding {
    /// A face is connected to no other by a fold.
    #[error("board {panel} hangs on no other by a fold")]
    FaceLoose {
        /// Panel id.
        panel: u32,
    },
    /// A face is printed in the place of another.
    #[error("board {panel} is printed where board {instead} belongs")]
    FaceElsewhere {
        /// Panel id.
        panel: u32,
        /// Panel that belongs there.
        instead: u32,
    },
    /// A face is rotated in its place.
    #[error("board {panel} is turned by {angle_deg:.0}° in its place")]
    FaceTurned {
        /// Panel id.
        panel: u32,
        /// Angle, degrees, counter-clockwise.
        angle_deg: f64,
    },
    /// Corners of a face, after folding, are not at their stated positions.
    #[error("board {panel}, folded, is off by {by_mm:.3} mm")]
    FoldOff {
        /// Panel id.
        panel: u32,
        /// Largest deviation.
        by_mm: f64,
    },
    /// Two sides that should meet do not.
    #[error(
        "the edges of boards {} and {} are {gap_mm:.3} mm apart when folded",
        panels[0], panels[1]
    )]
    EdgeOpen {
        /// Panels of the faces.
        panels: [u32; 2],
        /// Their distance.
        gap_mm: f64,
    },
    /// Two sides that meet do not carry the same single number.
    #[error(
        "the edge between boards {} and {} has {} on the first, {} on the second",
        panels[0], panels[1], enumerate(&numbers[0]), enumerate(&numbers[1])
    )]
    EdgeNumbers {
        /// Panels of the faces.
        panels: [u32; 2],
        /// The numbers found along each.
        numbers: [Vec<usize>; 2],
    },
    /// A face does not carry its number exactly once.
    #[error("board {panel} carries {} instead of face {stated}", enumerate(names))]
    FaceNumber {
        /// Panel id.
        panel: u32,
        /// The numbers found in it.
        names: Vec<usize>,
        /// Its number.
        stated: usize,
    },
    /// A tab names another face than the one under which its edge leads.
    #[error("a tab of board {panel} names face {named} instead of {stated}")]
    TabNames {
        /// Panel id of the face that the tab is attached to.
        panel: u32,
        /// The face that it names.
        named: usize,
        /// The face under which it is to be glued.
        stated: usize,
    },
    /// A cut edge has no tab, or two.
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

/// Numbers as part of a sentence.
fn enumerate(numbers: &[usize]) -> String {
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    if numbers.is_empty() { "no number".to_owned() } else { numbers.join(" and ") }
}
