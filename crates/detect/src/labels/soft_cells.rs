//! Soft decisions on the cells of a tag from the pixels of its tile. Linear Bayesian estimation under a known point
//! spread function gives the log-odds of all cells from all samples at once.
//!
//! Let the border be 0 and white 1. A sample at p is the sum of the cells c, weighted by their share W in its blurred
//! neighbourhood, plus the white beyond the border. With s = ±1 for white and black cells,
//!
//! ```text
//!     x(p) = ½ Σ W(p,c) (1 + s(c)) + white(p) + error of the levels + noise
//!     m    = K (x − ½ Σ W − white),     K = (WᵀW/σ² + 1)⁻¹ Wᵀ/σ²
//! ```
//!
//! is the posterior mean of s, v its variance, and m/v half the log-odds that the cell is white. Errors of the grey
//! levels are linear over the tile. They are additional unknowns, solved together with the cells.
//!
//! The shares depend only on the blur in tile coordinates, which neighbouring tiles share, and so do successive images.
//! So K is computed once for each blur, and each tile costs one multiplication.
//!
//! Limitations: cells are treated as independent, although wide blur correlates their errors; see `joint_cells`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::DVec2;
use multiversion::multiversion;
use nalgebra::{DMatrix, Matrix2, Vector2};

use super::cell_odds::{Mixing, Sample};
use super::grid_blur::GridBlur;
use super::joint_cells::{JointModel, JointOdds, RandomWords};
use crate::lanes::LANES;
use crate::refine::blurred_corner::{erf_sqrt_half, exp_negative, swept_edge};
use deltille_core::lattice::{GridKind, TagCells};

/// Subdivision of a cell: a triangle has 3² parts, a square twice as many.
const DIVISIONS: usize = 3;

/// Standard deviation of the added blur, bit-widths: about the size of a part of a cell, which is represented by its
/// centre.
const PART_BLUR_BITS: f64 = 0.14;

/// Step between distinct blurs, in log variance: a seventh of their standard deviation.
const LOG_VARIANCE_STEP: f64 = 0.3;

/// Step between distinct correlations of the blur: a fifth.
const CORRELATION_STEP: f64 = 0.2;

/// Step between distinct motions, bit-widths. It changes the standard deviation of the blur as little as the steps above.
const WAY_STEP_BITS: f64 = 0.25;

/// Step between distinct variances of samples, as a logarithm: a tenth of their standard deviation.
const LOG_NOISE_STEP: f64 = 0.2;

/// Number of mixings that are kept; one takes 20 to 100 kB.
const MAX_MIXINGS: usize = 256;

/// Half of a motion, in σ of the blur, that is ignored: it adds 0.3 % to the blur.
const MIN_WAY_SIGMAS: f64 = 0.1;

/// Standard deviation of a sample due to model errors, relative to the contrast: positions, shape
/// of the blur, dirt.
const MODEL_ERROR: f64 = 0.05;

/// Number of pixels over which an interpolated sample averages the noise: 1 / (2/3)².
const SAMPLE_PX2: f64 = 2.25;

/// Factor of the noise variance of a sample. Black, white and the width of the blur are measured with the same noise.
const NOISE_WEIGHT: f64 = 1.5;

/// Largest correlation of a blur in tile coordinates: the centre of the interval that is rounded to
/// 1, because no covariance has a correlation of 1.
const MAX_CORRELATION: f64 = 0.95;

/// Largest number of cells.
const MAX_CELLS: usize = 64;

/// Minimum variance of a cell. With less, its odds exceed `MAX_HALF_ODDS` of `cell_odds` anyway.
const MIN_VARIANCE: f64 = 1e-3;

/// Standard deviation of the grey levels, relative to the contrast.
const LEVEL_ERROR: f64 = 0.15;

/// Standard deviation of their slopes over a tile.
const SLOPE_ERROR: f64 = 0.2;

/// Number of unknowns in addition to the cells: the level and its slopes along u and v.
const LEVELS: usize = 3;

