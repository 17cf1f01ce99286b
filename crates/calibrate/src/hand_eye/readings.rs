//! Initial mountings from the poses of the robot, and poses that fit only if they mean something else.
//!
//! The noise of poses that are read correctly is small compared with the motion. Poses that are inverted, or in other units
//! than was stated, have errors as large as the motion.

use glam::{DMat3, DQuat, DVec3};

use super::error::HandEyeError;
use super::misreading::Misreading;
use crate::input::robot::{Mounting, RobotPose, RobotRotation};
use crate::start::rig_motion::{Moment, placed_by_motion};
use deltille_core::camera::Pose;
use deltille_core::statistics::median;

/// Minimum ratio of the errors of two readings for the better one to be right. Errors of the right reading are noise. Those
/// of a wrong one are as large as the motion, which must exceed noise many times anyway.
const BETTER: f64 = 3.0;

/// A frame with a pose of the robot.
pub(super) struct Paired<'a> {
    pub robot: &'a RobotPose,
    pub camera_from_board: Pose,
}

/// Initial mountings.
pub(super) struct Start {
    pub mount_from_camera: Pose,
    pub ground_from_board: Pose,
}

/// `base_from_flange` of a reported pose.
pub(super) fn base_from_flange(robot: &RobotPose, are_inverse: bool) -> Pose {
    let pose = robot.pose();
    if are_inverse { pose.inverse() } else { pose }
}

