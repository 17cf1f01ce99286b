//! Diagnoses of a calibration, and its views with their residuals.

use std::collections::BTreeMap;
use std::sync::Arc;

use deltille::calibrate::{self as solver, ViewEstimate};
use deltille::layout::Printing;
use deltille::targets;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::pickled::{Part, pickled};
use super::solved::Solved;
use crate::boundary::arrays::{self, record};
use crate::boundary::errors;
use crate::pickles;
use crate::see::pose::Pose;

/// A finding about a calibration, with its remedy.
#[pyclass(frozen, module = "deltille", eq)]
#[derive(PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    pub record: serde_json::Value,
    pub is_failure: bool,
}

#[pymethods]
impl Diagnosis {
    /// The kind, such as ``"lack_of_fit"``.
    #[getter]
    fn kind(&self) -> &str {
        self.record["kind"].as_str().unwrap_or_default()
    }

    /// The sentence.
    #[getter]
    fn sentence(&self) -> String {
        errors::one_line(&self.record["text"].as_str().unwrap_or_default())
    }

    /// Whether the calibration failed and must not be used.
    #[getter]
    fn is_failure(&self) -> bool {
        self.is_failure
    }

    /// All values by name, as in the file of the calibration.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        record(py, &self.record)
    }

    fn __str__(&self) -> String {
        self.sentence()
    }

    fn __repr__(&self) -> String {
        format!("<Diagnosis {}: {}>", self.kind(), self.sentence())
    }
}

impl Excluded {
    /// Reads a record of a calibration file.
    pub fn read(record: &serde_json::Value) -> Self {
        let text = |field: &str| record[field].as_str().map(str::to_owned);
        let number = |field: &str| record[field].as_u64();
        Self {
            view: text("view").unwrap_or_default(),
            camera: text("camera"),
            image: text("image").unwrap_or_default(),
            panel: number("panel").map(|panel| panel as u32),
            corners: number("corners").unwrap_or(0) as usize,
            reason: errors::one_line(&text("reason").unwrap_or_default()),
        }
    }
}

pickles!(Diagnosis);

/// An excluded view, frame or panel, and why.
#[pyclass(frozen, get_all, module = "deltille", eq)]
#[derive(PartialEq, Serialize, Deserialize)]
pub struct Excluded {
    /// Name of the view, or of the frame of a rig.
    pub view: String,
    /// Name of the camera in a rig; ``None`` for all cameras.
    pub camera: Option<String>,
    /// Name of the image; empty for images of several cameras.
    pub image: String,
    /// Id of the inconsistent panel; ``None`` if the whole view is excluded.
    pub panel: Option<u32>,
    /// Number of excluded corners.
    pub corners: usize,
    /// The reason.
    pub reason: String,
}

pickles!(Excluded);

#[pymethods]
impl Excluded {
    fn __repr__(&self) -> String {
        format!("<Excluded {}: {}>", self.view, self.reason)
    }
}

/// A view with the pose of the target in it and the residuals of its N corners.
#[pyclass(frozen, module = "deltille")]
pub struct View {
    pub solved: Arc<Solved>,
    pub camera: usize,
    pub view: usize,
}

/// Returns the ids of corners on the targets by panel, row and column.
pub fn corner_ids(targets: &[Printing]) -> BTreeMap<(usize, i32, i32), i64> {
    let panels = targets.iter().flat_map(|printing| &printing.target.panels).enumerate();
    let of_panel = |(index, panel): (usize, &targets::Panel)| {
        let id = |corner: &targets::Corner| ((index, corner.row, corner.col), i64::from(corner.id));
        panel.corners.iter().map(id).collect::<Vec<_>>()
    };
    panels.flat_map(of_panel).collect()
}

/// Implements the arrays of all corners of some views.
macro_rules! residual_arrays {
    ($class:ident, $self:ident => $views:expr, $solved:expr) => {
        #[pymethods]
        impl $class {
            /// Residuals of the corners, N × 2, float64, px: detected minus predicted position.
            #[getter]
            fn residuals<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| corner.residual.to_array()))
            }

            /// Detected positions of the corners, N × 2, float64, px.
            #[getter]
            fn pixels<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| corner.pixel.to_array()))
            }

            /// Ids of the corners on the target, N, int64; −1 if the target is not known.
            #[getter]
            fn ids<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
                let ids = $crate::calibrate::views::corner_ids(&$solved.targets);
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                let id = |c: &solver::Corner| ids.get(&(c.panel.index(), c.row, c.col)).copied();
                arrays::column(py, corners.map(|corner| id(corner).unwrap_or(-1)))
            }

            /// Lattice rows and columns of the corners, N × 2, int64.
            #[getter]
            fn labels<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray2<i64>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::rows(py, corners.map(|corner| [corner.row.into(), corner.col.into()]))
            }

            /// Whether each corner is an outlier, N, bool: its residual is larger than noise explains.
            #[getter]
            fn outliers<'py>(&$self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                let corners = $views.iter().flat_map(|view: &ViewEstimate| &view.corners);
                arrays::column(py, corners.map(|corner| corner.outlier))
            }
        }
    };
}
pub(crate) use residual_arrays;

residual_arrays!(View, self => std::slice::from_ref(self.estimate()), self.solved);

impl View {
    fn estimate(&self) -> &ViewEstimate {
        &self.solved.estimate.cameras[self.camera].views[self.view]
    }
}

#[pymethods]
impl View {
    /// Name of the view.
    #[getter]
    fn name(&self) -> &str {
        &self.estimate().name
    }

    /// File name of its image.
    #[getter]
    fn image(&self) -> &str {
        &self.estimate().image
    }

    /// Pose of the target: camera from target.
    #[getter]
    fn pose(&self) -> Pose {
        Pose(self.estimate().pose)
    }

    /// Standard deviations of the target's pose in the frame of the rig, or of the single camera, 6, float64: a rotation
    /// about the frame's axes (rad) and a translation (mm).
    #[getter]
    fn pose_sd<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let frame = self.solved.estimate.frames.get(self.estimate().frame);
        arrays::column(py, frame.map_or([f64::NAN; 6], |frame| frame.pose_sd))
    }

    /// Reprojection error, px: RMS per axis.
    #[getter]
    fn rms_px(&self) -> f64 {
        self.estimate().rms_px
    }

    fn __len__(&self) -> usize {
        self.estimate().corners.len()
    }

    fn __eq__(&self, other: &Self) -> bool {
        (self.camera, self.view) == (other.camera, other.view) && self.solved.is_same(&other.solved)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> crate::Reduced<'py, Part> {
        let own = slf.get();
        let (restore, (json, targets)) = pickled(slf.py(), "_part", &own.solved)?;
        Ok((restore, (json, targets, own.camera, Some(own.view))))
    }

    fn __repr__(&self) -> String {
        let view = self.estimate();
        format!("<View {}: {} corners, rms {:.4} px>", view.name, view.corners.len(), view.rms_px)
    }
}
