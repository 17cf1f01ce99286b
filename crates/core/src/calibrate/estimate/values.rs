use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use glam::DVec2;
use nalgebra::{DMatrix, Matrix3};

use super::coverage::Coverage;
use super::lens_end::LensEnd;
use super::target_map::{CornerOffset, TargetMap};
use crate::calibrate::adjust::finding::Finding;
use crate::calibrate::adjust::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::calibrate::adjust::reweighting::{Settled, variance};
use crate::calibrate::equations::covariances::Covariances;
use crate::calibrate::equations::minimise::Minimum;
use crate::calibrate::error::CalibrationError;
use crate::calibrate::excluded::Excluded;
use crate::calibrate::input::calibration::{Calibration, CameraViews};
use crate::calibrate::input::loss::Loss;
use crate::calibrate::input::order::in_order;
use crate::calibrate::input::panel::{PanelPlace, PanelRef};
use crate::calibrate::model::Model;
use crate::calibrate::next_view::gain::KnownSoFar;
use crate::calibrate::problem::corner_map::CornerMap;
use crate::calibrate::problem::roughness::Roughness;
use crate::calibrate::problem::shape::{BoardShape, COUNT as SHAPE_COEFFICIENTS, Shape};
use crate::calibrate::problem::whitening::deviations;
use crate::calibrate::start::frames::Frame;
use crate::calibrate::start::symmetry::LabelRotation;
use crate::calibrate::uncertainty::agreement::{Observed, observed};
use crate::calibrate::uncertainty::board_errors::{board_errors, drawn_to_plan};
use crate::calibrate::uncertainty::halves;
use crate::calibrate::uncertainty::projection::{ObservedCovariance, ProjectionUncertainty};
use crate::calibrate::uncertainty::state_equations::StateEquations;
use crate::camera::{Camera, PROJECTION_PARAMETERS, Pose};
use crate::statistics::median;
use crate::targets::{Name, PanelPose, Target, TargetIdentity};

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
    pub(in crate::calibrate) known: Option<KnownSoFar>,
    /// What the views of each camera say of its state.
    pub(in crate::calibrate) states: Vec<Option<StateEquations>>,
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
    pub covariance: DMatrix<f64>,
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
    pub(in crate::calibrate) roughness: Option<Roughness>,
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
    /// Whether the residual is larger than chance explains, see [`Loss`](crate::calibrate::Loss).
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
        Target { name, plan, ..target.with_poses(&poses.collect::<Vec<_>>()) }
    }

    /// How many unknowns were found beside the poses of the frames.
    pub(in crate::calibrate) fn unknown_count(&self) -> usize {
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
            covariance: DMatrix::zeros(0, 0),
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
        self.covariance = DMatrix::zeros(0, 0);
        (self.projection, self.pose_sd, self.observed_pose_sd) = (None, None, None);
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

impl ViewEstimate {
    /// How many of its corners are outliers.
    pub fn outlier_count(&self) -> usize {
        self.corners.iter().filter(|corner| corner.outlier).count()
    }
}

/// √(Σ(dx² + dy²)/2N); zero of none.
fn rms_px<'a>(corners: impl Iterator<Item = &'a Corner>) -> f64 {
    let residuals = corners.map(|corner| corner.residual);
    let (sum, count) =
        residuals.fold((0.0, 0), |(sum, count), r| (sum + r.x * r.x + r.y * r.y, count + 2));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}

