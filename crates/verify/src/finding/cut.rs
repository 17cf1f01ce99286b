//! Deviations of a drawing for a cutter.

use glam::DVec2;
use serde::Serialize;

/// A deviation of a drawing for a cutter. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum CutFinding {
    /// A path to cut, fold or engrave is displaced.
    #[error(
        "the path on {layer} from ({:.2}, {:.2}) mm is off by {by_mm:.3} mm",
        at_mm.x, at_mm.y
    )]
    PathOff {
        /// Its layer.
        layer: &'static str,
        /// Its stated start.
        at_mm: DVec2,
        /// Largest distance of a point.
        by_mm: f64,
    },
    /// A path to cut, fold or engrave is missing.
    #[error("the path on {layer} from ({:.2}, {:.2}) mm is missing", at_mm.x, at_mm.y)]
    PathMissing {
        /// Its layer.
        layer: &'static str,
        /// Its stated start.
        at_mm: DVec2,
    },
    /// A path that the target does not have.
    #[error(
        "a path on {layer} from ({:.2}, {:.2}) mm that should not be there",
        at_mm.x, at_mm.y
    )]
    PathExtra {
        /// Its layer.
        layer: &'static str,
        /// Its start.
        at_mm: DVec2,
    },
    /// The plate of a board is as much larger than stated as no kerf makes it.
    #[error("the outline to cut is that of a kerf of {by_mm:.3} mm, which this target cannot have")]
    NoKerf {
        /// By how much the first outline to cut is larger than its finished plate, along a line across it.
        by_mm: f64,
    },
    /// A drawing as other programs show it has something else in a place.
    #[error("drawn otherwise around ({:.2}, {:.2}) mm", at_mm.x, at_mm.y)]
    DrawnOtherwise {
        /// The place, from the lower left corner of the drawing.
        at_mm: DVec2,
    },
}
