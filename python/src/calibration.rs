//! Calibrated cameras and rigs, as arrays.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use deltille::calibrate::{
    self as solver, CameraEstimate, Estimate, Reference, Source, ViewEstimate,
};
use deltille::export::calibration::{Residuals, read_sheet};
use deltille::export::camera::{colmap, colmap_rig, kalibr};
use deltille::export::saved;
use deltille::limits::Limits;
use deltille::report;
use deltille::{glam, targets};
use glam::DVec2;
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::arrays::{self, Points};
use crate::camera::{Camera, save_text};
use crate::detection::{Detection, Targets, record};
use crate::errors::{self, Raise, raised, unlocked};
use crate::pose::Pose;
use crate::solving::{How, ModelChoice, OneCamera, PrintScale, Seen, Solved, named, solve};
use crate::targets::Target;

/// Something that is said of a calibration, with what to do about it.
#[pyclass(frozen, module = "deltille")]
pub struct Diagnosis {
    record: serde_json::Value,
    is_failure: bool,
}

#[pymethods]
impl Diagnosis {
    /// The kind, such as ``"lack_of_fit"``.
    #[getter]
    fn kind(&self) -> &str {
        self.record["kind"].as_str().unwrap_or_default()
    }

    /// The sentence.
    #[getter]
    fn sentence(&self) -> String {
        errors::told(&self.record["text"].as_str().unwrap_or_default())
    }

    /// Whether what was found is not to be used as it is.
    #[getter]
    fn is_failure(&self) -> bool {
        self.is_failure
    }

    /// All figures by their names, as in the file of the calibration.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        record(py, &self.record)
    }

    fn __str__(&self) -> String {
        self.sentence()
    }

    fn __repr__(&self) -> String {
        format!("<Diagnosis {}: {}>", self.kind(), self.sentence())
    }
}

/// A view, frame or panel that took no part, and why.
#[pyclass(frozen, get_all, module = "deltille")]
pub struct Excluded {
    /// Name of the view, or of the frame of a rig.
    view: String,
    /// Name of the camera in a rig; ``None`` where all are meant.
    camera: Option<String>,
    /// Name of the picture; empty where pictures of several cameras are meant.
    image: String,
    /// Id of the panel that is wrong in itself; ``None`` where the view does not fit as a whole.
    panel: Option<u32>,
    /// How many corners were left out by it.
    corners: usize,
    /// Why.
    reason: String,
}

#[pymethods]
impl Excluded {
    fn __repr__(&self) -> String {
        format!("<Excluded {}: {}>", self.view, self.reason)
    }
}

/// A view with the pose of the target in it and the residuals of its N corners.
#[pyclass(frozen, module = "deltille")]
pub struct View {
    solved: Arc<Solved>,
    camera: usize,
    view: usize,
}

/// One camera as it was found.
///
/// Arrays of P parameters are in the order of :attr:`Camera.parameter_names`, those of the F parameters that were found
/// in the order of :attr:`found`, those of N corners view after view.
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
}

/// Ids of corners on a target by panel, row and column.
fn corner_ids(targets: &[targets::Target]) -> BTreeMap<(usize, i32, i32), i64> {
    let panels = targets.iter().flat_map(|target| &target.panels).enumerate();
    let of_panel = |(index, panel): (usize, &targets::Panel)| {
        let id = |corner: &targets::Corner| ((index, corner.row, corner.col), i64::from(corner.id));
        panel.corners.iter().map(id).collect::<Vec<_>>()
    };
    panels.flat_map(of_panel).collect()
}

/// Where deviations come from, by name.
fn source(name: &str) -> PyResult<Source> {
    match name {
        "noise" => Ok(Source::Noise),
        "observed" => Ok(Source::Observed),
        _ => Err(raised::CalibrationError::new_err("source: give noise or observed")),
    }
}

