//! Paper: sizes, orientation, margins, and the options of a print.

use std::fmt;
use std::str::FromStr;

use glam::DVec2;

use crate::Logo;
use deltille_core::targets::{format_mm, parse_length_mm};

/// Named sizes: short and long side, mm (ISO 216; ANSI A and B, US legal).
const SIZES: [(&str, [f64; 2]); 9] = [
    ("A0", [841.0, 1189.0]),
    ("A1", [594.0, 841.0]),
    ("A2", [420.0, 594.0]),
    ("A3", [297.0, 420.0]),
    ("A4", [210.0, 297.0]),
    ("A5", [148.0, 210.0]),
    ("letter", [215.9, 279.4]),
    ("legal", [215.9, 355.6]),
    ("tabloid", [279.4, 431.8]),
];

/// Longest side of a sheet, mm: PDF page boxes are limited to 14,400 pt (ISO 32000-1, annex C).
const LONGEST_MM: f64 = 5080.0;

/// Shortest side of a sheet, mm: smaller paper has no room for check bars.
const SHORTEST_MM: f64 = 50.0;

/// Default margin, mm. Office printers leave 3 to 5 mm blank.
pub const DEFAULT_MARGIN_MM: f64 = 5.0;

/// Paper on which a target is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperSpec {
    /// Paper size; `None` selects the smallest of A4, A3, A2, A1 and A0 that fits the board.
    pub size: Option<PaperSize>,
    /// Orientation of the sheet.
    pub orientation: Orientation,
    /// Width of the blank strip along the edges of the paper, mm.
    pub margin_mm: f64,
    /// How the faces of a solid are printed.
    pub solids: SolidSheets,
    /// Largest number of pages for the net of a solid, which selects the paper if its size is not fixed; `None` prefers a single
    /// page, and allows any number of pages of the largest paper.
    pub pages: Option<u32>,
    /// Whether a board that is larger than the paper is split over several pages.
    pub poster: bool,
    /// Whether a sheet contains as many boards as fit, to be cut apart, instead of one.
    pub packed: bool,
    /// Note printed on the label of every sheet after the name, for example the owner.
    pub note: Option<String>,
    /// Logo printed on every sheet, at the opposite end of the strip in which the label begins.
    pub logo: Option<Logo>,
    /// Height of the logo, mm; `None` uses the height of the strip, or less if the logo would be too wide.
    pub logo_height_mm: Option<f64>,
    /// Whether each tag has its id printed beside it in small type.
    pub tag_ids: bool,
    /// Whether to add a guide page with a figure of the target, instructions and a ruler.
    pub guide_page: bool,
}

/// How the faces of a solid are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SolidSheets {
    /// As a net to fold. A net larger than the paper is split into pieces of whole faces.
    #[default]
    Net,
    /// As a net to fold. A net larger than the paper is split over pages that are joined along seams through its tiles.
    SeamedNet,
    /// Each face on its own sheet, to be glued on a rigid skeleton.
    PerFace,
}

impl PaperSpec {
    /// Returns the allowed page sizes for a paper size, portrait before landscape, mm.
    pub(super) fn pages_mm(&self, size: &PaperSize) -> Vec<DVec2> {
        match self.orientation {
            Orientation::Portrait => vec![size.portrait_mm()],
            Orientation::Landscape => vec![size.landscape_mm()],
            Orientation::Auto => vec![size.portrait_mm(), size.landscape_mm()],
        }
    }

    /// Returns the allowed sizes, smallest first: the requested one, or those of [`PaperSize::automatic`].
    pub(super) fn sizes(&self) -> Vec<PaperSize> {
        match &self.size {
            Some(size) => vec![size.clone()],
            None => PaperSize::automatic().collect(),
        }
    }
}

impl Default for PaperSpec {
    fn default() -> Self {
        Self {
            size: None,
            orientation: Orientation::Auto,
            margin_mm: DEFAULT_MARGIN_MM,
            solids: SolidSheets::default(),
            pages: None,
            poster: false,
            packed: false,
            note: None,
            logo: None,
            logo_height_mm: None,
            tag_ids: false,
            guide_page: false,
        }
    }
}

/// Orientation of a sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Orientation {
    /// The orientation that fits the board.
    #[default]
    Auto,
    /// Higher than wide.
    Portrait,
    /// Wider than high.
    Landscape,
}

impl FromStr for Orientation {
    type Err = PaperError;

    fn from_str(text: &str) -> Result<Self, PaperError> {
        match text {
            "auto" => Ok(Self::Auto),
            "portrait" => Ok(Self::Portrait),
            "landscape" => Ok(Self::Landscape),
            _ => Err(PaperError::Orientation(text.to_owned())),
        }
    }
}

/// Paper size: its name, such as `A4` or `297 × 420 mm`, and its sides.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperSize {
    name: String,
    short_mm: f64,
    long_mm: f64,
}

