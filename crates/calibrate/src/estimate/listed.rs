//! Lists the shared unknowns by name, and selects their covariances.

use nalgebra::DMatrix;

use super::shared::{SharedCovariance, SharedUnknown};
use super::values::CameraEstimate;
use crate::equations::layout::Layout;
use crate::input::calibration::Calibration;
use crate::matrix::Matrix;
use crate::problem::shape;
use crate::uncertainty::agreement::Observed;
use deltille_core::camera::{Lens, PROJECTION_PARAMETERS};

const POSE: [(&str, &str); 6] =
    [("rx", "rad"), ("ry", "rad"), ("rz", "rad"), ("tx", "mm"), ("ty", "mm"), ("tz", "mm")];

const SHAPE: [&str; shape::COUNT] = ["b1", "b2", "b3", "b4", "b5", "b6", "b7", "a1", "a2"];

/// The unknowns with their columns in the equations.
struct Listed(Vec<(SharedUnknown, usize)>);

impl Listed {
    fn add(&mut self, name: String, unit: &'static str, column: usize) {
        self.0.push((SharedUnknown { name, unit }, column));
    }

    fn add_pose(&mut self, of: &str, first: Option<usize>) {
        let Some(first) = first else { return };
        for (column, (name, unit)) in (first..).zip(POSE) {
            self.add(format!("{of}.{name}"), unit, column);
        }
    }
}

/// The covariances of the shared unknowns, from those of the columns of the equations. The observed covariances of single
/// cameras may be larger than those of the columns. `None` without unknowns.
pub(super) fn shared(
    calibration: &Calibration,
    layout: &Layout,
    cameras: &[CameraEstimate],
    noise: &DMatrix<f64>,
    observed: Option<&Observed>,
) -> Option<SharedCovariance> {
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
    let (unknowns, columns): (Vec<SharedUnknown>, Vec<usize>) = all.0.into_iter().unzip();
    let n = columns.len();
    let of =
        |matrix: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| matrix[(columns[i], columns[j])]);
    let of_frames = observed.map(|observed| {
        let mut covariance = of(&observed.covariance);
        for (camera, first) in cameras.iter().zip(firsts) {
            let own = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
            if let Some(own) = own {
                let n = own.covariance.rows();
                covariance.view_mut((first, first), (n, n)).copy_from(own.covariance.inner());
            }
        }
        Matrix::new(covariance)
    });
    (n > 0).then(|| SharedCovariance {
        unknowns,
        noise: Matrix::new(of(noise)),
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