macro_rules! residual_arrays {
    ($class:ident, $self:ident => $views:expr, $solved:expr) => {
        #[pymethods]
        impl $class {
            /// Residuals of the corners, N × 2, float64, px: detected less predicted position.
            #[getter]
            fn residuals<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| corner.residual.to_array()))
            }

            /// Detected positions of the corners, N × 2, float64, px.
            #[getter]
            fn pixels<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| corner.pixel.to_array()))
            }

            /// Ids of the corners on the target, N, int64; −1 where the target is not known.
            #[getter]
            fn ids<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
                let ids = corner_ids(&$solved.targets);
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                let id = |c: &solver::Corner| ids.get(&(c.panel.index(), c.row, c.col)).copied();
                arrays::column(py, corners.map(|corner| id(corner).unwrap_or(-1)))
            }

            /// Lattice rows and columns of the corners, N × 2, int64.
            #[getter]
            fn labels<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<i64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| [corner.row.into(), corner.col.into()]))
            }

            /// Whether each residual is larger than chance explains, N, bool.
            #[getter]
            fn outliers<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::column(py, corners.map(|corner| corner.outlier))
            }
        }
    };
}

residual_arrays!(CalibratedCamera, self => self.estimate().views, self.solved);
residual_arrays!(View, self => std::slice::from_ref(self.estimate()), self.solved);

impl View {
    fn estimate(&self) -> &ViewEstimate {
        &self.solved.estimate.cameras[self.camera].views[self.view]
    }
}

#[pymethods]
impl View {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.estimate().name
    }

    /// File name of its picture.
    #[getter]
    fn image(&self) -> &str {
        &self.estimate().image
    }

    /// Where the target is: camera from target.
    #[getter]
    fn pose(&self) -> Pose {
        Pose(self.estimate().pose)
    }

    /// Standard deviations of the target's pose in the frame of the rig, or of the only camera, 6, float64: a
    /// rotation about the frame's axes (rad) and a translation (mm).
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let frame = self.solved.estimate.frames.get(self.estimate().frame);
        arrays::column(py, frame.map_or([f64::NAN; 6], |frame| frame.pose_sd))
    }

    /// Root mean square error of a coordinate, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.estimate().rms_px
    }

    fn __len__(&self) -> usize {
        self.estimate().corners.len()
    }

    fn __repr__(&self) -> String {
        let view = self.estimate();
        format!("<View {}: {} corners, rms {:.4} px>", view.name, view.corners.len(), view.rms_px)
    }
}

