//! Finding targets in pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use deltille::detect::{self, DetectorConfig, Ink, Refinement, Tone};
use deltille::lattice::GridKind;
use deltille::limits::Limits;
use deltille::photograph;
use deltille::targets::SIDES;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::detection::{Detection, Targets};
use crate::boundary::arrays::whole;
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::image::Picture;
use crate::targets::target::Target;

/// Finds targets, or untagged boards, in pictures. One detector may be used by several threads at a time.
///
/// Parameters
/// ----------
/// target : Target or sequence of Target, optional
///     What is looked for.
/// grid : str, optional
///     Without a target the tiling of untagged boards: ``"deltille"`` or ``"checker"``.
/// rows, cols : int, optional
///     Rows of corners and corners in each row of such a board, which is labelled where it is seen whole.
/// tone : str or float, optional
///     The camera's tone curve: ``"auto"`` (found from the corners), ``"linear"``, ``"srgb"``, or a gamma.
/// ink : str or float, optional
///     How far ink has spread on the print: ``"auto"`` (found from the corners), ``"none"``, or µm.
/// allow_mirrored : bool, optional
///     Whether grids seen as in a mirror get labels too.
/// max_errors : int, optional
///     Most cells of a tag that may be corrected; as many as the family always mends if left out.
/// refine : str, optional
///     ``"model"``, with covariances, or ``"polynomial"``, that of the paper.
/// max_pixels : int, optional
///     Most pixels of a picture.
///
/// Raises
/// ------
/// DetectionError
///     Where there is nothing to look for, or two targets cannot be told apart.
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
    detector: Arc<detect::Detector>,
    targets: Vec<Target>,
    limits: Limits,
    asked: Arc<Asked>,
}

/// The keywords by which a detector was made, to make it again elsewhere.
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

/// A tiling by its name.
pub fn tiling(name: &str) -> PyResult<GridKind> {
    match name {
        "deltille" => Ok(GridKind::Deltille),
        "checker" => Ok(GridKind::Checker),
        _ => Err(raised::DetectionError::new_err("grid: give deltille or checker")),
    }
}

/// Rows and columns, where they are given.
pub fn sides(rows: Option<i64>, cols: Option<i64>) -> PyResult<[Option<u32>; 2]> {
    let side = |name: &str, side: Option<i64>| {
        side.map(|side| whole(name, side, errors::detection)).transpose()
    };
    Ok([side("rows", rows)?, side("cols", cols)?])
}

