//! The result of a calibration: cameras, targets, frames and views with their residuals.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use glam::DVec2;

use super::coverage::Coverage;
use super::lens_end::LensEnd;
use super::target_map::TargetMap;
use crate::adjust::finding::Finding;
use crate::adjust::lack_of_fit::LackOfFit;
use crate::excluded::Excluded;
use crate::input::panel::{PanelPlace, PanelRef};
use crate::matrix::Matrix;
use crate::model::Model;
use crate::problem::roughness::Roughness;
use crate::problem::shape::BoardShape;
use crate::start::symmetry::LabelRotation;
use crate::uncertainty::known_so_far::KnownSoFar;
use crate::uncertainty::projection::ProjectionUncertainty;
use crate::uncertainty::state_equations::StateEquations;
use deltille_core::camera::{Camera, Pose};
use deltille_core::statistics::median;
use deltille_core::targets::{Name, PanelPose, Target, TargetIdentity};

/// The result of a calibration: cameras, their poses and those of the target, with uncertainties.
///
/// One camera is a rig of one: the rig frame is that of the camera, and a frame a view.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// The cameras, in the order given.
    pub cameras: Vec<CameraEstimate>,
    /// The moments at which pictures were taken: in the order of the views of a single camera, by name for
    /// a rig.
    pub frames: Vec<FrameEstimate>,
    /// The targets, in the order given; the scene is that of the first one that was seen.
    pub targets: Vec<TargetEstimate>,
    /// Identities of the targets that the cameras were calibrated with; empty where they are not known.
    pub calibrated_with: Vec<TargetIdentity>,
    /// The panels of all targets; those that were found have a covariance.
    pub panels: Vec<PanelPlace>,
    /// The shape of the board's sheet, where it was to be found.
    pub shape: Option<BoardShape>,
    /// Where the corners of the target are, where that was to be found.
    pub map: Option<TargetMap>,
    /// Root mean square error of a coordinate over all corners, px: √(Σ(dx² + dy²)/2N).
    pub rms_px: f64,
    /// The deviation that was added to every corner's covariance, px; `None` where corners were
    /// taken as equally precise.
    pub common_px: Option<f64>,
    /// A-posteriori standard deviation of a coordinate: in px where corners were taken as equally
    /// precise, else in units of what its covariance says. All covariances are scaled by its square.
    pub sigma: f64,
    /// Views and frames that do not belong with the others and took no part, and why.
    pub excluded: Vec<Excluded>,
    /// What outliers share, and corners that were left out together.
    pub findings: Vec<Finding>,
    /// Patterns in the residuals that noise does not make, the strongest first.
    pub lack_of_fit: Vec<LackOfFit>,
    /// The same cameras in frames that took no part, where some were held out; only the poses of the
    /// target were found there.
    pub held_out: Option<Box<Estimate>>,
    /// Number of iterations of the last bundle adjustment.
    pub steps: usize,
    /// What the corners say of the first camera and the board's shape, by which views are proposed.
    pub(crate) known: Option<KnownSoFar>,
    /// What the views of each camera say of its state.
    pub(crate) states: Vec<Option<StateEquations>>,
}

