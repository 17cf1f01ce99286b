use super::misfit::{SIGNIFICANT, deviate_of_f};
use super::model::Model;
use super::remedy::trial;
use super::solution::Solution;
use super::solve::{Options, calibrated};
use super::view::View;
use crate::camera::Pose;

/// The model with the fewest parameters that holds the lens of a calibration as well as its own, of those
/// that have fewer of the same parameters; `None` where all of its own are needed.
///
/// With q parameters less the squares of the residuals grow by F q of their variances, and by chance F
/// is about 1.
pub fn sufficient(
    views: &[View],
    panels: &[Pose],
    options: Options,
    solution: &Solution,
) -> Option<Model> {
    let (views, solution) = trial(views, panels, options, solution)?;
    let mut found = None;
    let mut next = options.model.smaller();
    while let Some(model) = next {
        let options = Options { model, ..options };
        let smaller = calibrated(&views, panels, options, solution.shape.is_some());
        if !smaller.is_ok_and(|smaller| holds_as_well(&smaller, &solution)) {
            break;
        }
        found = Some(model);
        next = model.smaller();
    }
    found
}

fn holds_as_well(smaller: &Solution, solution: &Solution) -> bool {
    let names = |solution: &Solution| -> Vec<String> {
        solution.views.iter().map(|view| view.name.clone()).collect()
    };
    if names(smaller) != names(solution) {
        return false;
    }
    let corners = |solution: &Solution| {
        let of_views = solution.views.iter().flat_map(|view| view.corners.clone());
        of_views.collect::<Vec<_>>()
    };
    let (mut own, mut other, mut count) = (0.0, 0.0, 0.0);
    for (a, b) in corners(solution).iter().zip(&corners(smaller)) {
        // An outlier of the smaller model may be what it does not hold.
        if !a.outlier {
            own += a.residual.iter().map(|r| r * r).sum::<f64>();
            other += b.residual.iter().map(|r| r * r).sum::<f64>();
            count += 2.0;
        }
    }
    let found = |solution: &Solution| solution.found().count() as f64;
    let less = found(solution) - found(smaller);
    let freedom = count - found(solution) - 6.0 * solution.views.len() as f64;
    let f_ratio = (other - own).max(0.0) / less / (own / freedom);
    deviate_of_f(f_ratio, less, freedom) < SIGNIFICANT
}
