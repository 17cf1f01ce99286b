//! The result of `deltille check` as JSON, schema `deltille/check/1`.

use serde::Serialize;

use deltille_calibrate::{Check, Missing, Quantity, QuantityTest};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/check/1";

#[derive(Serialize)]
struct CheckFile {
    schema: &'static str,
    answer: &'static str,
    changed: Vec<&'static str>,
    or: Vec<&'static str>,
    missing: Vec<MissingRecord>,
    p_value: Option<f64>,
    tests: Vec<TestRecord>,
    views: usize,
    corners: usize,
    rms_px: f64,
    camera_size_px: [u32; 2],
    size_px: [u32; 2],
}

#[derive(Serialize)]
struct MissingRecord {
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    quantity: Option<&'static str>,
    text: String,
}

#[derive(Serialize)]
struct TestRecord {
    quantity: &'static str,
    unit: &'static str,
    change: f64,
    p_value: f64,
    /// `null` if no change would be found.
    detectable: Option<f64>,
    limit: Option<f64>,
}

/// The JSON text of a check.
pub fn write(found: &Check) -> String {
    let names = |of: &[Quantity]| of.iter().map(|quantity| quantity.name()).collect();
    let missing = found.missing.iter().map(|missing| MissingRecord {
        kind: missing.name(),
        quantity: match missing {
            Missing::Undetermined { quantity, .. } => Some(quantity.name()),
            _ => None,
        },
        text: missing.to_string(),
    });
    let [camera_size_px, size_px] = found.sizes_px;
    let file = CheckFile {
        schema: SCHEMA,
        answer: found.answer.name(),
        changed: names(&found.changed),
        or: names(&found.or),
        missing: missing.collect(),
        p_value: found.p_value,
        tests: found.tests.iter().map(test).collect(),
        views: found.views,
        corners: found.corners,
        rms_px: found.rms_px,
        camera_size_px,
        size_px,
    };
    json::to_text(&file, 3)
}

fn test(found: &QuantityTest) -> TestRecord {
    TestRecord {
        quantity: found.quantity.name(),
        unit: found.quantity.unit(),
        change: found.change,
        p_value: found.p_value,
        detectable: Some(found.detectable).filter(|value| value.is_finite()),
        limit: found.limit,
    }
}
