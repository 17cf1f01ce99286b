//! Families of tags: codes, decoding, search.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use deltille::clock;
use deltille::family::search::best::{Best, Budget};
use deltille::family::{self, Control, Decoder, FamilyError, Progress};
use deltille::lattice::{Dimension, GridKind};
use numpy::{PyArray1, PyArrayLike1};
use pyo3::prelude::*;

use crate::boundary::arrays::{self, whole};
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::interrupt::interruptible;
use crate::boundary::text_file::save_text;

/// A family of tags: codes with a minimum Hamming distance over all rotations.
#[pyclass(frozen, module = "deltille")]
#[derive(Clone)]
pub struct Family {
    pub family: Arc<family::Family>,
    decoder: Arc<OnceLock<Decoder>>,
}

impl From<Arc<family::Family>> for Family {
    fn from(family: Arc<family::Family>) -> Self {
        Self { family, decoder: Arc::default() }
    }
}

/// A family, or its name or path.
pub enum FamilyChoice {
    Family(Arc<family::Family>),
    Name(PathBuf),
}

impl<'a, 'py> FromPyObject<'a, 'py> for FamilyChoice {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(family) = given.cast::<Family>() {
            return Ok(Self::Family(family.get().family.clone()));
        }
        Ok(Self::Name(given.extract()?))
    }
}

impl FamilyChoice {
    /// Returns its name in specifications, and the family.
    pub fn resolve(self) -> PyResult<(String, Arc<family::Family>)> {
        match self {
            Self::Family(family) => Ok((family.name().to_owned(), family)),
            Self::Name(path) => {
                let name = path.to_string_lossy().into_owned();
                let found = family::resolve(&name).raise_of_file(&path, errors::family)?;
                Ok((name, Arc::new(found)))
            }
        }
    }
}

#[pymethods]
impl Family {
    /// Loads a bundled family by its name, or a family from a file.
    ///
    /// Parameters
    /// ----------
    /// name_or_path : str or path-like
    ///     A name such as ``"delTag25h7"``, see :meth:`shipped`, or a ``.json`` file of ``deltag gen-family``.
    ///
    /// Returns
    /// -------
    /// Family
    #[staticmethod]
    fn load(name_or_path: PathBuf) -> PyResult<Self> {
        let found = family::resolve(&name_or_path.to_string_lossy());
        let found = found.raise_of_file(&name_or_path, errors::family)?;
        Ok(Arc::new(found).into())
    }

