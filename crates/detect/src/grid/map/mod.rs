//! Positions of corners of a grid predicted from their neighbours.
//!
//! Input: corners with lattice coordinates. Output: the predicted position of any other vertex, with its error.
//!
//! 1. `spacing` measures whether rows and columns are wide and narrow in turn, as on an AprilGrid.
//! 2. `local_map` fits a smooth map from the lattice to the image to the nearest corners.
//! 3. `plane_map` fits a homography to all of them, for vertices that are far away.
//! 4. `maps` selects one of these.

pub(crate) mod local_map;
pub(crate) mod maps;
pub(crate) mod plane_map;
pub(crate) mod spacing;
