//! Restores pickled targets in their class.

use std::sync::Arc;

use deltille::layout::Printing;
use pyo3::prelude::*;

use super::boards::{Board, Checkerboard};
use super::other_detectors::{AprilGrid, Charuco, Circles};
use super::solids::{Cube, Cuboid, Icosahedron, Octahedron, Solid, Tetrahedron};
use super::target::Target;
use crate::boundary::errors::{self, Raise};

/// Restores a pickled target.
#[pyfunction]
pub fn _target<'py>(
    py: Python<'py>,
    class_: &str,
    json: &str,
    family: Option<&str>,
    squares: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut target = Printing::from_json(json).raise(errors::target)?;
    let read = |text| deltille::family::Family::from_json(text).raise(errors::family);
    let [family, squares] = [family, squares].map(|text| text.map(read).transpose());
    let (family, squares) = (family?, squares?);
    if let Some(family) = deltille::family::Family::paired(family, squares) {
        target.target.set_family(&family).raise(errors::family)?;
    }
    let target = Target { printing: Arc::new(target) };
    macro_rules! of_class {
        ($($class:ident),*) => {
            match class_ {
                $(stringify!($class) => {
                    let made = PyClassInitializer::from(target).add_subclass($class);
                    Ok(Bound::new(py, made)?.into_any())
                })*
                _ => Ok(Bound::new(py, target)?.into_any()),
            }
        };
    }
    of_class!(
        Board,
        Checkerboard,
        Charuco,
        AprilGrid,
        Circles,
        Tetrahedron,
        Octahedron,
        Icosahedron,
        Cube,
        Cuboid,
        Solid
    )
}
