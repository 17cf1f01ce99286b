//! How sure a camera is of where it projects a point.
//!
//! Parameters alone do not say: a principal point that is one pixel off is made up for by a camera that is turned
//! a little, and no picture tells the two apart. So a change of the parameters goes with the motion of the camera
//! that explains the corners best that were seen, as in the cross-reprojection uncertainty of mrcal 3.0
//! (<https://mrcal.secretsauce.net/docs-3.0/uncertainty-cross-reprojection.html>):
//!
//! ```text
//!     min over ξ of Σ |W (J_θ δθ + J_ξ ξ)|²    over the corners:    ξ = K δθ,  K = −(Σ J_ξᵀWᵀW J_ξ)⁻¹ Σ J_ξᵀWᵀW J_θ
//!     covariance of a projection = (J_θ + J_ξ K) Σ_θ (J_θ + J_ξ K)ᵀ
//! ```
//!
//! with ξ = (ω, τ), a turn and a move of what the camera sees. At infinity τ moves nothing.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, Dyn, Matrix2, Matrix6, OMatrix, SMatrix, U2};

use crate::matrix::Matrix;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;
use deltille_core::camera::{Camera, Projection};
use deltille_core::statistics::median;

/// How the projections of a camera are known.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ProjectionUncertainty {
    /// K: the motion (ω in rad, τ in mm) of what the camera sees for a change of each parameter that was found.
    pub alignment: Matrix,
    /// How far the points are for which it is told, beside those at infinity, mm: what was asked for, else the
    /// median distance of the corners.
    pub distances_mm: Vec<f64>,
    /// Covariance of the parameters that were found as the frames agree with each other; `None` of too few
    /// frames.
    pub observed: Option<ObservedCovariance>,
}

/// A covariance of parameters as frames show it.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedCovariance {
    /// The covariance, in the order of the parameters that were found.
    pub covariance: Matrix,
    /// The part of it that comes from errors of the board, which are the same in every frame, and in every
    /// calibration with that board; `None` where the board is exact or its corners were found too.
    pub of_board: Option<Matrix>,
    /// How well it is known: a variance of it as from so many independent squares.
    pub freedom: f64,
}

impl ObservedCovariance {
    /// The covariance without the part that comes from errors of the board.
    pub fn without_board(&self) -> Matrix {
        match &self.of_board {
            Some(of_board) => Matrix::new(self.covariance.inner() - of_board.inner()),
            None => self.covariance.clone(),
        }
    }
}

/// Where a deviation comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The noise of the corners, if camera and target are what they are taken for.
    Noise,
    /// How far the frames agree with each other, whatever the cause, and what errors of the board do to all of
    /// them alike.
    Observed,
}

impl ProjectionUncertainty {
    /// As an earlier calibration found it.
    pub fn new(
        alignment: Matrix,
        distances_mm: Vec<f64>,
        observed: Option<ObservedCovariance>,
    ) -> Self {
        Self { alignment, distances_mm, observed }
    }

    /// Of a camera as its blocks show it; `free` are the parameters that were found. `None` where its motion is open.
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
            for (seen, &w) in block.observations.iter().zip(weights) {
                let point = problem.camera_point(block, seen);
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

/// A⁻¹ B of turns and moves, which have different units.
pub(crate) fn solved(a: &Matrix6<f64>, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale =
        SMatrix::<f64, 6, 1>::from_fn(|i, _| a[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = Matrix6::from_fn(|i, j| a[(i, j)] * scale[i] * scale[j]);
    let right = DMatrix::from_fn(6, b.ncols(), |i, j| b[(i, j)] * scale[i]);
    let solution = scaled.cholesky()?.solve(&right);
    Some(DMatrix::from_fn(6, b.ncols(), |i, j| solution[(i, j)] * scale[i]))
}

/// Derivatives of a pixel by a turn and a move of the point.
pub(crate) fn by_motion(at: &Projection, point: DVec3) -> SMatrix<f64, 2, 6> {
    let rows = at.by_point.map(DVec3::from);
    let turns = rows.map(|row| point.cross(row));
    SMatrix::from_fn(|i, j| if j < 3 { turns[i][j] } else { rows[i][j - 3] })
}

/// Derivatives of a pixel by some parameters.
pub(crate) fn by_parameters(at: &Projection, free: &[usize]) -> OMatrix<f64, U2, Dyn> {
    OMatrix::<f64, U2, Dyn>::from_fn(free.len(), |i, j| at.by_parameter(free[j])[i])
}

/// WᵀW of a pixel.
fn information([a, b, c]: [f64; 3]) -> Matrix2<f64> {
    Matrix2::new(a * a + b * b, b * c, b * c, c * c)
}

/// The point that a pixel shows so many mm away, or the direction to one at infinity.
pub(crate) fn seen_at(camera: &Camera, pixel: DVec2, distance_mm: Option<f64>) -> Option<DVec3> {
    let ray = camera.unproject(pixel)?;
    // A pupil that moves does so by millimetres.
    Some(match distance_mm {
        Some(distance) => ray.origin + ray.direction * distance,
        None => ray.direction * INFINITY_MM,
    })
}

/// Far enough for an entrance pupil's place, a few millimetres, to be none of a pixel's millionths.
pub(crate) const INFINITY_MM: f64 = 1e9;
