//! One sheet of paper compared with its layout.
//!
//! Input: pages of a document. Output: a verdict on the sheet, and the corners detected on it.
//!
//! 1. `source` renders a page; `assemble` joins the pages of a larger sheet; `face_picture` draws a face as a sheet.
//! 2. `whole` runs the following steps on it.
//! 3. `boards` compares panels with the detections, `undetected` checks panels that the detector does not search for.
//! 4. `bars` measures the check bars.
//! 5. `expected_marks` contains the texts, lines, logos and discs of the layout; `marks` compares them.
//! 6. `ground` is the area outside tiles and marks, which should be blank.

pub(super) mod assemble;
mod bars;
pub(super) mod boards;
mod expected_marks;
pub(super) mod face_picture;
mod ground;
pub(super) mod marks;
pub(super) mod source;
mod undetected;
pub(super) mod whole;
