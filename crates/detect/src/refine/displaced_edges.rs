//! The brightness around a corner whose edges were displaced by ink or blooming, under a Gaussian blur.
//!
//! All edges have moved into the bright or the dark tiles. Three lines then do not meet. Between them is a triangle in
//! which the alternating sum of signs is ±3 instead of ±1. With F(i, j) = E[sᵢ sⱼ], the indicator of the triangle is
//! (1 − F(1,2) + F(1,3) − F(2,3))/4, since one of the eight combinations of three half-planes is empty. If the triangle
//! is small compared with the blur, only its area and its moments matter: it is a spot of light.
//!
//! With two edges, both halves of each line move in opposite directions by d₁ and d₂, and dark tiles overlap or part:
//!
//! ```text
//!     f = ½ [F(h₁ + d₁, h₂ ± d₂) + F(h₁ − d₁, h₂ ∓ d₂)] − ½ Σ [erf((hₖ + dₖ)/√2) − erf((hₖ − dₖ)/√2)]
//! ```
//!
//! with the upper sign where areas of f = −1 have grown.

use glam::{DMat2, DVec2};

use super::blurred_corner::{Orthant, SLOPE, bell, erf_sqrt_half, exp_negative, mean};
use super::pattern::{Combination, Distances, PAIRS, Pattern, Shade, Shades, combine};

/// Largest root mean square radius of a triangle that is treated as a spot, in units of the blur. Its third moments are
/// neglected, which changes the brightness by up to 10⁻³ at this size, and by the fifth power of the size below it.
const MAX_SPOT: f64 = 0.4;

/// Three displaced edges, with the triangle between them, however large it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WithTriangle<P> {
    /// The edges without the triangle.
    pub edges: P,
    /// The triangle.
    pub triangle: Triangle,
}

/// The triangle between three displaced edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// The pairs of edges.
    pub pairs: [Orthant<6>; PAIRS.len()],
    /// 1 if areas of f = −1 have grown, −1 if they have shrunk.
    pub sign: f32,
    /// 1/√(1 + w²/3) for half of the motion w across each edge: motion widens the blur.
    pub narrower: [f32; 3],
}

impl<P: Pattern<3>> Pattern<3> for WithTriangle<P> {
    fn shade(&self, distances: &Distances<3>, shades: &mut Shades<3>) {
        self.edges.shade(distances, shades);
        combine(&self.triangle, distances, [], shades);
    }
}

impl Triangle {
    /// Adds the term of a pair of edges. The pair is constant, so that the loop over pixels is vectorised.
    #[inline(always)]
    fn add_pair<const PAIR: usize>(&self, h: [f32; 3], shade: &mut Shade<3>) {
        let [i, j] = PAIRS[PAIR];
        // Signs of the triangle's sides: − + −, or + − +.
        let weight = if PAIR == 1 { 0.5 } else { -0.5 } * self.sign;
        let both = self.pairs[PAIR].checker([h[i] * self.narrower[i], h[j] * self.narrower[j]]);
        shade.f += weight * both.f;
        shade.slopes[i] += weight * both.slopes[0] * self.narrower[i];
        shade.slopes[j] += weight * both.slopes[1] * self.narrower[j];
        shade.correlations[PAIR] = weight * both.correlations[0];
    }
}

impl Combination<3, 0> for Triangle {
    #[inline(always)]
    fn at(&self, h: [f32; 3], mut shade: Shade<3>, _: [Shade<3>; 0]) -> Shade<3> {
        shade.f += 0.5 * self.sign;
        self.add_pair::<0>(h, &mut shade);
        self.add_pair::<1>(h, &mut shade);
        self.add_pair::<2>(h, &mut shade);
        shade
    }
}

/// Three displaced edges, with a small triangle between them.
///
/// Let hᵢ = nᵢ·p − mᵢ with unit normals n and a = (n₂×n₃, n₃×n₁, n₁×n₂), so that Σ aᵢnᵢ = 0. Then c = Σ aᵢhᵢ is the same
/// everywhere, and the triangle has the area c²/|2 a₁a₂a₃|. Its vertex opposite to line i is at hᵢ = c/aᵢ, so its centroid
/// is at hᵢ = c/(3aᵢ).
#[derive(Clone, Copy, Debug)]
pub(crate) struct WithSpot<P> {
    /// The edges without the triangle.
    edges: P,
    /// The triangle.
    spot: Spot,
}

