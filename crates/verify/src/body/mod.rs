//! Bodies for 3D printing.
//!
//! Input: the triangles of one body, or of a black one in a white one. Output: a verdict on their shape.
//!
//! 1. `shape` compares a single body, as STL or 3MF: a solid, or a skeleton that carries panels.
//! 2. `inlay` compares two bodies, as 3MF, and their common surface like a printed page.

pub(super) mod inlay;
pub(super) mod shape;
