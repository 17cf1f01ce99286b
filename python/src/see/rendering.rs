//! Synthetic images of targets, with the true positions of their corners.

use std::path::PathBuf;

use deltille::export::truth;
use deltille::glam::DVec3;
use deltille::limits::Limits;
use deltille::raster::Gray;
use deltille::synth::{Light, TruthCorner, scene_of_target};
use deltille_core::quantity::{blur_px, light_gradient, of_full_scale, position_mm};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use super::camera::AnyCamera;
use super::pose::Pose;
use crate::boundary::arrays::{self, number, vector, whole};
use crate::boundary::errors::{self, Raise, RaiseFile};
use crate::boundary::interrupt::interruptible;
use crate::targets::target::Target;

/// The true positions of the N corners visible in a synthetic image.
#[pyclass(frozen, module = "deltille")]
pub struct Truth {
    corners: Vec<TruthCorner>,
    pose: Pose,
    light: Light,
    target: String,
}

#[pymethods]
impl Truth {
    /// Positions, N × 2, float64, px.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.corners.iter().map(|corner| [corner.x, corner.y]))
    }

    /// Positions on the target, N × 3, float64, mm.
    #[getter]
    fn object_points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.corners.iter().map(|corner| corner.target_mm.to_array()))
    }

    /// Ids of the corners, N, int64.
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.corners.iter().map(|corner| i64::from(corner.id)))
    }

    /// Rows, N, int64.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.corners.iter().map(|corner| i64::from(corner.row)))
    }

    /// Columns, N, int64.
    #[getter]
    fn cols<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.corners.iter().map(|corner| i64::from(corner.col)))
    }

    /// Ids of the panels, N, int64.
    #[getter]
    fn panels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::column(py, self.corners.iter().map(|corner| i64::from(corner.panel)))
    }

    /// Pose of the target: camera from target.
    #[getter]
    fn pose(&self) -> Pose {
        self.pose
    }

    /// Reads the truth file that ``deltille render`` writes next to an image.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///
    /// Returns
    /// -------
    /// Truth
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let text = Limits::default().read_text(&path).raise_of_file(&path, errors::file)?;
        let found = truth::read(&text);
        let wrong =
            |error| errors::file(format!("{}: {}", path.display(), errors::one_line(&error)));
        found.map(Self::from).map_err(wrong)
    }

    /// Reads the truth from the text of a file, like :meth:`load`.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        truth::read(text).map(Self::from).raise(errors::file)
    }

    /// Returns the text that ``deltille render`` writes next to an image.
    ///
    /// Parameters
    /// ----------
    /// image : str, optional
    ///     Name of the image file.
    #[pyo3(signature = (image = ""))]
    fn to_json(&self, image: &str) -> String {
        truth::write(image, &self.target, &self.pose.0, &self.light, &self.corners)
    }

    fn __len__(&self) -> usize {
        self.corners.len()
    }

    /// A file has the rotation as a matrix, so poses are equal up to rounding.
    fn __eq__(&self, other: &Self) -> bool {
        let off = self.pose.0.off(&other.pose.0);
        let is_same_pose = off.into_iter().all(|part| part.length() < 1e-9);
        is_same_pose
            && (&self.corners, &self.light, &self.target)
                == (&other.corners, &other.light, &other.target)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String,)> {
        Ok((slf.get_type().getattr("from_json")?, (slf.get().to_json(""),)))
    }

    fn __repr__(&self) -> String {
        format!("<Truth of {}: {} corners>", self.target, self.corners.len())
    }
}

impl From<truth::Truth> for Truth {
    fn from(found: truth::Truth) -> Self {
        let truth::Truth { target, camera_from_target, light, corners, .. } = found;
        Self { corners, pose: Pose(camera_from_target), light, target }
    }
}

