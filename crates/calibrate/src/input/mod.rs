//! From named detections to views, and what a calibration is made from.
//!
//! Comes in: detections, and the target that was photographed. Goes out: a [`calibration::Calibration`], which has all that
//! is known and all that is asked for.
//!
//! 1. `reference` is the target, several targets, or an untagged board (`grid`), and compares labels with it.
//! 2. `views` reads all detections: sizes, copies of one picture, wrong labels and mirrored pictures.
//! 3. `observation` is what a picture shows then: corners of panels (`panel`).
//! 4. `calibration` holds cameras with their views and the settings, among them `loss` and `weights`.
//!
//! `order` sorts names of frames by their numbers, `sample` takes some of many.

pub(in crate::calibrate) mod calibration;
pub(in crate::calibrate) mod grid;
pub(in crate::calibrate) mod loss;
pub(in crate::calibrate) mod observation;
pub(in crate::calibrate) mod order;
pub(in crate::calibrate) mod panel;
pub(in crate::calibrate) mod reference;
pub(in crate::calibrate) mod sample;
pub(in crate::calibrate) mod views;
pub(in crate::calibrate) mod weights;
