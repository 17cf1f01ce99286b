//! Hand–eye and robot–world calibration: where a camera and a board are mounted on a robot.
//!
//! Input: a calibration of one camera, the poses of a robot, and the detections of all photographs. Output: the mountings
//! with their covariance ([`estimate::HandEye`]), or the reason why they cannot be determined ([`error::HandEyeError`]).
//!
//! 1. `request` collects what is given.
//! 2. `pairing` finds the pose of the robot for each photograph: by name, by time or by order.
//! 3. `readings` computes initial mountings by consensus, and recognises poses that are inverted or in other units
//!    (`misreading`).
//! 4. `noise` estimates the noise of the robot as variance components, and finds wrong poses.
//! 5. `run` adjusts everything together; `contradictions` tests what was stated about the robot; `estimate` has the result as
//!    values.

pub(crate) mod contradictions;
pub(crate) mod error;
pub(crate) mod estimate;
pub(crate) mod misreading;
mod noise;
pub(crate) mod pairing;
mod readings;
pub(crate) mod request;
mod run;
