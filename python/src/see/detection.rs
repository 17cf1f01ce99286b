//! The result of detection in an image.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use deltille::calibrate::Reference;
use deltille::detect::{self, GridCorner};
use deltille::export::named::named;
use deltille::export::tables::{ImageRecord, folder};
use deltille::export::{DETECTION_FORMATS, detection, overlay};
use deltille::limits::Limits;
use deltille::targets;
use deltille_core::words::counted;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::frames::seconds;
use crate::boundary::arrays::{self, record};
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::image::Picture;
use crate::boundary::text_file::save_text;
use crate::pickles;
use crate::targets::families;
use crate::targets::target::{Target, Targets};

/// Why an image, or a grid in it, has no labels.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq, Serialize, Deserialize)]
pub struct Reason(pub detect::Reason);

#[pymethods]
impl Reason {
    /// The kind, such as ``"too_dark"``.
    #[getter]
    fn kind(&self) -> String {
        let kind = serde_json::to_value(self.0.kind).unwrap_or_default();
        kind.as_str().unwrap_or_default().to_owned()
    }

    /// The reason and its remedy, as a sentence.
    #[getter]
    fn sentence(&self) -> String {
        errors::one_line(&self.0)
    }

    /// Index of the grid concerned; ``None`` for the whole image.
    #[getter]
    fn grid(&self) -> Option<usize> {
        self.0.grid
    }

    /// Measured values; the keys include units.
    #[getter]
    fn figures(&self) -> BTreeMap<String, f64> {
        self.0.figures.clone()
    }

    /// Settings of the target with which the tags in the image would fit, as in the file of a detection: those of
    /// ``legacy``, ``size``, ``first_id``, ``spacing`` and ``family`` that differ; ``None`` if the tags do not
    /// contradict the target.
    #[getter]
    fn fits<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.0.fits.as_ref().map(|fits| record(py, fits)).transpose()
    }

    fn __str__(&self) -> String {
        self.sentence()
    }

    fn __repr__(&self) -> String {
        format!("<Reason {}: {}>", self.kind(), self.sentence())
    }
}

pickles!(Reason);

/// A tag decoded in an image.
#[pyclass(frozen, get_all, module = "deltille", eq)]
#[derive(Clone, PartialEq, Serialize, Deserialize)]
pub struct DecodedTag {
    /// Id of the tag.
    id: u32,
    /// Name of its family.
    family: String,
    /// Id of its panel; ``None`` if the grid has no labels.
    panel: Option<u32>,
    /// Row of the lower left vertex of its tile.
    row: i32,
    /// Column of that vertex.
    col: i32,
    /// Number of cells that were misread and corrected.
    errors: u32,
}

pickles!(DecodedTag);

#[pymethods]
impl DecodedTag {
    fn __repr__(&self) -> String {
        format!("DecodedTag(id={}, family={:?}, errors={})", self.id, self.family, self.errors)
    }
}

/// The detections in one image: corners with their labels, positions and covariances.
///
/// All arrays have one row for each of the N corners, in the same order, grid after grid. Each access makes a new array.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone)]
pub struct Detection {
    pub found: Arc<detect::Detection>,
    pub targets: Vec<Target>,
}

/// A connected part of a tiling in an image.
///
/// The arrays are those of :class:`Detection`, restricted to this grid.
#[pyclass(frozen, module = "deltille")]
#[derive(Clone)]
pub struct Grid {
    of: Detection,
    index: usize,
}

impl PartialEq for Detection {
    fn eq(&self, other: &Self) -> bool {
        self.found == other.found
    }
}

