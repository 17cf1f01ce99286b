//! Blur of a grid: a Gaussian, and motion along a line.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use crate::refine::blurred_corner::swept_edge;
use crate::refine::optics::MIN_MOTION;

/// Weight of the isotropic prior of a covariance, relative to the equation of one direction.
const ROUND: f64 = 0.01;

/// Minimum variance in any direction, relative to that of the sharpest edges. It keeps covariances positive definite.
/// Motion may blur another direction less than all edge directions.
const SHARPEST: f64 = 0.3;

/// First step of the search for a motion: in the logarithms of its length and of the remaining blur, and in radians.
const FIRST_STEP: f64 = 0.2;

/// Number of times that the step is halved.
const HALVINGS: usize = 4;

/// Blur of a grid in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridBlur {
    /// Covariance xx, xy, yy of the Gaussian, px²: lens, pixel and interpolation.
    pub covariance_px2: [f64; 3],
    /// Half of the motion, px.
    pub way_px: DVec2,
}

/// Blur across an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeBlur {
    /// Standard deviation of the Gaussian, px.
    pub sigma_px: f64,
    /// Half of the motion across the edge, px.
    pub way_px: f64,
}

impl EdgeBlur {
    /// Returns a Gaussian blur.
    pub(crate) fn gaussian(sigma_px: f64) -> Self {
        Self { sigma_px, way_px: 0.0 }
    }

    /// Returns the brightness at a signed distance from the edge, from −1 to 1.
    pub(crate) fn step(&self, distance_px: f64) -> f64 {
        let sigmas = |px: f64| (px / self.sigma_px) as f32;
        f64::from(swept_edge(sigmas(distance_px), sigmas(self.way_px)))
    }
}

/// A measured bilinear form aᵀ Σ b of the covariance of the blur, px².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    /// Coefficients of xx, xy and yy.
    pub row: [f64; 3],
    pub value_px2: f64,
}

/// Returns the coefficients of xx, xy and yy in aᵀ Σ b.
pub(crate) fn row(a: DVec2, b: DVec2) -> [f64; 3] {
    [a.x * b.x, a.x * b.y + a.y * b.x, a.y * b.y]
}

impl GridBlur {
    /// Returns the Gaussian whose variances across edges, nᵀ Σ n, fit the measured ones best, together with further
    /// measurements. Where these do not determine it, a weak prior makes it isotropic.
    pub(crate) fn gaussian(variances: &[Spread], others: &[Spread]) -> Self {
        let all = || variances.iter().map(|spread| spread.value_px2);
        let mean = all().sum::<f64>() / variances.len().max(1) as f64;
        let mut normal = Matrix3::<f64>::identity() * ROUND;
        let mut right = Vector3::new(mean, 0.0, mean) * ROUND;
        for &Spread { row, value_px2 } in variances.iter().chain(others) {
            let row = Vector3::from(row);
            normal += row * row.transpose();
            right += row * value_px2;
        }
        let solution =
            normal.try_inverse().map_or(Vector3::new(mean, 0.0, mean), |inverse| inverse * right);
        let [low, high, angle] = axes(solution.into());
        let least = SHARPEST * all().fold(mean, f64::min);
        let covariance_px2 = with_axes([low.max(least), high.max(least), angle]);
        Self { covariance_px2, way_px: DVec2::ZERO }
    }

    /// Returns the motion, and the Gaussian of all that remains, with the least `cost`. The search begins with the
    /// variances of this Gaussian blur. Returns `None` if these are nearly equal in all directions.
    pub(crate) fn as_motion(&self, cost: impl Fn(&Self) -> f64) -> Option<Self> {
        let [low, high, angle] = axes(self.covariance_px2);
        if high - low < MIN_MOTION * (high + low) {
            return None;
        }
        // The variance of a box is a third of the square of half its length.
        let half_px = (3.0 * (high - low)).sqrt();
        let blur = |[ln_sigma, ln_half, angle]: [f64; 3]| {
            let variance = (2.0 * ln_sigma).exp();
            let way_px = ln_half.exp() * DVec2::from_angle(angle);
            Self { covariance_px2: [variance, 0.0, variance], way_px }
        };
        let mut best = [low.ln() / 2.0, half_px.ln(), angle];
        let mut least = cost(&blur(best));
        let mut step = FIRST_STEP;
        for _ in 0..HALVINGS {
            let mut is_better = true;
            while std::mem::take(&mut is_better) {
                for (i, by) in [(0, step), (0, -step), (1, step), (1, -step), (2, step), (2, -step)]
                {
                    let mut moved = best;
                    moved[i] += by;
                    let moved_cost = cost(&blur(moved));
                    if moved_cost < least {
                        (best, least, is_better) = (moved, moved_cost, true);
                    }
                }
            }
            step /= 2.0;
        }
        Some(blur(best))
    }

