//! Estimates when the rows of calibrated cameras are exposed.

use std::collections::BTreeMap;

use deltille::calibrate::{self, Measured, Reference, TimedCamera, views};
use deltille::export::timing;
use pyo3::prelude::*;

use super::checking::{before, check_target, given};
use super::solving::{Seen, assume};
use crate::boundary::errors::{self, Raise, raised, unlocked, warn};
use crate::targets::target::Targets;

/// When the rows of each camera are exposed.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct Timing(calibrate::Timing);

/// The timing of one camera. Values are tuples with their standard deviation; ``None`` if the motion does not determine them.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct CameraTiming(calibrate::CameraTiming);

/// A value and its standard deviation.
type Value = Option<(f64, f64)>;

fn value(of: Option<Measured>) -> Value {
    of.map(|of| (of.value, of.sd))
}

#[pymethods]
impl CameraTiming {
    /// Name of the camera; empty for a single one.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Time in which all rows are exposed one after the other, s: the number of rows times the line delay. Positive if the upper
    /// rows are exposed first.
    #[getter]
    fn readout_s(&self) -> Value {
        value(self.0.readout_s)
    }

    /// Whether the readout differs from that of a global shutter (probability of error 0.1 %).
    #[getter]
    fn is_rolling(&self) -> bool {
        self.0.readout_s.is_some_and(|of| of.is_significant())
    }

    /// Largest displacement of a corner by the readout, between the first and the last row, px.
    #[getter]
    fn shear_px(&self) -> f64 {
        self.0.shear_px
    }

    /// Time of its middle row minus that of the first camera, for equal time stamps, s, in the middle of the recording.
    #[getter]
    fn offset_s(&self) -> Value {
        value(self.0.offset_s)
    }

    /// Change of the offset with time, s/s.
    #[getter]
    fn drift(&self) -> Value {
        value(self.0.drift)
    }

    /// Number of its frames that were used.
    #[getter]
    fn frames(&self) -> usize {
        self.0.frames
    }

    fn __repr__(&self) -> String {
        let ms = |of: Option<Measured>| {
            of.map_or("unknown".to_owned(), |of| {
                format!("{:.3} ± {:.3} ms", 1e3 * of.value, 1e3 * of.sd)
            })
        };
        format!(
            "<CameraTiming {:?}, readout {}, offset {}>",
            self.0.name,
            ms(self.0.readout_s),
            ms(self.0.offset_s)
        )
    }
}

#[pymethods]
impl Timing {
    /// The timing of each camera.
    #[getter]
    fn cameras(&self) -> Vec<CameraTiming> {
        self.0.cameras.iter().cloned().map(CameraTiming).collect()
    }

    /// Number of frames of the first camera with a smooth motion of the target.
    #[getter]
    fn frames(&self) -> usize {
        self.0.frames
    }

    /// RMS residual of the corners per axis, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.0.rms_px
    }

    /// Median speed of the corners in the images of the first camera, px/s.
    #[getter]
    fn speed_px_s(&self) -> f64 {
        self.0.speed_px_s
    }

    /// Returns the text that ``deltille timing -o`` writes.
    fn to_json(&self) -> String {
        timing::write(&self.0)
    }

    fn __repr__(&self) -> String {
        format!("<Timing of {} cameras, {} frames>", self.0.cameras.len(), self.0.frames)
    }
}

/// Estimates the readout of rolling shutters, and offsets and drifts of the clocks of a rig, from detections of a moving target.
///
/// Parameters
/// ----------
/// calibration : CalibratedCamera or Rig
///     The calibration.
/// detections : sequence of Detection, or dict of str to sequence of Detection
///     Detections in all frames of a recording, with time stamps; for a rig those of each camera.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// assume_target : bool, optional
///     Use the target even if the detections name another one.
///
/// Returns
/// -------
/// Timing
///
/// Raises
/// ------
/// CalibrationError
///     If the detections have no time stamps, if too few successive frames show the target, or if they fit no timing.
#[pyfunction]
#[pyo3(name = "timing", signature = (calibration, detections, target = None, *, assume_target = false))]
pub fn timing_of(
    py: Python<'_>,
    calibration: &Bound<'_, PyAny>,
    detections: &Bound<'_, PyAny>,
    mut target: Option<Targets>,
    assume_target: bool,
) -> PyResult<Timing> {
    let wrong = |what: String| raised::CalibrationError::new_err(what);
    let before = before(calibration)?;
    let given = given(py, &before, detections, false, &mut target)?;
    let seen = Seen::of(target, None, [None, None], None)?;
    let reference = seen.reference();
    let Reference::Target(one) = reference else { return Err(wrong("pass one target".to_owned())) };
    check_target(&before, one, assume_target)?;
    let panels: Vec<_> = reference.panels().iter().map(|of| of.target_from_panel).collect();
    let mut cameras = Vec::new();
    for (of, mut detections) in before.cameras.iter().zip(given) {
        if assume_target {
            assume(&mut detections, reference.targets());
        }
        let times =
            detections.iter().filter_map(|(name, found)| Some((name.clone(), found.time_ns?)));
        let times: BTreeMap<String, i64> = times.collect();
        if times.is_empty() && !detections.is_empty() {
            return Err(wrong(
                "the detections have no time stamps: detect the frames of a recording".to_owned(),
            ));
        }
        if times.len() < detections.len() {
            let (without, all) = (detections.len() - times.len(), detections.len());
            warn(
                py,
                &format!("{without} of {all} detections have no time stamp and are not used"),
            )?;
        }
        let mut shown = views(&detections, &reference).raise(errors::calibration)?.views;
        shown.retain(|view| reference.labels_are_of_board(view));
        let camera = TimedCamera::of(of, shown, &times);
        cameras.push(camera.map_err(|error| wrong(error.to_string()))?);
    }
    let found = unlocked(py, move || calibrate::timing(&cameras, &panels))?;
    let found = found.map_err(|error| wrong(error.to_string()))?;
    found.warnings().iter().try_for_each(|said| warn(py, said))?;
    Ok(Timing(found))
}
