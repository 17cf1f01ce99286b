//! Verification of models for simulators that name the mesh in an OBJ: the model must put it where the target is, and
//! the OBJ must be that of the target.

use std::path::Path;

use super::reader::Reader;
use super::{Format, Verdict, Verifier, VerifyError, construct};

/// Compares a `.sdf`, `.urdf` or MuJoCo's `.xml`, and the mesh that it shows, with the target.
pub(super) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Verdict, VerifyError> {
    let (refused, _) = construct::check(reader, path, format, &verifier.printing)?;
    if construct::refuse(&refused) {
        return Ok(Verdict::new(path, format, refused));
    }
    let mesh = path.with_file_name(format!("{}.obj", verifier.target().name));
    let mut verdict = verifier.verify_by(reader, &mesh)?;
    if format == Format::Mjcf && verdict.passed {
        verdict.findings = construct::check_parts(reader, path, &mesh, &verifier.printing)?;
        verdict.passed = verdict.findings.is_empty();
    }
    Ok(Verdict { artifact: super::file_name(path), format, ..verdict })
}
