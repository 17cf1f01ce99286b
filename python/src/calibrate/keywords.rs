//! The functions `calibrate` and `rig`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use deltille::export::sheet::read_sheet;
use deltille::limits::Limits;
use deltille::targets;
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use super::calibration::{Calibration, Rig, calibration};
use super::solving::{How, ModelChoice, OneCamera, Seen, Texts, constraints, named, solve};
use crate::boundary::errors::{self, RaiseFile, raised};
use crate::see::arguments::Results;
use crate::see::camera::AnyCamera;
use crate::see::detection::Detection;
use crate::see::detector::sides;
use crate::targets::target::Targets;

/// Calibrates a camera from detections.
///
/// Parameters
/// ----------
/// detections : sequence of Detection
///     Detections in images of one camera; 20 or more with the board tilted by 20° to 45° work well.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// model : str, optional
///     ``"radtan"``, ``"radtan5"``, ``"rational"``, ``"thin-prism"``, ``"kannala-brandt"``, ``"eucm"``,
///     ``"double-sphere"``, ``"pupil"``, ``"spline"``, or ``"auto"``, which selects the model with the lowest error on
///     held-out views. Names of other programs work too: OpenCV's ``"fisheye"`` is ``"kannala-brandt"``.
/// camera : Camera or CalibratedCamera, optional
///     A known camera, which is kept fixed; only the poses are estimated.
/// grid : str, optional
///     Tiling of an untagged board, instead of a target: ``"deltille"`` or ``"checker"``.
/// rows, cols : int, optional
///     Its rows and columns of corners, if known.
/// edge_mm : float, optional
///     Edge of its tiles, mm.
/// hold_out : int, optional
///     Hold out every n-th view, and report how well the others predict it.
/// loss : str, optional
///     Robust loss for outliers: ``"huber"``, ``"cauchy"`` or ``"none"`` (least squares).
/// weights : str, optional
///     ``"covariance"`` of the detections, or ``"equal"``.
/// covariance_of_all : bool, optional
///     Include the poses of the views, and the offsets of measured corners, in ``joint_covariance``.
/// board_shape : bool, optional
///     Estimate bending and stretching of the sheet, too.
/// measure_target : bool, optional
///     Estimate the position of every corner, too.
/// shape : path-like, optional
///     File of an earlier calibration of the same sheet with ``board_shape``.
/// print_scale : float or (float, float), optional
///     Measured length of the check bars over the nominal one, across and up the sheet.
/// distances_mm : sequence of float, optional
///     Distances for which the projection uncertainty is reported.
/// names : sequence of str, optional
///     Names of the views.
/// assume_target : bool, optional
///     Use the target even if the detections name another one.
/// board_accuracy_mm : float, optional
///     Standard deviation of the board's corners from the description, mm, for the observed uncertainties. Defaults to 0.1,
///     but at most 0.5 % of an edge; for a measured target, to the value in its file.
/// fix : str or sequence of str, optional
///     Parameters that are not estimated, such as ``"k3"`` or ``"k3=0.01"``. Without a value, ``cx`` and ``cy`` are fixed at
///     the image centre, and coefficients of distortion at 0; other parameters need a value.
/// equal : str or sequence of str, optional
///     Parameters with one common value, such as ``"fx,fy"``.
/// prior : str or sequence of str, optional
///     Parameters that were measured before, with their standard deviations, such as ``"cx=960±2"`` or ``"cx=960+-2"``.
///
/// Returns
/// -------
/// Calibration
///
/// Raises
/// ------
/// CalibrationError
///     If there are too few views, if they are too similar, or if they do not belong together.
#[pyfunction]
#[pyo3(signature = (detections, target = None, model = "radtan", *, camera = None, grid = None, rows = None,
    cols = None, edge_mm = None, hold_out = None, loss = "huber", weights = "covariance", board_shape = false,
    measure_target = false, shape = None, print_scale = None, distances_mm = None, names = None,
    assume_target = false, board_accuracy_mm = None, fix = None, equal = None, prior = None,
    covariance_of_all = false))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn calibrate(
    py: Python<'_>,
    detections: Results<'_>,
    target: Option<Targets>,
    model: &str,
    camera: Option<AnyCamera>,
    grid: Option<&str>,
    rows: Option<i64>,
    cols: Option<i64>,
    edge_mm: Option<f64>,
    hold_out: Option<i64>,
    loss: &str,
    weights: &str,
    board_shape: bool,
    measure_target: bool,
    shape: Option<PathBuf>,
    print_scale: Option<&Bound<'_, PyAny>>,
    distances_mm: Option<Vec<f64>>,
    names: Option<Vec<String>>,
    assume_target: bool,
    board_accuracy_mm: Option<f64>,
    fix: Option<Texts>,
    equal: Option<Texts>,
    prior: Option<Texts>,
    covariance_of_all: bool,
) -> PyResult<Py<Calibration>> {
    let mut how = How::of(loss, weights, hold_out, distances_mm, print_scale, board_accuracy_mm)?;
    (how.board_shape, how.measure_target) = (board_shape, measure_target);
    (how.assume_target, how.covariance_of_all) = (assume_target, covariance_of_all);
    how.constraints = constraints(fix, equal, prior)?;
    let target = target.or_else(|| of_detections(&detections.all, grid.is_some()));
    let seen = Seen::of(target, grid, sides(rows, cols)?, edge_mm)?;
    if let Some(path) = shape {
        let text = Limits::default().read_text(&path).raise_of_file(&path, errors::file)?;
        let sheet = read_sheet(&text, &seen.reference().identities());
        let wrong = |error| {
            raised::FileError::new_err(format!("{}: {}", path.display(), errors::one_line(&error)))
        };
        how.sheet = sheet.map_err(wrong)?;
    }
    let model = ModelChoice::of(model)?;
    let names = detections.names(names);
    let detections = named(py, &detections.all, names)?;
    let known = camera.map(|camera| camera.0);
    let one = OneCamera { name: "camera".to_owned(), detections, known };
    let solved = solve(py, seen, vec![one], false, model, how)?;
    Py::new(py, calibration(Arc::new(solved)))
}

