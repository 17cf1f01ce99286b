//! Import of families from tables of other programs: C, Rust or Python source, or one code per line.
//!
//! Codes are the hexadecimal words of the text, in order. If there are none, codes are the lines
//! that consist of hexadecimal digits. Bits are read row by row from the upper left, or from the
//! apex for triangles, the first one being the most
//! significant. A table of AprilTag 3 states the positions of its bits in `bit_x` and `bit_y`; its
//! bits are reordered by them.
//!
//! Limits: other orders of bits are not supported. AprilTags whose bits do not fill a square, for example those of
//! tagStandard41h12, are rejected.

use crate::family::{
    Construction, Family, FamilyError, PAIRS_COUNTED, Rules, TagWords, distance_histogram,
};
use crate::lattice::{Dimension, GridKind};
use crate::setting::Setting::{ImportBits, ImportDistance, ImportKind};

/// Properties of a table to import.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportSpec {
    /// Name of the family.
    pub name: String,
    /// Description of the table's source.
    pub source: String,
    /// Kind of the tiles that the tags fill; `None` if it follows from the bit positions in
    /// the table.
    pub kind: Option<GridKind>,
    /// Number of cells of a tag; `None` if the table states it, as in `nbits = 36`.
    pub bits: Option<u32>,
    /// Distance that the family claims; `None` for its actual distance.
    pub distance: Option<u32>,
}

/// Why a table cannot be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The text contains no code.
    #[error(
        "no codes found: a code is a word like 0x08f50a7, or a line of hexadecimal digits only"
    )]
    NoCodes,
    /// There are more codes than can be compared.
    #[error("{found} codes are too many to compare all pairs: at most {PAIRS_COUNTED} are allowed")]
    TooMany {
        /// Number of codes.
        found: usize,
    },
    /// The number of cells is unknown.
    #[error("the table does not state the number of cells of a tag: set {ImportBits}")]
    Bits,
    /// The shape of the tags is unknown.
    #[error("the table does not state whether tags are triangles or squares: set {ImportKind}")]
    Kind,
    /// The bits do not fill a tag.
    #[error("its bits do not fill a square of {bits} cells: such tags are not supported")]
    Places {
        /// Number of bits.
        bits: u32,
    },
    /// The text is a family file, not a table.
    #[error("this is already a family file: pass it with `--family`")]
    FamilyFile,
    /// A tag is rotationally symmetric.
    #[error("code {id} is rotationally symmetric, so its orientation is ambiguous")]
    RotationallySymmetric {
        /// Index of the code.
        id: usize,
    },
    /// Two codes are too close.
    #[error("{ImportDistance}: the distance of its codes is {found}, not {claimed}")]
    Distance {
        /// Smallest distance of two codes.
        found: u32,
        /// Claimed distance.
        claimed: u32,
    },
    /// The codes do not form a family.
    #[error(transparent)]
    Family(#[from] FamilyError),
}

/// Makes a family from the table in a string, and computes its distance by comparing all codes.
///
/// # Errors
/// Returns an error if there is no table, a property of it is unknown, or its codes do not form a family.
///
/// ```
/// use deltille_core::family::{ImportSpec, import};
/// use deltille_core::lattice::GridKind;
///
/// let text = "static const uint64_t codes[] = {0x231bUL, 0x2ea5UL, 0x346aUL};";
/// let (name, source) = ("three".to_owned(), "tag16h5.h".to_owned());
/// let kind = Some(GridKind::Checker);
/// let family = import(text, &ImportSpec { name, source, kind, bits: Some(16), distance: None })?;
/// assert_eq!((family.len(), family.distance()), (3, 6));
/// # Ok::<(), deltille_core::family::ImportError>(())
/// ```
pub fn import(text: &str, spec: &ImportSpec) -> Result<Family, ImportError> {
    if text.trim_start().starts_with('{') && text.contains("\"deltille/family/") {
        return Err(ImportError::FamilyFile);
    }
    let text = without_comments(text);
    let tokens = tokens(&text);
    let codes = codes(&text, &tokens);
    match codes.len() {
        0 => return Err(ImportError::NoCodes),
        found if found > PAIRS_COUNTED => return Err(ImportError::TooMany { found }),
        _ => {}
    }
    let places = places(&tokens);
    let stated = || stated_bits(&tokens).or((!places.is_empty()).then_some(places.len() as u32));
    let bits = spec.bits.or_else(stated).ok_or(ImportError::Bits)?;
    let dimension = Dimension::from_bits(bits)
        .map_err(|error| FamilyError::field("bits", error.to_string()))?;
    let squares = (!places.is_empty()).then_some(GridKind::Checker);
    let kind = spec.kind.or(squares).ok_or(ImportError::Kind)?;
    if let Some(id) = codes.iter().position(Option::is_none) {
        let problem = format!("the code has more than {bits} bits");
        return Err(FamilyError::field(format!("codes[{id}]"), problem).into());
    }
    let codes: Vec<u64> = codes.into_iter().flatten().collect();
    let codes = match places.as_slice() {
        [] => codes,
        places => in_rows(&codes, places, dimension)?,
    };
    // The constructor of the family reports codes that are too wide or duplicate.
    let fit = codes.iter().all(|&code| code <= dimension.mask());
    let histogram = distance_histogram(kind, dimension, if fit { &codes } else { &[] });
    let found = histogram.keys().next().copied().unwrap_or(bits);
    let words = TagWords::of(kind, dimension);
    let is_own_turn = |&code: &u64| {
        let rotations =
            std::iter::successors(Some(words.rotate(code)), |&word| Some(words.rotate(word)));
        rotations.take(usize::from(kind.rotations()) - 1).any(|turned| turned == code)
    };
    if fit && let Some(id) = codes.iter().position(is_own_turn) {
        return Err(ImportError::RotationallySymmetric { id });
    }
    if let Some(claimed) = spec.distance.filter(|&claimed| fit && claimed > found && found > 0) {
        return Err(ImportError::Distance { found, claimed });
    }
    let distance = spec.distance.unwrap_or(found.max(1));
    let construction = Construction::Imported { source: spec.source.clone() };
    Ok(Family::of(&spec.name, kind, dimension, distance, codes, Rules::NONE, construction)?)
}

