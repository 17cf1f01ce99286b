use glam::DVec3;

/// Units in millimetres. Longer names come first, so that `m` does not match the end of `mm`.
const UNITS: [(&str, f64); 5] =
    [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72.0), ("m", 1000.0)];

/// A string that is not a length.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a length (examples: 20mm, 2cm, 0.02m, 0.79in, 57pt)")]
pub struct LengthError(pub String);

/// Parses a length with its unit, for example `20mm`, `2 cm`, `0.02m`, `0.79in` or `57pt`. A bare number is in
/// millimetres. The result is finite; it may be zero or negative.
///
/// ```
/// assert_eq!(deltille_core::targets::parse_length_mm("2.5 cm"), Ok(25.0));
/// assert!(deltille_core::targets::parse_length_mm("20 parsec").is_err());
/// ```
///
/// # Errors
/// Returns an error if the text is not a number with a known unit.
pub fn parse_length_mm(text: &str) -> Result<f64, LengthError> {
    let trimmed = text.trim();
    let (number, unit_mm) = UNITS
        .iter()
        .find_map(|&(unit, mm)| Some((trimmed.strip_suffix(unit)?, mm)))
        .unwrap_or((trimmed, 1.0));
    match number.trim_end().parse::<f64>() {
        Ok(value) if (value * unit_mm).is_finite() => Ok(value * unit_mm),
        _ => Err(LengthError(text.to_owned())),
    }
}

/// Parses the three edge lengths of a box, for example `200x150x100mm`, `20 × 15 × 10 cm` or
/// `200mm x 15cm x 0.1m`. A length without a unit has the unit of the last one.
///
/// ```
/// let sides = deltille_core::targets::parse_box_mm("20x15x10 cm");
/// assert_eq!(sides, Ok(glam::DVec3::new(200.0, 150.0, 100.0)));
/// ```
///
/// # Errors
/// Returns an error if the text is not three lengths.
pub fn parse_box_mm(text: &str) -> Result<DVec3, BoxError> {
    let unknown = || BoxError(text.to_owned());
    let sides: Vec<&str> = text.split(['x', 'X', '×']).map(str::trim).collect();
    let [first, second, last] = sides[..] else { return Err(unknown()) };
    let unit = last.trim_start_matches(|c: char| !c.is_alphabetic());
    let side = |text: &str| match text.ends_with(char::is_alphabetic) {
        true => parse_length_mm(text),
        false => parse_length_mm(&format!("{text}{unit}")),
    };
    match [side(first), side(second), side(last)] {
        [Ok(x), Ok(y), Ok(z)] if x.min(y).min(z) > 0.0 => Ok(DVec3::new(x, y, z)),
        _ => Err(unknown()),
    }
}

/// A string that does not consist of three positive lengths.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` does not consist of three positive lengths (example: 200x150x100mm)")]
pub struct BoxError(pub String);

/// Formats a length in millimetres as briefly as possible, with its unit: `20 mm`, `12.5 mm`.
pub fn format_mm(mm: f64) -> String {
    if mm.abs() > 1e9 {
        return format!("{mm:e} mm");
    }
    // A nanometre is finer than any print. Rounding to it hides the noise of unit conversion.
    format!("{} mm", (mm * 1e6).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_unit_is_parsed() {
        for text in ["25.4mm", "2.54cm", "0.0254 m", "1in", "72pt", " 25.4 ", "2.54e1mm"] {
            assert!((parse_length_mm(text).unwrap() - 25.4).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn nonfinite_numbers_are_rejected() {
        for text in ["", "mm", "NaN", "nanmm", "inf", "1e999mm", "20 km", "2,5cm", "20mm mm"] {
            assert_eq!(parse_length_mm(text), Err(LengthError(text.to_owned())));
        }
    }

    #[test]
    fn box_sides_inherit_the_last_unit() {
        for text in ["200x150x100mm", "20 × 15 X 10 cm", "0.2mx15cmx100", " 200 x 150 x 100 "] {
            assert_eq!(parse_box_mm(text), Ok(DVec3::new(200.0, 150.0, 100.0)), "{text}");
        }
        for text in ["", "200", "200x150mm", "1x2x3x4", "axbxc", "1x-2x3", "1x2xmm", "1x2x3km"] {
            assert_eq!(parse_box_mm(text), Err(BoxError(text.to_owned())));
        }
    }

    proptest! {
        #[test]
        fn formatting_reads_back(mm in 0.01f64..5000.0) {
            let back = parse_length_mm(&format_mm(mm)).unwrap();
            prop_assert!((back - mm).abs() < 1e-6);
        }

        #[test]
        fn no_text_panics(text in ".*") {
            let _ = parse_length_mm(&text);
        }
    }
}
