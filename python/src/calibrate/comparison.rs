//! Tests whether two calibrations differ, and estimates the pose of a target.

use std::sync::Arc;

use deltille::calibrate::{
    self, CameraEstimate, CameraMotion, Diagnosis, Estimate, Messages, Reference, Region,
    compare_boards, views,
};
use deltille::export::comparison;
use deltille::export::pose::PoseFormat;
use deltille::export::sheet::Sheet;
use deltille::glam::DVec2;
use deltille::targets::TargetIdentity;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use super::calibrated_camera::CalibratedCamera;
use super::calibration::Rig;
use super::solved::Solved;
use super::solving::print_scale_of;
use crate::boundary::arrays::{self, distance};
use crate::boundary::errors::{self, Raise, raised, unlocked};
use crate::see::camera::{AnyCamera, Camera};
use crate::see::detection::Detection;
use crate::see::pose::Pose;
use crate::targets::target::{Target, Targets};

/// A calibrated or given camera.
pub struct Compared(Estimate);

impl Compared {
    fn of(cameras: Vec<CameraEstimate>, calibrated_with: &[TargetIdentity]) -> Self {
        let mut estimate = Estimate::default();
        (estimate.cameras, estimate.calibrated_with) = (cameras, calibrated_with.to_vec());
        Self(estimate)
    }

    /// Takes the cameras of a calibration. If it failed, their uncertainties are omitted, because
    /// they are then unreliable.
    fn of_solved(mut cameras: Vec<CameraEstimate>, solved: &Solved) -> Self {
        if solved.said().iter().any(|(_, is_failure)| *is_failure) {
            cameras.iter_mut().for_each(CameraEstimate::forget_uncertainties);
        }
        Self::of(cameras, &solved.estimate.calibrated_with)
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Compared {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(rig) = given.cast::<Rig>() {
            let solved = &rig.get().solved;
            return Ok(Self::of_solved(solved.estimate.cameras.clone(), solved));
        }
        if let Ok(found) = given.cast::<CalibratedCamera>() {
            let found = found.get();
            return Ok(Self::of_solved(vec![found.estimate().clone()], &found.solved));
        }
        let camera = given.cast::<Camera>()?;
        Ok(Self::of(vec![CameraEstimate::given("", camera.get().0.clone())], &[]))
    }
}

/// The image region in which cameras are compared.
#[derive(FromPyObject)]
pub enum Part {
    Name(String),
    Within([f64; 4]),
}

impl Part {
    fn region(self) -> PyResult<Region> {
        match self {
            Self::Within([left, top, right, bottom]) if left < right && top < bottom => {
                Ok(Region::Within(DVec2::new(left, top), DVec2::new(right, bottom)))
            }
            Self::Name(name) if name == "seen" => Ok(Region::Seen),
            Self::Name(name) if name == "image" => Ok(Region::Image),
            _ => {
                let what =
                    "invalid region (known: seen, image, or (left, top, right, bottom) in px)";
                Err(raised::CalibrationError::new_err(what))
            }
        }
    }
}

/// How two calibrations of a camera differ over its image.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Comparison {
    name: String,
    found: calibrate::Comparison,
}

#[pymethods]
impl Comparison {
    /// Name of the camera.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// RMS difference per axis, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.found.rms_px
    }

    /// RMS difference per axis expected from the uncertainties of both, px; ``None`` if they are not known.
    #[getter]
    fn expected_px(&self) -> Option<f64> {
        self.found.expected_px
    }

    /// The largest difference, px.
    #[getter]
    fn largest_px(&self) -> f64 {
        self.found.largest_px()
    }

    /// Probability (p-value) that noise alone causes a difference of at least this size, if the
    /// camera is unchanged.
    #[getter]
    fn p_value(&self) -> Option<f64> {
        self.found.p_value
    }

    /// Why the significance of the difference is not known, as a sentence; ``None`` if it is.
    #[getter]
    fn why_undecided(&self) -> Option<&'static str> {
        self.found.why_undecided()
    }

    /// Whether they differ significantly; ``None`` if uncertainties are not known.
    #[getter]
    fn is_significant(&self) -> Option<bool> {
        self.found.is_significant()
    }

    /// Motion of the first camera that is compensated before comparing: a rotation, and a translation for points at a
    /// finite distance.
    #[getter]
    fn second_from_first(&self) -> Pose {
        Pose(self.found.second_from_first)
    }

    /// Positions compared in the first image, N × 2, float64, px.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.found.compared().map(|place| place.pixel.to_array()))
    }

    /// Differences of the second camera at these positions, N × 2, float64, px.
    #[getter]
    fn differences<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::rows(py, self.found.compared().map(|place| place.by.to_array()))
    }

    /// Standard deviations per axis from the uncertainties of both, N, float64, px; NaN if not known.
    #[getter]
    fn sd_px<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.found.compared().map(|place| place.sd_px.unwrap_or(f64::NAN)))
    }

    /// Returns the text that ``deltille compare`` writes.
    fn to_json(&self) -> String {
        comparison::write(&[&self.name], std::slice::from_ref(&self.found), &[])
    }

    fn __repr__(&self) -> String {
        let significance = significance(self.found.is_significant());
        format!("<Comparison: {:.4} px rms{significance}>", self.found.rms_px)
    }
}

