//! Cameras: projection, and camera files of this package and of other programs.

use std::path::PathBuf;

use deltille::calibrate::Model;
use deltille::camera::{self, CameraFile};
use deltille::export::named::named;
use deltille::export::{CAMERA_FORMATS, Written, camera as formats};
use deltille::{camera_file, glam};
use deltille_core::quantity::{Range, coefficient, focal_px, place_px};
use deltille_core::words::shown;
use glam::DVec2;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use serde_json::json;

use crate::boundary::arrays::{self, number, vector, whole};
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::text_file::save_text;

/// A camera with its lens: projects points to pixels, and unprojects pixels to rays.
///
/// Pixel centres are at integers, y down; the camera frame has x right, y down, z forward.
///
/// Parameters
/// ----------
/// width, height : int
///     Size of the image, px.
/// focal_px : float or (float, float)
///     Focal lengths along x and y, px.
/// centre_px : (float, float), optional
///     Principal point, px; defaults to the centre of the image.
/// model : str, optional
///     ``"pinhole"`` (Brown–Conrady), ``"fisheye"`` (Kannala–Brandt), ``"eucm"``, ``"double-sphere"`` or ``"pupil"``.
///     The names of :func:`calibrate` work, too: ``"radtan"``, ``"radtan5"``, ``"rational"`` and ``"thin-prism"`` are a
///     pinhole with 4, 5, 8 and 12 coefficients, and ``"kannala-brandt"`` is a fisheye.
/// distortion : sequence of floats, optional
///     Coefficients in the order of the model: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 for ``"pinhole"``, as in OpenCV, and
///     k1 k2 k3 k4 or more for ``"fisheye"``. Omitted trailing coefficients are zero.
///
/// Raises
/// ------
/// CameraError
///     If the parameters do not describe a valid camera.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone, PartialEq)]
pub struct Camera(pub camera::Camera);

/// Valid focal lengths, px.
const FOCAL: Range = focal_px::RANGE;

