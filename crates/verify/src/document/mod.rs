//! Printed pages rendered by code independent of their writer: hayro for PDF, resvg for SVG, the image crates for
//! PNG.
//!
//! Input: an inspected file. Output: each [`Page`] as an image.
//!
//! 1. `opened` parses a document and renders its pages.
//! 2. `pdf`, `svg` and `png` do this for one format each, within the limits of size and time in `drawing`.
//! 3. `page` is the rendered image, in millimetres.
//!
//! [`Page`]: page::Page

pub(super) mod drawing;
pub(super) mod opened;
pub(super) mod page;
mod pdf;
mod png;
mod svg;
