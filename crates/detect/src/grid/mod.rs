//! From corners to grids: which corner follows which, without labels.
//!
//! Comes in: corners with their half-edges. Goes out: grids ([`saddle_grid::SaddleGrid`]), lattice coordinates up to a motion.
//!
//! 1. `links` joins corners along clean edges (`edge`), by their neighbourhood (`places`).
//! 2. `grow` starts from four corners, grows tile by tile and fills the gaps, where tiles are narrow in the frame of their
//!    neighbours (`rectified`). It searches as often as an image of its size is worth (`effort`).
//! 3. `parts` joins what a cover separates, where the map of a grid (`local_map`) continues.
//! 4. `foreshortened` repeats all of it in images compressed along the tiles, for boards at a grazing angle.
//! 5. `outline` fits a board that is seen whole; `beyond` refuses checkerboards without tags whose pattern continues where they
//!    end, `tile_shape` those whose tiles (`checker_tiles`) are not squares.

pub(in crate::detect) mod beyond;
pub(in crate::detect) mod checker_tiles;
pub(in crate::detect) mod edge;
pub(in crate::detect) mod effort;
pub(in crate::detect) mod foreshortened;
pub(in crate::detect) mod grow;
pub(in crate::detect) mod links;
pub(in crate::detect) mod local_map;
pub(in crate::detect) mod outline;
pub(in crate::detect) mod parts;
pub(in crate::detect) mod places;
pub(in crate::detect) mod rectified;
pub(in crate::detect) mod saddle_grid;
pub(in crate::detect) mod tile_shape;
