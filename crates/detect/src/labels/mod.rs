//! Labelling: assigns each corner of a grid to a corner of a panel.
//!
//! Input: the image and a grid. Output: the grid with panel, rows and columns, or the reason why it has no labels.
//!
//! 1. `grid_light` measures black, white and blur (`grid_blur`) on the edges of the tiles.
//! 2. `tags` samples every tile through its map (`tile_map`); `soft_cells` computes how blur mixes its cells,
//!    `cell_odds` the log-odds of the cells, and `joint_cells` those of words whose cells are blurred into each other.
//! 3. `tag_words` compares them with the words of the target.
//! 4. `placement` combines the evidence of all tiles to decide where the grid lies on the target.
//! 5. `grid_labels` labels each grid, by tags or by an outline; `why` finds the reason for missing labels, and
//!    `other_settings` the settings of the target with which the tags would fit.

pub(crate) mod cell_odds;
pub(crate) mod grid_blur;
pub(crate) mod grid_labels;
pub(crate) mod grid_light;
pub(crate) mod joint_cells;
pub(crate) mod other_settings;
pub(crate) mod placement;
pub(crate) mod soft_cells;
pub(crate) mod tag_words;
pub(crate) mod tags;
pub(crate) mod tile_map;
pub(crate) mod why;
