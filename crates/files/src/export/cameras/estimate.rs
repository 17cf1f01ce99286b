//! Records shared by the files of single cameras and of rigs.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use super::motion::Motion;
use deltille_calibrate::{
    Alternative, BoardShape, CameraEstimate, ChangedIntrinsic, Coverage, Diagnosis, Estimate,
    LackOfFit, LensLimit, Matrix, Messages, ObservedCovariance, PanelRef, Source, TargetMap,
    ViewEstimate,
};
use deltille_core::camera::{Lens, SplineGrid};
use deltille_core::detection::InkEstimate;

/// Measurements of the print that was photographed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Print {
    /// Print scale (measured length / stated length) across and up the sheet; `None` if it was not measured.
    pub scale: Option<[f64; 2]>,
    /// Ink spread estimated from the detections; `None` if it was not estimated.
    pub ink: Option<InkEstimate>,
}

/// Whether a file lists the residual of every corner. These residuals take up nearly all of its
/// size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residuals {
    /// Views contain only their number of corners and the RMS residual.
    #[default]
    Omitted,
    /// Views list all corners.
    Listed,
}

/// The knot grid of a camera with a spline lens.
pub(in crate::export) fn spline(camera: &CameraEstimate) -> Option<SplineGrid> {
    match &camera.camera.lens {
        Lens::Spline(spline) => Some(spline.grid()),
        _ => None,
    }
}

#[derive(Serialize)]
pub(in crate::export) struct ParameterRecord<'a> {
    name: &'a str,
    value: f64,
    sd: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    observed_sd: Option<f64>,
}

/// Uncertainty of the projections of a camera.
#[derive(Serialize)]
pub(in crate::export) struct ProjectionRecord {
    /// For a rotation (rad) and a translation (mm) along each axis, the derivative with respect to
    /// each estimated parameter.
    alignment: Vec<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    observed_correlations: Option<Vec<Vec<f64>>>,
    /// Degrees of freedom of the observed covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    observed_freedom: Option<f64>,
    /// The contribution of board errors to the observed covariance, lower triangle.
    #[serde(skip_serializing_if = "Option::is_none")]
    board_covariance: Option<Vec<Vec<f64>>>,
    distances_mm: Vec<f64>,
    maps: Vec<UncertaintyRecord>,
}

/// Observed covariance of the unknowns of all cameras of a rig.
#[derive(Serialize)]
pub(in crate::export) struct JointRecord {
    /// Lower triangle.
    covariance: Vec<Vec<f64>>,
    freedom: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_covariance: Option<Vec<Vec<f64>>>,
}

/// Standard deviation of projections over the image, row by row.
#[derive(Serialize)]
struct UncertaintyRecord {
    distance_mm: Option<f64>,
    from: &'static str,
    columns: usize,
    rows: usize,
    sd_px: Vec<Option<f64>>,
}

#[derive(Serialize)]
pub(in crate::export) struct ViewRecord<'a> {
    name: &'a str,
    /// The frame of the view, if its name differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<&'a str>,
    image: &'a str,
    rms_px: f64,
    outliers: usize,
    corner_count: usize,
    camera_from_target: Motion,
    /// Row, column, x, y, dx, dy of each corner, by panel, if they are listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    corners: Option<Vec<CornerRecord<'a>>>,
}

/// Number of corners in each cell of the image, row by row.
#[derive(Serialize)]
pub(in crate::export) struct CoverageRecord {
    columns: usize,
    rows: usize,
    corners: Vec<u32>,
}

#[derive(Serialize)]
struct CornerRecord<'a> {
    /// Name of the target, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<&'a str>,
    panel: PanelRef,
    row: i32,
    col: i32,
    x: f64,
    y: f64,
    dx: f64,
    dy: f64,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    outlier: bool,
}

#[derive(Serialize)]
pub(in crate::export) struct ShapeRecord {
    middle_mm: DVec3,
    reach_mm: f64,
    /// b₁ … b₇, a₁, a₂ of [`deltille_calibrate::Shape`].
    coefficients_mm: Vec<f64>,
    sd_mm: Vec<f64>,
    bent_mm: f64,
    stretched_mm: f64,
    f_ratio: f64,
    significant: bool,
}

