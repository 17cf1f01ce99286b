//! Files read back and compared with their target.

use deltille_layout::Printing;
use deltille_verify::{Artifact, Verifier};
use js_sys::Uint8Array;
use wasm_bindgen::prelude::*;

use crate::errors::{Raise, told};
use crate::family::set_family;

/// Reads a file, or the pages of one, back and compares it with the target of a description, whose tags are those of the
/// family's file: the verdict as JSON, with the line that `deltille verify` prints and a sentence for each finding.
///
/// # Errors
/// In words, where nothing can be compared.
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
    let name = names.first().ok_or_else(|| JsError::new("there is no file"))?;
    let verdict = verifier.verify(name, &artifacts).raise()?;
    let of_sheets = verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
    let of_faces = verdict.faces.iter().flat_map(|face| &face.findings);
    let all = verdict.findings.iter().chain(of_sheets).chain(of_faces);
    let sentences: Vec<String> = all.map(|finding| told(&finding)).collect();
    let said = serde_json::json!({
        "passed": verdict.passed, "line": told(&verdict), "sentences": sentences,
    });
    Ok(said.to_string())
}
