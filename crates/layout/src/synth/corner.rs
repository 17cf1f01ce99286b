//! One ideal corner, as simulated for Fig. 6 of the paper.
//!
//! The corner consists of K lines through a point of a plane, seen by a camera that is tilted by φ about an axis at α.
//! The image angles are atan2(sin(a − α), −cos φ · cos(a − α)) for a = 0°, 60°, 120° or 0°, 90°. Levels are multiplied
//! by a linear illumination, then the image is blurred. Each pixel is the mean over its square, by Gauss–Legendre
//! quadrature of the closed form of the blurred image: exact to 10⁻⁵ of full scale for blurs of 0.4
//! px or more (tests).
//!
//! ```
//! use deltille_layout::synth::SimulatedCorner;
//! use glam::DVec2;
//!
//! let corner = SimulatedCorner::seen_from(3, 0.3, 0.5, DVec2::new(10.2, 9.9), 1.0);
//! let image = corner.render(21, 21);
//! assert!((0.1..0.9).contains(&image.at(10, 10)));
//! ```

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_PI, PI};

use glam::DVec2;

use deltille_core::raster::Gray;

/// Number of quadrature nodes along each side of a pixel, on −1 … 1. The second rule is used for
/// blurs smaller than [`SMOOTH_BLUR_PX`].
const SMOOTH_RULE: usize = 3;
const SHARP_RULE: usize = 6;

/// Smallest blur for which the smaller rule is accurate enough, px.
const SMOOTH_BLUR_PX: f64 = 0.9;

/// Number of lines of a deltille corner.
const MAX_LINES: usize = 3;

/// Number of nodes of the orthant integral: accurate to 10⁻¹² for edges at least 20° apart.
const ORTHANT_RULE: usize = 16;

/// A corner of two (checker) or three (deltille) lines.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedCorner {
    /// Position, px.
    pub position: DVec2,
    /// Image angles of the lines, ascending within 180°, radians.
    pub angles: Vec<f64>,
    /// Standard deviation of the optical blur, px, without the averaging over the pixel.
    pub blur_px: f64,
    /// Half the contrast, as a fraction of full scale.
    pub amplitude: f64,
    /// Grey value midway between dark and bright, as a fraction of full scale.
    pub level: f64,
    /// Change of the relative illumination per pixel; the total change is 0 at `light_centre`.
    pub slope: DVec2,
    /// Position at which the relative illumination is 1, px.
    pub light_centre: DVec2,
}

