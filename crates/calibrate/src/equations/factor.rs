//! Solution of large equations with the factor of similar equations.
//!
//! From one step of an adjustment to the next, the reduced matrix S = A − B C⁻¹ Bᵀ hardly changes. Conjugate gradients
//! with the factor of an earlier S as preconditioner need a few products of S with a vector, and neither S nor its
//! factor.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::cholesky::cholesky;
use super::layout::Layout;
use super::normal::{LARGE, Normal, Reduced};
use super::step::Step;
use deltille_core::damping::Damping;

/// Number of parts whose coupling fits into the cache of a processor, if the equations are large.
const PARTS_IN_CACHE: usize = 16;

/// Relative accuracy of a step from the factor of similar equations, in standard deviations. Later steps correct the
/// error, and the last one is shorter than a standard deviation.
const ACCURACY: f64 = 1e-6;

/// Maximum number of iterations to this accuracy; more take longer than a factor. From one step to the next, five to
/// ten are needed.
const MAX_ITERATIONS: usize = 25;

/// The factor of symmetric equations after scaling of their diagonal to 1.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    scale: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl Factor {
    /// `None` if the equations have no unique solution.
    pub(super) fn of(mut matrix: DMatrix<f64>) -> Option<Self> {
        let scale = matrix.diagonal().map(|value| 1.0 / value.max(f64::MIN_POSITIVE).sqrt());
        for (j, mut column) in matrix.column_iter_mut().enumerate() {
            column.iter_mut().zip(&scale).for_each(|(value, row)| *value = *value * row * scale[j]);
        }
        Some(Self { scale, factor: cholesky(matrix)? })
    }

    pub(super) fn len(&self) -> usize {
        self.scale.len()
    }

    pub(super) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        if self.len() == 0 {
            return right.clone();
        }
        self.factor.solve(&right.component_mul(&self.scale)).component_mul(&self.scale)
    }
}

impl Normal {
    /// The Levenberg–Marquardt step: diagonals grow by the factor 1 + `damping`. `None` if the equations have no unique
    /// solution. For large equations, `factor` is the factor of similar equations, and is replaced by their own if it
    /// is not similar enough.
    pub(crate) fn step(
        &self,
        layout: &Layout,
        damping: Damping,
        factor: &mut Option<Factor>,
    ) -> Option<Step> {
        let inverses = self.inverses(damping)?;
        let near = factor.as_ref().filter(|factor| factor.len() == self.right.len());
        let kept = match near.and_then(|factor| self.solve_with(factor, damping, &inverses)) {
            Some(kept) => kept,
            None => {
                *factor = None;
                let Reduced { matrix, right, .. } = self.reduced(damping)?;
                let own = Factor::of(matrix)?;
                let kept = own.solve(&right);
                *factor = (kept.len() >= LARGE).then_some(own);
                kept
            }
        };
        let carried = self.b.tr_times(0..self.parts.len(), &kept);
        let parts = self.parts.iter().zip(inverses).enumerate();
        let parts = parts.map(|(index, (part, inverse))| {
            inverse * (&part.right - carried.rows(part.right.len() * index, part.right.len()))
        });
        let (frames, corners) = layout.split(&kept, &parts.collect::<Vec<_>>());
        let shared = kept.rows(0, self.shared).into_owned();
        let step = Step { shared, frames, corners };
        kept.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// Solves the reduced equations by conjugate gradients, with the factor of similar equations as preconditioner and
    /// without forming the reduced matrix; `None` if the equations are not similar enough.
    pub(super) fn solve_with(
        &self,
        factor: &Factor,
        damping: Damping,
        inverses: &[DMatrix<f64>],
    ) -> Option<DVector<f64>> {
        let of_parts = |parts: Range<usize>| {
            let rights = self.parts[parts].iter().flat_map(|part| part.right.iter().copied());
            DVector::from_vec(rights.collect())
        };
        let mut left = &self.right - self.carried(inverses, of_parts);
        let diagonal = self.a.diagonal().map(|value| damping.grown(value) - value);
        let times = |vector: &DVector<f64>| {
            let eliminated = self.carried(inverses, |parts| self.b.tr_times(parts, vector));
            &self.a * vector + diagonal.component_mul(vector) - eliminated
        };
        let mut kept = DVector::zeros(left.len());
        let mut solution = factor.solve(&left);
        let mut size = left.dot(&solution);
        let enough = size * ACCURACY * ACCURACY;
        let mut direction = solution;
        for _ in 0..MAX_ITERATIONS {
            if size <= enough {
                return Some(kept);
            }
            let along = times(&direction);
            let part = size / direction.dot(&along);
            kept.axpy(part, &direction, 1.0);
            left.axpy(-part, &along, 1.0);
            solution = factor.solve(&left);
            let next = left.dot(&solution);
            direction = solution + direction * (next / size);
            size = next;
        }
        None
    }

    /// B C⁻¹ v, for the rows v of some parts. The sum is in the order of the parts, so it does not depend on the number
    /// of threads.
    fn carried(
        &self,
        inverses: &[DMatrix<f64>],
        of_parts: impl Fn(Range<usize>) -> DVector<f64> + Sync,
    ) -> DVector<f64> {
        let count = self.parts.len();
        let firsts: Vec<usize> = (0..count).step_by(PARTS_IN_CACHE).collect();
        let terms = firsts.into_par_iter().map(|first| {
            let parts = first..(first + PARTS_IN_CACHE).min(count);
            let mut of_parts = of_parts(parts.clone());
            for (index, inverse) in inverses[parts.clone()].iter().enumerate() {
                let size = inverse.nrows();
                let mut own = of_parts.rows_mut(size * index, size);
                let solved = inverse * &own;
                own.copy_from(&solved);
            }
            self.b.times(parts, &of_parts)
        });
        let terms: Vec<DVector<f64>> = terms.collect();
        terms.iter().fold(DVector::zeros(self.right.len()), |sum, term| sum + term)
    }
}
