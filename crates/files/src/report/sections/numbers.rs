//! Columns of numbers in tables, aligned at the decimal point.
//!
//! Values rounded to two digits of their standard deviation have different numbers of decimal places. All digits have the
//! same width, so the part from the decimal point on is given the width of the longest fraction in its column:
//!
//! ```text
//!      899.97
//!      −0.0012
//!      12
//! ```

use deltille_core::words::places;

/// The cells of a column of texts. Numbers are aligned at the decimal point; integers end before it. Other texts, such as a
/// dash, are right-aligned.
pub(super) fn aligned(texts: &[String]) -> Vec<String> {
    let longest = texts.iter().filter(|text| is_number(text)).map(|text| split(text).1.len()).max();
    // A decimal point is about half as wide as a digit.
    let digits = longest.unwrap_or(0).saturating_sub(1);
    let cell = |text: &String| {
        if digits == 0 || !is_number(text) {
            return format!("<td class=\"number\">{text}</td>");
        }
        let (whole, fraction) = split(text);
        format!(
            "<td class=\"number\">{whole}<span class=\"fraction\" style=\"width:{digits}.5ch\">{fraction}</span></td>"
        )
    };
    texts.iter().map(cell).collect()
}

/// Whether a text begins with a digit or with a minus and a digit.
fn is_number(text: &str) -> bool {
    text.trim_start_matches('−').starts_with(|c: char| c.is_ascii_digit())
}

/// Splits a number before its decimal point.
fn split(number: &str) -> (&str, &str) {
    number.split_at(number.find('.').unwrap_or(number.len()))
}

/// A value rounded to two digits of its standard deviation, and the standard deviation.
pub(super) fn rounded(value: f64, sd: Option<f64>) -> (String, String) {
    let sign = |text: String| text.replace('-', "−");
    match sd {
        Some(sd) if sd > 0.0 && sd.is_finite() => {
            let places = places(sd);
            // Zero has no sign.
            let value = if 2.0 * value.abs() < 0.1_f64.powi(places as i32) { 0.0 } else { value };
            (sign(format!("{value:.places$}")), format!("{sd:.places$}"))
        }
        _ => (sign(value.to_string()), "kept".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_in_a_column_have_equal_width() {
        let texts = ["899.97", "−0.0012", "12", "kept", "", "–"].map(str::to_owned);
        let cells = aligned(&texts);
        let fraction = |whole: &str, fraction: &str| {
            format!(
                "<td class=\"number\">{whole}<span class=\"fraction\" style=\"width:4.5ch\">{fraction}</span></td>"
            )
        };
        assert_eq!(cells[0], fraction("899", ".97"));
        assert_eq!(cells[1], fraction("−0", ".0012"));
        assert_eq!(cells[2], fraction("12", ""));
        for (cell, text) in cells[3..].iter().zip(["kept", "", "–"]) {
            assert_eq!(*cell, format!("<td class=\"number\">{text}</td>"));
        }
    }

    #[test]
    fn whole_numbers_need_no_fractions() {
        let cells = aligned(&["7".to_owned(), "130".to_owned()]);
        assert_eq!(cells, ["<td class=\"number\">7</td>", "<td class=\"number\">130</td>"]);
    }
}
