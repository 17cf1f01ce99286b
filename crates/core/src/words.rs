//! Formatting of numbers in sentences, and of foreign text on a terminal.

use std::borrow::Cow;

/// Formats a count with its noun in singular or plural.
///
/// ```
/// use deltille_core::words::counted;
///
/// assert_eq!([counted(1, "view"), counted(2, "view")], ["1 view", "2 views"]);
/// ```
pub fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// Formats a p-value; it never rounds to zero or across the level of 0.01.
///
/// ```
/// use deltille_core::words::p_value;
///
/// assert_eq!([0.25, 0.004, 3e-5, 0.0].map(p_value), ["p = 0.25", "p = 0.004", "p = 3e-5", "p < 10⁻⁶"]);
/// ```
pub fn p_value(probability: f64) -> String {
    match probability {
        p if p < 1e-6 => "p < 10⁻⁶".to_owned(),
        p if p < 0.001 => format!("p = {p:.0e}"),
        p if p < 0.01 => format!("p = {p:.3}"),
        p => format!("p = {p:.2}"),
    }
}

/// Maximum number of characters of foreign text that a message quotes.
pub const MAX_QUOTED: usize = 80;

/// Shortens foreign text for a message to at most [`MAX_QUOTED`] characters. The text may be a whole file.
///
/// ```
/// use deltille_core::words::cut;
///
/// assert_eq!(cut("id,A,B"), "id,A,B");
/// assert_eq!(cut(&"x".repeat(5000)).chars().count(), 80);
/// ```
pub fn cut(text: &str) -> Cow<'_, str> {
    if text.char_indices().nth(MAX_QUOTED).is_none() {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.chars().take(MAX_QUOTED - 1).chain(['…']).collect())
}

/// Formats a [`cut`] text between backquotes.
///
/// ```
/// use deltille_core::words::quoted;
///
/// assert_eq!(quoted("id,A,B"), "`id,A,B`");
/// ```
pub fn quoted(text: &str) -> String {
    format!("`{}`", cut(text))
}

/// [Cuts](cut) all text between backquotes or quotation marks in a message.
///
/// ```
/// use deltille_core::words::with_short_quotes;
///
/// assert_eq!(with_short_quotes("`a` and \"b\""), "`a` and \"b\"");
/// let message = format!("family `{}` is unknown", "x".repeat(5000));
/// assert_eq!(with_short_quotes(&message).chars().count(), 80 + "family `` is unknown".len());
/// ```
pub fn with_short_quotes(message: &str) -> Cow<'_, str> {
    if message.char_indices().nth(MAX_QUOTED).is_none() {
        return Cow::Borrowed(message);
    }
    let (mut short, mut rest) = (String::new(), message);
    while let Some(open) = rest.find(['`', '"']) {
        let mark = &rest[open..=open];
        let Some((inside, after)) = rest[open + 1..].split_once(mark) else { break };
        short += &rest[..=open];
        short += &cut(inside);
        short += mark;
        rest = after;
    }
    Cow::Owned(short + rest)
}

/// Returns the number of decimal places that shows two digits of a standard deviation, for it and its value.
///
/// ```
/// use deltille_core::words::places;
///
/// assert_eq!([places(0.00031), places(0.12), places(7.0), places(450.0)], [5, 2, 1, 0]);
/// ```
pub fn places(deviation: f64) -> usize {
    (1.0 - deviation.log10().floor()).clamp(0.0, 12.0) as usize
}

/// Escapes a line for display that may contain words from a file or its name. Escapes characters that end the line,
/// move the cursor, change colours or reverse the writing direction; keeps tabs.
pub fn shown(text: &str) -> Cow<'_, str> {
    let is_harmful = |c: char| {
        let rotations = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        rotations || c.is_control() && c != '\t'
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
    fn foreign_text_cannot_control_a_terminal() {
        assert_eq!(shown("a\tb µ Ω 板"), "a\tb µ Ω 板");
        assert_eq!(shown("\u{1b}[2Jx\r\n\u{202e}"), r"\u{1b}[2Jx\r\n\u{202e}");
    }
}
