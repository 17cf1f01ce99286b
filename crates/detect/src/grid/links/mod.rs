//! Links between neighbouring corners.
//!
//! Input: corners with their half-edges, and an image. Output: for each half-edge, the corner at its other end.
//!
//! 1. `neighbours` finds the nearest corners of each corner.
//! 2. `edge` tests whether the line between two corners is an edge of the pattern.
//! 3. `link` joins those corners whose half-edges point to each other along such an edge.

pub(crate) mod edge;
pub(crate) mod link;
pub(crate) mod neighbours;
