//! What readers of JSON, YAML and TOML say of a text, in words for whoever wrote it.

use std::fmt::Display;

use crate::words::{cut, with_short_quotes};

/// What the message of a reader says, without the names of Rust's types.
///
/// ```
/// use deltille_core::reading::in_words;
///
/// let said = in_words("focal_px: invalid length 0, expected a sequence of 2 f64 values at line 3 column 10");
/// assert_eq!(said, "focal_px: there are 0 values where a list of 2 numbers belongs (line 3)");
/// let said = in_words("EOF while parsing an object at line 7 column 1");
/// assert_eq!(said, "the text ends within an object, as if it was cut off (line 7)");
/// ```
pub fn in_words(message: impl Display) -> String {
    let message = message.to_string();
    if message.ends_with(" at line 1 column 0") {
        return "the text is empty".to_owned();
    }
    let (message, line) = without_place(&message);
    let at = KNOWN.iter().filter_map(|(start, _)| starts_at(message, start)).min().unwrap_or(0);
    let (before, said) = message.split_at(at);
    let known = KNOWN.iter().find_map(|(start, told)| told(said.strip_prefix(start)?));
    let said = known.unwrap_or_else(|| said.to_owned());
    let (before, said) = (with_short_quotes(before), with_short_quotes(&said));
    match line {
        Some(line) => format!("{before}{said} (line {line})"),
        None => format!("{before}{said}"),
    }
}

/// What is told of the rest of a message; `None` where that is not as readers put it.
type Telling = fn(&str) -> Option<String>;

/// How messages begin, and what is told of the rest.
const KNOWN: &[(&str, Telling)] = &[
    ("EOF while parsing ", |what| {
        Some(format!("the text ends within {what}, as if it was cut off"))
    }),
    ("missing field ", |field| Some(format!("field {field} is missing"))),
    ("duplicate field ", |field| Some(format!("field {field} is there twice"))),
    ("unknown field ", |rest| unknown("field ", rest)),
    ("unknown variant ", |rest| unknown("", rest)),
    ("invalid type: ", in_place_of),
    ("invalid value: ", in_place_of),
    ("invalid length ", |rest| {
        let (count, wanted) = rest.split_once(", expected ")?;
        let (verb, s) = if count == "1" { ("is", "") } else { ("are", "s") };
        Some(format!("there {verb} {count} value{s} where {} belongs", expected(wanted)))
    }),
];

/// The message before the place that it ends with, and the line of that.
fn without_place(message: &str) -> (&str, Option<&str>) {
    let parts = message.rsplit_once(" at line ").and_then(|(before, place)| {
        let (line, column) = place.split_once(" column ")?;
        let are_numbers = [line, column].iter().all(|n| n.bytes().all(|b| b.is_ascii_digit()));
        are_numbers.then_some((before, Some(line)))
    });
    parts.unwrap_or((message, None))
}

/// Where a message begins like this: at once, or after the field that it is about.
fn starts_at(message: &str, start: &str) -> Option<usize> {
    if message.starts_with(start) {
        return Some(0);
    }
    message.match_indices(": ").map(|(at, _)| at + 2).find(|&at| message[at..].starts_with(start))
}

fn unknown(what: &str, rest: &str) -> Option<String> {
    // The name is the file's, and may hold anything.
    let (name, known) = rest.rsplit_once(", expected ").unwrap_or((rest, ""));
    let name = cut_name(name.strip_suffix(", there are no fields").unwrap_or(name));
    let known = known.strip_prefix("one of ").unwrap_or(known);
    Some(match known {
        "" => format!("{what}{name} is not known"),
        known => format!("{what}{name} is not known; there are {known}"),
    })
}

/// A name between backquotes, in short.
fn cut_name(name: &str) -> String {
    match name.strip_prefix('`').and_then(|name| name.strip_suffix('`')) {
        Some(name) => format!("`{}`", cut(name)),
        None => cut(name).into_owned(),
    }
}

fn in_place_of(rest: &str) -> Option<String> {
    let (there, wanted) = rest.rsplit_once(", expected ")?;
    Some(format!("{} stands where {} belongs", found(there), expected(wanted)))
}

fn found(what: &str) -> String {
    let value = ["integer ", "floating point ", "boolean ", "character "];
    if let Some(value) = value.iter().find_map(|kind| what.strip_prefix(kind)) {
        return value.to_owned();
    }
    match what {
        "sequence" => "a list".to_owned(),
        "map" => "an object".to_owned(),
        "unit value" | "null" | "Option value" => "nothing".to_owned(),
        _ => match what.strip_prefix("string ") {
            Some(text) => {
                let inside = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
                format!("the text \"{}\"", cut(inside.unwrap_or(text)))
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
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more,",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a string" | "a borrowed string" => "a text",
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
    fn readers_are_understood() {
        for (text, told) in [
            ("", "the text is empty"),
            ("{\"count\": 1", "the text ends within an object, as if it was cut off (line 1)"),
            ("\n[", "the text ends within a list, as if it was cut off (line 2)"),
            ("{\"count\": -1}", "`-1` stands where a whole number, 0 or more, belongs (line 1)"),
            (
                "{\"count\": \"a, b\"}",
                "the text \"a, b\" stands where a whole number, 0 or more, belongs (line 1)",
            ),
            ("{\"count\": 1, \"count\": 2}", "field `count` is there twice (line 1)"),
            ("{\"count\": 1}", "field `place` is missing (line 1)"),
            ("{\"a\": 1}", "field `a` is not known; there are `count`, `place`, `kind` (line 1)"),
            ("{\"place\":\n[1]}", "there is 1 value where a list of 2 values belongs (line 2)"),
            ("{\"kind\": \"x\"}", "`x` is not known; there are `here` or `there` (line 1)"),
            ("{\"count\": 1 x", "expected `,` or `}` (line 1)"),
        ] {
            let said = in_words(serde_json::from_str::<File>(text).unwrap_err());
            assert!(said.starts_with(told), "{text}: {said}");
        }
    }

    #[test]
    fn what_a_file_has_is_repeated_in_short() {
        // Quotation marks and commas in it change nothing.
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
