//! Weights of corners: whitening of residuals by covariances and a common variance.

use glam::DVec2;

use super::bundle::Problem;
use super::unknowns::Block;
use crate::input::weights::Weights;
use deltille_core::statistics::median;

/// The median of a squared distance in the plane, for coordinates with variance 1: 2 ln 2.
pub(crate) const MEDIAN_OF_CHI_SQUARED_2: f64 = 1.386_294_361_119_890_6;

/// Number of bisections for the common standard deviation; they reach 1e-9 of the upper bound.
const HALVINGS: usize = 30;

/// Minimum standard deviation of residuals: far below that of any corner, so that exact data do not
/// divide by zero.
const MIN_SIGMA: f64 = 1e-6;

/// Limit of an outlier in standard deviations: four in a million corners with normal errors exceed it.
pub(crate) const OUTLIER_SIGMA: f64 = 5.0;

/// For each corner, the lower triangle a, b, c of W, with WᵀW = Σ⁻¹.
#[derive(Clone, Debug)]
pub(crate) struct Whitening {
    pub blocks: Vec<Vec<[f64; 3]>>,
    /// The common standard deviation in addition to the covariances, px; `None` if all corners have
    /// equal weight.
    pub common_px: Option<f64>,
    /// Standard deviation of a whitened coordinate, from the median.
    pub sigma: f64,
}

impl Whitening {
    /// W r.
    pub(crate) fn apply([a, b, c]: [f64; 3], DVec2 { x, y }: DVec2) -> DVec2 {
        DVec2::new(a * x, b * x + c * y)
    }

    /// Whether a corner is an outlier.
    pub(crate) fn is_outlier(&self, weight: [f64; 3], residual: DVec2) -> bool {
        let off = Self::apply(weight, residual);
        off.length() > self.outlier_limit()
    }

    /// The whitened distance beyond which a corner is an outlier.
    pub(crate) fn outlier_limit(&self) -> f64 {
        OUTLIER_SIGMA * self.sigma
    }

    /// Equal weights.
    fn equal(problem: &Problem, residuals: &[Vec<DVec2>]) -> Self {
        let mut whitening = Self { blocks: alike(problem), common_px: None, sigma: 1.0 };
        whitening.sigma = whitening.median_sigma(problem, residuals);
        whitening
    }

    /// Weights that fit the current residuals.
    pub(crate) fn fit(problem: &Problem, weights: Weights, residuals: &[Vec<DVec2>]) -> Self {
        let covariances = match weights {
            Weights::Equal => None,
            Weights::Covariance => covariances(problem),
        };
        let Some(covariances) = covariances else { return Self::equal(problem, residuals) };
        let with = |common: f64| {
            let blocks = triangles(&covariances, common);
            let mut whitening = Self { blocks, common_px: Some(common), sigma: 1.0 };
            whitening.sigma = whitening.median_sigma(problem, residuals);
            whitening
        };
        // Whether sigma exceeds 1: whether the median of rᵀ(Σ + c²)⁻¹r exceeds a limit.
        let limit = MEDIAN_OF_CHI_SQUARED_2 * left_free(problem);
        let is_too_small = |common: f64| {
            let all = covariances.iter().flatten().zip(residuals.iter().flatten());
            let count = all.clone().count();
            let within = all.filter(|&(&[xx, xy, yy], &DVec2 { x, y })| {
                let (xx, yy) = (xx + common * common, yy + common * common);
                x * x * yy - 2.0 * x * y * xy + y * y * xx <= limit * (xx * yy - xy * xy)
            });
            within.count() <= count / 2
        };
        if !is_too_small(0.0) {
            return with(0.0);
        }
        // With the standard deviation of all residuals as the common one, sigma is below 1.
        let (mut low, mut high) = (0.0, Self::equal(problem, residuals).sigma);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if is_too_small(middle) { &mut low } else { &mut high }) = middle;
        }
        with(high)
    }

    /// The same weights for other corners.
    pub(crate) fn of(&self, problem: &Problem) -> Self {
        let covariances = self.common_px.and_then(|common| Some((common, covariances(problem)?)));
        let blocks = match covariances {
            Some((common, covariances)) => triangles(&covariances, common),
            None => alike(problem),
        };
        Self { blocks, ..*self }
    }

    fn median_sigma(&self, problem: &Problem, residuals: &[Vec<DVec2>]) -> f64 {
        let whitened = self.blocks.iter().flatten().zip(residuals.iter().flatten());
        let squares = whitened.map(|(&w, &r)| Self::apply(w, r).length_squared());
        let square = median(squares.collect()).unwrap_or(0.0) / MEDIAN_OF_CHI_SQUARED_2;
        (square / left_free(problem)).sqrt().max(MIN_SIGMA)
    }
}

