//! The library's words as exceptions.

use std::fmt::Display;

use deltille_core::setting::Setting;
use deltille_core::words::with_short_quotes;
use wasm_bindgen::JsError;

/// A message on one line.
pub fn told(message: &impl Display) -> String {
    // What the page has no setting for.
    let assumed = format!(", or set {} to assume this one", Setting::DetectionAssumeTargets);
    let text = message.to_string().replace('\n', " ").replace(&assumed, "");
    with_short_quotes(&text).into_owned()
}

/// What a setting is called on the page: what the library calls `BoardSpec::rows` is `rows`.
pub fn name(setting: Setting) -> String {
    setting.path().rsplit("::").next().unwrap_or_default().to_owned()
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
    use super::{Setting, name, told};

    #[test]
    fn settings_are_called_as_on_the_page() {
        assert_eq!(name(Setting::BoardRows), "rows");
        assert_eq!(name(Setting::SolidSquareTagsFirstId), "first_id");
        let assumed = "another, or set `Detection::assume_targets` to assume this one";
        assert_eq!(told(&assumed), "another");
        assert_eq!(told(&"`B9` is no paper\nat all"), "`B9` is no paper at all");
    }
}
