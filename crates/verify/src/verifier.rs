//! The target, and the settings common to all comparisons.

use std::borrow::Cow;
use std::sync::atomic::AtomicBool;

use crate::error::VerifyError;
use deltille_core::detection::{Ink, Tone};
use deltille_core::family::Family;
use deltille_core::targets::Target;
use deltille_detect::{Detector, DetectorConfig};
use deltille_files::limits::{Guard, Limits};
use deltille_layout::Printing;

/// Largest accepted deviation of a position or length on paper, mm: a fifth of the error of a good printer.
pub const TOLERANCE_MM: f64 = 0.02;

/// Print resolution of 300 dpi, px/mm, at which 0.02 mm is a quarter of a pixel.
pub(super) const PRINT_PX_PER_MM: f64 = 300.0 / 25.4;

/// Compares artifacts with one target.
pub struct Verifier<'a> {
    pub(crate) printing: Cow<'a, Printing>,
    pub(crate) detector: Detector,
    pub(crate) limits: Limits,
    pub(crate) guard: Guard,
    pub(crate) cancel: Option<&'a AtomicBool>,
    progress: Option<&'a (dyn Fn(Progress) + Sync)>,
}

/// Progress of the comparison of an artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Number of pages, or faces of a mesh, compared so far.
    pub done: usize,
    /// Total number of pages or faces.
    pub total: usize,
}

impl<'a> Verifier<'a> {
    /// Creates a verifier for the printed artifacts of a target.
    ///
    /// # Errors
    /// Returns an error if the tag family is unknown.
    pub fn new(printing: &'a Printing) -> Result<Self, VerifyError> {
        let detector = Detector::for_target(&printing.target, detector_config())?;
        Ok(Self {
            printing: printing.under_printed_name(),
            detector,
            limits: Limits::default(),
            guard: Guard::default(),
            cancel: None,
            progress: None,
        })
    }

    /// Returns the target, under the name on its prints.
    pub(crate) fn target(&self) -> &Target {
        &self.printing.target
    }

    /// Returns the tag family, which was known when the detector was created.
    pub(crate) fn family(&self) -> Option<&Family> {
        self.target().family().ok().flatten()
    }

    /// Sets limits for reading artifacts other than the default ones.
    pub fn within(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Sets the guard for third-party code on artifacts in memory; the default is [`Guard::Here`]. Use
    /// [`Guard::Timed`] where threads are available and files are not trusted.
    pub fn with_guard(self, guard: Guard) -> Self {
        Self { guard, ..self }
    }

    /// Sets a flag that is checked before each page: once it is set, [`verify`](Self::verify) returns
    /// [`VerifyError::Cancelled`].
    pub fn cancelled_by(self, flag: &'a AtomicBool) -> Self {
        Self { cancel: Some(flag), ..self }
    }

    /// Sets a callback that receives the progress after each page of a document and each face of a mesh. Faces are
    /// compared on several threads.
    pub fn with_progress(self, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// Reports that `done` of `total` were compared.
    pub(crate) fn report_progress(&self, done: usize, total: usize) {
        if let Some(progress) = self.progress {
            progress(Progress { done, total });
        }
    }
}

/// Returns the settings of the detector: rendered pages have linear tones and no ink spread.
pub(super) fn detector_config() -> DetectorConfig {
    DetectorConfig::default().tone(Tone::Linear).ink(Ink::Um(0.0))
}
