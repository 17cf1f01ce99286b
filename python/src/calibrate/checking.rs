//! Tests whether cameras are still as calibrated, from a few new detections.

use deltille::calibrate::{
    self, Calibration, CameraEstimate, CameraViews, Estimate, Model, Reference, views,
};
use deltille::export::check;
use deltille::targets::Target;
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use super::calibrated_camera::CalibratedCamera;
use super::calibration::Rig;
use super::keywords::of_detections;
use super::solved::Solved;
use super::solving::{How, Named, Seen, assume, named};
use crate::boundary::errors;
use crate::boundary::errors::{Raise, raised, unlocked};
use crate::see::arguments::Results;
use crate::see::detector::sides;
use crate::targets::target::Targets;

/// A quantity that may have changed, of a camera if there are several.
#[pyclass(frozen, eq, hash, module = "deltille")]
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Suspect {
    camera: String,
    quantity: &'static str,
}

#[pymethods]
impl Suspect {
    /// Name of the camera; empty for a single camera, and for the board.
    #[getter]
    fn camera(&self) -> &str {
        &self.camera
    }

    /// ``"focal_length"``, ``"principal_point"``, ``"distortion"``, ``"pose"`` (on the rig), ``"board"``,
    /// ``"resolution"``, ``"crop"`` or ``"orientation"``.
    #[getter]
    fn quantity(&self) -> &'static str {
        self.quantity
    }

    fn __repr__(&self) -> String {
        match self.camera.as_str() {
            "" => format!("<Suspect {}>", self.quantity),
            camera => format!("<Suspect {} of {camera}>", self.quantity),
        }
    }
}

impl From<&calibrate::Suspect> for Suspect {
    fn from(of: &calibrate::Suspect) -> Self {
        Self { camera: of.camera.clone(), quantity: of.quantity.name() }
    }
}

/// The test of one quantity.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct QuantityTest(calibrate::QuantityTest);

#[pymethods]
impl QuantityTest {
    /// The quantity.
    #[getter]
    fn of(&self) -> Suspect {
        Suspect::from(&self.0.of)
    }

    /// Unit of the changes: ``"%"``, ``"px"`` or ``"mm"``.
    #[getter]
    fn unit(&self) -> &'static str {
        self.0.of.quantity.unit()
    }

    /// Estimated change if only this quantity changed: signed for the focal length, otherwise a length.
    #[getter]
    fn change(&self) -> f64 {
        self.0.change
    }

    /// Probability that an unchanged camera and board show at least this change.
    #[getter]
    fn p_value(&self) -> f64 {
        self.0.p_value
    }

    /// Change that would have been found with a probability of 90 %; infinite if none.
    #[getter]
    fn detectable(&self) -> f64 {
        self.0.detectable
    }

    /// Largest value of ``detectable`` for the answer ``"unchanged"``; ``None`` if any suffices.
    #[getter]
    fn limit(&self) -> Option<f64> {
        self.0.limit
    }

    fn __repr__(&self) -> String {
        let (of, unit) = (self.0.of.to_string(), self.unit());
        format!("<QuantityTest {of}: {:.4} {unit}, p = {:.3}>", self.0.change, self.0.p_value)
    }
}

/// Whether a camera or a rig is still as calibrated, and the evidence.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Check(calibrate::Check);

#[pymethods]
impl Check {
    /// ``"unchanged"``, ``"changed"`` or ``"cannot_tell"``.
    #[getter]
    fn answer(&self) -> &'static str {
        self.0.answer.name()
    }

    /// What has changed: these quantities together. Empty if nothing has.
    #[getter]
    fn changed(&self) -> Vec<Suspect> {
        self.0.changed.iter().map(Suspect::from).collect()
    }

    /// Other quantities, each of which alone explains the detections as well as ``changed``.
    #[getter]
    fn alternatives(&self) -> Vec<Suspect> {
        self.0.or.iter().map(Suspect::from).collect()
    }

    /// Why there is no answer, in sentences.
    #[getter]
    fn missing(&self) -> Vec<String> {
        self.0.missing.iter().map(ToString::to_string).collect()
    }

    /// The tests of single quantities.
    #[getter]
    fn tests(&self) -> Vec<QuantityTest> {
        self.0.tests.iter().cloned().map(QuantityTest).collect()
    }

    /// Probability that unchanged cameras and an unchanged board differ at least as much in all quantities together;
    /// ``None`` without tests.
    #[getter]
    fn p_value(&self) -> Option<f64> {
        self.0.p_value
    }

    /// Number of views that were used.
    #[getter]
    fn views(&self) -> usize {
        self.0.views
    }

    /// Number of corners that were used.
    #[getter]
    fn corners(&self) -> usize {
        self.0.corners
    }

    /// RMS residual of the best fit per axis, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.0.rms_px
    }

    /// Names of two cameras whose detections contradict the calibration, and agree with it if they are exchanged; ``None``
    /// if there are none.
    #[getter]
    fn exchanged(&self) -> Option<(&str, &str)> {
        self.0.exchanged.as_ref().map(|[a, b]| (a.as_str(), b.as_str()))
    }

    /// Returns the text that ``deltille check -o`` writes.
    fn to_json(&self) -> String {
        check::write(&self.0)
    }

    fn __repr__(&self) -> String {
        format!("<Check {}, {} views>", self.answer(), self.0.views)
    }
}

