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
//! alone are linear in the two links (Shah 2013), and the positions follow from the rotations. Three
//! frames determine the rotations; the triple that agrees best with the median frame shows which frames are wrong. If the
//! rig rotates about one axis only, a shift of both along this axis is undetermined.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_chacha::ChaCha8Rng;

use crate::error::DegenerateMotion;
use deltille_core::camera::Pose;
use deltille_core::statistics::median;

/// Minimum rotation about a second axis, rad (1°): more than the noise of poses.
const MIN_ROTATION_RAD: f64 = 0.017;

/// Number of reweighting iterations, in which frames that do not fit lose their weight.
const ROUNDS: usize = 10;

/// Number of triples of frames. If half of the frames are wrong, one in nine triples is right, so that all of them are
/// wrong once in 10⁶ calibrations.
const TRIPLES: usize = 120;

/// The observations of one frame: the pose of the rig from the other cameras or a robot, and the pose of the
/// target relative to the camera.
#[derive(Clone, Copy)]
pub(crate) struct Moment {
    pub rig_from_scene: Pose,
    pub camera_from_target: Pose,
}

/// Computes `camera_from_rig` and `scene_from_target`. Up to half of the frames may be wrong.
pub(crate) fn placed_by_motion(moments: &[Moment]) -> Result<[Pose; 2], DegenerateMotion> {
    check_rotations(moments.iter().map(|moment| moment.rig_from_scene.rotation))?;
    let mut rotations = agreeing_rotations(moments);
    let mut weights = lighter(angles(moments, rotations));
    for _ in 0..ROUNDS {
        rotations = solved_rotations(moments, &weights);
        weights = lighter(angles(moments, rotations));
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

/// The angle between measured and predicted rotation of each frame.
fn angles(moments: &[Moment], [camera, target]: [DQuat; 2]) -> Vec<f64> {
    let off = |moment: &Moment| {
        let predicted = camera * moment.rig_from_scene.rotation * target;
        predicted.angle_between(moment.camera_from_target.rotation)
    };
    moments.iter().map(off).collect()
}

/// The rotations from those three frames that agree best with the median frame.
fn agreeing_rotations(moments: &[Moment]) -> [DQuat; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let of_triple = |_| {
        let some = sample(&mut random, moments.len(), moments.len().min(3));
        let some: Vec<Moment> = some.into_iter().map(|index| moments[index]).collect();
        let rotations = rotations_of(&some);
        (median(angles(moments, rotations)).unwrap_or(f64::INFINITY), rotations)
    };
    let best = (0..TRIPLES).map(of_triple).min_by(|(one, _), (other, _)| one.total_cmp(other));
    best.map_or([DQuat::IDENTITY; 2], |(_, rotations)| rotations)
}

/// The rotations from a few frames: those of the target relative to the first frame are those of the rig about rotated axes
/// (Park & Martin 1994).
fn rotations_of(moments: &[Moment]) -> [DQuat; 2] {
    let Some(first) = moments.first() else { return [DQuat::IDENTITY; 2] };
    let turn = |now: DQuat, first: DQuat| {
        let turn = now * first.conjugate();
        (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis()
    };
    let mut correlation = Matrix3::zeros();
    for now in &moments[1..] {
        let seen = turn(now.camera_from_target.rotation, first.camera_from_target.rotation);
        let rig = turn(now.rig_from_scene.rotation, first.rig_from_scene.rotation);
        correlation += Matrix3::from_fn(|i, j| seen[i] * rig[j]);
    }
    let camera = nearest_rotation(correlation);
    let target = (camera * first.rig_from_scene.rotation).conjugate();
    [camera, target * first.camera_from_target.rotation]
}

/// Returns an error if these rotations are not about two axes.
pub(crate) fn check_rotations(
    rotations: impl IntoIterator<Item = DQuat>,
) -> Result<(), DegenerateMotion> {
    let [most, second, _] = rotation_spread(rotations).map(|(rms, _)| rms);
    match (most < MIN_ROTATION_RAD, second < MIN_ROTATION_RAD) {
        (true, _) => Err(DegenerateMotion::NoRotation),
        (false, true) => Err(DegenerateMotion::OneAxis),
        (false, false) => Ok(()),
    }
}

/// The principal RMS angles of rotations, rad, relative to the first of them, with their axes; the largest first.
pub(crate) fn rotation_spread(rotations: impl IntoIterator<Item = DQuat>) -> [(f64, DVec3); 3] {
    let mut rotations = rotations.into_iter();
    let back = rotations.next().unwrap_or(DQuat::IDENTITY).conjugate();
    let (mut scatter, mut count) = (Matrix3::zeros(), 1.0);
    for rotation in rotations {
        let turn = rotation * back;
        let turn = (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis();
        scatter += Matrix3::from_fn(|i, j| turn[i] * turn[j]);
        count += 1.0;
    }
    let eigen = (scatter / count).symmetric_eigen();
    let axis = |i: usize| DVec3::from_slice(eigen.eigenvectors.column(i).as_slice());
    let mut spread = [0, 1, 2].map(|i| (eigen.eigenvalues[i].max(0.0).sqrt(), axis(i)));
    spread.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    spread
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

    /// Frames of a rig that rotates up to these angles about each axis; two of five are wrong.
    fn moments(random: &mut ChaCha8Rng, truth: [Pose; 2], reach: DVec3) -> Vec<Moment> {
        let [camera, target] = truth;
        let at = (0..30).map(|index| {
            let turn = reach * DVec3::from([0; 3].map(|_| random.random_range(-1.0..1.0)));
            let rig_from_scene = pose(random, turn);
            let camera_from_target = match index % 5 {
                3 | 4 => pose(random, DVec3::ONE),
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