#[pymethods]
impl CalibratedCamera {
    /// Name of the camera.
    #[getter]
    fn name(&self) -> &str {
        &self.estimate().name
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.estimate().camera.clone())
    }

    /// The model that was found, such as ``"radtan"``; ``None`` where the camera was given.
    #[getter]
    fn model(&self) -> Option<String> {
        self.estimate().model.map(|model| model.to_string())
    }

    /// Names of the F parameters that were found.
    #[getter]
    fn found(&self) -> Vec<String> {
        self.estimate().found().map(str::to_owned).collect()
    }

    /// Covariance of the parameters that were found, F × F, float64, from the noise of the corners.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix(py, &self.estimate().covariance)
    }

    /// The same covariance as the frames agree with each other; ``None`` of too few frames.
    #[getter]
    fn observed_covariance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let found = self.estimate().covariance_from(Source::Observed);
        found.map(|covariance| arrays::matrix(py, covariance))
    }

    /// Standard deviations of all parameters, P, float64; NaN of those that were given.
    #[getter]
    fn sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let parameters = self.estimate().parameters.iter();
        arrays::column(py, parameters.map(|parameter| parameter.sd.unwrap_or(f64::NAN)))
    }

    /// The same as the frames agree with each other; NaN where that is not known.
    #[getter]
    fn observed_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let found = self.estimate().observed_sd().into_iter();
        arrays::column(py, found.map(|sd| sd.unwrap_or(f64::NAN)))
    }

    /// Names of parameters that the views cannot tell apart.
    #[getter]
    fn ill_conditioned(&self) -> Vec<String> {
        self.estimate().ill_conditioned.clone()
    }

    /// Root mean square error of a coordinate over its corners, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.estimate().rms_px
    }

    /// The same of the corners that are no outliers, px.
    #[getter]
    fn inlier_rms_px(&self) -> f64 {
        self.estimate().inlier_rms_px()
    }

    /// How many corners took part.
    #[getter]
    fn corner_count(&self) -> usize {
        self.estimate().corner_count()
    }

    /// How many corners are outliers.
    #[getter]
    fn outlier_count(&self) -> usize {
        self.estimate().outlier_count()
    }

    /// Where the camera is on the rig: camera from rig; of a single camera the identity.
    #[getter]
    fn pose(&self) -> Pose {
        Pose(self.estimate().camera_from_rig)
    }

    /// Standard deviations of that pose, 6, float64: a rotation (rad) and a translation (mm) about the camera's axes;
    /// ``None`` where it was not to be found.
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.estimate().pose_sd.map(|sd| arrays::column(py, sd))
    }

    /// By how many frames its pictures are late.
    #[getter]
    fn delay(&self) -> i32 {
        self.estimate().delay
    }

    /// The views that took part.
    #[getter]
    fn views(&self) -> Vec<View> {
        let all = 0..self.estimate().views.len();
        let view = |view| View { solved: self.solved.clone(), camera: self.index, view };
        all.map(view).collect()
    }

    /// Index of the view of each corner, N, int64.
    #[getter]
    fn view_indices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of =
            |(index, view): (i64, &ViewEstimate)| std::iter::repeat_n(index, view.corners.len());
        arrays::column(py, (0..).zip(&self.estimate().views).flat_map(of).collect::<Vec<_>>())
    }

    /// How sure projections are where corners were seen.
    ///
    /// Parameters
    /// ----------
    /// distance_mm : float, optional
    ///     How far points are, mm; infinity if left out.
    /// source : str, optional
    ///     ``"noise"`` of the corners, or ``"observed"``: how far the frames agree with each other.
    ///
    /// Returns
    /// -------
    /// float or None
    ///     Standard deviation of a coordinate, px; ``None`` where it is not known.
    #[pyo3(signature = (distance_mm = None, source = "noise"))]
    fn projection_sd(&self, distance_mm: Option<f64>, source: &str) -> PyResult<Option<f64>> {
        Ok(self.estimate().projection_sd_px(distance_mm, self::source(source)?))
    }

    /// How sure projections are over the image.
    ///
    /// Parameters
    /// ----------
    /// distance_mm, source
    ///     As of :meth:`projection_sd`.
    ///
    /// Returns
    /// -------
    /// ndarray of R × C, float64, or None
    ///     Standard deviations along the worst direction, px, of R × C places that cover the image; NaN beyond the lens.
    #[pyo3(signature = (distance_mm = None, source = "noise"))]
    fn uncertainty_map<'py>(
        &self,
        py: Python<'py>,
        distance_mm: Option<f64>,
        source: &str,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let source = self::source(source)?;
        let map = unlocked(py, || self.estimate().uncertainty_map(distance_mm, source))?;
        Ok(map.map(|map| {
            let sd = |i: usize, j: usize| map.sd_px[i * map.columns + j].unwrap_or(f64::NAN);
            let full = deltille::nalgebra::DMatrix::from_fn(map.rows, map.columns, sd);
            arrays::matrix(py, &full)
        }))
    }

    /// Covariances of where the camera projects what pixels show.
    ///
    /// Parameters
    /// ----------
    /// pixels : array of N × 2
    ///     Positions, px.
    /// distance_mm, source
    ///     As of :meth:`projection_sd`.
    ///
    /// Returns
    /// -------
    /// ndarray of N × 2 × 2, float64
    ///     px²; NaN beyond the lens, or where it is not known.
    #[pyo3(signature = (pixels, distance_mm = None, source = "noise"))]
    fn projection_covariance<'py>(
        &self,
        py: Python<'py>,
        pixels: Points<'py>,
        distance_mm: Option<f64>,
        source: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let source = self::source(source)?;
        let wrong =
            || raised::Error::new_err(format!("pixels are N × 2, not {}", arrays::shape(&pixels)));
        let pixels = arrays::points2(&pixels).ok_or_else(wrong)?;
        let found = unlocked(py, || {
            let one = |pixel: DVec2| {
                let found = self.estimate().projection_covariance(pixel, distance_mm, source)?;
                Some([found[0][0], found[0][1], found[1][1]])
            };
            pixels.into_iter().map(one).collect::<Vec<_>>()
        })?;
        Ok(arrays::covariances(py, found))
    }

    /// The models that were tried where one was to be chosen, each as a dictionary: ``model``, ``parameters``,
    /// ``held_out_px``, ``is_stable``, ``holds``, ``chosen``.
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let tried = self.solved.models.get(self.index).map(Vec::as_slice).unwrap_or_default();
        let one = |tried: &solver::Candidate| {
            serde_json::json!({
                "model": tried.model.to_string(), "parameters": tried.parameters,
                "held_out_px": tried.held_out_px, "is_stable": tried.is_stable,
                "holds": tried.holds, "chosen": tried.chosen,
            })
        };
        record(py, &tried.iter().map(one).collect::<Vec<_>>())
    }

    fn __repr__(&self) -> String {
        let found = self.estimate();
        let model = found.model.map_or("given".to_owned(), |model| model.to_string());
        let (views, rms) = (found.views.len(), found.rms_px);
        format!("<CalibratedCamera {}: {model}, {views} views, rms {rms:.4} px>", found.name)
    }
}

