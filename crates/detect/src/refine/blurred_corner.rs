//! The brightness around an ideal corner under a Gaussian blur, and its derivatives.
//!
//! K straight edges meet in the corner. h₁ … h_K are the signed distances of a point from them, in units of the blur,
//! for edge angles that increase within 180°. Bright is +1 and dark −1:
//!
//! ```text
//!     deltille    s₁ s₂ s₃ = s₁ − s₂ + s₃      f = erf(h₁/√2) − erf(h₂/√2) + erf(h₃/√2)
//!     checker     s₁ s₂                        f = E[sign(h₁ + z₁) sign(h₂ + z₂)],  corr(z) = ρ
//! ```
//!
//! where s = sign h, and ρ = cos(θ₂ − θ₁) is the cosine of the angle between the normals of the
//! edges. With Drezner and Wesolowsky's integral for the orthant probability (1990, J. Stat.
//! Comput. Simul. 35)
//!
//! ```text
//!     f = erf(h₁/√2) erf(h₂/√2) + 2/π ∫₀^{asin ρ} exp(−(h₁² + h₂² − 2 h₁h₂ sin φ)/(2 cos² φ)) dφ
//! ```
//!
//! All computations are straight-line single precision, so that the compiler can vectorise over pixels. Errors are
//! below 3·10⁻⁶ (tests).

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_2_PI, LN_2, LOG2_E};

use super::pattern::{Combination, Distances, Pattern, Shade, Shades, combine};

/// √(2/π): the slope of erf(h/√2) at 0.
pub(super) const SLOPE: f32 = 0.797_884_6;

/// Nodes and weights of the Gauss–Legendre rule of six points on −1 … 1. They suffice for 10⁻⁶ up to |ρ| = 0.9, edges
/// 25° apart.
const RULE_OF_SIX: [(f64, f64); 6] = [
    (0.238_619_186, 0.467_913_935),
    (-0.238_619_186, 0.467_913_935),
    (0.661_209_386, 0.360_761_573),
    (-0.661_209_386, 0.360_761_573),
    (0.932_469_514, 0.171_324_492),
    (-0.932_469_514, 0.171_324_492),
];

/// The rule of three points, which suffices for 2·10⁻⁵ up to [`FEW_NODES_RHO`].
const RULE_OF_THREE: [(f64, f64); 3] =
    [(0.0, 0.888_888_889), (0.774_596_669, 0.555_555_556), (-0.774_596_669, 0.555_555_556)];

/// Largest ρ for the rule of three points: edges 46° apart.
pub(crate) const FEW_NODES_RHO: f64 = 0.7;

/// Three edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deltille;

/// The corner of a sharpened image: (1 + α)·f(h) − α·f(h/w). A pattern of edges is linear in the point spread function,
/// so this is exact for a Gaussian mask.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Haloed<P> {
    /// The pattern without the halo.
    pub pattern: P,
    /// The same pattern at the width of the halo, at distances in its units; only its motion differs.
    pub wide: P,
    /// The halo.
    pub halo: Halo,
}

/// A halo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halo {
    /// α.
    pub strength: f32,
    /// 1/w.
    pub narrower: f32,
}

impl<const K: usize, P: Pattern<K>> Pattern<K> for Haloed<P> {
    fn shade(&self, distances: &Distances<K>, shades: &mut Shades<K>) {
        let (mut wide, narrower) = (Shades::NONE, self.halo.narrower);
        self.pattern.shade(distances, shades);
        self.wide.shade(&distances.map(|h| h.map(|h| h * narrower)), &mut wide);
        combine(&self.halo, distances, [&wide], shades);
    }
}

impl<const K: usize> Combination<K, 1> for Halo {
    #[inline(always)]
    fn at(&self, _: [f32; K], sharp: Shade<K>, [wide]: [Shade<K>; 1]) -> Shade<K> {
        let both = |sharp: f32, wide: f32| sharp + self.strength * (sharp - wide);
        Shade {
            f: both(sharp.f, wide.f),
            slopes: std::array::from_fn(|k| both(sharp.slopes[k], wide.slopes[k] * self.narrower)),
            correlations: std::array::from_fn(|p| {
                both(sharp.correlations[p], wide.correlations[p])
            }),
            halo: sharp.f - wide.f,
            shifts: std::array::from_fn(|k| both(sharp.shifts[k], wide.shifts[k] * self.narrower)),
            way: std::array::from_fn(|k| both(sharp.way[k], wide.way[k] * self.narrower)),
            boxed: std::array::from_fn(|k| {
                both(sharp.boxed[k], wide.boxed[k] * self.narrower.powi(4))
            }),
        }
    }
}