    /// Returns whether a part of the blur is motion.
    pub(crate) fn is_motion(&self) -> bool {
        self.way_px != DVec2::ZERO
    }

    /// Returns the blur across an edge with this normal.
    pub(crate) fn across(&self, normal: DVec2) -> EdgeBlur {
        let [a, b, c] = row(normal, normal);
        let [xx, xy, yy] = self.covariance_px2;
        let variance = a * xx + b * xy + c * yy;
        EdgeBlur { sigma_px: variance.max(0.0).sqrt(), way_px: self.way_px.dot(normal) }
    }

    /// Returns the covariance xx, xy, yy with that of the motion, px².
    fn whole_px2(&self) -> [f64; 3] {
        let DVec2 { x, y } = self.way_px;
        let [xx, xy, yy] = self.covariance_px2;
        [xx + x * x / 3.0, xy + x * y / 3.0, yy + y * y / 3.0]
    }

    /// Returns the standard deviation, px, averaged over all directions.
    pub(crate) fn mean_px(&self) -> f64 {
        let [xx, _, yy] = self.whole_px2();
        (0.5 * (xx + yy)).sqrt()
    }

    /// Returns e₁ and e₂, by which the covariance is the mean variance times (1 + e₁, e₂; e₂, 1 − e₁).
    pub(crate) fn astigmatism(&self) -> [f64; 2] {
        let [xx, xy, yy] = self.whole_px2();
        [(xx - yy) / (xx + yy), 2.0 * xy / (xx + yy)]
    }
}

/// Returns the smallest and largest variance of a covariance xx, xy, yy, and the direction of the largest, radians.
fn axes([xx, xy, yy]: [f64; 3]) -> [f64; 3] {
    let (middle, half_difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = half_difference.hypot(xy);
    [middle - radius, middle + radius, xy.atan2(half_difference) / 2.0]
}

/// Returns the covariance with these axes.
fn with_axes([low, high, angle]: [f64; 3]) -> [f64; 3] {
    let (middle, radius) = (0.5 * (high + low), 0.5 * (high - low));
    let (sin, cos) = (2.0 * angle).sin_cos();
    [middle + radius * cos, radius * sin, middle - radius * cos]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variances across the edges of a lattice determine a Gaussian, and the shapes of their profiles a motion.
    #[test]
    fn profiles_of_three_edges_determine_a_motion() {
        let normals = [0.1, 1.2, 2.3].map(DVec2::from_angle);
        for (sigma_px, way_px) in [(0.8, DVec2::new(5.0, -4.0)), (1.5, DVec2::new(1.0, 6.0))] {
            let variance = sigma_px * sigma_px;
            let seen = GridBlur { covariance_px2: [variance, 0.0, variance], way_px };
            let spread = |normal: DVec2| {
                let EdgeBlur { sigma_px, way_px } = seen.across(normal);
                Spread {
                    row: row(normal, normal),
                    value_px2: sigma_px * sigma_px + way_px * way_px / 3.0,
                }
            };
            let gaussian = GridBlur::gaussian(&normals.map(spread), &[]);
            let [a, b] = [gaussian.astigmatism(), seen.astigmatism()];
            assert!((a[0] - b[0]).abs() < 0.05 && (a[1] - b[1]).abs() < 0.05, "{a:?} {b:?}");
            let cost = |blur: &GridBlur| {
                let error = |&normal: &DVec2| {
                    let [found, seen] = [blur, &seen].map(|blur| blur.across(normal));
                    (-20..=20)
                        .map(|d| (found.step(d.into()) - seen.step(d.into())).powi(2))
                        .sum::<f64>()
                };
                normals.iter().map(error).sum::<f64>()
            };
            let motion = gaussian.as_motion(cost).unwrap();
            let sign = motion.way_px.dot(way_px).signum();
            assert!((sign * motion.way_px).distance(way_px) < 0.3, "{motion:?}");
            assert!((motion.covariance_px2[0] - variance).abs() < 0.2 * variance, "{motion:?}");
        }
        let round =
            GridBlur::gaussian(&normals.map(|n| Spread { row: row(n, n), value_px2: 1.0 }), &[]);
        assert!(round.as_motion(|_| 0.0).is_none());
    }
}
