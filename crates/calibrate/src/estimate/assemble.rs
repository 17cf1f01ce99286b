//! Assembles the estimate from a settled adjustment: values, standard deviations, residuals and patterns in them.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, Matrix3};

use super::listed::{covariance_of_all, joint_covariance};
use super::target_map::{CornerOffset, TargetMap};
use super::values::{
    CameraEstimate, Corner, Estimate, FrameEstimate, Parameter, TargetEstimate, ViewEstimate,
    rms_px,
};
use crate::adjust::lack_of_fit::lack_of_fit;
use crate::adjust::reweighting::{Settled, variance};
use crate::equations::covariances::Covariances;
use crate::equations::minimise::Minimum;
use crate::error::CalibrationError;
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::loss::Loss;
use crate::input::order::in_order;
use crate::input::panel::{PanelPrior, PanelRef};
use crate::matrix::Matrix;
use crate::problem::bundle::Problem;
use crate::problem::corner_map::CornerMap;
use crate::problem::shape::{BoardShape, Shape};
use crate::problem::whitening::deviations;
use crate::start::frames::Frame;
use crate::uncertainty::agreement::{Observed, observed};
use crate::uncertainty::board_errors::{board_errors, drawn_to_plan};
use crate::uncertainty::information::known_so_far;
use crate::uncertainty::projection::{ObservedCovariance, ProjectionUncertainty};
use crate::uncertainty::split_halves;
use crate::uncertainty::state_equations::StateEquations;
use deltille_core::camera::{Lens, PROJECTION_PARAMETERS};

impl Estimate {
    /// Assembles the estimate; `frames` are those of the settled problem, `found` are its covariances if they are
    /// known, and `f_ratio` is that of the shape.
    ///
    /// # Errors
    /// Returns an error if the views do not determine the pose of a frame, a camera or a panel.
    pub(crate) fn new(
        calibration: &Calibration,
        frames: &[&Frame],
        settled: &mut Settled,
        found: Option<Covariances>,
        f_ratio: f64,
    ) -> Result<Self, CalibrationError> {
        let Calibration { cameras, loss, distances_mm, board_accuracy_mm, .. } = calibration;
        let loss = *loss;
        let Settled { minimum, whitening, .. } = &*settled;
        let Minimum { normal, layout, .. } = minimum;
        let open = |parameters: String| CalibrationError::Undetermined { parameters };
        let found = found.or_else(|| normal.covariances(layout));
        let found = found.ok_or_else(|| open("the poses".to_owned()))?;
        let poses = open_poses(calibration, minimum, &found);
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
        let of_all = covariance_of_all(calibration, minimum, &found).map(|all| all * variance);
        // Nothing below needs the equations.
        settled.minimum.normal.release_if_large();
        let Settled { minimum, whitening, .. } = &*settled;
        let Minimum { problem, layout, steps, .. } = minimum;
        let states = states(frames, settled, loss);
        let mut views = views(cameras, frames, settled);
        let cameras = cameras.iter().enumerate().map(|(index, camera)| {
            let views = std::mem::take(&mut views[index]);
            let mut camera = camera_estimate(index, camera, views, settled, &found, &covariance);
            let (states, observed) = (&states[index], observed.as_ref());
            camera.projection = projection(&camera, states, index, settled, distances_mm, observed);
            let of_pose = layout.cameras[index].zip(observed);
            camera.observed_pose_sd =
                of_pose.map(|(first, observed)| sd_from(&observed.covariance, first));
            camera
        });
        let cameras: Vec<CameraEstimate> = cameras.collect();
        let joint = joint(&cameras, settled, observed.as_ref());
        let joint_covariance = joint_covariance(
            calibration,
            minimum,
            &cameras,
            frames,
            &covariance,
            of_all.as_ref(),
            observed.as_ref(),
        );
        let panels = problem.panels.iter().zip(&layout.panels).map(|(panel, first)| PanelPrior {
            target_from_panel: panel.target_from_panel,
            covariance: first.map(|first| {
                std::array::from_fn(|i| std::array::from_fn(|j| covariance[(first + i, first + j)]))
            }),
        });
        Ok(Self {
            frames: frame_estimates(&cameras, frames, problem, &found, variance),
            targets: target_estimates(calibration, minimum, &covariance),
            panels: panels.collect(),
            joint,
            covariance: joint_covariance,
            shape: board_shape(minimum, &covariance, f_ratio),
            map: target_map(settled, &found.corners, variance, loss, drawn.as_ref()),
            rms_px: rms_px(cameras.iter().flat_map(CameraEstimate::corners)),
            common_px: whitening.common_px,
            sigma: variance.sqrt(),
            lack_of_fit: lack_of_fit(problem, whitening),
            steps: *steps,
            is_compensated: calibration.is_compensated,
            known: known_so_far(settled, &found, variance),
            states,
            cameras,
            ..Self::default()
        })
    }
}

