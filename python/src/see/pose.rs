//! Rigid motions.

use deltille::camera;
use deltille::glam::{DMat3, DQuat, DVec3};
use deltille_core::quantity::{angle_rad, place_mm};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::boundary::arrays::{self, vector};
use crate::boundary::errors::{self, raised};

/// A rigid motion ``y = R x + t`` between two frames, in millimetres.
///
/// A pose is named after its frames: ``camera_from_target`` takes points of the target to the frame of the camera
/// (x right, y down, z forward). ``a_from_b @ b_from_c`` is ``a_from_c``.
///
/// Parameters
/// ----------
/// rvec : sequence of 3 floats, optional
///     Rotation vector (axis times angle), in radians, as OpenCV has it.
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
        let tvec = tvec
            .map_or(Ok([0.0; 3]), |tvec| vector("tvec", tvec, place_mm::RANGE, errors::argument))?;
        let rotation = DQuat::from_scaled_axis(rvec.into());
        Ok(Self(camera::Pose { rotation, translation: tvec.into() }))
    }

    /// The pose of a camera that stands at ``eye`` and looks at ``at``: camera from target.
    ///
    /// Parameters
    /// ----------
    /// eye, at : sequence of 3 floats
    ///     Places in the frame of the target, mm.
    /// up : sequence of 3 floats, optional
    ///     What is up in the picture; z unless the camera looks along it, then y.
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
        let up = up.map(|up| vector("up", up, place_mm::RANGE, errors::argument)).transpose()?;
        let place = |name: &str, place| vector(name, place, place_mm::RANGE, errors::argument);
        Self::looking_at(place("eye", eye)?, place("at", at)?, up)
    }

    /// The pose of a 4 × 4 matrix.
    ///
    /// Parameters
    /// ----------
    /// matrix : array of 4 × 4, or of 3 × 4
    ///     Rotation and translation (mm).
    ///
    /// Returns
    /// -------
    /// Pose
    #[staticmethod]
    fn from_matrix(matrix: &Bound<'_, PyAny>) -> PyResult<Self> {
        let wrong = |what: &str| Err(raised::ArgumentError::new_err(format!("matrix: {what}")));
        let rows = arrays::rows_of::<4>("matrix", matrix)?;
        let ([x, y, z] | [x, y, z, _]) = rows.as_slice() else {
            return wrong("a pose is 4 × 4, or 3 × 4");
        };
        let outside = rows.iter().flatten().find_map(|&number| place_mm::RANGE.check(number).err());
        if let Some(outside) = outside {
            return wrong(&outside.to_string());
        }
        if rows.get(3).is_some_and(|last| *last != [0.0, 0.0, 0.0, 1.0]) {
            return wrong("the last row of a pose is 0 0 0 1");
        }
        let column = |j: usize| DVec3::new(x[j], y[j], z[j]);
        let rotation = DMat3::from_cols(column(0), column(1), column(2));
        let off = rotation.transpose() * rotation - DMat3::IDENTITY;
        if off.to_cols_array().iter().any(|part| part.abs() > 1e-6) {
            return wrong(
                "its first three columns are no rotation: not of length 1 at right angles",
            );
        }
        if rotation.determinant() < 0.0 {
            return wrong("its first three columns are a reflection, not a rotation");
        }
        let rotation = DQuat::from_mat3(&rotation).normalize();
        Ok(Self(camera::Pose { rotation, translation: column(3) }))
    }

    /// The motion as a matrix of 4 × 4, float64.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rotation = DMat3::from_quat(self.0.rotation);
        let row = |i: usize| {
            let [a, b, c] = rotation.row(i).to_array();
            [a, b, c, self.0.translation[i]]
        };
        arrays::rows(py, [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
    }

    /// The rotation as a matrix of 3 × 3, float64.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix3(py, &DMat3::from_quat(self.0.rotation))
    }

    /// The rotation as a vector of 3: axis times angle in radians, as OpenCV has it.
    #[getter]
    fn rvec<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let [turn, _] = self.0.off(&camera::Pose::IDENTITY);
        arrays::column(py, turn.to_array())
    }

    /// The translation as a vector of 3, in mm.
    #[getter]
    fn tvec<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.translation.to_array())
    }

    /// Where the origin of the second frame is in the first, a vector of 3, in mm: of ``camera_from_target`` the
    /// place of the camera.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.inverse().translation.to_array())
    }

    /// The motion back.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Points of the second frame for points of the first.
    ///
    /// Parameters
    /// ----------
    /// points : array of N × 3
    ///     Places in mm.
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
            Err(_) => Err(PyTypeError::new_err(
                "pose @ pose is a pose; points are moved by pose.apply(points)",
            )),
        }
    }

    fn __repr__(&self) -> String {
        self.told()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, ([f64; 4], [f64; 3])> {
        let camera::Pose { rotation, translation } = slf.get().0;
        Ok((slf.get_type().getattr("_of")?, (rotation.to_array(), translation.to_array())))
    }

    /// A pose that was pickled.
    #[staticmethod]
    fn _of(quaternion: [f64; 4], translation: [f64; 3]) -> Self {
        let rotation = DQuat::from_array(quaternion);
        Self(camera::Pose { rotation, translation: translation.into() })
    }
}

impl Pose {
    /// The pose of a camera that stands somewhere and looks at something.
    pub fn looking_at(eye: [f64; 3], at: [f64; 3], up: Option<[f64; 3]>) -> PyResult<Self> {
        let pose = camera::Pose::viewing(eye.into(), at.into(), up.map(DVec3::from));
        let wrong = "up must not be parallel to the line of sight, nor eye be at";
        pose.map(Self).ok_or_else(|| raised::ArgumentError::new_err(wrong))
    }

    /// As it is made.
    pub fn told(&self) -> String {
        let [turn, _] = self.0.off(&camera::Pose::IDENTITY);
        let t = self.0.translation;
        format!(
            "Pose(rvec=({:.6}, {:.6}, {:.6}), tvec=({:.4}, {:.4}, {:.4}))",
            turn.x, turn.y, turn.z, t.x, t.y, t.z
        )
    }
}
