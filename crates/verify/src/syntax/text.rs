//! Words, numbers and names in a text, as all readers interpret them.

/// Maximum number of characters of a number: readers accept different lengths.
const MAX_DIGITS: usize = 40;

/// Returns the content of a text file.
pub(super) fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|_| "not a text file in UTF-8".to_owned())
}

/// Returns the first characters of a text for quotation in a finding.
pub(super) fn start(text: &str, characters: usize) -> String {
    text.chars().take(characters).collect()
}

/// Parses a decimal number that all readers accept: digits on both sides of a point, without an exponent or plus
/// sign, and no longer than any reader accepts.
pub(super) fn decimal(word: &str) -> Option<f64> {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let size = word.strip_prefix('-').unwrap_or(word);
    let (whole, fraction) = size.split_once('.').unwrap_or((size, "0"));
    let plain = word.len() <= MAX_DIGITS && digits(whole) && digits(fraction);
    plain.then(|| word.parse().ok()).flatten()
}

/// Whether a name denotes a file in the same folder on every system: it has no path, drive or control characters.
pub(super) fn is_plain_file_name(name: &str) -> bool {
    let listed = |c: char| !matches!(c, '/' | '\\' | ':') && !c.is_control();
    !name.is_empty() && name != ".." && name.trim() == name && name.chars().all(listed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_decimals_and_names_stay_in_the_folder() {
        assert_eq!(decimal("-0.5"), Some(-0.5));
        let long = "0".repeat(50);
        for word in
            ["1e3", "inf", "nan", "0x1", "", "-", "1.2.3", "1,5", "+1", ".5", "5.", "--1", &long]
        {
            assert_eq!(decimal(word), None, "{word}");
        }
        assert!(is_plain_file_name("t-texture.png"));
        for name in [
            "",
            "..",
            "../t.png",
            "/t.png",
            "a\\b.png",
            "c:t.png",
            "http://t/t.png",
            "t.png\r",
            "t.png ",
        ] {
            assert!(!is_plain_file_name(name), "{name}");
        }
    }
}