/// A small triangle between three displaced edges.
#[derive(Clone, Copy, Debug)]
struct Spot {
    /// aᵢ.
    weights: [f32; 3],
    /// 1/(3aᵢ).
    centroid: [f32; 3],
    /// Twice the brightness at the centroid for c = 1.
    peak: f32,
    /// Matrix of the quadratic form of distances from the centroid in the exponent, times two.
    form: [[f32; 3]; 3],
}

impl<P> WithSpot<P> {
    /// Creates the pattern for edges whose [`PAIRS`] have these correlations and that are displaced by `moved`, in units of
    /// the blur. Returns `None` if the triangle is too large.
    pub(crate) fn new(edges: P, rhos: [f64; PAIRS.len()], moved: [f64; 3]) -> Option<Self> {
        // The first normal is (1, 0).
        let angles = [0.0, rhos[0].acos(), rhos[1].acos()];
        let normals = angles.map(DVec2::from_angle);
        let a = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| normals[i].perp_dot(normals[j]));
        let c: f64 = -(0..3).map(|k| a[k] * moved[k]).sum::<f64>();
        let widest = (0..3).max_by(|&i, &j| a[i].abs().total_cmp(&a[j].abs()))?;
        let [i, j] = [(widest + 1) % 3, (widest + 2) % 3];
        // From distances to positions.
        let back = DMat2::from_cols(normals[i], normals[j]).transpose().inverse();
        let centroid = a.map(|a| 1.0 / (3.0 * a));
        let vertices = [0, 1, 2].map(|k| {
            let distance = |l: usize| c * (if l == k { 1.0 / a[l] } else { 0.0 } - centroid[l]);
            back * DVec2::new(distance(i), distance(j))
        });
        let moment = |of: fn(DVec2) -> f64| vertices.map(of).iter().sum::<f64>() / 12.0;
        let (xx, xy, yy) = (moment(|v| v.x * v.x), moment(|v| v.x * v.y), moment(|v| v.y * v.y));
        // False for NaN, which edges along the same line give.
        let is_small = xx + yy <= MAX_SPOT * MAX_SPOT;
        if !is_small {
            return None;
        }
        let cov = DMat2::from_cols_array(&[1.0 + xx, xy, xy, 1.0 + yy]);
        let inner = back.transpose() * cov.inverse() * back;
        let mut form = [[0.0; 3]; 3];
        for (row, k) in [(0, i), (1, j)] {
            for (col, l) in [(0, i), (1, j)] {
                form[k][l] = inner.col(col)[row] as f32;
            }
        }
        let area = 1.0 / (2.0 * a.iter().product::<f64>().abs());
        let peak = area / (std::f64::consts::PI * cov.determinant().sqrt());
        let spot = Spot {
            weights: a.map(|a| a as f32),
            centroid: centroid.map(|part| part as f32),
            peak: peak as f32,
            form,
        };
        Some(Self { edges, spot })
    }
}

impl<P: Pattern<3>> Pattern<3> for WithSpot<P> {
    fn shade(&self, distances: &Distances<3>, shades: &mut Shades<3>) {
        self.edges.shade(distances, shades);
        combine(&self.spot, distances, [], shades);
    }
}

impl Combination<3, 0> for Spot {
    #[inline(always)]
    fn at(&self, h: [f32; 3], mut shade: Shade<3>, _: [Shade<3>; 0]) -> Shade<3> {
        let (a, form) = (&self.weights, &self.form);
        let c = a[0] * h[0] + a[1] * h[1] + a[2] * h[2];
        let away: [f32; 3] = std::array::from_fn(|k| h[k] - self.centroid[k] * c);
        let pull: [f32; 3] = std::array::from_fn(|k| {
            form[k][0] * away[0] + form[k][1] * away[1] + form[k][2] * away[2]
        });
        let square = pull[0] * away[0] + pull[1] * away[1] + pull[2] * away[2];
        let spot = -self.peak * c.abs() * exp_negative(-0.5 * square);
        shade.f += spot * c;
        let by_c = 2.0
            + c * (pull[0] * self.centroid[0]
                + pull[1] * self.centroid[1]
                + pull[2] * self.centroid[2]);
        for k in 0..3 {
            shade.slopes[k] += spot * (a[k] * by_c - c * pull[k]);
        }
        shade
    }
}

