//! Converts errors of the library to Python exceptions, with settings named by their keywords.

use std::error::Error;
use std::ffi::CString;
use std::fmt::Display;
use std::io;
use std::path::Path;

use deltille::limits::{self, ReadError};
use deltille::setting::Setting;
use deltille_core::words::with_short_quotes;
use pyo3::exceptions::{PyKeyboardInterrupt, PyUserWarning};
use pyo3::prelude::*;

/// The exceptions. They are written in Python because most of them have two base classes.
pub mod raised {
    #![allow(missing_docs, reason = "the macro makes types without documentation")]
    pyo3::import_exception!(deltille.errors, Error);
    pyo3::import_exception!(deltille.errors, ArgumentError);
    pyo3::import_exception!(deltille.errors, TargetError);
    pyo3::import_exception!(deltille.errors, FamilyError);
    pyo3::import_exception!(deltille.errors, ImageError);
    pyo3::import_exception!(deltille.errors, DetectionError);
    pyo3::import_exception!(deltille.errors, CalibrationError);
    pyo3::import_exception!(deltille.errors, CameraError);
    pyo3::import_exception!(deltille.errors, VerifyError);
    pyo3::import_exception!(deltille.errors, FileError);
}

/// Returns the keyword of a setting.
pub fn keyword(setting: Setting) -> String {
    let keyword = match setting {
        Setting::AprilGridGap => "gap",
        Setting::AprilGridTagMm => "tag_mm",
        Setting::AprilGridTags => "tags",
        Setting::BoardBoardId => "board_id",
        Setting::BoardBoards => "boards",
        Setting::BoardCols => "cols",
        Setting::BoardEdgeMm => "edge_mm",
        Setting::BoardRows => "rows",
        Setting::BoardTags => "family",
        Setting::BoardTwoSidedMm => "two_sided_mm",
        Setting::CalibrateModel => "model",
        Setting::CalibrationBoardShape => "board_shape",
        Setting::CalibrationCompensatedForTiming => "`deltille calibrate --estimate-timing`",
        Setting::CalibrationMeasureTarget => "measure_target",
        Setting::CalibrationRefinePanels => "refine_target=True",
        Setting::CalibrationWrite => "Calibration.save",
        Setting::CharucoDictionary => "dictionary",
        Setting::CharucoLegacy => "legacy",
        Setting::CharucoMarkerMm => "marker_mm",
        Setting::CharucoSquareMm => "square_mm",
        Setting::CharucoSquares => "squares",
        Setting::CirclesCircles => "circles",
        Setting::CirclesDiameterMm => "diameter_mm",
        Setting::CirclesSpacingMm => "spacing_mm",
        Setting::CompareBoardsAssumeTarget => "assume_target=True",
        Setting::DetectionAssumeTargets => "assume_target=True",
        Setting::DetectionWrite => "Detection.save",
        Setting::DialectFork => "dsc-fork",
        Setting::FamilyShippedNames => "Family.shipped()",
        Setting::FamilyToJson => "Family.to_json",
        Setting::FinishContour => "contour",
        Setting::FinishWhite => "white",
        Setting::FrameOptionsTopic => "topic",
        Setting::ImportBits => "bits",
        Setting::ImportDistance => "distance",
        Setting::ImportKind => "kind",
        Setting::LimitsMaxBytes => "max_bytes",
        Setting::LimitsMaxDepth => "max_depth",
        Setting::LimitsMaxNodes => "max_nodes",
        Setting::LimitsMaxPixels => "max_pixels",
        Setting::LimitsMaxPixelsPerByte => "max_pixels_per_byte",
        Setting::LimitsMaxSeconds => "max_seconds",
        Setting::MeshingTextures => "textures",
        Setting::PaperGuidePage => "guide_page",
        Setting::PaperLogo => "logo",
        Setting::PaperLogoHeightMm => "logo_height_mm",
        Setting::PaperMarginMm => "margin_mm",
        Setting::PaperNote => "note",
        Setting::PaperPacked => "packed",
        Setting::PaperPages => "pages",
        Setting::PaperPoster => "poster",
        Setting::PaperSize => "paper",
        Setting::PaperTagIds => "tag_ids",
        Setting::PhotographReadWithNotes => "accept_damaged=True",
        Setting::PrintScale => "print_scale",
        Setting::RegionImage => "region=\"image\"",
        Setting::RigWrite => "Rig.save",
        Setting::SightingBend => "shape",
        Setting::SightingStretch => "print_scale",
        Setting::SkeletonPanelThicknessMm => "panel_thickness_mm",
        Setting::SkeletonRibMm => "rib_mm",
        Setting::SkeletonWallMm => "wall_mm",
        Setting::SolidBoardId => "board_id",
        Setting::SolidEdgeMm => "edge_mm",
        Setting::SolidMarginMm => "face_margin_mm",
        Setting::SolidShapeCuboid => "size_mm",
        Setting::SolidShapeMesh => "mesh",
        Setting::SolidSheetsPerFace => "per_face",
        Setting::SolidSheetsSeamedNet => "allow_seams",
        Setting::SolidSkeleton => "skeleton",
        Setting::SolidSquareTags => "square_family",
        Setting::SolidSquareTagsFamily => "square_family",
        Setting::SolidSquareTagsFirstId => "first_square_id",
        Setting::SolidTiles => "tiles",
        Setting::TagBorderBits => "tag_border",
        Setting::TagFamily => "family",
        Setting::TagFirstId => "first_id",
        Setting::TagHoleMm => "hole_mm",
        Setting::TagSheetBorderBits => "tag_border",
        Setting::TagSheetEdgeMm => "edge_mm",
        Setting::TagSheetFamily => "family",
        Setting::TagSheetIds => "ids",
        Setting::TagSpacing => "tag_spacing",
        Setting::TagTagsIn => "tags_in",
        Setting::TagsInBlack => "tags_in=\"black\"",
        Setting::TargetName => "name",
        Setting::TargetToJson => "Target.to_json",
        Setting::TargetSetFamily => "family",
        Setting::UntaggedGridEdgeMm => "edge_mm",
        Setting::UntaggedGridKind => "grid",
        Setting::UntaggedGridSize => "rows and cols",
    };
    keyword.to_owned()
}

