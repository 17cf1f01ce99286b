//! The Python package `deltille`, thin over the library: what arrays become, and what becomes of results.
//!
//! Comes in: a call from Python with arrays, paths and keywords. Goes out: a class of the package, arrays, or an exception.
//!
//! 1. `boundary` takes what Python gives, and makes exceptions of errors.
//! 2. `targets` are made, written and verified.
//! 3. `see` finds them in pictures.
//! 4. `calibrate` makes cameras and rigs of what was found, and compares them.
//! 5. `programs` runs `deltille` and `deltag`.
//!
//! What can be named in Python is listed below, in `_core`.

#![allow(unreachable_pub, reason = "the interface is that of Python")]

mod boundary;
mod calibrate;
mod programs;
mod see;
mod targets;

use pyo3::prelude::*;

/// What pickle restores a value by: a function and its arguments.
type Reduced<'py, A> = PyResult<(Bound<'py, PyAny>, A)>;

/// Makes a class of plain data one that pickle and copy take, as JSON.
macro_rules! pickles {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, (String,)> {
                let text = serde_json::to_string(slf.get()).unwrap_or_default();
                Ok((slf.get_type().getattr("_from_json")?, (text,)))
            }

            #[staticmethod]
            fn _from_json(text: &str) -> PyResult<Self> {
                let wrong = |error: serde_json::Error| {
                    crate::boundary::errors::raised::Error::new_err(error.to_string())
                };
                serde_json::from_str(text).map_err(wrong)
            }
        }
    };
}
pub(crate) use pickles;

/// The compiled part of the package.
#[pymodule]
mod _core {
    use super::*;

    #[pymodule_export]
    use super::calibrate::calibrated_camera::{_part, CalibratedCamera};
    #[pymodule_export]
    use super::calibrate::calibration::{_calibration, _rig, Calibration, Rig};
    #[pymodule_export]
    use super::calibrate::comparison::{
        _located, Comparison, Located, Motion, compare, compare_rigs, pose_of,
    };
    #[pymodule_export]
    use super::calibrate::keywords::{calibrate, rig};
    #[pymodule_export]
    use super::calibrate::next_view::{NextView, next_view};
    #[pymodule_export]
    use super::calibrate::views::{Diagnosis, Excluded, View};
    #[pymodule_export]
    use super::programs::_run;
    #[pymodule_export]
    use super::see::camera::Camera;
    #[pymodule_export]
    use super::see::detection::{_detection, _grid, _tables, DecodedTag, Detection, Grid, Reason};
    #[pymodule_export]
    use super::see::detector::{_detector, Detector};
    #[pymodule_export]
    use super::see::pose::Pose;
    #[pymodule_export]
    use super::see::rendering::{Truth, render};
    #[pymodule_export]
    use super::targets::boards::{Board, Checkerboard};
    #[pymodule_export]
    use super::targets::families::{Family, search_family};
    #[pymodule_export]
    use super::targets::other_detectors::{AprilGrid, Charuco, Circles};
    #[pymodule_export]
    use super::targets::pickled_target::_target;
    #[pymodule_export]
    use super::targets::solids::{Cube, Cuboid, Icosahedron, Octahedron, Solid, Tetrahedron};
    #[pymodule_export]
    use super::targets::target::{Tag, Target};
    #[pymodule_export]
    use super::targets::verdict::Verdict;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        deltille::setting::speak(super::boundary::errors::keyword);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
