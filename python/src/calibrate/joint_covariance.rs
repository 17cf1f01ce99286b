//! The covariance of all unknowns of a calibration.

use deltille::calibrate as solver;
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::boundary::arrays;

/// The covariance of everything that a calibration estimated, as ``--covariance`` writes it.
///
/// The first unknowns are shared by all frames: for each camera its parameters and the rotation (rx, ry, rz) and translation
/// (tx, ty, tz) of its pose on the rig, then those of panels and targets, and the shape of the board. The poses of frames and
/// the offsets of measured corners follow if they were requested.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct JointCovariance(pub solver::JointCovariance);

#[pymethods]
impl JointCovariance {
    /// Names of the n unknowns, such as ``"camera.fx"`` or ``"right.tx"``.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.0.unknowns.iter().map(|of| of.name.as_str()).collect()
    }

    /// Units of the unknowns: ``"px"``, ``"rad"``, ``"mm"``, or ``"1"``.
    #[getter]
    fn units(&self) -> Vec<&str> {
        self.0.unknowns.iter().map(|of| of.unit).collect()
    }

    /// Covariance from the noise of the corners, n × n.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix(py, &self.0.noise)
    }

    /// Covariance observed between frames, m × m for the first m unknowns, which all frames share; ``None`` with too few
    /// frames.
    #[getter]
    fn observed<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        self.0.observed.as_ref().map(|observed| arrays::matrix(py, observed))
    }

    /// Degrees of freedom of the observed variances.
    #[getter]
    fn observed_freedom(&self) -> Option<f64> {
        self.0.observed_freedom
    }

    fn __repr__(&self) -> String {
        format!("<JointCovariance of {} unknowns>", self.0.unknowns.len())
    }
}
