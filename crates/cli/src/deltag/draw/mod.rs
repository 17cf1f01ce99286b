//! Tags to look at, and to print.
//!
//! 1. `show` draws tags of a family on one picture.
//! 2. `sheet` puts them on pages to true scale, which are compared with what they should show.

pub mod sheet;
pub mod show;
