use crate::statistics::median;

/// Corners seen together do not belong with the others when their median error is more than so many
/// times the usual: blur, light and distance make a few times as much of it, labels that are off by a
/// tile a hundred times, as pictures do that were not taken at the same moment.
const WRONG_RATIO: f64 = 10.0;

/// Nor are they wrong below this: a corner that was found at all is found to the pixel, however much
/// better the others are.
const WRONG_PX: f64 = 1.0;

/// The median error of corners, px.
pub(super) fn median_px<'a>(residuals: impl IntoIterator<Item = &'a [f64; 2]>) -> f64 {
    median(residuals.into_iter().map(|[x, y]| x.hypot(*y)).collect()).unwrap_or(0.0)
}

/// The median error beyond which corners do not belong with the others, px, from those of all.
pub(super) fn limit_px(medians: &[f64]) -> f64 {
    f64::max(WRONG_RATIO * median(medians.to_vec()).unwrap_or(0.0), WRONG_PX)
}
