//! How many levels the pyramid of an image has.

use deltille_core::raster::ImageView;

/// Most levels of the pyramid that every image has: the coarsest sees four times the blur that the finest can.
pub(super) const PYRAMID_LEVELS: usize = 3;

/// Larger images have more, as long as a level is no narrower than this: an enlarged or blurred image
/// shows no less than a small one, where a dozen corners in line are ten pixels apart.
const MIN_FURTHER_SIDE: usize = 150;

/// A level narrower than this shows no grid.
pub(super) const MIN_LEVEL_SIDE: usize = 24;

/// Number of levels of an image's pyramid.
pub(super) fn levels_of(image: ImageView) -> usize {
    let side = image.width().min(image.height());
    let fitting = (side / MIN_FURTHER_SIDE).checked_ilog2().unwrap_or(0) as usize + 1;
    fitting.max(PYRAMID_LEVELS)
}
