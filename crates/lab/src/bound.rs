//! The Cramér–Rao bound of a simulated corner.
//!
//! The Fisher information under white noise σ is JᵀJ/σ². J contains the derivatives of the exact pixels with respect to
//! all unknowns of the fit: position, angles, blur, contrast, level, and illumination slopes. The slopes have the same
//! prior as in the fit. Derivatives are difference quotients of the exact renderer.

use nalgebra::{DMatrix, Matrix2};

use deltille::detect::{SLOPE_PRIOR, Tone};
use deltille::synth::SimulatedCorner;

/// Step of the difference quotients, in units of the parameters; the errors are of second order in it.
const STEP: f64 = 1e-3;

/// Number of directions over which the length of an error is averaged.
const DIRECTIONS: usize = 64;

/// Returns the smallest covariance of a position estimated from the (2 · radius + 1)² pixels around it, for a camera
/// with a known tone curve.
pub(crate) fn covariance(
    corner: &SimulatedCorner,
    radius: usize,
    noise: f64,
    tone: Tone,
) -> Option<Matrix2<f64>> {
    let centre = corner.position.to_array().map(|c| c.round() as usize);
    // Slopes act about the corner: another origin would only change level and contrast.
    let local = SimulatedCorner { light_centre: corner.position, ..corner.clone() };
    type Move<'a> = Box<dyn Fn(&mut SimulatedCorner, f64) + 'a>;
    let mut moves: Vec<Move> = vec![
        Box::new(|c, d| c.position.x += d),
        Box::new(|c, d| c.position.y += d),
        Box::new(|c, d| c.blur_px += d),
        Box::new(|c, d| c.amplitude += d),
        Box::new(|c, d| c.level += d),
        Box::new(|c, d| c.slope.x += d),
        Box::new(|c, d| c.slope.y += d),
    ];
    for k in 0..corner.angles.len() {
        moves.push(Box::new(move |c, d| c.angles[k] += d));
    }
    let columns: Vec<Vec<f64>> = moves
        .iter()
        .map(|shift| {
            let image = |d: f64| -> Vec<f64> {
                let mut moved = local.clone();
                shift(&mut moved, d);
                moved.window(centre, radius).into_iter().map(|light| tone.grey(light)).collect()
            };
            let (up, down) = (image(STEP), image(-STEP));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * STEP * noise)).collect()
        })
        .collect();
    let mut information = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
        columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum()
    });
    for slope in [5, 6] {
        information[(slope, slope)] += 1.0 / (SLOPE_PRIOR * SLOPE_PRIOR);
    }
    let inverse = information.cholesky()?.inverse();
    Some(Matrix2::new(inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 0)], inverse[(1, 1)]))
}

/// Returns the mean length of a Gaussian error with this covariance: √(π/2) times the mean over directions of |L e|, L
/// Lᵀ = C.
pub(crate) fn mean_length(covariance: &Matrix2<f64>) -> Option<f64> {
    let root = covariance.cholesky()?.l();
    let lengths = (0..DIRECTIONS).map(|i| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / DIRECTIONS as f64).sin_cos();
        (root * nalgebra::Vector2::new(cos, sin)).norm()
    });
    Some(std::f64::consts::FRAC_PI_2.sqrt() * lengths.sum::<f64>() / DIRECTIONS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_lengths_of_isotropic_and_flat_gaussians_are_exact() {
        let round = mean_length(&Matrix2::identity()).unwrap();
        assert!((round - std::f64::consts::FRAC_PI_2.sqrt()).abs() < 1e-9);
        let flat = mean_length(&Matrix2::new(1.0, 0.0, 0.0, 1e-12)).unwrap();
        assert!((flat - (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-3);
    }
}
