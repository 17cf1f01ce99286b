//! The result of `deltille timing` as JSON, schema `deltille/timing/1`.

use serde::Serialize;

use deltille_calibrate::{CameraTiming, Measured, Timing};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/timing/1";

#[derive(Serialize)]
struct TimingFile<'a> {
    schema: &'static str,
    cameras: Vec<CameraRecord<'a>>,
    frames: usize,
    interval_s: f64,
    speed_px_s: f64,
    rms_px: f64,
    corner_sd_px: f64,
}

#[derive(Serialize)]
struct CameraRecord<'a> {
    name: &'a str,
    readout_s: Option<Value>,
    line_delay_s: Option<Value>,
    shear_px: f64,
    offset_s: Option<Value>,
    drift: Option<Value>,
    frames: usize,
}

/// A value and its standard deviation.
#[derive(Serialize)]
struct Value {
    value: f64,
    sd: f64,
    significant: bool,
}

/// The JSON text of a result.
pub fn write(found: &Timing) -> String {
    let file = TimingFile {
        schema: SCHEMA,
        cameras: found.cameras.iter().map(camera).collect(),
        frames: found.frames,
        interval_s: found.interval_s,
        speed_px_s: found.speed_px_s,
        rms_px: found.rms_px,
        corner_sd_px: found.corner_sd_px,
    };
    json::to_text(&file, 3)
}

fn camera(of: &CameraTiming) -> CameraRecord<'_> {
    let value = |of: Measured, by: f64| Value {
        value: of.value / by,
        sd: of.sd / by,
        significant: of.is_significant(),
    };
    CameraRecord {
        name: &of.name,
        readout_s: of.readout_s.map(|of| value(of, 1.0)),
        line_delay_s: of.readout_s.map(|seconds| value(seconds, f64::from(of.height))),
        shear_px: of.shear_px,
        offset_s: of.offset_s.map(|of| value(of, 1.0)),
        drift: of.drift.map(|of| value(of, 1.0)),
        frames: of.frames,
    }
}