/// Sample positions of the cells, and the geometry by which blur mixes cells.
#[derive(Clone, Debug)]
pub(crate) struct CellModel {
    kind: GridKind,
    bits: usize,
    /// Edge length of the tile, bit-widths.
    width: f64,
    /// Distance from the tile's edges to the border of the tag, bit-widths.
    margin_bits: f64,
    /// Sample positions, in tile coordinates.
    points: Vec<DVec2>,
    /// Parts of the cells: each has one in every cell.
    parts: Vec<Part>,
    /// Words with which those of blurred tags are compared.
    random: OnceLock<RandomWords>,
    /// Mixings that were computed before, by quantised blur.
    mixings: Arc<Mutex<BTreeMap<[i32; 6], Arc<Mixing>>>>,
}

/// Centres of one part of every cell, bit-widths along u and v, by bit; zeros up to whole vectors.
#[derive(Clone, Debug)]
struct Part {
    u: Vec<f32>,
    v: Vec<f32>,
}

/// The density of a blur relative to its maximum; with motion, its mean over the motion.
#[derive(Clone, Copy, Debug)]
struct Kernel {
    /// Inverse covariance uu, uv, vv, 1/bit-widths².
    inverse: [f32; 3],
    /// Component along the motion of an offset, in σ of the blur: its factors for u and v.
    along: [f32; 2],
    /// Half of the motion, in σ of the blur.
    reach: f32,
}

/// Blur in tile coordinates, and noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileBlur {
    /// Covariance uu, uv, vv of its Gaussian part, bit-widths².
    pub covariance: [f64; 3],
    /// Half of the motion along a line, bit-widths.
    pub way: DVec2,
    /// Area of a squared bit-width of tile coordinates, px².
    pub area_px2: f64,
    /// Standard deviation of a sample, relative to the contrast.
    pub noise: f64,
}

impl CellModel {
    /// Creates a model for tags. Their cells begin `inset_bits` from the edges of the tile, and their border
    /// `margin_bits`, in bit-widths.
    pub(crate) fn new(cells: &TagCells, inset_bits: f64, margin_bits: f64) -> Self {
        let bits = cells.dimension().bits();
        let points = (0..bits).flat_map(|bit| {
            let centre = cells.centre(bit, inset_bits);
            let corners = cells.corners(bit, inset_bits);
            let half_way = move |corner: DVec2| corner.midpoint(centre);
            std::iter::once(centre).chain(corners.into_iter().map(half_way))
        });
        let width = cells.width(inset_bits);
        let of_cells: Vec<Vec<DVec2>> =
            (0..bits).map(|bit| parts_of(&cells.corners(bit, inset_bits))).collect();
        let part = |part: usize| {
            let [mut u, mut v] =
                [(); 2].map(|()| vec![0.0; of_cells.len().next_multiple_of(LANES)]);
            for (bit, centres) in of_cells.iter().enumerate() {
                [u[bit], v[bit]] = (width * centres[part]).as_vec2().to_array();
            }
            Part { u, v }
        };
        let parts = (0..of_cells.first().map_or(0, Vec::len)).map(part);
        Self {
            kind: cells.kind(),
            bits: bits as usize,
            width,
            margin_bits,
            points: points.collect(),
            parts: parts.collect(),
            random: OnceLock::new(),
            mixings: Arc::default(),
        }
    }

    fn random(&self) -> &RandomWords {
        self.random.get_or_init(|| RandomWords::new(self.bits))
    }

    /// Returns the sample positions of a tile, in tile coordinates.
    pub(crate) fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Returns the sample positions, each with the bit of its cell.
    pub(crate) fn points_by_bit(&self) -> impl Iterator<Item = (usize, &DVec2)> {
        let of_cell = self.points.len() / self.bits;
        self.points.iter().enumerate().map(move |(i, point)| (i / of_cell, point))
    }

    /// Returns the edge length of the tile, bit-widths.
    pub(crate) fn width(&self) -> f64 {
        self.width
    }

    /// Returns the joint odds of the words of a tile, if its cells are not known one by one and all samples are measured.
    pub(crate) fn joint_odds(&self, mixing: &Mixing, samples: &[Sample]) -> Option<JointOdds> {
        let joint = mixing.joint.as_ref()?;
        let off_middle: Option<Vec<f32>> = samples
            .iter()
            .zip(&mixing.middle)
            .map(|(sample, middle)| match sample {
                Sample::Share(share) => Some(share - middle),
                Sample::AtLeast(_) | Sample::Erased => None,
            })
            .collect();
        Some(joint.odds(&off_middle?, self.random()))
    }

