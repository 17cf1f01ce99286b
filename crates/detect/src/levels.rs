//! Number of levels of the image pyramid.

use deltille_core::raster::ImageView;

/// Minimum number of levels for every image. The coarsest level shows corners with four times as
/// much blur as the finest level can.
pub(super) const PYRAMID_LEVELS: usize = 3;

/// Minimum side of the additional levels of larger images, px. An enlarged or blurred image shows
/// no more detail than a small one. At this size, a dozen corners in a row can still be 10 px
/// apart.
const MIN_FURTHER_SIDE: usize = 150;

/// Minimum side of a level that can show a grid, px.
pub(super) const MIN_LEVEL_SIDE: usize = 24;

/// Returns the number of levels of an image's pyramid.
pub(super) fn levels_of(image: ImageView) -> usize {
    let side = image.width().min(image.height());
    let fitting = (side / MIN_FURTHER_SIDE).checked_ilog2().unwrap_or(0) as usize + 1;
    fitting.max(PYRAMID_LEVELS)
}
