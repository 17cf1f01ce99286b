//! Drawings for machines that cut.
//!
//! Comes in: a `.dxf` or `.svg`. Goes out: which outlines are not in their places.
//!
//! 1. `outlines` compares the paths of panels and nets for a cutter.
//! 2. `laser` measures the kerf of boards for a laser first, and looks at what is engraved like at a printed page.

pub(super) mod laser;
pub(super) mod outlines;
