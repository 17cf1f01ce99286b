//! The Python package `deltille`, thin over the library: what arrays become, and what becomes of results.
//!
//! | module | its one job |
//! |---|---|
//! | `errors`, `interrupt` | exceptions in the words of Python; long work that Ctrl-C ends |
//! | `image`, `arrays` | arrays to pictures and points, and back |
//! | `targets`, `making`, `verdict` | targets, and their files |
//! | `paper`, `boards`, `other_detectors`, `solids` | targets from what is asked for |
//! | `families` | codes of tags |
//! | `detector`, `detection` | pictures to corners |
//! | `camera`, `pose` | cameras and rigid motions |
//! | `calibrate`, `solving` | corners to cameras and rigs: keywords, and the work |
//! | `calibration`, `calibrated_camera`, `views` | what came of it |
//! | `next_view` | which view to take next |
//! | `comparison` | whether two calibrations differ; where a target is |
//! | `rendering` | synthetic pictures |
//! | `programs` | the programs `deltille` and `deltag` |

mod arrays;
mod boards;
mod calibrate;
mod calibrated_camera;
mod calibration;
mod camera;
mod comparison;
mod detection;
mod detector;
mod errors;
mod families;
mod image;
mod interrupt;
mod making;
mod next_view;
mod other_detectors;
mod paper;
mod pickled;
mod pickled_target;
mod pose;
mod programs;
mod rendering;
mod solids;
mod solving;
mod targets;
mod verdict;
mod views;

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
                    crate::errors::raised::Error::new_err(error.to_string())
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
    use super::boards::{Board, Checkerboard};
    #[pymodule_export]
    use super::calibrate::{calibrate, rig};
    #[pymodule_export]
    use super::calibrated_camera::{_part, CalibratedCamera};
    #[pymodule_export]
    use super::calibration::{_calibration, _rig, Calibration, Rig};
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::comparison::{
        _located, Comparison, Located, Motion, compare, compare_rigs, pose_of,
    };
    #[pymodule_export]
    use super::detection::{_detection, _grid, _tables, DecodedTag, Detection, Grid, Reason};
    #[pymodule_export]
    use super::detector::{_detector, Detector};
    #[pymodule_export]
    use super::families::{Family, search_family};
    #[pymodule_export]
    use super::next_view::{NextView, next_view};
    #[pymodule_export]
    use super::other_detectors::{AprilGrid, Charuco, Circles};
    #[pymodule_export]
    use super::pickled_target::_target;
    #[pymodule_export]
    use super::pose::Pose;
    #[pymodule_export]
    use super::programs::_run;
    #[pymodule_export]
    use super::rendering::{Truth, render};
    #[pymodule_export]
    use super::solids::{Cube, Cuboid, Icosahedron, Octahedron, Solid, Tetrahedron};
    #[pymodule_export]
    use super::targets::{Tag, Target};
    #[pymodule_export]
    use super::verdict::Verdict;
    #[pymodule_export]
    use super::views::{Diagnosis, Excluded, View};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        deltille::setting::speak(errors::keyword);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
