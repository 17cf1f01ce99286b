//! The result of `deltille accept` as JSON, schema `deltille/acceptance/1`.

use serde::Serialize;
use sha2::{Digest, Sha256};

use deltille_calibrate::{Acceptance, Conformity, CornerLabel, KnownLength, LengthError, Limit};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/acceptance/1";

#[derive(Serialize)]
struct AcceptanceFile<'a> {
    schema: &'static str,
    /// `null` without a limit.
    verdict: Option<&'static str>,
    limit: Option<LimitRecord>,
    method: &'static str,
    #[serde(flatten)]
    tested: Option<&'a Tested>,
    confidence: f64,
    frames: usize,
    observations: usize,
    extrapolated: usize,
    board_accuracy_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    temperature: Option<TemperatureRecord>,
    /// The length that decides about the verdict, or that with the largest error.
    decisive: Option<LengthRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    counts: Option<CountsRecord>,
    lengths_within_uncertainty: usize,
    probing: ProbingRecord<'a>,
    measured: &'a [String],
    reused: &'a [String],
    unmeasured: &'a [String],
    missing: Vec<MissingRecord>,
    lengths: Vec<LengthRecord<'a>>,
}

#[derive(Serialize)]
struct LimitRecord {
    constant_mm: f64,
    per_length: f64,
}

#[derive(Serialize)]
struct CountsRecord {
    conforms: usize,
    undecided: usize,
    fails: usize,
}

#[derive(Serialize)]
struct TemperatureRecord {
    celsius: f64,
    sd_k: f64,
    expansion_ppm_per_k: f64,
    expansion_sd_ppm_per_k: f64,
}

#[derive(Serialize)]
struct ProbingRecord<'a> {
    largest_mm: f64,
    #[serde(flatten)]
    at: Option<PlaceRecord<'a>>,
    rms_mm: f64,
    corners: usize,
}

#[derive(Serialize)]
struct PlaceRecord<'a> {
    corner: CornerRecord,
    frame: &'a str,
}

#[derive(Serialize)]
struct CornerRecord {
    panel: u32,
    row: i32,
    col: i32,
}

#[derive(Serialize)]
struct MissingRecord {
    from: CornerRecord,
    to: CornerRecord,
    length_mm: f64,
}

#[derive(Serialize)]
struct LengthRecord<'a> {
    frame: &'a str,
    from: CornerRecord,
    to: CornerRecord,
    known_mm: f64,
    measured_mm: f64,
    error_mm: f64,
    noise_mm: f64,
    lens_mm: f64,
    calibration_mm: f64,
    target_mm: f64,
    temperature_mm: f64,
    combined_mm: f64,
    /// `null` if no part was estimated from few values.
    freedom: Option<f64>,
    coverage_factor: f64,
    expanded_mm: f64,
    limit_mm: Option<f64>,
    verdict: Option<&'static str>,
}

/// What was tested, and with what.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Tested {
    /// The file of the calibration.
    pub calibration: String,
    /// The fingerprint of this file; `None` if there is no file.
    pub calibration_sha256: Option<String>,
    /// The target, with its fingerprint.
    pub target: String,
    /// The table of measured lengths; `None` if those of the target's description were measured.
    #[serde(rename = "lengths_from")]
    pub lengths: Option<String>,
}

/// The fingerprint of a file: SHA-256, in hexadecimal.
pub fn fingerprint(file: &[u8]) -> String {
    Sha256::digest(file).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The JSON text of a result, and of what was tested if it is known.
pub fn write(found: &Acceptance, tested: Option<&Tested>) -> String {
    let probing = &found.probing;
    let file = AcceptanceFile {
        schema: SCHEMA,
        verdict: found.verdict().map(|of| of.name()),
        limit: found
            .request
            .limit
            .map(|Limit { constant_mm, per_length }| LimitRecord { constant_mm, per_length }),
        method: if found.is_triangulated { "triangulation" } else { "plane" },
        confidence: Acceptance::CONFIDENCE,
        tested,
        frames: found.measured.len(),
        observations: found.observations,
        extrapolated: found.extrapolated,
        board_accuracy_mm: found.board_accuracy_mm,
        temperature: found.request.temperature.map(|of| TemperatureRecord {
            celsius: of.celsius(),
            sd_k: of.sd_k,
            expansion_ppm_per_k: of.expansion_per_k * 1e6,
            expansion_sd_ppm_per_k: of.expansion_sd_per_k * 1e6,
        }),
        decisive: found.by_weight().first().map(|of| length(found, of)),
        counts: found.verdict().map(|_| CountsRecord {
            conforms: found.count(Conformity::Conforms),
            undecided: found.count(Conformity::Undecided),
            fails: found.count(Conformity::Fails),
        }),
        lengths_within_uncertainty: found.within(),
        probing: ProbingRecord {
            largest_mm: probing.largest_mm,
            at: probing
                .at
                .as_ref()
                .map(|(label, frame)| PlaceRecord { corner: corner(label), frame }),
            rms_mm: probing.rms_mm,
            corners: probing.corners,
        },
        measured: &found.measured,
        reused: &found.reused,
        unmeasured: &found.unmeasured,
        missing: found.missing().map(missing).collect(),
        lengths: found.lengths.iter().map(|of| length(found, of)).collect(),
    };
    json::to_text(&file, 2)
}

fn corner(of: &CornerLabel) -> CornerRecord {
    CornerRecord { panel: of.panel.id(), row: of.row, col: of.col }
}

fn missing(of: &KnownLength) -> MissingRecord {
    let [from, to] = of.ends.map(|end| corner(&end));
    MissingRecord { from, to, length_mm: of.length_mm }
}

fn length<'a>(found: &Acceptance, of: &'a LengthError) -> LengthRecord<'a> {
    let budget = &of.budget;
    LengthRecord {
        frame: &of.frame,
        from: corner(&of.ends[0]),
        to: corner(&of.ends[1]),
        known_mm: of.known_mm,
        measured_mm: of.measured_mm,
        error_mm: of.error_mm(),
        noise_mm: budget.noise_mm,
        lens_mm: budget.lens_mm,
        calibration_mm: budget.calibration_mm,
        target_mm: budget.target_mm,
        temperature_mm: budget.temperature_mm,
        combined_mm: budget.combined_mm(),
        freedom: Some(budget.freedom()).filter(|freedom| freedom.is_finite()),
        coverage_factor: budget.coverage_factor(),
        expanded_mm: budget.expanded_mm(),
        limit_mm: found.request.limit.map(|limit| limit.of(of.known_mm)),
        verdict: found.conformity(of).map(|of| of.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first example of FIPS 180-2.
    #[test]
    fn fingerprints_are_those_of_sha256() {
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(fingerprint(b"abc"), expected);
    }
}