/// Returns the targets of the detections, the default if no target is given.
pub fn of_detections(detections: &[PyRef<'_, Detection>], is_grid: bool) -> Option<Targets> {
    let first = detections.first().filter(|_| !is_grid)?;
    (!first.targets.is_empty()).then(|| Targets(first.targets.clone()))
}

/// Calibrates the intrinsics and extrinsics of a multi-camera rig.
///
/// Parameters
/// ----------
/// cameras : dict of str to sequence of Detection
///     Detections of each camera; images taken at the same time have the same name. The first camera defines the frame of
///     the rig.
/// target : Target or sequence of Target, optional
///     The target, or several that do not move relative to each other; defaults to those of the detections.
/// model : str, optional
///     See :func:`calibrate`.
/// known : dict of str to Camera or CalibratedCamera, optional
///     Known cameras, which are kept fixed.
/// refine_target : bool, optional
///     Estimate the poses of the panels on the target, too.
/// hold_out, loss, weights, board_shape, measure_target, print_scale, distances_mm, assume_target,
/// board_accuracy_mm, covariance_of_all
///     See :func:`calibrate`.
///
/// Returns
/// -------
/// Rig
///
/// Raises
/// ------
/// CalibrationError
///     If there are too few views, or if no views connect the cameras.
#[pyfunction]
#[pyo3(signature = (cameras, target = None, model = "radtan", *, known = None, refine_target = false,
    hold_out = None, loss = "huber", weights = "covariance", board_shape = false, measure_target = false,
    print_scale = None, distances_mm = None, assume_target = false, board_accuracy_mm = None,
    covariance_of_all = false))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn rig(
    py: Python<'_>,
    cameras: &Bound<'_, PyMapping>,
    target: Option<Targets>,
    model: &str,
    known: Option<BTreeMap<String, AnyCamera>>,
    refine_target: bool,
    hold_out: Option<i64>,
    loss: &str,
    weights: &str,
    board_shape: bool,
    measure_target: bool,
    print_scale: Option<&Bound<'_, PyAny>>,
    distances_mm: Option<Vec<f64>>,
    assume_target: bool,
    board_accuracy_mm: Option<f64>,
    covariance_of_all: bool,
) -> PyResult<Rig> {
    let wrong = |what: String| Err(raised::CalibrationError::new_err(what));
    let mut how = How::of(loss, weights, hold_out, distances_mm, print_scale, board_accuracy_mm)?;
    (how.board_shape, how.measure_target) = (board_shape, measure_target);
    (how.assume_target, how.covariance_of_all) = (assume_target, covariance_of_all);
    how.refine_target = refine_target;
    if cameras.len()? < 2 && !refine_target {
        return wrong(
            "a rig has at least two cameras; for one, use calibrate or refine_target=True"
                .to_owned(),
        );
    }
    let mut known = known.unwrap_or_default();
    let (mut all, mut target) = (Vec::new(), target);
    for camera in cameras.items()?.iter() {
        let (name, detections): (String, Bound<'_, PyAny>) = camera.extract()?;
        targets::Name::new(&name)
            .map_err(|error| raised::CalibrationError::new_err(errors::one_line(&error)))?;
        let detections: Results<'_> = detections.extract()?;
        target = target.or_else(|| of_detections(&detections.all, false));
        let known = known.remove(&name).map(|camera| camera.0);
        let detections = named(py, &detections.all, None)?;
        let is_same = |one: &deltille::detect::Detection, other: &deltille::detect::Detection| {
            !one.grids.is_empty() && one.grids == other.grids
        };
        for other in &all {
            let OneCamera { name: of, detections: theirs, .. } = other;
            let twice =
                detections.iter().find(|(_, own)| theirs.iter().any(|(_, it)| is_same(own, it)));
            if let Some((picture, _)) = twice {
                return wrong(format!(
                    "{name}: {picture} has the same corners as an image of {of}"
                ));
            }
        }
        all.push(OneCamera { name, detections, known });
    }
    if let Some(name) = known.keys().next() {
        return wrong(format!("known: unknown camera {name}"));
    }
    let seen = Seen::of(target, None, [None, None], None)?;
    let solved = solve(py, seen, all, true, ModelChoice::of(model)?, how)?;
    Ok(Rig { solved: Arc::new(solved) })
}
