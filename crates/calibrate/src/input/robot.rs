//! Poses that a robot reported, and how camera and board are mounted.

use std::fmt;

use glam::{DMat3, DQuat, DVec3};

use deltille_core::camera::Pose;

/// Where the camera is mounted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mounting {
    /// The camera is on the robot's flange, and the board is fixed to the robot's base.
    #[default]
    EyeInHand,
    /// The camera is fixed to the robot's base, and the board is on the flange.
    EyeToHand,
}

impl Mounting {
    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::EyeInHand => "eye-in-hand",
            Self::EyeToHand => "eye-to-hand",
        }
    }

    /// The names of the bodies that carry the camera and the board.
    pub fn bodies(self) -> [&'static str; 2] {
        match self {
            Self::EyeInHand => ["flange", "base"],
            Self::EyeToHand => ["base", "flange"],
        }
    }
}

impl fmt::Display for Mounting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The poses of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotPoses {
    /// The poses, in the order of their file.
    pub poses: Vec<RobotPose>,
    /// Whether they are `flange_from_base`, the inverse of what robots report.
    pub are_inverse: bool,
}

/// A pose of the flange.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotPose {
    /// Name of the image that was taken at this pose, if it is known.
    pub image: Option<String>,
    /// Time stamp, ns, if it is known.
    pub time_ns: Option<i64>,
    /// Translation, mm.
    pub translation_mm: DVec3,
    /// Rotation, as it was reported.
    pub rotation: RobotRotation,
}

/// A rotation in the notation of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RobotRotation {
    /// A unit quaternion.
    Quaternion(DQuat),
    /// A rotation vector: the axis times the angle in rad.
    Vector(DVec3),
    /// Roll, pitch and yaw in rad: rotations about the fixed axes x, y and z, in this order.
    RollPitchYaw(DVec3),
    /// A rotation matrix.
    Matrix(DMat3),
}

impl RobotRotation {
    /// The rotation.
    pub fn rotation(self) -> DQuat {
        match self {
            Self::Quaternion(rotation) => rotation.normalize(),
            Self::Vector(vector) => DQuat::from_scaled_axis(vector),
            Self::RollPitchYaw(angles) => {
                DQuat::from_rotation_z(angles.z)
                    * DQuat::from_rotation_y(angles.y)
                    * DQuat::from_rotation_x(angles.x)
            }
            Self::Matrix(matrix) => DQuat::from_mat3(&matrix).normalize(),
        }
    }
}

impl RobotPose {
    /// The pose as it was reported.
    pub fn pose(&self) -> Pose {
        Pose { rotation: self.rotation.rotation(), translation: self.translation_mm }
    }
}

/// Standard deviations of the poses of a robot, equal in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotNoise {
    /// Of the rotation about each axis, rad.
    pub rotation_rad: f64,
    /// Of the position of the flange along each axis, mm.
    pub translation_mm: f64,
}

impl RobotNoise {
    /// Whether both are at least those of the best encoders, and below any useful ones: 10⁻⁶ to 1 rad and 10⁻³ to 10³ mm.
    pub fn is_valid(&self) -> bool {
        (1e-6..=1.0).contains(&self.rotation_rad) && (1e-3..=1e3).contains(&self.translation_mm)
    }
}
