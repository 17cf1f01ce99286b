//! The result of a calibration: cameras, targets, frames and views with their residuals.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use glam::DVec2;

use super::coverage::Coverage;
use super::joint_covariance::JointCovariance;
use super::lens_limit::LensLimit;
use super::target_map::TargetMap;
use crate::adjust::finding::Finding;
use crate::adjust::lack_of_fit::LackOfFit;
use crate::excluded::Excluded;
use crate::input::constraint::Constraint;
use crate::input::panel::{PanelPrior, PanelRef};
use crate::matrix::Matrix;
use crate::model::Model;
use crate::problem::roughness::Roughness;
use crate::problem::shape::BoardShape;
use crate::start::symmetry::LabelRotation;
use crate::uncertainty::information::KnownSoFar;
use crate::uncertainty::projection::{ObservedCovariance, ProjectionUncertainty};
use crate::uncertainty::state_equations::StateEquations;
use deltille_core::camera::{Camera, Pose};
use deltille_core::statistics::median;
use deltille_core::targets::{Name, PanelPose, Target, TargetIdentity};

/// The result of a calibration: cameras, their poses and those of the target, with uncertainties.
///
/// A single camera is a rig with one camera: the rig frame is the camera frame, and each frame is a
/// view.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// The cameras, in the order given.
    pub cameras: Vec<CameraEstimate>,
    /// The frames, that is, the times at which images were taken: in the order of the views for a single camera, by
    /// name for a rig.
    pub frames: Vec<FrameEstimate>,
    /// The targets, in the order given; the scene frame is that of the first target that was seen.
    pub targets: Vec<TargetEstimate>,
    /// Identities of the targets used for the calibration; empty if they are not known.
    pub calibrated_with: Vec<TargetIdentity>,
    /// The panels of all targets; estimated poses have a covariance.
    pub panels: Vec<PanelPrior>,
    /// The shape of the board's sheet, if it was estimated.
    pub shape: Option<BoardShape>,
    /// The positions of the corners of the target, if they were estimated.
    pub map: Option<TargetMap>,
    /// RMS reprojection error per axis over all corners, px: √(Σ(dx² + dy²)/2N).
    pub rms_px: f64,
    /// The common standard deviation added to the covariance of every corner, px; `None` if all corners had equal
    /// weight.
    pub common_px: Option<f64>,
    /// A-posteriori standard deviation per axis: in px if all corners had equal weight, else in units of the standard
    /// deviation from the corner's covariance. All covariances are scaled by its square.
    pub sigma: f64,
    /// Excluded views and frames, with the reasons.
    pub excluded: Vec<Excluded>,
    /// Findings: what outliers have in common, and corners that were excluded together.
    pub findings: Vec<Finding>,
    /// Patterns in the residuals that noise does not explain, the strongest first.
    pub lack_of_fit: Vec<LackOfFit>,
    /// The same cameras in the held-out frames, if there are any; only the poses of the target were estimated there. If
    /// the corners of the target were estimated and no frames were to be held out, these are every third frame, with the
    /// cameras and corners of another calibration without these frames.
    pub held_out: Option<Box<Estimate>>,
    /// Observed covariance of all cameras of a rig together: for each camera its estimated parameters, then (ω, τ) of
    /// [`camera_from_rig`](CameraEstimate::camera_from_rig) about the camera's axes (rad, mm) if it was estimated. `None`
    /// for a single camera, with splines, or with too few frames.
    pub joint: Option<ObservedCovariance>,
    /// Covariance of all unknowns together; `None` if nothing but poses of frames was estimated.
    pub covariance: Option<JointCovariance>,
    /// Number of iterations of the last bundle adjustment.
    pub steps: usize,
    /// The information about the first camera and the board's shape, on which proposals of views
    /// are based.
    pub(crate) known: Option<KnownSoFar>,
    /// The state equations of the views of each camera.
    pub(crate) states: Vec<Option<StateEquations>>,
    /// Whether the corners were compensated for the timing of the cameras, see
    /// [`Calibration::compensated_for_timing`](crate::Calibration::compensated_for_timing).
    pub is_compensated: bool,
}

