//! The scene: a printed page, its surroundings, and its covers.
//!
//! The input is a target with its sheets. The output is images that can be sampled from any distance, and the positions
//! of corners.
//!
//! 1. `page` is the rendered PDF of the target, with the positions of its corners.
//! 2. `paths` extracts these positions from the operators of the PDF.
//! 3. `moved_edges` moves the edges of the page, as ink that spreads does.
//! 4. `background` is the table on which the page lies, and the texture of the covers.
//! 5. `covers` are hands, cables and cups on the page.
//! 6. `mips` contains each of these images at all sizes.

pub mod background;
pub mod covers;
pub(crate) mod mips;
mod moved_edges;
pub mod page;
mod paths;
