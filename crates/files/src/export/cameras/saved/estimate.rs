//! Conversion of the records of a file into an [`Estimate`].

use deltille_calibrate::{
    BoardShape, CameraEstimate, Corner, CornerOffset, Coverage, Estimate, Excluded, FrameEstimate,
    Matrix, ObservedCovariance, PanelRef, Parameter, ProjectionUncertainty, Reason, Reference,
    TargetEstimate, TargetMap, ViewEstimate,
};
use deltille_core::camera::{Camera, Lens, LensKind, PROJECTION_PARAMETERS, Pose, SplineGrid};
use deltille_core::quantity;
use glam::{DVec2, DVec3};

use super::super::constraint::ConstraintRecord;
use super::error::SavedError;
use super::record::{
    Fit, Rig, RigHeldOut, SavedCamera, SavedCorner, SavedExcluded, SavedFrame, SavedJoint,
    SavedMap, SavedOffset, SavedPose, SavedProjection, SavedSeen, SavedShape, SavedView, Single,
    SingleHeldOut,
};

/// The target that was photographed, if it is known.
pub(super) type Panels<'a> = Option<&'a Reference<'a>>;

fn panel(panels: Panels, target: Option<&str>, id: u32) -> Result<PanelRef, SavedError> {
    match panels {
        Some(reference) => reference.panel(target, id).ok_or(SavedError::Panel(id)),
        None => Ok(PanelRef::new(id as usize, id)),
    }
}

