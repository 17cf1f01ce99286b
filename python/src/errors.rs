//! From the library's errors to exceptions, in the words of Python.

use std::borrow::Cow;
use std::error::Error;
use std::ffi::CString;
use std::fmt::Display;
use std::io;
use std::path::Path;

use deltille::limits::{self, ReadError};
use deltille_core::words::with_short_quotes;
use pyo3::exceptions::{PyKeyboardInterrupt, PyUserWarning};
use pyo3::prelude::*;

/// The exceptions, which are written in Python as most of them have two bases.
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

/// What messages of the library call a setting, and what it is called here.
pub const KEYWORDS: &[(&str, &str)] = &[
    ("AprilGridSpec::gap", "gap"),
    ("AprilGridSpec::tag_mm", "tag_mm"),
    ("AprilGridSpec::tags", "tags"),
    ("BoardSpec::board_id", "board_id"),
    ("BoardSpec::boards", "boards"),
    ("BoardSpec::cols", "cols"),
    ("BoardSpec::edge_mm", "edge_mm"),
    ("BoardSpec::rows", "rows"),
    ("BoardSpec::tags", "family"),
    ("BoardSpec::two_sided_mm", "two_sided_mm"),
    ("Calibration::board_shape", "board_shape"),
    ("Calibration::measure_target", "measure_target"),
    ("Calibration::refine_panels", "refine_target=True"),
    ("CharucoSpec::dictionary", "dictionary"),
    ("CharucoSpec::marker_mm", "marker_mm"),
    ("CharucoSpec::square_mm", "square_mm"),
    ("CharucoSpec::squares", "squares"),
    ("CirclesSpec::circles", "circles"),
    ("CirclesSpec::diameter_mm", "diameter_mm"),
    ("CirclesSpec::spacing_mm", "spacing_mm"),
    ("Detection::assume_targets", "assume_target=True"),
    ("Dialect::Fork", "dsc-fork"),
    ("Family::to_json", "Family.to_json"),
    ("Finish::contour", "contour"),
    ("Finish::white", "white"),
    ("ImportSpec::bits", "bits"),
    ("ImportSpec::distance", "distance"),
    ("ImportSpec::kind", "kind"),
    ("Limits::max_bytes", "max_bytes"),
    ("Limits::max_depth", "max_depth"),
    ("Limits::max_nodes", "max_nodes"),
    ("Limits::max_pixels", "max_pixels"),
    ("Limits::max_pixels_per_byte", "max_pixels_per_byte"),
    ("Limits::max_seconds", "max_seconds"),
    ("Meshing::textures", "textures"),
    ("PaperSpec::guide_page", "guide_page"),
    ("PaperSpec::logo", "logo"),
    ("PaperSpec::logo_height_mm", "logo_height_mm"),
    ("PaperSpec::margin_mm", "margin_mm"),
    ("PaperSpec::note", "note"),
    ("PaperSpec::packed", "packed"),
    ("PaperSpec::poster", "poster"),
    ("PaperSpec::size", "paper"),
    ("PaperSpec::tag_ids", "tag_ids"),
    ("Print::scale", "print_scale"),
    ("Region::Image", "region=\"image\""),
    ("Sighting::bend", "shape"),
    ("Sighting::stretch", "print_scale"),
    ("SkeletonSpec::panel_thickness_mm", "panel_thickness_mm"),
    ("SkeletonSpec::rib_mm", "rib_mm"),
    ("SkeletonSpec::wall_mm", "wall_mm"),
    ("SolidShape::Cuboid", "size_mm"),
    ("SolidShape::Mesh", "mesh"),
    ("SolidSheets::PerFace", "per_face"),
    ("SolidSheets::SeamedNet", "allow_seams"),
    ("SolidSpec::board_id", "board_id"),
    ("SolidSpec::edge_mm", "edge_mm"),
    ("SolidSpec::margin_mm", "face_margin_mm"),
    ("SolidSpec::skeleton", "skeleton"),
    ("SolidSpec::square_tags", "square_family"),
    ("SolidSpec::square_tags::family", "square_family"),
    ("SolidSpec::square_tags::first_id", "first_square_id"),
    ("SolidSpec::tiles", "tiles"),
    ("TagSheetSpec::border_bits", "tag_border"),
    ("TagSheetSpec::edge_mm", "edge_mm"),
    ("TagSheetSpec::family", "family"),
    ("TagSheetSpec::ids", "ids"),
    ("TagSpec::border_bits", "tag_border"),
    ("TagSpec::hole_mm", "hole_mm"),
    ("TagSpec::family", "family"),
    ("TagSpec::first_id", "first_id"),
    ("TagSpec::spacing", "tag_spacing"),
    ("TagSpec::tags_in", "tags_in"),
    ("TagsIn::Black", "tags_in=\"black\""),
    ("Target::name", "name"),
    ("Target::to_json", "Target.to_json"),
    ("UntaggedGrid::edge_mm", "edge_mm"),
    ("UntaggedGrid::kind", "grid"),
    ("UntaggedGrid::size", "rows and cols"),
    ("calibrate::Model", "model"),
    ("calibration::write", "Calibration.save"),
    ("compare_boards::assume_target", "assume_target=True"),
    ("detection::write", "Detection.save"),
    ("family::shipped_names", "Family.shipped()"),
    ("photograph::read_with_notes", "accept_damaged=True"),
    ("rig::write", "Rig.save"),
];