    /// Reads a family from the text of a file, like :meth:`load`.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Ok(Arc::new(family::Family::from_json(text).raise(errors::family)?).into())
    }

    /// Returns the names of the families bundled with the package.
    #[staticmethod]
    fn shipped() -> Vec<&'static str> {
        family::shipped_names()
    }

    /// Returns the text of the family's file.
    fn to_json(&self) -> String {
        self.family.to_json()
    }

    /// Writes the family's file.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// overwrite : bool, optional
    ///     Replace an existing file even if it is of another kind.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, path: PathBuf, overwrite: bool) -> PyResult<PathBuf> {
        save_text(path, self.to_json(), overwrite)
    }

    /// Name of the family.
    #[getter]
    fn name(&self) -> &str {
        self.family.name()
    }

    /// Number of data cells (bits) of a tag.
    #[getter]
    fn bits(&self) -> u32 {
        self.family.dimension().bits()
    }

    /// Minimum Hamming distance of two tags, over all rotations.
    #[getter]
    fn distance(&self) -> u32 {
        self.family.distance()
    }

    /// Number of misread cells that are always corrected.
    #[getter]
    fn correctable(&self) -> u32 {
        self.family.correctable()
    }

    /// ``"deltille"`` for triangular tags, ``"checker"`` for square ones.
    #[getter]
    fn kind(&self) -> &'static str {
        kind(self.family.kind())
    }

    /// Fingerprint of the codes.
    #[getter]
    fn fingerprint(&self) -> &str {
        self.family.fingerprint()
    }

    /// The codes, N, uint64; the id of a tag is its index.
    #[getter]
    fn codes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        arrays::column(py, self.family.codes().iter().copied())
    }

    /// Computes the histogram of Hamming distances between codes, over all rotations.
    ///
    /// Returns
    /// -------
    /// distances : ndarray of D, int64
    ///     Distances that occur, in cells.
    /// counts : ndarray of D, int64
    ///     Number of pairs at each distance.
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn distances<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>)> {
        let family = self.family.clone();
        let found = unlocked(py, move || family.histogram().clone())?;
        let distances = arrays::column(py, found.keys().map(|&distance| i64::from(distance)));
        let number = |&count: &u64| i64::try_from(count).unwrap_or(i64::MAX);
        Ok((distances, arrays::column(py, found.values().map(number))))
    }

    /// Computes the false-positive rates for random cells.
    ///
    /// Returns
    /// -------
    /// ndarray of :attr:`correctable` + 1, float64
    ///     Probabilities with 0, 1, … corrected cells.
    fn false_positive_rates<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.family.false_positive_rates())
    }

    /// Computes the probability that a triangle with a border in a natural image is decoded as a tag.
    ///
    /// Returns
    /// -------
    /// ndarray of :attr:`correctable` + 1, float64, or None
    ///     Probabilities with 0, 1, … corrected cells, known within a factor of 3; ``None`` for square tags and for position
    ///     codes.
    fn natural_false_positive_rates<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let family = self.family.clone();
        let rates = unlocked(py, move || family.natural_false_positive_rates())?;
        Ok(rates.map(|rates| arrays::column(py, rates)))
    }

    /// Computes the maximum number of cells to correct in single tags so that false positives in
    /// natural images stay rare.
    ///
    /// Parameters
    /// ----------
    /// accepted : float, optional
    ///     Maximum probability that a triangle with a border in a natural image is decoded as a tag.
    ///
    /// Returns
    /// -------
    /// int or None
    ///     ``None`` if the rate is larger even without correction, or if natural rates are not known.
    #[pyo3(signature = (accepted = 1e-4))]
    fn recommended_correction(&self, py: Python<'_>, accepted: f64) -> PyResult<Option<u32>> {
        if !(0.0..=1.0).contains(&accepted) {
            return Err(raised::FamilyError::new_err("accepted must be a probability from 0 to 1"));
        }
        let family = self.family.clone();
        unlocked(py, move || family.recommended_correction(accepted))
    }

    /// Decodes words: finds the nearest codes in any rotation.
    ///
    /// Parameters
    /// ----------
    /// words : array of N, uint64
    ///     Words with one bit per cell.
    /// max_errors : int, optional
    ///     Maximum number of misread cells; defaults to :attr:`correctable`, up to which results are unique.
    ///
    /// Returns
    /// -------
    /// ids : ndarray of N, int64
    ///     Ids of the tags; −1 if no code is close enough.
    /// rotations : ndarray of N, int64
    ///     Number of counter-clockwise rotations of the tag, by 120° or, for square tags, 90°; −1 if no code is close enough.
    /// corrected : ndarray of N, int64
    ///     Number of misread cells; −1 if no code is close enough.
    #[expect(clippy::type_complexity, reason = "three arrays")]
    #[pyo3(signature = (words, max_errors = None))]
    fn decode<'py>(
        &self,
        py: Python<'py>,
        words: PyArrayLike1<'py, u64>,
        max_errors: Option<i64>,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>)>
    {
        let words: Vec<u64> = words.as_array().iter().copied().collect();
        let bits = self.bits();
        if let Some(word) = words.iter().find(|&&word| bits < 64 && word >> bits != 0) {
            let what = format!("{word:#x} has more than the {bits} bits of {}", self.name());
            return Err(raised::FamilyError::new_err(what));
        }
        let most = max_errors.map(|most| whole("max_errors", most, errors::family));
        let most = most.transpose()?.unwrap_or(self.correctable());
        let own = self.clone();
        let found = unlocked(py, move || {
            let decoder = own.decoder.get_or_init(|| Decoder::new(&own.family));
            let found = |word: u64| decoder.decode(word, most);
            words.into_iter().map(found).collect::<Vec<_>>()
        })?;
        let numbers = |of: fn(family::Decoded) -> i64| {
            arrays::column(py, found.iter().map(|found| found.map_or(-1, of)))
        };
        Ok((
            numbers(|found| found.id.into()),
            numbers(|found| found.rotations.into()),
            numbers(|found| found.errors.into()),
        ))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.to_json() == other.to_json()
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.to_json().hash(&mut hasher);
        hasher.finish()
    }

    fn __len__(&self) -> usize {
        self.family.len()
    }

    fn __repr__(&self) -> String {
        format!("<Family {}: {} codes>", self.family.name(), self.family.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String,)> {
        Ok((slf.get_type().getattr("from_json")?, (slf.get().to_json(),)))
    }
}