/// Renders a synthetic image of a target.
///
/// Parameters
/// ----------
/// target : Target
///     A board or a solid. A board faces the side of z > 0; ChArUco boards and circle grids that of z < 0.
/// camera : Camera or CalibratedCamera
/// pose : Pose, optional
///     Camera from target.
/// eye : sequence of 3 floats, optional
///     Position of the camera in the target's frame, mm, instead of ``pose``.
/// look_at : sequence of 3 floats, optional
///     Point it looks at, mm; defaults to the centroid of the corners.
/// up : sequence of 3 floats, optional
///     Up direction of the image.
/// blur_px : float, optional
///     Standard deviation of the blur, px.
/// noise : float, optional
///     Standard deviation of the noise, relative to full scale.
/// gradient : (float, float), optional
///     Relative change of the light across and down the image, -2 to 2; defaults to none.
/// white, black, background : float, optional
///     Grey values of paper, print and background, relative to full scale.
/// seed : int, optional
///     Seed of the noise.
/// dtype : str, optional
///     ``"uint8"``, ``"uint16"`` or ``"float32"`` (0 to 1).
///
/// Returns
/// -------
/// image : ndarray of H × W
///     Grey values of the requested type.
/// truth : Truth
///     The true positions of all corners in view. Without any, a ``UserWarning`` is issued.
#[pyfunction]
#[pyo3(signature = (target, camera, pose = None, *, eye = None, look_at = None, up = None, blur_px = 0.8,
    noise = 0.01, gradient = None, white = 0.9, black = 0.1, background = 0.5, seed = 0, dtype = "uint8"))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn render<'py>(
    py: Python<'py>,
    target: PyRef<'_, Target>,
    camera: AnyCamera,
    pose: Option<PyRef<'_, Pose>>,
    eye: Option<&Bound<'_, PyAny>>,
    look_at: Option<&Bound<'_, PyAny>>,
    up: Option<&Bound<'_, PyAny>>,
    blur_px: f64,
    noise: f64,
    gradient: Option<&Bound<'_, PyAny>>,
    white: f64,
    black: f64,
    background: f64,
    seed: i64,
    dtype: &str,
) -> PyResult<(Bound<'py, PyAny>, Truth)> {
    let own = target.clone();
    let name = own.target().name.to_string();
    if !own.target().is_one_scene() {
        return Err(errors::target(format!(
            "{name} has several separate boards; only a single board or a solid can be rendered"
        )));
    }
    let camera = camera.0;
    Limits::default().check_pixels(camera.width, camera.height).raise(errors::camera)?;
    let grey = |name: &str, value| number(name, value, of_full_scale::RANGE, errors::target);
    let gradient = gradient
        .map(|parts| vector("gradient", parts, light_gradient::RANGE, errors::target))
        .transpose()?;
    let light = Light::default()
        .blur_px(number("blur_px", blur_px, blur_px::RANGE, errors::target)?)
        .noise(grey("noise", noise)?)
        .white(grey("white", white)?)
        .black(grey("black", black)?)
        .background(grey("background", background)?)
        .gradient(gradient.unwrap_or([0.0; 2]).into())
        .seed(whole("seed", seed, errors::target)?);
    let pose = pose_of(&own, pose.as_deref().copied(), eye, look_at, up)?;
    let drawn = interruptible(py, move |_| {
        let scene = scene_of_target(own.target())?;
        let image = scene.render(&camera, &pose.0, &light);
        Ok::<_, deltille::artwork::ArtworkError>((
            image,
            scene.truth(&camera, &pose.0, 0.0).corners,
        ))
    })?;
    let (image, corners) = drawn.raise(errors::target)?;
    if corners.is_empty() {
        // In the frames of OpenCV's boards, z points into the board.
        let first = target.target().panels.first();
        let is_away = first.is_some_and(|panel| panel.pose.matrix().z_axis.z < 0.0);
        let side = if is_away { "z < 0" } else { "z > 0" };
        let what = format!(
            "{name} is behind the camera, out of view, or seen from its back: eye looks at the middle of the target, \
             and a board faces the side of {side}"
        );
        errors::warn(py, &what)?;
    }
    Ok((array_of(py, &image, dtype)?, Truth { corners, pose, light, target: name }))
}

/// Returns the given pose, or that of a camera at `eye`.
fn pose_of(
    target: &Target,
    pose: Option<Pose>,
    eye: Option<&Bound<'_, PyAny>>,
    look_at: Option<&Bound<'_, PyAny>>,
    up: Option<&Bound<'_, PyAny>>,
) -> PyResult<Pose> {
    let wrong = |what: &str| Err(errors::target(what.to_owned()));
    let place = |name: &str, place| vector(name, place, position_mm::RANGE, errors::target);
    let look_at = look_at.map(|at| place("look_at", at)).transpose()?;
    let up = up.map(|up| place("up", up)).transpose()?;
    match (pose, eye) {
        (Some(pose), None) if look_at.or(up).is_none() => Ok(pose),
        (Some(_), None) => wrong("look_at and up need eye, and cannot be combined with pose"),
        (None, Some(eye)) => {
            let places = target.all().map(|(_, corner)| corner.target_mm);
            let middle = places.sum::<DVec3>() / target.all().count().max(1) as f64;
            Pose::looking_at(place("eye", eye)?, look_at.unwrap_or(middle.to_array()), up)
        }
        (Some(_), Some(_)) => wrong("pose and eye are mutually exclusive"),
        (None, None) => wrong("pass pose, or eye, the position of the camera in mm"),
    }
}

/// Returns an image as an array of this type.
fn array_of<'py>(py: Python<'py>, image: &Gray<f32>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    fn rows<'py, T: numpy::Element>(
        py: Python<'py>,
        image: &Gray<f32>,
        of: fn(f32) -> T,
    ) -> Bound<'py, PyAny> {
        let shape = (image.height(), image.width());
        let values = image.pixels().iter().map(|&v| of(v)).collect();
        let array = Array2::from_shape_vec(shape, values).expect("an image has all its pixels");
        array.into_pyarray(py).into_any()
    }
    match dtype {
        "uint8" => Ok(rows(py, image, |v| (v * 255.0 + 0.5) as u8)),
        "uint16" => Ok(rows(py, image, |v| (v * 65535.0 + 0.5) as u16)),
        "float32" => Ok(rows(py, image, |v| v)),
        _ => Err(errors::target(format!("unknown dtype {dtype} (known: uint8, uint16, float32)"))),
    }
}
