//! From grids to labels: which corner of which panel each corner is.
//!
//! Comes in: the image and a grid. Goes out: the grid with panel, rows and columns, or the reason why it has none.
//!
//! 1. `grid_light` measures black, white and blur on the edges of the tiles.
//! 2. `tags` samples every tile through its map (`tile_map`); `soft_cells` gives the log-odds of its cells.
//! 3. `tag_words` compares them with the words of the target.
//! 4. `placement` lets all tiles decide together where the grid lies on the target.
//! 5. `grid_labels` gives each grid its labels, by tags or by an outline; `why` finds the reason where there are none.

pub(crate) mod grid_labels;
pub(crate) mod grid_light;
pub(crate) mod placement;
pub(crate) mod soft_cells;
pub(crate) mod tag_words;
pub(crate) mod tags;
pub(crate) mod tile_map;
pub(crate) mod why;