/// A calibrated camera, with all that is said about it.
#[pyclass(frozen, extends = CalibratedCamera, module = "deltille")]
pub struct Calibration;

/// Cameras that are fixed to each other, and where they are.
#[pyclass(frozen, module = "deltille")]
pub struct Rig {
    pub solved: Arc<Solved>,
}

fn calibration(solved: Arc<Solved>) -> PyClassInitializer<Calibration> {
    PyClassInitializer::from(CalibratedCamera { solved, index: 0 }).add_subclass(Calibration)
}

macro_rules! whole {
    ($class:ident, $is_rig:literal, $self:ident: $kind:ty => $solved:expr) => {
        #[pymethods]
        impl $class {
            /// What is to be said about it.
            #[getter]
            fn diagnoses($self: $kind) -> Vec<Diagnosis> {
                let said = $solved.said().into_iter();
                said.map(|(record, is_failure)| Diagnosis { record, is_failure }).collect()
            }

            /// Views and frames that took no part, and why.
            #[getter]
            fn excluded($self: $kind) -> Vec<Excluded> {
                let one = |out: &solver::Excluded| Excluded {
                    view: out.view.clone(),
                    camera: out.camera.clone(),
                    image: out.image.clone(),
                    panel: out.panel,
                    corners: out.corners,
                    reason: errors::told(&out.reason),
                };
                $solved.estimate.excluded.iter().map(one).collect()
            }

            /// A-posteriori standard deviation of a coordinate, by whose square covariances are scaled.
            #[getter]
            fn sigma($self: $kind) -> f64 {
                $solved.estimate.sigma
            }

            /// The deviation that was added to that of every corner, px; ``None`` with equal weights.
            #[getter]
            fn common_px($self: $kind) -> Option<f64> {
                $solved.estimate.common_px
            }

            /// Root mean square error of a coordinate in what was held out, px; ``None`` where nothing was.
            #[getter]
            fn held_out_rms_px($self: $kind) -> Option<f64> {
                $solved.estimate.held_out.as_ref().map(|test| test.rms_px)
            }

            /// How far the sheet of the board is bent, mm, and how sure that is (F), where that was to be found:
            /// ``bent_mm``, ``stretched_mm``, ``f_ratio``, ``is_significant``.
            #[getter]
            fn board_shape<'py>($self: $kind, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
                let data = $solved.estimate.shape.map(|found| {
                    serde_json::json!({
                        "bent_mm": found.bent_mm, "stretched_mm": found.stretched_mm,
                        "f_ratio": found.f_ratio, "is_significant": found.is_significant(),
                    })
                });
                data.map(|data| record(py, &data)).transpose()
            }

            /// The text of its file.
            ///
            /// Parameters
            /// ----------
            /// residuals : bool, optional
            ///     Whether every corner is listed.
            ///
            /// Returns
            /// -------
            /// str
            #[pyo3(signature = (*, residuals = false))]
            fn to_json($self: $kind, residuals: bool) -> String {
                let listed = if residuals { Residuals::Listed } else { Residuals::LeftOut };
                $solved.json($is_rig, listed)
            }

            /// Writes a page that shows what the calibration is worth, and what would make it better.
            ///
            /// Parameters
            /// ----------
            /// path : path-like
            ///     An ``.html`` file.
            /// title : str, optional
            /// force : bool, optional
            ///     Whether a file of another kind is replaced.
            ///
            /// Returns
            /// -------
            /// pathlib.Path
            #[pyo3(signature = (path, *, title = None, force = false))]
            fn report(
                $self: $kind,
                py: Python<'_>,
                path: PathBuf,
                title: Option<&str>,
                force: bool,
            ) -> PyResult<PathBuf> {
                let solved = $solved.clone();
                let usual = if $is_rig { "rig" } else { "camera" };
                let title = title.unwrap_or(usual).to_owned();
                let page = unlocked(py, move || {
                    let mut page = report::Report::new(&title, &solved.estimate);
                    (page.diagnoses, page.stated) = (&solved.diagnoses, &solved.stated);
                    (page.print, page.models) = (solved.print, &solved.models);
                    page.html()
                })?;
                save_text(path, errors::told_in_lines(&page), force)
            }
        }
    };
}

