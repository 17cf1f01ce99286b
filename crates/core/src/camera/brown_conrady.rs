use glam::{DVec2, DVec3};

use super::law::{Imaged, LensLaw, Ray};
use super::reach::{product, sign_changes, slope_times_q, stays_positive};

/// Smallest depth of a projected point, relative to its distance. Beyond 89.9° from the axis, a perspective
/// projection is meaningless.
const MIN_FORWARD: f64 = 0.002;

/// Steps of the radius in the search for the undistorted point, in focal lengths. They are far smaller than the
/// distance over which any usable polynomial folds back.
const RADIUS_STEP: f64 = 0.02;

/// Largest exponent of image growth. No polynomial here grows faster than r⁷. A rational lens does
/// so only where its denominator approaches zero.
const STEEPEST: f64 = 7.0;

/// Newton iterations from a start within [`RADIUS_STEP`]; five give full precision.
const ITERATIONS: usize = 20;

/// Perspective with radial, tangential and thin-prism distortion (Brown 1966, Conrady 1919), as in
/// OpenCV:
///
/// ```text
///     x = X/Z, y = Y/Z, r² = x² + y²
///     ρ = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
///     x' = x ρ + 2 p1 xy + p2 (r² + 2x²) + s1 r² + s2 r⁴
///     y' = y ρ + p1 (r² + 2y²) + 2 p2 xy + s3 r² + s4 r⁴
/// ```
///
/// Valid at angles below 89.9° from the axis up to the first radius at which r ρ stops increasing.
/// Parameters are in OpenCV's order:
/// k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.
///
/// The denominator has more freedom than lenses need. After a calibration, it often has a zero
/// within the image. A zero of the numerator next to it cancels it, except in a ring far narrower
/// than a pixel. Only the ring is invalid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrownConrady {
    /// Radial coefficients k1, k2, k3 of the numerator.
    pub radial: [f64; 3],
    /// Tangential coefficients p1, p2.
    pub tangential: [f64; 2],
    /// Radial coefficients k4, k5, k6 of the denominator.
    pub denominator: [f64; 3],
    /// Thin-prism coefficients s1, s2, s3, s4.
    pub prism: [f64; 4],
}

/// Radial factor at r² = q.
struct Radial {
    /// Factor ρ.
    rho: f64,
    /// Derivative ∂ρ/∂q.
    slope: f64,
    /// Denominator of ρ.
    below: f64,
    /// Whether ρ is positive and r ρ increases.
    valid: bool,
}

impl BrownConrady {
    fn radial(&self, q: f64) -> Radial {
        let [k1, k2, k3] = self.radial;
        let [k4, k5, k6] = self.denominator;
        let above = 1.0 + q * (k1 + q * (k2 + q * k3));
        let below = 1.0 + q * (k4 + q * (k5 + q * k6));
        let rho = above / below;
        let above_slope = k1 + q * (2.0 * k2 + q * 3.0 * k3);
        let below_slope = k4 + q * (2.0 * k5 + q * 3.0 * k6);
        let slope = (above_slope - rho * below_slope) / below;
        Radial { rho, slope, below, valid: rho > 0.0 && rho + 2.0 * q * slope > 0.0 }
    }

    /// Returns x', y' and ∂(x', y')/∂(x, y).
    fn distort(&self, DVec2 { x, y }: DVec2, radial: &Radial) -> (DVec2, [[f64; 2]; 2]) {
        let q = x * x + y * y;
        let Radial { rho, slope, .. } = *radial;
        let ([p1, p2], [s1, s2, s3, s4]) = (self.tangential, self.prism);
        let at = DVec2::new(
            x * rho + 2.0 * p1 * x * y + p2 * (q + 2.0 * x * x) + q * (s1 + q * s2),
            y * rho + p1 * (q + 2.0 * y * y) + 2.0 * p2 * x * y + q * (s3 + q * s4),
        );
        let (along_x, along_y) = (2.0 * (s1 + 2.0 * s2 * q), 2.0 * (s3 + 2.0 * s4 * q));
        let mixed = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let by_plane = [
            [
                rho + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + x * along_x,
                mixed + y * along_x,
            ],
            [
                mixed + x * along_y,
                rho + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + y * along_y,
            ],
        ];
        (at, by_plane)
    }

    /// Returns the radius r with r ρ(r) = `distorted`, to within a step.
    fn undistorted_radius(&self, distorted: f64) -> Option<f64> {
        let farthest = 1.0 / MIN_FORWARD;
        let (mut last, mut reached, mut r) = (0.0, 0.0, 0.0);
        while r < farthest {
            r += RADIUS_STEP * (1.0 + r);
            let radial = self.radial(r * r);
            let value = r * radial.rho;
            match radial.valid {
                true if value >= distorted => {
                    return Some(last + (r - last) * (distorted - reached) / (value - reached));
                }
                true => (last, reached) = (r, value),
                false if self.is_rational() => {}
                false => return Some(last),
            }
        }
        None
    }