/// The estimate of one camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraEstimate {
    /// Name of the camera, as given.
    pub name: String,
    /// The camera with its estimated parameters.
    pub camera: Camera,
    /// The estimated model; `None` if the camera was given.
    pub model: Option<Model>,
    /// Constraints on its parameters.
    pub constraints: Vec<Constraint>,
    /// All its parameters, both estimated and fixed.
    pub parameters: Vec<Parameter>,
    /// Covariance of the estimated parameters, in their order; each entry in the product of their units.
    pub covariance: Matrix,
    /// The projection uncertainty; `None` if the camera was given, or if its motion is undetermined.
    pub projection: Option<ProjectionUncertainty>,
    /// Names of ill-conditioned parameters. If a joint change of them moves no corner, their
    /// standard deviations are lower bounds. If it moves corners only slightly, neither the value
    /// nor the standard deviation of a single parameter is meaningful.
    pub ill_conditioned: Vec<String>,
    /// Pose on the rig: from the rig frame to the camera frame, mm.
    pub camera_from_rig: Pose,
    /// Standard deviations of that pose: rotation (rad) and translation (mm) about the camera's
    /// axes; `None` if it was not estimated. This is the case for the first camera, which defines
    /// the rig frame.
    pub pose_sd: Option<[f64; 6]>,
    /// Observed standard deviations of that pose, from the scatter between frames; `None` if it was not estimated, or
    /// with too few frames.
    pub observed_pose_sd: Option<[f64; 6]>,
    /// Lag of its images in frames, relative to most other cameras: its image shows what the others showed this many
    /// frames earlier.
    pub delay: i32,
    /// The rotation of its labels that makes the cameras of a rig agree, for a board that looks the same after a
    /// rotation. `None` if there is no board like this, or if the detected labels agree and are
    /// unambiguous.
    pub label_rotation: Option<LabelRotation>,
    /// The used views, in the order of the frames.
    pub views: Vec<ViewEstimate>,
    /// The areas where corners were seen, for a camera whose views do not list corners, for example
    /// a camera that was read from a file.
    pub coverage: Option<Coverage>,
    /// RMS reprojection error per axis over all its views, px.
    pub rms_px: f64,
    /// The prior of the knots of an estimated spline.
    pub(crate) roughness: Option<Roughness>,
}

/// The pose of a target.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetEstimate {
    /// Its name; empty if it is the only one.
    pub name: String,
    /// Range of its panels among all panels.
    pub panels: Range<usize>,
    /// Pose relative to the first target.
    pub scene_from_target: Pose,
    /// Standard deviations of that pose: rotation (rad) and translation (mm) along the first
    /// target's axes; `None` if it was not estimated, for example for the first target.
    pub pose_sd: Option<[f64; 6]>,
}

/// A time at which the cameras took images, and the pose of the target at that time.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEstimate {
    /// Name of the frame: that of its views.
    pub name: String,
    /// Pose of the target (the first of several): from the target frame to the rig frame, mm. For a single camera, the
    /// rig frame is the camera frame.
    pub rig_from_target: Pose,
    /// Standard deviations of that pose: rotation (rad) and translation (mm) about the rig's axes.
    pub pose_sd: [f64; 6],
    /// RMS reprojection error per axis over all cameras, px.
    pub rms_px: f64,
}

/// A parameter of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, such as `k1`.
    pub name: String,
    /// Value: px for focal lengths and the principal point, mm for shifts of the pupil, else dimensionless.
    pub value: f64,
    /// Standard deviation, in the unit of the value; `None` if the parameter was given.
    pub sd: Option<f64>,
}

/// A view with its residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewEstimate {
    /// Name of the view.
    pub name: String,
    /// File name of its image.
    pub image: String,
    /// Index of the frame in which it was taken.
    pub frame: usize,
    /// Pose of the target (the first of several): from the target frame to the camera frame, mm.
    pub pose: Pose,
    /// RMS reprojection error per axis, px.
    pub rms_px: f64,
    /// The corners.
    pub corners: Vec<Corner>,
}

/// A corner with its residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The panel that it lies on.
    pub panel: PanelRef,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Detected position, px.
    pub pixel: DVec2,
    /// Residual: detected minus predicted position, px.
    pub residual: DVec2,
    /// Whether the residual is an outlier, larger than noise explains, see [`Loss`](crate::Loss).
    pub outlier: bool,
}