impl Detection {
    fn grids(&self) -> std::slice::Iter<'_, detect::Grid> {
        self.found.grids.iter()
    }

    /// Returns the target of a grid, if it is known.
    fn target_of(&self, grid: &detect::Grid) -> Option<&targets::Target> {
        let named =
            |name: &String| self.targets.iter().find(|target| *target.target().name == **name);
        let found = match &grid.target {
            Some(name) => named(name),
            None => self.targets.first(),
        };
        found.map(|found| found.target())
    }

    /// Attaches targets to a detection; `assume_target` accepts them even if the detection names others.
    fn of(
        mut found: detect::Detection,
        targets: Vec<Target>,
        assume_target: bool,
    ) -> PyResult<Self> {
        if assume_target {
            let given: Vec<_> = targets.iter().map(|target| target.target().identity()).collect();
            found.assume_targets(&given);
        }
        Self { found: Arc::new(found), targets }.checked()
    }

    /// Checks that the labels belong to the targets: otherwise they would refer to points that were never observed.
    fn checked(self) -> PyResult<Self> {
        let labelled = self.found.grids.iter().filter(|grid| grid.panel.is_some());
        for (grid, target) in labelled.filter_map(|grid| Some((grid, self.target_of(grid)?))) {
            let reference = Reference::Target(target);
            reference.check_labels(&self.found, grid).raise(errors::detection)?;
        }
        Ok(self)
    }

    /// Returns the positions of the corners of a grid on their target, mm.
    fn places(&self, grid: &detect::Grid) -> Vec<[f64; 3]> {
        let target = self.target_of(grid);
        let panel = target.zip(grid.panel);
        let panel =
            panel.and_then(|(target, id)| target.panels.iter().find(|panel| panel.id == id));
        let ids: BTreeMap<u32, usize> = panel.map_or_else(BTreeMap::new, |panel| {
            panel.corners.iter().enumerate().map(|(index, corner)| (corner.id, index)).collect()
        });
        let place = |corner: &GridCorner| {
            let index = corner.id.and_then(|id| ids.get(&id));
            let place = panel.zip(index).map(|(panel, &i)| panel.position_mm(&panel.corners[i]));
            place.map_or([f64::NAN; 3], |place| place.to_array())
        };
        grid.corners.iter().map(place).collect()
    }
}

/// Converts an id for an array: −1 if there is none.
fn id(id: Option<u32>) -> i64 {
    id.map_or(-1, i64::from)
}

macro_rules! corner_arrays {
    ($class:ident, $self:ident => $grids:expr, $of:expr) => {
        #[pymethods]
        impl $class {
            /// Positions, N × 2, float64, px: x right, y down, pixel centres at integers.
            #[getter]
            fn pixels<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                let corners = $grids.flat_map(|grid| &grid.corners);
                arrays::rows(py, corners.map(|corner| [corner.x, corner.y]))
            }

            /// Positions on the target, N × 3, float64, mm; NaN for corners without labels.
            #[getter]
            fn object_points<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                arrays::rows(py, $grids.flat_map(|grid| $of.places(grid)))
            }

            /// Ids in the target, N, int64; −1 for corners without labels.
            #[getter]
            fn ids<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
                let corners = $grids.flat_map(|grid| &grid.corners);
                arrays::column(py, corners.map(|corner| id(corner.id)))
            }

            /// Lattice rows, N, int64: absolute on the panel, or relative if the grid has no labels.
            #[getter]
            fn rows<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
                let corners = $grids.flat_map(|grid| &grid.corners);
                arrays::column(py, corners.map(|corner| i64::from(corner.row)))
            }

            /// Lattice columns, N, int64: absolute on the panel, or relative if the grid has no labels.
            #[getter]
            fn cols<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
                let corners = $grids.flat_map(|grid| &grid.corners);
                arrays::column(py, corners.map(|corner| i64::from(corner.col)))
            }

            /// Covariances of the positions, N × 2 × 2, float64, px²; NaN if the method computes none.
            #[getter]
            fn covariances<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
                let corners = $grids.flat_map(|grid| &grid.corners);
                arrays::covariances(py, corners.map(|corner| corner.cov))
            }

            /// The decoded tags.
            #[getter]
            fn tags(&$self) -> Vec<DecodedTag> {
                let of_grid = |grid: &detect::Grid| {
                    let tag = |tag: &detect::DecodedTag| DecodedTag {
                        id: tag.id,
                        family: tag.family.clone(),
                        panel: grid.panel,
                        row: tag.row,
                        col: tag.col,
                        errors: tag.errors,
                    };
                    grid.tags.iter().map(tag).collect::<Vec<_>>()
                };
                $grids.flat_map(of_grid).collect()
            }

            /// Whether a grid is a mirror image.
            #[getter]
            fn mirrored(&$self) -> bool {
                let mut grids = $grids;
                grids.any(|grid| grid.mirrored)
            }

            fn __len__(&$self) -> usize {
                $grids.map(|grid| grid.corners.len()).sum()
            }
        }
    };
}

