//! Text as glyph outlines of one built-in font: Inter, cut down to ASCII and `° ± · × – −`.
//!
//! There is no kerning and no shaping, which short labels do not need.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use kurbo::{Affine, BezPath};

/// Inter Regular, SIL Open Font License 1.1, see `font/LICENSE-Inter.txt`; made by `font/outlines.py`.
static OUTLINES: &str = include_str!("font/inter-outlines.txt");

/// Font units in an em.
const UNITS_PER_EM: f64 = 2816.0;

static GLYPHS: LazyLock<BTreeMap<char, Glyph>> = LazyLock::new(|| {
    let lines = OUTLINES.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| glyph(line).expect("the built-in font is whole")).collect()
});

/// Advance width and outline of a character, in font units.
struct Glyph {
    advance: f64,
    outline: BezPath,
}

/// Height of a capital letter as a fraction of the text size (em).
pub const CAP_HEIGHT: f64 = 0.727;

/// A character that the built-in font does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the built-in font has no {0:?}: use ASCII and ° ± · × – − in names and labels")]
pub struct MissingGlyph(pub char);

/// The outline of one line of text, mm, and its advance width, mm.
///
/// The text starts at the origin and its base line runs along x, with y up; `size_mm` is the em, of
/// which a capital letter is [`CAP_HEIGHT`] high. Fill by the non-zero or the even-odd rule.
///
/// # Errors
/// When the font lacks a character of the text.
pub fn outline(text: &str, size_mm: f64) -> Result<(BezPath, f64), MissingGlyph> {
    let mut path = BezPath::new();
    let mut advance = 0.0;
    for character in text.chars() {
        let glyph = GLYPHS.get(&character).ok_or(MissingGlyph(character))?;
        path.extend(Affine::translate((advance, 0.0)) * &glyph.outline);
        advance += glyph.advance;
    }
    let scale = size_mm / UNITS_PER_EM;
    Ok((Affine::scale(scale) * path, advance * scale))
}

/// Parses a line of the built-in font: a character in hexadecimal, its advance width, and its
/// outline as an SVG path.
fn glyph(line: &str) -> Option<(char, Glyph)> {
    let mut words = line.splitn(3, ' ');
    let character = char::from_u32(u32::from_str_radix(words.next()?, 16).ok()?)?;
    let advance = words.next()?.parse().ok()?;
    let outline = BezPath::from_svg(words.next().unwrap_or_default()).ok()?;
    Some((character, Glyph { advance, outline }))
}

#[cfg(test)]
mod tests {
    use kurbo::Shape;

    use super::*;

    #[test]
    fn all_promised_characters_have_outlines() {
        let promised = (' '..='~').chain("°±·×–−".chars());
        for character in promised {
            let (path, width) = outline(&character.to_string(), 10.0).unwrap();
            assert!(width > 1.0 && (character == ' ' || !path.is_empty()), "{character}");
        }
        assert_eq!(outline("aß", 3.0).unwrap_err(), MissingGlyph('ß'));
    }

    #[test]
    fn capitals_stand_on_the_base_line_and_sizes_are_millimetres() {
        let (path, width) = outline("HH", 10.0).unwrap();
        let bounds = path.bounding_box();
        assert!(
            bounds.y0.abs() < 0.01 && (bounds.y1 - 10.0 * CAP_HEIGHT).abs() < 0.01,
            "{bounds:?}"
        );
        assert!(bounds.x1 < width && width < 20.0);
    }
}
