//! Makes PNG pages and meshes, reads files back and compares them with their target, and reads logos.

#![allow(unreachable_pub, reason = "the page is the only user of this interface")]

use deltille_files::export::artifacts::{Making, make};
use deltille_files::logo;
use deltille_layout::Printing;
use deltille_verify::{Artifact, Verifier};
use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::*;

use deltille_web::errors::{Raise, one_line};
use deltille_web::family::set_family;
use deltille_web::files::in_array;

/// Returns the files of the target of a description in a format, as alternating names and bytes. `family` is the content of
/// the target's family file, `dpi` the resolution of PNG pages.
///
/// # Errors
/// Throws if the description or the family cannot be read, or if the target cannot be written in this format.
#[wasm_bindgen]
pub fn files(
    target: &str,
    family: Option<String>,
    format: &str,
    dpi: f64,
) -> Result<Array, JsError> {
    let mut printing = Printing::from_json(target).raise()?;
    set_family(&mut printing.target, family)?;
    let mut making = Making::default();
    making.dpi = dpi;
    Ok(in_array(&make(&printing, format.parse().raise()?, making).raise()?))
}

/// Returns the outline of the logo in an SVG, for the setting `logo` of a target.
///
/// # Errors
/// Throws if the SVG cannot be printed in black.
#[wasm_bindgen]
pub fn logo_of_svg(svg: &str) -> Result<String, JsError> {
    Ok(logo::from_svg(svg).raise()?.to_string())
}

/// Reads a file, or its pages, back and compares it with the target of a description. `family` is the content of the target's
/// family file. Returns the verdict as JSON, with the line that `deltille verify` prints and a sentence for each finding.
///
/// # Errors
/// Throws if the description, the family or a file cannot be read.
#[wasm_bindgen]
pub fn prove(
    target: &str,
    family: Option<String>,
    names: Vec<String>,
    contents: Vec<Uint8Array>,
) -> Result<String, JsError> {
    let mut printing = Printing::from_json(target).raise()?;
    set_family(&mut printing.target, family)?;
    let verifier = Verifier::new(&printing).raise()?;
    let files = names.iter().zip(&contents);
    let artifacts: Vec<_> =
        files.map(|(name, bytes)| Artifact::new(name.clone(), bytes.to_vec())).collect();
    let name = names.first().ok_or_else(|| JsError::new("no file was given"))?;
    let verdict = verifier.verify(name, &artifacts).raise()?;
    let of_sheets = verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
    let of_faces = verdict.faces.iter().flat_map(|face| &face.findings);
    let all = verdict.findings.iter().chain(of_sheets).chain(of_faces);
    let sentences: Vec<String> = all.map(|finding| one_line(&finding)).collect();
    let said = serde_json::json!({
        "passed": verdict.passed, "line": one_line(&verdict), "sentences": sentences,
    });
    Ok(said.to_string())
}