/// Edges under a Gaussian convolved with the box of a pixel, by the next term of Edgeworth's series: c (h³ − 3h) times the
/// slope of the edge, for the strength c of the term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WithPixel<P, const K: usize> {
    /// The edges under the Gaussian.
    pub edges: P,
    /// c of each edge.
    pub strengths: [f32; K],
}

impl<P, const K: usize> WithPixel<P, K> {
    /// Returns the same box at lengths that are multiplied by a factor.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { strengths: self.strengths.map(|c| c * factor.powi(4)), ..self }
    }
}

impl<P, const K: usize> Pattern<K> for WithPixel<P, K>
where
    Self: Combination<K, 0>,
{
    fn shade(&self, distances: &Distances<K>, shades: &mut Shades<K>) {
        combine(self, distances, [], shades);
    }
}

impl Combination<3, 0> for WithPixel<Deltille, 3> {
    #[inline(always)]
    fn at(&self, h: [f32; 3], _: Shade<3>, _: [Shade<3>; 0]) -> Shade<3> {
        let mut shade = deltille(h);
        for (k, h) in h.into_iter().enumerate() {
            let (square, slope) = (h * h, shade.slopes[k]);
            shade.boxed[k] = h * (square - 3.0) * slope;
            shade.f += self.strengths[k] * shade.boxed[k];
            shade.slopes[k] -= self.strengths[k] * ((square - 6.0) * square + 3.0) * slope;
        }
        shade
    }
}

impl<const NODES: usize> Combination<2, 0> for WithPixel<Orthant<NODES>, 2> {
    #[inline(always)]
    fn at(&self, h: [f32; 2], _: Shade<2>, _: [Shade<2>; 0]) -> Shade<2> {
        let still = self.edges.checker(h);
        let mut shade = still;
        // The slope of an edge changes by `mixed` with the distance from the other.
        let Orthant { rho, sine, .. } = self.edges;
        let mixed = still.correlations[0];
        for k in 0..2 {
            let (square, slope) = (h[k] * h[k], still.slopes[k]);
            let cubic = h[k] * (square - 3.0);
            let by_other = self.strengths[k] * cubic * mixed;
            shade.boxed[k] = cubic * slope;
            shade.f += self.strengths[k] * shade.boxed[k];
            shade.slopes[k] -=
                self.strengths[k] * ((square - 6.0) * square + 3.0) * slope + rho * by_other;
            shade.slopes[1 - k] += by_other;
            shade.correlations[0] -= by_other * (h[k] - rho * h[1 - k]) / (sine * sine);
        }
        shade
    }
}

/// Minimum length of a box to each side, in units of the blur. It widens the blur by 0.2 %.
const MIN_WAY: f32 = 0.1;

/// Three edges in an image that moved along a line at constant speed, half of the motion on each side of the centre.
/// The blur of an edge is then a Gaussian convolved with a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweptDeltille {
    /// Half of the motion across each edge, in units of the blur: its length, the inverse of its double, and its sign.
    reach: [f32; 3],
    over_whole: [f32; 3],
    signs: [f32; 3],
}

impl SweptDeltille {
    /// Creates it from half of the motion across each edge, in units of the blur.
    pub(crate) fn new(way: [f32; 3]) -> Self {
        let reach = way.map(|way| way.abs().max(MIN_WAY));
        let over_whole = reach.map(|reach| 0.5 / reach);
        Self { reach, over_whole, signs: way.map(f32::signum) }
    }

    /// Returns the brightness at this distance from an edge, its slope, and its derivative with
    /// respect to the motion.
    #[inline(always)]
    fn edge(&self, k: usize, h: f32) -> [f32; 3] {
        let over_whole = self.over_whole[k];
        let Swept { f, e1, e2 } = swept(h, self.reach[k], over_whole);
        let by_way = ((e1 + e2) - 2.0 * f) * over_whole * self.signs[k];
        [f, (e1 - e2) * over_whole, by_way]
    }
}