/// A message of the library on one line, with its settings as keywords.
pub fn told(message: &impl Display) -> String {
    let text = with_short_quotes(&message.to_string().replace('\n', " ")).into_owned();
    let (mut told, mut rest) = (String::with_capacity(text.len()), text.as_str());
    while let Some((before, after)) = rest.split_once('`') {
        told += before;
        let found = KEYWORDS.iter().find_map(|(setting, keyword)| {
            let after = after.strip_prefix(setting)?.strip_prefix('`')?;
            Some((Cow::Borrowed(*keyword), after))
        });
        let (word, after) = found.unwrap_or((Cow::Borrowed("`"), after));
        told += &word;
        rest = after;
    }
    told + rest
}

/// What became of work that was not to be finished.
pub enum Fault {
    /// An exception.
    Raised(PyErr),
    /// Ctrl-C came.
    Interrupted,
    /// The library failed within.
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
        let report = "please report it with what you called";
        Self::Broken(format!("the library failed within, which is a mistake in it: {report}"))
    }
}

/// Makes exceptions of errors.
pub trait Raise<T> {
    /// An exception of a class, with the error's words.
    ///
    /// # Errors
    /// Where there is an error.
    fn raise(self, class: fn(String) -> PyErr) -> PyResult<T>;
}

impl<T, E: Display> Raise<T> for Result<T, E> {
    fn raise(self, class: fn(String) -> PyErr) -> PyResult<T> {
        self.map_err(|error| class(told(&error)))
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
    argument => ArgumentError: "An array of another shape, or a number out of range.";
    target => TargetError: "A target that cannot be made or used.";
    family => FamilyError: "A family that cannot be used.";
    image => ImageError: "A picture that is none.";
    detection => DetectionError: "A detector that cannot be made, or a detection that cannot be read.";
    calibration => CalibrationError: "A calibration that has no solution.";
    camera => CameraError: "A camera that cannot be used.";
    verify => VerifyError: "A file that cannot be compared.";
    file => FileError: "A file that cannot be read or written.";
}

/// Makes exceptions of the errors of a file.
pub trait RaiseFile<T> {
    /// An exception of a class, with the error's words. Where the system does not give the file, it is a `FileError`
    /// with the system's number and words and the file's name, of a missing file a `MissingFileError`, of one that may
    /// not be used a `PermissionFileError`, of a folder in its place a `FolderError`.
    ///
    /// # Errors
    /// Where there is an error.
    fn raise_of_file(self, path: &Path, class: fn(String) -> PyErr) -> PyResult<T>;
}

impl<T, E: Error + 'static> RaiseFile<T> for Result<T, E> {
    fn raise_of_file(self, path: &Path, class: fn(String) -> PyErr) -> PyResult<T> {
        self.map_err(|error| {
            let mut cause: Option<&(dyn Error + 'static)> = Some(&error);
            let (mut number, mut at) = (None, path);
            while let Some(error) = cause {
                // The file may be another one, which that of the path names.
                if let Some(ReadError::Io { path, .. }) = error.downcast_ref() {
                    at = path;
                }
                let system = error.downcast_ref::<io::Error>();
                number = number.or(system.and_then(io::Error::raw_os_error));
                cause = error.source();
            }
            let words = told(&error);
            // A folder is refused before the system is asked, in these words.
            let refused = limits::check_file(at).err().filter(|_| number.is_none() && at.is_dir());
            let is_folder = refused.is_some_and(|refused| words.contains(&told(&refused)));
            match number.is_some() || is_folder {
                true => of_system(number, at).unwrap_or_else(|wrong| wrong),
                false => class(words),
            }
        })
    }
}

/// The exception for a number of the system, of a folder where a file is needed for none.
fn of_system(number: Option<i32>, path: &Path) -> PyResult<PyErr> {
    Python::attach(|py| {
        let make = py.import("deltille.errors")?.getattr("_of_system")?;
        Ok(PyErr::from_value(make.call1((number, path.as_os_str()))?))
    })
}

/// Issues a `UserWarning` at the caller's line.
pub fn warn(py: Python<'_>, what: &str) -> PyResult<()> {
    let what = CString::new(what.replace('\0', "")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &what, 2)
}

/// Does work without the interpreter's lock; a panic becomes an exception.
///
/// # Errors
/// Where the work panics.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| limits::caught(work)).map_err(|broken| Fault::from(broken).into())
}

/// What settings are called here, by what the library calls them.
#[pyfunction]
pub fn _keywords() -> Vec<(&'static str, &'static str)> {
    KEYWORDS.to_vec()
}

/// The same of a text of several lines.
pub fn told_in_lines(text: &str) -> String {
    text.split('\n').map(|line| told(&line)).collect::<Vec<_>>().join("\n")
}
