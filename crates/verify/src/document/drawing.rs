//! What is common to the drawing of all formats: how large a picture may be, and for how long it is drawn.

use std::time::Instant;

/// Largest picture that is drawn for a check, px.
pub(crate) const MAX_PIXELS: f64 = 60.0e6;

/// Whether the time for drawing is over; what is drawn after that is not looked at.
pub(super) fn is_over(end: Option<Instant>) -> bool {
    end.is_some_and(|end| Instant::now() > end)
}

/// Whole pixels of a length.
pub(super) fn pixels(mm: f64, px_per_mm: f64) -> usize {
    ((mm * px_per_mm).round() as usize).max(1)
}

/// Luma of an opaque colour, Rec. 709 weights.
pub(super) fn luma([r, g, b]: [u8; 3]) -> u8 {
    (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)).round() as u8
}
