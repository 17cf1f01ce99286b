//! Readable messages for errors of JSON, YAML and TOML parsers.

use std::fmt::Display;

use crate::words::{cut, with_short_quotes};

/// Rewrites the message of a parser without names of Rust types.
///
/// ```
/// use deltille_core::reading::in_words;
///
/// let said = in_words("focal_px: invalid length 0, expected a sequence of 2 f64 values at line 3 column 10");
/// assert_eq!(said, "focal_px: expected a list of 2 numbers, found 0 values (line 3)");
/// let said = in_words("EOF while parsing an object at line 7 column 1");
/// assert_eq!(said, "the text ends inside an object and may be truncated (line 7)");
/// ```
pub fn in_words(message: impl Display) -> String {
    let message = message.to_string();
    if message.ends_with(" at line 1 column 0") {
        return "the text is empty".to_owned();
    }
    let (message, line) = without_position(&message);
    let at = KNOWN.iter().filter_map(|(start, _)| starts_at(message, start)).min().unwrap_or(0);
    let (before, said) = message.split_at(at);
    let known = KNOWN.iter().find_map(|(start, rewrite)| rewrite(said.strip_prefix(start)?));
    let said = known.unwrap_or_else(|| said.to_owned());
    let (before, said) = (with_short_quotes(before), with_short_quotes(&said));
    match line {
        Some(line) => format!("{before}{said} (line {line})"),
        None => format!("{before}{said}"),
    }
}

/// Rewrites the rest of a message; `None` if it does not have the parser's usual form.
type Rewrite = fn(&str) -> Option<String>;

/// Beginnings of messages, and how the rest is rewritten.
const KNOWN: &[(&str, Rewrite)] = &[
    ("EOF while parsing ", |what| {
        Some(format!("the text ends inside {what} and may be truncated"))
    }),
    ("missing field ", |field| Some(format!("missing field {field}"))),
    ("duplicate field ", |field| Some(format!("field {field} appears twice"))),
    ("unknown field ", |rest| unknown("field ", rest)),
    ("unknown variant ", |rest| unknown("value ", rest)),
    ("invalid type: ", mismatch),
    ("invalid value: ", mismatch),
    ("invalid length ", |rest| {
        let (count, wanted) = rest.split_once(", expected ")?;
        let s = if count == "1" { "" } else { "s" };
        Some(format!("expected {}, found {count} value{s}", expected(wanted)))
    }),
];

/// Splits the position from the end of a message; returns the message and the line number.
fn without_position(message: &str) -> (&str, Option<&str>) {
    let parts = message.rsplit_once(" at line ").and_then(|(before, place)| {
        let (line, column) = place.split_once(" column ")?;
        let are_numbers = [line, column].iter().all(|n| n.bytes().all(|b| b.is_ascii_digit()));
        are_numbers.then_some((before, Some(line)))
    });
    parts.unwrap_or((message, None))
}

/// Finds where a message starts with `start`: at the beginning, or after the name of the field.
fn starts_at(message: &str, start: &str) -> Option<usize> {
    if message.starts_with(start) {
        return Some(0);
    }
    message.match_indices(": ").map(|(at, _)| at + 2).find(|&at| message[at..].starts_with(start))
}

fn unknown(what: &str, rest: &str) -> Option<String> {
    // The name comes from the file and may contain anything.
    let (name, known) = match rest.rsplit_once(", expected ") {
        Some(parts) => parts,
        // Other messages are left unchanged, for example those that were already rewritten.
        None => (rest.strip_suffix(", there are no fields")?, ""),
    };
    let name = cut_name(name);
    let known = known.strip_prefix("one of ").unwrap_or(known);
    Some(match known {
        "" => format!("unknown {what}{name}"),
        known => format!("unknown {what}{name} (known: {known})"),
    })
}

/// Shortens a name between backquotes.
fn cut_name(name: &str) -> String {
    match name.strip_prefix('`').and_then(|name| name.strip_suffix('`')) {
        Some(name) => format!("`{}`", cut(name)),
        None => cut(name).into_owned(),
    }
}