fn significance(is_significant: Option<bool>) -> &'static str {
    match is_significant {
        Some(true) => ", significant",
        Some(false) => ", not significant",
        None => ", significance unknown",
    }
}

/// Motion of a camera of a rig between two calibrations.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Motion(CameraMotion);

#[pymethods]
impl Motion {
    /// Name of the reference camera.
    #[getter]
    fn of_frame(&self) -> &str {
        &self.0.from
    }

    /// Name of the camera that moved.
    #[getter]
    fn name(&self) -> &str {
        &self.0.to
    }

    /// Rotation about its axes, 3, float64, rad.
    #[getter]
    fn rotation_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.rotation_rad.to_array())
    }

    /// Translation along its axes, 3, float64, mm.
    #[getter]
    fn translation_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::column(py, self.0.translation_mm.to_array())
    }

    /// Probability (p-value) that noise alone causes a motion of at least this size; ``None`` if
    /// uncertainties are not known.
    #[getter]
    fn p_value(&self) -> Option<f64> {
        self.0.p_value
    }

    /// Why the significance of the motion is not known, as a sentence; ``None`` if it is.
    #[getter]
    fn why_undecided(&self) -> Option<&'static str> {
        self.0.why_undecided()
    }

    /// Whether it moved significantly; ``None`` if uncertainties are not known.
    #[getter]
    fn is_significant(&self) -> Option<bool> {
        self.0.is_significant()
    }

    fn __repr__(&self) -> String {
        let CameraMotion { from, to, rotation_rad, translation_mm, .. } = &self.0;
        let (turn, moved) = (rotation_rad.length(), translation_mm.length());
        let significance = significance(self.0.is_significant());
        format!("<Motion of {to} relative to {from}: {turn:.6} rad, {moved:.4} mm{significance}>")
    }
}

fn compared(
    py: Python<'_>,
    pairs: &[(&CameraEstimate, &CameraEstimate)],
    distance_mm: Option<f64>,
    region: Region,
) -> PyResult<Vec<Comparison>> {
    let distance_mm = distance(distance_mm)?;
    let found = unlocked(py, || {
        let one = |(one, other): &(&CameraEstimate, &CameraEstimate)| {
            calibrate::Comparison::of(one, other, distance_mm, region)
        };
        pairs.iter().map(one).collect::<Result<Vec<_>, _>>()
    })?;
    let found = found.raise(errors::calibration)?;
    let named = pairs.iter().zip(found);
    Ok(named.map(|((one, _), found)| Comparison { name: one.name.clone(), found }).collect())
}

/// Tests whether two calibrations of a camera differ significantly.
///
/// Parameters
/// ----------
/// first, second : Calibration, CalibratedCamera or Camera
///     A :class:`Camera` has no known uncertainty.
/// distance_mm : float, optional
///     Distance of the points compared, mm; defaults to infinity.
/// region : str or (float, float, float, float), optional
///     ``"seen"``, where both observed corners (default), ``"image"``, or pixels left, top, right, bottom.
/// assume_target : bool, optional
///     Compare even if both were calibrated with the same tags at different sizes.
///
/// Returns
/// -------
/// Comparison
#[pyfunction]
#[pyo3(signature = (first, second, *, distance_mm = None, region = None, assume_target = false))]
pub fn compare(
    py: Python<'_>,
    first: Compared,
    second: Compared,
    distance_mm: Option<f64>,
    region: Option<Part>,
    assume_target: bool,
) -> PyResult<Comparison> {
    let region = region.map_or(Ok(Region::Seen), Part::region)?;
    let (Compared(mut first), Compared(mut second)) = (first, second);
    compare_boards(["first", "second"], [&mut first, &mut second], assume_target)
        .raise(errors::calibration)?;
    let ([one], [other]) = (first.cameras.as_slice(), second.cameras.as_slice()) else {
        let what = "use compare_rigs to compare rigs";
        return Err(raised::CalibrationError::new_err(what));
    };
    Ok(compared(py, &[(one, other)], distance_mm, region)?.remove(0))
}