    /// Returns the mixing for a blur, rounded to a few per cent so that equal ones recur. Returns `None` if the equations
    /// cannot be solved.
    pub(crate) fn mixing(&self, blur: TileBlur) -> Option<Arc<Mixing>> {
        let [uu, uv, vv] = blur.covariance;
        // Isotropic on the print. Steps along u and v are 60° apart, so uu = vv = 1/sin² 60° and uv = −cos 60° of that.
        let [puu, puv] = match self.kind {
            GridKind::Deltille => [4.0 / 3.0, -2.0 / 3.0],
            GridKind::Checker => [1.0, 0.0],
        };
        let part = PART_BLUR_BITS * PART_BLUR_BITS;
        let (uu, uv, vv) = (uu + part * puu, uv + part * puv, vv + part * puu);
        // The noise of samples that are denser than pixels is correlated.
        let samples_px2 =
            self.points.len() as f64 / (self.bits as f64 * self.cell_area() * blur.area_px2);
        let variance = NOISE_WEIGHT * blur.noise * blur.noise * (SAMPLE_PX2 * samples_px2).max(1.0)
            + MODEL_ERROR * MODEL_ERROR * samples_px2.max(1.0);
        let key = [
            (uu.ln() / LOG_VARIANCE_STEP).round() as i32,
            (vv.ln() / LOG_VARIANCE_STEP).round() as i32,
            (uv / (uu * vv).sqrt() / CORRELATION_STEP).round() as i32,
            (blur.way.x / WAY_STEP_BITS).round() as i32,
            (blur.way.y / WAY_STEP_BITS).round() as i32,
            (variance.ln() / LOG_NOISE_STEP).round() as i32,
        ];
        let known = || self.mixings.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(mixing) = known().get(&key) {
            return Some(Arc::clone(mixing));
        }
        let [uu, vv] = [key[0], key[1]].map(|k| (f64::from(k) * LOG_VARIANCE_STEP).exp());
        let correlation =
            (f64::from(key[2]) * CORRELATION_STEP).clamp(-MAX_CORRELATION, MAX_CORRELATION);
        let covariance = [uu, correlation * (uu * vv).sqrt(), vv];
        let way = WAY_STEP_BITS * DVec2::new(f64::from(key[3]), f64::from(key[4]));
        let variance = (f64::from(key[5]) * LOG_NOISE_STEP).exp();
        let mixing = Arc::new(self.make(covariance, way, variance)?);
        let mut known = known();
        if known.len() >= MAX_MIXINGS {
            known.clear();
        }
        known.insert(key, Arc::clone(&mixing));
        Some(mixing)
    }