/// The fraction of the squared residuals that remains after fitting the unknowns. If the corners
/// are unknown, too, and there are few views, this fraction is small.
fn left_free(problem: &Problem) -> f64 {
    let Some(map) = &problem.map else { return 1.0 };
    let unknowns = map.determined + 6.0 * problem.frames.len() as f64;
    (1.0 - unknowns / (2.0 * problem.count().max(1) as f64)).max(MIN_FREE)
}

/// Minimum of that fraction, which is a quarter for two views of a corner.
const MIN_FREE: f64 = 0.25;

/// The covariances of all corners; `None` if no corner has one. If only some corners have a
/// covariance, the others were the hardest to refine and get the largest variance of all.
fn covariances(problem: &Problem) -> Option<Vec<Vec<[f64; 3]>>> {
    let all = || problem.blocks.iter().flat_map(|block| block.observations.iter());
    let largest = all().filter_map(|o| o.cov).map(|[xx, _, yy]| xx.max(yy)).fold(0.0, f64::max);
    let of = |block: &Block| {
        block.observations.iter().map(|o| o.cov.unwrap_or([largest, 0.0, largest])).collect()
    };
    (largest > 0.0).then(|| problem.blocks.iter().map(of).collect())
}

/// W for corners of equal accuracy.
fn alike(problem: &Problem) -> Vec<Vec<[f64; 3]>> {
    problem.blocks.iter().map(|block| vec![[1.0, 0.0, 1.0]; block.observations.len()]).collect()
}

/// W for covariances with a common standard deviation added.
fn triangles(covariances: &[Vec<[f64; 3]>], common: f64) -> Vec<Vec<[f64; 3]>> {
    let whiten = |cov: &[f64; 3]| triangle(*cov, common * common);
    covariances.iter().map(|block| block.iter().map(whiten).collect()).collect()
}

/// W for a covariance with `common` added to both variances.
fn triangle([xx, xy, yy]: [f64; 3], common: f64) -> [f64; 3] {
    // Σ = L Lᵀ with L = [[l, 0], [m, n]], W = L⁻¹.
    let l = (xx + common).sqrt();
    let m = xy / l;
    let n = (yy + common - m * m).sqrt();
    [1.0 / l, -m / (l * n), 1.0 / n]
}

/// Residuals (observed minus predicted positions), px, for each block; empty for a block with a
/// corner that its camera cannot image, which problems with valid initial values do not have.
pub(crate) fn residuals(problem: &Problem) -> Vec<Vec<DVec2>> {
    let of_block = |block| problem.residuals(block).collect::<Option<Vec<DVec2>>>();
    problem.blocks.iter().map(|block| of_block(block).unwrap_or_default()).collect()
}

/// Whitening with equal weights for all corners, and the standard deviation of their coordinates.
pub(crate) fn scale(problem: &Problem) -> Whitening {
    Whitening::fit(problem, Weights::Equal, &residuals(problem))
}

/// Length of the whitened residual of each corner; infinite where its camera cannot image it.
pub(crate) fn deviations(problem: &Problem, whitening: &Whitening) -> Vec<Vec<f64>> {
    let weights = whitening.of(problem).blocks;
    let of_block = |(block, weights): (&Block, &Vec<[f64; 3]>)| {
        let off = problem.residuals(block).zip(weights).map(|(off, &w)| {
            let off = Whitening::apply(w, off?);
            Some(off.length())
        });
        off.map(|off| off.unwrap_or(f64::INFINITY)).collect()
    };
    problem.blocks.iter().zip(&weights).map(of_block).collect()
}