/// Returns the lens of a model in camera files, and its maximum number of coefficients.
fn lens_of(model: &str) -> (&str, usize) {
    match Model::named().find(|(name, of_name)| *name == model && of_name.kind().name() != *name) {
        Some((_, of_name)) => (of_name.kind().name(), of_name.parameter_count()),
        None => (model, usize::MAX),
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, focal_px, centre_px = None, *, model = "pinhole", distortion = None))]
    fn new(
        width: i64,
        height: i64,
        focal_px: &Bound<'_, PyAny>,
        centre_px: Option<&Bound<'_, PyAny>>,
        model: &str,
        distortion: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let focal = match focal_px.extract::<f64>() {
            Ok(both) => [number("focal_px", both, FOCAL, errors::camera)?; 2],
            Err(_) => vector("focal_px", focal_px, FOCAL, errors::camera)?,
        };
        let centre = centre_px
            .map(|centre| vector("centre_px", centre, place_px::RANGE, errors::camera))
            .transpose()?;
        let distortion = distortion
            .map(|all| arrays::numbers("distortion", all, coefficient::RANGE, errors::camera));
        let distortion = distortion.transpose()?.unwrap_or_default();
        let (lens, most) = lens_of(model);
        if distortion.len() > most {
            let count = distortion.len();
            let what = format!("distortion: {model} has at most {most} coefficients, got {count}");
            return Err(errors::camera(what));
        }
        Self::checked([width, height], focal, centre, lens, distortion)
    }

    /// Makes a camera from the results of ``cv2.calibrateCamera`` or ``cv2.fisheye.calibrate``.
    ///
    /// Parameters
    /// ----------
    /// matrix : array of 3 × 3
    ///     The camera matrix ``K``, px.
    /// distortion : sequence of floats, or None
    ///     The coefficients ``D``: 4, 5, 8, 12 or 14, or the 4 of ``cv2.fisheye``. Of 14, the last two (a tilted sensor) must be 0.
    /// size_px : (int, int)
    ///     Width and height of the image.
    /// fisheye : bool, optional
    ///     Whether the coefficients are those of ``cv2.fisheye``.
    ///
    /// Returns
    /// -------
    /// Camera
    ///
    /// Raises
    /// ------
    /// CameraError
    ///     If there is no such camera, or if the sensor is tilted.
    #[staticmethod]
    #[pyo3(signature = (matrix, distortion, size_px, *, fisheye = false))]
    fn from_opencv(
        matrix: &Bound<'_, PyAny>,
        distortion: Option<&Bound<'_, PyAny>>,
        size_px: (i64, i64),
        fisheye: bool,
    ) -> PyResult<Self> {
        let wrong = |what: String| Err(errors::camera(what));
        let rows = arrays::rows_of::<3>("matrix", matrix).unwrap_or_default();
        let [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]] = rows[..] else {
            return wrong("matrix: expected fx, 0, cx; 0, fy, cy; 0, 0, 1 (3 × 3)".to_owned());
        };
        if ![fx, fy, cx, cy].iter().all(|value| value.is_finite()) {
            return wrong("matrix: expected finite numbers".to_owned());
        }
        let distortion = distortion
            .map(|all| arrays::numbers("distortion", all, coefficient::RANGE, errors::camera));
        let mut distortion = distortion.transpose()?.unwrap_or_default();
        let (known, model): (&[usize], _) = match fisheye {
            true => (&[0, 4], "fisheye"),
            false => (&[0, 4, 5, 8, 12, 14], "pinhole"),
        };
        if !known.contains(&distortion.len()) {
            let known = known[1..].iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
            let count = distortion.len();
            return wrong(format!("distortion: expected {known} coefficients, got {count}"));
        }
        if distortion.drain(12.min(distortion.len())..).any(|tilt| tilt != 0.0) {
            let what = "distortion: a tilted sensor (the last two of 14 coefficients) is not supported; \
                        calibrate without CALIB_TILTED_MODEL";
            return wrong(what.to_owned());
        }
        Self::checked(size_px.into(), [fx, fy], Some([cx, cy]), model, distortion)
    }

    /// Reads a camera file of this package (``.yaml``), OpenCV, ROS, Kalibr, COLMAP (``cameras.txt``) or mrcal.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     The file; one of several cameras is chosen by its name, as in ``camchain.yaml:cam1`` or ``cameras.txt:2``.
    ///
    /// Returns
    /// -------
    /// Camera
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = camera_file::read_with_targets(&path).raise_of_file(&path, errors::file)?;
        if let Some(failed) = &file.failed {
            let what = format!("{}: the calibration failed: {}", path.display(), shown(failed));
            errors::warn(py, &what)?;
        }
        Ok(Self(file.camera))
    }

    /// Reads a camera from the text of a file, like :meth:`load`.
    #[staticmethod]
    fn from_yaml(text: &str) -> PyResult<Self> {
        camera::Camera::from_yaml(text).map(Self).raise(errors::camera)
    }

    /// Returns the text of this package's camera file.
    fn to_yaml(&self) -> String {
        self.0.to_yaml()
    }

    /// Writes a camera file.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     The file.
    /// format : str, optional
    ///     ``"own"``, which :meth:`load` reads back for every model, ``"opencv"``, ``"ros"``, ``"kalibr"``, ``"colmap"``,
    ///     ``"nerfstudio"`` or ``"mrcal"``.
    /// overwrite : bool, optional
    ///     Replace an existing file even if it is of another kind.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    ///
    /// Raises
    /// ------
    /// CameraError
    ///     If the format does not support this lens.
    #[pyo3(signature = (path, format = "own", *, overwrite = false))]
    fn save(&self, path: PathBuf, format: &str, overwrite: bool) -> PyResult<PathBuf> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        save_text(path, self.text(format, &stem, &[])?, overwrite)
    }

    /// Width of the image, px.
    #[getter]
    fn width(&self) -> u32 {
        self.0.width
    }

    /// Height of the image, px.
    #[getter]
    fn height(&self) -> u32 {
        self.0.height
    }

    /// The lens: ``pinhole``, ``fisheye``, ``eucm``, ``double-sphere``, ``pupil`` or ``spline``.
    #[getter]
    fn model(&self) -> &'static str {
        self.0.lens.kind().name()
    }

    /// Names of all parameters: ``fx``, ``fy``, ``cx``, ``cy``, then those of the lens.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.0.parameter_names()
    }

    /// Values of all parameters, float64, in the order of :attr:`parameter_names`; lengths in px, those of a pupil in mm.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.parameters())
    }

    /// The 3 × 3 camera matrix, float64, as in OpenCV.
    #[getter]
    #[pyo3(name = "K")]
    fn k<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.matrix(py)
    }

    /// The 3 × 3 camera matrix, like :attr:`K`.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let ([fx, fy], [cx, cy]) = (self.0.focal_px.to_array(), self.0.centre_px.to_array());
        arrays::rows(py, [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    }

    /// Distortion coefficients for OpenCV, float64: 4, 5, 8 or 12, or the 4 of ``cv2.fisheye`` for a fisheye.
    ///
    /// Raises
    /// ------
    /// CameraError
    ///     If OpenCV does not support this lens.
    #[getter]
    fn dist<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.distortion(py)
    }

    /// Distortion coefficients for OpenCV, like :attr:`dist`.
    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = formats::opencv_coefficients(&self.0).raise(errors::camera)?;
        Ok(arrays::column(py, found.values))
    }

    /// Projects points to pixels.
    ///
    /// Parameters
    /// ----------
    /// points : array of N × 3
    ///     Points in the camera frame, mm.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 2, float64
    ///     Pixels, which may lie outside the image; NaN for points that the lens does not project.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = arrays::rows_of::<3>("points", points)?;
        let seen = unlocked(py, || {
            let seen =
                |point: [f64; 3]| self.0.project(point.into()).unwrap_or(DVec2::NAN).to_array();
            points.into_iter().map(seen).collect::<Vec<_>>()
        })?;
        Ok(arrays::rows(py, seen))
    }

    /// Unprojects pixels to viewing directions.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 3, float64
    ///     Unit vectors in the camera frame; NaN for pixels outside the domain of the lens model.
    ///     For a non-central lens, see :meth:`rays`.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(self.rays(py, pixels)?.1)
    }

    /// Unprojects pixels to rays.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    ///
    /// Returns
    /// -------
    /// origins : ndarray of N × 3, float64
    ///     Origins in the camera frame, mm: zero unless the lens is a ``pupil``.
    /// directions : ndarray of N × 3, float64
    ///     Unit vectors; NaN for pixels outside the domain of the lens model.
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn rays<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let pixels = arrays::rows_of::<2>("pixels", pixels)?;
        let rays = unlocked(py, || {
            let ray = |pixel: [f64; 2]| match self.0.unproject(pixel.into()) {
                Some(ray) => (ray.origin.to_array(), ray.direction.to_array()),
                None => ([f64::NAN; 3], [f64::NAN; 3]),
            };
            pixels.into_iter().map(ray).unzip::<_, _, Vec<_>, Vec<_>>()
        })?;
        Ok((arrays::rows(py, rays.0), arrays::rows(py, rays.1)))
    }

    fn __repr__(&self) -> String {
        let (focal, centre) = (self.0.focal_px, self.0.centre_px);
        format!(
            "Camera({} × {} px, {}, focal_px=({:.2}, {:.2}), centre_px=({:.2}, {:.2}))",
            self.0.width,
            self.0.height,
            self.model(),
            focal.x,
            focal.y,
            centre.x,
            centre.y
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String,)> {
        Ok((slf.get_type().getattr("from_yaml")?, (slf.get().to_yaml(),)))
    }
}

