//! `--estimate-timing`: compensation for rolling shutters and clocks. Also what `deltille timing` prints.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::{Context, ensure};

use super::solving::ModelChoice;
use crate::deltille::files::written::{File, sample_of, text_file};
use crate::output::log;
use crate::progress::Spinner;
use deltille::calibrate::{Calibration, CameraTiming, Candidate, Model, Timing};
use deltille::detect::Detection;
use deltille::export::timing as timing_file;

/// Time stamps of the views of a camera by name, ns.
pub type Times = BTreeMap<String, i64>;

/// Returns the time stamps of detections, ns. Fails if there are none.
pub fn times_ns(detections: &[(String, Detection)]) -> anyhow::Result<Times> {
    let times = detections.iter().filter_map(|(name, found)| Some((name.clone(), found.time_ns?)));
    let times: Times = times.collect();
    ensure!(
        !times.is_empty() || detections.is_empty(),
        "no time stamps; give a video, a recording, or their detections"
    );
    if times.len() < detections.len() {
        let without = detections.len() - times.len();
        log!(
            "note: {without} of {} detections have no time stamp and are not used",
            detections.len()
        );
    }
    Ok(times)
}

/// Recordings of all frames, whose views are compensated for the timing of the cameras.
pub struct AllFrames {
    /// By camera.
    pub times_ns: Vec<Times>,
    /// Maximum number of views to calibrate with.
    pub most: usize,
}

/// Models of the cameras, by camera those that were compared, and the timing.
pub struct Prepared {
    pub tried: Vec<Vec<Candidate>>,
    pub timing: Option<Timing>,
}

/// Selects the models of the cameras; of all frames of recordings, also the views, and compensates them for the timing.
/// `options` name the cameras in messages.
pub fn prepare(
    calibration: &mut Calibration,
    model: ModelChoice,
    candidates: &[Model],
    options: &[String],
    frames: Option<&AllFrames>,
) -> anyhow::Result<Prepared> {
    let spinner = Spinner::new("selecting models");
    let choose = |calibration: &mut Calibration| -> anyhow::Result<Vec<Vec<Candidate>>> {
        let cameras = options.iter().enumerate();
        let tried = cameras.map(|(camera, option)| {
            let tried = model.choose(calibration, camera, candidates);
            if option.is_empty() { tried } else { tried.with_context(|| option.clone()) }
        });
        tried.collect()
    };
    let Some(AllFrames { times_ns, most }) = frames else {
        return Ok(Prepared { tried: choose(calibration)?, timing: None });
    };
    let mut all = calibration.clone();
    let compensated = |all: &Calibration| {
        all.compensated_for_timing(times_ns, *most).context("--estimate-timing")
    };
    let unknown = |all: &Calibration, camera: usize| all.cameras()[camera].intrinsics.model();
    if model == ModelChoice::Auto {
        // Uncompensated views do not show which model fits.
        for camera in 0..options.len() {
            let provisional = unknown(&all, camera).and_then(|_| all.provisional_model(camera));
            provisional.into_iter().for_each(|model| all.set_intrinsics(camera, model));
        }
    }
    let (found, mut timing) = compensated(&all)?;
    *calibration = found;
    let tried = choose(calibration)?;
    let is_other = |camera: &usize| unknown(calibration, *camera) != unknown(&all, *camera);
    let others: Vec<usize> = (0..options.len()).filter(is_other).collect();
    for &camera in &others {
        all.set_intrinsics(camera, calibration.cameras()[camera].intrinsics.clone());
    }
    if !others.is_empty() {
        (*calibration, timing) = compensated(&all)?;
    }
    drop(spinner);
    timing.warnings().iter().for_each(|said| log!("warning: {said}"));
    Ok(Prepared { tried, timing: Some(timing) })
}

impl Prepared {
    /// Returns `<stem>-timing.json`, if the timing was estimated.
    pub fn file(&self, stem: &str) -> Option<File> {
        let text = timing_file::write(self.timing.as_ref()?);
        Some(text_file(name(stem), text))
    }

    /// Describes the timing, if it was estimated.
    pub fn describe(&self) -> String {
        self.timing.as_ref().map_or(String::new(), describe)
    }
}

/// Returns a placeholder for [`Prepared::file`].
pub fn planned(stem: &str) -> File {
    text_file(name(stem), sample_of(timing_file::SCHEMA))
}

fn name(stem: &str) -> String {
    format!("{stem}-timing.json")
}

/// Describes the timing, one camera per line.
pub fn describe(found: &Timing) -> String {
    let mut text = String::new();
    let first = found.cameras.first().map_or("", |of| &of.name);
    for of in &found.cameras {
        let name = if of.name.is_empty() { String::new() } else { format!("{}: ", of.name) };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name}{}", readout(of));
        if let Some(offset) = of.offset_s {
            let [ms, sd] = [offset.value, offset.sd].map(|s| 1e3 * s);
            let drift = of.drift.map_or(String::new(), |drift| {
                format!(", drift {:.1} ± {:.1} ppm", 1e6 * drift.value, 1e6 * drift.sd)
            });
            let _ = writeln!(
                text,
                "{name}images are taken {ms:.3} ± {sd:.3} ms after those of {first} with the same time stamp{drift}"
            );
        } else if of.name != first {
            let why = match of.frames {
                0 => format!("no image was taken while {first} took images; the clocks must agree"),
                _ => MOVE.to_owned(),
            };
            let _ = writeln!(text, "{name}the offset to {first} is undetermined: {why}");
        }
    }
    let _ = writeln!(
        text,
        "{} frames, every {:.2} ms, median speed {:.0} px/s, RMS {:.4} px per axis",
        found.frames,
        1e3 * found.interval_s,
        found.speed_px_s,
        found.rms_px
    );
    text
}

/// What determines timing.
const MOVE: &str = "move the target faster, and record for ten seconds or more";

/// Describes the shutter of a camera.
fn readout(of: &CameraTiming) -> String {
    let Some(readout) = of.readout_s else {
        return format!("the readout is undetermined: {MOVE}");
    };
    let [ms, sd] = [readout.value, readout.sd].map(|s| 1e3 * s);
    match readout.is_significant() {
        true => format!(
            "rolling shutter, readout {ms:.3} ± {sd:.3} ms, {:.3} µs per row; corners are displaced by up to ±{:.1} px",
            1e3 * ms / f64::from(of.height),
            0.5 * of.shear_px
        ),
        false => format!("no significant rolling shutter: readout {ms:.3} ± {sd:.3} ms"),
    }
}
