//! Frames of photographs, videos and recordings.

use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

use deltille::detect;
use deltille::frames::{self, FrameOptions, FramesError};
use deltille::limits::Limits;
use deltille::photograph::Photograph;
use deltille::raster::{AnyGray, ImageView};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::boundary::arrays::whole;
use crate::boundary::errors::{self, RaiseFile, raised, unlocked, warn};
use crate::boundary::image::Picture;

/// The frames of a path. Each iteration reads them from the first, one at a time.
#[pyclass(frozen, module = "deltille")]
pub struct Frames {
    path: PathBuf,
    options: FrameOptions,
    accept_damaged: bool,
}

/// Reads the frames of a photograph, folder, video or recording, one at a time.
///
/// Parameters
/// ----------
/// path : path-like
///     A photograph, or a folder of them, in the order of their names; a video (Y4M; with an installed ffmpeg also MP4, MOV,
///     MKV, AVI, WebM); MCAP; a bag of ROS 1 (``.bag``) or 2 (its folder, or a ``.db3`` or ``.mcap`` file).
/// topic : str, optional
///     Topic of the images; needed if several topics of a recording contain images.
/// every : int, optional
///     Read only every N-th frame of a video or recording.
/// start, stop : int, optional
///     Read only the frames of a video or recording from number `start` up to, but without, `stop`. Earlier frames are
///     skipped without being decoded, except by ffmpeg.
/// max_pixels : int, optional
///     Maximum number of pixels of an image.
/// accept_damaged : bool, optional
///     Accept truncated JPEG files.
///
/// Returns
/// -------
/// Frames
///     An iterable of :class:`Frame`. Iteration warns if a recording is damaged or was not finished.
///
/// Raises
/// ------
/// ArgumentError
///     If ``every`` or ``max_pixels`` is less than 1, or ``start`` or ``stop`` is negative.
///
/// Examples
/// --------
/// >>> import deltille
/// >>> frames = deltille.frames("run.mcap", topic="/left/image_raw")
/// >>> tracker = deltille.Tracker(deltille.Detector(deltille.Board(10, 11)))
/// >>> for frame in frames:  # doctest: +SKIP
/// ...     print(frame.name, frame.time, len(tracker.detect(frame)))
#[pyfunction(name = "frames")]
#[pyo3(signature = (
    path, *, topic = None, every = 1, start = 0, stop = None, max_pixels = 150_000_000, accept_damaged = false
))]
pub fn frames_of(
    path: PathBuf,
    topic: Option<String>,
    every: i64,
    start: i64,
    stop: Option<i64>,
    max_pixels: i64,
    accept_damaged: bool,
) -> PyResult<Frames> {
    let mut options = FrameOptions::default();
    options.topic = topic;
    options.every = whole("every", every, errors::argument)?;
    options.start = whole("start", start, errors::argument)?;
    options.stop = stop.map(|stop| whole("stop", stop, errors::argument)).transpose()?;
    options.limits.max_pixels = whole("max_pixels", max_pixels, errors::argument)?;
    if options.every == 0 {
        return Err(raised::ArgumentError::new_err("every must be at least 1"));
    }
    Ok(Frames { path, options, accept_damaged })
}

#[pymethods]
impl Frames {
    fn __iter__(&self, py: Python<'_>) -> PyResult<FrameIterator> {
        let opened = unlocked(py, || frames::Frames::open(&self.path, &self.options))?;
        let frames = Mutex::new(opened.raise_of_file(&self.path, errors::image)?);
        let (path, limits) = (self.path.clone(), self.options.limits);
        Ok(FrameIterator { path, frames, limits, accept_damaged: self.accept_damaged })
    }

    fn __repr__(&self) -> String {
        format!("<Frames {}>", self.path.display())
    }
}

/// An iterator over frames.
#[pyclass(frozen, module = "deltille")]
pub struct FrameIterator {
    path: PathBuf,
    frames: Mutex<frames::Frames>,
    limits: Limits,
    accept_damaged: bool,
}

