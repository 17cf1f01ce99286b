//! Equations and covariances against finite differences.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::equations::factor::Factor;
use crate::input::observation::Observation;
use crate::input::robot::{Mounting, RobotNoise};
use crate::problem::robot::Robot;
use crate::problem::unknowns::Block;
use crate::problem::unknowns::{CameraUnknowns, PanelUnknowns, Prior, TargetUnknowns};
use crate::{PanelRef, Shape};
use deltille_core::camera::{Camera, Pose};
use deltille_core::damping::Damping;
use glam::DQuat;
use glam::DVec2;
use glam::DVec3;
use nalgebra::Vector3;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Rig,
    Scene,
    Bent,
    Robot,
    Map { frames: usize },
}

/// Two cameras and two panels in three frames with noise, where every link is unknown that can
/// be unknown; the same with a target for each panel; or one camera and a panel that is bent,
/// that a robot moves, or whose corners are unknown.
fn problem(kind: Kind) -> Problem {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let count = if matches!(kind, Kind::Rig | Kind::Scene) { 2 } else { 1 };
    let beside = |x: f64| Pose { translation: DVec3::new(x, 3.0, -2.0), ..Pose::IDENTITY };
    let cameras = (0..count).map(|i| {
        let camera = Camera::pinhole(640 + 80 * i, 480, 1.0);
        let free = vec![true; camera.parameters().len()];
        let free = free.iter().enumerate().map(|(i, _)| i < 6).collect();
        let camera_from_rig = beside(-60.0 * f64::from(i));
        CameraUnknowns { camera_from_rig, pose_free: i > 0, ..CameraUnknowns::alone(camera, free) }
    });
    let mut covariance = [[0.0; 6]; 6];
    (0..6).for_each(|i| covariance[i][i] = if i < 3 { 1e-6 } else { 1e-2 });
    let panels = (0..count).map(|i| {
        let target_from_panel = beside(70.0 * f64::from(i));
        let prior = Prior::new(beside(70.0 * f64::from(i) + 0.05), covariance);
        let prior = prior.filter(|_| i > 0);
        let target = if kind == Kind::Scene { i as usize } else { 0 };
        PanelUnknowns { target, target_from_panel, pose_free: i > 0, prior }
    });
    let turned = Pose::looking_at(DVec3::new(3.0, 7.0, 90.0), DVec3::ONE, DVec3::Y);
    let other = TargetUnknowns { scene_from_target: turned, pose_free: true };
    let targets = match kind {
        Kind::Scene => vec![TargetUnknowns::SCENE, other],
        _ => vec![TargetUnknowns::SCENE],
    };
    let moments = match kind {
        Kind::Map { frames } => frames,
        Kind::Rig | Kind::Scene | Kind::Bent => 3,
        Kind::Robot => 6,
    };
    let frames = (0..moments).map(|i| {
        let (sin, cos) = (2.4 * i as f64).sin_cos();
        let eye = DVec3::new(50.0 * cos, 50.0 * sin, 300.0);
        Pose::looking_at(eye, DVec3::new(30.0, 20.0, 0.0), DVec3::Y)
    });
    let shape = (kind == Kind::Bent).then(|| Shape {
        middle_mm: DVec3::new(30.0, 20.0, 0.0),
        reach_mm: 40.0,
        coefficients_mm: std::array::from_fn(|i| 0.1 * i as f64),
    });
    let mut problem = Problem {
        cameras: cameras.collect(),
        frames: frames.collect(),
        targets,
        panels: panels.collect(),
        shape,
        ..Problem::default()
    };
    for frame in 0..moments {
        for (camera, panel) in (0..count).flat_map(|c| (0..count).map(move |p| (c, p))) {
            let seen = (0..20).map(|k| Observation {
                row: k / 5,
                col: k % 5,
                panel_mm: DVec3::new(12.0 * f64::from(k % 5), 11.0 * f64::from(k / 5), 0.0),
                pixel: DVec2::ZERO,
                cov: None,
            });
            let panel = PanelRef::new(panel as usize, panel);
            let block =
                Block { camera: camera as usize, frame, panel, observations: seen.collect() };
            let residuals: Option<Vec<_>> = problem.residuals(&block).collect();
            let residuals = residuals.expect("the cameras image all corners");
            let mut block = block;
            let seen = Arc::make_mut(&mut block.observations).iter_mut();
            for (seen, residual) in seen.zip(residuals) {
                let noise = [0; 2].map(|_| rng.random_range(-0.5..0.5));
                seen.pixel = DVec2::from(noise) - residual;
            }
            problem.blocks.push(block);
        }
    }
    if kind == Kind::Robot {
        let mut robot = Robot {
            mounting: Mounting::EyeInHand,
            mount_from_camera: turned,
            ground_from_board: beside(400.0).after(&turned.inverse()),
            scale: 1.01,
            scale_free: true,
            poses: Vec::new(),
            noise: RobotNoise { rotation_rad: 0.01, translation_mm: 0.5 },
            variance: 0.7,
        };
        let measured = problem.frames.iter().map(|frame| {
            let mut any = |reach: f64| rng.random_range(-reach..reach);
            let turn = DVec3::new(any(0.01), any(0.01), any(0.01));
            let rotation = DQuat::from_scaled_axis(turn);
            let translation = DVec3::new(any(0.5), any(0.5), any(0.5));
            Pose { rotation, translation }.after(&robot.predicted(frame))
        });
        // A frame may have no link.
        let measured = measured.enumerate().map(|(i, pose)| Some(pose).filter(|_| i != 2));
        robot.poses = measured.collect();
        problem.robot = Some(robot);
    }
    if let Kind::Map { .. } = kind {
        let mut map = CornerMap::flat(&problem.blocks);
        for offset in &mut map.offsets_mm {
            *offset = DVec3::from([0; 3].map(|_| rng.random_range(-0.1..0.1)));
        }
        problem.map = Some(map);
    }
    problem
}