/// Initial mountings; an error if the poses fit only in another reading, or in none.
pub(super) fn start(
    paired: &[Paired<'_>],
    mounting: Mounting,
    are_inverse: bool,
) -> Result<Start, HandEyeError> {
    let seen = |index: usize| paired[index].camera_from_board;
    let moments = |reading: &Reading, shift: usize| -> Vec<Moment> {
        let of = |index: usize| {
            let robot = paired[(index + shift) % paired.len()].robot;
            let base_from_flange = base_from_flange(&reading.of(robot), are_inverse);
            let is_inverse = (mounting == Mounting::EyeInHand) != reading.is_inverted;
            let rig_from_scene =
                if is_inverse { base_from_flange.inverse() } else { base_from_flange };
            Moment { rig_from_scene, camera_from_target: seen(index) }
        };
        (0..paired.len()).map(of).collect()
    };
    let notation = paired.first().map(|paired| paired.robot.rotation);
    let readings = notation.map_or(Vec::new(), Reading::all);
    let stated = Fit::of(&moments(&Reading::STATED, 0));
    let others = readings.iter().skip(1).map(|reading| (reading, Fit::of(&moments(reading, 0))));
    let better = others.filter(|(_, fit)| fit.error_mm * BETTER < stated.error_mm);
    // Readings with one difference precede those with several.
    let better: Vec<_> = better.collect();
    let least = better.iter().map(|(_, fit)| fit.error_mm).fold(f64::INFINITY, f64::min);
    if let Some((reading, fit)) = better.iter().find(|(_, fit)| fit.error_mm <= BETTER * least) {
        let times = stated.error_mm / fit.error_mm;
        return Err(HandEyeError::Misread {
            readings: reading.differences(),
            mounting,
            are_inverse,
            times,
        });
    }
    let shuffled_mm = Fit::of(&moments(&Reading::STATED, paired.len() / 2)).error_mm;
    match stated.places {
        Some([camera_from_mount, ground_from_board])
            if stated.error_mm * BETTER < shuffled_mm || paired.len() == 3 =>
        {
            Ok(Start { mount_from_camera: camera_from_mount.inverse(), ground_from_board })
        }
        _ => Err(HandEyeError::NoAgreement { typical_mm: stated.error_mm, shuffled_mm }),
    }
}

/// Mountings that fit a reading, and the typical displacement of the board.
struct Fit {
    error_mm: f64,
    places: Option<[Pose; 2]>,
}

impl Fit {
    fn of(moments: &[Moment]) -> Self {
        let Ok(places) = placed_by_motion(moments) else {
            return Self { error_mm: f64::INFINITY, places: None };
        };
        let distances = moments.iter().map(|of| of.camera_from_target.translation.length());
        let arm_mm = median(distances.collect()).unwrap_or(0.0);
        let error = |of: &Moment| {
            let predicted = places[0].after(&of.rig_from_scene).after(&places[1]);
            let [turn, step] = predicted.off(&of.camera_from_target);
            (turn.length() * arm_mm).hypot(step.length())
        };
        let error_mm = median(moments.iter().map(error).collect()).unwrap_or(f64::INFINITY);
        Self { error_mm: error_mm.max(f64::MIN_POSITIVE), places: Some(places) }
    }
}

/// Units of translations that were stated in millimetres or metres, and their factors.
const UNITS: [(Misreading, f64); 6] = [
    (Misreading::Metres, 1000.0),
    (Misreading::Millimetres, 0.001),
    (Misreading::Centimetres, 10.0),
    (Misreading::Centimetres, 0.01),
    (Misreading::Inches, 25.4),
    (Misreading::Inches, 0.0254),
];

/// A reading of poses.
struct Reading {
    is_inverted: bool,
    /// Another unit of the translations, and its factor.
    length: Option<(Misreading, f64)>,
    rotation: Option<OtherRotation>,
    /// The axis of the translations whose sign is wrong, and its name.
    mirrored: Option<(DVec3, char)>,
}

impl Reading {
    const STATED: Self = Self { is_inverted: false, length: None, rotation: None, mirrored: None };

    /// All readings of a notation, those with the fewest differences first.
    fn all(notation: RobotRotation) -> Vec<Self> {
        let rotations = [None].into_iter().chain(other_rotations(notation).iter().map(Some));
        let mut all = Vec::new();
        for rotation in rotations {
            for length in [None].into_iter().chain(UNITS.map(Some)) {
                for is_inverted in [false, true] {
                    all.push(Self {
                        is_inverted,
                        length,
                        rotation: rotation.copied(),
                        mirrored: None,
                    });
                }
            }
        }
        let axes = [(DVec3::X, 'x'), (DVec3::Y, 'y'), (DVec3::Z, 'z')];
        all.extend(axes.map(|axis| Self { mirrored: Some(axis), ..Self::STATED }));
        all.sort_by_key(|reading| reading.differences().len());
        all
    }

    fn differences(&self) -> Vec<Misreading> {
        let inverted = self.is_inverted.then_some(Misreading::Inverted);
        let rotation = self.rotation.map(|(misreading, _)| misreading);
        let mirrored = self.mirrored.map(|(_, name)| Misreading::Mirrored(name));
        let length = self.length.map(|(misreading, _)| misreading);
        rotation.into_iter().chain(length).chain(inverted).chain(mirrored).collect()
    }

    /// The pose in this reading.
    fn of(&self, robot: &RobotPose) -> RobotPose {
        let scale = self.length.map_or(1.0, |(_, factor)| factor);
        let signs = self.mirrored.map_or(DVec3::ONE, |(axis, _)| DVec3::ONE - 2.0 * axis);
        RobotPose {
            translation_mm: robot.translation_mm * scale * signs,
            rotation: self.rotation.map_or(robot.rotation, |(_, of)| of(robot.rotation)),
            ..robot.clone()
        }
    }
}

/// Another meaning of rotations, and the rotation in this meaning.
type OtherRotation = (Misreading, fn(RobotRotation) -> RobotRotation);

/// Other readings of a rotation in this notation.
fn other_rotations(notation: RobotRotation) -> &'static [OtherRotation] {
    use RobotRotation::{Matrix, Quaternion, RollPitchYaw, Vector};
    fn permuted(rotation: RobotRotation, of: fn(DQuat) -> [f64; 4]) -> RobotRotation {
        match rotation {
            Quaternion(q) => Quaternion(DQuat::from_array(of(q))),
            other => other,
        }
    }
    fn scaled(rotation: RobotRotation, by: f64) -> RobotRotation {
        match rotation {
            Vector(vector) => Vector(vector * by),
            RollPitchYaw(angles) => RollPitchYaw(angles * by),
            other => other,
        }
    }
    fn moving(rotation: RobotRotation) -> RobotRotation {
        let RollPitchYaw(DVec3 { x, y, z }) = rotation else { return rotation };
        let about =
            [DQuat::from_rotation_x(x), DQuat::from_rotation_y(y), DQuat::from_rotation_z(z)];
        Quaternion(about[0] * about[1] * about[2])
    }
    fn transposed(rotation: RobotRotation) -> RobotRotation {
        match rotation {
            Matrix(matrix) => Matrix(DMat3::transpose(&matrix)),
            other => other,
        }
    }
    const DEGREES: OtherRotation = (Misreading::Degrees, |r| scaled(r, 1f64.to_radians()));
    const RADIANS: OtherRotation = (Misreading::Radians, |r| scaled(r, 1f64.to_degrees()));
    match notation {
        Quaternion(_) => &[
            (Misreading::QuaternionOrder, |r| permuted(r, |q| [q.y, q.z, q.w, q.x])),
            (Misreading::QuaternionOrder, |r| permuted(r, |q| [q.w, q.x, q.y, q.z])),
        ],
        Vector(_) => &[DEGREES, RADIANS],
        RollPitchYaw(_) => &[DEGREES, RADIANS, (Misreading::AngleOrder, moving)],
        Matrix(_) => &[(Misreading::Transposed, transposed)],
    }
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

    /// Each wrong reading is recognised from what a robot reports in it, in every notation and both mountings.
    #[test]
    fn misread_poses_are_recognised() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for mounting in [Mounting::EyeInHand, Mounting::EyeToHand] {
            let [mount_from_camera, ground_from_board] =
                [(); 2].map(|()| any(&mut random, 2.0, 300.0));
            let frames: Vec<(Pose, Pose)> = (0..12)
                .map(|_| {
                    let base_from_flange = any(&mut random, 0.8, 400.0);
                    let noisy = any(&mut random, 0.003, 0.5).after(&base_from_flange);
                    let mount_from_ground = match mounting {
                        Mounting::EyeInHand => base_from_flange.inverse(),
                        Mounting::EyeToHand => base_from_flange,
                    };
                    let seen = mount_from_camera.inverse().after(&mount_from_ground);
                    (noisy, seen.after(&ground_from_board))
                })
                .collect();
            let found = |change: &dyn Fn(&Pose) -> (DVec3, RobotRotation)| {
                let robot: Vec<RobotPose> = frames
                    .iter()
                    .map(|(pose, _)| {
                        let (translation_mm, rotation) = change(pose);
                        RobotPose { image: None, time_ns: None, translation_mm, rotation }
                    })
                    .collect();
                let paired = robot.iter().zip(&frames);
                let paired: Vec<_> = paired
                    .map(|(robot, (_, seen))| Paired { robot, camera_from_board: *seen })
                    .collect();
                start(&paired, mounting, false)
            };
            let differences = |change: &dyn Fn(&Pose) -> (DVec3, RobotRotation)| match found(change)
            {
                Ok(start) => {
                    let [turn, _] = start.mount_from_camera.off(&mount_from_camera);
                    assert!(turn.length() < 0.01, "{turn}");
                    Vec::new()
                }
                Err(HandEyeError::Misread { readings, .. }) => readings,
                Err(error) => panic!("{error}"),
            };
            let quaternion = |pose: &Pose| RobotRotation::Quaternion(pose.rotation);
            let vector = |pose: &Pose| pose.rotation.to_scaled_axis();
            assert_eq!(differences(&|p| (p.translation, quaternion(p))), []);
            let angles = |p: &Pose| {
                let (yaw, pitch, roll) = p.rotation.to_euler(glam::EulerRot::ZYX);
                RobotRotation::RollPitchYaw(DVec3::new(roll, pitch, yaw))
            };
            assert_eq!(differences(&|p| (p.translation, angles(p))), []);
            let inverse = |p: &Pose| (p.inverse().translation, quaternion(&p.inverse()));
            assert_eq!(differences(&inverse), [Misreading::Inverted]);
            let swapped = |p: &Pose| {
                let [x, y, z, w] = p.rotation.to_array();
                (p.translation, RobotRotation::Quaternion(DQuat::from_array([w, x, y, z])))
            };
            assert_eq!(differences(&swapped), [Misreading::QuaternionOrder]);
            let radians =
                |p: &Pose| (p.translation, RobotRotation::Vector(vector(p) * 1f64.to_radians()));
            assert_eq!(differences(&radians), [Misreading::Radians]);
            let degrees =
                |p: &Pose| (p.translation, RobotRotation::Vector(vector(p) * 1f64.to_degrees()));
            assert_eq!(differences(&degrees), [Misreading::Degrees]);
            let metres = |p: &Pose| (p.translation / 1000.0, quaternion(p));
            assert_eq!(differences(&metres), [Misreading::Metres]);
            let inches = |p: &Pose| (p.translation / 25.4, quaternion(p));
            assert_eq!(differences(&inches), [Misreading::Inches]);
            let both = |p: &Pose| (p.inverse().translation / 1000.0, quaternion(&p.inverse()));
            assert_eq!(differences(&both), [Misreading::Metres, Misreading::Inverted]);
            // Each pose with the photograph of another.
            let wrong: Vec<DVec3> =
                (0..12).map(|_| any(&mut random, 1.0, 1.0).translation).collect();
            let shuffled = found(&|p| {
                let index = frames.iter().position(|(pose, _)| pose == p).unwrap_or_default();
                (wrong[index] * 400.0, RobotRotation::Vector(wrong[(index + 3) % 12]))
            });
            assert!(matches!(shuffled, Err(HandEyeError::NoAgreement { .. })));
        }
    }
}
