//! The library's words as exceptions.

use std::fmt::Display;

use deltille_core::words::with_short_quotes;
use wasm_bindgen::JsError;

/// A message on one line.
pub fn told(message: &impl Display) -> String {
    let text = message.to_string().replace('\n', " ").replace(ASSUME_TARGET, "");
    named(&with_short_quotes(&text))
}

/// What the page has no setting for.
const ASSUME_TARGET: &str = ", or set `Detection::assume_targets` to assume this one";

/// A text in which settings have the names of the page: what the library calls `BoardSpec::rows` is `rows`.
pub fn named(text: &str) -> String {
    let (mut told, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((before, after)) = rest.split_once('`') {
        told += before;
        let Some((name, after)) = after.split_once('`') else {
            return told + "`" + after;
        };
        match name.rsplit_once("::") {
            Some((_, setting)) => told += setting,
            None => told = told + "`" + name + "`",
        }
        rest = after;
    }
    told + rest
}

/// Makes exceptions of errors.
pub trait Raise<T> {
    /// An exception with the error's words.
    ///
    /// # Errors
    /// Where there is an error.
    fn raise(self) -> Result<T, JsError>;
}

impl<T, E: Display> Raise<T> for Result<T, E> {
    fn raise(self) -> Result<T, JsError> {
        self.map_err(|error| JsError::new(&told(&error)))
    }
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn settings_are_called_as_on_the_page() {
        assert_eq!(
            told(&"`BoardSpec::rows`: 1 is not between 2 and 500"),
            "rows: 1 is not between 2 and 500"
        );
        assert_eq!(told(&"`B9` is no paper\nat all"), "`B9` is no paper at all");
        assert_eq!(told(&"a ` alone"), "a ` alone");
    }
}
