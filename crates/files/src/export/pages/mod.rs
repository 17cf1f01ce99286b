//! Artwork to files: `pdf`, `svg` and `png` of whole sheets, `laser_svg` and [`dxf`] of what is cut.
//! `supersample` renders black marks for pictures.

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
