//! Files of artwork: `pdf`, `svg` and `png` of whole sheets, `laser_svg` and [`dxf`] for cutters. `supersample` renders black marks
//! as pixels.

pub mod dxf;
#[cfg(feature = "print")]
pub mod laser_svg;
#[cfg(feature = "print")]
pub mod pdf;
#[cfg(feature = "print")]
pub mod png;
#[cfg(feature = "print")]
pub(super) mod supersample;
#[cfg(feature = "print")]
pub mod svg;
