//! Unknowns that are added to an adjustment, and weights of priors: smoothness of splines, shape of a board, offsets of corners.

use super::reweighting::{Kept, Settled, settle, variance};
use super::wrong_views::Gross;
use crate::equations::covariances::Covariances;
use crate::equations::minimise::{Minimum, Until, minimise};
use crate::error::CalibrationError;
use crate::input::calibration::Calibration;
use crate::problem::bundle::Problem;
use crate::problem::corner_map::CornerMap;
use crate::problem::shape;
use crate::problem::shape::Shape;

/// Relative change below which a prior has converged.
const SAME_PRIOR: f64 = 0.05;

/// Maximum number of iterations in which offsets and their prior are estimated alternately.
const PRIOR_ROUNDS: usize = 10;

/// Maximum number of such iterations for the knots of a spline; each takes less time.
const KNOT_ROUNDS: usize = 15;

/// Relative change below which the standard deviation of the second differences has converged.
const SAME_SIZE: f64 = 0.1;

impl Calibration {
    /// Fits the smoothness of splines to the corners.
    pub(crate) fn smoothed(
        &self,
        gross: &Gross,
        settled: Settled,
    ) -> Result<Settled, CalibrationError> {
        let has_splines = |problem: &Problem| problem.cameras.iter().any(|c| c.roughness.is_some());
        if !has_splines(&settled.problem) {
            return Ok(settled);
        }
        let Settled { minimum, whitening, problem: all, .. } = settled;
        let (mut minimum, mut rounds) = (minimum, 0);
        loop {
            let Minimum { problem, normal, layout, .. } = &minimum;
            let covariance = normal.covariance_of_kept().ok_or(CalibrationError::NoStart)?;
            let (mut next, mut change): (_, f64) = (problem.clone(), 0.0);
            for (camera, parameters) in next.cameras.iter_mut().zip(&layout.parameters) {
                let Some(now) = &camera.roughness else { continue };
                let found = now.fitted(&camera.camera, parameters, whitening.sigma, &covariance);
                change = change.max(now.change(&found));
                camera.roughness = Some(found);
            }
            rounds += 1;
            if change < SAME_SIZE || rounds > KNOT_ROUNDS {
                break;
            }
            minimum = minimise(next, &whitening, self.loss, Until::Rough)
                .ok_or(CalibrationError::NoStart)?;
        }
        let problem = all.at(&minimum.problem);
        settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)
    }

    /// Weights the priors of parameters by the variance of unit weight, not by that of the median.
    pub(crate) fn with_weighted_priors(
        &self,
        gross: &Gross,
        settled: Settled,
    ) -> Result<Settled, CalibrationError> {
        let variance = variance(&settled.minimum, &settled.whitening, self.loss);
        let ratio = variance / settled.whitening.sigma.powi(2);
        let has_priors = settled.problem.cameras.iter().any(|camera| camera.prior.is_some());
        if !has_priors || !ratio.is_finite() || ratio <= 0.0 {
            return Ok(settled);
        }
        let mut problem = settled.problem;
        let priors = problem.cameras.iter_mut().filter_map(|camera| camera.prior.as_mut());
        priors.for_each(|prior| prior.scale(ratio));
        settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)
    }

    /// Also estimates the shape of the sheet, and the F ratio of its effect.
    pub(crate) fn bent(
        &self,
        gross: &Gross,
        settled: Settled,
    ) -> Result<(Settled, f64), CalibrationError> {
        let flat = settled.minimum.normal.cost;
        let mut problem = settled.minimum.problem;
        let observations = problem.blocks.iter().flat_map(|block| block.observations.iter());
        problem.shape = Some(Shape::flat(observations.map(|seen| seen.panel_mm)));
        // The comparison uses the same weights.
        let bent = minimise(problem, &settled.whitening, self.loss, Until::Fine)
            .ok_or(CalibrationError::NoStart)?;
        let variance = variance(&bent, &settled.whitening, self.loss);
        let f_ratio = (flat - bent.normal.cost) / shape::COUNT as f64 / variance;
        let problem = settled.problem.at(&bent.problem);
        let settled = settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)?;
        Ok((settled, f_ratio))
    }

    /// Also estimates the position of every corner of the target; returns the covariances too if they are known.
    pub(crate) fn measured(
        &self,
        gross: &Gross,
        settled: Settled,
    ) -> Result<(Settled, Option<Covariances>), CalibrationError> {
        let mut problem = settled.problem;
        problem.map = Some(CornerMap::flat(&problem.blocks));
        let mut settled = settle(Kept { problem, ..gross.kept() }, self.weights, self.loss)?;
        for _ in 0..PRIOR_ROUNDS {
            let factor = settled.minimum.factor.take();
            let Minimum { problem, normal, layout, .. } = &settled.minimum;
            let Some(map) = &problem.map else { break };
            let found = normal.covariances(layout).ok_or(CalibrationError::NoStart)?;
            let (prior_mm, determined) = map.fitted_prior(&found.corners, settled.whitening.sigma);
            let change = (prior_mm - map.prior_mm).abs() / map.prior_mm;
            if change.max_element() < SAME_PRIOR {
                return Ok((settled, Some(found)));
            }
            let map = map.clone().expecting(prior_mm, determined);
            // Releases the equations, which may be large.
            let Settled { mut problem, .. } = settled;
            drop(found);
            problem.map = Some(map);
            settled = settle(Kept { problem, factor, ..gross.kept() }, self.weights, self.loss)?;
        }
        Ok((settled, None))
    }
}