impl Estimate {
    /// What was settled on; `frames` are those of the settled problem, and `f_ratio` is that of the
    /// shape.
    ///
    /// # Errors
    /// Where views leave the pose of a frame, a camera or a panel open.
    pub(in crate::calibrate) fn new(
        calibration: &Calibration,
        frames: &[&Frame],
        settled: &Settled,
        f_ratio: f64,
    ) -> Result<Self, CalibrationError> {
        let Calibration { cameras, loss, distances_mm, board_accuracy_mm, .. } = calibration;
        let loss = *loss;
        let Settled { minimum, whitening, .. } = settled;
        let Minimum { problem, normal, layout, steps } = minimum;
        let open = |parameters: String| CalibrationError::Undetermined { parameters };
        let found = normal.covariances(layout).ok_or_else(|| open("the poses".to_owned()))?;
        let is_open = |first: Option<usize>| {
            first.is_some_and(|first| (first..first + 6).any(|i| found.loose.contains(&i)))
        };
        let of_cameras = cameras.iter().zip(&layout.cameras).filter(|(_, first)| is_open(**first));
        let of_cameras = of_cameras.map(|(camera, _)| format!("the pose of {}", camera.name));
        let panels: BTreeSet<PanelRef> = problem.blocks.iter().map(|block| block.panel).collect();
        let of_panels = panels.into_iter().filter(|panel| is_open(layout.panels[panel.index()]));
        let of_panels = of_panels.map(|panel| format!("the pose of panel {panel}"));
        let of_targets = calibration.targets.iter().zip(&layout.targets);
        let of_targets = of_targets.filter(|(_, first)| is_open(**first));
        let of_targets =
            of_targets.map(|(target, _)| format!("the pose of target {}", target.name));
        let poses: Vec<String> = of_cameras.chain(of_panels).chain(of_targets).collect();
        if !poses.is_empty() {
            return Err(open(poses.join(", ")));
        }
        let variance = variance(minimum, whitening, loss);
        let covariance = &found.shared * variance;
        let drawn = drawn_to_plan(minimum, whitening, &found, *board_accuracy_mm);
        let observed = observed(minimum, whitening, loss, &found).map(|observed| {
            let of_board = board_errors(minimum, whitening, loss, &found, *board_accuracy_mm);
            observed.with(of_board, drawn.as_ref())
        });
        let states = states(frames, settled, loss);
        let mut views = views(cameras, frames, settled);
        let cameras = cameras.iter().enumerate().map(|(index, camera)| {
            let views = std::mem::take(&mut views[index]);
            let mut camera = camera_estimate(index, camera, views, settled, &found, &covariance);
            camera.projection = projection(
                &camera,
                &states[index],
                index,
                settled,
                distances_mm,
                observed.as_ref(),
            );
            let of_pose = layout.cameras[index].zip(observed.as_ref());
            camera.observed_pose_sd = of_pose.map(|(first, observed)| {
                std::array::from_fn(|i| observed.covariance[(first + i, first + i)].sqrt())
            });
            camera
        });
        let cameras: Vec<CameraEstimate> = cameras.collect();
        let of_frames = problem.frames.iter().zip(&found.frames).zip(frames).enumerate();
        let of_frames = of_frames.map(|(index, ((pose, own), frame))| {
            let views = cameras.iter().flat_map(|camera| &camera.views);
            let views = views.filter(|view| view.frame == index);
            FrameEstimate {
                name: frame.name.clone(),
                rig_from_target: *pose,
                pose_sd: std::array::from_fn(|i| (own[(i, i)] * variance).sqrt()),
                rms_px: rms_px(views.flat_map(|view| &view.corners)),
            }
        });
        let panels = problem.panels.iter().zip(&layout.panels).map(|(panel, first)| PanelPlace {
            target_from_panel: panel.target_from_panel,
            covariance: first.map(|first| {
                std::array::from_fn(|i| std::array::from_fn(|j| covariance[(first + i, first + j)]))
            }),
        });
        let of_targets = calibration.targets.iter().zip(&problem.targets).zip(&layout.targets);
        let targets = of_targets.map(|((given, target), first)| TargetEstimate {
            name: given.name.clone(),
            panels: given.panels.clone(),
            scene_from_target: target.scene_from_target,
            pose_sd: first
                .map(|first| std::array::from_fn(|i| covariance[(first + i, first + i)].sqrt())),
        });
        Ok(Self {
            frames: of_frames.collect(),
            targets: targets.collect(),
            panels: panels.collect(),
            shape: board_shape(minimum, &covariance, f_ratio),
            map: target_map(settled, &found.corners, variance, loss, drawn.as_ref()),
            rms_px: rms_px(cameras.iter().flat_map(CameraEstimate::corners)),
            common_px: whitening.common_px,
            sigma: variance.sqrt(),
            lack_of_fit: lack_of_fit(problem, whitening),
            steps: *steps,
            known: known(settled, &found, variance),
            states,
            cameras,
            ..Self::default()
        })
    }
}

/// What the views of each camera say of its state, in the natural order of their names.
fn states(frames: &[&Frame], settled: &Settled, loss: Loss) -> Vec<Option<StateEquations>> {
    let Settled { minimum, whitening, .. } = settled;
    let names = in_order(frames.iter().map(|frame| frame.name.as_str()).collect());
    let places: BTreeMap<&str, usize> =
        names.iter().enumerate().map(|(place, name)| (name.as_str(), place)).collect();
    let mut order: Vec<usize> = (0..frames.len()).collect();
    order.sort_by_key(|&frame| places.get(frames[frame].name.as_str()));
    let cameras = 0..minimum.problem.cameras.len();
    let of = |camera| StateEquations::of(&minimum.problem, whitening, loss, camera, &order);
    cameras.map(of).collect()
}