impl Single {
    pub(super) fn estimate(self, reference: Panels) -> Result<Estimate, SavedError> {
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
    pub(super) fn estimate(self, reference: Panels) -> Result<Estimate, SavedError> {
        let Self { rms_px, targets, cameras, joint, frames, fit, held_out } = self;
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
        let joint = joint.map(SavedJoint::read).transpose();
        estimate.joint = joint.map_err(|problem| SavedError::Field {
            field: "joint".to_owned(),
            problem: problem.to_owned(),
        })?;
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

/// A known camera evaluated on other views, in which only the poses were estimated.
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
            problem: format!("unknown frame {shown}"),
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
            .ok_or_else(|| field("parameters", "no known lens has these parameters"))?;
        let values: Vec<f64> = self.parameters.iter().map(|p| p.value).collect();
        let sds: Vec<f64> = self.parameters.iter().filter_map(|p| p.sd).collect();
        let covariance = of_correlations(&self.correlations, &sds).ok_or_else(|| {
            field(
                "correlations",
                "expected those of a positive definite matrix, one for each pair of parameters",
            )
        })?;
        let observed: Vec<f64> = self.parameters.iter().filter_map(|p| p.observed_sd).collect();
        let projection = self.projection.map(|known| known.read(sds.len(), &observed));
        let projection = projection.transpose().map_err(|wrong| field("projection", wrong))?;
        let parameters = self.parameters.iter();
        let parameters =
            parameters.map(|p| Parameter { name: p.name.clone(), value: p.value, sd: p.sd });
        let place = self.camera_from_rig.as_ref();
        let camera = blank.with_parameters(&values);
        for focal in camera.focal_px.to_array() {
            let checked = quantity::focal_px::RANGE.check(focal);
            checked.map_err(|wrong| field("parameters", &format!("focal length: {wrong}")))?;
        }
        let mut camera = CameraEstimate::given(name, camera);
        camera.model = self.model.parse().ok();
        camera.parameters = parameters.collect();
        camera.constraints = self.constraints.into_iter().map(ConstraintRecord::read).collect();
        camera.covariance = covariance;
        camera.projection = projection;
        camera.ill_conditioned = self.ill_conditioned;
        camera.camera_from_rig = place.map_or(Pose::IDENTITY, SavedPose::pose);
        camera.pose_sd = place.and_then(SavedPose::sd);
        camera.observed_pose_sd = self.observed_pose_sd;
        camera.delay = self.delay_frames;
        let coverage = self.coverage.map(|of| {
            Coverage::new(of.columns, of.rows, of.corners)
                .ok_or_else(|| field("coverage", "expected one number for each cell"))
        });
        camera.coverage = coverage.transpose()?;
        camera.views = estimates(self.views, frame, reference)?;
        camera.rms_px = self.rms_px;
        Ok(camera)
    }
}

/// Tolerance of the correlation of a parameter with itself.
const UNIT: f64 = 1e-6;

/// The covariance matrix from correlations and standard deviations; `None` if a pair of parameters has no correlation, or an
/// impossible one.
fn of_correlations(rows: &[Vec<f64>], sds: &[f64]) -> Option<Matrix> {
    let correlations = covariance_of(rows, &vec![1.0; sds.len()])?;
    let has_units = (0..sds.len()).all(|i| (correlations[(i, i)] - 1.0).abs() < UNIT);
    (has_units && correlations.is_covariance()).then(|| covariance_of(rows, sds))?
}

const WRONG_BOARD: &str = "`board_covariance` must be the lower triangle of a positive semidefinite matrix, with a row for each parameter";

/// The covariance matrix of this lower triangle; `None` if an element is missing, or impossible.
fn triangle(rows: &[Vec<f64>], n: usize) -> Option<Matrix> {
    covariance_of(rows, &vec![1.0; n]).filter(Matrix::is_covariance)
}

/// The matrix of these rows, scaled by standard deviations; `None` if an element is missing.
fn covariance_of(rows: &[Vec<f64>], sds: &[f64]) -> Option<Matrix> {
    let n = sds.len();
    // For a spline only the lower triangle is stored.
    let has_all = |(i, row): (usize, &Vec<f64>)| row.len() == n || row.len() == i + 1;
    let is_whole = rows.len() == n && rows.iter().enumerate().all(has_all);
    let of = |i: usize, j: usize| rows[i].get(j).copied().unwrap_or_else(|| rows[j][i]);
    is_whole.then(|| Matrix::from_fn(n, n, |i, j| of(i, j) * sds[i] * sds[j]))
}

impl SavedProjection {
    /// Converts the record; `found` is the number of estimated parameters, and `sds` are their observed standard deviations.
    fn read(self, found: usize, sds: &[f64]) -> Result<ProjectionUncertainty, &'static str> {
        let Self { alignment, observed_correlations, observed_freedom, .. } = self;
        let (board, distances_mm) = (self.board_covariance, self.distances_mm);
        if alignment.len() != 6 || alignment.iter().any(|row| row.len() != found) {
            return Err("`alignment` must have six rows with a number for each parameter");
        }
        let alignment = Matrix::from_fn(6, found, |i, j| alignment[i][j]);
        let observed = observed_correlations.zip(observed_freedom).map(|(rows, freedom)| {
            let covariance = of_correlations(&rows, sds).filter(|_| sds.len() == found);
            let covariance = covariance.ok_or(
                "`observed_correlations` must be positive definite, with one for each pair of parameters",
            )?;
            let of_board = board.map(|rows| triangle(&rows, found).ok_or(WRONG_BOARD));
            Ok(ObservedCovariance { covariance, of_board: of_board.transpose()?, freedom })
        });
        Ok(ProjectionUncertainty::new(alignment, distances_mm, observed.transpose()?))
    }
}

impl SavedJoint {
    fn read(self) -> Result<ObservedCovariance, &'static str> {
        let Self { covariance, freedom, board_covariance } = self;
        let n = covariance.len();
        let of_board = board_covariance.map(|rows| triangle(&rows, n).ok_or(WRONG_BOARD));
        Ok(ObservedCovariance {
            covariance: triangle(&covariance, n).ok_or(
                "`covariance` must be the lower triangle of a positive semidefinite matrix",
            )?,
            of_board: of_board.transpose()?,
            freedom,
        })
    }
}

/// The lens whose camera has parameters with these names.
fn lens_of(names: &[&str], spline: Option<SplineGrid>) -> Option<Lens> {
    let terms = names.len().saturating_sub(PROJECTION_PARAMETERS.len());
    let of_kind = |kind: &LensKind| [None, spline].map(|grid| kind.lens(terms, grid));
    let mut lenses = LensKind::ALL.iter().flat_map(of_kind).flatten();
    lenses.find(|lens| Camera::centred(1, 1, 1.0, lens.clone()).parameter_names() == names)
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
