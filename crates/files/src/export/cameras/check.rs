//! The result of `deltille check` as JSON, schema `deltille/check/1`.

use serde::Serialize;

use deltille_calibrate::{Check, Missing, QuantityTest, Suspect};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/check/1";

#[derive(Serialize)]
struct CheckFile<'a> {
    schema: &'static str,
    answer: &'static str,
    changed: Vec<SuspectRecord<'a>>,
    or: Vec<SuspectRecord<'a>>,
    missing: Vec<MissingRecord<'a>>,
    p_value: Option<f64>,
    tests: Vec<TestRecord<'a>>,
    views: usize,
    corners: usize,
    rms_px: f64,
    camera_size_px: [u32; 2],
    size_px: [u32; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    exchanged: Option<&'a [String; 2]>,
}

/// A quantity, of a camera if there are several.
#[derive(Serialize)]
struct SuspectRecord<'a> {
    quantity: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    camera: &'a str,
}

#[derive(Serialize)]
struct MissingRecord<'a> {
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    quantity: Option<&'static str>,
    #[serde(skip_serializing_if = "str::is_empty")]
    camera: &'a str,
    text: String,
}

#[derive(Serialize)]
struct TestRecord<'a> {
    #[serde(flatten)]
    of: SuspectRecord<'a>,
    unit: &'static str,
    change: f64,
    p_value: f64,
    /// `null` if no change would be found.
    detectable: Option<f64>,
    limit: Option<f64>,
}

/// The JSON text of a check.
pub fn write(found: &Check) -> String {
    let missing = found.missing.iter().map(|missing| {
        let (quantity, camera) = match missing {
            Missing::Undetermined { of, .. } => (Some(of.quantity.name()), of.camera.as_str()),
            Missing::Views { camera } => (None, camera.as_str()),
            _ => (None, ""),
        };
        MissingRecord { kind: missing.name(), quantity, camera, text: missing.to_string() }
    });
    let [camera_size_px, size_px] = found.sizes_px;
    let file = CheckFile {
        schema: SCHEMA,
        answer: found.answer.name(),
        changed: found.changed.iter().map(suspect).collect(),
        or: found.or.iter().map(suspect).collect(),
        missing: missing.collect(),
        p_value: found.p_value,
        tests: found.tests.iter().map(test).collect(),
        views: found.views,
        corners: found.corners,
        rms_px: found.rms_px,
        camera_size_px,
        size_px,
        exchanged: found.exchanged.as_ref(),
    };
    json::to_text(&file, 3)
}

fn suspect(of: &Suspect) -> SuspectRecord<'_> {
    SuspectRecord { quantity: of.quantity.name(), camera: &of.camera }
}

fn test(found: &QuantityTest) -> TestRecord<'_> {
    TestRecord {
        of: suspect(&found.of),
        unit: found.of.quantity.unit(),
        change: found.change,
        p_value: found.p_value,
        detectable: Some(found.detectable).filter(|value| value.is_finite()),
        limit: found.limit,
    }
}
