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

/// Returns the key of a setting in the settings of the page, or its words; of one that the page does not have, the option of
/// the program or the last part of its path.
pub fn name(setting: Setting) -> String {
    let key = match setting {
        Setting::CalibrateModel => return "the camera model".to_owned(),
        Setting::CalibrationBoardShape => {
            return "`--board-shape` of the deltille program".to_owned();
        }
        Setting::CalibrationMeasureTarget => {
            return "`--measure-target` of the deltille program".to_owned();
        }
        Setting::FamilyToJson => return "the deltag program".to_owned(),
        Setting::PrintScale => return "the print scale".to_owned(),
        Setting::AprilGridTagMm | Setting::CharucoSquareMm | Setting::CirclesSpacingMm => "edge_mm",
        Setting::AprilGridTags | Setting::CharucoSquares | Setting::CirclesCircles => "rows",
        Setting::BoardTags | Setting::CharucoDictionary => "family",
        Setting::PaperSize => "paper",
        Setting::SolidMarginMm => "face_margin_mm",
        Setting::SolidShapeCuboid => "size",
        Setting::SolidSheetsPerFace => "per_face",
        Setting::SolidSheetsSeamedNet => "allow_seams",
        Setting::TagBorderBits => "tag_border",
        Setting::TagSpacing => "tag_spacing",
        _ => setting.path().rsplit("::").next().unwrap_or_default(),
    };
    format!("`{key}`")
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
        let keys = include_str!("../../src/settings.ts");
        let of_targets = ["AprilGrid", "Board", "Charuco", "Circles", "Paper", "Solid", "Tag"];
        for setting in Setting::ALL {
            let path = setting.path();
            let (kind, _) = path.split_once("Spec::").unwrap_or_default();
            let key = name(*setting).replace('`', "");
            // The page has one kind of square tags, and no panels.
            let is_other = path.contains("square_tags");
            assert!(
                !of_targets.contains(&kind) || is_other || keys.contains(&format!("\n  {key}: ")),
                "{path}: {key}"
            );
        }
        assert_eq!(name(Setting::TagSpacing), "`tag_spacing`");
        let assumed = "another, or set `Detection::assume_targets` to assume this one";
        assert_eq!(one_line(&assumed), "another");
        assert_eq!(one_line(&"unknown paper\nsize `B9`"), "unknown paper size `B9`");
    }
}
