//! Whether the photographs contradict what was stated about the robot: the unit of its translations, and its noise.
//!
//! The joint adjustment is repeated with an unknown scale and an unknown noise. A scale contradicts if it differs
//! significantly from 1, and a given noise if its ratio to the estimated one is not that of a variance with as many degrees of
//! freedom.

use std::fmt;

use super::noise::WRONG;
use crate::input::robot::RobotNoise;
use deltille_core::statistics::f_p_value;

/// Degrees of freedom of a variance that is known.
const KNOWN: f64 = 1e6;

/// A statement about the robot that the photographs contradict.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Contradiction {
    /// The translations of the robot fit significantly better with a factor.
    Scale {
        /// The factor.
        scale: f64,
        /// Its standard deviation.
        sd: f64,
    },
    /// The given noise of the robot is significantly too small or too large.
    Noise {
        /// The estimated noise.
        estimated: RobotNoise,
    },
}

impl Contradiction {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scale { .. } => "scale",
            Self::Noise { .. } => "robot_noise",
        }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scale { scale, sd } => write!(
                f,
                "the robot's translations fit the board better if they are multiplied by {scale:.5} ± {sd:.5}: check the \
                 unit of the poses, the size of the board and the focal length of the camera, or estimate the scale"
            ),
            Self::Noise { estimated } => write!(
                f,
                "the given noise of the robot differs significantly from that of the residuals, {:.4}° and {:.3} mm: correct \
                 it, or let it be estimated",
                estimated.rotation_rad.to_degrees(),
                estimated.translation_mm
            ),
        }
    }
}

/// A scale with its standard deviation, if it differs significantly from 1.
pub(super) fn of_scale(scale: f64, sd: f64, freedom: f64) -> Option<Contradiction> {
    let t = (scale - 1.0) / sd;
    (f_p_value(t * t, 1.0, freedom.max(1.0)) < WRONG).then_some(Contradiction::Scale { scale, sd })
}

/// The estimated noise, if it differs significantly from the given one.
pub(super) fn of_noise(
    given: RobotNoise,
    estimated: RobotNoise,
    freedom: [f64; 2],
) -> Option<Contradiction> {
    let ratios = [
        estimated.rotation_rad / given.rotation_rad,
        estimated.translation_mm / given.translation_mm,
    ];
    let is_off = ratios.into_iter().zip(freedom).any(|(ratio, freedom)| {
        let (square, freedom) = (ratio * ratio, freedom.max(1.0));
        f_p_value(square, freedom, KNOWN) < WRONG || f_p_value(1.0 / square, KNOWN, freedom) < WRONG
    });
    is_off.then_some(Contradiction::Noise { estimated })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noise_contradicts_beyond_the_uncertainty_of_its_estimate() {
        let given = RobotNoise { rotation_rad: 1e-3, translation_mm: 0.2 };
        let estimated = |factor: f64| {
            let estimated = RobotNoise { translation_mm: 0.2 * factor, ..given };
            of_noise(given, estimated, [50.0; 2]).is_some()
        };
        // The relative standard deviation of an estimate with 50 degrees of freedom is 0.1.
        assert!([0.7, 1.0, 1.3].iter().all(|factor| !estimated(*factor)));
        assert!([0.4, 1.7].iter().all(|factor| estimated(*factor)));
    }
}
