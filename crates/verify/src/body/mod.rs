//! Bodies to print in three dimensions.
//!
//! Comes in: the triangles of one body, or of a black one in a white one. Goes out: a verdict on their shape.
//!
//! 1. `shape` compares one body, as STL or 3MF: a solid, or a skeleton that holds panels.
//! 2. `inlay` compares two, as 3MF, and what they show together like a printed page.

pub(super) mod inlay;
pub(super) mod shape;
