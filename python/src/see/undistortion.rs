//! Pinhole views of cameras: undistorted images, and rectified images of two cameras of a rig.

use std::sync::Arc;

use deltille::camera::{self, Field, PixelMap, Rectification as Pair};
use deltille::glam::{DMat3, DMat4, DQuat};
use deltille::limits::Limits;
use deltille::remap::{Depth, Pixels};
use deltille_core::quantity::{Range, focal_px, side_px};
use numpy::ndarray::Array2;
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods,
    PyUntypedArray, PyUntypedArrayMethods, dtype,
};
use pyo3::prelude::*;

use super::camera::{AnyCamera, Camera};
use crate::boundary::arrays::{self, number, shape_in_words, whole};
use crate::boundary::errors::{self, Raise, raised, unlocked};
use crate::calibrate::calibration::Rig;

/// A pinhole view of a camera: removes the distortion of its images.
///
/// Make one with :func:`undistort`, or two with :func:`rectify`, and use it for all images of the camera.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone)]
pub struct Undistortion {
    camera: camera::Camera,
    made: camera::Undistortion,
    distance_mm: Option<f64>,
    map: Arc<PixelMap>,
}

impl PartialEq for Undistortion {
    /// The map follows from the rest, and contains NaN.
    fn eq(&self, other: &Self) -> bool {
        (&self.camera, &self.made) == (&other.camera, &other.made)
    }
}

impl Undistortion {
    fn of(camera: camera::Camera, made: camera::Undistortion, distance_mm: Option<f64>) -> Self {
        let made = distance_mm.into_iter().fold(made, camera::Undistortion::at_distance);
        let map = Arc::new(made.map());
        Self { camera, made, distance_mm, map }
    }

    fn coordinate<'py>(&self, py: Python<'py>, axis: usize) -> Bound<'py, PyArray2<f32>> {
        let value = |place: &[f32; 2]| if place[axis].is_nan() { -1.0 } else { place[axis] };
        let values = self.map.positions().iter().map(value).collect();
        let size = (self.map.height(), self.map.width());
        Array2::from_shape_vec(size, values).expect("every pixel has a position").into_pyarray(py)
    }

    /// Resamples an array whose values have the type `T`.
    fn resampled<'py, T: Element + Depth>(
        &self,
        image: &Bound<'py, PyUntypedArray>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = image.py();
        let dense = py.import("numpy")?.call_method1("ascontiguousarray", (image,))?;
        let dense = dense.cast::<PyArrayDyn<T>>()?.try_readonly()?;
        let mut shape = image.shape().to_vec();
        let channels = shape.get(2).copied().unwrap_or(1);
        let pixels = Pixels::new(dense.as_slice()?, shape[1], channels);
        let pixels = pixels.ok_or_else(|| refused(image.shape()))?;
        let values = unlocked(py, || pixels.remapped(&self.map))?;
        (shape[0], shape[1]) = (self.map.height(), self.map.width());
        Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
    }
}

/// Returns the error for an array of the wrong shape.
fn refused(shape: &[usize]) -> PyErr {
    let shape = shape_in_words(shape);
    errors::image(format!(
        "an array of {shape} is not an image: expected H × W, or H × W × 1 to 4 channels"
    ))
}

