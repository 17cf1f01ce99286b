//! From corners to grids: which corner follows which, without labels.
//!
//! Comes in: corners with their half-edges. Goes out: grids ([`saddle_grid::SaddleGrid`]), lattice coordinates up to a motion.
//!
//! 1. `links` joins corners along clean edges (`edge`), by their neighbourhood (`neighbours`).
//! 2. `grow` starts from four corners and grows tile by tile; `gaps` looks for what is missing, where tiles are narrow in the
//!    frame of their neighbours (`rectified`), as often as an image of its size is worth (`effort`).
//! 3. `parts` joins what a cover separates, where the map of a grid (`local_map`) continues.
//! 4. `grids` runs these, and leaves out grids of the cells of tags and what was found twice.
//! 5. `foreshortened` repeats all of it in images compressed along the tiles, for boards at a grazing angle.
//! 6. `outline` fits a board that is seen whole; `beyond` refuses checkerboards without tags whose pattern continues where they
//!    end, `tile_shape` those whose tiles (`checker_tiles`) are not squares.

pub(crate) mod beyond;
pub(crate) mod checker_tiles;
pub(crate) mod edge;
pub(crate) mod effort;
pub(crate) mod foreshortened;
pub(crate) mod gaps;
pub(crate) mod grids;
pub(crate) mod grow;
pub(crate) mod links;
pub(crate) mod local_map;
pub(crate) mod neighbours;
pub(crate) mod outline;
pub(crate) mod parts;
pub(crate) mod rectified;
pub(crate) mod saddle_grid;
pub(crate) mod tile_shape;