/// Formats a message on one line.
pub fn one_line(message: &impl Display) -> String {
    with_short_quotes(&message.to_string().replace('\n', " ")).into_owned()
}

/// Why work ended without a result.
pub enum Fault {
    /// Python raised an exception.
    Raised(PyErr),
    /// The user pressed Ctrl-C.
    Interrupted,
    /// The library crashed.
    Broken(String),
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Raised(error) => error,
            Fault::Interrupted => PyKeyboardInterrupt::new_err(()),
            Fault::Broken(what) => raised::Error::new_err(what),
        }
    }
}

impl From<limits::Broken> for Fault {
    fn from(_: limits::Broken) -> Self {
        Self::Broken(
            "internal error in deltille; please report it with the call that caused it".to_owned(),
        )
    }
}

/// Converts errors to exceptions.
pub trait Raise<T> {
    /// Converts an error to an exception of class `class` with its message.
    ///
    /// # Errors
    /// Returns the exception if `self` is an error.
    fn raise(self, class: fn(String) -> PyErr) -> PyResult<T>;
}

impl<T, E: Display> Raise<T> for Result<T, E> {
    fn raise(self, class: fn(String) -> PyErr) -> PyResult<T> {
        self.map_err(|error| class(one_line(&error)))
    }
}

macro_rules! classes {
    ($($function:ident => $class:ident: $what:literal;)*) => {$(
        #[doc = $what]
        pub fn $function(message: String) -> PyErr {
            raised::$class::new_err(message)
        }
    )*};
}

classes! {
    argument => ArgumentError: "An array of the wrong shape, or a number out of range.";
    target => TargetError: "An invalid or unusable target.";
    family => FamilyError: "An unusable family.";
    image => ImageError: "An invalid image.";
    detection => DetectionError: "An invalid detector or detection.";
    calibration => CalibrationError: "A calibration that failed.";
    camera => CameraError: "An unusable camera.";
    verify => VerifyError: "A file that cannot be compared.";
    file => FileError: "A file that cannot be read or written.";
}

/// Converts errors of a file to exceptions.
pub trait RaiseFile<T> {
    /// Converts an error to an exception of class `class` with its message. If the operating system refused access, it is
    /// a `FileError` with also `errno`, `strerror` and `filename`: `MissingFileError` for a missing file,
    /// `PermissionFileError` for missing permissions, `FolderError` for a folder instead of a file.
    ///
    /// # Errors
    /// Returns the exception if `self` is an error.
    fn raise_of_file(self, path: &Path, class: fn(String) -> PyErr) -> PyResult<T>;
}

impl<T, E: Error + 'static> RaiseFile<T> for Result<T, E> {
    fn raise_of_file(self, path: &Path, class: fn(String) -> PyErr) -> PyResult<T> {
        self.map_err(|error| {
            let mut cause: Option<&(dyn Error + 'static)> = Some(&error);
            let (mut number, mut at) = (None, path);
            while let Some(error) = cause {
                // The file at `path` may refer to another file, which caused the error.
                if let Some(ReadError::Io { path, .. }) = error.downcast_ref() {
                    at = path;
                }
                let system = error.downcast_ref::<io::Error>();
                number = number.or(system.and_then(io::Error::raw_os_error));
                cause = error.source();
            }
            let words = one_line(&error);
            // The library rejects folders itself, without a system call; recognise its message.
            let refused = limits::check_file(at).err().filter(|_| number.is_none() && at.is_dir());
            let is_folder = refused.is_some_and(|refused| words.contains(&one_line(&refused)));
            match number.is_some() || is_folder {
                true => of_system(number, at, &words).unwrap_or_else(|wrong| wrong),
                false => class(words),
            }
        })
    }
}

/// Returns the exception for an `errno`; without one, for a folder where a file is needed.
fn of_system(number: Option<i32>, path: &Path, words: &str) -> PyResult<PyErr> {
    let code = number.map_or(String::new(), |number| format!(" (os error {number})"));
    Python::attach(|py| {
        let make = py.import("deltille.errors")?.getattr("_of_system")?;
        let words = words.replace(&code, "");
        Ok(PyErr::from_value(make.call1((number, path.as_os_str(), words))?))
    })
}

/// Issues a `UserWarning` at the line of the caller.
pub fn warn(py: Python<'_>, what: &str) -> PyResult<()> {
    let what = CString::new(what.replace('\0', "")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &what, 2)
}

/// Runs work without the interpreter's lock.
///
/// # Errors
/// Returns an exception if the work panics.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| limits::caught(work)).map_err(|broken| Fault::from(broken).into())
}