/// Descriptions of the poses of cameras, panels and targets that the views do not determine.
fn open_poses(calibration: &Calibration, minimum: &Minimum, found: &Covariances) -> Vec<String> {
    let Minimum { problem, layout, .. } = minimum;
    let is_open = |first: Option<usize>| {
        first.is_some_and(|first| (first..first + 6).any(|i| found.loose.contains(&i)))
    };
    let of_cameras =
        calibration.cameras.iter().zip(&layout.cameras).filter(|(_, first)| is_open(**first));
    let of_cameras = of_cameras.map(|(camera, _)| format!("the pose of {}", camera.name));
    let panels: BTreeSet<PanelRef> = problem.blocks.iter().map(|block| block.panel).collect();
    let of_panels = panels.into_iter().filter(|panel| is_open(layout.panels[panel.index()]));
    let of_panels = of_panels.map(|panel| format!("the pose of panel {panel}"));
    let of_targets = calibration.targets.iter().zip(&layout.targets);
    let of_targets = of_targets.filter(|(_, first)| is_open(**first));
    let of_targets = of_targets.map(|(target, _)| format!("the pose of target {}", target.name));
    of_cameras.chain(of_panels).chain(of_targets).collect()
}

/// The state equations of the views of each camera, in the natural order of their names.
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

/// Standard deviations of successive unknowns from a column on.
fn sd_from<const N: usize>(covariance: &DMatrix<f64>, first: usize) -> [f64; N] {
    std::array::from_fn(|i| covariance[(first + i, first + i)].sqrt())
}

fn target_estimates(
    calibration: &Calibration,
    Minimum { problem, layout, .. }: &Minimum,
    covariance: &DMatrix<f64>,
) -> Vec<TargetEstimate> {
    let of_targets = calibration.targets.iter().zip(&problem.targets).zip(&layout.targets);
    let targets = of_targets.map(|((given, target), first)| TargetEstimate {
        name: given.name.clone(),
        panels: given.panels.clone(),
        scene_from_target: target.scene_from_target,
        pose_sd: first.map(|first| sd_from(covariance, first)),
    });
    targets.collect()
}

fn frame_estimates(
    cameras: &[CameraEstimate],
    frames: &[&Frame],
    problem: &Problem,
    found: &Covariances,
    variance: f64,
) -> Vec<FrameEstimate> {
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
    of_frames.collect()
}