/// Tests whether a camera or a rig is still as calibrated, from one or a few new detections of a target.
///
/// Parameters
/// ----------
/// calibration : Calibration, CalibratedCamera or Rig
///     The calibration, with observed uncertainties.
/// detections : sequence of Detection, or dict of str to sequence of Detection
///     New detections; for a rig those of each camera. Images of a rig taken at the same time have the same name.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// grid, rows, cols, edge_mm
///     An untagged board instead of a target, see :func:`calibrate`; rows and columns are required.
/// print_scale : float or (float, float), optional
///     Measured length of the check bars over the nominal one, across and up the sheet.
/// assume_target : bool, optional
///     Use the target even if the detections name another one.
/// board_accuracy_mm : float, optional
///     Standard deviation of the board's corners from the description, mm; defaults to that of a measured target,
///     otherwise to 0.1, but at most 0.5 % of an edge.
///
/// Returns
/// -------
/// Check
///
/// Raises
/// ------
/// CalibrationError
///     If the detections do not belong to the target or to the cameras of the rig.
#[pyfunction]
#[pyo3(name = "check", signature = (calibration, detections, target = None, *, grid = None, rows = None, cols = None,
    edge_mm = None, print_scale = None, assume_target = false, board_accuracy_mm = None))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn check_of(
    py: Python<'_>,
    calibration: &Bound<'_, PyAny>,
    detections: &Bound<'_, PyAny>,
    target: Option<Targets>,
    grid: Option<&str>,
    rows: Option<i64>,
    cols: Option<i64>,
    edge_mm: Option<f64>,
    print_scale: Option<&Bound<'_, PyAny>>,
    assume_target: bool,
    board_accuracy_mm: Option<f64>,
) -> PyResult<Check> {
    let of_board = OfBoard {
        target,
        grid,
        rows,
        cols,
        edge_mm,
        print_scale,
        assume_target,
        board_accuracy_mm,
    };
    let (before, views, _) = new_views(py, calibration, detections, of_board)?;
    unlocked(py, move || Check(views.check(&before)))
}

/// The target of new detections, as keywords.
pub(super) struct OfBoard<'a, 'py> {
    pub target: Option<Targets>,
    pub grid: Option<&'a str>,
    pub rows: Option<i64>,
    pub cols: Option<i64>,
    pub edge_mm: Option<f64>,
    pub print_scale: Option<&'a Bound<'py, PyAny>>,
    pub assume_target: bool,
    pub board_accuracy_mm: Option<f64>,
}

