//! Selects the comparison for an artifact by the format of its file name.

use std::path::Path;

use crate::body::{inlay, shape};
use crate::cut::{laser, outlines};
use crate::error::VerifyError;
use crate::listing;
use crate::mesh::{simulator, textured};
use crate::printed;
use crate::reading::format::Format;
use crate::reading::names::{file_name, whole_of};
use crate::reading::reader::{Artifact, OnDisk, Reader};
use crate::verdict::Verdict;
use crate::verifier::Verifier;
use deltille_files::limits::Guard;
use deltille_layout::Printing;

/// Compares the artifact named `name`, one of `files` in memory, with its target. The extension of the name
/// determines the [`Format`].
///
/// An artifact may consist of several files, all of which must be among `files`, in any order: the other pages of a
/// net (`net-1.svg`, `net-2.svg`), or the material library and textures that an OBJ names. Other files are ignored.
///
/// The [`Verdict`] contains the deviations of the artifact. An error means that nothing can be compared: a file is
/// missing or cannot be read, or the target does not have this artifact.
///
/// # Errors
/// Returns an error if the tag family is unknown, the name does not determine a format or sheet, or a file is missing
/// or unreadable.
///
/// ```
/// use deltille_layout::artwork;
/// use deltille_core::lattice::GridKind;
/// use deltille_layout::{PaperSpec, Printing};
/// use deltille_core::targets::{BoardSpec, TargetSpec};
/// use deltille_files::export::svg;
/// use deltille_verify::{Artifact, verify};
///
/// let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 4, 5, 20.0) };
/// let spec = TargetSpec::Board(spec);
/// let board = Printing::build("board", &spec, None, Some(&PaperSpec::default()))?;
/// let mut artwork = board.draw()?;
/// let good = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// assert!(verify(&board, "board.svg", &good)?.passed);
///
/// artwork.sheets[0].shapes.remove(0);
/// let bad = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// let verdict = verify(&board, "board.svg", &bad)?;
/// assert!(verdict.to_string().contains("tile missing"), "{verdict}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn verify(printing: &Printing, name: &str, files: &[Artifact]) -> Result<Verdict, VerifyError> {
    Verifier::new(printing)?.verify(name, files)
}

impl Verifier<'_> {
    /// Compares the artifact named `name`, one of `files` in memory, with the target. A PDF contains all sheets, an
    /// SVG or PNG the one given by its name. All files of the artifact must be among `files`: all pages of
    /// [`set_of`](Self::set_of) for a net, material library and textures for an OBJ.
    ///
    /// # Errors
    /// Returns an error if the name does not determine a format or sheet, or a file is missing or unreadable.
    pub fn verify(&self, name: &str, files: &[Artifact]) -> Result<Verdict, VerifyError> {
        let reader = Reader { files: &files, limits: self.limits, guard: self.guard };
        compare(self, &reader, Path::new(name))
    }

    /// Reads an artifact from disk, with the neighbouring files that belong to it, and compares it as
    /// [`verify`](Self::verify) does. Third-party readers run on a separate thread, for at most
    /// [`Limits::max_seconds`](deltille_files::limits::Limits::max_seconds) in each step.
    ///
    /// # Errors
    /// Returns an error if the name does not determine a format or sheet, or a file is missing or unreadable.
    pub fn verify_path(&self, path: &Path) -> Result<Verdict, VerifyError> {
        let files = OnDisk(self.limits);
        compare(self, &Reader { files: &files, limits: self.limits, guard: Guard::Timed }, path)
    }
}

/// Compares an artifact whose files come from `reader`.
fn compare(verifier: &Verifier, reader: &Reader, path: &Path) -> Result<Verdict, VerifyError> {
    let target = verifier.target();
    if let Some(whole) = whole_of(&target.name, &file_name(path)) {
        return Err(VerifyError::PartOf { path: path.to_owned(), whole });
    }
    let Some(format) = Format::of(path) else {
        return Err(VerifyError::OtherKind { path: path.to_owned() });
    };
    match format {
        Format::Dsc => Ok(listing::verify(verifier, reader, path)?),
        Format::Dxf | Format::Svg if laser::is_named(target, path) => {
            laser::verify(verifier, reader, path, format)
        }
        Format::Dxf => outlines::verify(verifier, reader, path),
        Format::Pdf | Format::Svg | Format::Png => printed::verify(verifier, reader, path, format),
        Format::Sdf | Format::Urdf | Format::Mjcf => {
            Ok(simulator::verify(verifier, reader, path, format)?)
        }
        Format::ThreeMf => Ok(inlay::verify(verifier, reader, path)?),
        Format::Glb | Format::Obj | Format::Usda => {
            Ok(textured::verify(verifier, reader, path, format)?)
        }
        Format::Stl => Ok(shape::verify(verifier, reader, path)?),
    }
}
