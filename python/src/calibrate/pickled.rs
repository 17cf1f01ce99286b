//! Pickling of calibrations, their cameras and views.

use deltille::calibrate::{Estimate, Reference};
use deltille::export::calibration::Residuals;
use deltille::export::saved;
use deltille::layout::Printing;
use pyo3::prelude::*;

use super::solved::Solved;
use crate::boundary::errors::{self, Raise};

/// Data to restore part of a calibration: its whole text, the targets, the camera, and the view, if any.
pub type Part = (String, Vec<String>, usize, Option<usize>);

/// Returns the result of `__reduce__` for a calibration or a rig.
pub fn pickled<'py>(
    py: Python<'py>,
    restore: &str,
    solved: &Solved,
) -> crate::Reduced<'py, (String, Vec<String>)> {
    let restore = py.import("deltille._core")?.getattr(restore)?;
    let targets = solved.targets.iter().map(Printing::to_json).collect();
    Ok((restore, (solved.json(Residuals::Listed), targets)))
}

/// Restores a pickled calibration or rig.
pub fn restored(json: &str, targets: &[String]) -> PyResult<Solved> {
    let targets = targets.iter().map(|text| Printing::from_json(text).raise(errors::target));
    of_text(json, targets.collect::<PyResult<_>>()?).raise(errors::calibration)
}

/// Reads a calibration or rig from text.
pub fn of_text(text: &str, targets: Vec<Printing>) -> Result<Solved, saved::SavedError> {
    let scene: Vec<_> = targets.iter().map(|printing| printing.target.clone()).collect();
    let estimate: Estimate = match scene.as_slice() {
        [] => saved::read_without_target(text)?,
        [only] => saved::read(text, &Reference::Target(only))?,
        several => saved::read(text, &Reference::Scene(several))?,
    };
    let model = estimate.cameras.first().and_then(|camera| camera.model);
    let model = model.map_or("fixed".to_owned(), |model| model.to_string());
    Ok(Solved::read(estimate, targets, model, text))
}
