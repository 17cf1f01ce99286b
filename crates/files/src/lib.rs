//! Calibration targets to files and back.
//!
//! | module | its one job |
//! |---|---|
//! | [`clock`] | the clock of the machine |
//! | [`limits`] | how much of a file is read, regular files only; panics and endless work of other code |
//! | [`family_file`] | families by name or from their files |
//! | [`photograph`] | photographs of any common format as grey images |
//! | [`export`] | artwork, targets and results to files and back, one module a format |
//! | [`report`] | a calibration as a page to look at |

pub mod clock;
pub mod export;
pub mod family_file;
pub mod limits;
#[cfg(feature = "photographs")]
pub mod photograph;
#[cfg(feature = "photographs")]
pub mod remap;
#[cfg(feature = "report")]
pub mod report;
