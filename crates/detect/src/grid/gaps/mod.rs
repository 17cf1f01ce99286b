//! Corners of a grid that were not found at first.
//!
//! Input: an image, a grid, and the map from its lattice to the image. Output: the grid with more corners.
//!
//! 1. `fill` visits the empty vertices in the grid and around it.
//! 2. `rectified` searches for a corner in the frame of its neighbours, where tiles are narrow.
//! 3. `edge_crossing` computes the intersection of the edges of a corner that is itself not visible.
//! 4. `hidden` predicts corners behind an occluder, for reading tags beside it.

pub(crate) mod edge_crossing;
pub(crate) mod fill;
pub(crate) mod hidden;
pub(crate) mod rectified;