    /// Computes the mixing for a blur with this covariance and half of a motion, and for samples of this variance.
    fn make(&self, covariance: [f64; 3], way: DVec2, variance: f64) -> Option<Mixing> {
        let [uu, uv, vv] = covariance;
        let determinant = uu * vv - uv * uv;
        if determinant <= 0.0 || determinant.is_nan() {
            return None;
        }
        let inverse = [vv / determinant, -uv / determinant, uu / determinant];
        let pull = DVec2::new(
            inverse[0] * way.x + inverse[1] * way.y,
            inverse[1] * way.x + inverse[2] * way.y,
        );
        let reach = pull.dot(way).sqrt();
        let reach = if reach < MIN_WAY_SIGMAS { 0.0 } else { reach };
        let along = if reach > 0.0 { pull / reach } else { DVec2::ZERO };
        let kernel = Kernel {
            inverse: inverse.map(|part| part as f32),
            along: along.as_vec2().to_array(),
            reach: reach as f32,
        };
        let (n, bits) = (self.points.len(), self.bits);
        let mut design = DMatrix::<f64>::zeros(n, bits + LEVELS);
        let part_area = self.cell_area() / self.parts.len() as f64;
        let gain = part_area / (std::f64::consts::TAU * determinant.sqrt());
        for (i, point) in self.points.iter().enumerate() {
            let sums = sums_by_cell(&self.parts, (self.width * point).as_vec2().to_array(), kernel);
            for bit in 0..bits {
                design[(i, bit)] = 0.5 * gain * f64::from(sums[bit]);
            }
            design[(i, bits)] = LEVEL_ERROR;
            let off_middle = point - self.kind.middle();
            design[(i, bits + 1)] = SLOPE_ERROR * off_middle.x;
            design[(i, bits + 2)] = SLOPE_ERROR * off_middle.y;
        }
        let white = |&p: &DVec2| self.white_beyond(p, covariance, way);
        let white: Vec<f64> = self.points.iter().map(white).collect();
        let mut normal = design.tr_mul(&design) / variance;
        for i in 0..bits + LEVELS {
            normal[(i, i)] += 1.0;
        }
        let inverse = normal.cholesky()?.inverse();
        let of_cell = |c: usize| (-0.5 * inverse[(c, c)].ln()).min(std::f64::consts::LN_2);
        let [cells, levels] =
            [design.columns(0, bits), design.columns(bits, LEVELS)].map(|part| part.clone_owned());
        let of_cells = (0..bits).map(of_cell).sum();
        let joint = JointModel::new(&cells, &levels, variance, of_cells, || self.random());
        let gain = &inverse * design.transpose() / variance;
        let half_shares: Vec<Vec<f32>> =
            (0..n).map(|i| (0..bits).map(|c| design[(i, c)] as f32).collect()).collect();
        let middle =
            (0..n).map(|i| (white[i] + (0..bits).map(|c| design[(i, c)]).sum::<f64>()) as f32);
        let row = |c: usize| (0..n).map(|i| gain[(c, i)] as f32).collect();
        let inverse_variance = |c: usize| (1.0 / inverse[(c, c)].max(MIN_VARIANCE)) as f32;
        let spread =
            half_shares.iter().map(|row| row.iter().map(|w| w * w).sum::<f32>().sqrt()).collect();
        Some(Mixing {
            bits,
            middle: middle.collect(),
            gain: (0..bits).map(row).collect(),
            half_shares,
            inverse_variance: (0..bits).map(inverse_variance).collect(),
            spread,
            joint: joint.map(Arc::new),
        })
    }

    /// Returns the area of a cell in squared bit-widths of the coordinates.
    fn cell_area(&self) -> f64 {
        match self.kind {
            GridKind::Deltille => 0.5,
            GridKind::Checker => 1.0,
        }
    }

    /// Returns the share of the white around the border in a sample.
    fn white_beyond(&self, point: DVec2, [uu, uv, vv]: [f64; 3], way: DVec2) -> f64 {
        let beyond = |inside_bits: f64, variance: f64, way: f64| {
            let sigmas = |bits: f64| (bits / variance.sqrt()) as f32;
            0.5 - 0.5 * f64::from(swept_edge(sigmas(inside_bits), sigmas(way)))
        };
        let (margin, width) = (self.margin_bits, self.width);
        let DVec2 { x: u, y: v } = point * width;
        let (in_u, in_v) = (|u| beyond(u - margin, uu, way.x), |v| beyond(v - margin, vv, way.y));
        let far = match self.kind {
            GridKind::Deltille => beyond(width - u - v - margin, uu + 2.0 * uv + vv, way.x + way.y),
            GridKind::Checker => in_u(width - u) + in_v(width - v),
        };
        (in_u(u) + in_v(v) + far).min(1.0)
    }
}

/// Returns the sum of the kernel at the parts of each cell, by bit, for a sample at this position in bit-widths.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn sums_by_cell(parts: &[Part], [u, v]: [f32; 2], kernel: Kernel) -> [f32; MAX_CELLS] {
    let Kernel { inverse: [uu, uv, vv], along: [along_u, along_v], reach } = kernel;
    let mut sums = [0.0; MAX_CELLS];
    for part in parts {
        for ((sum, part_u), part_v) in sums.iter_mut().zip(&part.u).zip(&part.v) {
            let (du, dv) = (u - part_u, v - part_v);
            let square = uu * du * du + 2.0 * uv * du * dv + vv * dv * dv;
            *sum += if reach == 0.0 {
                exp_negative(-0.5 * square)
            } else {
                let along = along_u * du + along_v * dv;
                let across = (square - along * along).max(0.0);
                exp_negative(-0.5 * across) * mean_bell(along, reach)
            };
        }
    }
    sums
}

