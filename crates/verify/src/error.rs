//! Why an artifact cannot be compared with its target.

use std::path::PathBuf;

use crate::reading::error::DocumentError;
use deltille_core::targets::UnknownCodes;
use deltille_layout::artwork::CuttingError;

/// Why an artifact cannot be compared with its target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The artifact cannot be read.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// The comparison was cancelled by the caller.
    #[error("interrupted before all was compared")]
    Cancelled,
    /// The target has no sheets of paper.
    #[error("{}: target {target} has no sheets: it was not laid out on paper", path.display())]
    NoSheets {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The file name has no extension of a known [`Format`](crate::Format).
    #[error(
        "{}: only .pdf, .svg, .png, .glb, .obj, .sdf, .urdf, .xml (MuJoCo), .usda, .3mf, .stl, .dsc and .dxf files are \
         compared with their target",
        path.display()
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
    },
    /// The file is a part of another artifact.
    #[error("{}: it is compared with {whole}: name that", path.display())]
    PartOf {
        /// The file.
        path: PathBuf,
        /// The file that it is a part of.
        whole: String,
    },
    /// The file name does not tell which sheet the file shows.
    #[error(
        "{}: the target has {sheets} sheets; name the file {example} for the first",
        path.display()
    )]
    WhichSheet {
        /// The file.
        path: PathBuf,
        /// Number of sheets.
        sheets: usize,
        /// An example of a name that does.
        example: String,
    },
    /// The file name does not tell what is cut: panels or net.
    #[error(
        "{}: name the file {target}-panels.dxf, {target}-net.dxf or {target}-laser.dxf, for what it shows",
        path.display()
    )]
    WhichDrawing {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The target has no such drawing for a cutter.
    #[error("{}: {source}", path.display())]
    NothingToCut {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CuttingError,
    },
    /// The codes of the target's tags are not known.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
}
