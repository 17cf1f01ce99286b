//! The input of a calibration: named detections become views.
//!
//! Input: detections and the photographed target. Output: a [`calibration::Calibration`] with all
//! prior knowledge and all requests.
//!
//! 1. `reference` describes one target, several targets, or an untagged board (`grid`), and checks labels against it.
//! 2. `views` converts all detections and checks them for image sizes, duplicates, wrong labels and mirrored images.
//!    `photographs` groups them by the camera that their EXIF metadata name.
//! 3. `observation` is the content of an image: corners of panels (`panel`).
//! 4. `calibration` collects cameras with their views and the settings, including `loss` and
//!    `weights`. `intrinsics` describes what is known about a camera; `constraint`, parameters that are fixed, equal, or
//!    have a prior.
//! 5. `robot` describes the poses of a robot that moves the camera or the board.
//!
//! `order` sorts the names of frames by their numbers, and `sample` selects evenly spaced items.

pub(crate) mod calibration;
pub(crate) mod constraint;
pub(crate) mod grid;
pub(crate) mod intrinsics;
pub(crate) mod loss;
pub(crate) mod observation;
pub(crate) mod order;
pub(crate) mod panel;
pub(crate) mod photographs;
pub(crate) mod reference;
pub(crate) mod robot;
pub(crate) mod sample;
pub(crate) mod views;
pub(crate) mod weights;
