//! Drawings and prints of tags.
//!
//! 1. `show` draws tags of a family in one image.
//! 2. `sheet` prints them to scale and verifies the pages.

pub mod sheet;
pub mod show;
