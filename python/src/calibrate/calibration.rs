//! Calibrations and rigs: files, reports and diagnoses.

use std::path::PathBuf;
use std::sync::Arc;

use deltille::calibrate as solver;
use deltille::camera::CameraFile;
use deltille::export::calibration::Residuals;
use deltille::export::named::named;
use deltille::export::{Placed, RIG_FORMATS, saved};
use deltille::layout::Printing;
use deltille::limits::Limits;
use numpy::PyArray2;
use pyo3::prelude::*;

use super::calibrated_camera::CalibratedCamera;
use super::joint_covariance::JointCovariance;
use super::pickled::{of_text, pickled, restored};
use super::solved::Solved;
use super::views::{Diagnosis, Excluded};
use crate::boundary::arrays::{self, record};
use crate::boundary::errors::{self, Raise, RaiseFile, raised, unlocked};
use crate::boundary::text_file::save_text;
use crate::see::pose::Pose;
use crate::targets::target::{Target, Targets};

/// Standard deviations of a rotation (rad), and of a position across and along the line of sight (mm).
type PoseSd = (f64, f64, f64);

/// A calibrated camera with its diagnoses.
#[pyclass(frozen, extends = CalibratedCamera, module = "deltille")]
pub struct Calibration;

/// A calibrated rig: cameras fixed relative to each other, and their poses.
#[pyclass(frozen, module = "deltille")]
pub struct Rig {
    pub solved: Arc<Solved>,
}

pub fn calibration(solved: Arc<Solved>) -> PyClassInitializer<Calibration> {
    PyClassInitializer::from(CalibratedCamera { solved, index: 0 }).add_subclass(Calibration)
}

