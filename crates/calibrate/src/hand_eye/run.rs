//! The joint adjustment of camera, poses, mountings and the noise of the robot.

use glam::DVec3;

use super::contradictions::{self, Contradiction};
use super::error::{HandEyeError, MIN_POSES};
use super::estimate::{HandEye, HandEyeView};
use super::noise::{self, Components, Links};
use super::pairing::Pairing;
use super::readings::{self, Paired, Start};
use super::request::HandEyeRequest;
use crate::adjust::reweighting::{Settled, variance};
use crate::diagnose::diagnosis::Diagnosis;
use crate::diagnose::messages::Messages;
use crate::equations::minimise::{Minimum, Until, minimise};
use crate::error::CalibrationError;
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::input::calibration::Calibration;
use crate::input::robot::{RobotNoise, RobotPose};
use crate::input::views::Named;
use crate::matrix::Matrix;
use crate::problem::bundle::Problem;
use crate::problem::camera_prior::CameraPrior;
use crate::problem::robot::Robot;
use crate::problem::whitening::Whitening;
use crate::start::rig_motion::{check_rotations, rotation_spread};
use deltille_core::camera::{Lens, Pose};

/// Maximum number of iterations in which the noise of the robot and the solution are estimated alternately; they agree after
/// five to ten.
const MAX_ROUNDS: usize = 30;

/// Factors of translations that a wrong size of the board may cause; others are wrong units.
const ORDINARY_SCALES: std::ops::Range<f64> = 0.5..2.0;

impl Calibration {
    /// Estimates where the camera and the board are mounted on a robot, jointly with the poses of the board, the intrinsics
    /// and the noise of the robot. `detections` are those of all photographs, also without a target, in the order of the
    /// robot's poses if these have no names and no time stamps.
    ///
    /// Of a rig, the first camera is located.
    ///
    /// # Errors
    /// Returns an error if the cameras cannot be calibrated, poses and photographs cannot be paired, or the poses do not
    /// determine the mountings.
    pub fn hand_eye<'a>(
        &self,
        asked: &HandEyeRequest,
        detections: impl IntoIterator<Item = impl Into<Named<'a>>>,
    ) -> Result<HandEye, HandEyeError> {
        if asked.noise.is_some_and(|noise| !noise.is_valid()) {
            return Err(HandEyeError::NoiseRange);
        }
        let photographs: Vec<Named<'_>> = detections.into_iter().map(Into::into).collect();
        let pairing = Pairing::of(&asked.robot, &photographs)?;
        let (mut estimate, settled) = self.settled()?;
        if self.stop.is_raised() {
            return Err(CalibrationError::Stopped.into());
        }
        estimate.calibrated_with.clone_from(&self.identities);
        let diagnoses = self.explain(&estimate);
        let wrong_camera = wrong_camera(&diagnoses, &estimate)?;
        let Settled { minimum, whitening, .. } = settled;
        let variance = variance(&minimum, &whitening, self.loss);
        let of_frame = |frame: &crate::FrameEstimate| pairing.poses.get(&frame.name).copied();
        let indices: Vec<Option<usize>> = estimate.frames.iter().map(of_frame).collect();
        let paired = indices.iter().zip(&minimum.problem.frames).filter_map(|(pose, frame)| {
            Some(Paired { robot: &asked.robot.poses[(*pose)?], camera_from_board: *frame })
        });
        let (start, rotation_spread) = start(&paired.collect::<Vec<_>>(), asked, wrong_camera)?;
        let to_base = |pose: usize| asked.base_from_flange(&asked.robot.poses[pose]);
        let measured: Vec<Option<Pose>> = indices.iter().map(|pose| pose.map(to_base)).collect();
        let problem = with_robot(minimum.problem, asked, start, &measured, variance);
        let joint = adjusted(problem, &whitening, self, asked.noise, &measured)?;
        let agreeing = used_poses(&joint.minimum.problem);
        if check_rotations(agreeing.iter().map(|pose| pose.rotation)).is_err() {
            return Err(HandEyeError::Contradictory { agreeing: agreeing.len() });
        }
        let covariance = joint.covariance(variance).ok_or(HandEyeError::Undetermined)?;
        let contradictions = contradictions(&joint, &whitening, self, asked, &measured);
        for contradiction in &contradictions {
            if let Contradiction::Scale { scale, .. } = *contradiction
                && !ORDINARY_SCALES.contains(&scale)
            {
                return Err(HandEyeError::Unit { scale });
            }
        }
        let problem = &joint.minimum.problem;
        let robot = problem.robot.as_ref().ok_or(HandEyeError::Undetermined)?;
        let names = || estimate.frames.iter().map(|frame| frame.name.clone());
        let views = views(problem, robot, &measured, &indices, names());
        let used = views.iter().filter(|view| view.is_used);
        let (sum, count) = used.fold((0.0, 0.0), |(sum, n), v| (sum + v.rms_px.powi(2), n + 1.0));
        for (camera, of) in estimate.cameras.iter_mut().zip(&problem.cameras) {
            camera.camera = of.camera.clone();
        }
        Ok(HandEye {
            mounting: asked.mounting,
            mount_from_camera: robot.mount_from_camera,
            ground_from_board: robot.ground_from_board,
            covariance,
            scale: robot.scale,
            noise: robot.noise,
            noise_freedom: asked.noise.is_none().then_some(joint.components.freedom),
            contradictions,
            diagnoses,
            rotation_spread,
            paired_by: pairing.by,
            rms_px: (sum / f64::max(count, 1.0)).sqrt(),
            views,
            unpaired: pairing.unpaired,
            spare_poses: asked.robot.poses.len() - pairing.poses.len(),
            cameras: estimate,
        })
    }
}