/// Removes the comments of C, Rust and Python from source text.
fn without_comments(text: &str) -> String {
    let mut left = String::with_capacity(text.len());
    let mut rest = text;
    let starts = [("/*", "*/"), ("\"\"\"", "\"\"\""), ("//", "\n"), ("#", "\n")];
    while let Some((at, (start, end))) =
        starts.iter().filter_map(|pair| Some((rest.find(pair.0)?, *pair))).min_by_key(|(at, _)| *at)
    {
        left += &rest[..at];
        let after = &rest[at + start.len()..];
        left.push('\n');
        rest = after.find(end).map_or("", |found| &after[found + end.len()..]);
    }
    left + rest
}

/// Splits a text into names, numbers and other single characters; drops whitespace.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = match is_word(first) {
            true => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        if !first.is_whitespace() {
            tokens.push(&rest[..end]);
        }
        rest = &rest[end..];
    }
    tokens
}

/// Returns the codes of a table; `None` for words that are wider than any code.
fn codes(text: &str, tokens: &[&str]) -> Vec<Option<u64>> {
    let is_hex = |c: char| c.is_ascii_hexdigit();
    let number = |digits: &str| u64::from_str_radix(digits, 16).ok();
    let word = |token: &&str| {
        let digits = token.strip_prefix("0x").or_else(|| token.strip_prefix("0X"))?;
        let end = digits.find(|c| !is_hex(c)).unwrap_or(digits.len());
        (end > 0).then(|| number(&digits[..end]))
    };
    let words: Vec<Option<u64>> = tokens.iter().filter_map(word).collect();
    if !words.is_empty() {
        return words;
    }
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.filter(|line| line.chars().all(is_hex)).map(number).collect()
}

/// Returns the number of cells that a table states, as in `nbits = 36` or `BITS: u32 = 36`.
fn stated_bits(tokens: &[&str]) -> Option<u32> {
    let names_bits = |token: &str| token.to_ascii_lowercase().ends_with("bits");
    tokens.iter().enumerate().filter(|(_, token)| names_bits(token)).find_map(|(i, _)| {
        let after = tokens[i + 1..].iter().skip_while(|token| [":", "=", "u32"].contains(token));
        after.take(1).find_map(|token| token.parse().ok())
    })
}

/// Returns the column and row of each bit, the most significant first, if the table contains them.
fn places(tokens: &[&str]) -> Vec<[u32; 2]> {
    let mut places: Vec<[Option<u32>; 2]> = Vec::new();
    for window in tokens.windows(6) {
        let [name @ ("bit_x" | "bit_y"), "[", index, "]", "=", value] = window else { continue };
        let (Ok(index), Ok(value)) = (index.parse::<usize>(), value.parse::<u32>()) else {
            continue;
        };
        // No tag has more bits than a word.
        if index < 64 {
            places.resize(places.len().max(index + 1), [None; 2]);
            places[index][usize::from(*name == "bit_y")] = Some(value);
        }
    }
    places.into_iter().map(|[x, y]| [x.unwrap_or(u32::MAX), y.unwrap_or(u32::MAX)]).collect()
}

