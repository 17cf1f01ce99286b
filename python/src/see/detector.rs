//! Detects targets in images.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deltille::detect::{self, DetectorConfig, Ink, Refinement, Tone};
use deltille::lattice::GridKind;
use deltille::limits::Limits;
use deltille::photograph;
use deltille::raster::ImageView;
use deltille::targets::SIDES;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::detection::Detection;
use super::frames::detected;
use crate::boundary::arrays::whole;
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::targets::target::{Target, Targets};

/// Detects targets, or untagged boards, in images. Several threads can use one detector at the same time.
///
/// Parameters
/// ----------
/// target : Target or sequence of Target, optional
///     The target to find.
/// grid : str, optional
///     Tiling of untagged boards, instead of a target: ``"deltille"`` or ``"checker"``.
/// rows, cols : int, optional
///     Rows of corners and corners per row of an untagged board; it is labelled if it is completely visible.
/// tone : str or float, optional
///     Tone curve of the camera: ``"auto"`` (estimated from the corners), ``"linear"``, ``"srgb"``, or a gamma.
/// ink : str or float, optional
///     Ink spread of the print: ``"auto"`` (estimated from the corners), ``"none"``, or µm.
/// allow_mirrored : bool, optional
///     Label mirrored grids, too.
/// max_errors : int, optional
///     Maximum number of corrected cells per tag; defaults to the number that the family always corrects.
/// refine : str, optional
///     Subpixel method: ``"model"``, with covariances, or ``"polynomial"``, the method of the paper.
/// max_pixels : int, optional
///     Maximum number of pixels of an image.
///
/// Raises
/// ------
/// DetectionError
///     If neither a target nor a grid is given, or if two targets cannot be distinguished.
///
/// Examples
/// --------
/// >>> import deltille, numpy
/// >>> detector = deltille.Detector(deltille.Board(10, 11))
/// >>> found = detector.detect(numpy.zeros((480, 640), numpy.uint8))
/// >>> len(found), found.why.kind
/// (0, 'too_dark')
#[pyclass(frozen, module = "deltille")]
#[derive(Clone)]
pub struct Detector {
    pub(super) detector: Arc<detect::Detector>,
    pub(super) targets: Vec<Target>,
    pub(super) limits: Limits,
    asked: Arc<Asked>,
}

/// The keyword arguments of a detector, for pickling.
#[derive(Clone, Default)]
struct Asked {
    grid: Option<String>,
    rows: Option<u32>,
    cols: Option<u32>,
    tone: Option<String>,
    ink: Option<String>,
    allow_mirrored: bool,
    max_errors: Option<u32>,
    refine: String,
    max_pixels: u64,
}

/// A name or a number.
#[derive(FromPyObject)]
pub enum NameOrNumber {
    Number(f64),
    Name(String),
}

impl NameOrNumber {
    fn text(self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Name(name) => name,
        }
    }
}

/// Parses the name of a tiling.
pub fn tiling(name: &str) -> PyResult<GridKind> {
    match name {
        "deltille" => Ok(GridKind::Deltille),
        "checker" => Ok(GridKind::Checker),
        _ => Err(raised::DetectionError::new_err(format!(
            "unknown grid {name} (known: deltille, checker)"
        ))),
    }
}

/// Checks rows and columns, if they are given.
pub fn sides(rows: Option<i64>, cols: Option<i64>) -> PyResult<[Option<u32>; 2]> {
    let side = |name: &str, side: Option<i64>| {
        side.map(|side| whole(name, side, errors::detection)).transpose()
    };
    Ok([side("rows", rows)?, side("cols", cols)?])
}

/// Checks the rows and columns of a board: both or neither must be given.
pub fn size(rows: Option<u32>, cols: Option<u32>) -> PyResult<Option<(u32, u32)>> {
    let wrong = |what: &str| Err(raised::DetectionError::new_err(what.to_owned()));
    match (rows, cols) {
        (Some(rows), Some(cols)) if [rows, cols].iter().all(|side| SIDES.contains(side)) => {
            Ok(Some((rows, cols)))
        }
        (None, None) => Ok(None),
        (Some(_), Some(_)) => wrong("rows and cols must be from 2 to 500"),
        _ => wrong("rows and cols must be given together"),
    }
}

/// Rejects a maximum number of errors that a family of the targets cannot correct.
fn check_max_errors(targets: &[Target], max_errors: Option<u32>) -> PyResult<()> {
    for family in targets.iter().filter_map(|target| target.codes()) {
        if let Some(limit) = max_errors.filter(|limit| *limit > family.correctable()) {
            return Err(errors::detection(format!(
                "max_errors {limit} exceeds the {} cells that {} can correct",
                family.correctable(),
                family.name()
            )));
        }
    }
    Ok(())
}