corner_arrays!(Detection, self => self.found.grids.iter(), self);
corner_arrays!(Grid, self => std::iter::once(&self.of.found.grids[self.index]), self.of);

#[pymethods]
impl Grid {
    /// Id of the panel; ``None`` if the grid has no labels.
    #[getter]
    fn panel(&self) -> Option<u32> {
        self.of.found.grids[self.index].panel
    }

    /// Name of its target, if the detector searched for several.
    #[getter]
    fn target(&self) -> Option<&str> {
        self.of.found.grids[self.index].target.as_deref()
    }

    /// The tiling, ``"deltille"`` or ``"checker"``.
    #[getter]
    fn kind(&self) -> &'static str {
        families::kind(self.of.found.grids[self.index].kind)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.of.found.grids[self.index] == other.of.found.grids[other.index]
    }

    fn __repr__(&self) -> String {
        let grid = &self.of.found.grids[self.index];
        let panel = grid.panel.map_or("no labels".to_owned(), |panel| format!("panel {panel}"));
        format!("<Grid {}: {panel}, {} corners>", self.kind(), grid.corners.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (Detection, usize)> {
        let restore = slf.py().import("deltille._core")?.getattr("_grid")?;
        let own = slf.get();
        Ok((restore, (own.of.clone(), own.index)))
    }
}

#[pymethods]
impl Detection {
    /// Reads a detection: the ``.json`` of :meth:`save` or of ``deltille detect``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// target : Target or sequence of Target, optional
    ///     The target searched for; :attr:`object_points` are its corners.
    /// assume_target : bool, optional
    ///     Use the target even if the file names another one.
    ///
    /// Returns
    /// -------
    /// Detection
    #[staticmethod]
    #[pyo3(signature = (path, *, target = None, assume_target = false))]
    fn load(path: PathBuf, target: Option<Targets>, assume_target: bool) -> PyResult<Self> {
        let text = Limits::default().read_text(&path).raise_of_file(&path, errors::file)?;
        let wrong = |error: PyErr| {
            let what = format!("{}: {}", path.display(), error);
            raised::FileError::new_err(what.replace("DetectionError: ", ""))
        };
        Self::from_json(&text, target, assume_target).map_err(wrong)
    }

    /// Reads a detection from the text of a file, like :meth:`load`.
    #[staticmethod]
    #[pyo3(signature = (text, *, target = None, assume_target = false))]
    fn from_json(text: &str, target: Option<Targets>, assume_target: bool) -> PyResult<Self> {
        let found = detection::read(text).raise(errors::detection)?;
        Self::of(found, target.map(|targets| targets.0).unwrap_or_default(), assume_target)
    }

    /// Returns the text that ``deltille detect`` writes.
    fn to_json(&self) -> String {
        detection::write(&self.found)
    }

    /// Writes the detection.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// format : str, optional
    ///     ``"json"``, which :meth:`load` reads back, or one for other programs, such as ``"csv"``.
    /// overwrite : bool, optional
    ///     Replace an existing file even if it is of another kind.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, format = "json", *, overwrite = false))]
    fn save(&self, path: PathBuf, format: &str, overwrite: bool) -> PyResult<PathBuf> {
        let targets: Vec<_> = self.targets.iter().map(|target| target.target()).collect();
        let of_image = DETECTION_FORMATS.iter().filter(|format| format.is_of_one_image());
        let format = named(of_image, format).map_err(raised::DetectionError::new_err)?;
        let text = format.text(&self.found, &targets).unwrap_or_default();
        save_text(path, text, overwrite)
    }

    /// Name of the image.
    #[getter]
    fn image(&self) -> &str {
        &self.found.image
    }

    /// Width of the image, px.
    #[getter]
    fn width(&self) -> u32 {
        self.found.width
    }

    /// Height of the image, px.
    #[getter]
    fn height(&self) -> u32 {
        self.found.height
    }

    /// Always ``None``; distinguishes detections from failures in the results of many images.
    #[getter]
    fn error(&self) -> Option<bool> {
        None
    }

    /// The targets searched for.
    #[getter]
    fn targets(&self) -> Vec<Target> {
        self.targets.clone()
    }

    /// The grids: labelled ones in the order of their panel ids, then the others, largest first.
    #[getter(grids)]
    fn all_grids(&self) -> Vec<Grid> {
        (0..self.found.grids.len()).map(|index| Grid { of: self.clone(), index }).collect()
    }

    /// Ids of the panels of the corners, N, int64; −1 for corners without labels.
    #[getter]
    fn panels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of = |grid: &detect::Grid| std::iter::repeat_n(id(grid.panel), grid.corners.len());
        arrays::column(py, self.grids().flat_map(of).collect::<Vec<_>>())
    }

    /// Index of the grid of each corner, N, int64.
    #[getter]
    fn grid_indices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of =
            |(index, grid): (i64, &detect::Grid)| std::iter::repeat_n(index, grid.corners.len());
        arrays::column(py, (0..).zip(&self.found.grids).flat_map(of).collect::<Vec<_>>())
    }

    /// Why nothing was found or labelled; ``None`` if there is no such reason.
    #[getter]
    fn why(&self) -> Option<Reason> {
        self.found.reasons.first().cloned().map(Reason)
    }

    /// All reasons why something was not found or labelled.
    #[getter]
    fn reasons(&self) -> Vec<Reason> {
        self.found.reasons.iter().cloned().map(Reason).collect()
    }

    /// Estimate of the camera's tone curve: ``kappa``, ``kappa_sd`` (1σ), ``black``, ``white``, ``used`` and
    /// others; ``None`` if it was not estimated.
    #[getter]
    fn tone<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.found.tone.map(|tone| record(py, &tone)).transpose()
    }

    /// Estimate of the ink spread of the print: ``um``, ``um_sd`` (1σ), ``edges``, ``used`` and others; ``None`` if
    /// it was not estimated.
    #[getter]
    fn ink<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.found.ink.map(|ink| record(py, &ink)).transpose()
    }

    /// Identities of the targets searched for, which distinguish results of different targets: ``name``, ``fingerprint``,
    /// ``labels``, ``panels``, ``corners`` and ``edge_mm`` of each; empty if they are not known.
    #[getter]
    fn target_identities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        record(py, &self.found.targets)
    }

    /// Time stamp of a frame, s; ``None`` for photographs. :attr:`time_ns` is exact.
    #[getter]
    fn time(&self) -> Option<f64> {
        self.found.time_ns.map(seconds)
    }

    /// Time stamp of a frame, ns, as an exact integer; ``None`` for photographs.
    #[getter]
    fn time_ns(&self) -> Option<i64> {
        self.found.time_ns
    }

    /// EXIF orientation, 2 to 8; ``None`` if the image is upright.
    #[getter]
    fn exif_orientation(&self) -> Option<u8> {
        self.found.file.exif_orientation
    }

    /// Camera, lens and focal length in the EXIF metadata, those of ``make``, ``model``, ``serial``, ``lens``,
    /// ``focal_mm`` and ``focal_35mm_mm`` that are known; ``None`` if there are none.
    #[getter]
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.found.file.camera.as_ref().map(|camera| record(py, camera)).transpose()
    }

    /// Why some pixels are missing from the file; ``None`` for an intact file.
    #[getter]
    fn damage(&self) -> Option<&str> {
        self.found.file.damage.as_deref()
    }

    /// Draws the corners, grids and ids over the image.
    ///
    /// Parameters
    /// ----------
    /// image : ndarray
    ///     The image, as for :meth:`Detector.detect`.
    /// legible : bool, optional
    ///     Enlarge or reduce the image until all ids are legible, as ``deltille detect --overlay`` does.
    ///
    /// Returns
    /// -------
    /// ndarray of H × W × 3, uint8
    ///     Red, green, blue; of the size of the image unless ``legible``.
    #[pyo3(signature = (image, *, legible = false))]
    fn draw<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        legible: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let picture = Picture::of(image, &Limits::default())?.grey_values()?;
        let size = [picture.width(), picture.height()];
        if size != [self.found.width as usize, self.found.height as usize] {
            let (width, height) = (self.found.width, self.found.height);
            let what = format!(
                "the image has {} × {} px, but the detection is of one with {width} × {height} px",
                size[0], size[1]
            );
            return Err(errors::image(what));
        }
        let drawn = unlocked(py, || overlay::rgb(&picture, &self.found, legible))?;
        let (pixels, [width, height]) = drawn.raise(errors::image)?;
        Ok(PyArray1::from_vec(py, pixels).reshape([height, width, 3])?.into_any())
    }

    fn __repr__(&self) -> String {
        let corners: usize = self.grids().map(|grid| grid.corners.len()).sum();
        let tags: usize = self.grids().map(|grid| grid.tags.len()).sum();
        let why = self.found.reasons.first().map_or(String::new(), |why| format!(": {why}"));
        let image = &self.found.image;
        let name = if image.is_empty() { String::new() } else { format!(" {image}") };
        let [grids, corners, tags] =
            [(self.found.grids.len(), "grid"), (corners, "corner"), (tags, "tag")]
                .map(|(count, of)| counted(count, of));
        format!("<Detection{name}: {grids}, {corners}, {tags}{why}>")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String, Vec<Target>)> {
        let restore = slf.py().import("deltille._core")?.getattr("_detection")?;
        let own = slf.get();
        Ok((restore, (own.to_json(), own.targets.clone())))
    }
}

