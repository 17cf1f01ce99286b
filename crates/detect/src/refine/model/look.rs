//! Effect of the optics on a corner: the same for all of its pixels, and computed once.

use super::corner::{Corner, MIN_BLUR_PX};
use crate::refine::blurred_corner::{Halo, Haloed, Orthant, WithPixel};
use crate::refine::displaced_edges::{Displaced, Parted, Triangle, WithSpot, WithTriangle};
use crate::refine::optics::{INK_UNIT, Optics};
use crate::refine::pattern::PAIRS;
use deltille_core::detection::Piece;

/// Effect of the optics on a corner with K edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look<const K: usize> {
    /// Sines and cosines of the angles.
    pub(super) rotations: [(f64, f64); K],
    /// 1/s_k, 1/px.
    pub(super) sharpness: [f64; K],
    /// ∂ ln s_k/∂θ_k.
    pub(super) by_turn: [f64; K],
    /// Correlation of the blur along the normals of each pair of edges.
    pub(super) correlations: [Correlation; PAIRS.len()],
    /// ∂ ln s_k/∂e of both parameters of astigmatism, and of the cross.
    pub(super) by_shape: [[f64; K]; 3],
    /// A sixth of the skewness across each edge, and its derivatives with respect to the angle and to the skewness
    /// along rows and columns.
    pub(super) skewness: [f64; K],
    pub(super) skewness_by_turn: [f64; K],
    pub(super) by_skewness: [[f64; K]; 2],
    /// Deviation of a pixel's box from a Gaussian, across each edge.
    pub(super) pixel: [PixelBox; K],
    /// Tone curve between black and white.
    pub(super) piece: Piece,
    /// Strength of the halo, and its width relative to the blur.
    pub(super) halo: [f32; 2],
    /// ∂ ln s/∂α of the blur of the pattern, at a constant slope of the edges.
    pub(super) core_by_halo: f32,
    /// Half of the motion across the edges during exposure, in units of the blur, if there is
    /// motion. Also its derivatives with respect to the angles, to both parameters of astigmatism,
    /// and to the cross.
    pub(super) way: Option<[f32; K]>,
    pub(super) way_by_turn: [f64; K],
    pub(super) way_by_shape: [[f64; K]; 3],
    /// Displacement of the edges by ink, in units of the blur, and its derivatives with respect to the ink. With three
    /// edges, both halves move to the same side, and with two, to opposite sides.
    pub(super) displaced: [f64; K],
    pub(super) by_ink: [f64; K],
    /// The darkest and the brightest value that the sensor can show.
    pub(super) limits: [f32; 2],
}

/// Correlation ρ of the blur along the normals of two edges, and its derivatives with respect to their angles to both
/// parameters of astigmatism, and to the cross, on which it does not depend.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Correlation {
    pub(super) rho: f64,
    pub(super) by_angle: [f64; 2],
    pub(super) by_shape: [f64; 3],
}

/// The strength of [`WithPixel`] across an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelBox {
    /// c.
    pub(super) strength: f64,
    /// −∂c/∂ln s_k, and ∂c/∂θ_k at constant s_k.
    pub(super) by_sharpness: f64,
    pub(super) by_turn: f64,
}

impl PixelBox {
    const NONE: Self = Self { strength: 0.0, by_sharpness: 0.0, by_turn: 0.0 };

    /// The factor of 1/s² in [`Self::of`], px².
    const STRONGER_PX2: f64 = 0.093;

    /// Returns the strength for an edge at this angle. The fourth cumulant of the box, −(n_x⁴ + n_y⁴)/120 px⁴, gives 1/(2880 s⁴)
    /// for rows and columns, and the factor 1 + 0.093/s² replaces all further terms. A corner with edges along rows and columns
    /// is then wrong by at most 0.015 px under a box alone, and by 0.003 px under a box and a Gaussian of 0.15 px (tests).
    /// Without the term, these are 0.15 and 0.06 px.
    fn of(angle: f64, sharpness: f64) -> Self {
        let square = sharpness.powi(2).min(MIN_BLUR_PX.powi(-2));
        let (sin, cos) = (4.0 * angle).sin_cos();
        let extra = Self::STRONGER_PX2 * square;
        let by_direction = square.powi(2) / 2880.0 * (1.0 + extra);
        let strength = by_direction * (3.0 + cos) / 4.0;
        let by_sharpness = strength * (4.0 + 2.0 * extra / (1.0 + extra));
        Self { strength, by_sharpness, by_turn: -by_direction * sin }
    }

