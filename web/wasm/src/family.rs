//! The family of a target, from its file.

use deltille_core::family::Family;
use deltille_core::targets::{OtherFamily, Target};
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// Sets the family of a target's tags, from the file that the page has fetched.
///
/// # Errors
/// In words, where it is no family, or another one.
pub fn set_family(target: &mut Target, file: Option<String>) -> Result<(), JsError> {
    let Some(file) = file else { return Ok(()) };
    let family = Family::from_json(&file).raise()?;
    target.set_family(&family).map_err(|why| {
        JsError::new(&match why {
            OtherFamily::Codes { name, wanted, found } => format!(
                "the target has tags of another {name} than the one that is shipped: {wanted}, not {found}"
            ),
            why => format!("the target {why}"),
        })
    })
}
