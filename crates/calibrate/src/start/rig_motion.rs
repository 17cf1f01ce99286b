//! The poses of a camera and a target that share no frame with the others, from the motion of the rig.
//!
//! For a camera that sees only its own target, which is fixed to the others while the rig moves,
//! every frame gives
//!
//! ```text
//!     camera_from_target = camera_from_rig · rig_from_scene · scene_from_target
//! ```
//!
//! where the first and the last link are the same in all frames. The equations of the rotations
//! alone are linear in the two links (Shah 2013), and the positions follow from the rotations. If
//! the rig rotates about one axis only, a shift of both along this axis is undetermined.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};

use crate::error::DegenerateMotion;
use deltille_core::camera::Pose;
use deltille_core::statistics::median;

/// Minimum rotation about a second axis, rad (1°): more than the noise of poses.
const MIN_ROTATION_RAD: f64 = 0.017;

/// Number of reweighting iterations, in which frames that do not fit lose their weight.
const ROUNDS: usize = 10;

/// The observations of one frame: the pose of the rig from the other cameras, and the pose of the
/// target relative to the camera.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub rig_from_scene: Pose,
    pub camera_from_target: Pose,
}

/// Computes `camera_from_rig` and `scene_from_target`.
pub(super) fn placed_by_motion(moments: &[Moment]) -> Result<[Pose; 2], DegenerateMotion> {
    check_rotations(moments)?;
    let mut weights = vec![1.0; moments.len()];
    let mut rotations = [DQuat::IDENTITY; 2];
    for _ in 0..ROUNDS {
        rotations = solved_rotations(moments, &weights);
        let off = |moment: &Moment| {
            let [camera, target] = rotations;
            let predicted = camera * moment.rig_from_scene.rotation * target;
            predicted.angle_between(moment.camera_from_target.rotation)
        };
        weights = lighter(moments.iter().map(off).collect());
    }
    let mut places = [DVec3::ZERO; 2];
    for _ in 0..ROUNDS {
        places = solved_positions(moments, rotations[0], &weights);
        let off = |moment: &Moment| {
            let [camera, target] = posed(rotations, places);
            let predicted = camera.after(&moment.rig_from_scene).after(&target);
            predicted.translation.distance(moment.camera_from_target.translation)
        };
        weights = lighter(moments.iter().map(off).collect());
    }
    Ok(posed(rotations, places))
}

fn posed(rotations: [DQuat; 2], places: [DVec3; 2]) -> [Pose; 2] {
    [0, 1].map(|i| Pose { rotation: rotations[i], translation: places[i] })
}

/// Returns an error if the rig did not rotate about two axes.
fn check_rotations(moments: &[Moment]) -> Result<(), DegenerateMotion> {
    let Some(first) = moments.first() else { return Err(DegenerateMotion::NoRotation) };
    let back = first.rig_from_scene.rotation.conjugate();
    let turns = moments.iter().map(|moment| {
        let turn = back * moment.rig_from_scene.rotation;
        (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis()
    });
    let mut scatter = Matrix3::zeros();
    for turn in turns {
        scatter += Matrix3::from_fn(|i, j| turn[i] * turn[j] / moments.len() as f64);
    }
    let mut rms: Vec<f64> =
        scatter.symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    rms.sort_by(f64::total_cmp);
    match rms[..] {
        [_, _, most] if most < MIN_ROTATION_RAD => Err(DegenerateMotion::NoRotation),
        [_, second, _] if second < MIN_ROTATION_RAD => Err(DegenerateMotion::OneAxis),
        _ => Ok(()),
    }
}

/// Weights of frames by their residuals: frames with larger residuals than most have almost no influence.
fn lighter(off: Vec<f64>) -> Vec<f64> {
    let usual = median(off.clone()).unwrap_or(0.0).max(f64::MIN_POSITIVE);
    off.into_iter().map(|off| (1.0 + (off / (2.0 * usual)).powi(2)).powi(-2)).collect()
}

/// The rotations X of the camera and Y of the target for which R = X F Y, from R Y⁻¹ − X F = 0.
fn solved_rotations(moments: &[Moment], weights: &[f64]) -> [DQuat; 2] {
    let mut normal = SMatrix::<f64, 18, 18>::zeros();
    for (moment, weight) in moments.iter().zip(weights) {
        let [seen, rig] = [moment.camera_from_target, moment.rig_from_scene]
            .map(|pose| DMat3::from_quat(pose.rotation));
        for i in 0..3 {
            for j in 0..3 {
                // Entry (i, j): Σ seen[i][k] y[k][j] − Σ x[i][k] rig[k][j].
                let mut row = SMatrix::<f64, 18, 1>::zeros();
                for k in 0..3 {
                    row[3 * k + j] += seen.col(k)[i];
                    row[9 + 3 * i + k] -= rig.col(j)[k];
                }
                normal += row * row.transpose() * *weight;
            }
        }
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let matrix = |first: usize| Matrix3::from_fn(|i, j| least[first + 3 * i + j]);
    let sign = matrix(9).determinant().signum();
    let [target, camera] = [0, 9].map(|first| nearest_rotation(matrix(first) * sign));
    [camera, target.conjugate()]
}

fn nearest_rotation(matrix: Matrix3<f64>) -> DQuat {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return DQuat::IDENTITY };
    let flip = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&[1.0, 1.0, flip].into()) * v_t;
    DQuat::from_mat3(&DMat3::from_cols_slice(rotation.as_slice())).normalize()
}

