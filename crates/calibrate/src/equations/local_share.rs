//! The contribution of one frame to the unknowns that all frames share, computed in the subspace of
//! the unknowns that it touches.
//!
//! A frame touches only a few knots of a spline. With V the covariance of all shared unknowns, H
//! the part of the normal equations that the frame contributes, which is zero outside the rows and
//! columns t that it touches, and V_tt = G Gᵀ,
//!
//! ```text
//!     W H Wᵀ = Q (Gᵀ H_tt G) Qᵀ,    Q = W_t G⁻ᵀ,  QᵀQ = 1        for any W with WᵀW = V
//! ```
//!
//! so that the non-zero eigenvalues of W H Wᵀ are those of a small matrix.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The eigenvalues and eigenvectors of a frame's contribution.
pub(crate) struct LocalShare {
    touched: Vec<usize>,
    /// Standard deviations of the touched unknowns; `root` is the Cholesky factor of their
    /// correlations.
    sd: DVector<f64>,
    root: Cholesky<f64, Dyn>,
    /// Eigenvalues of Gᵀ H_tt G: the fraction of the information about a direction that the frame
    /// contributes.
    pub parts: DVector<f64>,
    directions: DMatrix<f64>,
}

impl LocalShare {
    /// Computes it from a frame's H (`own`, n × n, non-zero only in rows and columns of unknowns
    /// that it touches) and V (`covariance`, n × n). `None` if V is singular in these rows and
    /// columns.
    pub(crate) fn of(own: &DMatrix<f64>, covariance: &DMatrix<f64>) -> Option<Self> {
        let touched: Vec<usize> = (0..own.nrows()).filter(|&i| own[(i, i)] > 0.0).collect();
        let n = touched.len();
        let sd = DVector::from_fn(n, |i, _| covariance[(touched[i], touched[i])].sqrt());
        let correlations =
            DMatrix::from_fn(n, n, |i, j| covariance[(touched[i], touched[j])] / (sd[i] * sd[j]));
        let root = correlations.cholesky()?;
        let own = DMatrix::from_fn(n, n, |i, j| own[(touched[i], touched[j])] * sd[i] * sd[j]);
        let lower = root.l();
        let eigen = (lower.tr_mul(&own) * &lower).symmetric_eigen();
        Some(Self { touched, sd, root, parts: eigen.eigenvalues, directions: eigen.eigenvectors })
    }

    /// The components of Qᵀ W g along the eigenvectors, for a gradient g (`pull`, length n) that is
    /// zero outside the unknowns that the frame touches.
    pub(crate) fn along(&self, pull: &DVector<f64>) -> DVector<f64> {
        let own = DVector::from_fn(self.touched.len(), |i, _| pull[self.touched[i]] * self.sd[i]);
        self.directions.tr_mul(&self.root.l().tr_mul(&own))
    }

    /// The sum Q E a of the eigenvectors E with the components a, where W is the transpose of
    /// `half`.
    pub(crate) fn spread(&self, components: &DVector<f64>, half: &DMatrix<f64>) -> DVector<f64> {
        let turned = &self.directions * components;
        let Some(mut own) = self.root.l().tr_solve_lower_triangular(&turned) else {
            return DVector::zeros(half.ncols());
        };
        own.component_div_assign(&self.sd);
        let mut whole = DVector::zeros(half.nrows());
        self.touched.iter().zip(own.iter()).for_each(|(&i, value)| whole[i] = *value);
        half.tr_mul(&whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Results equal those of the whole matrices.
    #[test]
    fn the_share_in_a_subspace_equals_that_of_all_unknowns() {
        let n = 7;
        let any = |i: usize, j: usize| (((i * 31 + j * 17) % 13) as f64 - 6.0) / 7.0;
        let half = DMatrix::from_fn(n, n, |i, j| any(i, j) + if i == j { 2.0 } else { 0.0 });
        let covariance = &half * half.transpose();
        let rows = DMatrix::from_fn(4, 3, |i, j| any(i + 3, j + 5));
        let mut own = DMatrix::zeros(n, n);
        own.view_mut((2, 2), (3, 3)).copy_from(&(rows.tr_mul(&rows) * 0.01));
        let mut pull = DVector::zeros(n);
        pull.rows_mut(2, 3).copy_from(&DVector::from_vec(vec![0.3, -1.0, 0.7]));
        let whole = (half.tr_mul(&own) * &half).symmetric_eigen();
        let grown = |part: f64| (1.0 - part).sqrt().recip();
        let turned = whole.eigenvectors.tr_mul(&half.tr_mul(&pull));
        let expected = &whole.eigenvectors * turned.component_mul(&whole.eigenvalues.map(grown));
        let share = LocalShare::of(&own, &covariance).unwrap();
        let more = share.along(&pull).component_mul(&share.parts.map(|part| grown(part) - 1.0));
        let found = half.tr_mul(&pull) + share.spread(&more, &half);
        assert!((found - expected).amax() < 1e-10);
    }
}