/// The views of every camera, with all corners that the camera can image.
fn views(cameras: &[CameraViews], frames: &[&Frame], settled: &Settled) -> Vec<Vec<ViewEstimate>> {
    let Settled { problem, outliers, .. } = settled;
    let mut corners: BTreeMap<(usize, usize), Vec<Corner>> = BTreeMap::new();
    for (block, outliers) in problem.blocks.iter().zip(outliers) {
        let seen = block.observations.iter().zip(problem.residuals(block));
        let of_block = seen.zip(outliers).filter_map(|((seen, residual), &outlier)| {
            let (panel, row, col, pixel) = (block.panel, seen.row, seen.col, seen.pixel);
            let residual = residual?;
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
    // Single knots of a spline have no meaning.
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
        constraints: given.constraints.clone(),
        parameters: values
            .map(|(i, (name, value))| Parameter { name: name.clone(), value, sd: sd_of(i) })
            .collect(),
        covariance: Matrix::from_fn(columns.len(), columns.len(), |i, j| {
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

/// The projection uncertainty of a camera; the observed covariance of the shared unknowns comes
/// from the frames.
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
    let observed = observed.map(|observed| {
        let columns: Vec<usize> = columns.iter().map(|(_, column)| *column).collect();
        let mut own = observed_of(observed, &columns);
        // The halves of the views do not know what a prior knows.
        if let (Some(state), None) = (state, &problem.cameras[index].prior) {
            let noise = camera.covariance.inner();
            let raised =
                split_halves::raised(state, &camera.camera, own.covariance.into_inner(), noise);
            own.covariance = Matrix::new(raised);
        }
        own
    });
    let (whitening, free) = (&settled.whitening, camera.free());
    ProjectionUncertainty::of(problem, whitening, index, &free, distances_mm, observed)
}

/// The part of an observed covariance that belongs to some columns.
fn observed_of(observed: &Observed, columns: &[usize]) -> ObservedCovariance {
    let n = columns.len();
    let own = |of: &DMatrix<f64>| Matrix::from_fn(n, n, |i, j| of[(columns[i], columns[j])]);
    let covariance = own(&observed.covariance);
    let of_board = observed.of_board.as_ref().map(own);
    ObservedCovariance { covariance, of_board, freedom: observed.freedom }
}

/// The observed covariance of all cameras together; `None` for a single camera, or with splines.
fn joint(
    cameras: &[CameraEstimate],
    settled: &Settled,
    observed: Option<&Observed>,
) -> Option<ObservedCovariance> {
    let is_spline = |camera: &CameraEstimate| matches!(camera.camera.lens, Lens::Spline(_));
    let observed = observed?;
    if cameras.len() == 1 || cameras.iter().any(is_spline) {
        return None;
    }
    let layout = &settled.minimum.layout;
    let mut columns = Vec::new();
    let mut starts = Vec::new();
    for (parameters, pose) in layout.parameters.iter().zip(&layout.cameras) {
        starts.push(columns.len());
        columns.extend(parameters.iter().map(|(_, column)| *column));
        columns.extend(pose.iter().flat_map(|first| *first..first + 6));
    }
    let mut joint = observed_of(observed, &columns);
    // The covariances of single cameras may be raised.
    let mut covariance = joint.covariance.into_inner();
    for (camera, start) in cameras.iter().zip(starts) {
        let own = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
        if let Some(own) = own {
            let n = own.covariance.rows();
            covariance.view_mut((start, start), (n, n)).copy_from(own.covariance.inner());
        }
    }
    joint.covariance = Matrix::new(covariance);
    Some(joint)
}

/// Minimum sum of the weights of a corner's observations for a measured position: a view has two
/// coordinates, and a position has three.
const MIN_VIEWS: f64 = 2.0;

/// Minimum mean weight of these observations: a majority must count.
const MIN_WEIGHT: f64 = 0.5;

/// Whether a position depends on too few effective observations.
fn rests_on_few(&(weight, count): &(f64, usize)) -> bool {
    weight < MIN_VIEWS || weight < MIN_WEIGHT * count as f64
}

/// For each corner, the sum of the weights of its observations and their number. Outliers have no weight; views whose
/// whole panel is excluded are omitted.
fn weights(map: &CornerMap, settled: &Settled, loss: Loss) -> Vec<(f64, usize)> {
    let Settled { minimum, whitening, problem, outliers } = settled;
    let mut weights = vec![(0.0, 0); map.len()];
    let off = deviations(problem, whitening);
    let blocks = problem.blocks.iter().zip(&minimum.problem.blocks).zip(off).zip(outliers);
    for (((block, part), off), outliers) in blocks {
        if part.observations.is_empty() {
            continue;
        }
        for ((index, off), outlier) in map.indices(block).zip(off).zip(outliers) {
            let Some(index) = index else { continue };
            let (weight, count) = &mut weights[index];
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
    let labels = map.corners.iter().map(|corner| (corner.panel, corner.row, corner.col));
    let left = labels.zip(&weights).filter(|(_, of)| of.1 > 0 && rests_on_few(of));
    let not_measured = left.map(|(label, _)| label).collect();
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
    map.not_measured = not_measured;
    Some(map)
}

fn board_shape(minimum: &Minimum, covariance: &DMatrix<f64>, f_ratio: f64) -> Option<BoardShape> {
    let (shape, first): (Shape, usize) = minimum.problem.shape.zip(minimum.layout.shape)?;
    let seen = minimum.problem.blocks.iter().flat_map(|block| block.observations.iter());
    let offsets = seen.map(|seen| shape.offset(seen.panel_mm));
    let (low, high, beside) = offsets.fold((0.0, 0.0, 0.0), |(low, high, beside), d| {
        (d.z.min(low), d.z.max(high), d.truncate().length().max(beside))
    });
    Some(BoardShape {
        shape,
        sd_mm: sd_from(covariance, first),
        f_ratio,
        bent_mm: high - low,
        stretched_mm: beside,
    })
}
