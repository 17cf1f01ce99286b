//! Calibrations of cameras and rigs, read back from their JSON.
//!
//! Quantities that a file does not hold stay empty: corners where residuals were not requested,
//! findings and lack of fit, which files describe in words, and refined panel poses, which are in
//! the refined target. The reasons for excluded views are the words of the file.

use deltille_calibrate::Matrix;
use glam::{DMat3, DQuat, DVec2, DVec3};
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use super::sheet::StoredShape;
use super::{calibration, rig};
use deltille_calibrate::{
    BoardShape, CameraEstimate, Corner, CornerOffset, Coverage, Estimate, Excluded, FrameEstimate,
    ObservedCovariance, PanelRef, Parameter, ProjectionUncertainty, Reason, Reference,
    SHAPE_COEFFICIENTS as COUNT, TargetEstimate, TargetMap, ViewEstimate,
};
use deltille_core::camera::{
    Camera, Lens, LensKind, PROJECTION_PARAMETERS, Pose, SplineGrid, is_rotation,
};
use deltille_core::json;
use deltille_core::json::ReadError;
use deltille_core::quantity;
use deltille_core::setting::Setting::{CalibrationWrite, RigWrite};
use deltille_core::targets::{Target, TargetIdentity, check_result_of};

/// Why a calibration cannot be read from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedError {
    /// The file is neither the calibration of a camera nor of a rig.
    #[error("not what {CalibrationWrite} or {RigWrite} made")]
    Foreign,
    /// A field is missing, or has an invalid value.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field, such as `cameras[1].views[3].rms_px`.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// The calibration was made with another target.
    #[error("{0}")]
    OtherTarget(String),
    /// A corner lies on a panel that the target does not have.
    #[error("panel {0} is not on the target")]
    Panel(u32),
}

/// Reads the estimate of a camera or a rig; `reference` is the target that was photographed.
///
/// # Errors
/// When the file is not a calibration, a field is not valid, or the calibration was made with another target.
pub fn read(text: &str, reference: &Reference) -> Result<Estimate, SavedError> {
    let found = estimate(text, Some(reference))?;
    let given: Vec<TargetIdentity> = reference.targets().iter().map(Target::identity).collect();
    check_result_of(&found.calibrated_with, &given).map_err(SavedError::OtherTarget)?;
    Ok(found)
}

fn estimate(text: &str, reference: Panels) -> Result<Estimate, SavedError> {
    let wrong = |error| match error {
        ReadError::Json(_) => SavedError::Foreign,
        ReadError::Field { field, problem } => SavedError::Field { field, problem },
    };
    match json::schema(text.as_bytes()).ok().flatten().as_deref() {
        Some(calibration::SCHEMA) => json::read::<Single>(text).map_err(wrong)?.estimate(reference),
        Some(rig::SCHEMA) => json::read::<Rig>(text).map_err(wrong)?.estimate(reference),
        _ => Err(SavedError::Foreign),
    }
}

/// Reads the estimate of a camera or a rig without knowing the target; the panels of corners are
/// then identified by id only.
///
/// # Errors
/// When the file is not a calibration, or a field is not valid.
pub fn read_without_target(text: &str) -> Result<Estimate, SavedError> {
    estimate(text, None)
}

/// Why the calibration of a file is not to be used as it is: the sentences of its [failures](calibration::is_failure).
pub fn failures(text: &str) -> Vec<String> {
    #[derive(Deserialize)]
    struct Saved {
        #[serde(default)]
        diagnoses: Vec<Said>,
    }
    #[derive(Deserialize)]
    struct Said {
        kind: String,
        text: String,
    }
    let said = serde_json::from_str::<Saved>(text).map(|saved| saved.diagnoses).unwrap_or_default();
    said.into_iter()
        .filter(|said| calibration::is_failure(&said.kind))
        .map(|said| said.text)
        .collect()
}

/// The target that was photographed, if known.
type Panels<'a> = Option<&'a Reference<'a>>;

fn panel(panels: Panels, target: Option<&str>, id: u32) -> Result<PanelRef, SavedError> {
    match panels {
        Some(reference) => reference.panel(target, id).ok_or(SavedError::Panel(id)),
        None => Ok(PanelRef::new(id as usize, id)),
    }
}

#[derive(Deserialize)]
struct Single {
    #[serde(flatten)]
    camera: SavedCamera,
    #[serde(flatten)]
    fit: Fit,
    held_out: Option<SingleHeldOut>,
}

