//! Selects the list of permitted constructs by the format of a file.

use std::path::Path;

use crate::finding::any::Finding;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::{Artifact, Reader};
use crate::syntax::findings::Findings;
use crate::syntax::meshes::{glb, obj, stl, threemf, usda};
use crate::syntax::pages::{pdf, svg};
use crate::syntax::png;
use crate::syntax::text::text;
use crate::syntax::words::Words;
use deltille_files::export::inlay::Body;
use deltille_files::export::scene;
use deltille_layout::Printing;

/// Inspects a printed page, a mesh or a body: constructs that are not allowed, texts that are not those of the
/// target, and the files that belong to it, such as those named in an OBJ. Returns the findings and the contents of
/// those files.
///
/// # Errors
///
/// Returns an error if a file cannot be read or exceeds the limits.
pub(crate) fn check(
    reader: &Reader,
    path: &Path,
    format: Format,
    printing: &Printing,
) -> Result<(Vec<Finding>, Vec<Artifact>), DocumentError> {
    let bytes = reader.read(path)?;
    let (words, limits) = (Words::of(printing), reader.limits);
    if format == Format::Obj {
        let checked = obj::check(reader, path, &bytes, &words);
        return checked.map(|(found, parts)| (found.0, parts));
    }
    if format == Format::Usda {
        return usda::check(reader, path, &bytes, &words).map(|(found, parts)| (found.0, parts));
    }
    let found = reader.run(path, move || match format {
        Format::Svg => svg::check(&bytes, &words, &limits),
        Format::Pdf => pdf::check(&bytes, &words, &limits),
        Format::Png => png::check(&bytes, &words.title, &limits),
        Format::Glb => glb::check(&bytes, &words, &limits),
        Format::Stl => stl::check(&bytes, &words.title, &limits),
        Format::Sdf => model(&bytes, &scene::sdf(&words.title)),
        Format::Urdf => model(&bytes, &scene::urdf(&words.title)),
        Format::Mjcf => model(&bytes, &scene::mjcf(&words.title, textures_of_mjcf(&bytes))),
        // Their readers parse exactly what the program writes.
        Format::Obj | Format::Usda | Format::ThreeMf | Format::Dsc | Format::Dxf => {
            Ok(Findings::default())
        }
    })?;
    Ok((found.0, Vec::new()))
}

/// Inspects a 3MF that should have bodies with these names. Returns the findings, and the bodies if there are no
/// findings.
///
/// # Errors
///
/// Returns an error if the file cannot be read or exceeds the limits.
pub(crate) fn bodies(
    reader: &Reader,
    path: &Path,
    names: &'static [&str],
    printing: &Printing,
) -> Result<(Vec<Finding>, Vec<Body>), DocumentError> {
    let (bytes, words, limits) = (reader.read(path)?, Words::of(printing), reader.limits);
    let check = move || threemf::check(&bytes, names, &words, &limits);
    let (found, bodies) = reader.run(path, check)?;
    Ok((found.0, bodies))
}

/// Checks the textures, and the parts if there are several, that the MuJoCo model at `path` uses
/// from the inspected OBJ beside it, `mesh`.
///
/// # Errors
///
/// Returns an error if a file cannot be read.
pub(crate) fn check_parts(
    reader: &Reader,
    path: &Path,
    mesh: &Path,
    printing: &Printing,
) -> Result<Vec<Finding>, DocumentError> {
    let count = textures_of_mjcf(&reader.read(path)?);
    Ok(obj::check_parts(reader, mesh, count, &Words::of(printing))?.0)
}

/// Returns the number of textures of a MuJoCo model.
fn textures_of_mjcf(bytes: &[u8]) -> usize {
    std::str::from_utf8(bytes).map_or(1, |text| usda::textures_by(text, "<texture "))
}

/// Inspects a simulator model that contains only a reference to the mesh of an OBJ.
fn model(bytes: &[u8], stated: &str) -> Result<Findings, String> {
    let mut found = Findings::default();
    usda::same_lines(text(bytes)?, stated, str::to_owned, &mut found);
    Ok(found)
}
