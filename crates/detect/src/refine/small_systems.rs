//! Solves small symmetric systems of equations whose sizes are known at compile time.
//!
//! An image needs a few thousand of them, with ten unknowns. Loops over arrays of fixed size
//! process whole rows at once.

#![allow(clippy::needless_range_loop, reason = "one index for two rows, so that vectors show")]

use multiversion::multiversion;

/// Solves N equations A X = B with a positive definite A. Rows (A | B) become (· | X). Returns `None` if A is not
/// positive definite.
#[multiversion(targets("x86_64+avx2"))]
pub fn solved<const N: usize, const W: usize>(mut rows: [[f64; W]; N]) -> Option<[[f64; W]; N]> {
    let mut inverses = [0.0; N];
    for i in 0..N {
        let (above, below) = rows.split_at_mut(i + 1);
        let first = &above[i];
        // NaN is not positive either.
        if first[i] > 0.0 {
            inverses[i] = 1.0 / first[i];
        } else {
            return None;
        }
        for row in below {
            let factor = row[i] * inverses[i];
            for k in 0..W {
                row[k] -= factor * first[k];
            }
        }
    }
    for i in (0..N).rev() {
        let (here, below) = rows.split_at_mut(i + 1);
        let row = &mut here[i];
        for (j, below) in below.iter().enumerate() {
            let factor = row[i + 1 + j];
            for k in N..W {
                row[k] -= factor * below[k];
            }
        }
        for k in N..W {
            row[k] *= inverses[i];
        }
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn solutions_are_those_of_a_cholesky_factor() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for _ in 0..50 {
            let root = SMatrix::<f64, 6, 6>::from_fn(|_, _| random.random_range(-1.0..1.0));
            let matrix = root * root.transpose() + SMatrix::identity() * 0.1;
            let right = SVector::<f64, 6>::from_fn(|_, _| random.random_range(-1.0..1.0));
            let rows: [[f64; 7]; 6] = std::array::from_fn(|i| {
                std::array::from_fn(|j| if j < 6 { matrix[(i, j)] } else { right[i] })
            });
            let expected = matrix.cholesky().unwrap().solve(&right);
            let found = solved(rows).unwrap();
            assert!((0..6).all(|i| (found[i][6] - expected[i]).abs() < 1e-9 * expected.norm()));
        }
    }

    #[test]
    fn indefinite_matrices_have_no_solution() {
        assert_eq!(solved([[1.0, 2.0, 1.0], [2.0, 1.0, 1.0]]), None);
        assert_eq!(solved([[f64::NAN, 0.0, 1.0], [0.0, 1.0, 1.0]]), None);
    }
}
