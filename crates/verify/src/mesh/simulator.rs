//! Verification of simulator models that name the mesh of an OBJ: the model must place the mesh at the target frame,
//! and the OBJ must be that of the target.

use std::path::Path;

use crate::mesh::textured;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::names::file_name;
use crate::reading::reader::Reader;
use crate::syntax::{findings, inspect};
use crate::verdict::Verdict;
use crate::verifier::Verifier;

/// Compares a `.sdf`, `.urdf` or MuJoCo `.xml`, and the mesh that it shows, with the target.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Verdict, DocumentError> {
    let (refused, _) = inspect::check(reader, path, format, &verifier.printing)?;
    if findings::refuse(&refused) {
        return Ok(Verdict::new(path, format, refused));
    }
    let mesh = path.with_file_name(format!("{}.obj", verifier.target().name));
    let mut verdict = textured::verify(verifier, reader, &mesh, Format::Obj)?;
    if format == Format::Mjcf && verdict.passed {
        verdict.findings = inspect::check_parts(reader, path, &mesh, &verifier.printing)?;
        verdict.passed = verdict.findings.is_empty();
    }
    Ok(Verdict { artifact: file_name(path), format, ..verdict })
}
