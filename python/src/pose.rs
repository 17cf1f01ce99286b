//! Rigid motions.

use deltille::camera;
use deltille::glam::{DMat3, DQuat, DVec3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{self, Points};
use crate::errors::raised;

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
#[pyclass(frozen, module = "deltille")]
#[derive(Clone, Copy)]
pub struct Pose(pub camera::Pose);

#[pymethods]
impl Pose {
    #[new]
    #[pyo3(signature = (rvec = [0.0; 3], tvec = [0.0; 3]))]
    fn new(rvec: [f64; 3], tvec: [f64; 3]) -> PyResult<Self> {
        if rvec.iter().chain(&tvec).any(|number| !number.is_finite()) {
            return Err(raised::Error::new_err("a pose is made of finite numbers"));
        }
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
    #[pyo3(signature = (eye, at, up = None))]
    pub fn looking_at(eye: [f64; 3], at: [f64; 3], up: Option<[f64; 3]>) -> PyResult<Self> {
        let pose = camera::Pose::viewing(eye.into(), at.into(), up.map(DVec3::from));
        let wrong = "up must not be parallel to the line of sight, nor eye be at";
        pose.map(Self).ok_or_else(|| raised::Error::new_err(wrong))
    }

    /// The pose of a 4 × 4 matrix.
    ///
    /// Parameters
    /// ----------
    /// matrix : array of 4 × 4, or of 3 × 4
    ///     Rotation and translation (mm).
    #[staticmethod]
    fn from_matrix(matrix: Points<'_>) -> PyResult<Self> {
        let m = matrix.as_array();
        let wrong =
            || raised::Error::new_err("a pose is a rotation and a translation, 4 × 4 or 3 × 4");
        if !matches!(m.dim(), (3 | 4, 4)) || m.iter().any(|number| !number.is_finite()) {
            return Err(wrong());
        }
        let column = |j: usize| DVec3::new(m[[0, j]], m[[1, j]], m[[2, j]]);
        let rotation = DMat3::from_cols(column(0), column(1), column(2));
        let off = rotation.transpose() * rotation - DMat3::IDENTITY;
        if off.to_cols_array().iter().any(|part| part.abs() > 1e-6) || rotation.determinant() < 0.0
        {
            return Err(wrong());
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
        points: Points<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let wrong =
            || raised::Error::new_err(format!("points are N × 3, not {}", arrays::shape(&points)));
        let points = arrays::points3(&points).ok_or_else(wrong)?;
        Ok(arrays::rows(py, points.into_iter().map(|point| self.0.apply(point).to_array())))
    }

    fn __matmul__(&self, first: &Self) -> Self {
        Self(self.0.after(&first.0))
    }

    fn __repr__(&self) -> String {
        self.told()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, ([f64; 3], [f64; 3])> {
        let [turn, _] = slf.get().0.off(&camera::Pose::IDENTITY);
        Ok((slf.get_type().into_any(), (turn.to_array(), slf.get().0.translation.to_array())))
    }
}

impl Pose {
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