    /// Returns the RMS displacement, px, of a corner with edges along rows and columns by this term, under a blur of this
    /// standard deviation, px. Without the term, errors were 1 to 3 times c s (tests).
    pub(crate) fn displacement_px(blur_px: f64) -> f64 {
        2.0 * Self::of(0.0, 1.0 / blur_px).strength * blur_px
    }
}

impl<const K: usize> Look<K> {
    pub(super) fn of(corner: &Corner<K>, optics: &Optics, piece: Piece, limits: [f32; 2]) -> Self {
        let spread = optics.spread(K);
        let rotations = corner.angles.map(f64::sin_cos);
        let normals = rotations.map(|(sin, cos)| [-sin, cos]);
        let tangents = rotations.map(|(sin, cos)| [-cos, -sin]);
        let product = |a, b| spread.product(a, b);
        let parts = |a, b| spread.by_astigmatism(a, b);
        let fourfold = corner.angles.map(|angle| (4.0 * angle).sin_cos());
        let squares: [f64; K] =
            std::array::from_fn(|k| product(normals[k], normals[k]) + optics.cross * fourfold[k].1);
        let by_turn: [f64; K] = std::array::from_fn(|k| {
            (product(tangents[k], normals[k]) - 2.0 * optics.cross * fourfold[k].0) / squares[k]
        });
        let by_shape: [[f64; K]; 3] = [0, 1, 2].map(|e| {
            std::array::from_fn(|k| {
                let by = parts(normals[k], normals[k]).get(e).copied().unwrap_or(fourfold[k].1);
                by / (2.0 * squares[k])
            })
        });
        // The series of an edge is that about a Gaussian, so motion has neither skewness nor pixel.
        let part = if spread.is_swept { 0.0 } else { 1.0 / 6.0 };
        let cubes: [[f64; K]; 2] = [0, 1]
            .map(|e| std::array::from_fn(|k| part * normals[k][e].powi(3) / squares[k].powf(1.5)));
        let [g1, g2] = optics.skewness;
        let of_skewness = |by: [f64; 2]| by[0] * g1 + by[1] * g2;
        let skewness: [f64; K] = std::array::from_fn(|k| of_skewness(cubes.map(|cube| cube[k])));
        let skewness_by_turn = std::array::from_fn(|k| {
            let by = [0, 1].map(|e| {
                3.0 * part * normals[k][e].powi(2) * tangents[k][e] / squares[k].powf(1.5)
            });
            of_skewness(by) - 3.0 * by_turn[k] * skewness[k]
        });
        let correlations = PAIRS.map(|[i, j]| {
            if j >= K {
                return Correlation::default();
            }
            let [first, second] = [i, j].map(|k| product(normals[k], normals[k]));
            let lengths = (first * second).sqrt();
            let rho = product(normals[i], normals[j]) / lengths;
            let by_angle = [
                product(tangents[i], normals[j]) / lengths
                    - rho * product(tangents[i], normals[i]) / first,
                product(normals[i], tangents[j]) / lengths
                    - rho * product(tangents[j], normals[j]) / second,
            ];
            let [e1, e2] = [0, 1].map(|e| {
                let own = |k: usize, square: f64| parts(normals[k], normals[k])[e] / square;
                parts(normals[i], normals[j])[e] / lengths
                    - 0.5 * rho * (own(i, first) + own(j, second))
            });
            Correlation { rho, by_angle, by_shape: [e1, e2, 0.0] }
        });
        let across = |way: [f64; 2], direction: [f64; 2], k: usize| {
            (way[0] * direction[0] + way[1] * direction[1]) / f64::sqrt(squares[k])
        };
        let way: [f64; K] = std::array::from_fn(|k| across(spread.way, normals[k], k));
        let way_by_turn =
            std::array::from_fn(|k| across(spread.way, tangents[k], k) - way[k] * by_turn[k]);
        let way_by_shape = [0, 1, 2].map(|e| {
            let by = spread.way_by_astigmatism.get(e).copied().unwrap_or_default();
            std::array::from_fn(|k| across(by, normals[k], k) - way[k] * by_shape[e][k])
        });
        let core_px = corner.blur_px * optics.core();
        let sharpness = squares.map(|square| 1.0 / (core_px * square.sqrt()));
        let by_ink = by_ink(corner, sharpness);
        let displaced = by_ink.map(|by| by * optics.ink);
        Self {
            rotations,
            by_shape,
            skewness,
            skewness_by_turn,
            by_skewness: cubes,
            pixel: std::array::from_fn(|k| match spread.is_swept {
                true => PixelBox::NONE,
                false => PixelBox::of(corner.angles[k], sharpness[k]),
            }),
            correlations,
            sharpness,
            way: spread.is_swept.then(|| way.map(|way| way as f32)),
            way_by_turn,
            way_by_shape,
            displaced,
            by_ink,
            by_turn,
            piece,
            halo: optics.halo.map(|h| h as f32),
            core_by_halo: optics.ln_core_by_halo() as f32,
            limits,
        }
    }