#[pymethods]
impl Undistortion {
    /// The camera of the undistorted images, a pinhole without distortion.
    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.made.view().clone())
    }

    /// Rotation from the frame of the camera to that of the view, 3 × 3, float64: the identity unless it is rectified.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix3(py, &DMat3::from_quat(self.made.view_from_camera()))
    }

    /// Column of each undistorted pixel in the camera's image, H × W, float32, px; −1 if it has none. For ``cv2.remap``.
    #[getter]
    fn map_x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        self.coordinate(py, 0)
    }

    /// Row of each undistorted pixel in the camera's image, H × W, float32, px; −1 if it has none. For ``cv2.remap``.
    #[getter]
    fn map_y<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f32>> {
        self.coordinate(py, 1)
    }

    /// Undistorts an image of the camera, by bicubic interpolation as in ``deltille undistort``.
    ///
    /// Parameters
    /// ----------
    /// image : ndarray of H × W or H × W × C
    ///     An image of the size of the camera, of uint8, uint16, float32 or float64, with up to four channels in any order.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     An image of the size of :attr:`camera`, with the same dtype and channels. Pixels that the camera does not see are 0.
    ///
    /// Raises
    /// ------
    /// ImageError
    ///     If the array is not an image of this camera.
    fn apply<'py>(&self, image: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = image.py();
        let Ok(array) = image.cast::<PyUntypedArray>() else {
            let kind = image.get_type().qualname()?;
            return Err(errors::image(format!("{kind} is not a numpy array")));
        };
        let [height, width] = match *array.shape() {
            [height, width] | [height, width, 1..=4] => [height, width],
            ref other => return Err(refused(other)),
        };
        let camera = &self.camera;
        if [width, height] != [camera.width, camera.height].map(|side| side as usize) {
            return Err(errors::image(format!(
                "the image has {width} × {height} px, but the camera has {} × {}: it is from another camera or mode",
                camera.width, camera.height
            )));
        }
        let kind = array.dtype();
        let is = |of: Bound<'py, numpy::PyArrayDescr>| kind.is_equiv_to(&of);
        match () {
            () if is(dtype::<u8>(py)) => self.resampled::<u8>(array),
            () if is(dtype::<u16>(py)) => self.resampled::<u16>(array),
            () if is(dtype::<f32>(py)) => self.resampled::<f32>(array),
            () if is(dtype::<f64>(py)) => self.resampled::<f64>(array),
            () => Err(errors::image(format!(
                "unsupported dtype {kind}: expected uint8, uint16, float32 or float64"
            ))),
        }
    }

    fn __repr__(&self) -> String {
        let view = self.made.view();
        format!(
            "<Undistortion {} × {} px, focal length {:.2} px>",
            view.width, view.height, view.focal_px.x
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, Parts> {
        let restore = slf.py().import("deltille._core")?.getattr("_undistortion")?;
        let own = slf.get();
        let (view, camera) = (own.made.view(), Camera(own.camera.clone()));
        let rotation = own.made.view_from_camera().to_array();
        let parts = (camera, rotation, [view.width, view.height], view.focal_px.x, own.distance_mm);
        Ok((restore, parts))
    }
}

/// The camera of an undistortion, its rotation, size, focal length and distance.
type Parts = (Camera, [f64; 4], [u32; 2], f64, Option<f64>);

/// Restores a pickled undistortion.
#[pyfunction]
pub fn _undistortion(
    camera: &Camera,
    rotation: [f64; 4],
    size_px: [u32; 2],
    focal_px: f64,
    distance_mm: Option<f64>,
) -> PyResult<Undistortion> {
    let rotation = DQuat::from_array(rotation);
    let made = camera::Undistortion::rotated(&camera.0, rotation, size_px, Field::Focal(focal_px));
    Ok(Undistortion::of(camera.0.clone(), made.raise(errors::camera)?, distance_mm))
}

/// A name, or a horizontal field of view, rad.
#[derive(FromPyObject)]
pub enum FieldOfView {
    Rad(f64),
    Name(String),
}

/// The checked keywords of a view.
struct View {
    field: Field,
    size_px: [u32; 2],
    distance_mm: Option<f64>,
}

impl View {
    fn of(
        camera: &camera::Camera,
        field: FieldOfView,
        focal_px: Option<f64>,
        size_px: Option<[i64; 2]>,
        distance_mm: Option<f64>,
    ) -> PyResult<Self> {
        let wrong = |what: &str| Err(raised::ArgumentError::new_err(what.to_owned()));
        let field = match (field, focal_px) {
            (FieldOfView::Name(name), Some(focal)) if name == "inside" => {
                Field::Focal(number("focal_px", focal, focal_px::RANGE, errors::argument)?)
            }
            (_, Some(_)) => return wrong("field and focal_px are mutually exclusive"),
            (FieldOfView::Name(name), None) if name == "inside" => Field::Inside,
            (FieldOfView::Name(name), None) if name == "whole" => Field::Whole,
            (FieldOfView::Rad(rad), None) if rad > 0.0 => Field::Horizontal(rad),
            _ => {
                return wrong(
                    "field: expected inside, whole, or a positive horizontal angle in rad",
                );
            }
        };
        let side = |side: i64| -> PyResult<u32> {
            let range = Range { least: 2.0, ..side_px::RANGE };
            number("size_px", side as f64, range, errors::argument)?;
            whole("size_px", side, errors::argument)
        };
        let size_px = match size_px {
            Some([width, height]) => [side(width)?, side(height)?],
            None => [camera.width, camera.height],
        };
        Limits::default().check_pixels(size_px[0], size_px[1]).raise(errors::argument)?;
        Ok(Self { field, size_px, distance_mm: arrays::distance(distance_mm)? })
    }
}

/// Returns a pinhole view of a camera, which undistorts its images like ``deltille undistort``.
///
/// Parameters
/// ----------
/// camera : Camera or CalibratedCamera
/// field : str or float, optional
///     Field of view: ``"inside"``, as large as possible without black pixels; ``"whole"``, everything that the camera sees,
///     up to 150°; or a horizontal angle, rad.
/// focal_px : float, optional
///     Focal length, px, instead of ``field``.
/// size_px : (int, int), optional
///     Width and height of the undistorted images; defaults to those of the camera.
/// distance_mm : float, optional
///     Distance of the objects for which the view is exact, mm; only for the model ``"pupil"``. Defaults to infinity.
///
/// Returns
/// -------
/// Undistortion
///
/// Raises
/// ------
/// CameraError
///     If no pinhole view has this field of view.
///
/// Examples
/// --------
/// >>> import deltille, numpy
/// >>> view = deltille.undistort(deltille.Camera(64, 48, 50, distortion=[-0.1]))
/// >>> view.apply(numpy.zeros((48, 64, 3), numpy.uint8)).shape
/// (48, 64, 3)
#[pyfunction]
#[pyo3(signature = (camera, *, field = FieldOfView::Name("inside".to_owned()), focal_px = None, size_px = None,
    distance_mm = None), text_signature = "(camera, *, field='inside', focal_px=None, size_px=None, distance_mm=None)")]