impl SimulatedCorner {
    /// Returns an evenly lit corner of `lines` lines seen at tilt φ about an axis at α (radians), with levels 0.1 and
    /// 0.9.
    pub fn seen_from(
        lines: usize,
        axis_rad: f64,
        tilt_rad: f64,
        position: DVec2,
        blur_px: f64,
    ) -> Self {
        let mut angles: Vec<f64> = (0..lines)
            .map(|k| {
                let a = k as f64 * PI / lines as f64 - axis_rad;
                a.sin().atan2(-tilt_rad.cos() * a.cos()).rem_euclid(PI)
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        Self {
            position,
            angles,
            blur_px,
            amplitude: 0.4,
            level: 0.5,
            slope: DVec2::ZERO,
            light_centre: position,
        }
    }

    /// Renders the image before noise; full scale is 1.
    pub fn render(&self, width: usize, height: usize) -> Gray<f32> {
        let rules = self.rules();
        Gray::from_fn(width, height, |x, y| self.pixel(&rules, x as f64, y as f64) as f32)
    }

    /// Returns the brightness of the pixels of a square around (x, y), row by row.
    pub fn window(&self, [x, y]: [usize; 2], radius: usize) -> Vec<f64> {
        let rules = self.rules();
        let side = 2 * radius as isize + 1;
        (0..side * side)
            .map(|i| {
                let (du, dv) = (i % side - radius as isize, i / side - radius as isize);
                self.pixel(&rules, x as f64 + du as f64, y as f64 + dv as f64)
            })
            .collect()
    }

    fn rules(&self) -> Rules {
        let nodes = if self.blur_px < SMOOTH_BLUR_PX { SHARP_RULE } else { SMOOTH_RULE };
        let orthant = match self.angles[..] {
            [a, b] => {
                let range = (b - a).cos().asin();
                gauss_legendre(ORTHANT_RULE)
                    .into_iter()
                    .map(|(t, w)| {
                        let (sin, cos) = (range * (0.5 + 0.5 * t)).sin_cos();
                        [0.5 * range * w, sin, 0.5 / (cos * cos)]
                    })
                    .collect()
            }
            _ => Vec::new(),
        };
        let normals =
            self.angles.iter().take(MAX_LINES).map(|&a| DVec2::from_angle(a).perp()).collect();
        Rules { normals, pixel: gauss_legendre(nodes), orthant }
    }

    /// Returns the mean over the area of a pixel.
    fn pixel(&self, rules: &Rules, x: f64, y: f64) -> f64 {
        let mut sum = 0.0;
        for &(v, weight_v) in &rules.pixel {
            for &(u, weight_u) in &rules.pixel {
                let point = self.point(rules, DVec2::new(x + 0.5 * u, y + 0.5 * v));
                sum += 0.25 * weight_u * weight_v * point;
            }
        }
        sum
    }

    /// Returns the blurred image at a point. A linear factor g·p under a Gaussian of standard deviation s yields
    /// (g·p)(f∗G) + s² g·∇(f∗G).
    fn point(&self, rules: &Rules, p: DVec2) -> f64 {
        let off = p - self.position;
        let s = self.blur_px;
        let lines = rules.normals.len();
        let mut h = [0.0; MAX_LINES];
        for (h, n) in h.iter_mut().zip(&rules.normals) {
            *h = n.dot(off) / s;
        }
        let bell = |h: f64| (2.0 / PI).sqrt() * (-0.5 * h * h).exp();
        let mut slopes = [0.0; MAX_LINES];
        let mut f = 0.0;
        if lines == 2 {
            let ([h1, h2, _], [n1, n2]) = (h, [rules.normals[0], rules.normals[1]]);
            let rho = n1.dot(n2);
            let sine = (1.0 - rho * rho).sqrt();
            let (squares, product) = (h1 * h1 + h2 * h2, h1 * h2);
            let exponents = rules
                .orthant
                .iter()
                .map(|[w, sin, sec]| w * (-(squares - 2.0 * product * sin) * sec).exp());
            f = erf_sqrt_half(h1) * erf_sqrt_half(h2) + FRAC_2_PI * exponents.sum::<f64>();
            slopes[0] = bell(h1) * erf_sqrt_half((h2 - rho * h1) / sine);
            slopes[1] = bell(h2) * erf_sqrt_half((h1 - rho * h2) / sine);
        } else {
            for k in 0..lines {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                f += sign * erf_sqrt_half(h[k]);
                slopes[k] = sign * bell(h[k]);
            }
        }
        let towards_light: f64 =
            rules.normals.iter().zip(slopes).map(|(n, slope)| slope * n.dot(self.slope) / s).sum();
        let DVec2 { x: across, y: down } = self.slope * (p - self.light_centre);
        let light = 1.0 + across + down;
        (self.level + self.amplitude * f) * light + s * s * self.amplitude * towards_light
    }
}

struct Rules {
    /// Normals of the lines.
    normals: Vec<DVec2>,
    /// Nodes and weights on −1 … 1.
    pixel: Vec<(f64, f64)>,
    /// Weight, sin φ and 1/(2 cos² φ) of the orthant integral.
    orthant: Vec<[f64; 3]>,
}

fn erf_sqrt_half(h: f64) -> f64 {
    libm::erf(h * FRAC_1_SQRT_2)
}

/// Returns the Gauss–Legendre rule of n points on −1 … 1. Newton's method finds the roots of Pₙ.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let root = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut derivative = 1.0;
        // Convergence is quadratic, starting from an error of 0.1 %.
        for _ in 0..5 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 1..=n {
                let k = k as f64;
                (p, before) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k, p);
            }
            derivative = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / derivative;
        }
        (x, 2.0 / ((1.0 - x * x) * derivative * derivative))
    };
    (0..n).map(root).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_polynomials_up_to_its_degree() {
        for n in [SMOOTH_RULE, SHARP_RULE, ORTHANT_RULE] {
            for power in 0..2 * n {
                let integral: f64 =
                    gauss_legendre(n).iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((integral - exact).abs() < 1e-12, "{n} nodes, power {power}");
            }
        }
    }

    /// Compares with the definition: the sharp image times illumination, convolved with a finely sampled kernel.
    #[test]
    fn pixels_are_the_blurred_and_integrated_image() {
        for lines in [2, 3] {
            let corner = SimulatedCorner {
                slope: DVec2::new(0.004, -0.003),
                light_centre: DVec2::ZERO,
                ..SimulatedCorner::seen_from(lines, 0.4, 1.0, DVec2::new(8.3, 7.8), 0.5)
            };
            let image = corner.render(16, 16);
            let (step, reach) = (0.02, 125);
            for (x, y) in [(8, 8), (9, 7), (7, 8), (8, 6), (5, 9)] {
                let kernel: Vec<(f64, f64)> = (-reach..=reach)
                    .map(|i| {
                        let offset = (f64::from(i) + 0.5) * step;
                        let cdf = |t: f64| 0.5 * (1.0 + erf_sqrt_half(t / 0.5));
                        (offset, cdf(offset + 0.5) - cdf(offset - 0.5))
                    })
                    .collect();
                let (mut sum, mut weight) = (0.0, 0.0);
                for &(dv, wv) in &kernel {
                    for &(du, wu) in &kernel {
                        let p = DVec2::new(x as f64 + du, y as f64 + dv);
                        let side = |&a: &f64| DVec2::from_angle(a).perp_dot(p - corner.position);
                        let sign: f64 = corner.angles.iter().map(|a| side(a).signum()).product();
                        let light = 1.0 + corner.slope.dot(p);
                        sum += wu * wv * (0.5 + 0.4 * sign) * light;
                        weight += wu * wv;
                    }
                }
                let error = (f64::from(image.at(x, y)) - sum / weight).abs();
                assert!(error < 2e-3, "{lines} lines at ({x}, {y}): {error}");
            }
        }
    }
}