#[derive(Deserialize)]
struct SingleHeldOut {
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    views: Vec<SavedView>,
    excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
struct Rig {
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    rms_px: Option<f64>,
    #[serde(default)]
    targets: Vec<SavedTarget>,
    cameras: Vec<SavedCamera>,
    frames: Vec<SavedFrame>,
    #[serde(flatten)]
    fit: Fit,
    held_out: Option<RigHeldOut>,
}

/// One of several targets.
#[derive(Deserialize)]
struct SavedTarget {
    name: String,
    panels: usize,
    scene_from_target: SavedPose,
}

#[derive(Deserialize)]
struct RigHeldOut {
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    cameras: Vec<SavedSeen>,
    frames: Vec<SavedFrame>,
    excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
struct SavedSeen {
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    views: Vec<SavedView>,
}

/// The fields about the whole fit that both kinds of files have.
#[derive(Deserialize)]
struct Fit {
    #[serde(deserialize_with = "quantity::deviation::de")]
    sigma: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    common_px: Option<f64>,
    #[serde(default)]
    calibrated_with: Vec<TargetIdentity>,
    board_shape: Option<SavedShape>,
    target_map: Option<SavedMap>,
    excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
struct SavedCamera {
    #[serde(default)]
    name: String,
    model: String,
    width: u32,
    height: u32,
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    spline: Option<SplineGrid>,
    parameters: Vec<SavedParameter>,
    #[serde(deserialize_with = "quantity::figure::de")]
    correlations: Vec<Vec<f64>>,
    loose: Vec<String>,
    projection: Option<SavedProjection>,
    camera_from_rig: Option<SavedPose>,
    #[serde(default)]
    delay_frames: i32,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    observed_pose_sd: Option<[f64; 6]>,
    /// Only in files written after 2026-11-24.
    coverage: Option<SavedCoverage>,
    views: Vec<SavedView>,
}

#[derive(Deserialize)]
struct SavedCoverage {
    columns: usize,
    rows: usize,
    corners: Vec<u32>,
}

#[derive(Deserialize)]
struct SavedProjection {
    #[serde(deserialize_with = "quantity::figure::de")]
    alignment: Vec<Vec<f64>>,
    #[serde(default, deserialize_with = "quantity::figure::de")]
    observed_correlations: Option<Vec<Vec<f64>>>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    observed_freedom: Option<f64>,
    #[serde(default, deserialize_with = "quantity::figure::de")]
    board_covariance: Option<Vec<Vec<f64>>>,
    #[serde(deserialize_with = "quantity::length_mm::de")]
    distances_mm: Vec<f64>,
}

#[derive(Deserialize)]
struct SavedParameter {
    name: String,
    #[serde(deserialize_with = "quantity::figure::de")]
    value: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    sd: Option<f64>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    observed_sd: Option<f64>,
}

#[derive(Deserialize)]
struct SavedFrame {
    name: String,
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    rig_from_target: SavedPose,
}

#[derive(Deserialize)]
struct SavedView {
    name: String,
    frame: Option<String>,
    image: String,
    #[serde(deserialize_with = "quantity::deviation::de")]
    rms_px: f64,
    camera_from_target: SavedPose,
    /// Absent unless residuals were requested.
    #[serde(default)]
    corners: Vec<SavedCorner>,
}

#[derive(Deserialize)]
struct SavedCorner {
    target: Option<String>,
    panel: u32,
    row: i32,
    col: i32,
    #[serde(deserialize_with = "quantity::figure::de")]
    x: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    y: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    dx: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    dy: f64,
    #[serde(default)]
    outlier: bool,
}

/// A rotation matrix, row by row.
fn rotation<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; 9], D::Error> {
    let rows: [f64; 9] = quantity::cosine::de(source)?;
    match is_rotation(&rows) {
        true => Ok(rows),
        false => Err(D::Error::custom("it is not a rotation")),
    }
}

#[derive(Deserialize)]
pub(in crate::export) struct SavedPose {
    #[serde(deserialize_with = "rotation")]
    rotation: [f64; 9],
    #[serde(deserialize_with = "quantity::figure::de")]
    translation_mm: DVec3,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    rotation_sd_rad: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    translation_sd_mm: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct SavedShape {
    #[serde(flatten)]
    shape: StoredShape,
    #[serde(deserialize_with = "quantity::deviation::de")]
    sd_mm: [f64; COUNT],
    #[serde(deserialize_with = "quantity::deviation::de")]
    bent_mm: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    stretched_mm: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    f_ratio: f64,
}

#[derive(Deserialize)]
struct SavedMap {
    #[serde(deserialize_with = "quantity::length_mm::de")]
    expected_mm: [f64; 2],
    corners: Vec<SavedOffset>,
}

#[derive(Deserialize)]
struct SavedOffset {
    target: Option<String>,
    panel: u32,
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    row: i32,
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    col: i32,
    #[serde(deserialize_with = "quantity::place_mm::de")]
    panel_mm: [f64; 3],
    #[serde(deserialize_with = "quantity::place_mm::de")]
    offset_mm: [f64; 3],
    #[serde(deserialize_with = "quantity::figure::de")]
    covariance_mm2: [[f64; 3]; 3],
    views: usize,
}

#[derive(Deserialize)]
struct SavedExcluded {
    camera: Option<String>,
    view: String,
    image: String,
    panel: Option<u32>,
    corners: usize,
    reason: String,
}

impl Single {
    fn estimate(self, reference: Panels) -> Result<Estimate, SavedError> {
        let Self { camera, fit, held_out } = self;
        let (rms_px, views) = (camera.rms_px, &camera.views);
        let frames = frames_of(views);
        let found = camera.estimate("", |index, _| Some(index), reference)?;
        let held_out = held_out.map(|test| -> Result<Estimate, SavedError> {
            let SingleHeldOut { rms_px, views, excluded } = test;
            let frames = frames_of(&views);
            let known = known(&found, rms_px, views, |index, _| Some(index), reference)?;
            let excluded = excluded.into_iter().map(SavedExcluded::read).collect();
            let mut estimate = Estimate::default();
            estimate.cameras = vec![known];
            (estimate.frames, estimate.rms_px, estimate.excluded) = (frames, rms_px, excluded);
            Ok(estimate)
        });
        let mut estimate = fit.estimate(reference)?;
        estimate.held_out = held_out.transpose()?.map(Box::new);
        estimate.cameras = vec![found];
        (estimate.frames, estimate.rms_px) = (frames, rms_px);
        Ok(estimate)
    }
}

impl Rig {
    fn estimate(self, reference: Panels) -> Result<Estimate, SavedError> {
        let Self { rms_px, targets, cameras, frames, fit, held_out } = self;
        let place =
            |frames: &[SavedFrame], name: &str| frames.iter().position(|frame| frame.name == name);
        let found = cameras.into_iter().map(|camera| {
            let name = camera.name.clone();
            camera.estimate(&name, |_, view| place(&frames, view), reference)
        });
        let cameras = found.collect::<Result<Vec<_>, _>>()?;
        let held_out = held_out.map(|test| -> Result<Estimate, SavedError> {
            let RigHeldOut { rms_px, cameras: seen, frames, excluded } = test;
            let seen = cameras.iter().zip(seen).map(|(found, SavedSeen { rms_px, views })| {
                known(found, rms_px, views, |_, view| place(&frames, view), reference)
            });
            let cameras = seen.collect::<Result<Vec<_>, _>>()?;
            let excluded = excluded.into_iter().map(SavedExcluded::read).collect();
            let frames = frames.into_iter().map(SavedFrame::read).collect();
            let mut estimate = Estimate::default();
            (estimate.cameras, estimate.frames) = (cameras, frames);
            (estimate.rms_px, estimate.excluded) = (rms_px, excluded);
            Ok(estimate)
        });
        let mut estimate = fit.estimate(reference)?;
        estimate.held_out = held_out.transpose()?.map(Box::new);
        estimate.frames = frames.into_iter().map(SavedFrame::read).collect();
        estimate.cameras = cameras;
        let mut first = 0;
        let targets = targets.into_iter().map(|target| {
            let panels = first..target.panels.saturating_add(first);
            first = panels.end;
            let place = &target.scene_from_target;
            let (scene_from_target, pose_sd) = (place.pose(), place.sd());
            TargetEstimate { name: target.name, panels, scene_from_target, pose_sd }
        });
        estimate.targets = targets.collect();
        let (sum, count) = estimate.corners().fold((0.0, 0), |(sum, count), corner| {
            (sum + corner.residual.length_squared(), count + 2)
        });
        estimate.rms_px = match count {
            0 => rms_px.unwrap_or_default(),
            _ => (sum / f64::from(count)).sqrt(),
        };
        Ok(estimate)
    }
}

impl Fit {
    fn estimate(self, reference: Panels) -> Result<Estimate, SavedError> {
        let mut estimate = Estimate::default();
        (estimate.sigma, estimate.common_px) = (self.sigma, self.common_px);
        estimate.calibrated_with = self.calibrated_with;
        estimate.shape = self.board_shape.map(SavedShape::read);
        estimate.map = self.target_map.map(|map| map.read(reference)).transpose()?;
        estimate.excluded = self.excluded.into_iter().map(SavedExcluded::read).collect();
        Ok(estimate)
    }
}

/// The frames of a single camera: one for each view.
fn frames_of(views: &[SavedView]) -> Vec<FrameEstimate> {
    let frames = views.iter().map(|view| FrameEstimate {
        name: view.name.clone(),
        rig_from_target: view.camera_from_target.pose(),
        pose_sd: view.camera_from_target.sd().unwrap_or_default(),
        rms_px: view.rms_px,
    });
    frames.collect()
}

/// A calibrated camera with other views.
fn known(
    found: &CameraEstimate,
    rms_px: f64,
    views: Vec<SavedView>,
    frame: impl Fn(usize, &str) -> Option<usize>,
    reference: Panels,
) -> Result<CameraEstimate, SavedError> {
    let mut camera = CameraEstimate::given(&found.name, found.camera.clone());
    camera.camera_from_rig = found.camera_from_rig;
    camera.views = estimates(views, frame, reference)?;
    camera.rms_px = rms_px;
    Ok(camera)
}

fn estimates(
    views: Vec<SavedView>,
    frame: impl Fn(usize, &str) -> Option<usize>,
    reference: Panels,
) -> Result<Vec<ViewEstimate>, SavedError> {
    let read = |(index, view): (usize, SavedView)| {
        let shown = view.frame.as_ref().unwrap_or(&view.name);
        let frame = frame(index, shown).ok_or_else(|| SavedError::Field {
            field: "views".to_owned(),
            problem: format!("{shown} is no frame"),
        })?;
        let corners = view.corners.iter().map(|corner| {
            let panel = panel(reference, corner.target.as_deref(), corner.panel)?;
            Ok(corner.read(panel))
        });
        Ok(ViewEstimate {
            corners: corners.collect::<Result<_, SavedError>>()?,
            pose: view.camera_from_target.pose(),
            name: view.name,
            image: view.image,
            frame,
            rms_px: view.rms_px,
        })
    };
    views.into_iter().enumerate().map(read).collect()
}

impl SavedCamera {
    fn estimate(
        self,
        name: &str,
        frame: impl Fn(usize, &str) -> Option<usize>,
        reference: Panels,
    ) -> Result<CameraEstimate, SavedError> {
        let field = |field: &str, problem: &str| SavedError::Field {
            field: field.to_owned(),
            problem: problem.to_owned(),
        };
        let names: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
        let spline = self.spline.map(SplineGrid::checked).transpose();
        let spline = spline.map_err(|problem| field("spline", &problem.to_string()))?;
        let blank = lens_of(&names, spline)
            .map(|lens| Camera::centred(self.width, self.height, 1.0, lens))
            .ok_or_else(|| field("parameters", "they are those of no lens here"))?;
        let values: Vec<f64> = self.parameters.iter().map(|p| p.value).collect();
        let sds: Vec<f64> = self.parameters.iter().filter_map(|p| p.sd).collect();
        let covariance = covariance_of(&self.correlations, &sds)
            .ok_or_else(|| field("correlations", "there is not one for each pair of parameters"))?;
        let observed: Vec<f64> = self.parameters.iter().filter_map(|p| p.observed_sd).collect();
        let projection = self.projection.map(|known| known.read(sds.len(), &observed));
        let projection = projection.transpose().map_err(|wrong| field("projection", wrong))?;
        let parameters = self.parameters.iter();
        let parameters =
            parameters.map(|p| Parameter { name: p.name.clone(), value: p.value, sd: p.sd });
        let place = self.camera_from_rig.as_ref();
        let mut camera = CameraEstimate::given(name, blank.with_parameters(&values));
        camera.model = self.model.parse().ok();
        camera.parameters = parameters.collect();
        camera.covariance = covariance;
        camera.projection = projection;
        camera.ill_conditioned = self.loose;
        camera.camera_from_rig = place.map_or(Pose::IDENTITY, SavedPose::pose);
        camera.pose_sd = place.and_then(SavedPose::sd);
        camera.observed_pose_sd = self.observed_pose_sd;
        camera.delay = self.delay_frames;
        let coverage = self.coverage.map(|of| {
            Coverage::new(of.columns, of.rows, of.corners)
                .ok_or_else(|| field("coverage", "there is not a number for each cell"))
        });
        camera.coverage = coverage.transpose()?;
        camera.views = estimates(self.views, frame, reference)?;
        camera.rms_px = self.rms_px;
        Ok(camera)
    }
}

/// The covariance matrix from correlations and standard deviations; `None` where there is not one
/// correlation for each pair.
fn covariance_of(rows: &[Vec<f64>], sds: &[f64]) -> Option<Matrix> {
    let n = sds.len();
    // For a spline only the lower triangle is stored.
    let has_all = |(i, row): (usize, &Vec<f64>)| row.len() == n || row.len() == i + 1;
    let is_whole = rows.len() == n && rows.iter().enumerate().all(has_all);
    let of = |i: usize, j: usize| rows[i].get(j).copied().unwrap_or_else(|| rows[j][i]);
    is_whole.then(|| Matrix::from_fn(n, n, |i, j| of(i, j) * sds[i] * sds[j]))
}

impl SavedProjection {
    /// `found` is the number of estimated parameters, `sds` are their observed standard deviations.
    fn read(self, found: usize, sds: &[f64]) -> Result<ProjectionUncertainty, &'static str> {
        let Self { alignment, observed_correlations, observed_freedom, .. } = self;
        let (board, distances_mm) = (self.board_covariance, self.distances_mm);
        if alignment.len() != 6 || alignment.iter().any(|row| row.len() != found) {
            return Err("`alignment` has not six rows with a number for each parameter");
        }
        let alignment = Matrix::from_fn(6, found, |i, j| alignment[i][j]);
        let observed = observed_correlations.zip(observed_freedom).map(|(rows, freedom)| {
            let covariance = covariance_of(&rows, sds).filter(|_| sds.len() == found);
            let covariance = covariance
                .ok_or("`observed_correlations` are not one for each pair of parameters")?;
            let of_board = board.map(|rows| {
                covariance_of(&rows, &vec![1.0; found])
                    .ok_or("`board_covariance` has not a number for each pair of parameters")
            });
            Ok(ObservedCovariance { covariance, of_board: of_board.transpose()?, freedom })
        });
        Ok(ProjectionUncertainty::new(alignment, distances_mm, observed.transpose()?))
    }
}

/// The lens whose camera has parameters of these names.
fn lens_of(names: &[&str], spline: Option<SplineGrid>) -> Option<Lens> {
    let terms = names.len().saturating_sub(PROJECTION_PARAMETERS.len());
    let of_kind = |kind: &LensKind| [None, spline].map(|grid| kind.lens(terms, grid));
    let mut lenses = LensKind::ALL.iter().flat_map(of_kind).flatten();
    lenses.find(|lens| Camera::centred(1, 1, 1.0, lens.clone()).parameter_names() == names)
}

impl SavedPose {
    pub(in crate::export) fn pose(&self) -> Pose {
        let rotation = DMat3::from_cols_array(&self.rotation).transpose();
        Pose { rotation: DQuat::from_mat3(&rotation).normalize(), translation: self.translation_mm }
    }

