//! Limits shared by the renderers of all formats: image size and rendering time.

use std::time::Instant;

/// Largest rendered image, px.
pub(crate) const MAX_PIXELS: f64 = 60.0e6;

/// Whether the rendering time is over; the result is then discarded.
pub(super) fn is_over(end: Option<Instant>) -> bool {
    end.is_some_and(|end| Instant::now() > end)
}

/// Converts a length to whole pixels.
pub(super) fn pixels(mm: f64, px_per_mm: f64) -> usize {
    ((mm * px_per_mm).round() as usize).max(1)
}

/// Returns the luma of an opaque colour, with Rec. 709 weights.
pub(super) fn luma([r, g, b]: [u8; 3]) -> u8 {
    ((2126 * u32::from(r) + 7152 * u32::from(g) + 722 * u32::from(b) + 5000) / 10_000) as u8
}
