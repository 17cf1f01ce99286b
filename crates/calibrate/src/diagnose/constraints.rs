//! Constraints that the views contradict: the parameters are estimated again without each of them.

use super::diagnosis::Diagnosis;
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::input::calibration::Calibration;
use crate::input::constraint::Constraint;
use crate::uncertainty::projection::Source;

/// Difference between a constraint and the views, in standard deviations, that is not due to chance.
const CONTRADICTED: f64 = 4.0;

impl Calibration {
    /// The constraints that differ significantly from the estimate without them; the other constraints are kept. A constraint
    /// without which there is no estimate is not contradicted.
    pub(super) fn contradicted_constraints(&self, found: &Estimate) -> Vec<Diagnosis> {
        let mut said = Vec::new();
        for (camera, of) in self.cameras.iter().enumerate() {
            for (index, constraint) in of.constraints.iter().enumerate() {
                let mut cameras = self.cameras.clone();
                cameras[camera].constraints.remove(index);
                let free = self.of_cameras(cameras).covariance_of_all(false).adjusted();
                let deviations = free.ok().and_then(|free| {
                    deviations(constraint, &found.cameras[camera], &free.cameras[camera])
                });
                if let Some(deviations) = deviations.filter(|of| *of > CONTRADICTED) {
                    let constraint = constraint.clone();
                    said.push(Diagnosis::WrongConstraint { camera, constraint, deviations });
                }
            }
        }
        said
    }
}

/// How far a constraint is from the estimate without it, in standard deviations of the difference; `None` if unknown.
fn deviations(
    constraint: &Constraint,
    found: &CameraEstimate,
    free: &CameraEstimate,
) -> Option<f64> {
    let sources = [Source::Noise, Source::Observed];
    let covariances: Vec<_> = sources.iter().filter_map(|of| free.covariance_from(*of)).collect();
    // Without a constraint, an ill-conditioned parameter may be anywhere.
    let place = |name: &String| {
        let place = free.estimated_parameters().position(|of| of == name);
        place.filter(|_| !free.ill_conditioned.contains(name))
    };
    let value = |of: &CameraEstimate, name: &String| {
        of.parameters.iter().find(|of| of.name == *name).map(|of| of.value)
    };
    // The larger one of the two variances.
    let sd = |terms: &[(usize, f64)]| {
        let variance = covariances.iter().map(|of| {
            let pairs = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
            pairs.map(|((i, a), (j, b))| a * b * of[(*i, *j)]).sum::<f64>()
        });
        variance.max_by(f64::total_cmp).filter(|variance| *variance > 0.0).map(f64::sqrt)
    };
    match constraint {
        Constraint::Fixed { parameter, .. } => {
            let off = value(free, parameter)? - value(found, parameter)?;
            Some(off.abs() / sd(&[(place(parameter)?, 1.0)])?)
        }
        Constraint::Prior { parameter, value: known, sd: of_prior } => {
            let off = |of: &CameraEstimate| Some((value(of, parameter)? - known).abs());
            // The views may also pull the estimate away from the prior.
            let pulled = off(found)? / of_prior;
            Some(pulled.max(off(free)? / sd(&[(place(parameter)?, 1.0)])?.hypot(*of_prior)))
        }
        Constraint::Equal { parameters } => {
            let (first, others) = parameters.split_first()?;
            let from_first = |other: &String| {
                let off = value(free, first)? - value(free, other)?;
                Some(off.abs() / sd(&[(place(first)?, 1.0), (place(other)?, -1.0)])?)
            };
            others.iter().filter_map(from_first).max_by(f64::total_cmp)
        }
    }
}