    fn sd(&self) -> Option<[f64; 6]> {
        let ([a, b, c], [d, e, f]) = (self.rotation_sd_rad?, self.translation_sd_mm?);
        Some([a, b, c, d, e, f])
    }
}

impl SavedFrame {
    fn read(self) -> FrameEstimate {
        FrameEstimate {
            rig_from_target: self.rig_from_target.pose(),
            pose_sd: self.rig_from_target.sd().unwrap_or_default(),
            name: self.name,
            rms_px: self.rms_px,
        }
    }
}

impl SavedCorner {
    fn read(&self, panel: PanelRef) -> Corner {
        let Self { row, col, outlier, .. } = *self;
        let (pixel, residual) = (DVec2::new(self.x, self.y), DVec2::new(self.dx, self.dy));
        Corner { panel, row, col, pixel, residual, outlier }
    }
}

impl SavedShape {
    fn read(self) -> BoardShape {
        let Self { shape, sd_mm, f_ratio, bent_mm, stretched_mm } = self;
        BoardShape { shape: shape.shape(), sd_mm, f_ratio, bent_mm, stretched_mm }
    }
}

impl SavedMap {
    fn read(self, reference: Panels) -> Result<TargetMap, SavedError> {
        let corners = self.corners.into_iter().map(|corner| {
            let panel = panel(reference, corner.target.as_deref(), corner.panel)?;
            let SavedOffset { row, col, covariance_mm2, views, .. } = corner;
            let [panel_mm, offset_mm] = [corner.panel_mm, corner.offset_mm].map(DVec3::from);
            Ok(CornerOffset { panel, row, col, panel_mm, offset_mm, covariance_mm2, views })
        });
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        Ok(TargetMap::new(corners, self.expected_mm))
    }
}

impl SavedExcluded {
    fn read(self) -> Excluded {
        let Self { camera, view, image, panel, corners, reason } = self;
        Excluded { camera, view, image, panel, corners, reason: Reason::Foreign(reason) }
    }
}
