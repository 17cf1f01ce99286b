//! The links of frames to the poses of a robot.
//!
//! ```text
//!   P = X · F · Z⁻¹        X: mount_from_camera, F: camera_from_board of a frame, Z: ground_from_board
//!
//!   eye-in-hand    mount = flange, ground = base:      base_from_flange = P⁻¹
//!   eye-to-hand    mount = base,   ground = flange:    base_from_flange = P
//! ```
//!
//! The residual is the difference (ω, τ) of this base_from_flange from that of the robot, whose translation is multiplied
//! by a scale: a robot errs by a rotation about the origin of its flange and by a displacement of this origin.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::input::robot::{Mounting, RobotNoise};
use deltille_core::camera::Pose;

/// The unknowns X, Z and scale, and the poses of a robot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Robot {
    pub mounting: Mounting,
    /// X.
    pub mount_from_camera: Pose,
    /// Z.
    pub ground_from_board: Pose,
    pub scale: f64,
    pub scale_free: bool,
    /// `base_from_flange` as the robot reported it, for each frame; `None` where it is not used.
    pub poses: Vec<Option<Pose>>,
    pub noise: RobotNoise,
    /// The variance of whitened residuals of corners, in which costs are counted.
    pub variance: f64,
}

/// The residual of a frame, predicted minus measured, and its derivatives.
pub(crate) struct Link {
    pub off: Vector6<f64>,
    pub by_mount: Matrix6<f64>,
    pub by_ground: Matrix6<f64>,
    pub by_scale: Vector6<f64>,
    pub by_frame: Matrix6<f64>,
}

impl Robot {
    /// Number of unknowns.
    pub(crate) fn columns(&self) -> usize {
        12 + usize::from(self.scale_free)
    }

    /// The predicted `base_from_flange` of a frame.
    pub(crate) fn predicted(&self, camera_from_board: &Pose) -> Pose {
        let whole = self.mount_from_camera.after(camera_from_board);
        let whole = whole.after(&self.ground_from_board.inverse());
        match self.mounting {
            Mounting::EyeInHand => whole.inverse(),
            Mounting::EyeToHand => whole,
        }
    }

    /// The `camera_from_board` that follows from a measured `base_from_flange`.
    pub(crate) fn seen(&self, measured: &Pose) -> Pose {
        let measured = Pose { translation: measured.translation * self.scale, ..*measured };
        let mount_from_ground = match self.mounting {
            Mounting::EyeInHand => measured.inverse(),
            Mounting::EyeToHand => measured,
        };
        self.mount_from_camera.inverse().after(&mount_from_ground).after(&self.ground_from_board)
    }

    /// The difference (ω, τ) of the predicted pose of a frame from a measured one.
    pub(crate) fn off(&self, camera_from_board: &Pose, measured: &Pose) -> [DVec3; 2] {
        let translation = measured.translation * self.scale;
        self.predicted(camera_from_board).off(&Pose { translation, ..*measured })
    }

    /// The residual of a frame with its derivatives.
    pub(crate) fn link(&self, camera_from_board: &Pose, measured: &Pose) -> Link {
        let (x, frame, z) = (&self.mount_from_camera, camera_from_board, &self.ground_from_board);
        let (to_mount, from_ground) = (x.after(frame), z.inverse());
        let whole = to_mount.after(&from_ground);
        let [turn, step] = self.off(camera_from_board, measured);
        let mut last = Matrix6::identity();
        let rotation = left_jacobian_inverse(turn);
        last.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        if self.mounting == Mounting::EyeInHand {
            last *= of_inverse(&whole);
        }
        let by_camera = last * of_second(&to_mount, &from_ground);
        let t = -measured.translation;
        Link {
            off: Vector6::new(turn.x, turn.y, turn.z, step.x, step.y, step.z),
            by_mount: by_camera * of_second(x, frame),
            by_frame: by_camera * of_first(x),
            by_ground: last * of_first(&to_mount) * of_inverse(z),
            by_scale: Vector6::new(0.0, 0.0, 0.0, t.x, t.y, t.z),
        }
    }

    /// The inverse variances of a residual, in the unit of costs.
    pub(crate) fn weights(&self) -> Vector6<f64> {
        let [turn, step] = [self.noise.rotation_rad, self.noise.translation_mm]
            .map(|sd| self.variance / (sd * sd));
        Vector6::new(turn, turn, turn, step, step, step)
    }