/// A board's rows and columns, which are both known or neither.
pub fn size(rows: Option<u32>, cols: Option<u32>) -> PyResult<Option<(u32, u32)>> {
    let wrong = |what: &str| Err(raised::DetectionError::new_err(what.to_owned()));
    match (rows, cols) {
        (Some(rows), Some(cols)) if [rows, cols].iter().all(|side| SIDES.contains(side)) => {
            Ok(Some((rows, cols)))
        }
        (None, None) => Ok(None),
        (Some(_), Some(_)) => wrong("rows and cols: a board has 2 to 500 of each"),
        _ => wrong("give rows and cols, or neither"),
    }
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
                _ => return Err(wrong("refine: give model or polynomial".to_owned())),
            });
        let mut limits = Limits::default();
        limits.max_pixels = max_pixels;
        let targets = target.map(|targets| targets.0).unwrap_or_default();
        let size = size(rows, cols)?;
        let detector = match (targets.as_slice(), grid) {
            ([], Some(grid)) => {
                if allow_mirrored && size.is_none() {
                    let what = "allow_mirrored needs labels: give a target, or rows and cols";
                    return Err(wrong(what.to_owned()));
                }
                if matches!(ink, Ink::Um(um) if um != 0.0) {
                    let what = "ink: µm need the size of the tiles: give a target, or ink=\"none\"";
                    return Err(wrong(what.to_owned()));
                }
                detect::Detector::for_grid(tiling(grid)?, size, config)
            }
            ([], None) => {
                let what = "give a target, or grid=\"deltille\" or \"checker\" for untagged boards";
                return Err(wrong(what.to_owned()));
            }
            (_, Some(_)) => {
                return Err(wrong("give a target or a grid, not both".to_owned()));
            }
            (targets, None) => {
                for family in targets.iter().filter_map(|target| target.codes()) {
                    if let Some(limit) = max_errors.filter(|limit| *limit > family.correctable()) {
                        return Err(wrong(format!(
                            "max_errors: {limit} is more than the {} bits that {} can correct",
                            family.correctable(),
                            family.name()
                        )));
                    }
                }
                let each: Vec<_> = targets.iter().map(|of| of.target()).collect();
                detect::Detector::for_targets(&each, config).raise(errors::detection)?
            }
        };
        let asked = Arc::new(asked);
        Ok(Self { detector: Arc::new(detector), targets, limits, asked })
    }

    /// Finds what is looked for in a picture.
    ///
    /// The interpreter's lock is released meanwhile; the array must not be changed by other threads.
    ///
    /// Parameters
    /// ----------
    /// image : ndarray
    ///     H × W of uint8, uint16 or float32 (0, black, to 1, white), or H × W × 3 of uint8 in the order red, green,
    ///     blue (of OpenCV's blue, green, red give ``image[..., ::-1]``). Any strides; rows that lie in memory as they
    ///     are read are not copied.
    /// name : str, optional
    ///     Name of the picture, which is noted in the result.
    ///
    /// Returns
    /// -------
    /// Detection
    ///     Where nothing was found, :attr:`Detection.why` says why.
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     Where the array is no picture.
    #[pyo3(signature = (image, *, name = ""))]
    fn detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>, name: &str) -> PyResult<Detection> {
        let picture = Picture::of(image, &self.limits)?;
        let Some(view) = picture.view() else {
            return Err(raised::ImageError::new_err("the array has no rows of pixels"));
        };
        let found = unlocked(py, || self.detector.detect(view, name))?;
        Ok(Detection { found: Arc::new(found), targets: self.targets.clone() })
    }

    /// Finds what is looked for in a photograph, decoded as ``deltille detect`` does.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     PNG, JPEG, TIFF, BMP, PGM or WebP.
    /// accept_damaged : bool, optional
    ///     Whether JPEG files of which a part is missing are read too.
    ///
    /// Returns
    /// -------
    /// Detection
    ///
    /// Raises
    /// ------
    /// FileError
    ///     Where the file cannot be opened; a :class:`MissingFileError` where it is not there.
    /// ImageError
    ///     Where it is no picture.
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

    /// Finds what is looked for in a photograph whose file somebody else has read, decoded as :meth:`detect_file` does.
    ///
    /// Parameters
    /// ----------
    /// data : bytes
    ///     Content of a PNG, JPEG, TIFF, BMP, PGM or WebP file.
    /// name : str, optional
    ///     Name of the picture, which is noted in the result.
    /// accept_damaged : bool, optional
    ///     Whether JPEG files of which a part is missing are read too.
    ///
    /// Returns
    /// -------
    /// Detection
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     Where this is no picture.
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

    /// The same detector for a second look at pictures of one print, with what they say together of the ink.
    ///
    /// Parameters
    /// ----------
    /// detections : sequence of Detection
    ///
    /// Returns
    /// -------
    /// Detector or None
    ///     ``None`` where a second look would find nothing else.
    fn with_ink_of(&self, detections: Vec<PyRef<'_, Detection>>) -> Option<Self> {
        let found: Vec<_> = detections.iter().map(|seen| seen.found.ink).collect();
        let detector = self.detector.with_ink_of(&found)?;
        Some(Self { detector: Arc::new(detector), ..self.clone() })
    }

    /// The targets that are looked for.
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

/// A detector that was pickled.
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
