//! One calibrated camera, as arrays.

use std::sync::Arc;

use deltille::calibrate::Matrix;
use deltille::calibrate::{self as solver, CameraEstimate, Source, ViewEstimate};
use deltille::camera;
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

use super::pickled::{Part, pickled, restored};
use super::solved::Solved;
use super::views::{View, residual_arrays};
use crate::boundary::arrays::{self, distance, record};
use crate::boundary::errors::{raised, unlocked};
use crate::see::camera::{AnyCamera, Camera};
use crate::see::pose::Pose;

/// A calibrated camera.
///
/// Arrays of P parameters are in the order of :attr:`Camera.parameter_names`, those of the F estimated parameters in the
/// order of :attr:`found`, those of N corners view after view.
#[pyclass(frozen, subclass, module = "deltille")]
#[derive(Clone)]
pub struct CalibratedCamera {
    pub solved: Arc<Solved>,
    pub index: usize,
}

impl CalibratedCamera {
    pub fn estimate(&self) -> &CameraEstimate {
        &self.solved.estimate.cameras[self.index]
    }

    /// Returns a value from the file it was read from.
    fn in_file(&self, figure: &str) -> Option<f64> {
        self.solved.in_file(Some(self.index))?[figure].as_f64()
    }
}

/// Restores a pickled camera, or one of its views.
#[pyfunction]
pub fn _part<'py>(
    py: Python<'py>,
    json: &str,
    targets: Vec<String>,
    camera: usize,
    view: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let solved = Arc::new(restored(json, &targets)?);
    let found = solved.estimate.cameras.get(camera);
    let is_there = found.is_some_and(|found| view.is_none_or(|view| view < found.views.len()));
    match (is_there, view) {
        (false, _) => {
            Err(raised::CalibrationError::new_err("the calibration has no such camera or view"))
        }
        (true, None) => Ok(Bound::new(py, CalibratedCamera { solved, index: camera })?.into_any()),
        (true, Some(view)) => Ok(Bound::new(py, View { solved, camera, view })?.into_any()),
    }
}