whole!(Calibration, false, self_: PyRef<'_, Self> => self_.as_super().solved);
whole!(Rig, true, self_: PyRef<'_, Self> => self_.solved);

#[pymethods]
impl Calibration {
    /// Reads a calibration: the ``.json`` of :meth:`save` or of ``deltille calibrate``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// target : Target, optional
    ///     What was photographed, from which :attr:`ids` come.
    ///
    /// Returns
    /// -------
    /// Calibration
    #[staticmethod]
    #[pyo3(signature = (path, *, target = None))]
    fn load(py: Python<'_>, path: PathBuf, target: Option<Targets>) -> PyResult<Py<Self>> {
        let solved = read(&path, target, false)?;
        Py::new(py, calibration(Arc::new(solved)))
    }

    /// Writes the calibration.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     A ``.json`` file, or that of another program.
    /// format : str, optional
    ///     ``"json"``, which :meth:`load` reads back, or a format of :meth:`Camera.save`; ``"nerfstudio"`` has the
    ///     poses of the views too.
    /// residuals : bool, optional
    ///     Whether every corner is listed in the ``.json``.
    /// force : bool, optional
    ///     Whether a file of another kind is replaced.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, format = "json", *, residuals = false, force = false))]
    fn save(
        slf: PyRef<'_, Self>,
        path: PathBuf,
        format: &str,
        residuals: bool,
        force: bool,
    ) -> PyResult<PathBuf> {
        let own = slf.as_super();
        let text = match format {
            "json" => {
                let listed = if residuals { Residuals::Listed } else { Residuals::LeftOut };
                own.solved.json(false, listed)
            }
            _ => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let camera = own.estimate();
                let views = camera.views.iter().map(|view| (view.image.as_str(), view.pose));
                own.camera().text(format, &stem, &views.collect::<Vec<_>>())?
            }
        };
        save_text(path, text, force)
    }

    /// The target with its corners where they were measured; ``None`` where they were not.
    #[getter]
    fn measured_target(slf: PyRef<'_, Self>) -> PyResult<Option<Target>> {
        let solved = &slf.as_super().solved;
        let found = solved.estimate.map.as_ref().zip(solved.targets.first());
        found.map(|(map, target)| Target::with_family(map.on(target), None)).transpose()
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        slf.as_super().__repr__().replace("CalibratedCamera ", "Calibration ")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String, Vec<String>)> {
        let solved = slf.as_super().get().solved.clone();
        let restore = slf.py().import("deltille._core")?.getattr("_calibration")?;
        let targets = solved.targets.iter().map(targets::Target::to_json).collect();
        Ok((restore, (solved.json(false, Residuals::Listed), targets)))
    }
}

/// A calibration that was pickled.
#[pyfunction]
pub fn _calibration(py: Python<'_>, json: &str, targets: Vec<String>) -> PyResult<Py<Calibration>> {
    let targets = targets.iter().map(|text| targets::Target::from_json(text).raise(errors::target));
    let solved = of_text(json, targets.collect::<PyResult<_>>()?).raise(errors::calibration)?;
    Py::new(py, calibration(Arc::new(solved)))
}

#[pymethods]
impl Rig {
    /// Reads a rig: the ``.json`` of :meth:`save` or of ``deltille rig``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// target : Target or sequence of Target, optional
    ///     What was photographed.
    ///
    /// Returns
    /// -------
    /// Rig
    #[staticmethod]
    #[pyo3(signature = (path, *, target = None))]
    fn load(path: PathBuf, target: Option<Targets>) -> PyResult<Self> {
        Ok(Self { solved: Arc::new(read(&path, target, true)?) })
    }

    /// The cameras by their names, in the order given; the first is the frame of the rig.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let all = pyo3::types::PyDict::new(py);
        for index in 0..self.solved.estimate.cameras.len() {
            let camera = CalibratedCamera { solved: self.solved.clone(), index };
            all.set_item(camera.name().to_owned(), Py::new(py, camera)?)?;
        }
        Ok(all)
    }

    /// Names of the frames: moments at which pictures were taken.
    #[getter]
    fn frames(&self) -> Vec<String> {
        self.solved.estimate.frames.iter().map(|frame| frame.name.clone()).collect()
    }

    /// Where the target was in each frame: rig from target.
    #[getter]
    fn poses(&self) -> Vec<Pose> {
        self.solved.estimate.frames.iter().map(|frame| Pose(frame.rig_from_target)).collect()
    }

    /// Standard deviations of these poses, frames × 6, float64: a rotation (rad) and a translation (mm) about the
    /// rig's axes.
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.solved.estimate.frames.iter().map(|frame| frame.pose_sd))
    }

    /// Root mean square error of a coordinate over all corners, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.solved.estimate.rms_px
    }

    /// The targets with their panels where they were found, where that was asked for.
    #[getter]
    fn refined_targets(&self) -> PyResult<Vec<Target>> {
        let estimate = &self.solved.estimate;
        let all = self.solved.targets.iter().enumerate();
        let refined = all.filter_map(|(index, target)| {
            let found = match self.solved.targets.len() {
                1 => estimate.clone(),
                _ => estimate.of_target(index),
            };
            let refined = found.has_refined_panels().then(|| found.refined(target));
            let measured = found.map.as_ref().map(|map| map.on(refined.as_ref().unwrap_or(target)));
            measured.or(refined)
        });
        refined.map(|target| Target::with_family(target, None)).collect()
    }

    /// Writes the rig.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     A ``.json`` file, or that of another program.
    /// format : str, optional
    ///     ``"json"``, which :meth:`load` reads back, ``"kalibr"``, ``"colmap"`` or ``"colmap-rig"``.
    /// residuals : bool, optional
    ///     Whether every corner is listed in the ``.json``.
    /// force : bool, optional
    ///     Whether a file of another kind is replaced.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, format = "json", *, residuals = false, force = false))]
    fn save(&self, path: PathBuf, format: &str, residuals: bool, force: bool) -> PyResult<PathBuf> {
        let estimate = &self.solved.estimate;
        let cameras = || estimate.cameras.iter();
        let text = match format {
            "json" => {
                let listed = if residuals { Residuals::Listed } else { Residuals::LeftOut };
                self.solved.json(true, listed)
            }
            "kalibr" => {
                let placed = cameras().map(|found| (&found.camera, found.camera_from_rig));
                kalibr(&placed.collect::<Vec<_>>(), &estimate.overlaps()).raise(errors::camera)?
            }
            "colmap" => colmap(&cameras().map(|found| &found.camera).collect::<Vec<_>>())
                .raise(errors::camera)?,
            "colmap-rig" => {
                let placed = cameras().map(|f| (f.name.as_str(), &f.camera, f.camera_from_rig));
                colmap_rig(&placed.collect::<Vec<_>>()).raise(errors::camera)?
            }
            _ => {
                let what = format!("format: {format} is not json, kalibr, colmap or colmap-rig");
                return Err(raised::CameraError::new_err(what));
            }
        };
        save_text(path, text, force)
    }

    fn __repr__(&self) -> String {
        let found = &self.solved.estimate;
        let (cameras, frames) = (found.cameras.len(), found.frames.len());
        format!("<Rig: {cameras} cameras, {frames} frames, rms {:.4} px>", found.rms_px)
    }
}

