//! Hand-eye calibration: a camera and a board on a robot.

use std::path::PathBuf;

use deltille::calibrate::{
    self, Calibration, CalibrationError, CameraEstimate, HandEyeError, HandEyeRequest, Intrinsics,
    Messages, Mounting, RobotNoise, RobotPose, RobotPoses, RobotRotation, views,
};
use deltille::export::hand_eye;
use deltille::limits::Limits;
use deltille::robot_poses;
use numpy::PyArray2;
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;

use super::calibrated_camera::CalibratedCamera;
use super::keywords::of_detections;
use super::solving::{How, Named, Seen, assume, named};
use crate::boundary::arrays;
use crate::boundary::errors::{self, Raise, raised, unlocked};
use crate::see::arguments::Results;
use crate::see::camera::Camera;
use crate::see::pose::Pose;
use crate::targets::target::Targets;

/// Where a camera and a board are mounted on a robot.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq)]
pub struct HandEye(calibrate::HandEye);

impl HandEye {
    /// A pose that only one setup has.
    fn pose(&self, mounting: Mounting, pose: deltille::camera::Pose) -> PyResult<Pose> {
        if self.0.mounting != mounting {
            let [camera, board] = hand_eye::names(self.0.mounting);
            let what = format!("the setup is {}: use {camera} and {board}", self.0.mounting);
            return Err(PyAttributeError::new_err(what));
        }
        Ok(Pose(pose))
    }
}

#[pymethods]
impl HandEye {
    /// ``"eye-in-hand"`` or ``"eye-to-hand"``.
    #[getter]
    fn setup(&self) -> &'static str {
        self.0.mounting.name()
    }

    /// Pose of the camera on the flange; an ``AttributeError`` for a fixed camera.
    #[getter]
    fn flange_from_camera(&self) -> PyResult<Pose> {
        self.pose(Mounting::EyeInHand, self.0.mount_from_camera)
    }

    /// Pose of the fixed board in the base; an ``AttributeError`` if the board is on the flange.
    #[getter]
    fn base_from_board(&self) -> PyResult<Pose> {
        self.pose(Mounting::EyeInHand, self.0.ground_from_board)
    }

    /// Pose of the fixed camera in the base; an ``AttributeError`` if the camera is on the flange.
    #[getter]
    fn base_from_camera(&self) -> PyResult<Pose> {
        self.pose(Mounting::EyeToHand, self.0.mount_from_camera)
    }

    /// Pose of the board on the flange; an ``AttributeError`` for a fixed board.
    #[getter]
    fn flange_from_board(&self) -> PyResult<Pose> {
        self.pose(Mounting::EyeToHand, self.0.ground_from_board)
    }

    /// Covariance of rotation (rad) and translation (mm) of the camera's pose, then of the board's, and of the scale if it
    /// was estimated: 12 × 12, or 13 × 13.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        arrays::matrix(py, &self.0.covariance)
    }

    /// Factor of the robot's translations; 1 if it was not estimated.
    #[getter]
    fn scale(&self) -> f64 {
        self.0.scale
    }

    /// Standard deviation of the scale; ``None`` if it was not estimated.
    #[getter]
    fn scale_sd(&self) -> Option<f64> {
        self.0.scale_sd()
    }

    /// Standard deviations of the robot per axis: rotation (degrees) and translation (mm).
    #[getter]
    fn robot_noise(&self) -> (f64, f64) {
        (self.0.noise.rotation_rad.to_degrees(), self.0.noise.translation_mm)
    }

    /// What the detections contradict of the statements about the robot (the scale of its translations, ``robot_noise``), of
    /// the camera and of the board, in sentences.
    #[getter]
    fn findings(&self) -> Vec<String> {
        let words = Messages::new(&self.0.cameras, None);
        let of_robot = self.0.contradictions.iter().map(ToString::to_string);
        let of_camera = self.0.diagnoses.iter().map(|said| words.sentence(said));
        of_robot.chain(of_camera).chain(self.0.few_views()).collect()
    }

    /// The camera, with its parameters after the adjustment.
    #[getter]
    fn camera(&self) -> Option<Camera> {
        self.0.cameras.cameras.first().map(|of| Camera(of.camera.clone()))
    }

    /// Names of the views whose poses were used.
    #[getter]
    fn used(&self) -> Vec<String> {
        self.0.used().map(|view| view.name.clone()).collect()
    }

    /// Names of the views whose poses are wrong.
    #[getter]
    fn wrong(&self) -> Vec<String> {
        self.0.wrong().map(|view| view.name.clone()).collect()
    }

    /// RMS reprojection error of the used views per axis, px.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.0.rms_px
    }

    /// Returns the text that ``deltille handeye`` writes.
    fn to_json(&self) -> String {
        hand_eye::write(&self.0)
    }

    fn __repr__(&self) -> String {
        let views = self.0.used().count();
        format!("<HandEye {}, {views} views, {:.4} px>", self.setup(), self.0.rms_px)
    }
}

/// Poses of a robot as an argument.
#[derive(FromPyObject)]
pub enum Robot<'py> {
    /// One for each detection; `None` where it is unknown.
    Poses(Vec<Option<PyRef<'py, Pose>>>),
    /// A file.
    File(PathBuf),
}

