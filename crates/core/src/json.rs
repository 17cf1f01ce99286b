//! Readable JSON text: one record per line.

use std::io;

use serde::{Deserialize, Serialize};
use serde_json::ser::{CompactFormatter, Formatter, PrettyFormatter};

use crate::reading::in_words;
use crate::words::cut;

/// Serialises plain data, indented down to `depth` levels; deeper values stay on one line.
pub fn to_text<T: Serialize>(value: &T, depth: usize) -> String {
    let mut text = Vec::new();
    let layout = Layout { pretty: PrettyFormatter::new(), depth, level: 0 };
    let mut serializer = serde_json::Serializer::with_formatter(&mut text, layout);
    value.serialize(&mut serializer).expect("plain data has a JSON form");
    text.push(b'\n');
    String::from_utf8(text).expect("JSON is UTF-8")
}

/// Why a JSON string could not be read.
pub enum ReadError {
    /// Not JSON, or not an object of this kind at all.
    Json(serde_json::Error),
    /// A field is missing, unknown or invalid.
    Field {
        /// Path of the field, for example `panels[2].corners`.
        field: String,
        /// The problem with the field.
        problem: String,
    },
}

/// Parses JSON. The error names the field if the text is valid JSON.
///
/// # Errors
/// Returns an error if the text is not JSON, or a field is missing, unknown or invalid.
pub fn read<T: serde::de::DeserializeOwned>(json: &str) -> Result<T, ReadError> {
    check_object(json.as_bytes()).map_err(ReadError::Json)?;
    let mut deserializer = serde_json::Deserializer::from_str(json);
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let field = error.path().to_string();
        let inner = error.into_inner();
        if inner.is_data() && field != "." {
            ReadError::Field { field, problem: in_words(&inner) }
        } else {
            ReadError::Json(inner)
        }
    })?;
    deserializer.end().map_err(ReadError::Json)?;
    Ok(value)
}

/// Reads the schema that a JSON string names, for example `deltille/target/1`, shortened if it is
/// very long. Returns
/// `None` if it names none.
///
/// # Errors
/// Returns an error if the text is not a JSON object.
pub fn schema(text: &[u8]) -> serde_json::Result<Option<String>> {
    #[derive(Deserialize)]
    struct Head {
        schema: Option<String>,
    }
    check_object(text)?;
    serde_json::from_slice::<Head>(text).map(|head| head.schema.map(|schema| cut(&schema).into()))
}

/// Reads the schema that a JSON string must name. Callers read it first, so that a file of another
/// kind or version is
/// reported as one.
///
/// # Errors
/// Returns an error if the text is not JSON or names no schema.
pub fn named_schema(json: &str) -> Result<String, ReadError> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    read::<Head>(json).map(|head| cut(&head.schema).into())
}

/// Rejects a list: serde would assign its values to the fields in order.
fn check_object(text: &[u8]) -> serde_json::Result<()> {
    match text.trim_ascii_start().first() {
        Some(b'[') => Err(serde::de::Error::custom("expected an object, found a list")),
        _ => Ok(()),
    }
}

/// Returns the kind of a schema, for example `deltille/target` for `deltille/target/1`.
pub fn kind(schema: &str) -> &str {
    schema.rsplit_once('/').map_or(schema, |(kind, _)| kind)
}

/// Pretty layout above `depth`, compact layout below it.
struct Layout {
    pretty: PrettyFormatter<'static>,
    depth: usize,
    /// Number of arrays and objects that enclose the current position.
    level: usize,
}

impl Layout {
    fn open(&mut self) -> bool {
        self.level += 1;
        self.level <= self.depth
    }

    fn close(&mut self) -> bool {
        self.level -= 1;
        self.level < self.depth
    }

    fn indents(&self) -> bool {
        self.level <= self.depth
    }
}

/// Writes a separator inside a line, followed by a space.
fn comma<W: ?Sized + io::Write>(writer: &mut W, first: bool) -> io::Result<()> {
    if first { Ok(()) } else { writer.write_all(b", ") }
}

impl Formatter for Layout {
    fn begin_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.open() {
            self.pretty.begin_array(writer)
        } else {
            CompactFormatter.begin_array(writer)
        }
    }

    fn end_array<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.close() {
            self.pretty.end_array(writer)
        } else {
            CompactFormatter.end_array(writer)
        }
    }

    fn begin_array_value<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if self.indents() {
            self.pretty.begin_array_value(writer, first)
        } else {
            comma(writer, first)
        }
    }

    fn end_array_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.indents() { self.pretty.end_array_value(writer) } else { Ok(()) }
    }

    fn begin_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.open() {
            self.pretty.begin_object(writer)
        } else {
            CompactFormatter.begin_object(writer)
        }
    }

    fn end_object<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.close() {
            self.pretty.end_object(writer)
        } else {
            CompactFormatter.end_object(writer)
        }
    }

    fn begin_object_key<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        if self.indents() {
            self.pretty.begin_object_key(writer, first)
        } else {
            comma(writer, first)
        }
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }

    fn end_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.indents() { self.pretty.end_object_value(writer) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_rejected() {
        let message = schema(b" [\"deltille/target/1\"]").unwrap_err();
        assert_eq!(message.to_string(), "expected an object, found a list");
        assert_eq!(schema(b"{\"schema\": \"x/1\"}").unwrap().as_deref(), Some("x/1"));
    }

    #[test]
    fn deep_records_stay_on_their_line() {
        let value = serde_json::json!({"a": [{"x": 1, "y": [2, 3]}, {}], "b": []});
        let text = to_text(&value, 2);
        assert_eq!(
            text,
            "{\n  \"a\": [\n    {\"x\": 1, \"y\": [2, 3]},\n    {}\n  ],\n  \"b\": []\n}\n"
        );
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }
}
