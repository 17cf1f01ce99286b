//! Rigid motions.

use deltille::camera;
use deltille::glam::{DMat3, DQuat, DVec3};
use deltille_core::quantity::{angle_rad, position_mm};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::boundary::arrays::{self, vector};
use crate::boundary::errors::{self, raised};

/// A rigid motion ``y = R x + t`` between two frames, in millimetres.
///
/// A pose is named after its frames: ``camera_from_target`` maps points of the target to the frame of the camera
/// (x right, y down, z forward). ``a_from_b @ b_from_c`` is ``a_from_c``.
///
/// Parameters
/// ----------
/// rvec : sequence of 3 floats, optional
///     Rotation vector (axis times angle), in radians, as in OpenCV.
/// tvec : sequence of 3 floats, optional
///     Translation in mm.
///
/// Examples
/// --------
/// >>> import deltille
/// >>> pose = deltille.Pose(rvec=(0, 0, 0.1), tvec=(0, 0, 500))
/// >>> (pose @ pose.inverse()).matrix.shape
/// (4, 4)
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone, Copy, PartialEq)]
pub struct Pose(pub camera::Pose);

#[pymethods]
impl Pose {
    #[new]
    #[pyo3(signature = (rvec = None, tvec = None))]
    fn new(rvec: Option<&Bound<'_, PyAny>>, tvec: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let rvec = rvec.map_or(Ok([0.0; 3]), |rvec| {
            vector("rvec", rvec, angle_rad::RANGE, errors::argument)
        })?;
        let tvec = tvec.map_or(Ok([0.0; 3]), |tvec| {
            vector("tvec", tvec, position_mm::RANGE, errors::argument)
        })?;
        let rotation = DQuat::from_scaled_axis(rvec.into());
        Ok(Self(camera::Pose { rotation, translation: tvec.into() }))
    }

    /// Returns the pose of a camera at ``eye`` that looks at ``at``: camera from target.
    ///
    /// Parameters
    /// ----------
    /// eye, at : sequence of 3 floats
    ///     Points in the frame of the target, mm.
    /// up : sequence of 3 floats, optional
    ///     Up direction of the image; defaults to z, or to y if the camera looks along z.
    ///
    /// Returns
    /// -------
    /// Pose
    #[staticmethod]
    #[pyo3(name = "looking_at", signature = (eye, at, up = None))]
    fn looking_at_of(
        eye: &Bound<'_, PyAny>,
        at: &Bound<'_, PyAny>,
        up: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let up = up.map(|up| vector("up", up, position_mm::RANGE, errors::argument)).transpose()?;
        let place = |name: &str, place| vector(name, place, position_mm::RANGE, errors::argument);
        Self::looking_at(place("eye", eye)?, place("at", at)?, up)
    }

    /// Converts a matrix to a pose.
    ///
    /// Parameters
    /// ----------
    /// matrix : array of 4 × 4, or of 3 × 4
    ///     Rotation matrix and translation (mm).
    ///
    /// Returns
    /// -------
    /// Pose
    #[staticmethod]
    fn from_matrix(matrix: &Bound<'_, PyAny>) -> PyResult<Self> {
        let wrong = |what: &str| Err(raised::ArgumentError::new_err(format!("matrix: {what}")));
        let rows = arrays::rows_of::<4>("matrix", matrix)?;
        let ([x, y, z] | [x, y, z, _]) = rows.as_slice() else {
            return wrong("expected 4 × 4 or 3 × 4");
        };
        let outside =
            rows.iter().flatten().find_map(|&number| position_mm::RANGE.check(number).err());
        if let Some(outside) = outside {
            return wrong(&outside.to_string());
        }
        if rows.get(3).is_some_and(|last| *last != [0.0, 0.0, 0.0, 1.0]) {
            return wrong("the last row must be 0 0 0 1");
        }
        let column = |j: usize| DVec3::new(x[j], y[j], z[j]);
        let rotation = DMat3::from_cols(column(0), column(1), column(2));
        let off = rotation.transpose() * rotation - DMat3::IDENTITY;
        if off.to_cols_array().iter().any(|part| part.abs() > 1e-6) {
            return wrong("the first three columns are not a rotation (orthonormal)");
        }
        if rotation.determinant() < 0.0 {
            return wrong("the first three columns are a reflection, not a rotation");
        }
        let rotation = DQuat::from_mat3(&rotation).normalize();
        Ok(Self(camera::Pose { rotation, translation: column(3) }))
    }

    /// The motion as a 4 × 4 matrix, float64.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rotation = DMat3::from_quat(self.0.rotation);
        let row = |i: usize| {
            let [a, b, c] = rotation.row(i).to_array();
            [a, b, c, self.0.translation[i]]
        };
        arrays::rows(py, [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
    }

    /// The rotation as a 3 × 3 matrix, float64.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix3(py, &DMat3::from_quat(self.0.rotation))
    }

    /// The rotation vector: axis times angle in radians, as in OpenCV.
    #[getter]
    fn rvec<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let [turn, _] = self.0.off(&camera::Pose::IDENTITY);
        arrays::column(py, turn.to_array())
    }

    /// The translation vector, mm.
    #[getter]
    fn tvec<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.translation.to_array())
    }

    /// The origin of the destination frame in the source frame, mm: for ``camera_from_target``, the position of the camera on
    /// the target.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.inverse().translation.to_array())
    }

    /// Returns the inverse motion.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Maps points from the source frame to the destination frame.
    ///
    /// Parameters
    /// ----------
    /// points : array of N × 3
    ///     Points, mm.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 3, float64
    fn apply<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = arrays::rows_of::<3>("points", points)?;
        let moved = points.into_iter().map(|point| self.0.apply(point.into()).to_array());
        Ok(arrays::rows(py, moved))
    }

    fn __matmul__(&self, first: &Bound<'_, PyAny>) -> PyResult<Self> {
        match first.cast::<Self>() {
            Ok(first) => Ok(Self(self.0.after(&first.get().0))),
            Err(_) => {
                Err(PyTypeError::new_err("@ combines two poses; use pose.apply(points) for points"))
            }
        }
    }

    fn __repr__(&self) -> String {
        self.text()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, ([f64; 4], [f64; 3])> {
        let camera::Pose { rotation, translation } = slf.get().0;
        Ok((slf.get_type().getattr("_of")?, (rotation.to_array(), translation.to_array())))
    }

    /// Restores a pickled pose.
    #[staticmethod]
    fn _of(quaternion: [f64; 4], translation: [f64; 3]) -> Self {
        let rotation = DQuat::from_array(quaternion);
        Self(camera::Pose { rotation, translation: translation.into() })
    }
}

impl Pose {
    /// Returns the pose of a camera at `eye` that looks at `at`.
    pub fn looking_at(eye: [f64; 3], at: [f64; 3], up: Option<[f64; 3]>) -> PyResult<Self> {
        let pose = camera::Pose::viewing(eye.into(), at.into(), up.map(DVec3::from));
        let wrong = "up must not be parallel to the line of sight, and eye and at must differ";
        pose.map(Self).ok_or_else(|| raised::ArgumentError::new_err(wrong))
    }

    /// Formats the pose as the expression that makes it.
    pub fn text(&self) -> String {
        let [turn, _] = self.0.off(&camera::Pose::IDENTITY);
        let t = self.0.translation;
        format!(
            "Pose(rvec=({:.6}, {:.6}, {:.6}), tvec=({:.4}, {:.4}, {:.4}))",
            turn.x, turn.y, turn.z, t.x, t.y, t.z
        )
    }
}