/// Returns the name of a tiling.
pub fn kind(kind: GridKind) -> &'static str {
    match kind {
        GridKind::Deltille => "deltille",
        GridKind::Checker => "checker",
    }
}

/// Searches for a family of triangular tags, starting from the best known one.
///
/// Parameters
/// ----------
/// name : str
///     Name of the family, such as ``"d25h7"``: 25 bits, Hamming distance 7.
/// seconds : float, optional
///     Duration of the search; the result then depends on the machine.
/// work : int, optional
///     Amount of work instead of a duration; gives the same codes on every machine.
/// seed : int, optional
///     Seed of the random choices.
/// from_scratch : bool, optional
///     Start from scratch instead of from the best known family.
/// callback : callable, optional
///     Called regularly with the fraction done (0 to 1) and the number of codes so far. If it returns ``False``, the search
///     ends with the best family so far.
///
/// Returns
/// -------
/// Family
#[pyfunction]
#[pyo3(signature = (name, *, seconds = 60.0, work = None, seed = 0, from_scratch = false, callback = None))]
pub fn search_family(
    py: Python<'_>,
    name: &str,
    seconds: f64,
    work: Option<i64>,
    seed: i64,
    from_scratch: bool,
    callback: Option<Py<PyAny>>,
) -> PyResult<Family> {
    let wrong = |what: &str| raised::FamilyError::new_err(format!("{name}: {what}"));
    let parts = name.strip_prefix('d').and_then(|rest| rest.split_once('h'));
    let numbers = parts.and_then(|(bits, h)| Some((bits.parse().ok()?, h.parse().ok()?)));
    let (bits, distance): (u32, u32) =
        numbers.ok_or_else(|| wrong("expected bits and distance, such as d25h7"))?;
    let dimension = Dimension::from_bits(bits).raise(errors::family)?;
    family::check_name(name, dimension, distance).raise(errors::family)?;
    if !(0.0..=1e9).contains(&seconds) {
        return Err(wrong("seconds must be from 0 to 1e9"));
    }
    let budget = match work {
        Some(steps) => Budget::Work(whole("work", steps, errors::family)?),
        None => Budget::Time(Duration::from_secs_f64(seconds), clock::now),
    };
    let search = Best::new(dimension, distance, budget).seed(whole("seed", seed, errors::family)?);
    let own_name = name.to_owned();
    let raised_by_callback: Arc<Mutex<Option<PyErr>>> = Arc::default();
    let error = raised_by_callback.clone();
    let found = interruptible(py, move |stop| {
        let start = if from_scratch { None } else { search.start() };
        let report = |progress: Progress| {
            if let Some(callback) = &callback {
                report_progress(callback, progress, stop, &error);
            }
        };
        let control = Control::default().cancel(stop).report(&report);
        search.family(&own_name, start, control)
    })?;
    if let Some(error) = raised_by_callback.lock().ok().and_then(|mut error| error.take()) {
        return Err(error);
    }
    match found {
        Ok(found) => Ok(Arc::new(found).into()),
        Err(FamilyError::Field { field, .. }) if field == "codes" => {
            Err(wrong("no word satisfies the rules at this distance; use a smaller distance"))
        }
        Err(error) => Err(errors::family(errors::one_line(&error))),
    }
}

/// Reports the progress of a search to the callback.
fn report_progress(
    callback: &Py<PyAny>,
    progress: Progress,
    stop: &AtomicBool,
    error: &Mutex<Option<PyErr>>,
) {
    let part = progress.done as f64 / progress.total.max(1) as f64;
    let answer = Python::attach(|py| {
        let answer = callback.call1(py, (part.min(1.0), progress.codes))?;
        Ok::<_, PyErr>(answer.is(pyo3::types::PyBool::new(py, false)))
    });
    match answer {
        Ok(false) => {}
        Ok(true) => stop.store(true, Ordering::Relaxed),
        Err(raised) => {
            stop.store(true, Ordering::Relaxed);
            if let Ok(mut error) = error.lock() {
                error.get_or_insert(raised);
            }
        }
    }
}
