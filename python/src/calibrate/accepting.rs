//! Measures known lengths with calibrated cameras, against a limit.

use deltille::calibrate::{self, AcceptanceRequest, CornerLabel, KnownLength, Limit, Temperature};
use deltille::export::acceptance::{self, Tested};
use deltille::report::Certificate;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::checking::{OfBoard, new_views};
use crate::boundary::arrays::column;
use crate::boundary::errors::{self, raised, unlocked};
use crate::targets::target::Targets;

/// The errors of measured lengths, with their uncertainties.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Acceptance {
    found: calibrate::Acceptance,
    has_table: bool,
}

#[pymethods]
impl Acceptance {
    /// ``"conforms"``, ``"fails"`` or ``"undecided"`` (ISO 14253-1); ``None`` without a limit.
    #[getter]
    fn verdict(&self) -> Option<&'static str> {
        self.found.verdict().map(|of| of.name())
    }

    /// Number of images of one camera, or of sets of simultaneous images of a rig.
    #[getter]
    fn frames(&self) -> usize {
        self.found.measured.len()
    }

    /// Known lengths at the temperature of the target, mm.
    #[getter]
    fn known_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.found.lengths.iter().map(|of| of.known_mm))
    }

    /// Errors of the measured lengths: measured minus known, mm.
    #[getter]
    fn error_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.found.lengths.iter().map(calibrate::LengthError::error_mm))
    }

    /// Combined standard uncertainties of the errors, mm.
    #[getter]
    fn combined_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.found.lengths.iter().map(|of| of.budget.combined_mm()))
    }

    /// Expanded uncertainties of the errors for a level of confidence of 95 %, mm.
    #[getter]
    fn expanded_mm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.found.lengths.iter().map(|of| of.budget.expanded_mm()))
    }

    /// The probing error: the largest distance of a measured corner from the target, mm.
    #[getter]
    fn probing_mm(&self) -> f64 {
        self.found.probing.largest_mm
    }

    /// RMS distance of the measured corners from the target, mm.
    #[getter]
    fn probing_rms_mm(&self) -> f64 {
        self.found.probing.rms_mm
    }

    /// Names of the images that were not measured, because their pose is that of an image of the calibration.
    #[getter]
    fn reused(&self) -> Vec<String> {
        self.found.reused.clone()
    }

    /// Returns the text that ``deltille accept -o`` writes, with the uncertainty budget of each length.
    fn to_json(&self) -> String {
        acceptance::write(&self.found, None)
    }

    /// Returns the certificate as HTML, which prints on one page of A4.
    ///
    /// Parameters
    /// ----------
    /// calibration, target : str
    ///     Names of the calibration and of the target on the certificate.
    fn certificate(&self, calibration: &str, target: &str) -> String {
        let certificate = Certificate {
            tested: Tested {
                calibration: calibration.to_owned(),
                calibration_sha256: None,
                target: target.to_owned(),
                lengths: self.has_table.then(|| "a table".to_owned()),
            },
            found: &self.found,
        };
        certificate.html()
    }

    fn __repr__(&self) -> String {
        let largest = self.found.largest().map_or(0.0, calibrate::LengthError::error_mm);
        let verdict = self.verdict().map_or(String::new(), |of| format!("{of}, "));
        let count = self.found.lengths.len();
        format!("<Acceptance {verdict}{count} lengths, largest error {largest:+.4} mm>")
    }
}

/// An end of a length: row and column, or panel, row and column.
#[derive(FromPyObject)]
pub enum End {
    /// With the id of the panel.
    OnPanel((u32, i32, i32)),
    /// On the only panel.
    OfBoard((i32, i32)),
}