fn whitening(problem: &Problem) -> Whitening {
    let of = |block: &Block| {
        (0..block.observations.len()).map(|k| [2.0, 0.1 * (k % 7) as f64, 1.5]).collect()
    };
    Whitening { blocks: problem.blocks.iter().map(of).collect(), common_px: None, sigma: 0.8 }
}

/// All whitened residuals: those of the corners, and the deviations from priors.
fn residuals(problem: &Problem, whitening: &Whitening) -> DVector<f64> {
    let mut all = Vec::new();
    for (block, weights) in problem.blocks.iter().zip(&whitening.blocks) {
        for (residual, &w) in problem.residuals(block).map(Option::unwrap).zip(weights) {
            all.extend(Whitening::apply(w, residual).to_array());
        }
    }
    for panel in &problem.panels {
        if let Some(prior) = &panel.prior {
            let (off, information) = prior.off(&panel.target_from_panel);
            let half = (information * whitening.sigma.powi(2)).cholesky().unwrap().l();
            all.extend((half.transpose() * -off).iter());
        }
    }
    if let Some(robot) = &problem.robot {
        let roots = robot.weights().map(f64::sqrt);
        for (frame, measured) in problem.frames.iter().zip(&robot.poses) {
            let off = measured.map(|measured| robot.off(frame, &measured));
            let off = off.into_iter().flatten().flat_map(|off| off.to_array());
            all.extend(off.zip(&roots).map(|(off, root)| -off * root));
        }
    }
    if let Some(map) = &problem.map {
        let offsets = map.offsets_mm.iter();
        all.extend(offsets.flat_map(|&mm| (mm / map.prior_mm * whitening.sigma).to_array()));
    }
    DVector::from_vec(all)
}

fn step(layout: &Layout, frames: usize, values: &DVector<f64>) -> Step {
    let (shared, others) = values.as_slice().split_at(layout.shared);
    let (frames, corners) = others.split_at(6 * frames);
    let frames = frames.chunks_exact(6).map(Vector6::from_column_slice).collect();
    let corners = corners.chunks_exact(3).map(Vector3::from_column_slice).collect();
    Step { shared: DVector::from_column_slice(shared), frames, corners }
}