/// The views of every camera, with all corners that are within its reach.
fn views(cameras: &[CameraViews], frames: &[&Frame], settled: &Settled) -> Vec<Vec<ViewEstimate>> {
    let Settled { problem, outliers, .. } = settled;
    let mut corners: BTreeMap<(usize, usize), Vec<Corner>> = BTreeMap::new();
    for (block, outliers) in problem.blocks.iter().zip(outliers) {
        let of_block = block.observations.iter().zip(outliers).filter_map(|(seen, &outlier)| {
            let (panel, row, col, pixel) = (block.panel, seen.row, seen.col, seen.pixel);
            let residual = problem.residual(block, seen)?;
            Some(Corner { panel, row, col, pixel, residual, outlier })
        });
        corners.entry((block.camera, block.frame)).or_default().extend(of_block);
    }
    let of_camera = |(index, camera): (usize, &CameraViews)| {
        let taken = frames.iter().enumerate().filter_map(|(frame, of_frame)| {
            let (_, view) = of_frame.views.iter().find(|(camera, _)| *camera == index)?;
            let (view, corners) = (&camera.views[*view], corners.remove(&(index, frame))?);
            Some(ViewEstimate {
                name: view.name.clone(),
                image: view.image.clone(),
                frame,
                pose: problem.cameras[index].camera_from_rig.after(&problem.frames[frame]),
                rms_px: rms_px(corners.iter()),
                corners,
            })
        });
        taken.collect()
    };
    cameras.iter().enumerate().map(of_camera).collect()
}

fn camera_estimate(
    index: usize,
    given: &CameraViews,
    views: Vec<ViewEstimate>,
    settled: &Settled,
    found: &Covariances,
    covariance: &DMatrix<f64>,
) -> CameraEstimate {
    let Minimum { problem, layout, .. } = &settled.minimum;
    let unknowns = &problem.cameras[index];
    let columns = &layout.parameters[index];
    let names = unknowns.camera.parameter_names();
    // Of a spline no number means anything by itself.
    let is_spline = unknowns.roughness.is_some();
    let is_loose = |&(i, column): &(usize, usize)| {
        found.loose.contains(&column)
            || i >= PROJECTION_PARAMETERS.len() && !is_spline && found.tied.contains(&column)
    };
    let loose = columns.iter().copied().filter(is_loose).map(|(i, _)| names[i].clone());
    let sd = |column: usize| covariance[(column, column)].sqrt();
    let sd_of = |i: usize| columns.iter().find(|(of, _)| *of == i).map(|&(_, column)| sd(column));
    let values = names.iter().zip(unknowns.camera.parameters()).enumerate();
    CameraEstimate {
        name: given.name.clone(),
        camera: unknowns.camera.clone(),
        model: given.intrinsics.model(),
        parameters: values
            .map(|(i, (name, value))| Parameter { name: name.clone(), value, sd: sd_of(i) })
            .collect(),
        covariance: DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            covariance[(columns[i].1, columns[j].1)]
        }),
        projection: None,
        ill_conditioned: loose.collect(),
        camera_from_rig: unknowns.camera_from_rig,
        pose_sd: layout.cameras[index].map(|first| std::array::from_fn(|i| sd(first + i))),
        observed_pose_sd: None,
        delay: 0,
        label_rotation: None,
        rms_px: rms_px(views.iter().flat_map(|view| &view.corners)),
        views,
        coverage: None,
        roughness: unknowns.roughness.clone(),
    }
}

/// How a camera's projections are known, with the covariance of what all frames share as these show it.
fn projection(
    camera: &CameraEstimate,
    state: &Option<StateEquations>,
    index: usize,
    settled: &Settled,
    distances_mm: &[f64],
    observed: Option<&Observed>,
) -> Option<ProjectionUncertainty> {
    let Minimum { problem, layout, .. } = &settled.minimum;
    let columns = &layout.parameters[index];
    if columns.is_empty() {
        return None;
    }
    let observed = observed.map(|Observed { covariance, of_board, freedom }| {
        let n = columns.len();
        let own =
            |of: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| of[(columns[i].1, columns[j].1)]);
        let covariance = match state {
            Some(state) => {
                halves::raised(state, &camera.camera, own(covariance), &camera.covariance)
            }
            None => own(covariance),
        };
        ObservedCovariance { covariance, of_board: of_board.as_ref().map(own), freedom: *freedom }
    });
    let (whitening, free) = (&settled.whitening, camera.free());
    ProjectionUncertainty::of(problem, whitening, index, &free, distances_mm, observed)
}

