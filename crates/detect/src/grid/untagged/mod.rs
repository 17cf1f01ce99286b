//! Evidence that a grid without tags is a board, not a halftone, a dither or a fabric.
//!
//! Input: an image and a grid. Output: whether it can be a board.
//!
//! 1. `beyond` tests whether the pattern continues beyond the grid.
//! 2. `checker_tiles` are the squares of a checkerboard; `tile_shape` tests whether they are squares.

pub(crate) mod beyond;
pub(crate) mod checker_tiles;
pub(crate) mod tile_shape;