/// A known camera.
#[derive(FromPyObject)]
pub enum Known<'py> {
    /// With its uncertainties.
    Calibrated(PyRef<'py, CalibratedCamera>),
    /// Without.
    Camera(PyRef<'py, Camera>),
}

/// Locates a camera and a board on a robot: hand-eye and robot-world calibration.
///
/// Parameters
/// ----------
/// detections : sequence of Detection
///     Detections in images of one camera; 15 or more, with rotations about two axes.
/// robot : sequence of Pose or None, or path-like
///     Pose of the flange in the base (``base_from_flange``) for each detection, or a file of poses: CSV, JSON, TUM or ROS.
/// target : Target, optional
///     The target; defaults to that of the detections.
/// setup : str, optional
///     ``"eye-in-hand"`` (the camera is on the flange), or ``"eye-to-hand"`` (the board is).
/// camera : CalibratedCamera or Camera, optional
///     The known camera; the uncertainties of a calibrated one count. By default, it is calibrated from the same detections.
/// model : str, optional
///     Model of a camera that is calibrated, see :func:`calibrate`.
/// inverse_poses : bool, optional
///     The poses are ``flange_from_base``.
/// robot_noise : (float, float), optional
///     Known standard deviations of the robot per axis: rotation (degrees) and translation (mm). Estimated by default.
/// scale : bool, optional
///     Estimate a scale of the robot's translations, too.
/// print_scale : float or (float, float), optional
///     Measured length of the check bars over the nominal one, across and up the sheet.
/// assume_target : bool, optional
///     Use the target even if the detections name another one.
///
/// Returns
/// -------
/// HandEye
///
/// Raises
/// ------
/// CalibrationError
///     If the poses do not fit the detections, or do not determine the mountings.
#[pyfunction]
#[pyo3(name = "hand_eye", signature = (detections, robot, target = None, *, setup = "eye-in-hand", camera = None,
    model = "radtan", inverse_poses = false, robot_noise = None, scale = false, print_scale = None,
    assume_target = false))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn hand_eye_of(
    py: Python<'_>,
    detections: Results<'_>,
    robot: Robot<'_>,
    target: Option<Targets>,
    setup: &str,
    camera: Option<Known<'_>>,
    model: &str,
    inverse_poses: bool,
    robot_noise: Option<(f64, f64)>,
    scale: bool,
    print_scale: Option<&Bound<'_, PyAny>>,
    assume_target: bool,
) -> PyResult<HandEye> {
    let wrong = |what: String| raised::CalibrationError::new_err(what);
    let mounting = [Mounting::EyeInHand, Mounting::EyeToHand].into_iter();
    let mounting = mounting
        .into_iter()
        .find(|mounting| mounting.name() == setup)
        .ok_or_else(|| wrong(format!("unknown setup {setup} (known: eye-in-hand, eye-to-hand)")))?;
    let target = target.or_else(|| of_detections(&detections.all, false));
    let mut given = named(py, &detections.all, None)?;
    let mut robot = poses(robot, &given, detections.all.len())?;
    robot.are_inverse |= inverse_poses;
    let noise = robot_noise.map(|(degrees, translation_mm)| RobotNoise {
        rotation_rad: degrees.to_radians(),
        translation_mm,
    });
    if noise.is_some_and(|noise| !noise.is_valid()) {
        let what = "robot_noise: expected 0.0001° to 57° and 0.001 mm to 1000 mm";
        return Err(wrong(what.to_owned()));
    }
    let earlier: Option<CameraEstimate> = camera.map(|camera| match camera {
        Known::Calibrated(camera) => camera.estimate().clone(),
        Known::Camera(camera) => CameraEstimate::given("camera", camera.0.clone()),
    });
    let intrinsics = match &earlier {
        Some(earlier) => Intrinsics::Known(earlier.camera.clone()),
        None => Intrinsics::Unknown(
            model.parse().map_err(|error: calibrate::ModelError| wrong(error.to_string()))?,
        ),
    };
    let seen = Seen::of(target, None, [None; 2], None)?;
    let reference = seen.reference();
    if assume_target {
        assume(&mut given, reference.targets());
    }
    let mut sheet = How::of("huber", "covariance", None, None, print_scale, None)?.sheet;
    if let [only] = seen.printed() {
        sheet.sheets = only.sheets.clone();
    }
    let panels = sheet.panels(&reference).raise(errors::calibration)?;
    let mut views = views(&given, &reference).raise(errors::calibration)?.views;
    sheet.put_on(reference.targets().first(), &mut views).raise(errors::calibration)?;
    let calibration = Calibration::of(&reference, panels).camera("camera", views, intrinsics);
    let request = HandEyeRequest { robot, mounting, noise, scale, earlier };
    let found = unlocked(py, move || calibration.hand_eye(&request, &given))?;
    found.map(HandEye).map_err(|error| match error {
        HandEyeError::Calibration(error) => {
            Err::<(), CalibrationError>(error).raise(errors::calibration).unwrap_err()
        }
        error => wrong(error.to_string()),
    })
}

/// The poses of a robot; those of a sequence name their detections, so that some may be missing.
fn poses(robot: Robot<'_>, given: &Named, count: usize) -> PyResult<RobotPoses> {
    let wrong = |what: String| raised::CalibrationError::new_err(what);
    let poses = match robot {
        Robot::File(path) => {
            let read = robot_poses::read(&path, &Limits::default());
            return read.map_err(|error| wrong(format!("robot: {error}")));
        }
        Robot::Poses(poses) => poses,
    };
    if poses.len() != count || given.len() != count {
        let found = poses.len();
        return Err(wrong(format!(
            "robot: {found} poses for {count} detections; pass one for each"
        )));
    }
    let named = given.iter().zip(poses).filter_map(|((name, _), pose)| {
        let pose = pose?.0;
        let rotation = RobotRotation::Quaternion(pose.rotation);
        let (image, translation_mm) = (Some(name.clone()), pose.translation);
        Some(RobotPose { image, time_ns: None, translation_mm, rotation })
    });
    Ok(RobotPoses { poses: named.collect(), are_inverse: false })
}
