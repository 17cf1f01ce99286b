//! One panel on a page.
//!
//! Input: a page, and a panel at its stated position. Output: its tiles and tags, correct or not.
//!
//! 1. `placed` relates panel, page and image coordinates, by an `affine_map` if the board is found elsewhere;
//!    `text_area` is the area of texts in the tiles.
//! 2. `tones` checks whether black and white are those of a print. `alone` detects a panel without tags.
//! 3. `pattern` is the expected appearance of every point, with a `tile_table` for every pixel.
//! 4. `tiles` compares every pixel of tiles and cells, `edges` their edges with subpixel accuracy.
//! 5. `spots` joins wrong pixels.

pub(super) mod affine_map;
pub(super) mod alone;
mod edges;
pub(super) mod pattern;
pub(super) mod placed;
pub(super) mod spots;
pub(super) mod text_area;
pub(super) mod tile_table;
mod tiles;
pub(super) mod tones;
