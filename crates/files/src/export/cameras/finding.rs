//! Findings of a calibration (common properties of outliers) as JSON records.

use serde::Serialize;

use deltille_calibrate::{Diagnosis, Estimate, Finding, PanelRef, Shared, Words};

/// A finding in the form of the files; `panel` is an id, `camera` a name.
#[derive(Debug, Default, Serialize)]
pub(in crate::export) struct FindingRecord {
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    panel: Option<PanelRef>,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    view: Option<String>,
    /// Left, top, right, bottom.
    #[serde(skip_serializing_if = "Option::is_none")]
    region_px: Option<[f64; 4]>,
    outliers: usize,
    corners: usize,
    left_out: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    off_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    moved_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turned_rad: Option<f64>,
    /// The finding as a sentence.
    text: String,
}

/// The records of an estimate's findings.
pub(in crate::export) fn records(
    estimate: &Estimate,
    print_scale: Option<[f64; 2]>,
) -> Vec<FindingRecord> {
    let words = Words::new(estimate, print_scale);
    let record = |finding: &Finding| {
        let name = |camera: usize| estimate.camera_name(camera).map(str::to_owned);
        let counts = FindingRecord {
            outliers: finding.outliers,
            corners: finding.corners,
            left_out: finding.left_out,
            text: words.sentence(&Diagnosis::GrossErrors(finding.clone())),
            ..FindingRecord::default()
        };
        Some(match &finding.shared {
            Shared::Beyond { camera, view } => FindingRecord {
                kind: "outside_picture",
                camera: name(*camera),
                view: Some(view.clone()),
                ..counts
            },
            Shared::Panel { panel, moved } => FindingRecord {
                kind: "panel",
                panel: Some(*panel),
                moved_mm: moved.map(|moved| moved.by_mm),
                turned_rad: moved.map(|moved| moved.turned_rad),
                ..counts
            },
            Shared::PanelInView { panel, camera, view, off_px } => FindingRecord {
                kind: "panel_in_view",
                panel: Some(*panel),
                camera: name(*camera),
                view: Some(view.clone()),
                off_px: Some(*off_px),
                ..counts
            },
            Shared::View { camera, view } => FindingRecord {
                kind: "view",
                camera: name(*camera),
                view: Some(view.clone()),
                ..counts
            },
            Shared::Region { camera, from_px, to_px } => FindingRecord {
                kind: "region",
                camera: name(*camera),
                region_px: Some([from_px.x, from_px.y, to_px.x, to_px.y]),
                ..counts
            },
            Shared::Camera { camera } => {
                FindingRecord { kind: "camera", camera: name(*camera), ..counts }
            }
            _ => return None,
        })
    };
    estimate.findings.iter().filter_map(record).collect()
}
