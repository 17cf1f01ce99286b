//! Settings of a detector.

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
    /// Maximum number of corrected bits in a tag. `None` means ⌊(h − 1)/2⌋, where h is the Hamming distance of its
    /// family.
    pub max_bit_errors: Option<u32>,
    /// Whether mirrored grids are labelled too. They get the labels of the print, but no direct
    /// view of the print shows a mirrored grid. Use these labels only to diagnose why an image is
    /// mirrored.
    pub allow_mirrored: bool,
    /// Method that refines the positions of the corners.
    pub refinement: Refinement,
    /// Tone curve of the camera.
    pub tone: Tone,
    /// Ink spread (dot gain) of the print.
    pub ink: Ink,
}

impl DetectorConfig {
    /// Sets the maximum number of corrected bits in a tag; see [`Self::max_bit_errors`].
    #[must_use]
    pub fn max_bit_errors(self, max_bit_errors: Option<u32>) -> Self {
        Self { max_bit_errors, ..self }
    }

    /// Enables or disables labels for mirrored grids; see [`Self::allow_mirrored`].
    #[must_use]
    pub fn allow_mirrored(self, allow_mirrored: bool) -> Self {
        Self { allow_mirrored, ..self }
    }

    /// Sets the method that refines the positions of the corners.
    #[must_use]
    pub fn refinement(self, refinement: Refinement) -> Self {
        Self { refinement, ..self }
    }

    /// Sets the tone curve of the camera.
    #[must_use]
    pub fn tone(self, tone: Tone) -> Self {
        Self { tone, ..self }
    }

    /// Sets the ink spread of the print.
    #[must_use]
    pub fn ink(self, ink: Ink) -> Self {
        Self { ink, ..self }
    }
}