fn mismatch(rest: &str) -> Option<String> {
    let (there, wanted) = rest.rsplit_once(", expected ")?;
    Some(format!("expected {}, found {}", expected(wanted), found(there)))
}

fn found(what: &str) -> String {
    let value = ["integer ", "floating point ", "boolean ", "character "];
    if let Some(value) = value.iter().find_map(|kind| what.strip_prefix(kind)) {
        return value.to_owned();
    }
    match what {
        "sequence" => "a list".to_owned(),
        "map" => "an object".to_owned(),
        "unit value" | "null" | "Option value" => "no value".to_owned(),
        _ => match what.strip_prefix("string ") {
            Some(text) => {
                let inside = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
                format!("the string \"{}\"", cut(inside.unwrap_or(text)))
            }
            None => cut(what).into_owned(),
        },
    }
}

fn expected(what: &str) -> String {
    let numbers = what.strip_prefix("a sequence of ").and_then(|rest| rest.strip_suffix(" values"));
    if let Some(count) = numbers.and_then(|rest| rest.split(' ').next()) {
        return format!("a list of {count} numbers");
    }
    if let Some(count) = what.strip_prefix("an array of length ") {
        return format!("a list of {count} values");
    }
    let plain = match what {
        "f64" | "f32" | "float" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a non-negative integer",
        "i8" | "i16" | "i32" | "i64" | "isize" => "an integer",
        "a string" | "a borrowed string" => "a string",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        "a map" => "an object",
        "field identifier" | "variant identifier" => "a name",
        _ if what.starts_with("struct ") => "an object with named fields",
        _ if what.starts_with("enum ") || what.starts_with("variant of enum ") => {
            "one of the known names"
        }
        _ => what,
    };
    plain.to_owned()
}

#[cfg(test)]
mod tests {
    use super::in_words;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        #[serde(rename = "count")]
        _count: u32,
        #[serde(rename = "place")]
        _place: [f64; 2],
        #[serde(rename = "kind")]
        _kind: Kind,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        Here,
        There,
    }

    #[test]
    fn parser_messages_are_rewritten() {
        for (text, wanted) in [
            ("", "the text is empty"),
            ("{\"count\": 1", "the text ends inside an object and may be truncated (line 1)"),
            ("\n[", "the text ends inside a list and may be truncated (line 2)"),
            ("{\"count\": -1}", "expected a non-negative integer, found `-1` (line 1)"),
            (
                "{\"count\": \"a, b\"}",
                "expected a non-negative integer, found the string \"a, b\" (line 1)",
            ),
            ("{\"count\": 1, \"count\": 2}", "field `count` appears twice (line 1)"),
            ("{\"count\": 1}", "missing field `place` (line 1)"),
            ("{\"a\": 1}", "unknown field `a` (known: `count`, `place`, `kind`) (line 1)"),
            ("{\"place\":\n[1]}", "expected a list of 2 values, found 1 value (line 2)"),
            ("{\"kind\": \"x\"}", "unknown value `x` (known: `here` or `there`) (line 1)"),
            ("{\"count\": 1 x", "expected `,` or `}` (line 1)"),
        ] {
            let said = in_words(serde_json::from_str::<File>(text).unwrap_err());
            assert!(said.starts_with(wanted), "{text}: {said}");
        }
    }

    #[test]
    fn quotes_from_a_file_are_short() {
        // Quotation marks and commas in the file do not matter.
        for word in ["x", "`, `", "\\\"a\\\", ", ", expected one of `"] {
            let long = word.repeat(3000);
            for text in [
                format!("{{\"{long}\": 1}}"),
                format!("{{\"kind\": \"{long}\"}}"),
                format!("{{\"count\": \"{long}\"}}"),
            ] {
                let said = in_words(serde_json::from_str::<File>(&text).unwrap_err());
                assert!(said.chars().count() < 250, "{said}");
            }
        }
    }
}