macro_rules! whole {
    ($class:ident, $is_rig:literal, $self:ident: $kind:ty => $solved:expr) => {
        #[pymethods]
        impl $class {
            /// The diagnoses of this calibration.
            #[getter]
            fn diagnoses($self: $kind) -> Vec<Diagnosis> {
                let said = $solved.said().into_iter();
                said.map(|(record, is_failure)| Diagnosis { record, is_failure }).collect()
            }

            /// Views and frames that were excluded, and why.
            #[getter]
            fn excluded($self: $kind) -> Vec<Excluded> {
                let one = |out: &solver::Excluded| Excluded {
                    view: out.view.clone(),
                    camera: out.camera.clone(),
                    image: out.image.clone(),
                    panel: out.panel,
                    corners: out.corners,
                    reason: errors::one_line(&out.reason),
                };
                if let Some(file) = $solved.in_file(None) {
                    let all = file["excluded"].as_array().map_or(&[][..], Vec::as_slice);
                    return all.iter().map(Excluded::read).collect();
                }
                $solved.estimate.excluded.iter().map(one).collect()
            }

            /// Standard deviation of unit weight, per axis; covariances are scaled by its square.
            #[getter]
            fn sigma($self: $kind) -> f64 {
                let file = $solved.in_file(None).and_then(|file| file["sigma"].as_f64());
                file.unwrap_or($solved.estimate.sigma)
            }

            /// Standard deviation added to that of every corner, px; ``None`` with equal weights.
            #[getter]
            fn common_px($self: $kind) -> Option<f64> {
                let file = $solved.in_file(None).and_then(|file| file["common_px"].as_f64());
                file.or($solved.estimate.common_px)
            }

            /// Reprojection error in held-out views, px: RMS per axis; ``None`` without held-out views.
            #[getter]
            fn held_out_rms_px($self: $kind) -> Option<f64> {
                if let Some(file) = $solved.in_file(None) {
                    return file["held_out"]["rms_px"].as_f64();
                }
                $solved.estimate.held_out.as_ref().map(|test| test.rms_px)
            }

            /// Estimated shape of the sheet: ``bent_mm``, ``stretched_mm``, ``f_ratio`` (F statistic), ``is_significant``;
            /// ``None`` if it was not estimated.
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

            /// Covariance of all unknowns together; ``None`` if only poses were estimated, or if it was read from a file.
            #[getter]
            fn joint_covariance($self: $kind) -> Option<JointCovariance> {
                $solved.estimate.covariance.clone().map(JointCovariance)
            }

            /// Uncertainty (1σ) of the pose of a target that the calibrated camera or rig estimates.
            ///
            /// Parameters
            /// ----------
            /// target : Target
            ///     The target; it need not be that of the calibration.
            /// distance_mm : float
            ///     Distance of its centre from the camera, mm.
            /// camera : str, optional
            ///     The camera that sees the target; by default the first one. Other cameras of a rig contribute where they see the
            ///     target too.
            ///
            /// Returns
            /// -------
            /// tuple of two tuples of three floats, or None
            ///     Standard deviations of the rotation (rad, RMS of three axes), and of the position of the centre across (RMS of two
            ///     directions) and along the line of sight (mm): from the calibration; and from noise of the pixels, for each px of noise
            ///     per coordinate. RMS values over positions of the centre where corners were detected, with the whole
            ///     target in the image, tilted by 30°.
            ///     ``None`` if not known, or if there are no such positions.
            #[pyo3(signature = (target, distance_mm, camera=None))]
                    fn target_pose_sd(
                $self: $kind,
                target: &Target,
                distance_mm: f64,
                camera: Option<&str>,
            ) -> PyResult<Option<(PoseSd, PoseSd)>> {
                let distance_mm = arrays::distance(Some(distance_mm))?.unwrap_or_default();
                let camera = camera.map_or(Ok(0), |name| camera_index(&$solved, name))?;
                let target = &target.printing.target;
                let found = $solved.estimate.pose_uncertainty(camera, target, distance_mm);
                let sd = |of: solver::PoseSd| (of.rotation_rad, of.across_mm, of.along_mm);
                Ok(found.map(|found| (sd(found.calibration), sd(found.per_px))))
            }

            /// Returns the text of its file.
            ///
            /// Parameters
            /// ----------
            /// residuals : bool, optional
            ///     List every corner. A loaded calibration is written unchanged.
            ///
            /// Returns
            /// -------
            /// str
            #[pyo3(signature = (*, residuals = false))]
            fn to_json($self: $kind, residuals: bool) -> PyResult<String> {
                text_of(&$solved, residuals)
            }

            /// Writes an HTML report on the quality of the calibration and possible improvements.
            ///
            /// Parameters
            /// ----------
            /// path : path-like
            ///     An ``.html`` file.
            /// title : str, optional
            /// overwrite : bool, optional
            ///     Replace an existing file even if it is of another kind.
            ///
            /// Returns
            /// -------
            /// pathlib.Path
            #[pyo3(signature = (path, *, title = None, overwrite = false))]
            fn report(
                $self: $kind,
                py: Python<'_>,
                path: PathBuf,
                title: Option<&str>,
                overwrite: bool,
            ) -> PyResult<PathBuf> {
                if path.extension().is_none_or(|end| end != "html") {
                    let what = format!("{} must end in .html", path.display());
                    return Err(raised::FileError::new_err(what));
                }
                let solved = $solved.clone();
                solved.check_whole()?;
                let usual = if $is_rig { "rig" } else { "camera" };
                let title = title.unwrap_or(usual).to_owned();
                let page = unlocked(py, move || solved.page(&title).html())?;
                save_text(path, page, overwrite)
            }

            /// Returns what to improve, the most important first: the warnings and hints of :meth:`report`.
            ///
            /// Returns
            /// -------
            /// list of str
            fn remedies($self: $kind, py: Python<'_>) -> PyResult<Vec<String>> {
                let solved = $solved.clone();
                solved.check_whole()?;
                unlocked(py, move || solved.page("").remedies())
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
    ///     The target, needed for :attr:`ids`.
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
    ///     A ``.json`` file, or a file of another program.
    /// format : str, optional
    ///     ``"json"``, which :meth:`load` reads back, or a format of :meth:`Camera.save`; ``"nerfstudio"`` includes the poses
    ///     of the views.
    /// residuals : bool, optional
    ///     List every corner in the ``.json``.
    /// overwrite : bool, optional
    ///     Replace an existing file even if it is of another kind.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, format = "json", *, residuals = false, overwrite = false))]
    fn save(
        slf: PyRef<'_, Self>,
        path: PathBuf,
        format: &str,
        residuals: bool,
        overwrite: bool,
    ) -> PyResult<PathBuf> {
        let own = slf.as_super();
        let text = match format {
            "json" => text_of(&own.solved, residuals)?,
            "own" => {
                let camera = own.estimate().camera.clone();
                let calibrated_with = own.solved.estimate.calibrated_with.clone();
                let failed = saved::failures(&text_of(&own.solved, false)?).into_iter().next();
                CameraFile { camera, calibrated_with, failed }.to_yaml()
            }
            _ => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let camera = own.estimate();
                let views = camera.views.iter().map(|view| (view.image.as_str(), view.pose));
                own.camera().text(format, &stem, &views.collect::<Vec<_>>())?
            }
        };
        save_text(path, text, overwrite)
    }

    /// The target with measured corner positions; ``None`` if they were not measured.
    #[getter]
    fn measured_target(slf: PyRef<'_, Self>) -> PyResult<Option<Target>> {
        let solved = &slf.as_super().solved;
        let found = solved.estimate.map.as_ref().zip(solved.targets.first());
        let measured = found.map(|(map, printing)| Printing {
            target: map.on(&printing.target),
            ..printing.clone()
        });
        measured.map(|printing| Target::with_family(printing, None)).transpose()
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        slf.as_super().__repr__().replace("CalibratedCamera ", "Calibration ")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String, Vec<String>)> {
        pickled(slf.py(), "_calibration", &slf.as_super().get().solved)
    }

    fn __eq__(slf: PyRef<'_, Self>, other: PyRef<'_, Self>) -> bool {
        slf.as_super().solved.is_same(&other.as_super().solved)
    }
}

/// Restores a pickled calibration.
#[pyfunction]
pub fn _calibration(py: Python<'_>, json: &str, targets: Vec<String>) -> PyResult<Py<Calibration>> {
    Py::new(py, calibration(Arc::new(restored(json, &targets)?)))
}

/// Restores a pickled rig.
#[pyfunction]
pub fn _rig(json: &str, targets: Vec<String>) -> PyResult<Rig> {
    Ok(Rig { solved: Arc::new(restored(json, &targets)?) })
}

#[pymethods]
impl Rig {
    /// Reads a rig: the ``.json`` of :meth:`save` or of ``deltille rig``.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    /// target : Target or sequence of Target, optional
    ///     The target, needed for the ids of the corners.
    ///
    /// Returns
    /// -------
    /// Rig
    #[staticmethod]
    #[pyo3(signature = (path, *, target = None))]
    fn load(path: PathBuf, target: Option<Targets>) -> PyResult<Self> {
        Ok(Self { solved: Arc::new(read(&path, target, true)?) })
    }

    /// The cameras by their names, in the given order; the first defines the frame of the rig.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let all = pyo3::types::PyDict::new(py);
        for index in 0..self.solved.estimate.cameras.len() {
            let camera = CalibratedCamera { solved: self.solved.clone(), index };
            all.set_item(camera.name().to_owned(), Py::new(py, camera)?)?;
        }
        Ok(all)
    }

    /// Names of the frames: times at which images were taken.
    #[getter]
    fn frames(&self) -> Vec<String> {
        self.solved.estimate.frames.iter().map(|frame| frame.name.clone()).collect()
    }

    /// Pose of the target in each frame: rig from target.
    #[getter]
    fn poses(&self) -> Vec<Pose> {
        self.solved.estimate.frames.iter().map(|frame| Pose(frame.rig_from_target)).collect()
    }

    /// Standard deviations of these poses, frames × 6, float64: rotation about (rad) and
    /// translation along (mm) the rig's axes.
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.solved.estimate.frames.iter().map(|frame| frame.pose_sd))
    }

    /// Computes the uncertainty of distances that two cameras measure by triangulation.
    ///
    /// Parameters
    /// ----------
    /// first, second : str
    ///     Names of the cameras.
    /// distance_mm : float
    ///     Distance of the points from the first camera, mm.
    ///
    /// Returns
    /// -------
    /// tuple of two floats, or None
    ///     Standard deviation from the calibration, mm; and from noise of the pixels, mm for each px of noise per
    ///     coordinate: RMS values over points that both cameras see, where the first one detected corners. ``None`` if not
    ///     known, or if there are no such points.
    fn depth_sd(
        &self,
        first: &str,
        second: &str,
        distance_mm: f64,
    ) -> PyResult<Option<(f64, f64)>> {
        let distance_mm = arrays::distance(Some(distance_mm))?.unwrap_or_default();
        let pair = [camera_index(&self.solved, first)?, camera_index(&self.solved, second)?];
        let found = self.solved.estimate.depth_uncertainty(pair, distance_mm);
        Ok(found.map(|found| (found.sd_mm, found.mm_per_px)))
    }

    /// Reprojection error over all corners, px: RMS per axis.
    #[getter]
    fn rms_px(&self) -> f64 {
        let file = self.solved.in_file(None).and_then(|file| file["rms_px"].as_f64());
        file.unwrap_or(self.solved.estimate.rms_px)
    }

    /// The targets with refined panel poses or measured corners; empty if neither was estimated.
    #[getter]
    fn refined_targets(&self) -> PyResult<Vec<Target>> {
        let estimate = &self.solved.estimate;
        let all = self.solved.targets.iter().enumerate();
        let refined = all.filter_map(|(index, printing)| {
            let target = &printing.target;
            let found = match self.solved.targets.len() {
                1 => estimate.clone(),
                _ => estimate.of_target(index),
            };
            let refined = found.has_refined_panels().then(|| found.refined(target));
            let measured = found.map.as_ref().map(|map| map.on(refined.as_ref().unwrap_or(target)));
            let target = measured.or(refined)?;
            Some(Printing { target, ..printing.clone() })
        });
        refined.map(|printing| Target::with_family(printing, None)).collect()
    }

    /// Writes the rig.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     A ``.json`` file, or a file of another program.
    /// format : str, optional
    ///     ``"json"``, which :meth:`load` reads back, or one for other programs, such as ``"kalibr"``.
    /// residuals : bool, optional
    ///     List every corner in the ``.json``.
    /// overwrite : bool, optional
    ///     Replace an existing file even if it is of another kind.
    ///
    /// Returns
    /// -------
    /// pathlib.Path
    #[pyo3(signature = (path, format = "json", *, residuals = false, overwrite = false))]
    fn save(
        &self,
        path: PathBuf,
        format: &str,
        residuals: bool,
        overwrite: bool,
    ) -> PyResult<PathBuf> {
        let estimate = &self.solved.estimate;
        let text = if format == "json" {
            text_of(&self.solved, residuals)?
        } else {
            let files = RIG_FORMATS.iter().flat_map(|format| format.files);
            let file = named(files, format).map_err(|what| {
                raised::CameraError::new_err(what.replacen("known: ", "known: json, ", 1))
            })?;
            let found = estimate.cameras.iter();
            let placed = found.map(|found| (&*found.name, &found.camera, found.camera_from_rig));
            let placed: Vec<Placed> = placed.collect();
            file.text(&placed, &estimate.overlaps()).raise(errors::camera)?
        };
        save_text(path, text, overwrite)
    }

    fn __repr__(&self) -> String {
        let found = &self.solved.estimate;
        let (cameras, frames) = (found.cameras.len(), found.frames.len());
        format!("<Rig: {cameras} cameras, {frames} frames, rms {:.4} px>", found.rms_px)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String, Vec<String>)> {
        pickled(slf.py(), "_rig", &slf.get().solved)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.solved.is_same(&other.solved)
    }
}