impl Pattern<3> for SweptDeltille {
    fn shade(&self, distances: &Distances<3>, shades: &mut Shades<3>) {
        combine(self, distances, [], shades);
    }
}

impl Combination<3, 0> for SweptDeltille {
    #[inline(always)]
    fn at(&self, h: [f32; 3], _: Shade<3>, _: [Shade<3>; 0]) -> Shade<3> {
        let [f1, slope1, way1] = self.edge(0, h[0]);
        let [f2, slope2, way2] = self.edge(1, h[1]);
        let [f3, slope3, way3] = self.edge(2, h[2]);
        let way = [way1, -way2, way3];
        Shade { way, ..Shade::new(f1 - f2 + f3, [slope1, -slope2, slope3]) }
    }
}

/// Two edges in motion. The box is approximated by four Gaussians, and the rest of its variance is
/// added to the blur.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweptChecker<P> {
    /// The pattern without motion.
    pub pattern: P,
    /// Half of the motion across both edges, in units of the blur.
    pub way: [f32; 2],
}

/// Fraction of the variance of a box that comes from the positions of its four equal parts.
pub(crate) const PLACES_OF_FOUR: f64 = 15.0 / 16.0;

/// The distances of the centres of four equal parts from that of the whole, as fractions of half of its length: each of
/// two parts behind and ahead.
const PARTS: [f32; 2] = [0.75, 0.25];

impl<P: Pattern<2>> Pattern<2> for SweptChecker<P> {
    fn shade(&self, distances: &Distances<2>, shades: &mut Shades<2>) {
        let [mut ahead, mut behind_within, mut ahead_within] = [const { Shades::NONE }; 3];
        let parts = [(&mut *shades, &mut ahead), (&mut behind_within, &mut ahead_within)];
        for (part, (behind, ahead)) in PARTS.into_iter().zip(parts) {
            let [x, y] = self.way.map(|way| part * way);
            self.pattern.shade(&distances.map(|[a, b]| [a - x, b - y]), behind);
            self.pattern.shade(&distances.map(|[a, b]| [a + x, b + y]), ahead);
        }
        combine(&MeanOfParts, distances, [&ahead, &behind_within, &ahead_within], shades);
    }
}

/// The mean of four parts of a motion, in the order of [`PARTS`].
struct MeanOfParts;

impl Combination<2, 3> for MeanOfParts {
    #[inline(always)]
    fn at(&self, _: [f32; 2], a: Shade<2>, [b, c, d]: [Shade<2>; 3]) -> Shade<2> {
        let (outer, inner) = (mean_of_pair(a, b, PARTS[0]), mean_of_pair(c, d, PARTS[1]));
        Shade {
            f: 0.5 * (outer.f + inner.f),
            slopes: mean(outer.slopes, inner.slopes),
            correlations: mean(outer.correlations, inner.correlations),
            shifts: mean(outer.shifts, inner.shifts),
            way: mean(outer.way, inner.way),
            boxed: mean(outer.boxed, inner.boxed),
            ..outer
        }
    }
}

/// Returns the mean of two patterns, at a fraction `part` of half the motion behind and ahead of the centre.
#[inline(always)]
fn mean_of_pair(behind: Shade<2>, ahead: Shade<2>, part: f32) -> Shade<2> {
    Shade {
        f: 0.5 * (behind.f + ahead.f),
        slopes: mean(behind.slopes, ahead.slopes),
        correlations: mean(behind.correlations, ahead.correlations),
        shifts: mean(behind.shifts, ahead.shifts),
        boxed: mean(behind.boxed, ahead.boxed),
        way: [
            0.5 * part * (ahead.slopes[0] - behind.slopes[0]),
            0.5 * part * (ahead.slopes[1] - behind.slopes[1]),
        ],
        ..behind
    }
}

#[inline(always)]
pub(super) fn mean<const N: usize>(a: [f32; N], b: [f32; N]) -> [f32; N] {
    std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
}

#[inline(always)]
fn deltille([h1, h2, h3]: [f32; 3]) -> Shade<3> {
    Shade::new(
        erf_sqrt_half(h1) - erf_sqrt_half(h2) + erf_sqrt_half(h3),
        [SLOPE * bell(h1), -SLOPE * bell(h2), SLOPE * bell(h3)],
    )
}