/// Returns the mean of exp(−x²/2) over `reach` on each side.
#[inline(always)]
fn mean_bell(x: f32, reach: f32) -> f32 {
    /// √(π/2)/2.
    const SCALE: f32 = 0.626_657_07;
    SCALE * (erf_sqrt_half(x + reach) - erf_sqrt_half(x - reach)) / reach
}

/// Returns the centres of the equal triangles into which a cell is divided.
fn parts_of(cell: &[DVec2]) -> Vec<DVec2> {
    let third = 1.0 / (3.0 * DIVISIONS as f64);
    let rows = (0..DIVISIONS).flat_map(|j| (0..DIVISIONS - j).map(move |i| (i, j)));
    let parts: Vec<DVec2> = rows
        .flat_map(|(i, j)| {
            let upright = [3 * i + 1, 3 * j + 1];
            let inverted = (i + j + 1 < DIVISIONS).then_some([3 * i + 2, 3 * j + 2]);
            [Some(upright), inverted].into_iter().flatten()
        })
        .map(|part| DVec2::from(part.map(|thirds| thirds as f64)) * third)
        .collect();
    let a = cell[0];
    let triangles = cell[1..].windows(2);
    let middles = triangles.flat_map(|bc| {
        let (to_b, to_c) = (bc[0] - a, bc[1] - a);
        parts.iter().map(move |part| a + part.x * to_b + part.y * to_c)
    });
    middles.collect()
}