/// A diagnosis of an estimate that is not a finding, with the figures used in its text.
#[derive(Debug, Default, Serialize)]
pub(in crate::export) struct DiagnosisRecord<'a> {
    pub(super) kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    panel: Option<PanelRef>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_mm: Option<f64>,
    /// Delay of a camera, in frames, or number of frames in which labels were rotated.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    excluded: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    all: Option<usize>,
    /// The smallest rotation after which the board looks the same, degrees, and whether only the selected labels fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    degrees: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    confirmed: Option<bool>,
    /// Parameters of another camera that also explains the views.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    other: BTreeMap<String, f64>,
    /// Radius up to which the lens model is usable, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    monotonic_px: Option<f64>,
    /// The remedy that was tried (another lens model, or a quantity estimated instead of fixed),
    /// and the resulting RMS residual.
    #[serde(skip_serializing_if = "Option::is_none")]
    alternative: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_px_then: Option<f64>,
    /// First view after a change of the camera, the changed intrinsic before and after, and the standard deviation of the
    /// difference, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_view: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    focal_px: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cx_px: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cy_px: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sd_px: Option<f64>,
    /// Displacement between the first and the last row, px, and the number of views that show it.
    #[serde(skip_serializing_if = "Option::is_none")]
    shear_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    views: Option<usize>,
    /// Ratio of the board's length along x to its length along y, relative to the description (1 if
    /// they agree), and its standard deviation.
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio_sd: Option<f64>,
    /// Probability that noise alone has at least this effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    significance: Option<f64>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    parameters: &'a [String],
    /// Difference between a prior and the views, in standard deviations.
    #[serde(skip_serializing_if = "Option::is_none")]
    deviations: Option<f64>,
    /// A smaller lens model that fits as well.
    #[serde(skip_serializing_if = "Option::is_none")]
    sufficient: Option<String>,
    pub(super) text: String,
}

pub(in crate::export) fn parameters(camera: &CameraEstimate) -> Vec<ParameterRecord<'_>> {
    let parameters = camera.parameters.iter().zip(camera.observed_sd());
    parameters
        .map(|(p, observed_sd)| ParameterRecord {
            name: &p.name,
            value: p.value,
            sd: p.sd,
            observed_sd,
        })
        .collect()
}

fn lower_triangle(matrix: &Matrix) -> Vec<Vec<f64>> {
    (0..matrix.rows()).map(|i| (0..=i).map(|j| matrix[(i, j)]).collect()).collect()
}

pub(in crate::export) fn projection(camera: &CameraEstimate) -> Option<ProjectionRecord> {
    let known = camera.projection.as_ref()?;
    let (rows, columns) = (known.alignment.rows(), known.alignment.columns());
    let row = |i: usize| (0..columns).map(|j| known.alignment[(i, j)]).collect();
    let maps = camera.uncertainty_maps().into_iter().map(|map| UncertaintyRecord {
        distance_mm: map.distance_mm,
        from: match map.source {
            Source::Noise => "noise",
            Source::Observed => "observed",
        },
        columns: map.columns,
        rows: map.rows,
        // Standard deviations need few digits.
        sd_px: map.sd_px.iter().map(|sd| sd.map(|sd| (sd * 1e5).round() / 1e5)).collect(),
    });
    Some(ProjectionRecord {
        alignment: (0..rows).map(row).collect(),
        observed_correlations: known
            .observed
            .as_ref()
            .map(|of| correlations_of(&of.covariance, spline(camera).is_some())),
        observed_freedom: known.observed.as_ref().map(|of| of.freedom),
        board_covariance: known
            .observed
            .as_ref()
            .and_then(|of| of.of_board.as_ref())
            .map(lower_triangle),
        distances_mm: known.distances_mm.clone(),
        maps: maps.collect(),
    })
}

pub(in crate::export) fn joint(known: &ObservedCovariance) -> JointRecord {
    JointRecord {
        covariance: lower_triangle(&known.covariance),
        freedom: known.freedom,
        board_covariance: known.of_board.as_ref().map(lower_triangle),
    }
}

