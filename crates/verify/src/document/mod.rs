//! Printed pages read back as pictures, by other code than wrote them: hayro for PDF, resvg for SVG,
//! the image crates for PNG.
//!
//! Comes in: a file that was inspected. Goes out: each [`Page`] as a picture.
//!
//! 1. `opened` parses a document, and renders its pages.
//! 2. `pdf`, `svg` and `png` do so for one format each, within what `drawing` says of size and time.
//! 3. `page` is the picture, in millimetres.
//!
//! [`Page`]: page::Page

pub(super) mod drawing;
pub(super) mod opened;
pub(super) mod page;
mod pdf;
mod png;
mod svg;
