//! The uncertainty of projections of a camera.
//!
//! The covariance of the parameters alone does not give it: a slight rotation of the camera
//! compensates for a principal point that is off by one pixel, and no image distinguishes the two.
//! So a change of the parameters is combined with the motion of the camera that best explains the
//! detected corners, as in the cross-reprojection uncertainty of mrcal 3.0
//! (<https://mrcal.secretsauce.net/docs-3.0/uncertainty-cross-reprojection.html>):
//!
//! ```text
//!     min over ξ of Σ |W (J_θ δθ + J_ξ ξ)|²    over the corners:    ξ = K δθ,  K = −(Σ J_ξᵀWᵀW J_ξ)⁻¹ Σ J_ξᵀWᵀW J_θ
//!     covariance of a projection = (J_θ + J_ξ K) Σ_θ (J_θ + J_ξ K)ᵀ
//! ```
//!
//! with ξ = (ω, τ), a rotation and a translation of the scene. At infinity τ has no effect.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, Dyn, Matrix2, Matrix6, OMatrix, SMatrix, U2};

use crate::matrix::Matrix;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;
use deltille_core::camera::{Camera, Projection};
use deltille_core::statistics::median;

/// The uncertainty of the projections of a camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ProjectionUncertainty {
    /// K: the motion of the scene (ω in rad, τ in mm) per change of each estimated parameter.
    pub alignment: Matrix,
    /// Distances for which it is reported in addition to infinity, mm: the requested ones, or by
    /// default the median distance of the corners.
    pub distances_mm: Vec<f64>,
    /// Observed covariance of the estimated parameters, from the scatter between frames; `None` with too few frames.
    pub observed: Option<ObservedCovariance>,
}

/// A covariance of parameters from the scatter between frames.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedCovariance {
    /// The covariance, in the order of the estimated parameters.
    pub covariance: Matrix,
    /// The part from errors of the board, which are the same in every frame and in every calibration with that board;
    /// `None` if the board is exact or its corners were estimated too.
    pub of_board: Option<Matrix>,
    /// Degrees of freedom of its variances.
    pub freedom: f64,
}

impl ObservedCovariance {
    /// The covariance without the part from errors of the board.
    pub fn without_board(&self) -> Matrix {
        match &self.of_board {
            Some(of_board) => Matrix::new(self.covariance.inner() - of_board.inner()),
            None => self.covariance.clone(),
        }
    }
}

/// The source of a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The noise of the corners, for an exact model of camera and target.
    Noise,
    /// The scatter between frames, from any cause, and the effect of errors of the board, which all
    /// frames have in common.
    Observed,
}

impl ProjectionUncertainty {
    /// Restores the uncertainty from an earlier calibration.
    pub fn new(
        alignment: Matrix,
        distances_mm: Vec<f64>,
        observed: Option<ObservedCovariance>,
    ) -> Self {
        Self { alignment, distances_mm, observed }
    }

    /// Computes it from the blocks of a camera; `free` are the estimated parameters. `None` if its motion is
    /// undetermined.
    pub(crate) fn of(
        problem: &Problem,
        whitening: &Whitening,
        camera: usize,
        free: &[usize],
        distances_mm: &[f64],
        observed: Option<ObservedCovariance>,
    ) -> Option<Self> {
        let lens = &problem.cameras[camera].camera;
        let mut motion = Matrix6::zeros();
        let mut across = DMatrix::zeros(6, free.len());
        let mut distances = Vec::new();
        let blocks = problem.blocks.iter().zip(&whitening.blocks);
        for (block, weights) in blocks.filter(|(block, _)| block.camera == camera) {
            for (point, &w) in problem.camera_points(block).zip(weights) {
                let Some(at) = lens.project_with_derivatives(point) else { continue };
                let pull = by_motion(&at, point).transpose() * information(w);
                motion += pull * by_motion(&at, point);
                across += pull * by_parameters(&at, free);
                distances.push(point.length());
            }
        }
        let distances_mm = match distances_mm {
            [] => vec![median(distances)?],
            asked => asked.to_vec(),
        };
        Some(Self { alignment: Matrix::new(-solved(&motion, &across)?), distances_mm, observed })
    }
}

/// A⁻¹ B for rotations and translations, which have different units.
pub(crate) fn solved(a: &Matrix6<f64>, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale =
        SMatrix::<f64, 6, 1>::from_fn(|i, _| a[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = Matrix6::from_fn(|i, j| a[(i, j)] * scale[i] * scale[j]);
    let right = DMatrix::from_fn(6, b.ncols(), |i, j| b[(i, j)] * scale[i]);
    let solution = scaled.cholesky()?.solve(&right);
    Some(DMatrix::from_fn(6, b.ncols(), |i, j| solution[(i, j)] * scale[i]))
}

/// Derivatives of a pixel with respect to a rotation and a translation of the point.
pub(crate) fn by_motion(at: &Projection, point: DVec3) -> SMatrix<f64, 2, 6> {
    let rows = at.by_point.map(DVec3::from);
    let rotations = rows.map(|row| point.cross(row));
    SMatrix::from_fn(|i, j| if j < 3 { rotations[i][j] } else { rows[i][j - 3] })
}

/// Derivatives of a pixel with respect to some parameters.
pub(crate) fn by_parameters(at: &Projection, free: &[usize]) -> OMatrix<f64, U2, Dyn> {
    OMatrix::<f64, U2, Dyn>::from_fn(free.len(), |i, j| at.by_parameter(free[j])[i])
}

/// WᵀW for a pixel.
fn information([a, b, c]: [f64; 3]) -> Matrix2<f64> {
    Matrix2::new(a * a + b * b, b * c, b * c, c * c)
}

/// The point seen at a pixel at a distance, or its direction for infinity.
pub(crate) fn seen_at(camera: &Camera, pixel: DVec2, distance_mm: Option<f64>) -> Option<DVec3> {
    let ray = camera.unproject(pixel)?;
    // A moving pupil shifts by millimetres.
    Some(match distance_mm {
        Some(distance) => ray.origin + ray.direction * distance,
        None => ray.direction * INFINITY_MM,
    })
}

/// Distance that counts as infinity, mm: the position of an entrance pupil, a few millimetres, shifts a pixel by less
/// than a millionth.
pub(crate) const INFINITY_MM: f64 = 1e9;
