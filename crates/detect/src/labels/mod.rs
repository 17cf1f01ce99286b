//! From grids to labels: which corner of which panel each corner is.
//!
//! Comes in: the image and a grid. Goes out: the grid with panel, rows and columns, or the reason why it has none.
//!
//! 1. `grid_light` measures black, white and blur on the edges of the tiles.
//! 2. `tags` samples every tile through its map (`tile_map`); `soft_cells` gives the log-odds of its cells.
//! 3. `tag_words` compares them with the words of the target.
//! 4. `evidence` lets all tiles decide together where the grid lies on the target.
//! 5. `assignment` gives the labels to the grids, by tags or by an outline; `why` finds the reason where there are none.

pub(in crate::detect) mod assignment;
pub(in crate::detect) mod evidence;
pub(in crate::detect) mod grid_light;
pub(in crate::detect) mod soft_cells;
pub(in crate::detect) mod tag_words;
pub(in crate::detect) mod tags;
pub(in crate::detect) mod tile_map;
pub(in crate::detect) mod why;
