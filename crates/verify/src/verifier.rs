//! The target, and the settings that all comparisons have in common.

use std::borrow::Cow;
use std::sync::atomic::AtomicBool;

use crate::error::VerifyError;
use deltille_core::detection::{Ink, Tone};
use deltille_core::family::Family;
use deltille_core::targets::Target;
use deltille_detect::{Detector, DetectorConfig};
use deltille_files::limits::{Guard, Limits};
use deltille_layout::Printing;

/// Largest deviation of a position or a length on paper, mm: a fifth of the error of a good
/// printer.
pub const TOLERANCE_MM: f64 = 0.02;

/// Print resolution of 300 dpi, px/mm: 0.02 mm is a quarter of a pixel.
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

/// How far the comparison of an artifact has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pages, or faces of a mesh, that were compared.
    pub done: usize,
    /// How many there are.
    pub total: usize,
}

impl<'a> Verifier<'a> {
    /// A verifier for the artifacts of a target as it is printed.
    ///
    /// # Errors
    /// When the family of its tags is unknown.
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

    /// The target, under the name that is on its prints.
    pub(crate) fn target(&self) -> &Target {
        &self.printing.target
    }

    /// The family of its tags, which was there when the detector was made.
    pub(crate) fn family(&self) -> Option<&Family> {
        self.target().family().ok().flatten()
    }

    /// The same verifier with other limits for reading artifacts than the default.
    pub fn within(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The same verifier, running third-party code on artifacts in memory under this guard; the
    /// default is [`Guard::Here`]. Take [`Guard::Timed`] where threads are available and files are
    /// not trusted.
    pub fn guarded_by(self, guard: Guard) -> Self {
        Self { guard, ..self }
    }

    /// The same verifier, which checks `flag` before each page: once it is set,
    /// [`verify`](Self::verify) returns [`VerifyError::Cancelled`].
    pub fn stopped_by(self, flag: &'a AtomicBool) -> Self {
        Self { cancel: Some(flag), ..self }
    }

    /// The same verifier, which tells after each page of a document and each face of a mesh how far it has come; faces are
    /// compared on several threads.
    pub fn telling(self, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// Tells that so many of all were compared.
    pub(crate) fn tell(&self, done: usize, total: usize) {
        if let Some(progress) = self.progress {
            progress(Progress { done, total });
        }
    }
}

/// What is looked at is drawn: as bright as it is stated, and without ink that spreads.
pub(super) fn detector_config() -> DetectorConfig {
    DetectorConfig::default().tone(Tone::Linear).ink(Ink::Um(0.0))
}