/// Correlations of a covariance. With many parameters, only the lower triangle is written, to nine
/// digits: the file of a fisheye spline would otherwise take 30 MB.
fn correlations_of(covariance: &Matrix, are_many: bool) -> Vec<Vec<f64>> {
    let c = covariance;
    let of = |i: usize, j: usize| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
    if are_many {
        let rounded = |i: usize, j: usize| (of(i, j) * 1e9).round() / 1e9;
        return (0..c.rows()).map(|i| (0..=i).map(|j| rounded(i, j)).collect()).collect();
    }
    (0..c.rows()).map(|i| (0..c.rows()).map(|j| of(i, j)).collect()).collect()
}

pub(in crate::export) fn correlations(camera: &CameraEstimate) -> Vec<Vec<f64>> {
    correlations_of(&camera.covariance, spline(camera).is_some())
}

pub(in crate::export) fn coverage(camera: &CameraEstimate) -> CoverageRecord {
    let of = Coverage::of(camera);
    let [columns, rows] = of.cells();
    CoverageRecord { columns, rows, corners: of.counts().to_vec() }
}

/// The views of a camera; poses have standard deviations for a single camera.
pub(in crate::export) fn views<'a>(
    estimate: &'a Estimate,
    camera: &'a CameraEstimate,
    residuals: Residuals,
) -> Vec<ViewRecord<'a>> {
    let is_rig_frame = camera.pose_sd.is_none() && estimate.cameras.len() == 1;
    let record = |view: &'a ViewEstimate| {
        let of_view = estimate.frames.get(view.frame);
        let frame = of_view.filter(|_| is_rig_frame);
        let other = of_view.filter(|frame| camera.delay != 0 && frame.name != view.name);
        let corners = view.corners.iter().map(|corner| CornerRecord {
            target: estimate.target_name(corner.panel),
            panel: corner.panel,
            row: corner.row,
            col: corner.col,
            x: corner.pixel.x,
            y: corner.pixel.y,
            dx: corner.residual.x,
            dy: corner.residual.y,
            outlier: corner.outlier,
        });
        ViewRecord {
            name: &view.name,
            frame: other.map(|frame| frame.name.as_str()),
            image: &view.image,
            rms_px: view.rms_px,
            outliers: view.outlier_count(),
            corner_count: view.corners.len(),
            camera_from_target: Motion::new(&view.pose, frame.map(|frame| frame.pose_sd)),
            corners: (residuals == Residuals::Listed).then(|| corners.collect()),
        }
    };
    camera.views.iter().map(record).collect()
}

pub(in crate::export) fn shape(found: BoardShape) -> ShapeRecord {
    ShapeRecord {
        middle_mm: found.shape.middle_mm,
        reach_mm: found.shape.reach_mm,
        coefficients_mm: found.shape.coefficients_mm.to_vec(),
        sd_mm: found.sd_mm.to_vec(),
        bent_mm: found.bent_mm,
        stretched_mm: found.stretched_mm,
        f_ratio: found.f_ratio,
        significant: found.is_significant(),
    }
}

/// The measured offsets of the corners of a target.
#[derive(Serialize)]
pub(in crate::export) struct MapRecord<'a> {
    expected_mm: [f64; 2],
    rms_mm: [f64; 2],
    significant: usize,
    corners: Vec<OffsetRecord<'a>>,
}

#[derive(Serialize)]
struct OffsetRecord<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<&'a str>,
    panel: PanelRef,
    row: i32,
    col: i32,
    panel_mm: [f64; 3],
    offset_mm: [f64; 3],
    covariance_mm2: &'a [[f64; 3]; 3],
    views: usize,
    /// RMS residual per axis in held-out views, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out_px: Option<f64>,
}

