//! Drawings for cutting machines.
//!
//! Input: a `.dxf` or `.svg`. Output: the outlines that are not at their positions.
//!
//! 1. `outlines` compares the paths of panels and nets for a cutter.
//! 2. `laser` first measures the kerf of boards for a laser, then compares the engraved surface like a printed page.

pub(super) mod laser;
pub(super) mod outlines;