pub fn undistort(
    py: Python<'_>,
    camera: AnyCamera,
    field: FieldOfView,
    focal_px: Option<f64>,
    size_px: Option<[i64; 2]>,
    distance_mm: Option<f64>,
) -> PyResult<Undistortion> {
    let camera = camera.0;
    let view = View::of(&camera, field, focal_px, size_px, distance_mm)?;
    let made = unlocked(py, || {
        let made = camera::Undistortion::new(&camera, view.size_px, view.field)?;
        Ok::<_, camera::UndistortionError>(Undistortion::of(camera, made, view.distance_mm))
    })?;
    made.raise(errors::camera)
}

/// Rectified views of two cameras of a rig: a point is in the same row of both images, or in the same column if one camera is
/// above the other.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone, PartialEq)]
pub struct Rectification {
    first: Undistortion,
    second: Undistortion,
    baseline_mm: [f64; 3],
    depth: [[f64; 4]; 4],
}

#[pymethods]
impl Rectification {
    /// The views of both cameras.
    #[getter]
    fn views(&self) -> (Undistortion, Undistortion) {
        (self.first.clone(), self.second.clone())
    }

    /// Position of the second view in the frame of the first, 3, float64, mm: along x, or along y if one camera is above the
    /// other.
    #[getter]
    fn baseline_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.baseline_mm)
    }

    /// The matrix of ``cv2.reprojectImageTo3D``, 4 × 4, float64: maps x, y, disparity and 1 (px, in the first view) to
    /// homogeneous coordinates in the frame of the first view, mm.
    #[getter]
    #[pyo3(name = "Q")]
    fn depth<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.depth)
    }

    /// Rectifies an image of each camera.
    ///
    /// Parameters
    /// ----------
    /// first, second : ndarray
    ///     Simultaneous images, as for :meth:`Undistortion.apply`.
    ///
    /// Returns
    /// -------
    /// first, second : ndarray
    ///     Images of the same size, with the same dtypes and channels.
    fn apply<'py>(
        &self,
        first: &Bound<'py, PyAny>,
        second: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        Ok((self.first.apply(first)?, self.second.apply(second)?))
    }

    fn __repr__(&self) -> String {
        let [x, y, _] = self.baseline_mm;
        let (mm, what) = if y == 0.0 { (x, "rows") } else { (y, "columns") };
        format!("<Rectification: baseline {mm:.3} mm, equal {what}>")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, PairParts> {
        let restore = slf.py().import("deltille._core")?.getattr("_rectification")?;
        let Self { first, second, baseline_mm, depth } = slf.get().clone();
        Ok((restore, (first, second, baseline_mm, depth)))
    }
}

