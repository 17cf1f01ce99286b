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

pub(crate) mod calibration;
pub(crate) mod grid;
pub(crate) mod loss;
pub(crate) mod observation;
pub(crate) mod order;
pub(crate) mod panel;
pub(crate) mod reference;
pub(crate) mod sample;
pub(crate) mod views;
pub(crate) mod weights;
