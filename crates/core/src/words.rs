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

/// A p-value as tests give it: never rounded to zero, nor across the level of 0.01.
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

/// Most characters of a text of others that a message repeats.
pub const MOST_QUOTED: usize = 80;

/// A text of others in a message: all of it, or the beginning of one that may be a whole file, in
/// at most [`MOST_QUOTED`] characters.
///
/// ```
/// use deltille_core::words::cut;
///
/// assert_eq!(cut("id,A,B"), "id,A,B");
/// assert_eq!(cut(&"x".repeat(5000)).chars().count(), 80);
/// ```
pub fn cut(text: &str) -> Cow<'_, str> {
    if text.char_indices().nth(MOST_QUOTED).is_none() {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.chars().take(MOST_QUOTED - 1).chain(['…']).collect())
}

/// A [`cut`] text between backquotes.
///
/// ```
/// use deltille_core::words::quoted;
///
/// assert_eq!(quoted("id,A,B"), "`id,A,B`");
/// ```
pub fn quoted(text: &str) -> String {
    format!("`{}`", cut(text))
}

/// A message in which everything between backquotes, or between quotation marks, is [`cut`].
///
/// ```
/// use deltille_core::words::with_short_quotes;
///
/// assert_eq!(with_short_quotes("`a` and \"b\""), "`a` and \"b\"");
/// let message = format!("family `{}` is not known", "x".repeat(5000));
/// assert_eq!(with_short_quotes(&message).chars().count(), 80 + "family `` is not known".len());
/// ```
pub fn with_short_quotes(message: &str) -> Cow<'_, str> {
    if message.char_indices().nth(MOST_QUOTED).is_none() {
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