/// The estimate of one camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraEstimate {
    /// Name of the camera, as it was given.
    pub name: String,
    /// The camera with its estimated parameters.
    pub camera: Camera,
    /// The model that was estimated; `None` where the camera was given.
    pub model: Option<Model>,
    /// All its parameters, estimated and kept ones.
    pub parameters: Vec<Parameter>,
    /// Covariance of the estimated parameters, in their order; each entry in the product of their units.
    pub covariance: Matrix,
    /// How sure it is of where it projects a point; `None` where it was given, or where its motion is open.
    pub projection: Option<ProjectionUncertainty>,
    /// Names of parameters that the views cannot tell apart: some change of them together moves no
    /// corner, and their deviations are the least that they can be; or hardly any, so that neither the
    /// value nor the deviation of one alone means anything.
    pub ill_conditioned: Vec<String>,
    /// Pose on the rig: from the rig frame to the camera frame, mm.
    pub camera_from_rig: Pose,
    /// Standard deviations of that pose: of a rotation (rad) and a translation (mm) about the camera's axes; `None`
    /// where it was not to be found, as of the first camera, which is the rig.
    pub pose_sd: Option<[f64; 6]>,
    /// The same as the frames agree with each other; `None` where it was not to be found, or of too few frames.
    pub observed_pose_sd: Option<[f64; 6]>,
    /// By how many frames its pictures are late, against those of most other cameras: a picture of it shows the moment
    /// that theirs of so many frames before show.
    pub delay: i32,
    /// How its labels were rotated so that the cameras of a rig agree, where the board looks the same after a rotation
    /// and the detected labels do not agree, or do not decide; `None` where neither is the case.
    pub label_rotation: Option<LabelRotation>,
    /// The views that took part, in the order of the frames.
    pub views: Vec<ViewEstimate>,
    /// Where corners were seen, of a camera whose views do not list them, as one that was read from a file.
    pub coverage: Option<Coverage>,
    /// Root mean square error of a coordinate over all its views, px.
    pub rms_px: f64,
    /// What was expected of the knots of a spline that was found.
    pub(crate) roughness: Option<Roughness>,
}

/// Where a target is.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetEstimate {
    /// Its name; empty where it is the only one.
    pub name: String,
    /// Its panels among all.
    pub panels: Range<usize>,
    /// Where it is to the first target.
    pub scene_from_target: Pose,
    /// Standard deviations of that: of a turn (rad) and a move (mm) along the first target's axes; `None` where it
    /// was not to be found, as of the first target.
    pub pose_sd: Option<[f64; 6]>,
}

/// A moment at which the cameras took pictures, and the pose of the target in it.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEstimate {
    /// Name of the frame: that of its views.
    pub name: String,
    /// Pose of the target, of several the first: from the target frame to the rig frame, mm. Of a single camera the rig frame is the camera
    /// frame.
    pub rig_from_target: Pose,
    /// Standard deviations of that pose: of a rotation (rad) and a translation (mm) about the rig's axes.
    pub pose_sd: [f64; 6],
    /// Root mean square error of a coordinate over all cameras, px.
    pub rms_px: f64,
}

/// A parameter of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, such as `k1`.
    pub name: String,
    /// Value: px for focal lengths and the principal point, mm for shifts of the pupil, else without unit.
    pub value: f64,
    /// Standard deviation, in the unit of the value; `None` where the parameter was given.
    pub sd: Option<f64>,
}

/// A view with its residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewEstimate {
    /// Name of the view.
    pub name: String,
    /// File name of its picture.
    pub image: String,
    /// Index of the frame in which it was taken.
    pub frame: usize,
    /// Pose of the target, of several the first: from the target frame to the camera frame, mm.
    pub pose: Pose,
    /// Root mean square error of a coordinate, px.
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
    /// Residual: detected less predicted position, px.
    pub residual: DVec2,
    /// Whether the residual is larger than chance explains, see [`Loss`](crate::Loss).
    pub outlier: bool,
}

impl Estimate {
    /// All corners, by camera.
    pub fn corners(&self) -> impl Iterator<Item = &Corner> {
        self.cameras.iter().flat_map(CameraEstimate::corners)
    }

    /// How many corners took part.
    pub fn corner_count(&self) -> usize {
        self.corners().count()
    }

