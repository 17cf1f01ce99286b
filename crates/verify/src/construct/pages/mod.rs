//! Constructs of printed pages.
//!
//! Comes in: a PDF or an SVG. Goes out: what in it is not on the list of its format.
//!
//! 1. `svg` has elements, attributes and values.
//! 2. `pdf` has objects, `pdf_content` the operators that draw a page.
//! 3. `ink` tells for both whether what is drawn is black, white and on the page.

mod ink;
pub(super) mod pdf;
mod pdf_content;
pub(super) mod svg;