/// A calibration or rig of a text.
fn of_text(text: &str, targets: Vec<targets::Target>) -> Result<Solved, saved::SavedError> {
    let estimate: Estimate = match targets.as_slice() {
        [] => {
            let mut estimate = Estimate::default();
            estimate.cameras = saved::read_cameras(text)?;
            estimate.rms_px = estimate.cameras.first().map_or(0.0, |camera| camera.rms_px);
            estimate
        }
        [only] => saved::read(text, &Reference::Target(only))?,
        several => saved::read(text, &Reference::Scene(several))?,
    };
    let model = estimate.cameras.first().and_then(|camera| camera.model);
    let model = model.map_or("fixed".to_owned(), |model| model.to_string());
    Ok(Solved::read(estimate, targets, model))
}

fn read(path: &std::path::Path, target: Option<Targets>, is_rig: bool) -> PyResult<Solved> {
    let text = Limits::default().read_text(path).raise(errors::file)?;
    let targets = target.map(|targets| targets.0).unwrap_or_default();
    let targets = targets.iter().map(|target| (*target.target).clone()).collect();
    let wrong = |what: String| raised::FileError::new_err(format!("{}: {what}", path.display()));
    let solved = of_text(&text, targets).map_err(|error| wrong(errors::told(&error)))?;
    if !is_rig && solved.estimate.cameras.len() != 1 {
        return Err(wrong("this is a rig: read it by Rig.load".to_owned()));
    }
    Ok(solved)
}

