//! Constructs of printed pages.
//!
//! Input: a PDF or an SVG. Output: the constructs that are not on the list of its format.
//!
//! 1. `svg` lists elements, attributes and values.
//! 2. `pdf` lists objects, `pdf_content` the operators that draw a page.
//! 3. `ink` checks for both that marks are wide enough, drawn once and few enough.

mod ink;
pub(super) mod pdf;
mod pdf_content;
pub(super) mod svg;