/// Elimination of frames or corners changes nothing, and every derivative matches the residuals: cost, step and
/// covariances equal those of the whole equations, formed by finite differences.
#[test]
fn equations_match_finite_differences_of_the_residuals() {
    // With few frames corners are eliminated, with many frames the frames.
    let maps = [5, 12].map(|frames| Kind::Map { frames });
    for kind in [Kind::Rig, Kind::Scene, Kind::Bent, Kind::Robot].into_iter().chain(maps) {
        let problem = problem(kind);
        let (layout, whitening) = (Layout::of(&problem), whitening(&problem));
        let normal = Normal::of(&problem, &layout, &whitening, Loss::Squared).unwrap();
        let here = residuals(&problem, &whitening);
        let of_corners = problem.map.as_ref().map_or(0, |map| 3 * map.len());
        let frames = problem.frames.len();
        let count = layout.shared + 6 * frames + of_corners;
        let column = |i: usize| {
            // About a ten-millionth of a pixel, regardless of the unit.
            let unit = DVector::from_fn(count, |j, _| f64::from(u8::from(i == j)));
            let at = |by: f64| {
                residuals(
                    &problem.after(&layout, &step(&layout, frames, &(&unit * by))),
                    &whitening,
                )
            };
            let size = 1e-4 / (at(1e-6) - &here).norm().max(1e-9) * 1e-6;
            (at(size) - at(-size)) / (2.0 * size)
        };
        let columns: Vec<DVector<f64>> = (0..count).map(column).collect();
        let jacobian = DMatrix::from_columns(&columns);
        let whole = jacobian.tr_mul(&jacobian);
        let scale = DVector::from_fn(count, |i, _| whole[(i, i)].sqrt());
        let scaled = DMatrix::from_fn(count, count, |i, j| whole[(i, j)] / scale[i] / scale[j]);
        let inverse = scaled.cholesky().expect("everything is determined").inverse();
        let right = jacobian.tr_mul(&-&here).component_div(&scale);
        let expected = (&inverse * right).component_div(&scale);

        assert!((normal.cost - here.norm_squared()).abs() < 1e-9 * normal.cost);
        let found = normal.step(&layout, Damping::NONE, &mut None).unwrap();
        let frames = found.frames.iter().flat_map(|frame| frame.iter());
        let corners = found.corners.iter().flat_map(|corner| corner.iter());
        let found = found.shared.iter().chain(frames).chain(corners).copied();
        let found = DVector::from_iterator(count, found);
        for i in 0..count {
            let deviation = inverse[(i, i)].sqrt() / scale[i];
            let off = (found[i] - expected[i]).abs();
            assert!(off < 1e-4 * deviation, "unknown {i}: {off} of {deviation}");
        }
        let covariances = normal.covariances(&layout).unwrap();
        assert!(covariances.loose.is_empty());
        let all = normal.covariance_of_all(&covariances).unwrap();
        // The columns are in the order shared, frames, corners, or shared, corners, frames.
        let of_frames = 6 * problem.frames.len();
        let own = |i: usize| match (i.checked_sub(layout.shared), layout.corners) {
            (Some(i), Some(first)) if i < of_frames => first + of_corners + i,
            (Some(i), Some(first)) => first + i - of_frames,
            _ => i,
        };
        for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
            let limit = (inverse[(i, i)] * inverse[(j, j)]).sqrt();
            let off = all[(own(i), own(j))] * scale[i] * scale[j] - inverse[(i, j)];
            assert!(off.abs() < 1e-4 * limit, "{i}, {j}: {off} of {limit}");
        }
        for i in 0..count {
            let shared = covariances.shared.diagonal();
            let frames = covariances.frames.iter().flat_map(|c| c.diagonal().data.0[0]);
            let corners = covariances.corners.iter().flat_map(|c| c.diagonal().data.0[0]);
            let all = shared.iter().copied().chain(frames).chain(corners);
            let found = all.collect::<Vec<f64>>()[i];
            let ratio = found / inverse[(i, i)] * scale[i] * scale[i];
            assert!((ratio - 1.0).abs() < 1e-3, "variance of unknown {i}: {ratio}");
        }
    }
}

/// A step with the factor of other equations, here with other weights and another damping, equals that with their
/// own.
#[test]
fn steps_with_a_similar_factor_equal_those_with_their_own() {
    for frames in [5, 12] {
        let problem = problem(Kind::Map { frames });
        let layout = Layout::of(&problem);
        let whitening = whitening(&problem);
        let mut others = whitening.clone();
        let of_weight = others.blocks.iter_mut().flatten().flatten().enumerate();
        of_weight.for_each(|(i, weight)| *weight *= 1.0 + 0.02 * (i % 5) as f64);
        let normal_of = |whitening| Normal::of(&problem, &layout, whitening, Loss::Squared);
        let [normal, other] = [&whitening, &others].map(|whitening| normal_of(whitening).unwrap());
        let factor = Factor::of(other.reduced(Damping::NONE).unwrap().matrix).unwrap();
        let damping = Damping::from(1e-4);
        let found = normal.solve_with(&factor, damping, &normal.inverses(damping).unwrap());
        let Reduced { matrix, right, .. } = normal.reduced(damping).unwrap();
        let own = Factor::of(matrix.clone()).unwrap().solve(&right);
        let off = found.expect("the equations are similar") - &own;
        let size = |step: &DVector<f64>| step.dot(&(&matrix * step)).sqrt();
        assert!(size(&off) < 1e-5 * size(&own), "{} of {}", size(&off), size(&own));
    }
}