/// What corners say of the first camera and of the board's shape, all else that is shared taken out.
fn known(settled: &Settled, found: &Covariances, variance: f64) -> Option<KnownSoFar> {
    let Settled { minimum, whitening, .. } = settled;
    let layout = &minimum.layout;
    let of_camera = layout.parameters.first()?.iter().map(|&(_, column)| column);
    let of_shape = layout.shape.into_iter().flat_map(|first| first..first + SHAPE_COEFFICIENTS);
    let columns: Vec<usize> = of_camera.chain(of_shape).collect();
    let n = columns.len();
    let information = match n == layout.shared {
        true => found.root.inverse.tr_mul(&found.root.inverse),
        false => {
            let of = |i: usize, j: usize| found.shared[(columns[i], columns[j])];
            let scale: Vec<f64> = (0..n).map(|i| of(i, i).sqrt().recip()).collect();
            let own = DMatrix::from_fn(n, n, |i, j| of(i, j) * scale[i] * scale[j]);
            let inverse = own.cholesky()?.inverse();
            DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j])
        }
    };
    // W is triangular: the determinant of WᵀW is the square of its diagonal's product.
    let corners = whitening.blocks.iter().flatten().map(|[a, _, c]| 1.0 / (a * c));
    let corner_variance_px2 = variance * median(corners.collect())?;
    Some(KnownSoFar { information: information / variance, corner_variance_px2 })
}

/// Least sum of the weights of a corner's observations for its position to be measured: a view has two
/// coordinates, a position three.
const LEAST_VIEWS: f64 = 2.0;

/// Least mean weight of them: a majority.
const LEAST_WEIGHT: f64 = 0.5;

/// Whether a position rests on observations that count.
fn rests_on_few(&(weight, count): &(f64, usize)) -> bool {
    weight < LEAST_VIEWS || weight < LEAST_WEIGHT * count as f64
}

/// For each corner the weights of its observations, summed, and their number. Outliers weigh nothing; views in
/// which the whole panel takes no part are left out.
fn weights(map: &CornerMap, settled: &Settled, loss: Loss) -> Vec<(f64, usize)> {
    let Settled { minimum, whitening, problem, outliers } = settled;
    let mut weights = vec![(0.0, 0); map.len()];
    let off = deviations(problem, whitening);
    let blocks = problem.blocks.iter().zip(&minimum.problem.blocks).zip(off).zip(outliers);
    for (((block, part), off), outliers) in blocks {
        if part.observations.is_empty() {
            continue;
        }
        for ((seen, off), outlier) in block.observations.iter().zip(off).zip(outliers) {
            let (weight, count) = &mut weights[map.index(block.panel, seen)];
            *count += 1;
            if !outlier {
                *weight += loss.influence(off * off, whitening.sigma).weight;
            }
        }
    }
    weights
}

fn target_map(
    settled: &Settled,
    covariances: &[Matrix3<f64>],
    variance: f64,
    loss: Loss,
    drawn: Option<&DMatrix<f64>>,
) -> Option<TargetMap> {
    let Minimum { problem, layout, .. } = &settled.minimum;
    let map = problem.map.as_ref()?;
    let covariances = map.without_gauge(covariances, settled.whitening.sigma, problem);
    let weights = weights(map, settled, loss);
    let few = weights.iter().filter(|of| of.1 > 0 && rests_on_few(of)).count();
    let corners =
        map.corners.iter().zip(&map.offsets_mm).zip(covariances).zip(map.views(&problem.blocks));
    let all = corners.zip(&weights).enumerate();
    let measured = all.filter(|(_, (_, of))| !rests_on_few(of));
    let corners = measured.map(|(index, ((((corner, &offset_mm), covariance), views), _))| {
        let drawn = drawn.map_or(Matrix3::zeros(), |drawn| {
            let own = drawn.rows(layout.shared + 3 * index, 3);
            let square = own * own.transpose();
            Matrix3::from_fn(|i, j| square[(i, j)])
        });
        CornerOffset {
            panel: corner.panel,
            row: corner.row,
            col: corner.col,
            panel_mm: corner.panel_mm,
            offset_mm,
            covariance_mm2: std::array::from_fn(|i| {
                std::array::from_fn(|j| variance * covariance[(i, j)] + drawn[(i, j)])
            }),
            views,
        }
    });
    let expected_mm = [map.prior_mm.x, map.prior_mm.z];
    let mut map = TargetMap::new(corners.collect(), expected_mm);
    map.few = few;
    Some(map)
}

fn board_shape(minimum: &Minimum, covariance: &DMatrix<f64>, f_ratio: f64) -> Option<BoardShape> {
    let (shape, first): (Shape, usize) = minimum.problem.shape.zip(minimum.layout.shape)?;
    let seen = minimum.problem.blocks.iter().flat_map(|block| &block.observations);
    let offsets = seen.map(|seen| shape.offset(seen.panel_mm));
    let (low, high, beside) = offsets.fold((0.0, 0.0, 0.0), |(low, high, beside), d| {
        (d.z.min(low), d.z.max(high), d.truncate().length().max(beside))
    });
    Some(BoardShape {
        shape,
        sd_mm: std::array::from_fn(|i| covariance[(first + i, first + i)].sqrt()),
        f_ratio,
        bent_mm: high - low,
        stretched_mm: beside,
    })
}