/// Terms of the orthant integral that depend only on ρ, computed once for all pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Orthant<const NODES: usize> {
    rho: f32,
    /// √(1 − ρ²).
    sine: f32,
    /// Half the range of integration, times 2/π.
    scale: f32,
    /// Weight, sin φ, and 1/(2 cos² φ) at the nodes.
    nodes: [[f32; 3]; NODES],
}

impl Orthant<6> {
    /// Creates the terms for ρ = cos(angle between the edges), |ρ| < 1.
    pub(crate) fn new(rho: f64) -> Self {
        Self::by(RULE_OF_SIX, rho)
    }
}

impl Orthant<3> {
    /// Creates the terms for ρ up to [`FEW_NODES_RHO`].
    pub(crate) fn of_few_nodes(rho: f64) -> Self {
        Self::by(RULE_OF_THREE, rho)
    }
}

impl<const NODES: usize> Orthant<NODES> {
    fn by(rule: [(f64, f64); NODES], rho: f64) -> Self {
        let half = rho.asin() / 2.0;
        let nodes = rule.map(|(node, weight)| {
            let (sin, cos) = (half * (1.0 + node)).sin_cos();
            [weight as f32, sin as f32, (0.5 / (cos * cos)) as f32]
        });
        let sine = (1.0 - rho * rho).sqrt() as f32;
        Self { rho: rho as f32, sine, scale: FRAC_2_PI * half as f32, nodes }
    }

    /// Returns the brightness of two edges.
    #[inline(always)]
    pub(crate) fn checker(&self, [h1, h2]: [f32; 2]) -> Shade<2> {
        let (squares, product) = (h1 * h1 + h2 * h2, h1 * h2);
        let mut integral = 0.0;
        for [weight, sin, half_sec2] in self.nodes {
            integral += weight * exp_negative(-(squares - 2.0 * product * sin) * half_sec2);
        }
        let [towards_1, towards_2] = [h2 - self.rho * h1, h1 - self.rho * h2];
        let exponent = (squares - 2.0 * self.rho * product) * -0.5 / (self.sine * self.sine);
        let slopes = [
            SLOPE * bell(h1) * erf_sqrt_half(towards_1 / self.sine),
            SLOPE * bell(h2) * erf_sqrt_half(towards_2 / self.sine),
        ];
        let correlations = [FRAC_2_PI / self.sine * exp_negative(exponent), 0.0, 0.0];
        let f = erf_sqrt_half(h1) * erf_sqrt_half(h2) + self.scale * integral;
        Shade { correlations, ..Shade::new(f, slopes) }
    }

    /// Returns the part of the blurred light that comes from the positive sides of both edges.
    pub(crate) fn quadrant(&self, h: [f32; 2]) -> Shade<2> {
        let both = self.checker(h);
        let single = |k: usize| SLOPE * bell(h[k]);
        Shade {
            f: 0.25 * (1.0 + erf_sqrt_half(h[0]) + erf_sqrt_half(h[1]) + both.f),
            slopes: [0, 1].map(|k| 0.25 * (single(k) + both.slopes[k])),
            ..both
        }
    }
}

/// The brightness of an edge in motion, and erf(h/√2) at both ends of the motion.
struct Swept {
    f: f32,
    e1: f32,
    e2: f32,
}

/// Returns the mean of erf(h/√2) over `reach` on each side; `over_whole` is 0.5/`reach`.
#[inline(always)]
fn swept(h: f32, reach: f32, over_whole: f32) -> Swept {
    let [ahead, behind] = [h + reach, h - reach];
    let [e1, e2] = [erf_sqrt_half(ahead), erf_sqrt_half(behind)];
    // The integral of erf(h/√2).
    let area = ahead * e1 - behind * e2 + SLOPE * (bell(ahead) - bell(behind));
    Swept { f: area * over_whole, e1, e2 }
}

/// Returns the mean of erf(h/√2) over `reach` on each side.
pub(crate) fn swept_edge(h: f32, reach: f32) -> f32 {
    let reach = reach.abs();
    if reach < MIN_WAY { erf_sqrt_half(h) } else { swept(h, reach, 0.5 / reach).f }
}

/// Returns the slope of an edge, ∂ erf(h/√2)/∂h.
#[inline(always)]
pub(crate) fn edge_slope(h: f32) -> f32 {
    SLOPE * bell(h)
}

