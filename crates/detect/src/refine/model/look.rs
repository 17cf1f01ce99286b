//! Effect of the optics on a corner: the same for all of its pixels, and computed once.

use super::corner::Corner;
use crate::refine::blurred_corner::{Haloed, Overlap, Triangle};
use crate::refine::optics::{INK_UNIT, Optics, Spread};
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
    /// Correlation of the blur along the first two normals, and its derivatives with respect to
    /// their angles.
    pub(super) rho: f64,
    pub(super) rho_by_angle: [f64; 2],
    /// ∂ ln s_k/∂e and ∂ρ/∂e of both parameters of astigmatism.
    pub(super) by_astigmatism: [[f64; K]; 2],
    pub(super) rho_by_astigmatism: [f64; 2],
    /// Tone curve between black and white.
    pub(super) piece: Piece,
    /// Strength of the halo, and its width relative to the blur.
    pub(super) halo: [f32; 2],
    /// ∂ ln s/∂α of the blur of the pattern, at a constant slope of the edges.
    pub(super) core_by_halo: f32,
    /// Half of the motion across the edges during exposure, in units of the blur, if there is
    /// motion. Also its derivatives with respect to the angles and to both parameters of
    /// astigmatism.
    pub(super) way: Option<[f32; K]>,
    pub(super) way_by_turn: [f64; K],
    pub(super) way_by_astigmatism: [[f64; K]; 2],
    /// Displacement of the edges by ink, in units of the blur, its derivatives with respect to the
    /// ink, and the triangle between them.
    pub(super) displaced: [f64; K],
    pub(super) by_ink: [f64; K],
    pub(super) triangle: Option<Triangle>,
    /// The darkest and the brightest value that the sensor can show.
    pub(super) limits: [f32; 2],
}

