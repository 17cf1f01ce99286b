//! Errors of the library as JavaScript exceptions.

use std::fmt::Display;

use deltille_core::setting::Setting;
use deltille_core::words::with_short_quotes;
use wasm_bindgen::JsError;

/// Formats a message on one line.
pub fn one_line(message: &impl Display) -> String {
    // The page has no such setting.
    let assumed = format!(", or set {} to assume this one", Setting::DetectionAssumeTargets);
    let text = message.to_string().replace('\n', " ").replace(&assumed, "");
    with_short_quotes(&text).into_owned()
}

/// Returns the page's name of a setting: `BoardSpec::rows` of the library is `rows`.
pub fn name(setting: Setting) -> String {
    setting.path().rsplit("::").next().unwrap_or_default().to_owned()
}

/// Converts errors to exceptions.
pub trait Raise<T> {
    /// Converts an error to an exception with its message.
    ///
    /// # Errors
    /// Throws if `self` is an error.
    fn raise(self) -> Result<T, JsError>;
}

impl<T, E: Display> Raise<T> for Result<T, E> {
    fn raise(self) -> Result<T, JsError> {
        self.map_err(|error| JsError::new(&one_line(&error)))
    }
}

#[cfg(test)]
mod tests {
    use super::{Setting, name, one_line};

    #[test]
    fn settings_have_the_names_of_the_page() {
        assert_eq!(name(Setting::BoardRows), "rows");
        assert_eq!(name(Setting::SolidSquareTagsFirstId), "first_id");
        let assumed = "another, or set `Detection::assume_targets` to assume this one";
        assert_eq!(one_line(&assumed), "another");
        assert_eq!(one_line(&"unknown paper\nsize `B9`"), "unknown paper size `B9`");
    }
}