/// exp(−h²/2).
#[inline(always)]
pub(super) fn bell(h: f32) -> f32 {
    exp_negative(-0.5 * h * h)
}

/// erf(h/√2), by Abramowitz and Stegun 7.1.26; error below 2·10⁻⁷.
#[inline(always)]
pub(crate) fn erf_sqrt_half(h: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * FRAC_1_SQRT_2 * h.abs());
    let poly = t
        * (0.254_829_6
            + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152_1 + t * 1.061_405_4))));
    (1.0 - poly * bell(h)).copysign(h)
}

/// exp(x) for x ≤ 0, with a relative error of 3·10⁻⁷. The result is limited to 2⁻⁶⁰, so that no product of two is a
/// subnormal number, which processors handle slowly.
#[inline(always)]
pub(crate) fn exp_negative(x: f32) -> f32 {
    /// 1.5·2²³: adding it rounds to an integer, which then fills the low bits.
    const ROUND: f32 = 12_582_912.0;
    let y = (x * LOG2_E).max(-60.0);
    let rounded = y + ROUND;
    let fraction = y - (rounded - ROUND);
    /// Taylor series of 2^x, |x| ≤ 1/2, from x⁶ down: (ln 2)^k / k!.
    const SERIES: [f32; 6] =
        [0.000_154_035_3, 0.001_333_355_8, 0.009_618_129, 0.055_504_11, 0.240_226_5, LN_2];
    let mut mantissa = 0.0;
    for coefficient in SERIES {
        mantissa = (mantissa + coefficient) * fraction;
    }
    mantissa += 1.0;
    // 2^x of the integer part: its bits, plus 127, above the 23 of the mantissa.
    let exponent = rounded.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23;
    mantissa * f32::from_bits(exponent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::pattern::at;

    #[test]
    fn special_functions_agree_with_those_of_libm() {
        for i in -800..=800 {
            let h = i as f32 * 0.01;
            let erf = libm::erf(f64::from(h) * std::f64::consts::FRAC_1_SQRT_2);
            assert!((f64::from(erf_sqrt_half(h)) - erf).abs() < 4e-7, "erf at {h}");
            let bell_64 = (-0.5 * f64::from(h).powi(2)).exp();
            assert!((f64::from(bell(h)) - bell_64).abs() < 4e-7, "bell at {h}");
        }
        assert!(exp_negative(-1e9) < 1e-17);
    }

    /// Compares every derivative with a difference quotient of f.
    #[test]
    fn slopes_are_derivatives() {
        let step = 0.01f32;
        let close = |derivative: f32, up: f32, down: f32, d: f32| {
            let quotient = (up - down) / d;
            assert!((derivative - quotient).abs() < 2e-4, "{derivative} or {quotient}");
        };
        for i in 0..400 {
            let h = [0, 1, 2].map(|k| (((i * (37 + 10 * k)) % 101) as f32 - 50.0) * 0.06);
            let rho = f64::from((i % 19) - 9) * 0.095;
            for k in 0..3 {
                let moved = |by: f32| std::array::from_fn(|j| h[j] + if j == k { by } else { 0.0 });
                let (up, down) = (deltille(moved(step)).f, deltille(moved(-step)).f);
                close(deltille(h).slopes[k], up, down, 2.0 * step);
            }
            let three = WithPixel { edges: Deltille, strengths: [0.1, 0.05, 0.02] };
            for k in 0..3 {
                let moved = |by: f32| std::array::from_fn(|j| h[j] + if j == k { by } else { 0.0 });
                let (up, down) = (at(&three, moved(step)).f, at(&three, moved(-step)).f);
                close(at(&three, h).slopes[k], up, down, 2.0 * step);
            }
            let orthant = Orthant::new(rho);
            let h = [h[0], h[1]];
            let two = |rho: f64| WithPixel { edges: Orthant::new(rho), strengths: [0.1, 0.05] };
            for k in 0..2 {
                let moved = |by: f32| std::array::from_fn(|j| h[j] + if j == k { by } else { 0.0 });
                let (up, down) = (at(&two(rho), moved(step)).f, at(&two(rho), moved(-step)).f);
                close(at(&two(rho), h).slopes[k], up, down, 2.0 * step);
            }
            let quotient = (at(&two(rho + 0.01), h).f - at(&two(rho - 0.01), h).f) / 0.02;
            let derivative = at(&two(rho), h).correlations[0];
            assert!((derivative - quotient).abs() < 1e-2 * derivative.abs().max(0.1));
            for k in 0..2 {
                let moved = |by: f32| std::array::from_fn(|j| h[j] + if j == k { by } else { 0.0 });
                let (up, down) = (orthant.checker(moved(step)).f, orthant.checker(moved(-step)).f);
                close(orthant.checker(h).slopes[k], up, down, 2.0 * step);
            }
            let (up, down) = (Orthant::new(rho + 0.01), Orthant::new(rho - 0.01));
            let quotient = (up.checker(h).f - down.checker(h).f) / 0.02;
            let derivative = orthant.checker(h).correlations[0];
            assert!((derivative - quotient).abs() < 5e-3 * derivative.abs().max(0.1));
        }
    }

    /// A corner in motion is the mean of the corner along the motion.
    #[test]
    fn motion_is_a_mean_along_the_path() {
        const STEPS: i32 = 400;
        let still = Orthant::new(0.3);
        for i in 0..400 {
            let h = [0, 1, 2].map(|k| (((i * (37 + 10 * k)) % 101) as f32 - 50.0) * 0.08);
            let way = [0, 1, 2].map(|k| (((i * (23 + 8 * k)) % 61) as f32 - 30.0) * 0.1);
            let along = |of: &dyn Fn(f32) -> f32| {
                let places = (0..STEPS).map(|s| (s as f32 + 0.5) * 2.0 / STEPS as f32 - 1.0);
                places.map(of).sum::<f32>() / STEPS as f32
            };
            let three = along(&|t| deltille([0, 1, 2].map(|k| h[k] + t * way[k])).f);
            let swept = |way: [f32; 3]| at(&SweptDeltille::new(way), h);
            // At the shortest motions, the minimum length adds blur.
            let error = swept(way).f - three;
            assert!(error.abs() < 3e-3, "{h:?} {way:?}: {error}");
            for k in (0..3).filter(|&k| way[k].abs() > 0.2) {
                let moved =
                    |by: f32| std::array::from_fn(|j| way[j] + if j == k { by } else { 0.0 });
                let quotient = (swept(moved(0.05)).f - swept(moved(-0.05)).f) / 0.1;
                assert!((swept(way).way[k] - quotient).abs() < 2e-3, "{h:?} {way:?}");
            }
            // Two edges: each of four parts is longer than the Gaussian that represents it, by less than its width.
            let (h, way) = ([h[0], h[1]], [way[0] / 2.0, way[1] / 2.0]);
            let two = along(&|t| still.checker([0, 1].map(|k| h[k] + t * way[k])).f);
            let cov = |k: usize, l: usize| way[k] * way[l] / 48.0;
            let spread = [1.0 + cov(0, 0), 1.0 + cov(1, 1)].map(f32::sqrt);
            let rho = (0.3 + cov(0, 1)) / (spread[0] * spread[1]);
            let edges = Orthant::new(f64::from(rho));
            let pattern = WithPixel { edges, strengths: [0.0; 2] };
            let units = |v: [f32; 2]| [v[0] / spread[0], v[1] / spread[1]];
            let four = at(&SweptChecker { pattern, way: units(way) }, units(h)).f;
            assert!((four - two).abs() < 2e-3, "{h:?} {way:?}: {four} or {two}");
        }
    }

    #[test]
    fn few_nodes_are_enough_for_edges_that_are_nearly_square() {
        for i in -20..=20 {
            let rho = FEW_NODES_RHO * f64::from(i) / 20.0;
            let (few, many) = (Orthant::of_few_nodes(rho), Orthant::new(rho));
            for j in 0..1600 {
                let h = [j % 40, j / 40].map(|k| (k - 20) as f32 * 0.2);
                let (few, many) = (few.checker(h).f, many.checker(h).f);
                assert!((few - many).abs() < 2e-5, "{rho} {h:?}: {few} or {many}");
            }
        }
    }

    #[test]
    fn the_corner_itself_has_the_arcsine_law() {
        for i in -9..=9 {
            let rho = f64::from(i) * 0.1;
            let f = f64::from(Orthant::new(rho).checker([0.0; 2]).f);
            assert!((f - 2.0 / std::f64::consts::PI * rho.asin()).abs() < 1e-6);
        }
    }
}
