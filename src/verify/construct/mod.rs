//! What a file is built of, held against a list of what every viewer shows alike.
//!
//! A picture of a file proves what one program shows. Scripts, animations, rules for print, layers,
//! blend modes, vertex colours or a second scene make another program show something else. So each
//! format has a list of what its writer here uses and the reader interprets exactly; anything else
//! is named and refused, known as harmful or not. What is refused is not drawn.

mod glb;
mod glb_json;
mod mtl;
mod obj;
mod pdf;
mod pdf_content;
mod png;
mod stl;
mod svg;

use std::path::Path;

use super::document::read;
use super::{DocumentError, Finding, Format};

/// More than this of a file is not listed.
const MOST_LISTED: usize = 64;

/// What is not on the list, as it is met on the way through a file.
#[derive(Default)]
struct Findings(Vec<Finding>);

impl Findings {
    /// Adds a construct, such as "element <image>", and where it is, such as "line 12".
    fn add(&mut self, place: impl Into<String>, construct: impl Into<String>) {
        if !self.is_full() {
            let (place, construct) = (place.into(), construct.into());
            self.0.push(Finding::Construct { place, construct });
        }
    }

    /// Adds a construct unless something holds.
    fn unless(&mut self, holds: bool, place: impl Into<String>, construct: impl Into<String>) {
        if !holds {
            self.add(place, construct);
        }
    }

    /// Whether no more is listed.
    fn is_full(&self) -> bool {
        self.0.len() >= MOST_LISTED
    }

    /// Adds what a file that belongs to this one has, with its name.
    fn add_of(&mut self, file: &str, other: Findings) {
        for finding in other.0 {
            if let Finding::Construct { place, construct } = finding {
                self.add(format!("{file}, {place}"), construct);
            }
        }
    }
}

/// What of a drawn page, a mesh or a body is not on the list of its format; `name` is that of the
/// target. An error means that the file cannot be read at all.
pub(super) fn check(
    path: &Path,
    format: Format,
    name: &str,
) -> Result<Vec<Finding>, DocumentError> {
    let unreadable = |problem: String| DocumentError::unreadable(path, problem);
    let bytes = read(path)?;
    let found = match format {
        Format::Svg => svg::check(&bytes),
        Format::Pdf => pdf::check(&bytes),
        Format::Png => png::check(&bytes),
        Format::Glb => glb::check(&bytes),
        Format::Stl => Ok(stl::check(&bytes, name)),
        Format::Obj => return obj::check(path, &bytes).map(|found| found.0),
        // Their readers know nothing but what is written.
        Format::Dsc | Format::Dxf => Ok(Findings::default()),
    };
    Ok(found.map_err(unreadable)?.0)
}

/// The text of a file.
fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|_| "not a text file".to_owned())
}

/// The first characters of what is named in a finding.
fn start(text: &str, characters: usize) -> String {
    text.chars().take(characters).collect()
}

/// A decimal number without an exponent, as all readers take it.
fn decimal(word: &str) -> Option<f64> {
    let plain = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.');
    if !word.chars().all(plain) {
        return None;
    }
    word.parse().ok().filter(|value: &f64| value.is_finite())
}

/// Whether a name is that of a file in the same folder.
fn is_plain_file_name(name: &str) -> bool {
    !name.is_empty() && name != ".." && !name.contains(['/', '\\', ':'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_decimals_and_names_stay_in_the_folder() {
        assert_eq!(decimal("-0.5"), Some(-0.5));
        for word in ["1e3", "inf", "nan", "0x1", "", "-", "1.2.3", "1,5"] {
            assert_eq!(decimal(word), None, "{word}");
        }
        assert!(is_plain_file_name("t-texture.png"));
        for name in ["", "..", "../t.png", "/t.png", "a\\b.png", "c:t.png", "http://t/t.png"] {
            assert!(!is_plain_file_name(name), "{name}");
        }
    }
}