/// Tests whether two calibrations of a rig differ significantly: cameras of the same name, and their poses.
///
/// Parameters
/// ----------
/// first, second : Rig
/// distance_mm, region, assume_target
///     See :func:`compare`.
///
/// Returns
/// -------
/// cameras : list of Comparison
/// motions : list of Motion
#[pyfunction]
#[pyo3(signature = (first, second, *, distance_mm = None, region = None, assume_target = false))]
pub fn compare_rigs(
    py: Python<'_>,
    first: PyRef<'_, Rig>,
    second: PyRef<'_, Rig>,
    distance_mm: Option<f64>,
    region: Option<Part>,
    assume_target: bool,
) -> PyResult<(Vec<Comparison>, Vec<Motion>)> {
    let region = region.map_or(Ok(Region::Seen), Part::region)?;
    let of = |rig: &Rig| Compared::of_solved(rig.solved.estimate.cameras.clone(), &rig.solved).0;
    let (mut first, mut second) = (of(&first), of(&second));
    compare_boards(["first", "second"], [&mut first, &mut second], assume_target)
        .raise(errors::calibration)?;
    let others = &second.cameras;
    let same = |one: &&CameraEstimate| others.iter().any(|other| other.name == one.name);
    let own = first.cameras.iter().filter(same);
    let pairs =
        own.filter_map(|one| Some((one, others.iter().find(|other| other.name == one.name)?)));
    let pairs: Vec<_> = pairs.collect();
    if pairs.is_empty() {
        let what = "the rigs have no camera name in common; pass two calibrations of the same rig";
        return Err(raised::CalibrationError::new_err(what));
    }
    let found = compared(py, &pairs, distance_mm, region)?;
    Ok((found, CameraMotion::of_rig(&pairs).into_iter().map(Motion).collect()))
}

/// Pose of a target in an image of a known camera.
#[pyclass(frozen, module = "deltille")]
pub struct Located {
    asked: Asked,
    estimate: Option<Arc<calibrate::Estimate>>,
    why: Option<String>,
    warnings: Vec<String>,
    image: String,
    target: String,
}

/// The inputs of a pose.
#[derive(Clone, PartialEq)]
struct Asked {
    detection: Detection,
    camera: Camera,
    target: Target,
    print_scale: Option<[f64; 2]>,
}

impl Located {
    fn view(&self) -> Option<&calibrate::ViewEstimate> {
        self.estimate.as_ref()?.cameras.first()?.views.first()
    }
}

#[pymethods]
impl Located {
    /// Camera from target; ``None`` if it is not known.
    #[getter]
    fn pose(&self) -> Option<Pose> {
        self.view().map(|view| Pose(view.pose))
    }

    /// Standard deviations of the pose, 6, float64: rotation about (rad) and translation along (mm)
    /// the camera's axes.
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let frame = self.estimate.as_ref()?.frames.first()?;
        Some(arrays::column(py, frame.pose_sd))
    }

    /// Why there is no pose, as a sentence; ``None`` if there is one.
    #[getter]
    fn why(&self) -> Option<&str> {
        self.why.as_deref()
    }

    /// Warnings about the pose, in sentences.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Reprojection error, px: RMS per axis; NaN without a pose.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.view().map_or(f64::NAN, |view| view.rms_px)
    }

    /// Residuals of the corners, N × 2, float64, px: detected minus predicted position.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let corners = self.view().into_iter().flat_map(|view| &view.corners);
        arrays::rows(py, corners.map(|corner| corner.residual.to_array()))
    }

    /// Returns the line that ``deltille pose`` writes.
    fn to_json(&self) -> String {
        let found = self.estimate.as_ref().zip(self.view());
        let time_ns = self.asked.detection.found.time_ns;
        match found {
            Some((estimate, view)) => {
                PoseFormat::JsonLines.line(estimate, view, time_ns, self.asked.target.target())
            }
            None => {
                let why = self.why.as_deref().unwrap_or_default();
                PoseFormat::JsonLines.line_without(&self.image, time_ns, &self.target, why)
            }
        }
    }

    fn __bool__(&self) -> bool {
        self.estimate.is_some()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.asked == other.asked
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> crate::Reduced<'py, (Detection, Camera, Target, Option<[f64; 2]>)> {
        let restore = slf.py().import("deltille._core")?.getattr("_located")?;
        let Asked { detection, camera, target, print_scale } = slf.get().asked.clone();
        Ok((restore, (detection, camera, target, print_scale)))
    }

    fn __repr__(&self) -> String {
        match (self.view(), &self.why) {
            (Some(view), _) => {
                format!("<Located {}, rms {:.4} px>", Pose(view.pose).text(), view.rms_px)
            }
            (None, why) => format!("<Located without pose: {}>", why.as_deref().unwrap_or("")),
        }
    }
}