impl Rig {
    /// Returns the camera with a name.
    pub fn named(&self, name: &str) -> PyResult<&solver::CameraEstimate> {
        Ok(&self.solved.estimate.cameras[camera_index(&self.solved, name)?])
    }
}

/// Returns the index of a camera.
fn camera_index(solved: &Solved, name: &str) -> PyResult<usize> {
    let cameras = &solved.estimate.cameras;
    let index = cameras.iter().position(|camera| camera.name == name);
    index.ok_or_else(|| {
        let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        let names = names.join(", ");
        raised::CalibrationError::new_err(format!("no camera is named {name} (cameras: {names})"))
    })
}

/// Returns the text of a file, with its corners if requested.
fn text_of(solved: &Solved, residuals: bool) -> PyResult<String> {
    if residuals && !solved.has_corners() {
        let what = "residuals: the loaded file contains none; save with residuals=True right after calibrating";
        return Err(errors::calibration(what.to_owned()));
    }
    let listed = if residuals { Residuals::Listed } else { Residuals::Omitted };
    Ok(solved.json(listed))
}

fn read(path: &std::path::Path, target: Option<Targets>, is_rig: bool) -> PyResult<Solved> {
    let text = Limits::default().read_text(path).raise_of_file(path, errors::file)?;
    let targets = target.map(|targets| targets.0).unwrap_or_default();
    let targets = targets.iter().map(|target| (*target.printing).clone()).collect();
    let wrong = |what: String| raised::FileError::new_err(format!("{}: {what}", path.display()));
    let solved = of_text(&text, targets).map_err(|error| wrong(errors::one_line(&error)))?;
    if is_rig && !solved.is_rig {
        return Err(wrong("this is a calibration of one camera; use Calibration.load".to_owned()));
    }
    if !is_rig && solved.is_rig {
        return Err(wrong("this is a rig; use Rig.load".to_owned()));
    }
    Ok(solved)
}