impl<const K: usize> Look<K> {
    pub(super) fn of(corner: &Corner<K>, optics: &Optics, piece: Piece, limits: [f32; 2]) -> Self {
        let spread = optics.spread(K);
        let rotations = corner.angles.map(f64::sin_cos);
        let normals = rotations.map(|(sin, cos)| [-sin, cos]);
        let tangents = rotations.map(|(sin, cos)| [-cos, -sin]);
        let product = |a, b| spread.product(a, b);
        let squares = normals.map(|n| product(n, n));
        let by_turn: [f64; K] =
            std::array::from_fn(|k| product(tangents[k], normals[k]) / squares[k]);
        let lengths = (squares[0] * squares[1]).sqrt();
        let rho = product(normals[0], normals[1]) / lengths;
        let rho_by_angle = [
            product(tangents[0], normals[1]) / lengths - rho * by_turn[0],
            product(normals[0], tangents[1]) / lengths - rho * by_turn[1],
        ];
        let parts = |a, b| spread.by_astigmatism(a, b);
        let by_astigmatism: [[f64; K]; 2] = [0, 1].map(|e| {
            std::array::from_fn(|k| parts(normals[k], normals[k])[e] / (2.0 * squares[k]))
        });
        let across = |way: [f64; 2], direction: [f64; 2], k: usize| {
            (way[0] * direction[0] + way[1] * direction[1]) / f64::sqrt(squares[k])
        };
        let way: [f64; K] = std::array::from_fn(|k| across(spread.way, normals[k], k));
        let way_by_turn =
            std::array::from_fn(|k| across(spread.way, tangents[k], k) - way[k] * by_turn[k]);
        let way_by_astigmatism = [0, 1].map(|e| {
            let by = spread.way_by_astigmatism[e];
            std::array::from_fn(|k| across(by, normals[k], k) - way[k] * by_astigmatism[e][k])
        });
        let rho_by_astigmatism = [0, 1].map(|e| {
            let [first, second] = [by_astigmatism[e][0], by_astigmatism[e][1]];
            parts(normals[0], normals[1])[e] / lengths - rho * (first + second)
        });
        let core_px = corner.blur_px * optics.core();
        let sharpness = squares.map(|square| 1.0 / (core_px * square.sqrt()));
        let by_ink = by_ink(corner, sharpness);
        let displaced = by_ink.map(|by| by * optics.ink);
        let is_inked = displaced.iter().any(|d| *d != 0.0);
        let triangle = is_inked.then(|| triangle(corner, rotations, optics, &spread));
        Self {
            rotations,
            by_astigmatism,
            rho_by_astigmatism,
            sharpness,
            way: spread.is_swept.then(|| way.map(|way| way as f32)),
            way_by_turn,
            way_by_astigmatism,
            displaced,
            by_ink,
            triangle,
            by_turn,
            rho,
            rho_by_angle,
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

    pub(super) fn haloed<P: Copy>(&self, pattern: P) -> Haloed<P> {
        self.haloed_of(|_| pattern)
    }

    /// Returns the haloed pattern. `pattern` creates the pattern with its own lengths multiplied by
    /// a factor.
    pub(super) fn haloed_of<P>(&self, pattern: impl Fn(f32) -> P) -> Haloed<P> {
        let [strength, width] = self.halo;
        Haloed {
            pattern: pattern(1.0),
            wide: pattern(1.0 / width),
            strength,
            narrower: 1.0 / width,
        }
    }
}

/// Returns the displacement of the edges by an ink of 1, in units of the blur.
///
/// If the contrast is positive, dark areas lie on the right of the first and the third edge, and on the left of the
/// second. With two edges, the halves move in opposite directions, and the corner does not move.
fn by_ink<const K: usize>(corner: &Corner<K>, sharpness: [f64; K]) -> [f64; K] {
    std::array::from_fn(|k| match (K, k) {
        (3, 1) => -INK_UNIT * corner.amplitude.signum() * corner.across_px[k] * sharpness[k],
        (3, _) => INK_UNIT * corner.amplitude.signum() * corner.across_px[k] * sharpness[k],
        _ => 0.0,
    })
}

/// Returns the triangle between three edges displaced by ink, with its derivatives with respect to
/// ln s, the angles and the ink. The sines and cosines of the corner's angles are passed with it.
fn triangle<const K: usize>(
    corner: &Corner<K>,
    rotations: [(f64, f64); K],
    optics: &Optics,
    spread: &Spread,
) -> Triangle {
    /// Step in the logarithm of the blur, radians and units of ink: the quotient is accurate to
    /// about 1/10 000.
    const STEP: f64 = 1e-4;
    let core = optics.core();
    let overlap = |blur_px: f64, rotations: [(f64, f64); K], ink: f64| {
        let core_px = blur_px * core;
        let normals = rotations.map(|(sin, cos)| [-sin, cos]);
        let product = |a, b| spread.product(a, b);
        let lengths = normals.map(|n| product(n, n).sqrt());
        let rho = product(normals[0], normals[1]) / (lengths[0] * lengths[1]);
        let displaced = by_ink(corner, lengths.map(|l| 1.0 / (core_px * l))).map(|by| by * ink);
        // n₃ as a sum of n₁ and n₂.
        let sine = |from: usize, to: usize| {
            rotations[to].0 * rotations[from].1 - rotations[to].1 * rotations[from].0
        };
        let a = sine(2, 1) / sine(0, 1) * lengths[0] / lengths[2];
        let b = sine(0, 2) / sine(0, 1) * lengths[1] / lengths[2];
        let c = a * displaced[0] + b * displaced[1] - displaced[2];
        let [x, y] = [0, 1]
            .map(|k| (spread.way[0] * normals[k][0] + spread.way[1] * normals[k][1]) / lengths[k]);
        // A box of half length x has the variance x²/3.
        let cov = [1.0 + x * x / 3.0, rho + x * y / 3.0, 1.0 + y * y / 3.0];
        Overlap::between([a, b, c], cov, displaced[0].signum())
    };
    let there = std::array::from_fn(|parameter| match parameter {
        0 => overlap(corner.blur_px * STEP.exp(), rotations, optics.ink),
        1..=3 => {
            let mut turned = rotations;
            turned[parameter - 1] = (corner.angles[parameter - 1] + STEP).sin_cos();
            overlap(corner.blur_px, turned, optics.ink)
        }
        _ => overlap(corner.blur_px, rotations, optics.ink + STEP),
    });
    Triangle::new(overlap(corner.blur_px, rotations, optics.ink), there, STEP)
}
