//! Sets the family of a target from its file.

use deltille_core::family::Family;
use deltille_core::targets::{OtherFamily, Target};
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// Sets the family of a target's tags from a file that the page fetched.
///
/// # Errors
/// Throws if the file is not a valid family file or does not match the target.
pub fn set_family(target: &mut Target, file: Option<String>) -> Result<(), JsError> {
    let Some(file) = file else { return Ok(()) };
    let family = Family::from_json(&file).raise()?;
    target.set_family(&family).map_err(|why| {
        JsError::new(&match why {
            OtherFamily::Codes { name, wanted, found } => format!(
                "the target was made with another version of family {name} (fingerprint {wanted}) than the bundled one ({found})"
            ),
            why => format!("the target {why}"),
        })
    })
}
