//! Numbers in sentences, and texts of others on a terminal.

use std::borrow::Cow;

/// A number of things, in the right number.
///
/// ```
/// use deltille_core::words::counted;
///
/// assert_eq!([counted(1, "view"), counted(2, "view")], ["1 view", "2 views"]);
/// ```
pub fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// What is quoted of a text: all of it, or the beginning of one that may be a whole file.
///
/// ```
/// use deltille_core::words::quoted;
///
/// assert_eq!(quoted("id,A,B"), "`id,A,B`");
/// assert!(quoted(&"x".repeat(5000)).len() < 80);
/// ```
pub fn quoted(text: &str) -> String {
    const MOST_CHARACTERS: usize = 60;
    match text.char_indices().nth(MOST_CHARACTERS) {
        Some((end, _)) => format!("`{} …`", &text[..end]),
        None => format!("`{text}`"),
    }
}

/// How many places two digits of a standard deviation need, and so the value that it belongs to.
///
/// ```
/// use deltille_core::words::places;
///
/// assert_eq!([places(0.00031), places(0.12), places(7.0), places(450.0)], [5, 2, 1, 0]);
/// ```
pub fn places(deviation: f64) -> usize {
    (1.0 - deviation.log10().floor()).clamp(0.0, 12.0) as usize
}

/// A line with words that may come from a file or its name, as it is shown: what would end the line, move the cursor,
/// change colours or turn the direction of writing is escaped; tabs stay.
pub fn shown(text: &str) -> Cow<'_, str> {
    let is_harmful = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        turns || c.is_control() && c != '\t'
    };
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| -> String {
        if is_harmful(c) { c.escape_default().collect() } else { c.to_string() }
    };
    Cow::Owned(text.chars().map(escaped).collect())
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn texts_of_others_do_nothing_to_a_terminal() {
        assert_eq!(shown("a\tb µ Ω 板"), "a\tb µ Ω 板");
        assert_eq!(shown("\u{1b}[2Jx\r\n\u{202e}"), r"\u{1b}[2Jx\r\n\u{202e}");
    }
}