    /// Returns whether there is a halo.
    pub(super) fn has_halo(&self) -> bool {
        self.halo[0] != 0.0
    }

    /// Returns whether ink has displaced the edges.
    pub(super) fn is_inked(&self) -> bool {
        self.displaced.iter().any(|d| *d != 0.0)
    }

    /// Returns these edges with the box of a pixel.
    pub(super) fn with_pixel<P, const E: usize>(&self, edges: P) -> WithPixel<P, E> {
        let strengths = std::array::from_fn(|k| self.pixel[k.min(K - 1)].strength as f32);
        WithPixel { edges, strengths }
    }

    /// Returns these three edges without motion, with the triangle between them if it is small. All lengths are multiplied
    /// by a factor.
    pub(super) fn with_spot<P>(&self, edges: P, factor: f32) -> Option<WithSpot<P>> {
        let moved = [0, 1, 2].map(|k| self.displaced[k.min(K - 1)] * f64::from(factor));
        WithSpot::new(edges, self.correlations.map(|of| of.rho), moved)
    }

    /// Returns these three edges with the triangle between them.
    pub(super) fn with_triangle<P>(&self, edges: P) -> WithTriangle<P> {
        let way = |k: usize| self.way.map_or(0.0, |way| way[k.min(K - 1)]);
        // A box of half length w has the variance w²/3.
        let narrower = [0, 1, 2].map(|k| 1.0 / (1.0 + way(k) * way(k) / 3.0).sqrt());
        let pairs = [0, 1, 2].map(|p| {
            let [i, j] = PAIRS[p];
            let rho = self.correlations[p].rho as f32 + way(i) * way(j) / 3.0;
            Orthant::new(f64::from(rho * narrower[i] * narrower[j]))
        });
        let sign = self.displaced[0].signum() as f32;
        WithTriangle { edges, triangle: Triangle { pairs, sign, narrower } }
    }

    /// Returns these two edges with their halves displaced, and all lengths multiplied by a factor.
    pub(super) fn parted<P>(&self, edges: P, factor: f32) -> Parted<P> {
        let displaced = Displaced([0, 1].map(|k| self.displaced[k] as f32 * factor));
        Parted { edges, displaced }
    }

    /// Returns the haloed pattern. `pattern` creates the pattern with its own lengths multiplied by
    /// a factor.
    pub(super) fn haloed_of<P>(&self, pattern: impl Fn(f32) -> P) -> Haloed<P> {
        let [strength, width] = self.halo;
        let halo = Halo { strength, narrower: 1.0 / width };
        Haloed { pattern: pattern(1.0), wide: pattern(halo.narrower), halo }
    }
}

/// Returns the displacement of the edges by an ink of 1, in units of the blur.
///
/// If the contrast is positive, dark areas lie on the right of the first and the third of three edges, and on the left
/// of the second. Of two edges, both are displaced into areas of f = 1.
fn by_ink<const K: usize>(corner: &Corner<K>, sharpness: [f64; K]) -> [f64; K] {
    std::array::from_fn(|k| {
        let by = INK_UNIT * corner.amplitude.signum() * corner.across_px[k] * sharpness[k];
        if (K, k) == (3, 1) { -by } else { by }
    })
}