/// Converts a blur to tile coordinates whose unit steps along u and v are the vectors `a` and `b`, px.
pub(crate) fn in_tile(blur: &GridBlur, [a, b]: [DVec2; 2], noise: f64) -> Option<TileBlur> {
    let ([xx, xy, yy], way) = (blur.covariance_px2, blur.way_px);
    let jacobian = Matrix2::new(a.x, b.x, a.y, b.y);
    let area_px2 = jacobian.determinant().abs();
    let inverse = jacobian.try_inverse()?;
    let covariance = Matrix2::new(xx, xy, xy, yy);
    let mapped = inverse * covariance * inverse.transpose();
    let way = inverse * Vector2::new(way.x, way.y);
    let (covariance, way) =
        ([mapped[(0, 0)], mapped[(0, 1)], mapped[(1, 1)]], DVec2::new(way.x, way.y));
    Some(TileBlur { covariance, way, area_px2, noise })
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use deltille_core::lattice::Dimension;

    const MARGIN_BITS: f64 = 0.5;
    const INSET_BITS: f64 = 1.5;

    /// Returns whether a polygon of either winding contains a point.
    fn has(polygon: &[DVec2], point: DVec2) -> bool {
        let side = |i: usize| {
            let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            (b - a).perp_dot(point - a) > 0.0
        };
        (1..polygon.len()).all(|i| side(i) == side(0))
    }

    /// Returns the printed value of a tag at a point of its tile: 1 is white.
    fn drawn(cells: &TagCells, word: u64, point: DVec2) -> f32 {
        let DVec2 { x: u, y: v } = point;
        let (width, margin) = (cells.width(INSET_BITS), MARGIN_BITS);
        let far = match cells.kind() {
            GridKind::Deltille => width * (1.0 - u - v),
            GridKind::Checker => width * (1.0 - u).min(1.0 - v),
        };
        if (width * u.min(v)).min(far) < margin {
            return 1.0;
        }
        let bit =
            (0..cells.dimension().bits()).find(|&bit| has(&cells.corners(bit, INSET_BITS), point));
        bit.map_or(0.0, |bit| f32::from(u8::from(word >> bit & 1 == 1)))
    }

    /// Returns random samples of a tag under a blur that is isotropic on the print, and half of a motion, bit-widths.
    fn seen<R: Rng>(
        model: &CellModel,
        cells: &TagCells,
        word: u64,
        (bits, way): (f64, DVec2),
        rng: &mut R,
    ) -> Vec<Sample> {
        let (width, noise) = (cells.width(INSET_BITS), StandardNormal);
        let share = |&point: &DVec2, rng: &mut R| {
            let mut sum = 0.0;
            for _ in 0..400 {
                let [a, b]: [f64; 2] = [0; 2].map(|_| noise.sample(rng));
                let off = match cells.kind() {
                    // Steps along u and v are 60° apart.
                    GridKind::Deltille => DVec2::new(a - b / 3f64.sqrt(), 2.0 * b / 3f64.sqrt()),
                    GridKind::Checker => DVec2::new(a, b),
                };
                let moved: f64 = rng.random_range(-1.0..1.0);
                sum += drawn(cells, word, point + (off * bits + moved * way) / width);
            }
            Sample::Share(sum / 400.0)
        };
        model.points().iter().map(|point| share(point, rng)).collect()
    }

    fn blur(kind: GridKind, bits: f64, way: DVec2) -> TileBlur {
        let variance = bits * bits;
        let covariance = match kind {
            GridKind::Deltille => [4.0 / 3.0, -2.0 / 3.0, 4.0 / 3.0].map(|of| of * variance),
            GridKind::Checker => [variance, 0.0, variance],
        };
        TileBlur { covariance, way, area_px2: 16.0, noise: 0.05 }
    }

    /// The model reads tags that are rendered and blurred independently of it. Under weak blur, all
    /// cells are correct. Under strong blur or motion, the number of wrong cells does not exceed the
    /// prediction of the odds.
    #[test]
    fn cell_errors_match_the_odds() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let cells = TagCells::of(kind, Dimension::from_bits(25).unwrap());
            let model = CellModel::new(&cells, INSET_BITS, MARGIN_BITS);
            let still = [0.25, 0.8, 1.1].map(|bits| (bits, DVec2::ZERO));
            let moved = [(0.3, DVec2::new(1.25, 0.5)), (0.3, DVec2::new(-1.0, 2.0))];
            for (bits, way) in still.into_iter().chain(moved) {
                let mixing = model.mixing(blur(kind, bits, way)).unwrap();
                let (mut wrong, mut expected) = (0, 0.0);
                for _ in 0..40 {
                    let word = rng.random::<u64>() & cells.dimension().mask();
                    let odds = mixing.half_odds(&seen(&model, &cells, word, (bits, way), &mut rng));
                    for (bit, half) in odds.iter().enumerate() {
                        wrong += usize::from((*half > 0.0) != (word >> bit & 1 == 1));
                        expected += 1.0 / (1.0 + (2.0 * half.abs()).exp());
                    }
                }
                assert!(
                    wrong as f32 <= 1.2 * expected,
                    "{kind:?}, {bits}, {way}: {wrong}, expected {expected}"
                );
                assert!(bits >= 0.3 || wrong == 0, "{kind:?}: {wrong} wrong under weak blur");
            }
        }
    }

    /// Erased samples contain no information, and a lower bound contains no more information than
    /// the value itself.
    #[test]
    fn unseen_cells_stay_unknown() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let cells = TagCells::of(GridKind::Deltille, Dimension::from_bits(16).unwrap());
        let model = CellModel::new(&cells, INSET_BITS, MARGIN_BITS);
        let mixing = model.mixing(blur(cells.kind(), 0.4, DVec2::ZERO)).unwrap();
        let samples = seen(&model, &cells, 0b1010_0110_0011_0101, (0.4, DVec2::ZERO), &mut rng);
        let nothing = mixing.half_odds(&vec![Sample::Erased; samples.len()]);
        assert!(nothing.iter().all(|half| half.abs() < 1e-6), "{nothing:?}");
        let at_least = |sample: &Sample| match *sample {
            Sample::Share(share) => Sample::AtLeast(share),
            other => other,
        };
        let bounds: Vec<Sample> = samples.iter().map(at_least).collect();
        let (seen, bounded) = (mixing.half_odds(&samples), mixing.half_odds(&bounds));
        let sure =
            |odds: &[f32]| odds.iter().filter(|half| **half < 0.0).map(|half| -half).sum::<f32>();
        assert!(sure(&bounded) < sure(&seen), "a lower bound determines black");
    }
}
