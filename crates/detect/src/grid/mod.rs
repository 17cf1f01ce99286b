//! Grids: joins corners into lattices, without labels.
//!
//! Input: corners with their half-edges. Output: grids ([`saddle_grid::SaddleGrid`]) with lattice coordinates up to a
//! motion.
//!
//! 1. `links` joins corners along clean edges (`edge`) in their neighbourhood (`neighbours`).
//! 2. `grow` starts from four corners and grows tile by tile. `gaps` searches for missing corners; where tiles are
//!    narrow, it searches in the frame of their neighbours (`rectified`). Where no corner is
//!    visible but its edges are, these meet in it (`edge_crossing`). `effort` limits the searches per image.
//! 3. `parts` joins parts on both sides of an occluder, where the map of a grid (`local_map`), with rows and columns
//!    that may be wide and narrow in turn (`spacing`), continues.
//! 4. `outer_edges` removes corners at the end of a grid whose tiles are not all visible. `grids` runs these, and
//!    removes duplicates and grids of the cells of tags.
//! 5. `outline` fits a visible board. `untagged` distinguishes boards without tags from other patterns.

pub(crate) mod edge;
pub(crate) mod edge_crossing;
pub(crate) mod effort;
pub(crate) mod gaps;
pub(crate) mod grids;
pub(crate) mod grow;
pub(crate) mod links;
pub(crate) mod local_map;
pub(crate) mod neighbours;
pub(crate) mod outer_edges;
pub(crate) mod outline;
pub(crate) mod parts;
pub(crate) mod rectified;
pub(crate) mod saddle_grid;
pub(crate) mod spacing;
pub(crate) mod untagged;
