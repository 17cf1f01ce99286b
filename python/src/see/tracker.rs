//! Detects targets in the images of a video.

use std::sync::{Arc, Mutex, PoisonError};

use deltille::detect;
use pyo3::prelude::*;

use super::detection::Detection;
use super::detector::Detector;
use super::frames::detected;
use crate::targets::target::Target;
use deltille::limits::Limits;
use deltille::raster::ImageView;

/// Detects targets in successive images of a video, in less than half of the time that :class:`Detector`
/// takes for single images.
///
/// Corners are predicted from the last images. Some of the tags, or the outline of an untagged board, have to confirm the
/// labels; otherwise the image is searched. :attr:`Grid.tags` contains only the tags that were read in the image.
///
/// Parameters
/// ----------
/// detector : Detector
///     Detector of the target.
///
/// Examples
/// --------
/// >>> import deltille, numpy
/// >>> tracker = deltille.Tracker(deltille.Detector(deltille.Board(10, 11)))
/// >>> for frame in range(3):
/// ...     found = tracker.detect(numpy.zeros((480, 640), numpy.uint8))
/// >>> tracker.has_followed
/// False
#[pyclass(frozen, module = "deltille")]
pub struct Tracker {
    tracker: Mutex<detect::Tracker>,
    targets: Vec<Target>,
    limits: Limits,
}

#[pymethods]
impl Tracker {
    #[new]
    fn new(detector: &Detector) -> Self {
        let tracker = Mutex::new(detect::Tracker::new((*detector.detector).clone()));
        Self { tracker, targets: detector.targets.clone(), limits: detector.limits }
    }

    /// Detects the target in the next image.
    ///
    /// Parameters
    /// ----------
    /// image : ndarray or Frame
    ///     An image as for :meth:`Detector.detect`.
    /// name : str, optional
    ///     Name of the image, stored in the result.
    ///
    /// Returns
    /// -------
    /// Detection
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     If the array is not an image, or the frame cannot be read.
    #[pyo3(signature = (image, *, name = ""))]
    fn detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>, name: &str) -> PyResult<Detection> {
        let detect = |view: ImageView<'_>, name: &str| {
            self.tracker.lock().unwrap_or_else(PoisonError::into_inner).detect(view, name)
        };
        let found = detected(py, image, name, &self.limits, detect)?;
        Ok(Detection { found: Arc::new(found), targets: self.targets.clone() })
    }

    /// Whether the grids of the last image were followed from the image before it, not searched for.
    #[getter]
    fn has_followed(&self) -> bool {
        self.tracker.lock().unwrap_or_else(PoisonError::into_inner).has_followed()
    }

    /// Forgets the images so far. The next one is searched.
    fn reset(&self) {
        self.tracker.lock().unwrap_or_else(PoisonError::into_inner).reset();
    }
}
