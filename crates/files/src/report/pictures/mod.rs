//! Photographs on the page.
//!
//! Comes in: a photograph. Goes out: a small PNG of it.
//!
//! 1. `thumbnail` reduces it.
//! 2. `sample` sets it beside its undistorted version.

pub(super) mod sample;
pub(super) mod thumbnail;
