//! A logo from an SVG: all that is painted as one black outline.
//!
//! `elements` reads the SVG and refuses what cannot be printed black, `painted` follows what is painted over what, with
//! `crossings` and `area` for outlines.
//!
//! White is bare paper, and takes away from what was painted before; every other colour is black. Strokes become the
//! areas that they cover. What has no outline is refused by its name: texts, pictures, gradients, patterns, masks,
//! filters, what shines through.
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

use crate::limits::{self, Broken};
use area::{Area, Tone};

/// Most bytes of an SVG: programs that draw write tens of kilobytes for a logo.
pub const MAX_LOGO_BYTES: usize = 500_000;

/// Most elements, those that `use` repeats included: a tenth of a second for the reader.
const MOST_ELEMENTS: usize = 20_000;

/// How long reading may take: a hundred times what the largest logo needs.
const TIME: Duration = Duration::from_secs(20);

/// Why an SVG is no logo.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LogoError {
    /// The file is too long.
    #[error("more than {MAX_LOGO_BYTES} bytes: save it as plain SVG, without pictures in it")]
    Bytes,
    /// It cannot be read.
    #[error("not a readable SVG ({0}): save it as plain SVG")]
    Unreadable(String),
    /// Something in it has no outline that could be printed black.
    #[error("{what}: {remedy}")]
    Element {
        /// The element, and what is wrong with it.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// There is too much of something.
    #[error("{what}, more than {most}: simplify its paths")]
    Much {
        /// What.
        what: &'static str,
        /// How much of it is read.
        most: usize,
    },
    /// Its reader failed, or took too long.
    #[error(transparent)]
    Broken(#[from] Broken),
    /// Its outline is no logo.
    #[error(transparent)]
    Outline(#[from] TargetError),
}

/// The logo that an SVG shows.
///
/// # Errors
/// Where the text is no SVG, has what cannot be printed black, is too large or too intricate, or shows nothing.
pub fn from_svg(svg: &str) -> Result<Logo, LogoError> {
    if svg.len() > MAX_LOGO_BYTES {
        return Err(LogoError::Bytes);
    }
    let svg = svg.to_owned();
    limits::bounded(TIME, move || read(&svg))?
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
