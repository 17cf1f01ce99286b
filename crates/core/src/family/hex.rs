//! Words of cells as hexadecimal numbers.

/// Parses a word written as 0x….
pub fn parse_word(text: &str) -> Option<u64> {
    let digits = text.strip_prefix("0x")?;
    // from_str_radix would accept a sign.
    digits.chars().all(|c| c.is_ascii_hexdigit()).then(|| u64::from_str_radix(digits, 16).ok())?
}
