//! Findings of a calibration (common properties of outliers) as JSON records.

use serde::Serialize;

use deltille_calibrate::{Diagnosis, Estimate, Finding, Messages, OutlierPattern, PanelRef};

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
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    col: Option<i32>,
    /// Whether the observations are in held-out views.
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_px: Option<f64>,
    outliers: usize,
    corners: usize,
    excluded: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    off_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    displacement_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation_rad: Option<f64>,
    /// The finding as a sentence.
    text: String,
}

/// The records of an estimate's findings.
pub(in crate::export) fn records(
    estimate: &Estimate,
    print_scale: Option<[f64; 2]>,
) -> Vec<FindingRecord> {
    let words = Messages::new(estimate, print_scale);
    let record = |finding: &Finding| {
        let name = |camera: usize| estimate.camera_name(camera).map(str::to_owned);
        let counts = FindingRecord {
            outliers: finding.outliers,
            corners: finding.corners,
            excluded: finding.is_excluded,
            text: words.sentence(&Diagnosis::CommonOutliers(finding.clone())),
            ..FindingRecord::default()
        };
        Some(match &finding.pattern {
            OutlierPattern::OutsideImage { camera, view } => FindingRecord {
                kind: "outside_image",
                camera: name(*camera),
                view: Some(view.clone()),
                ..counts
            },
            OutlierPattern::Panel { panel, moved } => FindingRecord {
                kind: "panel",
                panel: Some(*panel),
                displacement_mm: moved.map(|moved| moved.by_mm),
                rotation_rad: moved.map(|moved| moved.rotation_rad),
                ..counts
            },
            OutlierPattern::PanelInView { panel, camera, view, off_px } => FindingRecord {
                kind: "panel_in_view",
                panel: Some(*panel),
                camera: name(*camera),
                view: Some(view.clone()),
                off_px: Some(*off_px),
                ..counts
            },
            OutlierPattern::View { camera, view } => FindingRecord {
                kind: "view",
                camera: name(*camera),
                view: Some(view.clone()),
                ..counts
            },
            OutlierPattern::Region { camera, from_px, to_px } => FindingRecord {
                kind: "region",
                camera: name(*camera),
                region_px: Some([from_px.x, from_px.y, to_px.x, to_px.y]),
                ..counts
            },
            OutlierPattern::Corner { panel, row, col, rms_px, is_held_out } => FindingRecord {
                kind: "corner",
                panel: Some(*panel),
                row: Some(*row),
                col: Some(*col),
                held_out: Some(*is_held_out),
                rms_px: Some(*rms_px),
                ..counts
            },
            OutlierPattern::Offset { panel, row, col, offset_mm } => FindingRecord {
                kind: "offset",
                panel: Some(*panel),
                row: Some(*row),
                col: Some(*col),
                displacement_mm: Some(*offset_mm),
                ..counts
            },
            OutlierPattern::Camera { camera } => {
                FindingRecord { kind: "camera", camera: name(*camera), ..counts }
            }
            _ => return None,
        })
    };
    estimate.findings.iter().filter_map(record).collect()
}