/// Measures known lengths with a camera or a rig, and judges their errors against a limit.
///
/// A rig triangulates the corners that two or more cameras see. One camera measures corners in the plane of their panel and takes
/// the scale from the target.
///
/// Parameters
/// ----------
/// calibration : CalibratedCamera or Rig
///     The calibration, with observed uncertainties.
/// detections : sequence of Detection, or dict of str to sequence of Detection
///     Detections in images that took no part in the calibration; for a rig those of each camera. Images of a rig taken at the
///     same time have the same name.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// lengths : sequence of (from, to, length_mm, sd_mm), optional
///     Lengths that were measured by other means, with their standard uncertainties; ends are (row, column), or (panel, row,
///     column). Defaults to lengths between corners as the target describes them.
/// limit_mm, limit_per_length : float, optional
///     The largest permitted error of a length L is ``limit_mm + limit_per_length * L``.
/// temperature_c, expansion_ppm : (float, float), optional
///     Temperature of the target (°C) and its coefficient of linear expansion (ppm/K), each with its standard deviation, for a
///     rig. Lengths are known at 20 °C.
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
/// Acceptance
///
/// Raises
/// ------
/// CalibrationError
///     If the calibration has no observed uncertainties, or no length was measured.
#[pyfunction]
#[pyo3(name = "accept", signature = (calibration, detections, target = None, *, lengths = None, limit_mm = None,
    limit_per_length = 0.0, temperature_c = None, expansion_ppm = None, grid = None, rows = None, cols = None,
    edge_mm = None, print_scale = None, assume_target = false, board_accuracy_mm = None))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn accept_of(
    py: Python<'_>,
    calibration: &Bound<'_, PyAny>,
    detections: &Bound<'_, PyAny>,
    target: Option<Targets>,
    lengths: Option<Vec<(End, End, f64, f64)>>,
    limit_mm: Option<f64>,
    limit_per_length: f64,
    temperature_c: Option<(f64, f64)>,
    expansion_ppm: Option<(f64, f64)>,
    grid: Option<&str>,
    rows: Option<i64>,
    cols: Option<i64>,
    edge_mm: Option<f64>,
    print_scale: Option<&Bound<'_, PyAny>>,
    assume_target: bool,
    board_accuracy_mm: Option<f64>,
) -> PyResult<Acceptance> {
    let wrong = |what: String| raised::CalibrationError::new_err(what);
    let has_table = lengths.is_some();
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
    let (before, views, target) = new_views(py, calibration, detections, of_board)?;
    let end = |end: End| {
        let (panel, row, col) = match end {
            End::OnPanel((panel, row, col)) => (Some(panel), row, col),
            End::OfBoard((row, col)) => (None, row, col),
        };
        CornerLabel::on(&target, panel, row, col)
            .map_err(|error| wrong(format!("lengths: {error}")))
    };
    let length = |(from, to, length_mm, sd_mm): (End, End, f64, f64)| {
        let ends = [end(from)?, end(to)?];
        if !(0.0..f64::INFINITY).contains(&sd_mm) {
            return Err(wrong("lengths: expected standard uncertainties in mm".to_owned()));
        }
        let known = KnownLength::on(&target, ends, length_mm, sd_mm);
        known.map_err(|error| wrong(format!("lengths: {error}")))
    };
    let lengths =
        lengths.into_iter().flatten().map(length).collect::<PyResult<Vec<KnownLength>>>()?;
    if has_table && lengths.is_empty() {
        return Err(wrong("lengths: the list is empty".to_owned()));
    }
    let limit = limit_of(limit_mm, limit_per_length)?;
    let temperature = match (temperature_c, expansion_ppm) {
        (None, None) => None,
        (Some(celsius), Some(ppm_per_k)) => {
            let temperature = Temperature::new(celsius, ppm_per_k);
            Some(temperature.map_err(|error| wrong(error.to_string()))?)
        }
        _ => return Err(wrong("pass temperature_c and expansion_ppm together".to_owned())),
    };
    if let Some([again, first]) = KnownLength::repeated(&lengths) {
        return Err(wrong(format!("lengths: [{again}] is between the same corners as [{first}]")));
    }
    let request = AcceptanceRequest { lengths, limit, temperature };
    let found = unlocked(py, move || views.accept(&before, &request))?;
    let found = found.map_err(|error| wrong(error.to_string()))?;
    Ok(Acceptance { found, has_table })
}

/// Checks the largest permitted error.
fn limit_of(limit_mm: Option<f64>, per_length: f64) -> PyResult<Option<Limit>> {
    let wrong = |what: &str| Err(errors::calibration(what.to_owned()));
    if limit_mm.is_some_and(|mm| !(mm.is_finite() && mm > 0.0)) {
        return wrong("limit_mm: expected a positive number");
    }
    if limit_mm.is_none() && per_length != 0.0 {
        return wrong("limit_per_length: pass limit_mm, too");
    }
    // The reciprocal, L/5000 as 5000, would accept everything.
    if !(0.0..1.0).contains(&per_length) {
        return wrong("limit_per_length: expected mm of error per mm of length, such as 1/5000");
    }
    Ok(limit_mm.map(|constant_mm| Limit { constant_mm, per_length }))
}