/// A camera as an argument: a [`Camera`], or that of a calibration.
pub struct AnyCamera(pub camera::Camera);

impl Camera {
    /// Makes a camera from numbers in their ranges; the principal point defaults to the centre of the image.
    fn checked(
        [width, height]: [i64; 2],
        focal_px: [f64; 2],
        centre_px: Option<[f64; 2]>,
        lens: &str,
        distortion: Vec<f64>,
    ) -> PyResult<Self> {
        let width: u32 = whole("width", width, errors::camera)?;
        let height: u32 = whole("height", height, errors::camera)?;
        let middle = [width, height].map(|side| (f64::from(side) - 1.0) / 2.0);
        let text = json!({
            "width": width, "height": height, "focal_px": focal_px,
            "centre_px": centre_px.unwrap_or(middle), "model": lens, "distortion": distortion,
        });
        camera::Camera::from_yaml(&text.to_string()).map(Self).raise(errors::camera)
    }

    /// Returns the text of a camera file in a format.
    pub fn text(
        &self,
        format: &str,
        name: &str,
        views: &[(&str, camera::Pose)],
    ) -> PyResult<String> {
        let format = named(CAMERA_FORMATS, format).map_err(raised::CameraError::new_err)?;
        let (camera, calibrated_with) = (self.0.clone(), Vec::new());
        let file = CameraFile { camera, calibrated_with, failed: None };
        let text = format.text(&Written { file: &file, name, views });
        text.raise(errors::camera)
    }
}