/// Two edges whose halves are displaced in opposite directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parted<P> {
    /// The pattern without displacement.
    pub edges: P,
    /// The displacement.
    pub displaced: Displaced,
}

/// Displacements of two edges into areas of f = 1, in units of the blur.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Displaced(pub [f32; 2]);

impl Displaced {
    /// The sign with which the second edge is displaced where the first is displaced by d₁.
    #[inline(always)]
    fn sign(&self) -> f32 {
        if self.0[0] + self.0[1] < 0.0 { -1.0 } else { 1.0 }
    }
}

impl<P: Pattern<2>> Pattern<2> for Parted<P> {
    fn shade(&self, distances: &Distances<2>, shades: &mut Shades<2>) {
        let [d1, d2] = self.displaced.0;
        let d2 = self.displaced.sign() * d2;
        let mut behind = Shades::NONE;
        self.edges.shade(&distances.map(|[a, b]| [a + d1, b + d2]), shades);
        self.edges.shade(&distances.map(|[a, b]| [a - d1, b - d2]), &mut behind);
        combine(&self.displaced, distances, [&behind], shades);
    }
}

impl Combination<2, 1> for Displaced {
    #[inline(always)]
    fn at(&self, h: [f32; 2], ahead: Shade<2>, [behind]: [Shade<2>; 1]) -> Shade<2> {
        let (by, sign) = (self.0, self.sign());
        let (mut f, mut slopes) = (0.5 * (ahead.f + behind.f), mean(ahead.slopes, behind.slopes));
        let mut shifts = [
            0.5 * (ahead.slopes[0] - behind.slopes[0]),
            0.5 * sign * (ahead.slopes[1] - behind.slopes[1]),
        ];
        for k in 0..2 {
            let [there, back] = [h[k] + by[k], h[k] - by[k]];
            let [steep, flat] = [SLOPE * bell(there), SLOPE * bell(back)];
            f -= 0.5 * (erf_sqrt_half(there) - erf_sqrt_half(back));
            slopes[k] -= 0.5 * (steep - flat);
            shifts[k] -= 0.5 * (steep + flat);
        }
        let correlation = 0.5 * (ahead.correlations[0] + behind.correlations[0]);
        let boxed = mean(ahead.boxed, behind.boxed);
        Shade { f, slopes, correlations: [correlation, 0.0, 0.0], shifts, boxed, ..ahead }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::blurred_corner::{Deltille, WithPixel};
    use crate::refine::pattern::at;

    const THREE_EDGES: WithPixel<Deltille, 3> = WithPixel { edges: Deltille, strengths: [0.0; 3] };

    /// Integrates displaced edges over a Gaussian blur, and compares them with the patterns and their derivatives.
    #[test]
    fn displaced_edges_are_means_over_the_blur() {
        const STEPS: i32 = 160;
        let node = |i: i32| (f64::from(i) + 0.5) * 10.0 / f64::from(STEPS) - 5.0;
        let mean = |of: &dyn Fn([f64; 2]) -> f64| {
            let (mut sum, mut total) = (0.0, 0.0);
            for i in 0..STEPS * STEPS {
                let z = [node(i % STEPS), node(i / STEPS)];
                let weight = (-0.5 * (z[0] * z[0] + z[1] * z[1])).exp();
                sum += weight * of(z);
                total += weight;
            }
            sum / total
        };
        for case in 0..60 {
            let angles = [0.3, 1.2 + 0.01 * f64::from(case % 7), 2.3];
            let normals = angles.map(|angle: f64| [-angle.sin(), angle.cos()]);
            let rho =
                |i: usize, j: usize| normals[i][0] * normals[j][0] + normals[i][1] * normals[j][1];
            let place = [f64::from(case % 10) * 0.5 - 2.2, f64::from(case / 6) * 0.5 - 2.4];
            let far = |k: usize, z: [f64; 2]| {
                (place[0] + z[0]) * normals[k][0] + (place[1] + z[1]) * normals[k][1]
            };
            let h = [0, 1, 2].map(|k| far(k, [0.0; 2]));
            let sign = if case % 2 == 0 { 1.0 } else { -1.0 };
            let by: [f64; 2] = [1.1 * sign, 0.7 * sign];
            // Areas of f = −1 are grown, or those of f = 1.
            let two = mean(&|z| {
                let [a, b] = [far(0, z), far(1, z)];
                let grown = |x: f64, y: f64| x > -by[0].abs() && y > -by[1].abs();
                match sign > 0.0 {
                    true if grown(a, -b) || grown(-a, b) => -1.0,
                    true => 1.0,
                    false if grown(a, b) || grown(-a, -b) => 1.0,
                    false => -1.0,
                }
            });
            let edges = Orthant::new(rho(0, 1));
            let two_edges = WithPixel { edges, strengths: [0.0; 2] };
            let parted = |h: [f32; 2], by: [f32; 2]| {
                at(&Parted { edges: two_edges, displaced: Displaced(by) }, h)
            };
            let (h2, by2) = ([h[0] as f32, h[1] as f32], by.map(|by| by as f32));
            let found = parted(h2, by2);
            assert!((f64::from(found.f) - two).abs() < 4e-3, "{case}: {} or {two}", found.f);
            for k in 0..2 {
                let step = |to: [f32; 2], s: f32| {
                    std::array::from_fn(|j| if j == k { to[j] + s } else { to[j] })
                };
                let by_h = (parted(step(h2, 0.01), by2).f - parted(step(h2, -0.01), by2).f) / 0.02;
                let by_d = (parted(h2, step(by2, 0.01)).f - parted(h2, step(by2, -0.01)).f) / 0.02;
                assert!((by_h - found.slopes[k]).abs() < 3e-4, "{case}: {by_h}");
                assert!((by_d - found.shifts[k]).abs() < 3e-4, "{case}: {by_d}");
            }
            let off = [1.1 * sign, -0.8 * sign, 0.9 * sign];
            let three = mean(&|z| {
                let sum: f64 = [0, 1, 2]
                    .map(|k| (far(k, z) - off[k]).signum() * if k == 1 { -1.0 } else { 1.0 })
                    .iter()
                    .sum();
                sum.clamp(-1.0, 1.0)
            });
            let pairs = PAIRS.map(|[i, j]| Orthant::new(rho(i, j)));
            let triangle = Triangle { pairs, sign: sign as f32, narrower: [1.0; 3] };
            let inked = WithTriangle { edges: THREE_EDGES, triangle };
            let found = at(&inked, [0, 1, 2].map(|k| (h[k] - off[k]) as f32)).f;
            assert!((f64::from(found) - three).abs() < 4e-3, "{case}: {found} or {three}");
        }
    }

    /// Compares a spot with the triangle that it approximates, and every derivative with a difference quotient.
    #[test]
    fn a_small_triangle_is_a_spot() {
        for case in 0..200 {
            let angles = [0.2, 1.1 + 0.01 * f64::from(case % 30), 2.2];
            let rho = |i: usize, j: usize| f64::cos(angles[i] - angles[j]);
            let rhos = PAIRS.map(|[i, j]| rho(i, j));
            let sign = if case % 2 == 0 { 1.0 } else { -1.0 };
            let moved = [0.25 * sign, -0.2 * sign, 0.22 * sign];
            let spot = WithSpot::new(THREE_EDGES, rhos, moved).unwrap();
            let pairs = rhos.map(Orthant::new);
            let triangle = Triangle { pairs, sign: sign as f32, narrower: [1.0; 3] };
            let exact = WithTriangle { edges: THREE_EDGES, triangle };
            let place = [f64::from(case % 14) * 0.5 - 3.2, f64::from(case / 14) * 0.5 - 3.4];
            let h = [0, 1, 2].map(|k| {
                (place[1] * angles[k].cos() - place[0] * angles[k].sin() - moved[k]) as f32
            });
            let (found, expected) = (at(&spot, h), at(&exact, h));
            assert!((found.f - expected.f).abs() < 5e-4, "{case}: {} {}", found.f, expected.f);
            for k in 0..3 {
                assert!((found.slopes[k] - expected.slopes[k]).abs() < 1e-2, "{case}");
                let moved =
                    |by: f32| at(&spot, [0, 1, 2].map(|j| h[j] + if j == k { by } else { 0.0 })).f;
                let quotient = (moved(0.01) - moved(-0.01)) / 0.02;
                assert!((quotient - found.slopes[k]).abs() < 1e-3, "{case}: {quotient}");
            }
        }
        assert!(WithSpot::new(THREE_EDGES, [0.5, -0.5, 0.5], [1.0, -1.0, 1.0]).is_none());
        assert!(WithSpot::new(THREE_EDGES, [1.0, 0.5, 0.5], [0.1, -0.1, 0.1]).is_none());
    }
}