/// Parses the name of a source of uncertainty.
fn source(name: &str) -> PyResult<Source> {
    match name {
        "noise" => Ok(Source::Noise),
        "observed" => Ok(Source::Observed),
        _ => Err(raised::CalibrationError::new_err(format!(
            "unknown source {name} (known: noise, observed)"
        ))),
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for AnyCamera {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(found) = given.cast::<CalibratedCamera>() {
            return Ok(Self(found.get().estimate().camera.clone()));
        }
        Ok(Self(given.cast::<Camera>()?.get().0.clone()))
    }
}

residual_arrays!(CalibratedCamera, self => self.estimate().views, self.solved);

#[pymethods]
impl CalibratedCamera {
    /// Name of the camera.
    #[getter]
    pub fn name(&self) -> &str {
        &self.estimate().name
    }

    /// The camera.
    #[getter]
    pub fn camera(&self) -> Camera {
        Camera(self.estimate().camera.clone())
    }

    /// The estimated model, such as ``"radtan"``; ``None`` if the camera was given.
    #[getter]
    fn model(&self) -> Option<String> {
        self.estimate().model.map(|model| model.to_string())
    }

    /// Names of the F estimated parameters.
    #[getter]
    fn found(&self) -> Vec<String> {
        self.estimate().estimated_parameters().map(str::to_owned).collect()
    }

    /// Covariance of the estimated parameters, F × F, float64, from the noise of the corners.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix(py, &self.estimate().covariance)
    }

    /// Covariance of the estimated parameters, F × F, float64, from the scatter between frames; ``None`` with too few frames.
    #[getter]
    fn observed_covariance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let found = self.estimate().covariance_from(Source::Observed);
        found.map(|covariance| arrays::matrix(py, covariance))
    }

    /// Standard deviations of all parameters, P, float64; NaN for fixed parameters.
    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let parameters = self.estimate().parameters.iter();
        arrays::column(py, parameters.map(|parameter| parameter.sd.unwrap_or(f64::NAN)))
    }

    /// Standard deviations from the scatter between frames, P, float64; NaN if not known.
    #[getter]
    fn observed_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let found = self.estimate().observed_sd().into_iter();
        arrays::column(py, found.map(|sd| sd.unwrap_or(f64::NAN)))
    }

    /// Names of ill-conditioned parameters, which the views cannot distinguish.
    #[getter]
    fn ill_conditioned(&self) -> Vec<String> {
        self.estimate().ill_conditioned.clone()
    }

    /// Reprojection error over all corners, px: RMS per axis.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.estimate().rms_px
    }

    /// Reprojection error over the inliers, px: RMS per axis.
    #[getter]
    fn inlier_rms_px(&self) -> f64 {
        self.in_file("inlier_rms_px").unwrap_or_else(|| self.estimate().inlier_rms_px())
    }

    /// Number of corners used.
    #[getter]
    fn corner_count(&self) -> usize {
        match self.in_file("corners") {
            Some(count) => count as usize,
            None => self.estimate().corner_count(),
        }
    }

    /// Number of outliers among the corners.
    #[getter]
    fn outlier_count(&self) -> usize {
        match self.in_file("outliers") {
            Some(count) => count as usize,
            None => self.estimate().outlier_count(),
        }
    }

    /// Pose of the camera on the rig: camera from rig; the identity for a single camera.
    #[getter]
    fn pose(&self) -> Pose {
        Pose(self.estimate().camera_from_rig)
    }

    /// Standard deviations of that pose, 6, float64: rotation about (rad) and translation along
    /// (mm) the camera's axes; NaN if it was not estimated, as for the first camera.
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.estimate().pose_sd.unwrap_or([f64::NAN; 6]))
    }

    /// Number of frames by which its images lag.
    #[getter]
    fn delay(&self) -> i32 {
        self.estimate().delay
    }

    /// The views used.
    #[getter]
    fn views(&self) -> Vec<View> {
        let all = 0..self.estimate().views.len();
        let view = |view| View { solved: self.solved.clone(), camera: self.index, view };
        all.map(view).collect()
    }

    /// Rotation vectors of the poses of the target in the views, V × 3, float64, rad: those of ``cv2.calibrateCamera``.
    #[getter]
    fn rvecs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let views = self.estimate().views.iter();
        let turn = |view: &ViewEstimate| view.pose.off(&camera::Pose::IDENTITY)[0].to_array();
        arrays::rows(py, views.map(turn))
    }

    /// Translations of the poses of the target in the views, V × 3, float64, mm: those of ``cv2.calibrateCamera``.
    #[getter]
    fn tvecs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.estimate().views.iter().map(|view| view.pose.translation.to_array()))
    }

    /// Index of the view of each corner, N, int64.
    #[getter]
    fn view_indices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of =
            |(index, view): (i64, &ViewEstimate)| std::iter::repeat_n(index, view.corners.len());
        arrays::column(py, (0..).zip(&self.estimate().views).flat_map(of).collect::<Vec<_>>())
    }

    /// Computes the projection uncertainty in the region covered by corners.
    ///
    /// Parameters
    /// ----------
    /// distance_mm : float, optional
    ///     Distance of the points, mm; defaults to infinity.
    /// source : str, optional
    ///     ``"noise"`` of the corners, or ``"observed"`` scatter between frames.
    ///
    /// Returns
    /// -------
    /// float or None
    ///     Standard deviation per axis, px; ``None`` if not known.
    #[pyo3(signature = (distance_mm = None, source = "noise"))]
    fn projection_sd(&self, distance_mm: Option<f64>, source: &str) -> PyResult<Option<f64>> {
        Ok(self.estimate().projection_sd_px(distance(distance_mm)?, self::source(source)?))
    }

    /// Computes the projection uncertainty over the image.
    ///
    /// Parameters
    /// ----------
    /// distance_mm, source
    ///     See :meth:`projection_sd`.
    ///
    /// Returns
    /// -------
    /// ndarray of R × C, float64, or None
    ///     Standard deviations along the worst direction, px, at R × C positions that cover the
    ///     image; NaN outside the domain of the lens model.
    #[pyo3(signature = (distance_mm = None, source = "noise"))]
    fn uncertainty_map<'py>(
        &self,
        py: Python<'py>,
        distance_mm: Option<f64>,
        source: &str,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let (source, distance_mm) = (self::source(source)?, distance(distance_mm)?);
        let map = unlocked(py, || self.estimate().uncertainty_map(distance_mm, source))?;
        Ok(map.map(|map| {
            let sd = |i: usize, j: usize| map.sd_px[i * map.columns + j].unwrap_or(f64::NAN);
            let full = Matrix::from_fn(map.rows, map.columns, sd);
            arrays::matrix(py, &full)
        }))
    }

    /// Computes the covariances of projections to these pixels.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    /// distance_mm, source
    ///     See :meth:`projection_sd`.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 2 × 2, float64
    ///     px²; NaN outside the domain of the lens model, or if not known.
    #[pyo3(signature = (pixels, distance_mm = None, source = "noise"))]
    fn projection_covariance<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        distance_mm: Option<f64>,
        source: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (source, distance_mm) = (self::source(source)?, distance(distance_mm)?);
        let pixels = arrays::rows_of::<2>("pixels", pixels)?;
        let found = unlocked(py, || {
            let one = |pixel: [f64; 2]| {
                let found =
                    self.estimate().projection_covariance(pixel.into(), distance_mm, source)?;
                Some([found[0][0], found[0][1], found[1][1]])
            };
            pixels.into_iter().map(one).collect::<Vec<_>>()
        })?;
        Ok(arrays::covariances(py, found))
    }

    /// The models compared for ``model="auto"``, each as a dictionary: ``model``, ``parameters``, ``held_out_px``,
    /// ``is_stable``, ``holds`` (adequate), ``chosen``.
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let tried = self.solved.models.get(self.index).map(Vec::as_slice).unwrap_or_default();
        let one = |tried: &solver::Candidate| {
            serde_json::json!({
                "model": tried.model.to_string(), "parameters": tried.parameters,
                "held_out_px": tried.held_out_px, "is_stable": tried.is_stable,
                "adequate": tried.is_adequate, "chosen": tried.chosen,
            })
        };
        record(py, &tried.iter().map(one).collect::<Vec<_>>())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.index == other.index && self.solved.is_same(&other.solved)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, Part> {
        let own = slf.get();
        let (restore, (json, targets)) = pickled(slf.py(), "_part", &own.solved)?;
        Ok((restore, (json, targets, own.index, None)))
    }

    pub fn __repr__(&self) -> String {
        let found = self.estimate();
        let model = found.model.map_or("given".to_owned(), |model| model.to_string());
        let (views, rms) = (found.views.len(), found.rms_px);
        format!("<CalibratedCamera {}: {model}, {views} views, rms {rms:.4} px>", found.name)
    }
}
