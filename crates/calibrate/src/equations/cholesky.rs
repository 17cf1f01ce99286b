//! Factors, inverses and products of symmetric matrices by blocks of columns.
//!
//! nalgebra factors and inverts column by column, which reads a matrix larger than the caches from
//! memory once for each column. With blocks, nearly all work consists of matrix products, which
//! read it once for each block.

use nalgebra::{Cholesky, DMatrix, DMatrixViewMut, Dyn};
use rayon::prelude::*;

/// Number of columns of a block.
const WIDTH: usize = 64;

/// The first column and the number of columns of each block.
fn blocks(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).step_by(WIDTH).map(move |first| (first, WIDTH.min(n - first)))
}

/// The Cholesky factor of a symmetric matrix, of which only the lower triangle is read; `None` if it is not positive
/// definite.
pub(super) fn cholesky(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let n = matrix.nrows();
    for (first, count) in blocks(n) {
        let (before, mut own) = matrix.columns_range_pair_mut(..first, first..first + count);
        let across = before.rows(first, count).transpose();
        own.rows_mut(first, n - first).gemm(-1.0, &before.rows(first, n - first), &across, 1.0);
        let factor = own.rows(first, count).into_owned().cholesky()?.unpack();
        own.rows_mut(first, count).copy_from(&factor);
        let mut below = own.rows_mut(first + count, n - first - count);
        let mut turned = below.transpose();
        factor.solve_lower_triangular_mut(&mut turned);
        below.tr_copy_from(&turned);
    }
    Some(Cholesky::pack_dirty(matrix))
}

/// The inverse of a symmetric matrix from its factor L.
pub(super) fn inverse(factor: Cholesky<f64, Dyn>) -> DMatrix<f64> {
    squared(&inverse_of_factor(factor))
}

/// The inverse of a lower triangular factor.
pub(super) fn inverse_of_factor(factor: Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let mut root = factor.unpack();
    for (first, count) in blocks(root.nrows()) {
        let (above, mut own) = root.rows_range_pair_mut(..first, first..first + count);
        let across = own.columns(0, first).into_owned();
        let own_lower = own.columns(first, count).into_owned();
        own.columns_mut(0, first).gemm(-1.0, &across, &above.columns(0, first), 0.0);
        own.columns_mut(first, count).fill_with_identity();
        own_lower.solve_lower_triangular_mut(&mut own.columns_mut(0, first + count));
    }
    root
}

/// AᵀA of a lower triangular matrix A.
pub(super) fn squared(lower: &DMatrix<f64>) -> DMatrix<f64> {
    let n = lower.nrows();
    let turned = lower.transpose();
    let mut square = DMatrix::zeros(n, n);
    for (first, count) in blocks(n) {
        let mut own = square.view_mut((first, first), (n - first, count));
        let left = turned.view((first, first), (n - first, n - first));
        own.gemm(1.0, &left, &lower.view((first, first), (n - first, count)), 0.0);
    }
    square.fill_upper_triangle_with_lower_triangle();
    square
}

/// Subtracts the product of two matrices, which must be symmetric, from the blocks on and below the
/// diagonal of a matrix.
pub(super) fn subtract_product(
    matrix: &mut DMatrix<f64>,
    left: &DMatrix<f64>,
    right: &DMatrix<f64>,
) {
    let n = matrix.nrows();
    if n == 0 {
        return;
    }
    let some = matrix.as_mut_slice().par_chunks_mut(n * WIDTH).enumerate();
    some.for_each(|(index, some)| {
        let (first, count) = (index * WIDTH, some.len() / n);
        let mut own = DMatrixViewMut::from_slice(some, n, count);
        let mut own = own.rows_mut(first, n - first);
        own.gemm(-1.0, &left.rows(first, n - first), &right.columns(first, count), 1.0);
    });
}

/// The product of the lower triangle of a symmetric matrix, with half of its diagonal, with another matrix. With L this
/// triangle, XᵀSX = XᵀLX + (XᵀLX)ᵀ takes half as long as from S.
pub(super) fn half_product(symmetric: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let n = symmetric.nrows();
    let mut product = DMatrix::zeros(n, right.ncols());
    for (first, count) in blocks(n) {
        let mut own = product.rows_mut(first, count);
        let left = symmetric.view((first, 0), (count, first));
        own.gemm(1.0, &left, &right.rows(0, first), 0.0);
        let mut lower = symmetric.view((first, first), (count, count)).lower_triangle();
        (0..count).for_each(|i| lower[(i, i)] *= 0.5);
        own.gemm(1.0, &lower, &right.rows(first, count), 1.0);
    }
    product
}

/// Copies the blocks of a symmetric matrix from below its diagonal to above it.
pub(super) fn fill_upper_blocks(matrix: &mut DMatrix<f64>) {
    let n = matrix.nrows();
    for (first, count) in blocks(n) {
        let (after, others) = (first + count, n - first - count);
        let below = matrix.view((after, first), (others, count)).transpose();
        matrix.view_mut((first, after), (count, others)).copy_from(&below);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Results equal those of nalgebra for one block, several blocks, and several blocks plus a
    /// partial one.
    #[test]
    fn factors_and_inverses_equal_those_of_nalgebra() {
        for n in [0, 1, WIDTH, 3 * WIDTH, 3 * WIDTH + 7] {
            let any = |i: usize, j: usize| ((i * 31 + j * 17) % 103) as f64 / 103.0 - 0.5;
            let half = DMatrix::from_fn(n, n + 5, any);
            let mut matrix = DMatrix::identity(n, n);
            subtract_product(&mut matrix, &-&half, &half.transpose());
            fill_upper_blocks(&mut matrix);
            let whole = DMatrix::identity(n, n) + &half * half.transpose();
            assert!(
                (&matrix - &whole).iter().fold(0.0, |most: f64, v| most.max(v.abs())) < 1e-12,
                "product of {n}"
            );
            let (found, expected) = (cholesky(matrix.clone()).unwrap(), whole.cholesky().unwrap());
            assert!(
                (found.l() - expected.l()).iter().fold(0.0, |most: f64, v| most.max(v.abs()))
                    < 1e-11,
                "factor of {n}"
            );
            let product = half.tr_mul(&half_product(&matrix, &half));
            let off = &product + product.transpose() - half.tr_mul(&(&matrix * &half));
            assert!(
                off.iter().fold(0.0, |most: f64, v| most.max(v.abs())) < 1e-9 * (1 + n * n) as f64,
                "half product of {n}"
            );
            let off = inverse(found) - expected.inverse();
            assert!(
                off.iter().fold(0.0, |most: f64, v| most.max(v.abs())) < 1e-11,
                "inverse of {n}"
            );
        }
    }
}