    /// How many corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners().filter(|corner| corner.outlier).count()
    }

    /// In how many views a corner of the target was seen, the median of all.
    pub fn views_of_a_corner(&self) -> usize {
        let mut counts: BTreeMap<_, usize> = BTreeMap::new();
        for corner in self.corners() {
            *counts.entry((corner.panel, corner.row, corner.col)).or_default() += 1;
        }
        let counts = counts.into_values().map(|count| count as f64).collect();
        median(counts).unwrap_or(0.0) as usize
    }

    /// [`Self::rms_px`] of the corners that are no outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        rms_px(self.corners().filter(|corner| !corner.outlier))
    }

    /// The name of a camera where there are several, by which it is told from the others.
    pub fn camera_name(&self, camera: usize) -> Option<&str> {
        let cameras = &self.cameras;
        cameras.get(camera).filter(|_| cameras.len() > 1).map(|camera| camera.name.as_str())
    }

    /// The name of a target where there are several, by which its panels are told from others.
    pub fn target_name(&self, panel: PanelRef) -> Option<&str> {
        let of_panel = self.targets.iter().find(|target| target.panels.contains(&panel.index()));
        of_panel.filter(|_| self.targets.len() > 1).map(|target| target.name.as_str())
    }

    /// What is known of one of several targets, and of what was seen of it, as if it were the only one.
    #[must_use]
    pub fn of_target(&self, target: usize) -> Self {
        let Some(of) = self.targets.get(target) else { return self.clone() };
        let panels = self.panels[of.panels.clone()].to_vec();
        let map = self.map.as_ref().map(|map| map.of_panels(&of.panels));
        let targets = vec![TargetEstimate { panels: 0..panels.len(), ..of.clone() }];
        Self { panels, map, targets, ..Self::default() }
    }

    /// Which other cameras saw the target in the same frames, of each camera.
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

    /// Whether panels were to be found.
    pub fn has_refined_panels(&self) -> bool {
        self.panels.iter().any(|panel| panel.covariance.is_some())
    }

    /// The target with its panels where they were found, named `<target>-refined`. [`TargetMap::on`] does the
    /// same for its corners.
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

    /// How many unknowns were found beside the poses of the frames.
    pub(crate) fn unknown_count(&self) -> usize {
        let of_panels = self.panels.iter().filter(|panel| panel.covariance.is_some()).count();
        let of_cameras = self
            .cameras
            .iter()
            .map(|camera| camera.found().count() + if camera.pose_sd.is_some() { 6 } else { 0 });
        let of_shape = self.shape.map_or(0, |found| found.sd_mm.len());
        let of_targets = self.targets.iter().filter(|target| target.pose_sd.is_some()).count();
        of_cameras.sum::<usize>() + 6 * (of_panels + of_targets) + of_shape
    }
}

impl CameraEstimate {
    /// A camera that was given, in the place of the rig, without views.
    pub fn given(name: &str, camera: Camera) -> Self {
        let values = camera.parameter_names().into_iter().zip(camera.parameters());
        let parameter = |(name, value)| Parameter { name, value, sd: None };
        Self {
            name: name.to_owned(),
            parameters: values.map(parameter).collect(),
            camera,
            model: None,
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

    /// Removes all uncertainties, as of a calibration that failed: they follow from residuals that the model does not explain.
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

    /// How many corners took part.
    pub fn corner_count(&self) -> usize {
        self.corners().count()
    }

    /// How many corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners().filter(|corner| corner.outlier).count()
    }

    /// [`Self::rms_px`] of the corners that are no outliers.
    pub fn inlier_rms_px(&self) -> f64 {
        rms_px(self.corners().filter(|corner| !corner.outlier))
    }

    /// Correlation of two of the parameters that were found.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let c = &self.covariance;
        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
    }

    /// The names of the parameters that were found.
    pub fn found(&self) -> impl Iterator<Item = &str> {
        self.parameters.iter().filter(|p| p.sd.is_some()).map(|p| p.name.as_str())
    }

    /// Where the lens ends to be good, if that is within the image.
    pub fn lens_end(&self) -> Option<LensEnd> {
        let seen: Vec<DVec2> = self.corners().map(|corner| corner.pixel).collect();
        LensEnd::of(&self.camera, &seen)
    }
}

impl Coverage {
    /// Where a camera saw corners: those of its views, else what is known of it without them.
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
    /// How many of its corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners.iter().filter(|corner| corner.outlier).count()
    }
}

/// √(Σ(dx² + dy²)/2N); zero of none.
pub(super) fn rms_px<'a>(corners: impl Iterator<Item = &'a Corner>) -> f64 {
    let residuals = corners.map(|corner| corner.residual);
    let (sum, count) =
        residuals.fold((0.0, 0), |(sum, count), r| (sum + r.x * r.x + r.y * r.y, count + 2));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}
