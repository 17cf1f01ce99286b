//! Increases the observed covariance if two halves of the views differ by more than it predicts.
//!
//! The scatter of single views underestimates slow or single changes, because each view differs
//! little from its neighbours. Let two halves of the views (first and last half, or odd and even
//! views) differ by δ. The camera from all views differs by δ/2 from either. If δ is significantly
//! larger than the observed covariance predicts, δδᵀ/4 is added: the variance of a mean of two,
//! estimated from the two.

use nalgebra::{DMatrix, DVector};

use super::state_equations::{Candidate, StateEquations, significance};
use deltille_core::camera::Camera;
use deltille_core::statistics::f_p_value;

/// Probability that a correct covariance is increased, for all parameters and both splits together.
const SIGNIFICANT: f64 = 0.01;

/// Number of splits of the views.
const WAYS: usize = 2;

/// Minimum number of views in a half.
const MIN_VIEWS: usize = 5;

/// The covariance of a camera's parameters, increased if the halves differ significantly. `noise`
/// is the covariance from noise.
pub(crate) fn raised(
    equations: &StateEquations,
    camera: &Camera,
    observed: DMatrix<f64>,
    noise: &DMatrix<f64>,
) -> DMatrix<f64> {
    let count = equations.count();
    let (n, unknowns) = (equations.parameter_count(), equations.unknowns_of_parameters());
    if count < 2 * MIN_VIEWS || unknowns.len() != observed.nrows() {
        return observed;
    }
    // The first parameter of each unknown.
    let first_of: Vec<usize> =
        (0..n).filter_map(|unknown| unknowns.iter().position(|&of| of == unknown)).collect();
    let of_parameters =
        |off: &dyn Fn(usize) -> f64| DVector::from_fn(unknowns.len(), |i, _| off(i));
    let limit = SIGNIFICANT / (WAYS * (n + 1)) as f64;
    let ways: [&dyn Fn(usize) -> bool; WAYS] = [&|view| 2 * view < count, &|view| view % 2 == 0];
    // Fits all parameters separately for each half.
    let apart = ways.iter().filter_map(|is_first| {
        let first = equations.some(is_first).fit(&equations.camera())?;
        let second = equations.some(|view| !is_first(view)).fit(&equations.camera())?;
        let off: DVector<f64> = first.values() - second.values();
        // Standard deviation of half the difference: the observed standard deviation, scaled by the
        // ratio that noise predicts for halves.
        let of_halves = |i: usize| {
            let half = first.noise_variance(i) + second.noise_variance(i);
            let at = (first_of[i], first_of[i]);
            (observed[at] * half / noise[at]).sqrt()
        };
        let p_value =
            |i: usize| f_p_value((off[i] / of_halves(i)).powi(2), 1.0, (count - 2) as f64);
        let is_significant = (0..n).map(p_value).fold(1.0, f64::min) < limit;
        is_significant.then(|| of_parameters(&|i| off[unknowns[i]]))
    });
    // Fits the focal lengths alone. With one common lens, halves that show the board differently
    // determine them better.
    let focal = ways.iter().filter(|_| equations.is_focal_free()).filter_map(|is_first| {
        let mut columns = equations.camera();
        let weights = (0..count).map(|view| f64::from(u8::from(is_first(view)))).collect();
        columns.push(equations.weighted(Candidate::Focal, weights));
        let effect = equations.fit(&columns)?.effect(n, 2.0)?;
        let focal_px = camera.focal_px.to_array();
        let off = of_parameters(&|i| focal_px.get(i).map_or(0.0, |px| px * effect.value));
        (significance(effect) < limit).then_some(off)
    });
    let differences: Vec<DVector<f64>> = apart.chain(focal).collect();
    differences.iter().fold(observed, |sum, off| sum + off * off.transpose() / 4.0)
}
