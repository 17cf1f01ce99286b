//! Settings of a detector, and the least that it looks for in any image.

use super::refine::refiner::Refinement;
use deltille_core::detection::{Ink, Tone};

/// Settings of a detector.
///
/// ```
/// use deltille_detect::DetectorConfig;
/// use deltille_core::detection::Tone;
///
/// let config = DetectorConfig::default().tone(Tone::Linear).max_bit_errors(Some(1));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct DetectorConfig {
    /// Most bits of a tag that may be corrected; `None` for ⌊(h − 1)/2⌋, where h is the distance of its family.
    pub max_bit_errors: Option<u32>,
    /// Whether grids seen as in a mirror get labels too. They are those of the print, and belong to no
    /// camera that looks at it: use them only to find out what was mirrored.
    pub allow_mirrored: bool,
    /// How the positions of corners are refined.
    pub refinement: Refinement,
    /// The camera's tone curve.
    pub tone: Tone,
    /// How far ink has spread on the print.
    pub ink: Ink,
}

impl DetectorConfig {
    /// With as many bits of a tag corrected, at most; see [`Self::max_bit_errors`].
    #[must_use]
    pub fn max_bit_errors(self, max_bit_errors: Option<u32>) -> Self {
        Self { max_bit_errors, ..self }
    }

    /// With labels for grids seen as in a mirror, or without; see [`Self::allow_mirrored`].
    #[must_use]
    pub fn allow_mirrored(self, allow_mirrored: bool) -> Self {
        Self { allow_mirrored, ..self }
    }

    /// With positions of corners refined like this.
    #[must_use]
    pub fn refinement(self, refinement: Refinement) -> Self {
        Self { refinement, ..self }
    }

    /// With the camera's tone curve.
    #[must_use]
    pub fn tone(self, tone: Tone) -> Self {
        Self { tone, ..self }
    }

    /// With the spread of ink on the print.
    #[must_use]
    pub fn ink(self, ink: Ink) -> Self {
        Self { ink, ..self }
    }
}
