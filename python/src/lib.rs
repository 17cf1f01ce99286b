//! The Python package `deltille`, thin over the library: what arrays become, and what becomes of results.
//!
//! | module | its one job |
//! |---|---|
//! | `errors`, `interrupt` | exceptions in the words of Python; long work that Ctrl-C ends |
//! | `image`, `arrays` | arrays to pictures and points, and back |
//! | `targets`, `boards`, `verdict` | targets, their making and their files |
//! | `families` | codes of tags |
//! | `detector`, `detection` | pictures to corners |
//! | `camera`, `pose` | cameras and rigid motions |
//! | `solving`, `calibration`, `comparison` | corners to cameras and rigs |
//! | `rendering` | synthetic pictures |
//! | `programs` | the programs `deltille` and `deltag` |

mod arrays;
mod boards;
mod calibration;
mod camera;
mod comparison;
mod detection;
mod detector;
mod errors;
mod families;
mod image;
mod interrupt;
mod pose;
mod programs;
mod rendering;
mod solving;
mod targets;
mod verdict;

use pyo3::prelude::*;

/// What pickle restores a value by: a function and its arguments.
type Reduced<'py, A> = PyResult<(Bound<'py, PyAny>, A)>;

/// The compiled part of the package.
#[pymodule]
mod _core {
    use super::*;

    #[pymodule_export]
    use super::boards::{Board, Checkerboard, Icosahedron, Octahedron, Solid, Tetrahedron};
    #[pymodule_export]
    use super::calibration::{
        _calibration, CalibratedCamera, Calibration, Diagnosis, Excluded, Rig, View, calibrate, rig,
    };
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::comparison::{Comparison, Located, Motion, compare, compare_rigs, pose_of};
    #[pymodule_export]
    use super::detection::{_detection, DecodedTag, Detection, Grid, Reason};
    #[pymodule_export]
    use super::detector::Detector;
    #[pymodule_export]
    use super::errors::_keywords;
    #[pymodule_export]
    use super::families::{Family, search_family};
    #[pymodule_export]
    use super::pose::Pose;
    #[pymodule_export]
    use super::programs::_run;
    #[pymodule_export]
    use super::rendering::{Truth, render};
    #[pymodule_export]
    use super::targets::{_target, Tag, Target};
    #[pymodule_export]
    use super::verdict::Verdict;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
