use std::ops::Index;

use nalgebra::DMatrix;

/// Rounding errors of correlations, which files may have in nine digits.
const ROUNDED: f64 = 1e-6;

/// A matrix in a result, such as a covariance.
///
/// ```
/// use deltille_calibrate::Matrix;
///
/// let covariance = Matrix::from_fn(2, 2, |row, column| if row == column { 0.25 } else { 0.0 });
/// assert_eq!((covariance.rows(), covariance[(1, 1)].sqrt()), (2, 0.5));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix(DMatrix<f64>);

impl Matrix {
    /// Creates a matrix from a function of row and column.
    pub fn from_fn(rows: usize, columns: usize, entry: impl FnMut(usize, usize) -> f64) -> Self {
        Self(DMatrix::from_fn(rows, columns, entry))
    }

    /// A matrix without rows, for unknown values.
    pub(crate) fn empty() -> Self {
        Self(DMatrix::zeros(0, 0))
    }

    pub(crate) fn new(inner: DMatrix<f64>) -> Self {
        Self(inner)
    }

    pub(crate) fn inner(&self) -> &DMatrix<f64> {
        &self.0
    }

    pub(crate) fn into_inner(self) -> DMatrix<f64> {
        self.0
    }

    /// Whether it is symmetric and positive semidefinite up to rounding errors, after scaling by its diagonal; a row without
    /// variance must be zero.
    pub fn is_covariance(&self) -> bool {
        let n = self.0.nrows();
        let scale = |i: usize| if self.0[(i, i)] == 0.0 { 1.0 } else { self.0[(i, i)].sqrt() };
        let of = |i: usize, j: usize| self.0[(i, j)] / (scale(i) * scale(j));
        let is_symmetric = (0..n).all(|i| (0..i).all(|j| (of(i, j) - of(j, i)).abs() < ROUNDED));
        let lifted = DMatrix::from_fn(n, n, |i, j| of(i, j) + if i == j { ROUNDED } else { 0.0 });
        self.0.ncols() == n && is_symmetric && lifted.cholesky().is_some()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.0.nrows()
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.0.ncols()
    }
}

/// The entry of a row and a column.
impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, at: (usize, usize)) -> &f64 {
        &self.0[at]
    }
}
