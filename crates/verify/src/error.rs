//! Reasons why an artifact cannot be compared with its target.

use std::path::PathBuf;

use crate::reading::error::DocumentError;
use deltille_core::targets::UnknownCodes;
use deltille_layout::artwork::CuttingError;

/// The reason why an artifact cannot be compared with its target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The artifact cannot be read.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// The comparison was cancelled by the caller.
    #[error("interrupted before the comparison finished")]
    Cancelled,
    /// The target has no sheets of paper.
    #[error("{}: target {target} has no sheets: it was not laid out on paper", path.display())]
    NoSheets {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The file name does not end in the extension of a known [`Format`](crate::Format).
    #[error(
        "{}: unsupported file type (supported: .pdf, .svg, .png, .glb, .obj, .sdf, .urdf, .xml (MuJoCo), .usda, .3mf, \
         .stl, .dsc, .dxf)",
        path.display()
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
    },
    /// The file is part of another artifact.
    #[error("{}: this file is part of {whole}; verify that file instead", path.display())]
    PartOf {
        /// The file.
        path: PathBuf,
        /// The file that it is part of.
        whole: String,
    },
    /// The file name does not say which sheet the file shows.
    #[error(
        "{}: the file name does not say which of the {sheets} sheets it shows; rename it, {example} for the first",
        path.display()
    )]
    WhichSheet {
        /// The file.
        path: PathBuf,
        /// Number of sheets.
        sheets: usize,
        /// Example of a valid file name.
        example: String,
    },
    /// The file name does not say which drawing the file contains.
    #[error(
        "{}: the file name does not say which drawing this is; rename it {target}-panels.dxf, {target}-net.dxf or \
         {target}-laser.dxf",
        path.display()
    )]
    WhichDrawing {
        /// The file.
        path: PathBuf,
        /// Name of the target.
        target: String,
    },
    /// The target does not have this drawing for a cutter.
    #[error("{}: {source}", path.display())]
    NothingToCut {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: CuttingError,
    },
    /// The codes of the target's tags are unknown.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
}