/// The record of the measured corners of a target.
pub(in crate::export) fn map<'a>(estimate: &'a Estimate, found: &'a TargetMap) -> MapRecord<'a> {
    let held_out = estimate.held_out.as_ref().map(|test| test.rms_of_corners()).unwrap_or_default();
    let corners = found.corners().iter().map(|corner| OffsetRecord {
        target: estimate.target_name(corner.panel),
        panel: corner.panel,
        row: corner.row,
        col: corner.col,
        panel_mm: corner.panel_mm.to_array(),
        offset_mm: corner.offset_mm.to_array(),
        covariance_mm2: &corner.covariance_mm2,
        views: corner.views,
        held_out_px: held_out.get(&(corner.panel, corner.row, corner.col)).copied(),
    });
    MapRecord {
        expected_mm: found.expected_mm,
        rms_mm: found.rms_mm(),
        significant: found.significant().count(),
        corners: corners.collect(),
    }
}

/// Kinds of diagnoses, as files name them, that make a calibration unusable.
const FAILURES: [&str; 5] =
    ["wrong_camera", "unusable_fit", "many_excluded", "many_panels_excluded", "changed_camera"];

/// Whether a diagnosis of this kind in a file makes the calibration unusable, as [`Diagnosis::is_failure`] does.
pub fn is_failure(kind: &str) -> bool {
    FAILURES.contains(&kind)
}

/// The diagnoses that are not findings, which files list separately.
pub(in crate::export) fn diagnoses<'a>(
    estimate: &'a Estimate,
    diagnoses: &'a [Diagnosis],
    print_scale: Option<[f64; 2]>,
) -> Vec<DiagnosisRecord<'a>> {
    let words = Messages::new(estimate, print_scale);
    let record = |diagnosis: &'a Diagnosis| {
        let record = DiagnosisRecord::of(diagnosis, estimate)?;
        Some(DiagnosisRecord { text: words.sentence(diagnosis), ..record })
    };
    diagnoses.iter().filter_map(record).collect()
}

impl<'a> DiagnosisRecord<'a> {
    /// The record without its sentence; `None` for findings.
    fn of(diagnosis: &'a Diagnosis, estimate: &'a Estimate) -> Option<Self> {
        let of_camera = |kind, camera: &usize| Self::of_camera(kind, *camera, estimate);
        let misfit =
            |kind, camera, rms_px: &f64| Self { rms_px: Some(*rms_px), ..of_camera(kind, camera) };
        let many = |kind, excluded: &usize, all: &usize| Self {
            excluded: Some(*excluded),
            all: Some(*all),
            ..Self::new(kind)
        };
        Some(match diagnosis {
            Diagnosis::WrongCamera { camera, rms_px } => misfit("wrong_camera", camera, rms_px),
            Diagnosis::UnusableFit { camera, rms_px } => misfit("unusable_fit", camera, rms_px),
            Diagnosis::ManyExcluded { excluded, all } => many("many_excluded", excluded, all),
            Diagnosis::ManyPanelsExcluded { excluded, all } => {
                many("many_panels_excluded", excluded, all)
            }
            Diagnosis::DelayedCamera { camera, frames } => {
                Self { frames: Some(*frames), ..of_camera("delayed_camera", camera) }
            }
            Diagnosis::LabelsRotated { camera, rotation } => Self {
                degrees: Some(rotation.degrees),
                frames: Some(rotation.frames as i32),
                all: Some(rotation.of),
                confirmed: Some(rotation.is_confirmed),
                ..of_camera("labels_rotated", camera)
            },
            Diagnosis::AmbiguousLabels { degrees } => {
                Self { degrees: Some(*degrees), ..Self::new("ambiguous_labels") }
            }
            Diagnosis::SecondMinimum { camera, other, rms_px } => Self {
                rms_px_then: Some(*rms_px),
                other: other.parameter_names().into_iter().zip(other.parameters()).collect(),
                ..of_camera("second_minimum", camera)
            },
            Diagnosis::NonMonotonicLens { camera, end: LensLimit { monotonic_px, .. } } => Self {
                monotonic_px: Some(*monotonic_px),
                ..of_camera("non_monotonic_lens", camera)
            },
            Diagnosis::Remedied { camera, remedy } => Self {
                rms_px: Some(remedy.from_px),
                rms_px_then: Some(remedy.to_px),
                views: Some(remedy.excluded_views).filter(|views| *views > 0),
                alternative: Some(alternative(remedy.alternative)?),
                ..of_camera("remedy", camera)
            },
            Diagnosis::LackOfFit(LackOfFit::Lens { camera, rms_px }) => {
                misfit("pattern_over_image", camera, rms_px)
            }
            Diagnosis::LackOfFit(LackOfFit::Target { panel, rms_px, rms_mm }) => Self {
                panel: Some(*panel),
                rms_px: Some(*rms_px),
                rms_mm: Some(*rms_mm),
                ..Self::new("pattern_over_target")
            },
            Diagnosis::PoorFit { camera, rms_px } => misfit("poor_fit", camera, rms_px),
            Diagnosis::WrongConstraint { camera, constraint, deviations } => Self {
                parameters: constraint.parameters(),
                deviations: Some(*deviations),
                ..of_camera("wrong_constraint", camera)
            },
            Diagnosis::IllConditioned { camera, parameters, sufficient } => Self {
                parameters,
                sufficient: sufficient.map(|model| model.to_string()),
                ..of_camera("ill_conditioned", camera)
            },
            _ => return Self::of_state(diagnosis, estimate),
        })
    }

