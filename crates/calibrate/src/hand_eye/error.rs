//! Why a hand–eye calibration failed.

use glam::DVec3;

use super::misreading::Misreading;
use crate::error::{CalibrationError, DegenerateMotion};
use crate::input::robot::Mounting;
use deltille_core::words::counted;

/// Minimum number of photographs with a pose of the robot: two relative motions determine the mountings.
pub(super) const MIN_POSES: usize = 3;

/// Why a hand–eye calibration failed. Each message says what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandEyeError {
    /// The camera or the poses of the board could not be estimated.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The given camera did not take the photographs.
    #[error("{0}")]
    WrongCamera(String),
    /// Poses and photographs that cannot be paired.
    #[error("cannot pair the robot's poses with the photographs: {0}")]
    Pairing(String),
    /// Too few photographs have a pose of the robot and show the target.
    #[error(
        "{} a pose of the robot and the target; at least {MIN_POSES} are needed, with rotations about two axes \
         (15 or more are better)",
        match paired {
            0 => "no photograph has".to_owned(),
            1 => "only one photograph has".to_owned(),
            n => format!("only {n} photographs have"),
        }
    )]
    TooFew {
        /// Number of photographs with both.
        paired: usize,
    },
    /// The motion does not determine the mountings.
    #[error(
        "{}",
        match why {
            DegenerateMotion::NoRotation => format!(
                "the robot did not rotate, so the position of the {} is undetermined; rotate the flange by 20° or \
                 more about two axes", mounted(*mounting)
            ),
            DegenerateMotion::OneAxis => format!(
                "the robot rotated only about one axis, {} in the base, so the position of the {} along it is \
                 undetermined; also rotate the flange by 20° or more about a second axis", axis_of(*axis), mounted(*mounting)
            ),
        }
    )]
    Motion {
        /// The rotation that is missing.
        why: DegenerateMotion,
        /// The main axis of rotation in the frame of the base.
        axis: DVec3,
        /// Where the camera is mounted.
        mounting: Mounting,
    },
    /// The board rotates in the photographs, and the poses do not.
    #[error(
        "the robot's poses rotate less or about fewer axes than the board in the photographs: check that each photograph \
         has a pose of its own"
    )]
    Still,
    /// Poses that fit only if they mean something else than was stated.
    #[error("{}", misread(readings, *mounting, *are_inverse, *times))]
    Misread {
        /// What has to be changed so that they fit.
        readings: Vec<Misreading>,
        /// Where the camera was said to be mounted.
        mounting: Mounting,
        /// Whether the poses were said to be `flange_from_base`.
        are_inverse: bool,
        /// How many times smaller the errors of the poses then are.
        times: f64,
    },
    /// Poses that fit the photographs no better than in a wrong order.
    #[error(
        "the robot's poses do not agree with the photographs in any convention: check that each pose belongs to its \
         photograph (typical error {}; {} if poses and photographs are exchanged)",
        shown_mm(*typical_mm), shown_mm(*shuffled_mm)
    )]
    NoAgreement {
        /// Typical displacement of the board, mm.
        typical_mm: f64,
        /// The same with the poses in a wrong order.
        shuffled_mm: f64,
    },
    /// The given noise is impossible.
    #[error(
        "the noise of the robot must be between 0.0001° and 57°, and between 0.001 mm and 1000 mm"
    )]
    NoiseRange,
    /// The given noise is so small that the poses contradict each other.
    #[error(
        "the poses of the robot contradict each other by far more than the given noise explains: state a larger one, or let \
         it be estimated"
    )]
    Noise,
    /// Poses that are wrong, without which the others do not determine the mountings.
    #[error(
        "the robot's poses contradict each other, and the {agreeing} that agree do not rotate about two axes: take 15 or more \
         photographs, each with the flange rotated differently"
    )]
    Contradictory {
        /// Number of poses that agree.
        agreeing: usize,
    },
    /// Translations that fit only with a factor far from 1.
    #[error(
        "the robot's translations fit the board only if they are multiplied by {scale:.3}: check the unit of the poses and \
         the size of the board"
    )]
    Unit {
        /// The factor.
        scale: f64,
    },
    /// The equations have no solution.
    #[error("the poses do not determine the mountings: rotate the flange more, about two axes")]
    Undetermined,
}

/// What moves with the robot.
fn mounted(mounting: Mounting) -> &'static str {
    match mounting {
        Mounting::EyeInHand => "camera on the flange",
        Mounting::EyeToHand => "board on the flange",
    }
}

fn axis_of(axis: DVec3) -> String {
    // Of the two directions, the one with a positive largest component.
    let largest = axis.to_array().into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let axis = axis * largest.unwrap_or(1.0).signum();
    // Without the sign of a zero.
    let [x, y, z] = axis.to_array().map(|v| (v * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2})")
}

fn shown_mm(mm: f64) -> String {
    match mm.is_finite() {
        true => format!("{mm:.0} mm"),
        false => "unlimited".to_owned(),
    }
}

fn misread(readings: &[Misreading], mounting: Mounting, are_inverse: bool, times: f64) -> String {
    let [looks, remedies]: [Vec<String>; 2] = [
        readings.iter().map(|of| of.look().to_owned()).collect(),
        readings.iter().map(|of| of.remedy(mounting, are_inverse)).collect(),
    ];
    let times = match times {
        1000.0.. => "errors are more than 1000 times smaller".to_owned(),
        _ => format!("errors are {times:.0} times smaller"),
    };
    format!("the robot's poses look {}: {} ({times})", looks.join(" and "), remedies.join("; "))
}

/// The beginning of a list of names.
pub(super) fn named<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names: Vec<&str> = names.into_iter().collect();
    let more = names.len().saturating_sub(3);
    names.truncate(3);
    match more {
        0 => names.join(", "),
        _ => format!("{} and {}", names.join(", "), counted(more, "other")),
    }
}
