//! Cells of tables as text.

use std::borrow::Cow;

/// A text as a cell of a CSV: in quotes if it contains a separator (RFC 4180).
pub(in crate::export) fn quoted(text: &str) -> Cow<'_, str> {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")).into(),
        false => text.into(),
    }
}