    /// The links of the frames for which `keep` returns true.
    pub(crate) fn with_frames(&self, keep: impl Fn(usize) -> bool) -> Self {
        let poses = self.poses.iter().enumerate().filter(|(frame, _)| keep(*frame));
        Self { poses: poses.map(|(_, pose)| *pose).collect(), ..self.clone() }
    }
}

/// The change of `second.after(&first)` by one of `second`.
fn of_second(second: &Pose, first: &Pose) -> Matrix6<f64> {
    let mut by = Matrix6::identity();
    by.fixed_view_mut::<3, 3>(3, 0).copy_from(&-cross(second.rotation * first.translation));
    by
}

/// The change of `second.after(&first)` by one of `first`.
fn of_first(second: &Pose) -> Matrix6<f64> {
    let rotation = matrix(second.rotation);
    let mut by = Matrix6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    by.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    by
}

/// The change of the inverse of a pose by one of the pose.
fn of_inverse(pose: &Pose) -> Matrix6<f64> {
    let back = -matrix(pose.rotation.conjugate());
    let mut by = Matrix6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&back);
    by.fixed_view_mut::<3, 3>(3, 3).copy_from(&back);
    by.fixed_view_mut::<3, 3>(3, 0).copy_from(&(back * cross(pose.translation)));
    by
}

/// The inverse of the left Jacobian of rotations: the change of a rotation vector by a small rotation after it (Solà,
/// Deray & Atchuthan 2018, equation 146).
fn left_jacobian_inverse(turn: DVec3) -> Matrix3<f64> {
    let (angle, across) = (turn.length(), cross(turn));
    let second = match angle < 1e-4 {
        true => 1.0 / 12.0,
        false => (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle),
    };
    Matrix3::identity() - across * 0.5 + across * across * second
}

fn matrix(rotation: DQuat) -> Matrix3<f64> {
    Matrix3::from_column_slice(&DMat3::from_quat(rotation).to_cols_array())
}

/// The matrix of v × .
fn cross(v: DVec3) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn any(random: &mut ChaCha8Rng, turn: f64, step: f64) -> Pose {
        let mut vector =
            |reach: f64| DVec3::from([0; 3].map(|_| random.random_range(-reach..reach)));
        Pose { rotation: DQuat::from_scaled_axis(vector(turn)), translation: vector(step) }
    }

    fn moved(pose: &Pose, index: usize, by: f64) -> Pose {
        let mut change = [0.0; 6];
        change[index] = by;
        Pose {
            rotation: DQuat::from_scaled_axis(DVec3::from_slice(&change[..3])) * pose.rotation,
            translation: pose.translation + DVec3::from_slice(&change[3..]),
        }
    }

    /// A change of an unknown by the index of its column, in the order mount, ground, frame, scale.
    fn changed(robot: &Robot, frame: &Pose, column: usize, by: f64) -> (Robot, Pose) {
        let (mut robot, mut frame) = (robot.clone(), *frame);
        match column {
            0..6 => robot.mount_from_camera = moved(&robot.mount_from_camera, column, by),
            6..12 => robot.ground_from_board = moved(&robot.ground_from_board, column - 6, by),
            12..18 => frame = moved(&frame, column - 12, by),
            _ => robot.scale += by,
        }
        (robot, frame)
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for mounting in [Mounting::EyeInHand, Mounting::EyeToHand] {
            let mut pose = || any(&mut random, 1.5, 400.0);
            let frame = pose();
            let mut robot = Robot {
                mounting,
                mount_from_camera: pose(),
                ground_from_board: pose(),
                scale: 1.002,
                scale_free: true,
                poses: Vec::new(),
                noise: RobotNoise { rotation_rad: 1e-3, translation_mm: 0.1 },
                variance: 1.0,
            };
            // A residual of 20°, so that its rotation vector is not linear in the rotation.
            let measured = any(&mut random, 0.2, 5.0).after(&robot.predicted(&frame));
            robot.scale = 1.001;
            let link = robot.link(&frame, &measured);
            for column in 0..19 {
                let expected = match column {
                    0..6 => link.by_mount.column(column).into_owned(),
                    6..12 => link.by_ground.column(column - 6).into_owned(),
                    12..18 => link.by_frame.column(column - 12).into_owned(),
                    _ => link.by_scale,
                };
                let off = |by: f64| {
                    let (robot, frame) = changed(&robot, &frame, column, by);
                    robot.link(&frame, &measured).off
                };
                let found = (off(1e-5) - off(-1e-5)) / 2e-5;
                let error = (found - expected).amax();
                assert!(error < 1e-6 * (1.0 + expected.amax()), "{mounting} {column}: {error}");
            }
        }
    }
}
