//! Searches in transformed images, for boards that the image itself does not show clearly.
//!
//! Input: the pyramid of an image in which no board was identified, or only a part of one. Output: grids in pixels of that image. Only
//! identified boards are reported, because other patterns, once transformed, resemble boards.
//!
//! 0. `regions` limits them to the parts of the image that may show a board.
//! 1. `moved_edges` moves the edges back of boards whose dark tiles have grown or shrunk.
//! 2. `enlarged` enlarges the image, for boards whose tags begin a few pixels from their corners.
//! 3. `foreshortened` compresses the image along the tiles of boards at a grazing angle.

pub(crate) mod enlarged;
pub(crate) mod foreshortened;
pub(crate) mod moved_edges;
pub(crate) mod regions;
