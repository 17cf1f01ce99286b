//! A textured mesh as a whole: first whether it is a different mesh, then face by face.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec2;
use rayon::prelude::*;

use crate::finding::board::BoardFinding;
use crate::finding::mesh::MeshFinding;
use crate::mesh::face::check_face;
use crate::mesh::measures::{MESH_TOLERANCE_MM, is_other_mesh, other_count};
use crate::mesh::surface::{beside_boards, not_on_faces, scale, sides, wrong_surface};
use crate::mesh::texels;
use crate::model::load::load;
use crate::model::mesh::Model;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::Reader;
use crate::syntax::{findings, inspect};
use crate::verdict::Verdict;
use crate::verifier::Verifier;
use deltille_core::targets::TargetSpec;
use deltille_files::export::mesh::PLATE_TRIANGLES;

/// Tolerance of a unit normal.
const NORMAL_SLACK: f64 = 1e-4;

/// A mesh whose size differs by more than this, relative, is not examined further.
const MAX_SCALE_ERROR: f64 = 0.05;

/// Reads a mesh with its textures, and compares it with the target.
///
/// # Errors
///
/// Returns an error if a file is missing or cannot be read. Deviations are findings of the verdict.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Verdict, DocumentError> {
    let (refused, parts) = inspect::check(reader, path, format, &verifier.printing)?;
    if findings::refuse(&refused) {
        return Ok(Verdict::new(path, format, refused));
    }
    Ok(compare(verifier, path, load(reader, path, parts)?, format).with(refused))
}

/// Compares a loaded mesh with the target.
fn compare(verifier: &Verifier, path: &Path, model: Model, format: Format) -> Verdict {
    let mut findings = Vec::new();
    let mut faces = Vec::new();
    let scale = scale(verifier, &model);
    if let Some((scale, radius_mm)) = scale
        && (scale - 1.0).abs() * radius_mm > MESH_TOLERANCE_MM
    {
        findings.push(BoardFinding::Scale { panel: verifier.target().panels[0].id, scale }.into());
    }
    let stated = match &verifier.target().spec {
        // The faces have this many triangles, and all of them are compared: there must be no others.
        TargetSpec::Solid(spec) => Some(spec.polyhedron().triangles_mm().len()),
        spec if spec.is_on_plate() => {
            findings.extend(beside_boards(&model, sides(verifier.target())));
            Some(PLATE_TRIANGLES)
        }
        _ => None,
    };
    if let Some(stated) = stated {
        let found = model.triangles.len();
        findings.extend(other_count(found, stated));
        if is_other_mesh(found, stated) {
            return Verdict::new(path, format, findings);
        }
    }
    let is_beyond = |uv: &DVec2| uv.cmplt(DVec2::ZERO).any() || uv.cmpgt(DVec2::ONE).any();
    if model.triangles.iter().flat_map(|triangle| &triangle.uv).any(is_beyond)
        || texels::are_shared(&model)
    {
        let problem = "triangles that share part of a texture or extend beyond it".to_owned();
        findings.push(MeshFinding::Body { problem }.into());
        return Verdict::new(path, format, findings);
    }
    let wrong = model.triangles.iter().filter(|triangle| {
        let normal = triangle.winding().normalize_or_zero();
        triangle.normals.iter().any(|n| n.distance(normal) > NORMAL_SLACK)
    });
    let wrong = wrong.count();
    if wrong > 0 {
        findings.push(MeshFinding::Normals { triangles: wrong }.into());
    }
    if scale.is_none_or(|(scale, _)| (scale - 1.0).abs() < MAX_SCALE_ERROR) {
        let panels = verifier.target().panels.par_iter();
        let done = AtomicUsize::new(0);
        let check = |panel| {
            let verdict = check_face(verifier, &model, panel);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            verifier.report_progress(done, verifier.target().panels.len());
            verdict
        };
        faces = panels.map(check).collect();
    }
    if findings.is_empty() && faces.iter().all(|face| face.findings.is_empty()) {
        let surface = wrong_surface(verifier, &model);
        findings.extend(surface.or_else(|| not_on_faces(verifier, &model)));
    }
    let mut verdict = Verdict::new(path, format, findings);
    verdict.passed &= faces.iter().all(|face| face.findings.is_empty());
    Verdict { faces, ..verdict }
}