/// Error for a string that is not a paper size or an orientation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// The text is neither a known name nor two lengths.
    #[error("unknown paper size `{0}` (known: {size})", size = PaperSize::choice())]
    Unknown(String),
    /// A side is too short or too long.
    #[error(
        "paper size `{0}` is out of range: both sides must be {SHORTEST_MM} to {LONGEST_MM} mm long"
    )]
    Side(String),
    /// The orientation is not auto, portrait or landscape.
    #[error("unknown orientation `{0}` (known: auto, portrait, landscape)")]
    Orientation(String),
}

impl PaperSize {
    /// Iterates over the named sizes.
    pub fn all() -> impl DoubleEndedIterator<Item = PaperSize> {
        SIZES.iter().map(|&(name, sides)| Self::named(name, sides))
    }

    /// Iterates over the sizes tried by default, smallest first: A4 to A0.
    pub fn automatic() -> impl Iterator<Item = PaperSize> {
        Self::all().rev().skip_while(|size| size.name != "A4")
    }

    /// Describes the accepted values: the named sizes, and an example of a custom size.
    pub fn choice() -> String {
        let (series, other): (Vec<&str>, Vec<&str>) =
            SIZES.iter().map(|&(name, _)| name).partition(|name| name.starts_with('A'));
        let (largest, smallest) = (series[0], series[series.len() - 1]);
        format!("{largest} to {smallest}, {}, or a size such as 297x420mm", other.join(", "))
    }

    fn named(name: &str, [short_mm, long_mm]: [f64; 2]) -> Self {
        Self { name: name.to_owned(), short_mm, long_mm }
    }

    /// Returns the name of a size of this width and height, mm, in either orientation; `None` if it has none.
    pub fn name_of_mm(width: f64, height: f64) -> Option<&'static str> {
        let sides = [width.min(height), width.max(height)];
        let is_same =
            |known: &[f64; 2]| (0..2).all(|side| (known[side] - sides[side]).abs() < 0.01);
        SIZES.iter().find(|(_, known)| is_same(known)).map(|&(name, _)| name)
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the width and height in portrait orientation, mm.
    pub fn portrait_mm(&self) -> DVec2 {
        DVec2::new(self.short_mm, self.long_mm)
    }

    /// Returns the width and height in landscape orientation, mm.
    pub fn landscape_mm(&self) -> DVec2 {
        DVec2::new(self.long_mm, self.short_mm)
    }
}

impl fmt::Display for PaperSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl FromStr for PaperSize {
    type Err = PaperError;

    /// Parses a name, ignoring case, or two lengths such as `297x420mm`, `11 × 17 in` or
    /// `30cmx40cm`.
    fn from_str(text: &str) -> Result<Self, PaperError> {
        let unknown = || PaperError::Unknown(text.to_owned());
        let trimmed = text.trim();
        if let Some(&(name, sides)) = SIZES.iter().find(|(n, _)| n.eq_ignore_ascii_case(trimmed)) {
            return Ok(Self::named(name, sides));
        }
        let (first, second) = trimmed.split_once(['x', 'X', '×']).ok_or_else(unknown)?;
        let (first, second) = (first.trim(), second.trim());
        // A unit after the second length applies to both.
        let unit = second.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
        let shared = first.ends_with(|c: char| c.is_ascii_digit() || c == '.');
        let first = if shared { format!("{first}{unit}") } else { first.to_owned() };
        let sides = [parse_length_mm(&first), parse_length_mm(second)];
        let [Ok(a), Ok(b)] = sides else { return Err(unknown()) };
        if ![a, b].iter().all(|side| (SHORTEST_MM..=LONGEST_MM).contains(side)) {
            return Err(PaperError::Side(text.to_owned()));
        }
        let name = format!("{} × {}", format_mm(a).trim_end_matches(" mm"), format_mm(b));
        Ok(Self { name, short_mm: a.min(b), long_mm: a.max(b) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_sizes_are_parsed() {
        let sides = |text: &str| text.parse::<PaperSize>().unwrap().portrait_mm();
        assert_eq!(sides("a4"), DVec2::new(210.0, 297.0));
        assert_eq!(sides("Letter"), DVec2::new(215.9, 279.4));
        for text in ["297x420mm", "420 x 297 mm", "29.7×42cm", "297mmx42cm", "420x297"] {
            assert!(sides(text).abs_diff_eq(DVec2::new(297.0, 420.0), 1e-9), "{text}");
        }
        let custom: PaperSize = "11x17in".parse().unwrap();
        assert_eq!(custom.name(), "279.4 × 431.8 mm");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "A6", "x", "10x", "297x420km", "A4x"] {
            assert!(matches!(text.parse::<PaperSize>(), Err(PaperError::Unknown(_))), "{text}");
        }
        for text in ["0x100mm", "-210x297mm", "210x9999mm", "1x1m", "49x100mm"] {
            let read = text.parse::<PaperSize>();
            let fine = text == "1x1m";
            assert_eq!(matches!(read, Err(PaperError::Side(_))), !fine, "{text}");
        }
        assert!("NaNxNaN".parse::<PaperSize>().is_err());
    }
}
