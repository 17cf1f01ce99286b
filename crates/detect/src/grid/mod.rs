//! Grids: joins corners into lattices, without labels.
//!
//! Input: corners with their half-edges. Output: grids ([`saddle_grid::SaddleGrid`]) with lattice coordinates up to a
//! motion.
//!
//! 1. `links` joins neighbouring corners along clean edges.
//! 2. `grow` starts from four corners and grows tile by tile. `gaps` searches for missing corners where `map` predicts
//!    them. `effort` limits the searches per image.
//! 3. `parts` joins parts on both sides of an occluder, where the map of a grid continues.
//! 4. `outer_edges` removes corners at the end of a grid whose tiles are not all visible.
//! 5. `grids` runs these, and removes duplicates and grids of the cells of tags.
//! 6. `outline` fits a visible board. `untagged` distinguishes boards without tags from other patterns.

pub(crate) mod effort;
pub(crate) mod gaps;
pub(crate) mod grids;
pub(crate) mod grow;
pub(crate) mod links;
pub(crate) mod map;
pub(crate) mod outer_edges;
pub(crate) mod outline;
pub(crate) mod parts;
pub(crate) mod saddle_grid;
pub(crate) mod untagged;