/// Reorders the bits of codes row by row, given the position of each bit.
fn in_rows(
    codes: &[u64],
    places: &[[u32; 2]],
    dimension: Dimension,
) -> Result<Vec<u64>, ImportError> {
    let (bits, side) = (dimension.bits(), dimension.rows());
    let not_square = || ImportError::Places { bits: places.len() as u32 };
    let least = |axis: usize| places.iter().map(|place| place[axis]).min().unwrap_or(0);
    let (left, top) = (least(0), least(1));
    let mut to = Vec::new();
    for &[x, y] in places {
        let (column, row) = (x - left, y - top);
        if column >= side || row >= side {
            return Err(not_square());
        }
        to.push(bits - 1 - (row * side + column));
    }
    let mut filled = to.clone();
    filled.sort_unstable();
    if !filled.into_iter().eq(0..bits) {
        return Err(not_square());
    }
    let moved = |&code: &u64| {
        (0..bits).zip(&to).fold(0, |word, (i, to)| word | (code >> (bits - 1 - i) & 1) << to)
    };
    Ok(codes.iter().map(moved).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::{ExportFormat, export};

    fn spec(kind: Option<GridKind>, bits: Option<u32>) -> ImportSpec {
        let (name, source) = ("imported".to_owned(), "a table".to_owned());
        ImportSpec { name, source, kind, bits, distance: None }
    }

    #[test]
    fn exported_families_import_with_the_same_fingerprint() {
        let family = Family::shipped("delTag16h5").unwrap();
        for format in [ExportFormat::C, ExportFormat::Rust, ExportFormat::Python] {
            let text = export(&family, format);
            let read = import(&text, &spec(Some(GridKind::Deltille), None)).unwrap();
            assert_eq!(read.fingerprint(), family.fingerprint(), "{text}");
        }
        let text = export(&family, ExportFormat::Text);
        for text in [text.clone(), text.replace("0x", "")] {
            let read = import(&text, &spec(Some(GridKind::Deltille), Some(16))).unwrap();
            assert_eq!(read.fingerprint(), family.fingerprint());
        }
    }

    /// The table of a tag with bits in rotational order as in AprilTag 3: each quarter is the previous one, rotated.
    #[test]
    fn bits_are_reordered_by_their_positions() {
        let family = Family::shipped("aprilTag16h5").unwrap();
        let quarter = [(1, 1), (2, 1), (3, 1), (2, 2)];
        let places = (0..4)
            .flat_map(|turn| quarter.map(|place| (0..turn).fold(place, |(x, y), _| (5 - y, x))));
        let places: Vec<(u32, u32)> = places.collect();
        let code_of = |code: u64| {
            places
                .iter()
                .fold(0, |word, &(x, y)| word << 1 | code >> (15 - ((y - 1) * 4 + x - 1)) & 1)
        };
        let codes: String =
            family.codes().iter().map(|&code| format!("0x{:016x}UL,\n", code_of(code))).collect();
        let lines = places.iter().enumerate();
        let lines =
            lines.map(|(i, (x, y))| format!("tf->bit_x[{i}] = {x};\ntf->bit_y[{i}] = {y};\n"));
        let text = format!(
            "/* 0xdead */ static uint64_t codedata[30] = {{\n{codes}}};\ntf->nbits = 16;\n{}",
            lines.collect::<String>()
        );
        let read = import(&text, &spec(None, None)).unwrap();
        assert_eq!((read.codes(), read.kind()), (family.codes(), GridKind::Checker));
        assert_eq!(read.fingerprint(), family.fingerprint());
        let outside = text.replace("bit_x[3] = 2;", "bit_x[3] = 9;");
        assert!(matches!(import(&outside, &spec(None, None)), Err(ImportError::Places { .. })));
    }

    #[test]
    fn texts_without_a_valid_table_are_rejected() {
        let squares = Some(GridKind::Checker);
        let message = |text: &str, spec: ImportSpec| import(text, &spec).unwrap_err().to_string();
        assert!(message("", spec(squares, Some(16))).starts_with("no codes found"));
        assert!(message("0x231b", spec(squares, None)).contains("`ImportSpec::bits`"));
        assert!(message("0x231b", spec(None, Some(16))).contains("`ImportSpec::kind`"));
        assert!(message("0x231b", spec(squares, Some(17))).contains("17"));
        assert!(message("0x1231b", spec(squares, Some(16))).contains("more than 16 bits"));
        let wide = format!("0x{}", "f".repeat(17));
        for bits in [16, 64] {
            let error = message(&wide, spec(squares, Some(bits)));
            assert!(error.contains(&format!("more than {bits} bits")), "{error}");
        }
        assert!(message("0x231b 0x231b", spec(squares, Some(16))).contains("repeats code 0"));
        let claims = ImportSpec { distance: Some(9), ..spec(squares, Some(16)) };
        assert!(message("0x231b 0x2ea5", claims).contains("`ImportSpec::distance`"));
    }
}