/// The positions x of the camera and y of the target, from X F y + x = place − X f.
fn solved_positions(moments: &[Moment], camera: DQuat, weights: &[f64]) -> [DVec3; 2] {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (moment, weight) in moments.iter().zip(weights) {
        let Moment { rig_from_scene: rig, camera_from_target: seen } = moment;
        let turn = DMat3::from_quat(camera * rig.rotation);
        let is = seen.translation - camera * rig.translation;
        for i in 0..3 {
            let by_target = turn.row(i);
            let row = Vector6::from_fn(|j, _| match j {
                0..3 => by_target[j],
                _ => f64::from(u8::from(j == i + 3)),
            });
            normal += row * row.transpose() * *weight;
            right += row * (weight * is[i]);
        }
    }
    let found = normal.svd(true, true).solve(&right, f64::EPSILON).unwrap_or_default();
    [DVec3::new(found[3], found[4], found[5]), DVec3::new(found[0], found[1], found[2])]
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn pose(random: &mut ChaCha8Rng, turn: DVec3) -> Pose {
        let translation = DVec3::from([0; 3].map(|_| random.random_range(-500.0..500.0)));
        Pose { rotation: DQuat::from_scaled_axis(turn), translation }
    }

    /// Frames of a rig that rotates up to these angles about each axis; every fifth is wrong.
    fn moments(random: &mut ChaCha8Rng, truth: [Pose; 2], reach: DVec3) -> Vec<Moment> {
        let [camera, target] = truth;
        let at = (0..30).map(|index| {
            let turn = reach * DVec3::from([0; 3].map(|_| random.random_range(-1.0..1.0)));
            let rig_from_scene = pose(random, turn);
            let camera_from_target = match index % 5 {
                4 => pose(random, DVec3::ONE),
                _ => camera.after(&rig_from_scene).after(&target),
            };
            Moment { rig_from_scene, camera_from_target }
        });
        at.collect()
    }

    #[test]
    fn a_camera_with_its_own_target_is_placed_if_the_rig_rotates_about_two_axes() {
        for seed in 0..20 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut any = || DVec3::from([0; 3].map(|_| random.random_range(-3.0..3.0)));
            let turns = [any(), any()];
            let truth = turns.map(|turn| pose(&mut random, turn));
            let seen = moments(&mut random, truth, DVec3::new(0.6, 0.4, 0.0));
            let found = placed_by_motion(&seen).unwrap();
            for (found, truth) in found.iter().zip(&truth) {
                let [turn, step] = found.off(truth);
                assert!(turn.length() < 1e-3 && step.length() < 1.0, "{seed}: {turn} {step}");
            }
            let one = moments(&mut random, truth, DVec3::new(0.0, 0.6, 0.0));
            assert_eq!(placed_by_motion(&one).unwrap_err(), DegenerateMotion::OneAxis);
            let none = moments(&mut random, truth, DVec3::ZERO);
            assert_eq!(placed_by_motion(&none).unwrap_err(), DegenerateMotion::NoRotation);
        }
    }
}