#[pymethods]
impl Detector {
    #[new]
    #[pyo3(signature = (target = None, *, grid = None, rows = None, cols = None, tone = None, ink = None,
        allow_mirrored = false, max_errors = None, refine = "model", max_pixels = 150_000_000))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        target: Option<Targets>,
        grid: Option<&str>,
        rows: Option<i64>,
        cols: Option<i64>,
        tone: Option<NameOrNumber>,
        ink: Option<NameOrNumber>,
        allow_mirrored: bool,
        max_errors: Option<i64>,
        refine: &str,
        max_pixels: i64,
    ) -> PyResult<Self> {
        let wrong = |what: String| raised::DetectionError::new_err(what);
        let [rows, cols] = sides(rows, cols)?;
        let max_errors = max_errors.map(|most| whole("max_errors", most, errors::detection));
        let max_errors = max_errors.transpose()?;
        let max_pixels = whole("max_pixels", max_pixels, errors::detection)?;
        let asked = Asked {
            grid: grid.map(str::to_owned),
            rows,
            cols,
            tone: tone.map(NameOrNumber::text),
            ink: ink.map(NameOrNumber::text),
            allow_mirrored,
            max_errors,
            refine: refine.to_owned(),
            max_pixels,
        };
        let tone = asked.tone.as_ref().map_or(Ok(Tone::Auto), |tone| tone.parse());
        let ink = asked.ink.as_ref().map_or(Ok(Ink::Auto), |ink| ink.parse());
        let ink = ink.map_err(|error| wrong(format!("ink: {error}")))?;
        let config = DetectorConfig::default()
            .max_bit_errors(max_errors)
            .allow_mirrored(allow_mirrored)
            .tone(tone.map_err(|error| wrong(format!("tone: {error}")))?)
            .ink(ink)
            .refinement(match refine {
                "model" => Refinement::Model,
                "polynomial" => Refinement::Polynomial,
                _ => {
                    return Err(wrong(format!(
                        "unknown refine {refine} (known: model, polynomial)"
                    )));
                }
            });
        let mut limits = Limits::default();
        limits.max_pixels = max_pixels;
        let targets = target.map(|targets| targets.0).unwrap_or_default();
        let size = size(rows, cols)?;
        let detector = match (targets.as_slice(), grid) {
            ([], Some(grid)) => {
                if allow_mirrored && size.is_none() {
                    let what = "allow_mirrored needs a target, or rows and cols";
                    return Err(wrong(what.to_owned()));
                }
                if matches!(ink, Ink::Um(um) if um != 0.0) {
                    let what =
                        "ink in µm needs the size of the tiles: pass a target, or ink=\"none\"";
                    return Err(wrong(what.to_owned()));
                }
                detect::Detector::for_grid(tiling(grid)?, size, config)
            }
            ([], None) => {
                let what = "pass a target, or grid=\"deltille\" or \"checker\" for untagged boards";
                return Err(wrong(what.to_owned()));
            }
            (_, Some(_)) => {
                return Err(wrong("target and grid are mutually exclusive".to_owned()));
            }
            (targets, None) => {
                check_max_errors(targets, max_errors)?;
                let each: Vec<_> = targets.iter().map(|of| of.target()).collect();
                detect::Detector::for_targets(&each, config).raise(errors::detection)?
            }
        };
        let asked = Arc::new(asked);
        Ok(Self { detector: Arc::new(detector), targets, limits, asked })
    }

    /// Detects the target in an image.
    ///
    /// The interpreter's lock is released during detection; other threads must not change the
    /// array.
    ///
    /// Parameters
    /// ----------
    /// image : ndarray or Frame
    ///     A frame of :func:`frames`, or H × W of uint8, uint16, float32 or float64 (0, black, to 1, white), or H × W × 3 of uint8 in the order red, green, blue
    ///     (for OpenCV's blue, green, red, pass ``image[..., ::-1]``). Any strides are allowed; contiguous rows are not
    ///     copied.
    /// name : str, optional
    ///     Name of the image, stored in the result; defaults to that of the frame.
    ///
    /// Returns
    /// -------
    /// Detection
    ///     If nothing was found, :attr:`Detection.why` gives the reason.
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     If the array is not an image, or the frame cannot be read.
    #[pyo3(signature = (image, *, name = ""))]
    fn detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>, name: &str) -> PyResult<Detection> {
        let detect = |view: ImageView<'_>, name: &str| self.detector.detect(view, name);
        let found = detected(py, image, name, &self.limits, detect)?;
        Ok(Detection { found: Arc::new(found), targets: self.targets.clone() })
    }

    /// Detects the target in a photograph, decoded as in ``deltille detect``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     PNG, JPEG, TIFF, BMP, PGM or WebP.
    /// accept_damaged : bool, optional
    ///     Accept truncated JPEG files.
    ///
    /// Returns
    /// -------
    /// Detection
    ///
    /// Raises
    /// ------
    /// FileError
    ///     If the file cannot be opened; a :class:`MissingFileError` if it does not exist.
    /// ImageError
    ///     If the file is not an image.
    #[pyo3(signature = (path, *, accept_damaged = false))]
    fn detect_file(
        &self,
        py: Python<'_>,
        path: PathBuf,
        accept_damaged: bool,
    ) -> PyResult<Detection> {
        let found = unlocked(py, || {
            let read = photograph::read_with_notes(&path, &self.limits, accept_damaged);
            let photograph = read.raise_of_file(&path, errors::image)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let mut found = self.detector.detect(&photograph.image, &name);
            found.file = photograph.notes;
            Ok::<_, PyErr>(found)
        })??;
        Ok(Detection { found: Arc::new(found), targets: self.targets.clone() })
    }

    /// Detects the target in the content of a photograph file, decoded as in :meth:`detect_file`.
    ///
    /// Parameters
    /// ----------
    /// data : bytes
    ///     Content of a PNG, JPEG, TIFF, BMP, PGM or WebP file.
    /// name : str, optional
    ///     Name of the image, stored in the result.
    /// accept_damaged : bool, optional
    ///     Accept truncated JPEG files.
    ///
    /// Returns
    /// -------
    /// Detection
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     If the data is not an image.
    #[pyo3(signature = (data, *, name = "", accept_damaged = false))]
    fn detect_bytes(
        &self,
        py: Python<'_>,
        data: Vec<u8>,
        name: &str,
        accept_damaged: bool,
    ) -> PyResult<Detection> {
        let found = unlocked(py, || {
            let called = Path::new(if name.is_empty() { "data" } else { name });
            let read = photograph::read_bytes(called, data, &self.limits, accept_damaged);
            let photograph = read.raise(errors::image)?;
            let mut found = self.detector.detect(&photograph.image, name);
            found.file = photograph.notes;
            Ok::<_, PyErr>(found)
        })??;
        Ok(Detection { found: Arc::new(found), targets: self.targets.clone() })
    }

    /// Returns a detector for a second pass over images of one print, with their combined ink estimate.
    ///
    /// Parameters
    /// ----------
    /// detections : sequence of Detection
    ///
    /// Returns
    /// -------
    /// Detector or None
    ///     ``None`` if a second pass would change nothing.
    fn with_ink_of(&self, detections: Vec<PyRef<'_, Detection>>) -> Option<Self> {
        let found: Vec<_> = detections.iter().map(|seen| seen.found.ink).collect();
        let detector = self.detector.with_ink_of(&found)?;
        Some(Self { detector: Arc::new(detector), ..self.clone() })
    }

    /// The targets to find.
    #[getter]
    fn targets(&self) -> Vec<Target> {
        self.targets.clone()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> crate::Reduced<'py, (Vec<Target>, Bound<'py, PyDict>, Option<String>)> {
        let (py, own) = (slf.py(), slf.get());
        let restore = py.import("deltille._core")?.getattr("_detector")?;
        let asked = PyDict::new(py);
        let Asked { grid, rows, cols, tone, ink, allow_mirrored, max_errors, refine, max_pixels } =
            &*own.asked;
        asked.set_item("grid", grid)?;
        asked.set_item("rows", rows)?;
        asked.set_item("cols", cols)?;
        asked.set_item("tone", tone)?;
        asked.set_item("ink", ink)?;
        asked.set_item("allow_mirrored", allow_mirrored)?;
        asked.set_item("max_errors", max_errors)?;
        asked.set_item("refine", refine)?;
        asked.set_item("max_pixels", max_pixels)?;
        let known = own.detector.known_ink();
        let known = known.map(|ink| serde_json::to_string(&ink).unwrap_or_default());
        Ok((restore, (own.targets.clone(), asked, known)))
    }

    fn __repr__(&self) -> String {
        let names: Vec<&str> = self.targets.iter().map(|of| &*of.target().name).collect();
        format!(
            "<Detector {}>",
            if names.is_empty() { "of untagged boards".into() } else { names.join(", ") }
        )
    }
}

/// Restores a pickled detector.
#[pyfunction]
pub fn _detector<'py>(
    py: Python<'py>,
    targets: Vec<Bound<'py, Target>>,
    asked: &Bound<'py, PyDict>,
    ink: Option<&str>,
) -> PyResult<Detector> {
    let class = py.get_type::<Detector>();
    let made = match targets.is_empty() {
        true => class.call((), Some(asked))?,
        false => class.call((targets,), Some(asked))?,
    };
    let made = made.cast::<Detector>()?.get().clone();
    let Some(ink) = ink else { return Ok(made) };
    let ink = serde_json::from_str(ink).raise(errors::detection)?;
    Ok(Detector { detector: Arc::new((*made.detector).clone().with_ink(ink)), ..made })
}
