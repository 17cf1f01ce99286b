//! How far corners scatter about the smooth lattice that they lie in, against what their covariances say.
//!
//! A lens and a sheet are smooth, so high differences along the lines of a grid show nothing but errors:
//!
//! ```text
//!     δ⁴ = p₀ − 4 p₁ + 6 p₂ − 4 p₃ + p₄,      δ⁶ = p₀ − 6 p₁ + 15 p₂ − 20 p₃ + 15 p₄ − 6 p₅ + p₆
//! ```
//!
//! Of errors that are independent both tell the same variance. Where perspective or a lens leaves more in δ⁴, the two
//! disagree, and δ⁶ is no more than a bound. What no residual of a single corner tells shows here: a blur that is no
//! Gaussian leaves much and moves nothing, steps of grey values leave nothing and move much.

use super::by_vertex::ByVertex;
use super::detection::{Grid, GridCorner, median};
use crate::lattice::Vertex;

const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
const SIXTH: [f64; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];

/// Median of χ² of two degrees of freedom.
const MEDIAN_CHI2: f64 = 2.0 * std::f64::consts::LN_2;

/// Standard deviation of the logarithm of a median of n such, times √n; it is 1.44, and half of the differences
/// say the same as others.
const DEVIATION: f64 = 2.0;

/// A factor is believed that differs from 1 by so many deviations.
const SIGNIFICANT: f64 = 3.0;

/// Fewest differences that tell a factor of two.
const LEAST_DIFFERENCES: usize = 40;

/// Variances from fourth and sixth differences agree where they differ by no more than this factor.
const AGREEMENT: f64 = 1.4;

/// Factor of the covariances of a picture's grids.
pub fn factor(grids: &[Grid]) -> f64 {
    let (mut fourth, mut sixth) = (Vec::new(), Vec::new());
    for grid in grids {
        let corners = ByVertex::of(grid, |corner| corner);
        let steps = grid.kind.steps();
        for corner in &grid.corners {
            for &step in &steps[..steps.len() / 2] {
                fourth.extend(chi2(&corners, corner, step, FOURTH));
                sixth.extend(chi2(&corners, corner, step, SIXTH));
            }
        }
    }
    let count = sixth.len();
    let (Some(fourth), Some(sixth)) = (median(fourth), median(sixth)) else { return 1.0 };
    let [fourth, sixth] = [fourth, sixth].map(|chi2| chi2 / MEDIAN_CHI2);
    let agree = fourth.max(sixth) < AGREEMENT * fourth.min(sixth);
    let is_told = count >= LEAST_DIFFERENCES && (agree || sixth < 1.0);
    let is_significant = sixth.ln().abs() > SIGNIFICANT * DEVIATION / (count as f64).sqrt();
    if is_told && is_significant && sixth > 0.0 { sixth } else { 1.0 }
}

/// Square of the difference from a corner on along a line, over its covariance.
fn chi2<const N: usize>(
    corners: &ByVertex<&GridCorner>,
    corner: &GridCorner,
    step: Vertex,
    weights: [f64; N],
) -> Option<f64> {
    let mut at = Vertex::new(corner.row, corner.col);
    let ([mut x, mut y], [mut xx, mut xy, mut yy]) = ([0.0; 2], [0.0; 3]);
    for weight in weights {
        let corner = corners.get(at)?;
        let cov = corner.cov?;
        x += weight * corner.x;
        y += weight * corner.y;
        xx += weight * weight * cov[0];
        xy += weight * weight * cov[1];
        yy += weight * weight * cov[2];
        at = at + step;
    }
    Some((yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use crate::target::GridKind;

    /// A grid that scatters by 0.01 px and states this deviation, through a lens.
    fn seen(kind: GridKind, stated_px: f64, bend: f64, seed: u64) -> Grid {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let error = Normal::new(0.0, 0.01).unwrap();
        let corners = (0..120).map(|i| {
            let (row, col) = (i / 12, i % 12);
            let [x, y] = kind.position(row.into(), col.into()).map(|c| (c - 6.0) / 12.0);
            let depth = 1.0 + 0.3 * x - 0.2 * y;
            let [x, y] = [x / depth, y / depth];
            let radial = 1.0 / (1.0 + bend * (x * x + y * y));
            let [x, y] = [x, y].map(|c| 600.0 * c * radial + error.sample(&mut rng));
            let variance = stated_px * stated_px;
            GridCorner { row, col, id: None, x, y, cov: Some([variance, 0.0, variance]) }
        });
        Grid { kind, panel: None, mirrored: false, corners: corners.collect(), tags: Vec::new() }
    }

    #[test]
    fn scatter_tells_covariances_that_are_too_small_or_too_large() {
        for kind in [GridKind::Deltille, GridKind::Checker] {
            for seed in 0..20 {
                assert_eq!(factor(&[seen(kind, 0.01, 0.1, seed)]), 1.0, "{kind:?} {seed}");
                let small = factor(&[seen(kind, 0.01 / 3.0, 0.1, seed)]);
                assert!((5.0..16.0).contains(&small), "{kind:?} {seed}: {small}");
                let large = factor(&[seen(kind, 0.03, 0.1, seed)]);
                assert!((0.06..0.2).contains(&large), "{kind:?} {seed}: {large}");
            }
        }
    }

    #[test]
    fn what_a_lens_bends_is_no_scatter() {
        for kind in [GridKind::Deltille, GridKind::Checker] {
            for bend in [1.0, 3.0, 6.0] {
                assert_eq!(factor(&[seen(kind, 0.01, bend, 1)]), 1.0, "{kind:?} {bend}");
            }
        }
    }
}