impl HandEyeRequest {
    /// `base_from_flange` of a reported pose.
    fn base_from_flange(&self, reported: &RobotPose) -> Pose {
        readings::base_from_flange(reported, self.robot.are_inverse)
    }
}

/// The error if a given camera may not have taken the images.
///
/// # Errors
/// Returns this error if it certainly did not.
fn wrong_camera(
    diagnoses: &[Diagnosis],
    estimate: &Estimate,
) -> Result<Option<HandEyeError>, HandEyeError> {
    let Some(wrong) = diagnoses.iter().find(|of| of.blames_camera()) else { return Ok(None) };
    let error = HandEyeError::WrongCamera(Messages::new(estimate, None).sentence(wrong));
    match wrong {
        Diagnosis::WrongCamera { .. } => Err(error),
        _ => Ok(Some(error)),
    }
}

/// Initial mountings, and the spread of the robot's rotations; `wrong_camera` explains why no mountings fit.
fn start(
    paired: &[Paired<'_>],
    asked: &HandEyeRequest,
    wrong_camera: Option<HandEyeError>,
) -> Result<(Start, [(f64, DVec3); 3]), HandEyeError> {
    if paired.len() < MIN_POSES {
        return Err(HandEyeError::TooFew { paired: paired.len() });
    }
    let rotations = || paired.iter().map(|of| asked.base_from_flange(of.robot).rotation);
    let spread = rotation_spread(rotations());
    let seen = paired.iter().map(|of| of.camera_from_board.rotation.conjugate());
    check_rotations(seen).map_err(|why| {
        let axis = spread[0].1;
        HandEyeError::Motion { why, axis, mounting: asked.mounting }
    })?;
    let start = readings::start(paired, asked.mounting, asked.robot.are_inverse);
    let start =
        start.map_err(|error| match (&error, check_rotations(rotations()), wrong_camera) {
            (HandEyeError::NoAgreement { .. }, Err(_), _) => HandEyeError::Still,
            (HandEyeError::NoAgreement { .. }, _, Some(camera)) => camera,
            _ => error,
        })?;
    Ok((start, spread))
}

/// The problem with the links to the robot, and with the parameters of a known camera unknown within their covariance.
fn with_robot(
    mut problem: Problem,
    asked: &HandEyeRequest,
    start: Start,
    measured: &[Option<Pose>],
    variance: f64,
) -> Problem {
    let mut robot = Robot {
        mounting: asked.mounting,
        mount_from_camera: start.mount_from_camera,
        ground_from_board: start.ground_from_board,
        scale: 1.0,
        scale_free: asked.scale,
        poses: measured.to_vec(),
        noise: RobotNoise { rotation_rad: 1.0, translation_mm: 1.0 },
        variance,
    };
    let off = |(frame, measured): (&Pose, &Option<Pose>)| {
        let off = robot.off(frame, measured.as_ref()?);
        Some(off.map(|off| off.length()))
    };
    let off: Vec<Option<[f64; 2]>> = problem.frames.iter().zip(measured).map(off).collect();
    // Wrong poses must not displace the frames of the photographs.
    let first = noise::first(&off.iter().copied().flatten().collect::<Vec<_>>());
    for (pose, off) in robot.poses.iter_mut().zip(off) {
        *pose = pose.filter(|_| off.is_some_and(|off| first.explain(off)));
    }
    robot.noise = asked.noise.unwrap_or(first.noise);
    problem.robot = Some(robot);
    if let ([camera], Some(earlier)) = (problem.cameras.as_mut_slice(), &asked.earlier)
        && !camera.free.contains(&true)
        && let Some((free, prior)) = prior(earlier)
    {
        (camera.free, camera.prior) = (free, Some(prior));
    }
    problem
}

/// The parameters that an earlier calibration estimated, and their prior; `None` without a covariance.
fn prior(earlier: &CameraEstimate) -> Option<(Vec<bool>, CameraPrior)> {
    if matches!(earlier.camera.lens, Lens::Spline(_)) {
        return None;
    }
    let free = earlier.free();
    let observed = earlier.projection.as_ref().and_then(|known| known.observed.as_ref());
    let covariance = observed.map_or(&earlier.covariance, |observed| &observed.covariance);
    if covariance.rows() == 0 || covariance.rows() != free.len() {
        return None;
    }
    let prior = CameraPrior::new(&earlier.camera, covariance.inner())?;
    let count = earlier.camera.parameters().len();
    Some(((0..count).map(|index| free.contains(&index)).collect(), prior))
}

/// The joint minimum.
struct Joint {
    minimum: Minimum,
    components: Components,
}

impl Joint {
    /// The covariance of mountings and scale; `None` if they are not determined.
    fn covariance(&self, variance: f64) -> Option<Matrix> {
        let Minimum { problem, normal, layout, .. } = &self.minimum;
        let (robot, first) = (problem.robot.as_ref()?, layout.robot?);
        let found = normal.covariances(layout)?;
        let columns = first..first + robot.columns();
        if found.loose.iter().any(|column| columns.contains(column)) {
            return None;
        }
        Some(Matrix::from_fn(columns.len(), columns.len(), |i, j| {
            found.shared[(first + i, first + j)] * variance
        }))
    }
}

/// What the photographs contradict of the stated scale and noise.
fn contradictions(
    joint: &Joint,
    whitening: &Whitening,
    calibration: &Calibration,
    asked: &HandEyeRequest,
    measured: &[Option<Pose>],
) -> Vec<Contradiction> {
    if asked.scale && asked.noise.is_none() {
        return Vec::new();
    }
    let mut problem = joint.minimum.problem.clone();
    let Some(robot) = &mut problem.robot else { return Vec::new() };
    robot.scale_free = true;
    let variance = robot.variance;
    let Ok(freed) = adjusted(problem, whitening, calibration, None, measured) else {
        return Vec::new();
    };
    let Some(robot) = &freed.minimum.problem.robot else { return Vec::new() };
    let freedom = freed.components.freedom;
    let sd = freed.covariance(variance).map(|of| of[(of.rows() - 1, of.rows() - 1)].sqrt());
    let of_scale = sd
        .filter(|_| !asked.scale)
        .and_then(|sd| contradictions::of_scale(robot.scale, sd, freedom[1]));
    let of_noise =
        asked.noise.and_then(|given| contradictions::of_noise(given, robot.noise, freedom));
    of_scale.into_iter().chain(of_noise).collect()
}

/// Adjusts all unknowns, the noise of the robot, and the set of right poses, until they agree.
fn adjusted(
    mut problem: Problem,
    whitening: &Whitening,
    calibration: &Calibration,
    noise: Option<RobotNoise>,
    measured: &[Option<Pose>],
) -> Result<Joint, HandEyeError> {
    let count = measured.iter().flatten().count() as f64;
    let mut components = Components {
        noise: problem.robot.as_ref().ok_or(HandEyeError::Undetermined)?.noise,
        freedom: [3.0 * count - 6.0; 2],
    };
    let mut minimum = None;
    for _ in 0..MAX_ROUNDS {
        let found = minimise(problem, whitening, calibration.loss, Until::Fine);
        let found = found.ok_or(match calibration.stop.is_raised() {
            true => HandEyeError::Calibration(CalibrationError::Stopped),
            false => HandEyeError::Undetermined,
        })?;
        let links = Links::of(&found, measured).ok_or(HandEyeError::Undetermined)?;
        problem = found.problem.clone();
        minimum = Some(found);
        let robot = problem.robot.as_mut().ok_or(HandEyeError::Undetermined)?;
        let right = links.right(&components);
        let used = measured.iter().zip(&right).map(|(pose, right)| pose.filter(|_| *right));
        let used: Vec<Option<Pose>> = used.collect();
        if used.iter().flatten().count() < MIN_POSES {
            match noise {
                Some(_) => return Err(HandEyeError::Noise),
                None => break,
            }
        }
        let is_same = used == robot.poses;
        robot.poses = used;
        let next = links.components(components.noise);
        components.freedom = next.freedom;
        let is_settled = noise.is_some() || noise::are_equal(next.noise, components.noise);
        if is_same && is_settled {
            break;
        }
        if noise.is_none() {
            components.noise = next.noise;
            robot.noise = next.noise;
        }
    }
    let minimum = minimum.ok_or(HandEyeError::Undetermined)?;
    Ok(Joint { minimum, components })
}

/// The poses of the robot that were used.
fn used_poses(problem: &Problem) -> Vec<Pose> {
    problem.robot.iter().flat_map(|robot| robot.poses.iter().copied().flatten()).collect()
}

/// The frames with a pose of the robot.
fn views(
    problem: &Problem,
    robot: &Robot,
    measured: &[Option<Pose>],
    indices: &[Option<usize>],
    names: impl Iterator<Item = String>,
) -> Vec<HandEyeView> {
    let mut by_robot = problem.clone();
    for (frame, measured) in by_robot.frames.iter_mut().zip(measured) {
        if let Some(measured) = measured {
            *frame = robot.seen(measured);
        }
    }
    let [own, by_robot] = [problem, &by_robot].map(frame_rms_px);
    let of_frame = |(frame, name): (usize, String)| {
        let (pose, measured) = (indices[frame]?, measured[frame].as_ref()?);
        let [rotation_rad, translation_mm] = robot.off(&problem.frames[frame], measured);
        Some(HandEyeView {
            name,
            pose,
            is_used: robot.poses[frame].is_some(),
            rotation_rad,
            translation_mm,
            rms_px: own[frame],
            robot_rms_px: by_robot[frame],
        })
    };
    names.enumerate().filter_map(of_frame).collect()
}

/// RMS reprojection error of each frame per axis, px; infinite where a camera cannot see a corner.
fn frame_rms_px(problem: &Problem) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; problem.frames.len()];
    for block in &problem.blocks {
        for off in problem.residuals(block) {
            let [sum, count] = &mut sums[block.frame];
            *sum += off.map_or(f64::INFINITY, |off| off.length_squared());
            *count += 2.0;
        }
    }
    sums.into_iter().map(|[sum, count]| (sum / f64::max(count, 1.0)).sqrt()).collect()
}