    /// The record of a camera or a board that differs between views, rows or directions.
    fn of_state(diagnosis: &'a Diagnosis, estimate: &'a Estimate) -> Option<Self> {
        let of_camera = |kind, camera: &usize, left_px, significance| Self {
            rms_px_then: Some(left_px),
            significance: Some(significance),
            ..Self::of_camera(kind, *camera, estimate)
        };
        Some(match diagnosis {
            Diagnosis::ChangedCamera { camera, change } => Self {
                from_view: Some(&change.from_view),
                focal_px: change.of(ChangedIntrinsic::Focal),
                cx_px: change.of(ChangedIntrinsic::CentreX),
                cy_px: change.of(ChangedIntrinsic::CentreY),
                sd_px: Some(change.sd_px),
                ..of_camera("changed_camera", camera, change.left_px, change.significance)
            },
            Diagnosis::RollingShutter { camera, shutter } => Self {
                shear_px: Some(shutter.shear_px),
                views: Some(shutter.views),
                ..of_camera("rolling_shutter", camera, shutter.left_px, shutter.significance)
            },
            Diagnosis::StretchedBoard { camera, stretch } => Self {
                ratio: Some(stretch.ratio),
                ratio_sd: Some(stretch.sd),
                ..of_camera("stretched_board", camera, stretch.left_px, stretch.significance)
            },
            _ => return None,
        })
    }

    fn of_camera(kind: &'static str, camera: usize, estimate: &'a Estimate) -> Self {
        Self { camera: estimate.camera_name(camera), ..Self::new(kind) }
    }

    fn new(kind: &'static str) -> Self {
        Self { kind, ..Self::default() }
    }
}

/// The name of an alternative in files.
fn alternative(tried: Alternative) -> Option<String> {
    Some(match tried {
        Alternative::Model(model) => model.to_string(),
        Alternative::Shape => "board_shape".to_owned(),
        Alternative::Panels => "panels".to_owned(),
        Alternative::Camera => "camera".to_owned(),
        Alternative::Constraints => "constraints".to_owned(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failure_kinds_in_files_match_the_library() {
        let mut estimate = Estimate::default();
        estimate.cameras = vec![CameraEstimate::given("camera", test_camera())];
        let all = [
            Diagnosis::WrongCamera { camera: 0, rms_px: 100.0 },
            Diagnosis::UnusableFit { camera: 0, rms_px: 100.0 },
            Diagnosis::ManyExcluded { excluded: 5, all: 8 },
            Diagnosis::ManyPanelsExcluded { excluded: 5, all: 8 },
            Diagnosis::PoorFit { camera: 0, rms_px: 2.0 },
            Diagnosis::DelayedCamera { camera: 0, frames: 1 },
        ];
        for (said, record) in all.iter().zip(diagnoses(&estimate, &all, None)) {
            assert_eq!(is_failure(record.kind), said.is_failure(), "{}", record.kind);
        }
    }

    fn test_camera() -> deltille_core::camera::Camera {
        deltille_core::camera::Camera::from_yaml(
            r#"{"width": 640, "height": 480, "focal_px": [500, 500], "centre_px": [320, 240], "model": "pinhole"}"#,
        )
        .unwrap()
    }
}
