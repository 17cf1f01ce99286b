//! The result of a hand–eye calibration, as values.

use glam::DVec3;

use super::contradictions::Contradiction;
use super::pairing::PairedBy;
use crate::diagnose::diagnosis::Diagnosis;
use crate::estimate::values::Estimate;
use crate::input::robot::{Mounting, RobotNoise};
use crate::matrix::Matrix;
use deltille_core::camera::Pose;

/// Number of views among which a wrong pose is recognised: two relative motions determine the mountings, and two others have to
/// contradict it.
const RECOGNISABLE: usize = 5;

/// The mountings of a camera and a board on a robot.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct HandEye {
    /// Where the camera is mounted. It decides between which frames the poses are, see [`Mounting::bodies`].
    pub mounting: Mounting,
    /// Pose of the camera on the body that carries it: `flange_from_camera`, or `base_from_camera` for a fixed camera, mm.
    pub mount_from_camera: Pose,
    /// Pose of the board on the other body: `base_from_board`, or `flange_from_board` for a fixed camera, mm.
    pub ground_from_board: Pose,
    /// Covariance of (ω, τ) of both poses, in this order, and of the scale if it was estimated (rad, mm).
    pub covariance: Matrix,
    /// Factor of the robot's translations; 1 if it was not estimated.
    pub scale: f64,
    /// The noise of the robot.
    pub noise: RobotNoise,
    /// Degrees of freedom of its rotation and translation; `None` if the noise was given.
    pub noise_freedom: Option<[f64; 2]>,
    /// What the photographs contradict of what was stated about the robot.
    pub contradictions: Vec<Contradiction>,
    /// What the photographs contradict of the camera, the board and the lens model, see [`Calibration::explain`].
    ///
    /// [`Calibration::explain`]: crate::Calibration::explain
    pub diagnoses: Vec<Diagnosis>,
    /// RMS angles of the rotations of the flange about their principal axes, rad, with these axes in the frame of the base;
    /// the largest first. The second should be 10° or more.
    pub rotation_spread: [(f64, DVec3); 3],
    /// How poses and photographs were paired.
    pub paired_by: PairedBy,
    /// The photographs that show the board and have a pose of the robot.
    pub views: Vec<HandEyeView>,
    /// Names of the photographs without a pose of the robot.
    pub unpaired: Vec<String>,
    /// Number of poses without a photograph.
    pub spare_poses: usize,
    /// RMS reprojection error of the used views per axis, px.
    pub rms_px: f64,
    /// The estimate of the camera and of the poses of the board from the photographs alone, with the intrinsics after the
    /// joint adjustment.
    pub cameras: Estimate,
}

/// A photograph with a pose of the robot.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct HandEyeView {
    /// Name of the view.
    pub name: String,
    /// Index of the pose of the robot.
    pub pose: usize,
    /// Whether the pose was used; wrong poses are not.
    pub is_used: bool,
    /// Rotation of the flange from its reported pose to the pose that photographs and mountings predict, rad.
    pub rotation_rad: DVec3,
    /// The same for its position, mm.
    pub translation_mm: DVec3,
    /// RMS reprojection error per axis at the estimated pose, px.
    pub rms_px: f64,
    /// RMS reprojection error per axis at the pose that the robot reported, px; infinite if the camera cannot see a corner
    /// from there.
    pub robot_rms_px: f64,
}

impl HandEye {
    /// Standard deviations of (ω, τ) of [`Self::mount_from_camera`] and [`Self::ground_from_board`], rad and mm.
    pub fn pose_sd(&self) -> [[f64; 6]; 2] {
        [0, 6].map(|first| std::array::from_fn(|i| self.covariance[(first + i, first + i)].sqrt()))
    }

    /// Standard deviation of the scale, if it was estimated.
    pub fn scale_sd(&self) -> Option<f64> {
        (self.covariance.rows() > 12).then(|| self.covariance[(12, 12)].sqrt())
    }

    /// A warning if the views are too few to recognise a wrong pose, without initial capital and full stop.
    pub fn few_views(&self) -> Option<String> {
        let used = self.used().count();
        (used < RECOGNISABLE).then(|| {
            format!(
                "with {used} views, a wrong pose of the robot may not be recognised; use 15 or more"
            )
        })
    }

    /// Whether the photographs show that the given camera did not take them. Poses that seem wrong may then be right.
    pub fn blames_camera(&self) -> bool {
        self.diagnoses.iter().any(Diagnosis::blames_camera)
    }

    /// The views whose poses were used.
    pub fn used(&self) -> impl Iterator<Item = &HandEyeView> {
        self.views.iter().filter(|view| view.is_used)
    }

    /// The views whose poses are wrong.
    pub fn wrong(&self) -> impl Iterator<Item = &HandEyeView> {
        self.views.iter().filter(|view| !view.is_used)
    }
}
