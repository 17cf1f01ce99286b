//! The information of the corners about the first camera and the board. It is the basis of proposed
//! views.

use nalgebra::DMatrix;

use crate::adjust::reweighting::Settled;
use crate::equations::covariances::Covariances;
use crate::problem::camera_prior::inverted;
use crate::problem::shape::COUNT as SHAPE_COEFFICIENTS;
use deltille_core::statistics::median;

/// The information about the unknowns of one camera and about the shape of the board.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KnownSoFar {
    /// Inverse covariance of the estimated parameters, then of the shape.
    pub information: DMatrix<f64>,
    /// Median variance of a corner per axis, px².
    pub corner_variance_px2: f64,
}

/// The information about the first camera and the board's shape, after elimination of all other
/// shared unknowns.
pub(crate) fn known_so_far(
    settled: &Settled,
    found: &Covariances,
    variance: f64,
) -> Option<KnownSoFar> {
    let Settled { minimum, whitening, .. } = settled;
    let layout = &minimum.layout;
    let of_camera = layout.parameters.first()?.iter().map(|&(_, column)| column);
    let of_shape = layout.shape.into_iter().flat_map(|first| first..first + SHAPE_COEFFICIENTS);
    let columns: Vec<usize> = of_camera.chain(of_shape).collect();
    let n = columns.len();
    let information = match n == layout.shared {
        true => found.root.inverse.tr_mul(&found.root.inverse),
        false => {
            let of = |i: usize, j: usize| found.shared[(columns[i], columns[j])];
            // Equal parameters have a correlation of 1.
            inverted(&DMatrix::from_fn(n, n, of))?
        }
    };
    // W is triangular: the determinant of WᵀW is the square of its diagonal's product.
    let corners = whitening.blocks.iter().flatten().map(|[a, _, c]| 1.0 / (a * c));
    let corner_variance_px2 = variance * median(corners.collect())?;
    Some(KnownSoFar { information: information / variance, corner_variance_px2 })
}
