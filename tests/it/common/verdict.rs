use deltille::verify::{Finding, Verdict};
use serde_json::Value;

/// Asserts that a verdict is bad, and has findings with each of these fields; lengths in mm to within 50 nm.
#[track_caller]
pub fn assert_found<const N: usize>(verdict: &Verdict, expected: [Value; N]) {
    assert!(!verdict.passed, "{verdict}");
    let all: Vec<Value> = findings(verdict).map(|one| serde_json::to_value(one).unwrap()).collect();
    for expected in expected {
        let is_found = all.iter().any(|found| has(found, &expected));
        assert!(is_found, "no {expected} in {}", Value::from(all));
    }
}

/// Returns all findings, of the file, of its pages and of its faces.
pub fn findings(verdict: &Verdict) -> impl Iterator<Item = &Finding> {
    let sheets = verdict.sheets.iter().flat_map(|sheet| &sheet.findings);
    let faces = verdict.faces.iter().flat_map(|face| &face.findings);
    verdict.findings.iter().chain(sheets).chain(faces)
}

/// Returns whether a value is as expected; objects may have more fields.
fn has(found: &Value, expected: &Value) -> bool {
    match (found, expected) {
        (Value::Object(found), Value::Object(fields)) => fields
            .iter()
            .all(|(name, expected)| found.get(name).is_some_and(|found| has(found, expected))),
        (Value::Array(found), Value::Array(expected)) if found.len() == expected.len() => {
            found.iter().zip(expected).all(|(found, expected)| has(found, expected))
        }
        (Value::Number(found), Value::Number(expected)) => {
            (found.as_f64().unwrap() - expected.as_f64().unwrap()).abs() < 5e-5
        }
        _ => found == expected,
    }
}