impl Estimate {
    /// All corners, by camera.
    pub fn corners(&self) -> impl Iterator<Item = &Corner> {
        self.cameras.iter().flat_map(CameraEstimate::corners)
    }

    /// Number of used corners.
    pub fn corner_count(&self) -> usize {
        self.corners().count()
    }

    /// Number of outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners().filter(|corner| corner.outlier).count()
    }

    /// Median number of views that show a corner of the target.
    pub fn views_of_a_corner(&self) -> usize {
        let mut counts: BTreeMap<_, usize> = BTreeMap::new();
        for corner in self.corners() {
            *counts.entry((corner.panel, corner.row, corner.col)).or_default() += 1;
        }
        let counts = counts.into_values().map(|count| count as f64).collect();
        median(counts).unwrap_or(0.0) as usize
    }

    /// [`Self::rms_px`] without outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        rms_px(self.corners().filter(|corner| !corner.outlier))
    }

    /// The name of a camera if there are several.
    pub fn camera_name(&self, camera: usize) -> Option<&str> {
        let cameras = &self.cameras;
        cameras.get(camera).filter(|_| cameras.len() > 1).map(|camera| camera.name.as_str())
    }

    /// The name of the target of a panel if there are several targets.
    pub fn target_name(&self, panel: PanelRef) -> Option<&str> {
        let of_panel = self.targets.iter().find(|target| target.panels.contains(&panel.index()));
        of_panel.filter(|_| self.targets.len() > 1).map(|target| target.name.as_str())
    }

    /// The estimate reduced to one of several targets and its observations, as if it were the only
    /// target.
    #[must_use]
    pub fn of_target(&self, target: usize) -> Self {
        let Some(of) = self.targets.get(target) else { return self.clone() };
        let panels = self.panels[of.panels.clone()].to_vec();
        let map = self.map.as_ref().map(|map| map.of_panels(&of.panels));
        let targets = vec![TargetEstimate { panels: 0..panels.len(), ..of.clone() }];
        Self { panels, map, targets, ..Self::default() }
    }

    /// For each camera, the other cameras that saw the target in the same frames.
    pub fn overlaps(&self) -> Vec<Vec<usize>> {
        let frames = self.cameras.iter();
        let frames = frames.map(|camera| camera.views.iter().map(|view| view.frame).collect());
        let frames: Vec<BTreeSet<usize>> = frames.collect();
        let others = |of: usize| {
            let others = (0..frames.len()).filter(move |&other| other != of);
            others.filter(|&other| !frames[of].is_disjoint(&frames[other])).collect()
        };
        (0..frames.len()).map(others).collect()
    }

    /// Whether panel poses were estimated.
    pub fn has_refined_panels(&self) -> bool {
        self.panels.iter().any(|panel| panel.covariance.is_some())
    }

    /// Returns the target with its estimated panel poses, named `<target>-refined`. [`TargetMap::on`] does the same for
    /// its corners.
    pub fn refined(&self, target: &Target) -> Target {
        let poses = self.panels.iter();
        let poses =
            poses.map(|panel| PanelPose::from_pose(&panel.target_from_panel, panel.covariance));
        let name = Name::like(&format!("{}-refined", target.name.trim_end_matches("-refined")));
        let plan = Some(target.printed());
        let mut refined = target.with_poses(&poses.collect::<Vec<_>>());
        (refined.name, refined.plan) = (name, plan);
        refined
    }

    /// Number of estimated unknowns besides the poses of the frames.
    pub(crate) fn unknown_count(&self) -> usize {
        let of_panels = self.panels.iter().filter(|panel| panel.covariance.is_some()).count();
        let of_cameras = self
            .cameras
            .iter()
            .map(|camera| camera.unknown_count() + if camera.pose_sd.is_some() { 6 } else { 0 });
        let of_shape = self.shape.map_or(0, |found| found.sd_mm.len());
        let of_targets = self.targets.iter().filter(|target| target.pose_sd.is_some()).count();
        of_cameras.sum::<usize>() + 6 * (of_panels + of_targets) + of_shape
    }
}

