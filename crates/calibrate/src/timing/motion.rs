//! The path of the target through five successive frames.
//!
//! ```text
//!   x(t) = c₁ t + c₂ t² + c₃ t³ + c₄ t⁴        rotation and translation (ω, τ) from the pose of the middle frame, through
//!                                              its four neighbours
//! ```
//!
//! For a vibration of angular frequency f and frames at intervals h, the velocity is wrong by a fraction f⁴h⁴/30: 0.5 % at 3 Hz
//! and 30 frames a second. Through two neighbours, it would be wrong by f²h²/6, 7 %.

use glam::{DQuat, DVec3};
use nalgebra::{Matrix4, Vector6};

use deltille_core::camera::Pose;

/// Number of successive frames that determine a path.
pub(super) const FRAMES: usize = 5;

/// The motion of the target about a frame, in the rig frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion([Vector6<f64>; FRAMES - 1]);

impl Motion {
    /// The motion from a pose through its four neighbours, whose times are relative to it, s. Times are distinct, and not zero.
    pub(super) fn through(at: &Pose, neighbours: &[(f64, Pose)]) -> Option<Self> {
        let powers = Matrix4::from_fn(|row, power| neighbours[row].0.powi(power as i32 + 1));
        let inverse = powers.try_inverse()?;
        let off = neighbours.iter().map(|(_, pose)| {
            let [turn, moved] = pose.off(at);
            Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z)
        });
        let off: Vec<Vector6<f64>> = off.collect();
        let coefficient = |power: usize| {
            off.iter()
                .enumerate()
                .map(|(row, off)| off * inverse[(power, row)])
                .sum::<Vector6<f64>>()
        };
        Some(Self(std::array::from_fn(coefficient)))
    }

    /// The pose at a time after the frame, s.
    pub(super) fn pose(&self, at: &Pose, time: f64) -> Pose {
        let by = self.0.iter().rev().fold(Vector6::zeros(), |sum, of| (sum + of) * time);
        moved(at, &by)
    }

    /// The velocity at a time after the frame.
    pub(super) fn velocity(&self, time: f64) -> Vector6<f64> {
        let terms = self.0.iter().zip([1.0, 2.0, 3.0, 4.0]).rev();
        terms.fold(Vector6::zeros(), |sum, (of, power)| sum * time + of * power)
    }
}

/// The pose moved by (ω, τ).
pub(super) fn moved(pose: &Pose, by: &Vector6<f64>) -> Pose {
    let turn = DVec3::new(by[0], by[1], by[2]);
    let step = DVec3::new(by[3], by[4], by[5]);
    Pose {
        rotation: (DQuat::from_scaled_axis(turn) * pose.rotation).normalize(),
        translation: pose.translation + step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniformly_accelerated_motion_is_reproduced() {
        let start = Pose {
            rotation: DQuat::from_rotation_y(0.3),
            translation: DVec3::new(5.0, -3.0, 400.0),
        };
        let velocity = Vector6::new(0.4, -0.2, 0.1, 100.0, 50.0, -30.0);
        let acceleration = Vector6::new(0.5, 0.3, -0.8, 400.0, -900.0, 200.0);
        let zero = Vector6::zeros();
        let truth = Motion([velocity, acceleration / 2.0, zero, zero]);
        let times = [-0.07, -0.04, 0.03, 0.08];
        let poses = times.map(|time| truth.pose(&start, time));
        let neighbours: Vec<(f64, Pose)> = times.into_iter().zip(poses).collect();
        let found = Motion::through(&start, &neighbours).unwrap();
        for time in [-0.03, 0.0, 0.05] {
            assert!((found.velocity(time) - velocity - acceleration * time).amax() < 1e-6);
            let [turn, step] = found.pose(&start, time).off(&truth.pose(&start, time));
            assert!(turn.length() < 1e-9 && step.length() < 1e-6);
        }
    }
}
