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
        /// Largest distance of a point from its stated position.
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
    /// The target does not have this path.
    #[error(
        "unexpected path on {layer} from ({:.2}, {:.2}) mm",
        at_mm.x, at_mm.y
    )]
    PathExtra {
        /// Its layer.
        layer: &'static str,
        /// Its start.
        at_mm: DVec2,
    },
    /// The plate of a board exceeds its stated size by more than any possible kerf.
    #[error("the cut outline implies a kerf of {by_mm:.3} mm, which is impossible for this target")]
    NoKerf {
        /// Excess of the first cut outline over its finished plate, measured across the plate.
        by_mm: f64,
    },
    /// The drawing, rendered as in other programs, differs from its paths.
    #[error("the rendered drawing differs from its paths near ({:.2}, {:.2}) mm", at_mm.x, at_mm.y)]
    DrawnOtherwise {
        /// The location, from the lower left corner of the drawing.
        at_mm: DVec2,
    },
}
