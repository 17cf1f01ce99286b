//! Pictures of targets: what a camera sees, and what is found in it.
//!
//! Comes in: targets, cameras and pictures. Goes out: a `Detection` of each picture.
//!
//! 1. `camera` projects, and is read from and written for other programs; `pose` is a rigid motion.
//! 2. `rendering` takes a synthetic picture with them, with the true places of its corners.
//! 3. `detector` finds targets in pictures.
//! 4. `detection` is what it found: corners, tags, or the reason why there are none.

pub mod camera;
pub mod detection;
pub mod detector;
pub mod pose;
pub mod rendering;