/// Calibrates a camera from detections.
///
/// Parameters
/// ----------
/// detections : sequence of Detection
///     Of pictures of one camera; 20 or more with the board tilted by 20° to 45° are good.
/// target : Target, optional
///     What was photographed; that of the detections if left out.
/// model : str, optional
///     ``"radtan"``, ``"radtan5"``, ``"rational"``, ``"thin-prism"``, ``"kannala-brandt"``, ``"eucm"``,
///     ``"double-sphere"``, ``"pupil"``, ``"spline"``, or ``"auto"``, which takes the one that holds views best that
///     took no part.
/// camera : Camera, optional
///     A known camera, of which only the poses are found.
/// grid : str, optional
///     Without a target the tiling of an untagged board, ``"deltille"`` or ``"checker"``.
/// rows, cols : int, optional
///     Its rows and columns of corners, where they are known.
/// edge_mm : float, optional
///     The edge of its tiles, mm.
/// hold_out : int, optional
///     Every n-th view takes no part, and tells how well the others predict it.
/// loss : str, optional
///     How corners far off count: ``"huber"``, ``"cauchy"`` or ``"none"`` (least squares).
/// weights : str, optional
///     ``"covariance"`` of the detections, or ``"equal"``.
/// board_shape : bool, optional
///     Whether it is found, too, how the sheet is bent and stretched.
/// measure_target : bool, optional
///     Whether the place of every corner is found, too.
/// shape : path-like, optional
///     A file of a calibration with ``board_shape``, whose sheet this is.
/// print_scale : float or (float, float), optional
///     Measured over stated length of the check bars, across and up the sheet.
/// distances_mm : sequence of float, optional
///     For which the uncertainty of projections is told.
/// names : sequence of str, optional
///     Names of the views.
///
/// Returns
/// -------
/// Calibration
///
/// Raises
/// ------
/// CalibrationError
///     Where views are too few, too much alike, or do not belong together.
#[pyfunction]
#[pyo3(signature = (detections, target = None, model = "radtan", *, camera = None, grid = None, rows = None,
    cols = None, edge_mm = None, hold_out = None, loss = "huber", weights = "covariance", board_shape = false,
    measure_target = false, shape = None, print_scale = None, distances_mm = Vec::new(), names = None))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn calibrate(
    py: Python<'_>,
    detections: Vec<PyRef<'_, Detection>>,
    target: Option<Targets>,
    model: &str,
    camera: Option<PyRef<'_, Camera>>,
    grid: Option<&str>,
    rows: Option<u32>,
    cols: Option<u32>,
    edge_mm: Option<f64>,
    hold_out: Option<usize>,
    loss: &str,
    weights: &str,
    board_shape: bool,
    measure_target: bool,
    shape: Option<PathBuf>,
    print_scale: Option<PrintScale>,
    distances_mm: Vec<f64>,
    names: Option<Vec<String>>,
) -> PyResult<Py<Calibration>> {
    let mut how = How::of(loss, weights, hold_out, distances_mm, print_scale)?;
    (how.board_shape, how.measure_target) = (board_shape, measure_target);
    if let Some(path) = shape {
        let text = Limits::default().read_text(&path).raise(errors::file)?;
        let sheet = read_sheet(&text);
        let wrong = |error| {
            raised::FileError::new_err(format!("{}: {}", path.display(), errors::told(&error)))
        };
        how.sheet = sheet.map_err(wrong)?;
    }
    let target = target.or_else(|| of_detections(&detections, grid.is_some()));
    let seen = Seen::of(target, grid, [rows, cols], edge_mm)?;
    let model = ModelChoice::of(model)?;
    let detections = named(py, &detections, names)?;
    let known = camera.map(|camera| camera.0.clone());
    let one = OneCamera { name: "camera".to_owned(), detections, known };
    let solved = solve(py, seen, vec![one], model, how)?;
    Py::new(py, calibration(Arc::new(solved)))
}

