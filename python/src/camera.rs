//! Cameras: projection, and files of other programs.

use std::path::PathBuf;

use deltille::camera::{self, Lens};
use deltille::export::artifacts::write_set;
use deltille::export::camera as formats;
use deltille::{camera_file, glam};
use glam::{DVec2, DVec3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use serde_json::json;

use crate::arrays::{self, Points};
use crate::errors::{self, Raise, raised, unlocked};

/// A camera with its lens: where points are seen, and along which rays pixels look.
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
///     Principal point, px; the middle of the image if left out.
/// model : str, optional
///     ``"pinhole"`` (Brown–Conrady), ``"fisheye"`` (Kannala–Brandt), ``"eucm"``, ``"double-sphere"`` or ``"pupil"``.
/// distortion : sequence of floats, optional
///     Coefficients in the order of the model: of ``"pinhole"`` k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 as in OpenCV, of
///     ``"fisheye"`` k1 k2 k3 k4 or more; what is left out at the end is zero.
///
/// Raises
/// ------
/// CameraError
///     Where this is no camera.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(Clone, PartialEq)]
pub struct Camera(pub camera::Camera);

/// One focal length, or two.
#[derive(FromPyObject)]
enum Focal {
    One(f64),
    Two([f64; 2]),
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, focal_px, centre_px = None, *, model = "pinhole", distortion = Numbers(Vec::new())))]
    fn new(
        width: u32,
        height: u32,
        focal_px: Focal,
        centre_px: Option<[f64; 2]>,
        model: &str,
        distortion: Numbers,
    ) -> PyResult<Self> {
        let focal = match focal_px {
            Focal::One(both) => [both; 2],
            Focal::Two(each) => each,
        };
        let middle = [width, height].map(|side| (f64::from(side) - 1.0) / 2.0);
        let text = json!({
            "width": width, "height": height, "focal_px": focal,
            "centre_px": centre_px.unwrap_or(middle), "model": model, "distortion": distortion.0,
        });
        camera::Camera::from_yaml(&text.to_string()).map(Self).raise(errors::camera)
    }

    /// Reads a camera file: one of this package (``.yaml``), of ROS or OpenCV.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///
    /// Returns
    /// -------
    /// Camera
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        camera_file::read(&path).map(Self).raise(errors::file)
    }

    /// The camera of a text, as :meth:`load` reads it from files.
    #[staticmethod]
    fn from_yaml(text: &str) -> PyResult<Self> {
        camera::Camera::from_yaml(text).map(Self).raise(errors::camera)
    }

    /// The text of this package's camera file.
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
    ///     ``"own"``, which :meth:`load` reads back for every model, ``"opencv"``, ``"ros"``, ``"kalibr"``,
    ///     ``"colmap"``, ``"nerfstudio"`` or ``"mrcal"``.
    /// force : bool, optional
    ///     Whether a file of another kind is replaced.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    ///
    /// Raises
    /// ------
    /// CameraError
    ///     Where the format has no such lens.
    #[pyo3(signature = (path, format = "own", *, force = false))]
    fn save(&self, path: PathBuf, format: &str, force: bool) -> PyResult<PathBuf> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        save_text(path, self.text(format, &stem, &[])?, force)
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
        match self.0.lens {
            Lens::BrownConrady(_) => "pinhole",
            Lens::KannalaBrandt(_) => "fisheye",
            Lens::ExtendedUnified(_) => "eucm",
            Lens::DoubleSphere(_) => "double-sphere",
            Lens::Pupil(_) => "pupil",
            Lens::Spline(_) => "spline",
        }
    }

    /// Names of all parameters: ``fx``, ``fy``, ``cx``, ``cy``, then those of the lens.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.0.parameter_names()
    }

    /// Values of all parameters, float64, in the order of :attr:`parameter_names`; lengths in px, of a pupil in mm.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.parameters())
    }

    /// The camera matrix of 3 × 3, float64, as OpenCV has it.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let ([fx, fy], [cx, cy]) = (self.0.focal_px.to_array(), self.0.centre_px.to_array());
        arrays::rows(py, [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    }

    /// The coefficients of distortion for OpenCV, float64: 4, 5, 8 or 12, of a fisheye the 4 of ``cv2.fisheye``.
    ///
    /// Raises
    /// ------
    /// CameraError
    ///     Where OpenCV has no such lens.
    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = formats::opencv_coefficients(&self.0).raise(errors::camera)?;
        Ok(arrays::column(py, found.values))
    }

    /// Where points are seen.
    ///
    /// Parameters
    /// ----------
    /// points : array of N × 3
    ///     Places in the camera frame, mm.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 2, float64
    ///     Pixels, which may lie outside the image; NaN where the lens does not reach.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: Points<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let wrong =
            || raised::Error::new_err(format!("points are N × 3, not {}", arrays::shape(&points)));
        let points = arrays::points3(&points).ok_or_else(wrong)?;
        let seen = unlocked(py, || {
            let seen = |point: DVec3| self.0.project(point).unwrap_or(DVec2::NAN).to_array();
            points.into_iter().map(seen).collect::<Vec<_>>()
        })?;
        Ok(arrays::rows(py, seen))
    }

    /// The directions in which pixels look.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 3, float64
    ///     Unit vectors of the camera frame; NaN where the lens does not reach. See :meth:`rays` for a lens that is not
    ///     central.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: Points<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(self.rays(py, pixels)?.1)
    }

    /// The rays along which pixels look.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    ///
    /// Returns
    /// -------
    /// origins : ndarray of N × 3, float64
    ///     Where they begin in the camera frame, mm: zero unless the lens is a ``pupil``.
    /// directions : ndarray of N × 3, float64
    ///     Unit vectors; NaN where the lens does not reach.
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn rays<'py>(
        &self,
        py: Python<'py>,
        pixels: Points<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let wrong =
            || raised::Error::new_err(format!("pixels are N × 2, not {}", arrays::shape(&pixels)));
        let pixels = arrays::points2(&pixels).ok_or_else(wrong)?;
        let rays = unlocked(py, || {
            let ray = |pixel| match self.0.unproject(pixel) {
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

impl Camera {
    /// The text of a file of another program.
    pub fn text(
        &self,
        format: &str,
        name: &str,
        views: &[(&str, camera::Pose)],
    ) -> PyResult<String> {
        let camera = &self.0;
        let text = match format {
            "own" => return Ok(camera.to_yaml()),
            "opencv" => formats::opencv(camera),
            "ros" => formats::ros(camera, name),
            "kalibr" => formats::kalibr(&[(camera, camera::Pose::IDENTITY)], &[]),
            "colmap" => formats::colmap(&[camera]),
            "nerfstudio" => formats::nerfstudio(camera, views),
            "mrcal" => formats::mrcal(camera),
            _ => {
                let known = "own, opencv, ros, kalibr, colmap, nerfstudio or mrcal";
                return Err(raised::CameraError::new_err(format!(
                    "format: {format} is not {known}"
                )));
            }
        };
        text.raise(errors::camera)
    }
}

/// Writes a file of text whole or not at all.
pub fn save_text(path: PathBuf, text: String, force: bool) -> PyResult<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(std::path::Path::new(".")).to_owned();
    let Some(name) = path.file_name() else {
        return Err(raised::FileError::new_err(format!("{} is not a file name", path.display())));
    };
    let files = [(name.to_string_lossy().into_owned(), text.into_bytes())];
    write_set(&folder, &files, force).raise(errors::file)?;
    Ok(path)
}

/// Numbers in a row, also where an array has them in several dimensions, as OpenCV's coefficients.
pub struct Numbers(pub Vec<f64>);

impl<'a, 'py> FromPyObject<'a, 'py> for Numbers {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let flat = match given.hasattr("ravel")? {
            true => given.call_method0("ravel")?,
            false => given.to_owned(),
        };
        flat.extract().map(Self)
    }
}
