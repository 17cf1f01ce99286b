//! One sheet of paper compared with its layout.
//!
//! Comes in: pages of a document. Goes out: a verdict on the sheet, and the corners that were seen on it.
//!
//! 1. `source` renders a page; `assemble` joins the pages of a larger sheet, `face_picture` draws a face as a sheet.
//! 2. `whole` runs the following on it.
//! 3. `boards` compares panels with what the detector sees, `undetected` those that it does not look for.
//! 4. `bars` measures the check bars.
//! 5. `expected_marks` has the texts, lines, logos and discs of the layout; `marks` compares them.
//! 6. `ground` is what lies beside tiles and marks, and should be blank.

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
