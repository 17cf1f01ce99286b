//! A logo from an SVG: all painted areas become one black outline.
//!
//! `elements` checks the SVG and refuses elements that cannot be printed in black. `painted` follows the painting order, with
//! `crossings` and `area` for outlines.
//!
//! White is bare paper and erases what was painted before; every other colour is black. Strokes become the areas that they
//! cover. Elements without an outline are refused with their name: texts, images, gradients, patterns, masks, filters,
//! transparent paint.
//!
//! ```
//! let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8 4">
//!     <path d="M0 4L4 0L8 4Z" fill="#06c"/><circle cx="4" cy="3" r="1" fill="white"/></svg>"##;
//! let logo = deltille_files::logo::from_svg(svg)?;
//! assert_eq!(logo.width(), 2.0);
//! # Ok::<(), deltille_files::logo::LogoError>(())
//! ```

mod area;
mod crossings;
mod elements;
mod painted;

use std::time::Duration;

use deltille_core::targets::TargetError;
use deltille_layout::Logo;
use glam::DVec2;
use usvg::roxmltree::{Document, ParsingOptions};

use crate::limits::{Broken, Guard};
use area::{Area, Tone};

/// Maximum size of an SVG, bytes: drawing programs write tens of kilobytes for a logo.
pub const MAX_LOGO_BYTES: usize = 500_000;

/// Maximum number of elements, including those repeated by `use`: the reader takes a tenth of a second for them.
const MAX_ELEMENTS: usize = 20_000;

/// Time limit for reading: a hundred times the time for the largest logo.
const TIME: Duration = Duration::from_secs(20);

/// Error of reading a logo from an SVG.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LogoError {
    /// The file is too long.
    #[error("more than {MAX_LOGO_BYTES} bytes: save it as plain SVG without embedded images")]
    Bytes,
    /// The SVG cannot be read.
    #[error("not a readable SVG ({0}): save it as plain SVG")]
    Unreadable(String),
    /// An element has no outline that can be printed in black.
    #[error("{what}: {remedy}")]
    Element {
        /// The element and its problem.
        what: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// A count exceeds its maximum.
    #[error("more than {most} {what}: simplify the paths")]
    Much {
        /// The things counted, in the plural.
        what: &'static str,
        /// The maximum.
        most: usize,
    },
    /// The reader failed or took too long.
    #[error(transparent)]
    Broken(#[from] Broken),
    /// The outline is not a valid logo.
    #[error(transparent)]
    Outline(#[from] TargetError),
}

/// Reads the logo from an SVG.
///
/// # Errors
/// Returns an error if the text is not an SVG, contains elements that cannot be printed in black, is too large or too complex,
/// or shows nothing.
pub fn from_svg(svg: &str) -> Result<Logo, LogoError> {
    if svg.len() > MAX_LOGO_BYTES {
        return Err(LogoError::Bytes);
    }
    let svg = svg.to_owned();
    // A browser has no threads; a page restarts a module that does not answer.
    let guard = if cfg!(target_family = "wasm") { Guard::Here } else { Guard::Timed };
    guard.run(TIME, move || read(&svg))?
}

fn read(svg: &str) -> Result<Logo, LogoError> {
    let unreadable = |error: &dyn ToString| LogoError::Unreadable(error.to_string());
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let xml = Document::parse_with_options(svg, options).map_err(|e| unreadable(&e))?;
    elements::check(&xml)?;
    let options = usvg::Options::default();
    let tree = usvg::Tree::from_xmltree(&xml, &options).map_err(|e| unreadable(&e))?;
    let painted = painted::of(&tree)?;
    let mut black = Area::default();
    for run in painted.chunk_by(|a, b| a.0 == b.0) {
        let areas = Area::union(run.iter().map(|(_, area)| area));
        black = match run[0].0 {
            Tone::Black => Area::union([&black, &areas]),
            Tone::White => black.without(&areas),
        };
    }
    let outlines: Vec<Vec<DVec2>> = black.into_outlines();
    Ok(Logo::from_outlines(&outlines)?)
}

#[cfg(test)]
mod tests;
