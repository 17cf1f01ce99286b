//! The covariance of the residuals of unchanged cameras, and the information about changes.
//!
//! ```text
//!   r = J u + ε,   u = (δθ, b, a)      r: residuals with the earlier parameters; the poses are eliminated
//!   δθ ~ N(0, V)                        errors of the earlier calibration
//!   b ~ N(0, α²), a ~ N(0, 1)           errors of single corners and of the sheets of the board
//!   ε ~ N(0, s²)                        errors of the corners in the images, whitened
//! ```

use nalgebra::{DMatrix, DVector};

use super::earlier::{Earlier, SAME_BOARD};
use super::views::{LOOSE, Views};
use crate::problem::camera_prior::inverted;
use crate::uncertainty::board_errors::{SHEET, accuracy, sheets};

/// Minimum assumed standard deviation of a corner of the board, mm, so that its inverse is finite.
const MIN_ACCURACY_MM: f64 = 1e-6;

/// The range of s² that is searched, and the number of bisections.
const VARIANCES: [f64; 2] = [1e-3, 1e3];
const HALVINGS: usize = 14;

/// The equations of all new views.
pub(super) struct Equations {
    /// JᵀJ.
    gram: DMatrix<f64>,
    /// Jᵀr.
    right: DVector<f64>,
    /// The inverse covariance of u.
    prior: DMatrix<f64>,
    /// s² times the excess of the earlier calibration's scatter over noise.
    variance: f64,
    /// The columns of the sheet of each panel except its scale, which the distance absorbs; the unit is an RMS
    /// displacement of this over √3.
    pub sheet: Vec<usize>,
    /// The assumed standard deviation of a corner of the board, √2 α, mm.
    pub board_mm: f64,
}

impl Equations {
    /// Forms the equations; `None` if a covariance has no inverse.
    pub(super) fn of(
        views: &Views,
        earlier: &Earlier,
        board_accuracy_mm: Option<f64>,
    ) -> Option<Self> {
        let (n, corners) = (earlier.unknowns.len(), 3 * views.map.len());
        let board_mm = accuracy(&views.map, board_accuracy_mm).unwrap_or(0.0);
        let board_mm = (SAME_BOARD.sqrt() * board_mm).max(MIN_ACCURACY_MM);
        let sheets = sheets(&views.map, &SHEET) * board_mm;
        let (count, all) = (sheets.ncols(), n + corners + sheets.ncols());
        let mut by_all = DMatrix::zeros(n + corners, all);
        by_all.fill_with_identity();
        by_all.view_mut((n, n + corners), (corners, count)).copy_from(&sheets);
        let gram = by_all.tr_mul(&(&views.gram * &by_all));
        let right = by_all.tr_mul(&views.right);
        let mut prior = DMatrix::identity(all, all);
        prior.view_mut((0, 0), (n, n)).copy_from(&inverted(&earlier.covariance)?);
        (n..n + corners).for_each(|i| prior[(i, i)] = board_mm.powi(-2));
        let is_sheet = |column: &usize| !(column - n - corners).is_multiple_of(SHEET.len());
        let sheet = (n + corners..all).filter(is_sheet).collect();
        let mut equations = Self { gram, right, prior, variance: 1.0, sheet, board_mm };
        let own = equations.variance_of(views, n)?;
        equations.variance = own.max(views.least) * earlier.excess;
        Some(equations)
    }

    /// s² from the residuals, with all changes that the loose prior permits.
    fn variance_of(&self, views: &Views, cameras: usize) -> Option<f64> {
        if views.freedom < 1.0 {
            return None;
        }
        let mut loose = self.prior.clone();
        loose.view_mut((0, 0), (cameras, cameras)).scale_mut(LOOSE.powi(-2));
        self.sheet.iter().for_each(|&i| loose[(i, i)] *= LOOSE.powi(-2));
        let [mut low, mut high] = VARIANCES.map(f64::ln);
        for _ in 0..HALVINGS {
            let variance = (0.5 * (low + high)).exp();
            let left = (&self.gram + &loose * variance).cholesky()?.solve(&self.right);
            let is_too_small = views.squares - left.dot(&self.right) > variance * views.freedom;
            *(if is_too_small { &mut low } else { &mut high }) = variance.ln();
        }
        Some(high.exp())
    }

    /// The information matrix D'J'C⁻¹JD and the score D'J'C⁻¹r of some directions D of u, where C is the covariance of
    /// the residuals of an unchanged camera.
    pub(super) fn information(&self, by: &DMatrix<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let along = &self.gram * by;
        let factor = (&self.gram + &self.prior * self.variance).cholesky()?;
        let solved = factor.solve(&along);
        let matrix = (by.tr_mul(&along) - along.tr_mul(&solved)) / self.variance;
        let score = (by.tr_mul(&self.right) - solved.tr_mul(&self.right)) / self.variance;
        Some(((&matrix + matrix.transpose()) * 0.5, score))
    }

    /// The information matrix D'V⁻¹D that any number of views would approach.
    pub(super) fn most_information(&self, by: &DMatrix<f64>) -> DMatrix<f64> {
        by.tr_mul(&(&self.prior * by))
    }

    /// Number of columns.
    pub(super) fn count(&self) -> usize {
        self.right.len()
    }
}
