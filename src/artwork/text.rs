//! Text as glyph outlines of one built-in font: Inter, cut down to ASCII and `° ± · × – −`.
//!
//! No kerning and no shaping: labels are short and plain.

use kurbo::{Affine, BezPath};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};

/// Inter Regular, SIL Open Font License 1.1, see `font/LICENSE-Inter.txt`.
static FONT: &[u8] = include_bytes!("font/inter-subset.otf");

/// Height of a capital letter over the size of the text.
pub const CAP_HEIGHT: f64 = 0.727;

/// A character that the built-in font does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the built-in font has no {0:?}: use ASCII and ° ± · × – − in names and labels")]
pub struct MissingGlyph(pub char);

/// The outlines of one line of text and its advance width in mm.
///
/// The text starts at the origin and its base line runs along x; `size_mm` is the em, a capital is
/// [`CAP_HEIGHT`] times as high. Fill by the non-zero or even-odd rule.
pub fn outline(text: &str, size_mm: f64) -> Result<(BezPath, f64), MissingGlyph> {
    let font = FontRef::new(FONT).expect("the built-in font is a font");
    let (glyphs, map) = (font.outline_glyphs(), font.charmap());
    let location = LocationRef::default();
    let metrics = font.glyph_metrics(Size::unscaled(), location);
    let units = f64::from(font.metrics(Size::unscaled(), location).units_per_em);
    let mut path = BezPath::new();
    let mut advance = 0.0;
    for character in text.chars() {
        let missing = MissingGlyph(character);
        let id = map.map(character).ok_or(missing)?;
        let mut pen = Pen(BezPath::new());
        let settings = DrawSettings::unhinted(Size::unscaled(), location);
        glyphs.get(id).ok_or(missing)?.draw(settings, &mut pen).map_err(|_| missing)?;
        path.extend(Affine::translate((advance, 0.0)) * pen.0);
        advance += f64::from(metrics.advance_width(id).ok_or(missing)?);
    }
    let scale = size_mm / units;
    Ok((Affine::scale(scale) * path, advance * scale))
}

struct Pen(BezPath);

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to((f64::from(x), f64::from(y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to((f64::from(x), f64::from(y)));
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let [c, to] = [(cx, cy), (x, y)].map(|(x, y)| (f64::from(x), f64::from(y)));
        self.0.quad_to(c, to);
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let [a, b, to] = [(ax, ay), (bx, by), (x, y)].map(|(x, y)| (f64::from(x), f64::from(y)));
        self.0.curve_to(a, b, to);
    }

    fn close(&mut self) {
        self.0.close_path();
    }
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