/// The earlier calibration, a calibration with the views of new detections, and their target.
pub(super) fn new_views(
    py: Python<'_>,
    calibration: &Bound<'_, PyAny>,
    detections: &Bound<'_, PyAny>,
    of_board: OfBoard<'_, '_>,
) -> PyResult<(Estimate, Calibration, Target)> {
    let OfBoard {
        mut target,
        grid,
        rows,
        cols,
        edge_mm,
        print_scale,
        assume_target,
        board_accuracy_mm,
    } = of_board;
    let how = How::of("huber", "covariance", None, None, print_scale, board_accuracy_mm)?;
    let before = before(calibration)?;
    let given = given(py, &before, detections, grid.is_some(), &mut target)?;
    let seen = Seen::of(target, grid, sides(rows, cols)?, edge_mm)?;
    let wrong = |what: &str| raised::CalibrationError::new_err(what.to_owned());
    let made = match seen.reference() {
        Reference::Grid(grid) => {
            let made = grid.target("board");
            let made =
                made.ok_or_else(|| wrong("grid needs rows and cols to identify the corners"))?;
            Some(made.raise(errors::calibration)?)
        }
        Reference::Scene(_) => return Err(wrong("pass one target")),
        Reference::Target(_) => None,
    };
    let reference = made.as_ref().map_or_else(|| seen.reference(), Reference::Target);
    if let Some(target) = reference.targets().first() {
        check_target(&before, target, assume_target)?;
    }
    let mut sheet = how.sheet;
    if let [only] = seen.printed() {
        sheet.sheets = only.sheets.clone();
    }
    let panels = sheet.panels(&reference).raise(errors::calibration)?;
    let mut checked = Calibration::of(&reference, panels);
    if how.board_accuracy_mm.is_some() {
        checked = checked.board_accuracy_mm(how.board_accuracy_mm);
    }
    for (camera, mut detections) in before.cameras.iter().zip(given) {
        if assume_target {
            assume(&mut detections, reference.targets());
        }
        let mut of_camera = views(&detections, &reference).raise(errors::calibration)?.views;
        of_camera.retain(|view| reference.labels_are_of_board(view));
        sheet.put_on(reference.targets().first(), &mut of_camera).raise(errors::calibration)?;
        checked = checked.with(CameraViews::new(&camera.name, of_camera, Model::Radtan));
    }
    let target = reference.targets().first().cloned().ok_or_else(|| wrong("pass one target"))?;
    Ok((before, checked, target))
}

/// Rejects another target than that of the calibration.
pub(super) fn check_target(
    before: &Estimate,
    target: &Target,
    assume_target: bool,
) -> PyResult<()> {
    let own = target.identity();
    match before.calibrated_with.as_slice() {
        [first, ..] if !assume_target && !before.calibrated_with.contains(&own) => {
            Err(raised::CalibrationError::new_err(format!(
                "the calibration was made with {first}, not with {own}; pass the right target, or assume_target=True"
            )))
        }
        _ => Ok(()),
    }
}

/// The earlier calibration; without uncertainties if it failed.
pub(super) fn before(given: &Bound<'_, PyAny>) -> PyResult<Estimate> {
    let of = |cameras: Vec<CameraEstimate>, solved: &Solved| {
        let mut before = Estimate::default();
        before.cameras = cameras;
        before.joint = solved.estimate.joint.clone();
        (before.common_px, before.sigma) = (solved.estimate.common_px, solved.estimate.sigma);
        before.calibrated_with = solved.estimate.calibrated_with.clone();
        if solved.said().iter().any(|(_, is_failure)| *is_failure) {
            before.cameras.iter_mut().for_each(CameraEstimate::forget_uncertainties);
        }
        before
    };
    if let Ok(rig) = given.cast::<Rig>() {
        let solved = &rig.get().solved;
        return Ok(of(solved.estimate.cameras.clone(), solved));
    }
    let found = given.cast::<CalibratedCamera>()?.get();
    let mut camera = found.estimate().clone();
    camera.name.clear();
    Ok(of(vec![camera], &found.solved))
}

/// The detections of each camera.
pub(super) fn given(
    py: Python<'_>,
    before: &Estimate,
    detections: &Bound<'_, PyAny>,
    is_grid: bool,
    target: &mut Option<Targets>,
) -> PyResult<Vec<Named>> {
    let wrong = |what: String| raised::CalibrationError::new_err(what);
    let mut of_camera = |detections: &Bound<'_, PyAny>| {
        let detections: Results<'_> = detections.extract()?;
        if target.is_none() {
            *target = of_detections(&detections.all, is_grid);
        }
        named(py, &detections.all, None)
    };
    let Ok(by_name) = detections.cast::<PyMapping>() else {
        if before.cameras.len() > 1 {
            let names: Vec<&str> = before.cameras.iter().map(|of| of.name.as_str()).collect();
            let what = "pass the detections of a rig as a dict with a sequence for each camera";
            return Err(wrong(format!("{what} (cameras: {})", names.join(", "))));
        }
        return Ok(vec![of_camera(detections)?]);
    };
    if before.cameras.len() == 1 {
        return Err(wrong("pass the detections of one camera as a sequence".to_owned()));
    }
    let names: Vec<String> = by_name.keys()?.extract()?;
    let unknown = names.iter().find(|name| before.cameras.iter().all(|of| of.name != **name));
    if let Some(name) = unknown {
        return Err(wrong(format!("the rig has no camera {name}")));
    }
    let all = before.cameras.iter().map(|camera| match names.contains(&camera.name) {
        true => of_camera(&by_name.get_item(&camera.name)?),
        false => Ok(Vec::new()),
    });
    all.collect()
}
