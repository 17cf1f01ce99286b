//! Proposes the next view of a target.

use deltille::calibrate::{Guide, Guided, Intrinsics, Reference, views};
use deltille::export::next_view::write;
use deltille_core::quantity::distance_mm;
use numpy::PyArray2;
use pyo3::prelude::*;

use super::keywords::of_detections;
use super::solving::{ModelChoice, Seen, assume, named};
use crate::boundary::arrays::{self, number, whole};
use crate::boundary::errors::{self, Raise, raised, unlocked};
use crate::see::arguments::Results;
use crate::see::camera::AnyCamera;
use crate::see::pose::Pose;
use crate::targets::target::Targets;

/// A proposed view: the pose of the board that improves the calibration most.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct NextView {
    next: deltille::calibrate::NextView,
    target: String,
    views: usize,
}

#[pymethods]
impl NextView {
    /// Number of views so far.
    #[getter]
    fn views(&self) -> usize {
        self.views
    }

    /// Instructions for the user; left and right are those of the image.
    #[getter]
    fn description(&self) -> String {
        self.next.to_string()
    }

    /// Proposed pose: camera from target.
    #[getter]
    fn camera_from_target(&self) -> Pose {
        Pose(self.next.camera_from_target)
    }

    /// Outlines of the panels visible from the front, N × 2 each, float64, px; they may extend beyond the image.
    #[getter]
    fn outlines<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        let outlines = self.next.outlines.iter();
        outlines.map(|outline| arrays::rows(py, outline.iter().map(|at| at.to_array()))).collect()
    }

    /// An arrow from the centre of the board towards its upper side, 2 × 2, float64, px; ``None`` if it is outside the lens.
    #[getter]
    fn up<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        self.next.upwards.map(|ends| arrays::rows(py, ends.iter().map(|at| at.to_array())))
    }

    /// Expected positions of the corners, N × 2, float64, px.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.next.corners.iter().map(|corner| corner.pixel.to_array()))
    }

    /// Panel id, row and column of each of them, N × 3, int64.
    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<i64>> {
        let corners = self.next.corners.iter();
        arrays::rows(
            py,
            corners.map(|c| [i64::from(c.panel.id()), i64::from(c.row), i64::from(c.col)]),
        )
    }

    /// Distance of the centre of the board from the camera, mm.
    #[getter]
    fn distance_mm(&self) -> f64 {
        self.next.distance_mm
    }

    /// Angle between the board's normal and the line of sight, rad.
    #[getter]
    fn tilt_rad(&self) -> f64 {
        self.next.tilt_rad
    }

    /// Current projection uncertainty at infinity over the whole image, px (1σ); ``None`` before there is a calibration.
    #[getter]
    fn uncertainty_px(&self) -> Option<f64> {
        self.next.now_px
    }

    /// Expected projection uncertainty with this view, px (1σ).
    #[getter]
    fn expected_px(&self) -> Option<f64> {
        self.next.expected_px
    }

    /// Returns whether no more views are needed.
    ///
    /// Parameters
    /// ----------
    /// until_px : float, optional
    ///     Required projection uncertainty, px. By default, views are enough once this one would lower the uncertainty by
    ///     less than 3 %.
    ///
    /// Returns
    /// -------
    /// bool
    #[pyo3(signature = (until_px = None))]
    fn is_enough(&self, until_px: Option<f64>) -> bool {
        self.next.is_enough(until_px)
    }

    /// Returns the text that ``deltille guide`` writes.
    fn to_json(&self) -> String {
        write(&self.next, &self.target, self.views, self.next.is_enough(None))
    }

    fn __repr__(&self) -> String {
        format!("<NextView {}: {}>", self.views + 1, self.next)
    }
}

/// Proposes the next view of a target that lowers the projection uncertainty over the whole image most.
///
/// Parameters
/// ----------
/// detections : sequence of Detection
///     Detections in the images so far; the sequence may be empty.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// model : str, optional
///     See :func:`calibrate`; ``"auto"`` and ``"spline"`` are not supported.
/// size_px : (int, int), optional
///     Width and height of the images; required before the first image unless ``camera`` is given.
/// camera : Camera or CalibratedCamera, optional
///     Initial guess of the camera; all its parameters are estimated.
/// nearest_mm, farthest_mm : float, optional
///     Range of distances at which the board can be held and is in focus.
/// avoid : sequence of NextView, optional
///     Views that cannot be taken.
/// assume_target : bool, optional
///     See :func:`calibrate`.
///
/// Returns
/// -------
/// NextView
///
/// Raises
/// ------
/// CalibrationError
///     If the size of the images is not known, or if detections do not belong to the target.
#[pyfunction]
#[pyo3(signature = (detections, target = None, model = "radtan", *, size_px = None, camera = None,
    nearest_mm = None, farthest_mm = None, avoid = None, assume_target = false))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn next_view(
    py: Python<'_>,
    detections: Results<'_>,
    target: Option<Targets>,
    model: &str,
    size_px: Option<(i64, i64)>,
    camera: Option<AnyCamera>,
    nearest_mm: Option<f64>,
    farthest_mm: Option<f64>,
    avoid: Option<Vec<PyRef<'_, NextView>>>,
    assume_target: bool,
) -> PyResult<NextView> {
    let wrong = |what: &str| raised::CalibrationError::new_err(what.to_owned());
    let target = target.or_else(|| of_detections(&detections.all, false));
    let seen = Seen::of(target, None, [None; 2], None)?;
    let [target] = seen.targets() else {
        return Err(wrong("next_view needs exactly one target"));
    };
    let checked = |name: &str, mm: Option<f64>| {
        mm.map(|mm| number(name, mm, distance_mm::RANGE, errors::calibration)).transpose()
    };
    let nearest = checked("nearest_mm", nearest_mm)?;
    let farthest = checked("farthest_mm", farthest_mm)?;
    let intrinsics = match (&camera, ModelChoice::of(model)?) {
        (Some(camera), _) => Intrinsics::Known(camera.0.clone()),
        (None, ModelChoice(Some(model))) => model.into(),
        (None, ModelChoice(None)) => {
            return Err(wrong(
                "model auto needs images to choose from; pass the candidate model with the most parameters",
            ));
        }
    };
    let of_pictures = detections.all.first().map(|first| [first.found.width, first.found.height]);
    let of_camera = camera.map(|camera| [camera.0.width, camera.0.height]);
    let side = |side: i64| whole("size_px", side, errors::calibration);
    let size_px = size_px.map(|(width, height)| Ok::<_, PyErr>([side(width)?, side(height)?]));
    let size = of_pictures.or(of_camera).or(size_px.transpose()?);
    let size = size.ok_or_else(|| wrong("size_px is required before the first image"))?;
    let guide = Guide::new(target, size, intrinsics);
    let guide = guide.ok_or_else(|| {
        wrong("no view can be proposed: the target has no corners, the model is spline, or the camera has another image size")
    })?;
    let avoided: Vec<deltille::calibrate::NextView> =
        avoid.unwrap_or_default().iter().map(|view| view.next.clone()).collect();
    let guide = guide.within_mm(nearest, farthest).avoiding(&avoided);
    let mut detections = named(py, &detections.all, None)?;
    if assume_target {
        assume(&mut detections, std::slice::from_ref(target));
    }
    let reference = Reference::Target(target);
    let shown = views(&detections, &reference).raise(errors::calibration)?.views;
    let Guided { next, .. } = unlocked(py, || guide.after(&reference, &shown))?;
    Ok(NextView { next, target: target.name.to_string(), views: shown.len() })
}