/// The views of a rectification, its baseline and its depth matrix.
type PairParts = (Undistortion, Undistortion, [f64; 3], [[f64; 4]; 4]);

/// Restores pickled rectified views.
#[pyfunction]
pub fn _rectification(
    first: &Undistortion,
    second: &Undistortion,
    baseline_mm: [f64; 3],
    depth: [[f64; 4]; 4],
) -> Rectification {
    Rectification { first: first.clone(), second: second.clone(), baseline_mm, depth }
}

/// Returns rectified views of two cameras of a rig, for stereo matching, like ``deltille rectify``.
///
/// Parameters
/// ----------
/// rig : Rig
/// pair : (str, str)
///     Names of the two cameras, such as ``("left", "right")``.
/// field, focal_px, size_px, distance_mm
///     See :func:`undistort`; the size defaults to that of the first camera.
///
/// Returns
/// -------
/// Rectification
///
/// Raises
/// ------
/// CameraError
///     If the cameras have no common side-by-side view.
#[pyfunction]
#[pyo3(signature = (rig, pair, *, field = FieldOfView::Name("inside".to_owned()), focal_px = None, size_px = None,
    distance_mm = None), text_signature = "(rig, pair, *, field='inside', focal_px=None, size_px=None, distance_mm=None)")]
pub fn rectify(
    py: Python<'_>,
    rig: &Rig,
    pair: (String, String),
    field: FieldOfView,
    focal_px: Option<f64>,
    size_px: Option<[i64; 2]>,
    distance_mm: Option<f64>,
) -> PyResult<Rectification> {
    let (first, second) = (rig.named(&pair.0)?, rig.named(&pair.1)?);
    let view = View::of(&first.camera, field, focal_px, size_px, distance_mm)?;
    let cameras = [first, second].map(|found| (&found.camera, found.camera_from_rig));
    let made = unlocked(py, || {
        let made = Pair::new(cameras, view.size_px, view.field)?;
        let depth: DMat4 = made.depth_matrix();
        let [first, second] = made.views.clone();
        Ok::<_, camera::RectificationError>(Rectification {
            first: Undistortion::of(cameras[0].0.clone(), first, view.distance_mm),
            second: Undistortion::of(cameras[1].0.clone(), second, view.distance_mm),
            baseline_mm: made.baseline_mm.to_array(),
            depth: depth.transpose().to_cols_array_2d(),
        })
    })?;
    made.raise(errors::camera)
}