    /// Returns whether the domain may have gaps.
    fn is_rational(&self) -> bool {
        self.denominator != [0.0; 3]
    }
}

impl LensLaw for BrownConrady {
    fn names(&self) -> Vec<String> {
        ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"]
            .map(str::to_owned)
            .to_vec()
    }

    fn parameters(&self) -> Vec<f64> {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        [[k1, k2, p1, p2, k3].as_slice(), &self.denominator, &self.prism].concat()
    }

    fn set_parameters(&mut self, values: &[f64]) {
        self.radial = [values[0], values[1], values[4]];
        self.tangential = [values[2], values[3]];
        self.denominator.copy_from_slice(&values[5..8]);
        self.prism.copy_from_slice(&values[8..12]);
    }

    fn least_coefficients(&self) -> Option<usize> {
        Some(0)
    }

    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        let least = MIN_FORWARD * MIN_FORWARD * point.length_squared();
        if !(point.z > 0.0 && point.z * point.z > least) {
            return None;
        }
        let nearness = 1.0 / point.z;
        let plane @ DVec2 { x, y } = point.truncate() * nearness;
        let q = plane.length_squared();
        let radial = self.radial(q);
        if !(radial.valid || self.is_rational()) {
            return None;
        }
        let (at, by_plane) = self.distort(plane, &radial);
        let by_point = by_plane.map(|[by_x, by_y]| {
            [by_x * nearness, by_y * nearness, -(x * by_x + y * by_y) * nearness]
        });
        let Radial { rho, below, .. } = radial;
        let (x_up, y_up) = (x / below, y / below);
        let up = |power: f64| [x_up * power, y_up * power];
        let down = |power: f64| up(-rho * power);
        by_parameters[..12].copy_from_slice(&[
            up(q),
            up(q * q),
            [2.0 * x * y, q + 2.0 * y * y],
            [q + 2.0 * x * x, 2.0 * x * y],
            up(q * q * q),
            down(q),
            down(q * q),
            down(q * q * q),
            [q, 0.0],
            [q * q, 0.0],
            [0.0, q],
            [0.0, q * q],
        ]);
        Some(Imaged { at, by_point })
    }

    fn covers(&self, DVec3 { x, y, z }: DVec3) -> bool {
        let q = (x * x + y * y) / (z * z);
        let [k1, k2, k3] = self.radial;
        match self.is_rational() {
            true => self.radial(q).valid,
            // ∂(r ρ)/∂r as a polynomial in r².
            false => stays_positive(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3], q),
        }
    }

    fn ray(&self, at: DVec2) -> Option<Ray> {
        let distorted = at.x.hypot(at.y);
        if distorted == 0.0 {
            return Ray::central(DVec3::Z);
        }
        let part = self.undistorted_radius(distorted)? / distorted;
        let mut plane = at * part;
        for _ in 0..ITERATIONS {
            let radial = self.radial(plane.length_squared());
            if !(radial.valid || self.is_rational()) {
                return None;
            }
            let (image, by_plane) = self.distort(plane, &radial);
            let step = solve(by_plane, at - image)?;
            plane += step;
            if step.length() <= 1e-15 * (1.0 + distorted) {
                break;
            }
        }
        Ray::central(plane.extend(1.0)).filter(|_| self.covers(plane.extend(1.0)))
    }

    /// With ρ = A/B and q = r², the image grows with the power
    ///
    /// ```text
    ///     ∂ ln(r ρ)/∂ ln r = 1 + 2 q (A'/A − B'/B)
    /// ```
    ///
    /// of r. It must stay between 0, where the image folds, and [`STEEPEST`].
    fn monotonic_radius(&self) -> Option<f64> {
        let with_one = |[a, b, c]: [f64; 3]| [1.0, a, b, c];
        let (above, below) = (with_one(self.radial), with_one(self.denominator));
        let both = product(&above, &below);
        let grow = product(&slope_times_q(&above), &below);
        let fall = product(&above, &slope_times_q(&below));
        let power_less = |power: f64| {
            let terms = both.iter().zip(&grow).zip(&fall);
            terms.map(|((ab, grow), fall)| (1.0 - power) * ab + 2.0 * (grow - fall)).collect()
        };
        let ends = [0.0, STEEPEST].map(|power| {
            let polynomial: Vec<f64> = power_less(power);
            sign_changes(&polynomial, MIN_FORWARD.powi(-2)).first().copied()
        });
        let q = ends.into_iter().flatten().reduce(f64::min)?;
        Some(q.sqrt() * self.radial(q).rho)
    }
}

/// Solves two linear equations.
pub(super) fn solve([[a, b], [c, d]]: [[f64; 2]; 2], right: DVec2) -> Option<DVec2> {
    let DVec2 { x: u, y: v } = right;
    let determinant = a * d - b * c;
    let solution = DVec2::new(d * u - b * v, a * v - c * u) / determinant;
    solution.is_finite().then_some(solution)
}
