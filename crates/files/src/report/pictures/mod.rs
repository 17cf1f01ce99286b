//! Photographs on the page.
//!
//! Input: a photograph. Output: a small PNG.
//!
//! 1. `thumbnail` reduces it.
//! 2. `sample` shows it beside its undistorted version.

pub(super) mod sample;
pub(super) mod thumbnail;
