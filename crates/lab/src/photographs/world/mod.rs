//! What there is to see: a printed page, what lies around it, and what covers it.
//!
//! Comes in: a target with its sheets. Goes out: pictures to be looked at from any distance, and the places of corners.
//!
//! 1. `page` is the target's PDF, drawn, with the places of its corners.
//! 2. `paths` finds these places in the operators of the PDF.
//! 3. `background` is the table that the page lies on, and the skin of what covers it.
//! 4. `covers` are hands, cables and cups on it.
//! 5. `mips` holds each of these pictures at all its sizes.

pub mod background;
pub mod covers;
pub(crate) mod mips;
pub mod page;
mod paths;