/// Restores a pickled detection.
#[pyfunction]
pub fn _detection(json: &str, targets: Vec<PyRef<'_, Target>>) -> PyResult<Detection> {
    let found = Arc::new(detection::read(json).raise(errors::detection)?);
    Ok(Detection { found, targets: targets.iter().map(|target| (**target).clone()).collect() })
}

/// Restores a pickled grid.
#[pyfunction]
pub fn _grid(of: &Detection, index: usize) -> PyResult<Grid> {
    match index < of.found.grids.len() {
        true => Ok(Grid { of: of.clone(), index }),
        false => Err(raised::DetectionError::new_err(format!("the detection has no grid {index}"))),
    }
}

/// The result for an image: its name, and its detection or why it could not be read.
type Row = (String, Option<Detection>, Option<String>);

/// Reads detections from tables: Parquet files, or folders that contain them.
#[pyfunction]
pub fn _tables(
    paths: Vec<PathBuf>,
    targets: Option<Targets>,
    assume_target: bool,
) -> PyResult<Vec<Row>> {
    let mut files = Vec::new();
    let first = paths.first().cloned().unwrap_or_default();
    for path in paths {
        if path.is_dir() {
            files.extend(folder::files(&path).raise_of_file(&path, errors::file)?);
        } else {
            let other = folder::beside(&path).filter(|other| !files.contains(other));
            files.extend(other);
            files.push(path);
        }
    }
    let targets = targets.map(|targets| targets.0).unwrap_or_default();
    let row = |picture: ImageRecord| match picture.found {
        Ok(found) => {
            let found = Detection::of(found, targets.clone(), assume_target)?;
            Ok((picture.image, Some(found), None))
        }
        Err(why) => Ok((picture.image, None, Some(why))),
    };
    let read = folder::read(&files, &Limits::default()).raise_of_file(&first, errors::file)?;
    read.images.into_iter().map(row).collect()
}