/// The targets that detections looked for, where nothing else is said.
fn of_detections(detections: &[PyRef<'_, Detection>], is_grid: bool) -> Option<Targets> {
    let first = detections.first().filter(|_| !is_grid)?;
    (!first.targets.is_empty()).then(|| Targets(first.targets.clone()))
}

/// Calibrates cameras that are fixed to each other.
///
/// Parameters
/// ----------
/// cameras : dict of str to sequence of Detection
///     What each camera saw; pictures of one moment have the same name. The first camera is the frame of the rig.
/// target : Target or sequence of Target, optional
///     What was photographed: one target, or several that do not move against each other; that of the detections if
///     left out.
/// model : str, optional
///     As of :func:`calibrate`.
/// known : dict of str to Camera, optional
///     Cameras that are known and kept.
/// refine_target : bool, optional
///     Whether it is found, too, where the panels are on the target.
/// hold_out, loss, weights, board_shape, measure_target, print_scale, distances_mm
///     As of :func:`calibrate`.
///
/// Returns
/// -------
/// Rig
///
/// Raises
/// ------
/// CalibrationError
///     Where views are too few, or nothing ties the cameras to each other.
#[pyfunction]
#[pyo3(signature = (cameras, target = None, model = "radtan", *, known = None, refine_target = false,
    hold_out = None, loss = "huber", weights = "covariance", board_shape = false, measure_target = false,
    print_scale = None, distances_mm = Vec::new()))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn rig(
    py: Python<'_>,
    cameras: &Bound<'_, pyo3::types::PyDict>,
    target: Option<Targets>,
    model: &str,
    known: Option<BTreeMap<String, PyRef<'_, Camera>>>,
    refine_target: bool,
    hold_out: Option<usize>,
    loss: &str,
    weights: &str,
    board_shape: bool,
    measure_target: bool,
    print_scale: Option<PrintScale>,
    distances_mm: Vec<f64>,
) -> PyResult<Rig> {
    let wrong = |what: String| Err(raised::CalibrationError::new_err(what));
    let mut how = How::of(loss, weights, hold_out, distances_mm, print_scale)?;
    (how.board_shape, how.measure_target) = (board_shape, measure_target);
    how.refine_target = refine_target;
    if cameras.len() < 2 && !refine_target {
        return wrong(
            "a rig has at least two cameras; calibrate takes one, and so does refine_target"
                .to_owned(),
        );
    }
    let mut known = known.unwrap_or_default();
    let (mut all, mut target) = (Vec::new(), target);
    for (name, detections) in cameras.iter() {
        let name: String = name.extract()?;
        targets::Name::new(&name)
            .map_err(|error| raised::CalibrationError::new_err(errors::told(&error)))?;
        let detections: Vec<PyRef<'_, Detection>> = detections.extract()?;
        target = target.or_else(|| of_detections(&detections, false));
        let known = known.remove(&name).map(|camera| camera.0.clone());
        let detections = named(py, &detections, None)?;
        let is_same = |one: &deltille::detect::Detection, other: &deltille::detect::Detection| {
            !one.grids.is_empty() && one.grids == other.grids
        };
        for other in &all {
            let OneCamera { name: of, detections: theirs, .. } = other;
            let twice =
                detections.iter().find(|(_, own)| theirs.iter().any(|(_, it)| is_same(own, it)));
            if let Some((picture, _)) = twice {
                return wrong(format!(
                    "{name}: {picture} has the same corners as a picture of {of}"
                ));
            }
        }
        all.push(OneCamera { name, detections, known });
    }
    if let Some(name) = known.keys().next() {
        return wrong(format!("known: there is no camera {name}"));
    }
    let seen = Seen::of(target, None, [None, None], None)?;
    let solved = solve(py, seen, all, ModelChoice::of(model)?, how)?;
    Ok(Rig { solved: Arc::new(solved) })
}
