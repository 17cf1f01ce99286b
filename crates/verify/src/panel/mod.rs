//! One panel in a picture of it.
//!
//! Comes in: a page, and a panel where it is stated. Goes out: its tiles and tags, right or wrong.
//!
//! 1. `placed` joins both: panel, page and picture coordinates, by an `affine_map` where the board is found elsewhere;
//!    `text_area` is what texts in the tiles take.
//! 2. `tones` tells whether black and white are those of a print. `alone` detects a panel without tags.
//! 3. `pattern` says what every point should look like, with a `tile_table` for every pixel.
//! 4. `tiles` compares every pixel of tiles and cells, `edges` their edges to parts of a pixel.
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