impl CameraEstimate {
    /// Creates a given camera at the rig frame, without views.
    pub fn given(name: &str, camera: Camera) -> Self {
        let values = camera.parameter_names().into_iter().zip(camera.parameters());
        let parameter = |(name, value)| Parameter { name, value, sd: None };
        Self {
            name: name.to_owned(),
            parameters: values.map(parameter).collect(),
            camera,
            model: None,
            constraints: Vec::new(),
            covariance: Matrix::empty(),
            projection: None,
            ill_conditioned: Vec::new(),
            camera_from_rig: Pose::IDENTITY,
            pose_sd: None,
            observed_pose_sd: None,
            delay: 0,
            label_rotation: None,
            views: Vec::new(),
            coverage: None,
            rms_px: 0.0,
            roughness: None,
        }
    }

    /// Removes all uncertainties of a failed calibration, because they come from residuals that the
    /// model does not explain.
    pub fn forget_uncertainties(&mut self) {
        self.covariance = Matrix::empty();
        (self.projection, self.pose_sd, self.observed_pose_sd) = (None, None, None);
    }

    /// Width and height of its image, px.
    pub(crate) fn size_px(&self) -> DVec2 {
        DVec2::new(self.camera.width.into(), self.camera.height.into()).max(DVec2::ONE)
    }

    /// All its corners, by view.
    pub fn corners(&self) -> impl Iterator<Item = &Corner> {
        self.views.iter().flat_map(|view| &view.corners)
    }

    /// Number of used corners.
    pub fn corner_count(&self) -> usize {
        self.corners().count()
    }

    /// Number of outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners().filter(|corner| corner.outlier).count()
    }

    /// [`Self::rms_px`] without outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        rms_px(self.corners().filter(|corner| !corner.outlier))
    }

    /// Correlation of two of the estimated parameters.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let c = &self.covariance;
        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
    }

    /// The constraints on its parameters in words, such as `k3 fixed at 0; fx and fy equal`; `None` without any.
    pub fn described_constraints(&self) -> Option<String> {
        let value = |name: &String| self.parameters.iter().find(|p| p.name == *name);
        let describe = |of: &Constraint| match of {
            Constraint::Fixed { parameter, .. } => {
                format!("{parameter} fixed at {}", value(parameter).map_or(0.0, |p| p.value))
            }
            Constraint::Equal { parameters } => format!("{} equal", parameters.join(" and ")),
            Constraint::Prior { parameter, value, sd } => {
                format!("{parameter} with the prior {value} ± {sd}")
            }
        };
        let all: Vec<String> = self.constraints.iter().map(describe).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// Number of its unknown parameters; equal parameters are one unknown.
    pub(crate) fn unknown_count(&self) -> usize {
        let shared = self.constraints.iter().map(|of| match of {
            Constraint::Equal { parameters } => parameters.len() - 1,
            Constraint::Fixed { .. } | Constraint::Prior { .. } => 0,
        });
        self.estimated_parameters().count().saturating_sub(shared.sum())
    }

    /// The names of the estimated parameters.
    pub fn estimated_parameters(&self) -> impl Iterator<Item = &str> {
        self.parameters.iter().filter(|p| p.sd.is_some()).map(|p| p.name.as_str())
    }

    /// The fold or pole of the lens model within the image, if there is one.
    pub fn lens_limit(&self) -> Option<LensLimit> {
        let seen: Vec<DVec2> = self.corners().map(|corner| corner.pixel).collect();
        LensLimit::of(&self.camera, &seen)
    }
}

impl Coverage {
    /// The coverage from the corners of a camera's views, or the stored coverage if the views do
    /// not list corners.
    pub fn of(camera: &CameraEstimate) -> Self {
        match &camera.coverage {
            Some(known) if camera.corners().next().is_none() => known.clone(),
            _ => {
                let corners = camera.corners().filter(|corner| !corner.outlier);
                Self::counted(camera.size_px(), corners.map(|corner| corner.pixel))
            }
        }
    }
}

impl ViewEstimate {
    /// Number of outliers among its corners.
    pub fn outlier_count(&self) -> usize {
        self.corners.iter().filter(|corner| corner.outlier).count()
    }
}

/// √(Σ(dx² + dy²)/2N); zero without corners.
pub(super) fn rms_px<'a>(corners: impl Iterator<Item = &'a Corner>) -> f64 {
    let residuals = corners.map(|corner| corner.residual);
    let (sum, count) =
        residuals.fold((0.0, 0), |(sum, count), r| (sum + r.x * r.x + r.y * r.y, count + 2));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}
