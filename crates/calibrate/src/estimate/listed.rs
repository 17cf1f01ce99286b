//! Lists the unknowns by name, and selects their covariances.

use nalgebra::DMatrix;

use super::joint_covariance::{JointCovariance, JointUnknown};
use super::values::CameraEstimate;
use crate::equations::covariances::Covariances;
use crate::equations::minimise::Minimum;
use crate::input::calibration::Calibration;
use crate::matrix::Matrix;
use crate::problem::corner_map::CornerMap;
use crate::problem::shape;
use crate::start::frames::Frame;
use crate::uncertainty::agreement::Observed;
use deltille_core::camera::{Lens, PROJECTION_PARAMETERS};

const POSE: [(&str, &str); 6] =
    [("rx", "rad"), ("ry", "rad"), ("rz", "rad"), ("tx", "mm"), ("ty", "mm"), ("tz", "mm")];

const SHAPE: [&str; shape::COUNT] = ["b1", "b2", "b3", "b4", "b5", "b6", "b7", "a1", "a2"];

/// The unknowns with their columns in the equations.
struct Listed(Vec<(JointUnknown, usize)>);

impl Listed {
    fn add(&mut self, name: String, unit: &'static str, column: usize) {
        self.0.push((JointUnknown { name, unit }, column));
    }

    fn add_pose(&mut self, of: &str, first: Option<usize>) {
        let Some(first) = first else { return };
        for (column, (name, unit)) in (first..).zip(POSE) {
            self.add(format!("{of}.{name}"), unit, column);
        }
    }
}

/// The covariance of all unknowns for residuals of variance 1, if it was asked for and is not too large.
pub(super) fn covariance_of_all(
    calibration: &Calibration,
    minimum: &Minimum,
    found: &Covariances,
) -> Option<DMatrix<f64>> {
    let Minimum { normal, layout, problem, .. } = minimum;
    let corners = problem.map.as_ref().map_or(0, CornerMap::len);
    let count = layout.shared + 6 * problem.frames.len() + 3 * corners;
    let wanted = calibration.covariance_of_all && count <= JointCovariance::MOST_UNKNOWNS;
    wanted.then(|| normal.covariance_of_all(found)).flatten()
}

/// The covariances of the unknowns, from those of the columns of the equations. `all` is the covariance of all columns, if the poses
/// of frames and the offsets of corners are listed too. The observed covariances of single cameras may be larger than those of the
/// columns. `None` without unknowns.
pub(super) fn joint_covariance(
    calibration: &Calibration,
    minimum: &Minimum,
    cameras: &[CameraEstimate],
    frames: &[&Frame],
    noise: &DMatrix<f64>,
    of_all: Option<&DMatrix<f64>>,
    observed: Option<&Observed>,
) -> Option<JointCovariance> {
    let Minimum { layout, problem, .. } = minimum;
    let mut all = Listed(Vec::new());
    let mut firsts = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        firsts.push(all.0.len());
        for &(parameter, column) in &layout.parameters[index] {
            let name = &camera.parameters[parameter].name;
            all.add(format!("{}.{name}", camera.name), unit(camera, parameter), column);
        }
        all.add_pose(&camera.name, layout.cameras[index]);
    }
    for (index, first) in layout.panels.iter().enumerate() {
        all.add_pose(&format!("panel{index}"), *first);
    }
    for (target, first) in calibration.targets.iter().zip(&layout.targets) {
        all.add_pose(&format!("target.{}", target.name), *first);
    }
    for (column, name) in layout.shape.into_iter().flat_map(|first| (first..).zip(SHAPE)) {
        all.add(format!("board.{name}"), "mm", column);
    }
    let shared = all.0.len();
    if of_all.is_some() {
        let first = layout.frames.unwrap_or(layout.count);
        for (index, frame) in frames.iter().enumerate() {
            all.add_pose(&format!("frame.{}", frame.name), Some(first + 6 * index));
        }
        let first = layout.corners.unwrap_or(layout.count);
        let corners = problem.map.iter().flat_map(|map| &map.corners);
        for (index, corner) in corners.enumerate() {
            let name = format!("corner.{}.{}.{}", corner.panel, corner.row, corner.col);
            for (column, axis) in (first + 3 * index..).zip(["x", "y", "z"]) {
                all.add(format!("{name}.{axis}"), "mm", column);
            }
        }
    }
    let (unknowns, columns): (Vec<JointUnknown>, Vec<usize>) = all.0.into_iter().unzip();
    let of = |matrix: &DMatrix<f64>, n: usize| {
        DMatrix::from_fn(n, n, |i, j| matrix[(columns[i], columns[j])])
    };
    let of_frames = observed.map(|observed| {
        let mut covariance = of(&observed.covariance, shared);
        for (camera, first) in cameras.iter().zip(firsts) {
            let own = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
            if let Some(own) = own {
                let n = own.covariance.rows();
                covariance.view_mut((first, first), (n, n)).copy_from(own.covariance.inner());
            }
        }
        Matrix::new(covariance)
    });
    let noise = of(of_all.unwrap_or(noise), columns.len());
    (shared > 0).then(|| JointCovariance {
        unknowns,
        shared,
        noise: Matrix::new(noise),
        observed: of_frames,
        observed_freedom: observed.map(|observed| observed.freedom),
    })
}

/// The unit of a parameter of a camera.
fn unit(camera: &CameraEstimate, index: usize) -> &'static str {
    let is_shift = camera.parameters[index].name.starts_with('e');
    match &camera.camera.lens {
        _ if index < PROJECTION_PARAMETERS.len() => "px",
        Lens::Pupil(_) if is_shift => "mm",
        _ => "1",
    }
}
