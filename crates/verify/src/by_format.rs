//! The extension of a name tells the format, and the format which comparison an artifact goes through.

use std::path::Path;

use crate::body::{inlay, shape};
use crate::construct::{findings, inspect};
use crate::cut::{laser, outlines};
use crate::error::VerifyError;
use crate::listing;
use crate::mesh::{simulator, textured};
use crate::model::load::load;
use crate::model::stl::load_stl;
use crate::reading::format::Format;
use crate::reading::names::{file_name, whole_of};
use crate::reading::on_disk::OnDisk;
use crate::reading::reader::{Artifact, Reader};
use crate::verdict::Verdict;
use crate::verifier::Verifier;
use deltille_core::family::Family;
use deltille_core::layout::Printing;
use deltille_files::limits::Guard;

/// Compares the artifact named `name` among `files` in memory with its target. `family` must be
/// given if the target has tags. The extension of the name tells the [`Format`].
///
/// An artifact may consist of several files. All of them must be among `files`, in any order: the
/// other pages of a net (`net-1.svg`, `net-2.svg`), the material library and the textures that an
/// OBJ names. Other files are ignored.
///
/// Deviations of the artifact are in the [`Verdict`]. An error means that nothing can be compared:
/// a file is missing or cannot be read, or the target has no such artifact.
///
/// # Errors
/// When the family is not that of the target, the name tells no format or sheet, or a file is
/// missing or cannot be read at all.
///
/// ```
/// use deltille_core::artwork;
/// use deltille_core::lattice::GridKind;
/// use deltille_core::layout::{PaperSpec, Printing};
/// use deltille_core::targets::{BoardSpec, TargetSpec};
/// use deltille_files::export::svg;
/// use deltille_verify::{Artifact, verify};
///
/// let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 4, 5, 20.0) };
/// let spec = TargetSpec::Board(spec);
/// let board = Printing::build("board", &spec, None, Some(&PaperSpec::default()))?;
/// let mut artwork = artwork::draw(&board, None)?;
/// let good = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// assert!(verify(&board, None, "board.svg", &good)?.passed);
///
/// artwork.sheets[0].shapes.remove(0);
/// let bad = [Artifact::new("board.svg", svg::to_string(&artwork, 0))];
/// let verdict = verify(&board, None, "board.svg", &bad)?;
/// assert!(verdict.to_string().contains("tile missing"), "{verdict}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn verify(
    printing: &Printing,
    family: Option<&Family>,
    name: &str,
    files: &[Artifact],
) -> Result<Verdict, VerifyError> {
    Verifier::new(printing, family)?.verify(name, files)
}

impl<'a> Verifier<'a> {
    /// Compares the artifact named `name` among files in memory with the target. A PDF shows all
    /// sheets, an SVG or PNG the one that its name tells. All files of the artifact must be among
    /// `files`: all pages of [`set_of`](Self::set_of) for a net, material library and textures for
    /// an OBJ.
    ///
    /// # Errors
    /// When the name tells no format or sheet, or a file is missing or cannot be read at all.
    pub fn verify(&self, name: &str, files: &[Artifact]) -> Result<Verdict, VerifyError> {
        let reader = Reader { files: &files, limits: self.limits, guard: self.guard };
        self.verify_by(&reader, Path::new(name))
    }

    /// Compares an artifact whose files come from `reader`.
    pub(crate) fn verify_by(&self, reader: &Reader, path: &Path) -> Result<Verdict, VerifyError> {
        let name = file_name(path);
        if let Some(whole) = whole_of(&self.target().name, &name) {
            return Err(VerifyError::PartOf { path: path.to_owned(), whole });
        }
        let Some(format) = Format::of(path) else {
            return Err(VerifyError::OtherKind { path: path.to_owned() });
        };
        match format {
            Format::Dsc => return Ok(listing::verify(self, reader, path)?),
            Format::Dxf | Format::Svg if laser::is_named(self.target(), path) => {
                return laser::verify(self, reader, path, format);
            }
            Format::Dxf => return outlines::verify(self, reader, path),
            Format::Pdf | Format::Svg | Format::Png => {
                return self.verify_sheets(reader, path, format);
            }
            Format::Sdf | Format::Urdf | Format::Mjcf => {
                return simulator::verify(self, reader, path, format);
            }
            Format::ThreeMf => return Ok(inlay::verify(self, reader, path)?),
            Format::Glb | Format::Obj | Format::Usda | Format::Stl => {}
        }
        let (refused, parts) = inspect::check(reader, path, format, &self.printing)?;
        if findings::refuse(&refused) {
            return Ok(Verdict::new(path, format, refused));
        }
        let mut verdict = match format {
            Format::Stl => shape::verify(self, path, &load_stl(reader, path)?, format)?,
            _ => textured::verify(self, path, load(reader, path, parts)?, format),
        };
        verdict.passed &= refused.is_empty();
        verdict.findings.extend(refused);
        Ok(verdict)
    }
}

impl Verifier<'_> {
    /// Reads an artifact from disk, with the files beside it that belong to it, and compares it as
    /// [`verify`](Self::verify) does. Third-party readers run on a thread of their own, for at most
    /// [`Limits::max_seconds`] in each step.
    ///
    /// # Errors
    /// When the name tells no format or sheet, or a file is missing or cannot be read at all.
    pub fn verify_path(&self, path: &Path) -> Result<Verdict, VerifyError> {
        let files = OnDisk(self.limits);
        self.verify_by(&Reader { files: &files, limits: self.limits, guard: Guard::Timed }, path)
    }
}