/// Estimates the pose of a target in an image of a known camera.
///
/// Parameters
/// ----------
/// detection : Detection
///     The detections in the image.
/// camera : Camera or CalibratedCamera
///     The camera that took it.
/// target : Target, optional
///     The target; defaults to that of the detection.
/// print_scale : float or (float, float), optional
///     Measured length of the check bars over the nominal one, across and up the sheet.
/// assume_target : bool, optional
///     Use the target even if the detection names another one.
///
/// Returns
/// -------
/// Located
///     If there is no pose, :attr:`Located.why` gives the reason.
#[pyfunction]
#[pyo3(name = "pose", signature = (detection, camera, target = None, *, print_scale = None,
    assume_target = false))]
pub fn pose_of(
    py: Python<'_>,
    detection: PyRef<'_, Detection>,
    camera: AnyCamera,
    target: Option<Targets>,
    print_scale: Option<&Bound<'_, PyAny>>,
    assume_target: bool,
) -> PyResult<Located> {
    let targets = target.map_or_else(|| detection.targets.clone(), |targets| targets.0);
    let wrong = |what: &str| Err(raised::CalibrationError::new_err(what.to_owned()));
    let [target] = targets.as_slice() else {
        return match targets.is_empty() {
            true => wrong("target is missing, and the detection has none"),
            false => wrong("the detection has several targets; pass the one to locate"),
        };
    };
    let print_scale = print_scale.map(print_scale_of).transpose()?;
    let mut detection = detection.clone();
    let reference = Reference::Target(target.target());
    if assume_target {
        Arc::make_mut(&mut detection.found).assume_targets(&[target.target().identity()]);
    }
    for grid in &detection.found.grids {
        reference.check_labels(&detection.found, grid).raise(errors::calibration)?;
    }
    let (camera, target) = (Camera(camera.0), target.clone());
    Asked { detection, camera, target, print_scale }.located(py)
}

/// Restores a pickled pose by estimating it again.
#[pyfunction]
pub fn _located(
    py: Python<'_>,
    detection: &Detection,
    camera: &Camera,
    target: &Target,
    print_scale: Option<[f64; 2]>,
) -> PyResult<Located> {
    let (detection, camera, target) = (detection.clone(), camera.clone(), target.clone());
    Asked { detection, camera, target, print_scale }.located(py)
}

impl Asked {
    fn located(self, py: Python<'_>) -> PyResult<Located> {
        unlocked(py, || self.solve())?
    }

    fn solve(self) -> PyResult<Located> {
        let (found, printing) = (&self.detection.found, self.target.printing.clone());
        let sheets = printing.sheets.clone();
        let sheet = Sheet { print_scale: self.print_scale, shape: None, sheets };
        let target = &printing.target;
        let reference = Reference::Target(target);
        let name = if found.image.is_empty() { "the image" } else { &found.image };
        let named = [(name.to_owned(), (**found).clone())];
        let of = |why: Option<String>, estimate: Option<calibrate::Estimate>, warnings| Located {
            estimate: estimate.map(Arc::new),
            why,
            warnings,
            image: found.image.clone(),
            target: target.name.to_string(),
            asked: self.clone(),
        };
        let nowhere = |why: String| of(Some(why), None, Vec::new());
        let mut views = match views(&named, &reference) {
            Ok(shown) => shown.views,
            Err(error) => return Ok(nowhere(errors::one_line(&error))),
        };
        sheet.put_on(Some(target), &mut views).raise(errors::calibration)?;
        let panels = sheet.panels(&reference).raise(errors::calibration)?;
        let camera = self.camera.0.clone();
        let calibration = calibrate::Calibration::new(panels).camera("", views, camera);
        match calibration.located(found).raise(errors::calibration)? {
            Err(why) => Ok(nowhere(errors::one_line(&why))),
            Ok(estimate) => {
                let words = Messages::new(&estimate, None);
                let is_of_picture =
                    |said: &&Diagnosis| !matches!(said, Diagnosis::NonMonotonicLens { .. });
                let said = estimate.diagnose();
                let said = said.iter().filter(is_of_picture).map(|said| words.sentence(said));
                let warnings = said.collect();
                Ok(of(None, Some(estimate), warnings))
            }
        }
    }
}
