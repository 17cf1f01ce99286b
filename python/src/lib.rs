//! The Python package `deltille`, a thin layer over the library: converts arguments and results.
//!
//! Input: a call from Python with arrays, paths and keywords. Output: a class of the package, arrays, or an exception.
//!
//! 1. `boundary` converts values and errors.
//! 2. `targets` makes, writes and verifies targets.
//! 3. `see` renders targets and detects them in images.
//! 4. `calibrate` calibrates cameras and rigs from detections, and compares them.
//! 5. `programs` runs `deltille` and `deltag`.
//!
//! `_core`, below, lists the names visible in Python.

#![allow(unreachable_pub, reason = "Python is the only user of this interface")]

mod boundary;
mod calibrate;
mod programs;
mod see;
mod targets;

use pyo3::prelude::*;

/// The result of `__reduce__`: a function that restores a value, and its arguments.
type Reduced<'py, A> = PyResult<(Bound<'py, PyAny>, A)>;

/// Makes a class of plain data picklable, as JSON.
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
    use super::calibrate::accepting::{Acceptance, accept_of};
    #[pymodule_export]
    use super::calibrate::calibrated_camera::{_part, CalibratedCamera};
    #[pymodule_export]
    use super::calibrate::calibration::{_calibration, _rig, Calibration, Rig};
    #[pymodule_export]
    use super::calibrate::checking::{Check, QuantityTest, Suspect, check_of};
    #[pymodule_export]
    use super::calibrate::comparison::{
        _located, Comparison, Located, Motion, compare, compare_rigs, pose_of,
    };
    #[pymodule_export]
    use super::calibrate::joint_covariance::JointCovariance;
    #[pymodule_export]
    use super::calibrate::keywords::{calibrate, rig};
    #[pymodule_export]
    use super::calibrate::next_view::{NextView, next_view};
    #[pymodule_export]
    use super::calibrate::robots::{HandEye, hand_eye_of};
    #[pymodule_export]
    use super::calibrate::timing::{CameraTiming, Timing, timing_of};
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
    use super::see::frames::{Frame, FrameIterator, Frames, frames_of};
    #[pymodule_export]
    use super::see::pose::Pose;
    #[pymodule_export]
    use super::see::rendering::{Truth, render};
    #[pymodule_export]
    use super::see::tracker::Tracker;
    #[pymodule_export]
    use super::see::undistortion::{
        _rectification, _undistortion, Rectification, Undistortion, rectify, undistort,
    };
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
