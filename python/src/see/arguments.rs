//! Results of `detect_many` as arguments.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::detection::Detection;

/// Results of `detect_many`, without the images that could not be read.
pub struct Results<'py> {
    pub all: Vec<PyRef<'py, Detection>>,
    is_read: Vec<bool>,
}

impl Results<'_> {
    /// Selects the names of the images that were read from the names of all.
    pub fn names(&self, names: Option<Vec<String>>) -> Option<Vec<String>> {
        let names = names?;
        if names.len() != self.is_read.len() {
            return Some(names);
        }
        let read = names.into_iter().zip(&self.is_read).filter(|(_, is_read)| **is_read);
        Some(read.map(|(name, _)| name).collect())
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Results<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let wrong = |what: String| PyTypeError::new_err(format!("detections: {what}"));
        if given.cast::<Detection>().is_ok() {
            return Err(wrong("expected a list, [detection]".to_owned()));
        }
        let (mut all, mut is_read) = (Vec::new(), Vec::new());
        for one in given.try_iter()? {
            let one = one?;
            if let Ok(found) = one.cast::<Detection>() {
                all.push(found.clone().borrow());
                is_read.push(true);
            } else if one.getattr("error").is_ok_and(|error| !error.is_none()) {
                is_read.push(false);
            } else {
                let kind = one.get_type().qualname()?;
                return Err(wrong(format!("expected Detection, got {kind}")));
            }
        }
        Ok(Self { all, is_read })
    }
}