#[pymethods]
impl FrameIterator {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        let next =
            unlocked(py, || self.frames.lock().unwrap_or_else(PoisonError::into_inner).next())?;
        let frame = match next.transpose() {
            Err(early @ FramesError::Incomplete { .. }) => {
                warn(py, &early.to_string())?;
                return Ok(None);
            }
            next => next.raise_of_file(&self.path, errors::image)?,
        };
        Ok(frame.map(|frame| Frame {
            name: frame.name(),
            time_ns: frame.time_ns(),
            path: frame.path().to_owned(),
            encoded: Mutex::new(Some(frame)),
            decoded: OnceLock::new(),
            limits: self.limits,
            accept_damaged: self.accept_damaged,
        }))
    }
}

/// A photograph, or a frame of a video or recording. It is decoded when it is first used.
#[pyclass(frozen, module = "deltille")]
pub struct Frame {
    /// File name of a photograph; the stem of a recording and the number of the frame, such as ``run-000012``.
    #[pyo3(get)]
    name: String,
    /// Time stamp, ns, as an exact integer: that of the message's header, else of its recording; in a video, since its start.
    /// ``None`` for photographs.
    #[pyo3(get)]
    time_ns: Option<i64>,
    path: PathBuf,
    /// The frame until it is decoded.
    encoded: Mutex<Option<frames::Frame>>,
    decoded: OnceLock<Result<Photograph, String>>,
    limits: Limits,
    accept_damaged: bool,
}

impl Frame {
    /// Decodes the frame, once.
    fn photograph(&self) -> PyResult<&Photograph> {
        // Held while decoding, so that other threads wait for the result.
        let mut encoded = self.encoded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(frame) = encoded.take() {
            let read = frame.read(&self.limits, self.accept_damaged);
            let kept = read.as_ref().map_err(ToString::to_string).cloned();
            let _ = self.decoded.set(kept);
            read.raise_of_file(&self.path, errors::image)?;
        }
        match self.decoded.get() {
            Some(Ok(photograph)) => Ok(photograph),
            Some(Err(why)) => Err(errors::image(why.clone())),
            None => Err(errors::image(format!("{}: cannot be decoded", self.name))),
        }
    }
}

#[pymethods]
impl Frame {
    /// Time stamp, s; ``None`` for photographs. :attr:`time_ns` is exact.
    #[getter]
    fn time(&self) -> Option<f64> {
        self.time_ns.map(seconds)
    }

    /// Grey values, H × W, uint8 or uint16. Each access makes a new array.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let photograph = unlocked(py, || self.photograph())??;
        let size = [photograph.image.height(), photograph.image.width()];
        Ok(match &photograph.image {
            AnyGray::U8(image) => {
                PyArray1::from_slice(py, image.pixels()).reshape(size)?.into_any()
            }
            AnyGray::U16(image) => {
                PyArray1::from_slice(py, image.pixels()).reshape(size)?.into_any()
            }
        })
    }

    fn __repr__(&self) -> String {
        let time = self.time().map_or(String::new(), |time| format!(" at {time} s"));
        format!("<Frame {}{time}>", self.name)
    }
}

/// Returns a time stamp in seconds.
pub fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

/// Detects targets in an array or a frame. A frame has its own name and time stamp.
pub fn detected(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    name: &str,
    limits: &Limits,
    detect: impl Fn(ImageView<'_>, &str) -> detect::Detection + Sync,
) -> PyResult<detect::Detection> {
    let Ok(frame) = image.cast::<Frame>() else {
        let picture = Picture::of(image, limits)?;
        let view = picture.viewed()?;
        return unlocked(py, || detect(view, name));
    };
    let frame = frame.get();
    unlocked(py, || {
        let photograph = frame.photograph()?;
        let name = if name.is_empty() { &frame.name } else { name };
        let mut found = detect((&photograph.image).into(), name);
        (found.file, found.time_ns) = (photograph.notes.clone(), frame.time_ns);
        Ok(found)
    })?
}
