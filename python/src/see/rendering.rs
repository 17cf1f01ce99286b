//! Synthetic pictures of targets, with the true places of their corners.

use std::path::PathBuf;

use deltille::export::truth;
use deltille::glam::DVec3;
use deltille::limits::Limits;
use deltille::synth::{Light, TruthCorner, scene_of_target};
use deltille_core::quantity::{blur_px, light_gradient, of_full_scale, place_mm};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use super::camera::Camera;
use super::pose::Pose;
use crate::boundary::arrays::{self, number, vector, whole};
use crate::boundary::errors::{self, Raise, RaiseFile, raised};
use crate::boundary::interrupt::interruptible;
use crate::targets::target::Target;

/// The true places of the N corners that a synthetic picture shows.
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

    /// Places on the target, N × 3, float64, mm.
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

    /// Where the target is: camera from target.
    #[getter]
    fn pose(&self) -> Pose {
        self.pose
    }

    /// Reads what ``deltille render`` writes beside a picture.
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
        let wrong = |error| errors::file(format!("{}: {}", path.display(), errors::told(&error)));
        found.map(Self::from).map_err(wrong)
    }

    /// The truth of a text, as :meth:`load` reads it from files.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        truth::read(text).map(Self::from).raise(errors::file)
    }

    /// The text that ``deltille render`` writes beside a picture.
    ///
    /// Parameters
    /// ----------
    /// image : str, optional
    ///     Name of the picture's file.
    #[pyo3(signature = (image = ""))]
    fn to_json(&self, image: &str) -> String {
        truth::write(image, &self.target, &self.pose.0, &self.light, &self.corners)
    }

    fn __len__(&self) -> usize {
        self.corners.len()
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

/// Takes a synthetic picture of a target.
///
/// Parameters
/// ----------
/// target : Target
///     A board or a solid.
/// camera : Camera
/// pose : Pose, optional
///     Camera from target.
/// eye : sequence of 3 floats, optional
///     Instead of ``pose``: where the camera stands in the target's frame, mm.
/// look_at : sequence of 3 floats, optional
///     What it looks at, mm; the middle of all corners if left out.
/// up : sequence of 3 floats, optional
///     What is up in the picture.
/// blur_px : float, optional
///     Standard deviation of the blur, px.
/// noise : float, optional
///     Standard deviation of the noise, of full scale 1.
/// gradient : (float, float), optional
///     Relative change of the light across and down the picture, -2 to 2; none if left out.
/// white, black, background : float, optional
///     Grey values of paper, print and what is around, of full scale 1.
/// seed : int, optional
///     Seed of the noise.
/// dtype : str, optional
///     ``"uint8"``, ``"uint16"`` or ``"float32"`` (0 to 1).
///
/// Returns
/// -------
/// image : ndarray of H × W
///     Grey values of the type that was asked for.
/// truth : Truth
///     The true places of all corners in view.
#[pyfunction]
#[pyo3(signature = (target, camera, pose = None, *, eye = None, look_at = None, up = None, blur_px = 0.8,
    noise = 0.01, gradient = None, white = 0.9, black = 0.1, background = 0.5, seed = 0, dtype = "uint8"))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn render<'py>(
    py: Python<'py>,
    target: PyRef<'_, Target>,
    camera: PyRef<'_, Camera>,
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
    let wrong = |what: String| raised::TargetError::new_err(what);
    let own = target.clone();
    let of = own.target();
    if !of.is_one_scene() {
        let what =
            format!("{} has several loose boards: render targets of one board, or solids", of.name);
        return Err(wrong(what));
    }
    let camera = camera.0.clone();
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
    let place = |name: &str, place| vector(name, place, place_mm::RANGE, errors::target);
    let look_at = look_at.map(|at| place("look_at", at)).transpose()?;
    let up = up.map(|up| place("up", up)).transpose()?;
    let pose = match (pose, eye) {
        (Some(pose), None) if look_at.or(up).is_none() => *pose,
        (Some(_), None) => {
            return Err(wrong(
                "look_at and up belong to eye: a pose says where it looks".to_owned(),
            ));
        }
        (None, Some(eye)) => {
            let places = own.all().map(|(_, corner)| corner.target_mm);
            let middle = places.sum::<DVec3>() / own.all().count().max(1) as f64;
            Pose::looking_at(place("eye", eye)?, look_at.unwrap_or(middle.to_array()), up)?
        }
        _ => {
            let what = "give pose, or eye for where the camera stands";
            return Err(wrong(what.to_owned()));
        }
    };
    let name = own.target().name.to_string();
    let drawn = interruptible(py, move |_| {
        let scene = scene_of_target(own.target())?;
        let image = scene.render(&camera, &pose.0, &light);
        Ok::<_, deltille::artwork::ArtworkError>((
            image,
            scene.truth(&camera, &pose.0, 0.0).corners,
        ))
    })?;
    let (image, corners) = drawn.raise(errors::target)?;
    let shape = (image.height(), image.width());
    let pixels = image.pixels();
    let full = "a picture has all its pixels";
    let array = match dtype {
        "uint8" => {
            let grey = pixels.iter().map(|v| (v * 255.0 + 0.5) as u8).collect();
            Array2::from_shape_vec(shape, grey).expect(full).into_pyarray(py).into_any()
        }
        "uint16" => {
            let grey = pixels.iter().map(|v| (v * 65535.0 + 0.5) as u16).collect();
            Array2::from_shape_vec(shape, grey).expect(full).into_pyarray(py).into_any()
        }
        "float32" => {
            let grey = pixels.to_vec();
            Array2::from_shape_vec(shape, grey).expect(full).into_pyarray(py).into_any()
        }
        _ => return Err(wrong("dtype: give uint8, uint16 or float32".to_owned())),
    };
    Ok((array, Truth { corners, pose, light, target: name }))
}
