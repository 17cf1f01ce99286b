//! What a grid tells about light and blur before its tags are read: black and white on the edges of its
//! tiles, and how wide the edges are.
//!
//! Across an edge, at the signed distance d from it, positive on the bright side, a picture shows
//!
//! ```text
//!     I(d) = o + a (S + κ (1 − S²)),     S = erf(d / √2σ),     σ² = nᵀ Σ n
//! ```
//!
//! with the edge's normal n, the covariance Σ of the blur, and κ the curvature of the camera's tone curve. Edges
//! of several directions give Σ, so that motion is a blur as well.
//!
//! Limits: motion is taken for the Gaussian of its variance, and one blur for the whole grid. Where white is
//! saturated the edge shows less of itself: a share θ of the way to white is as bright as white, and S is cut there.

use std::collections::BTreeMap;

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use crate::grid::saddle_grid::SaddleGrid;
use crate::refine::blurred_corner::erf_sqrt_half;
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::raster::ImageView;

/// Samples across an edge.
const ACROSS: usize = 13;

/// Places along an edge whose mean is taken, far from its corners.
const ALONG: [f64; 3] = [0.38, 0.5, 0.62];

/// Edges that tell the blur: more of them would tell it no better than the model of the blur is.
const BLUR_EDGES: usize = 150;

/// Each deviation of the blur that is tried is a tenth greater than the last, so that the true one is off by 6 % at most.
const BLUR_STEP: f64 = 1.12;

/// The least of them, px: sharper than pixels and their interpolation are.
const LEAST_BLUR_PX: f64 = 0.35;

/// How many there are: the last has 6 px, half a tile.
const BLUR_STEPS: i32 = 26;

/// Every so manieth of them is tried first, then those around the best.
const COARSE_STEPS: i32 = 4;

/// Edges of a direction that tell how much of white is clipped.
const CLIPPED_EDGES: usize = 20;

/// The part of the image's full scale from which a pixel may be saturated.
const SATURATED: f64 = 0.985;

/// Shares of white that may be as bright as the sensor tells: white is exposed up to eight times too much.
const CLIPPED_SHARES: [f64; 8] = [1.0, 0.85, 0.65, 0.5, 0.35, 0.25, 0.18, 0.12];

/// Less clipping is believed unless it leaves so many times the squares that more would leave: sharp edges of
/// a drawn page, where all white is full scale, fit any share.
const CLIPPING_GAIN: f64 = 1.5;

/// Deviation of a sample that any picture has, of full scale: half a step of 8 bits.
const LEAST_DEVIATION: f64 = 0.002;

/// Variance of the levels that an edge tells, over that of a sample: a few samples on either side tell them.
const EDGE_VARIANCE: f64 = 0.16;

/// Deviation of the slopes of black and white over a tile, over the contrast: steeper ones are noise.
const SLOPE: f64 = 0.2;

/// Largest curvature of a tone curve: that of gamma 2.6 between white and a black of a twentieth is 0.4.
const MOST_CURVATURE: f64 = 0.45;

/// A smaller curvature changes a share of white by less than half a thousandth, a quarter of what rounding to 8 bits does.
const STRAIGHT: f64 = 1e-3;

/// Of S = ±1 the determinant of an edge's equations is of the order of the square of the number of samples; this is one
/// whose S are all the same.
const NO_EDGE: f64 = 1e-6;

/// Prior information on the curvature where it is not told, over what a sample half-way up an edge tells: it stays 0.
const HELD: f64 = 1e6;

/// The same where it is told: a tenth of a sample.
const HARDLY_HELD: f64 = 0.1;

/// How far from the edges tiles are plain, in the units of tile coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClearDepth {
    /// In dark tiles.
    pub dark: f64,
    /// In bright tiles.
    pub bright: f64,
}

/// Light and blur of a grid.
#[derive(Clone, Debug)]
pub(crate) struct GridLight {
    /// Covariance of the blur xx, xy, yy, px²: lens, motion, pixel and interpolation together.
    pub blur_px2: [f64; 3],
    /// κ.
    pub tone: f64,
    /// θ: the share of white from which pixels are saturated, 1 where white is not.
    pub clipped_share: f64,
    /// Deviation of a sample from the model, over the contrast.
    pub noise: f64,
    kind: GridKind,
    clear: ClearDepth,
}

/// Black and white over a tile, as planes of its coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    dark: [f64; 3],
    contrast: [f64; 3],
}

impl Levels {
    /// Black at a point of the tile, and how much brighter white is.
    pub(crate) fn at(&self, DVec2 { x: u, y: v }: DVec2) -> [f64; 2] {
        [self.dark, self.contrast].map(|[a, b, c]| a + b * u + c * v)
    }
}

/// An edge and what was sampled across it.
struct Profile {
    distances_px: [f64; ACROSS],
    values: [f64; ACROSS],
    normal: DVec2,
    saturated: bool,
    /// Variance of a sample by what differs along the edge.
    variance: f64,
}

impl GridLight {
    /// That of a grid; `None` where too little of it is seen.
    pub(crate) fn of(
        image: ImageView,
        grid: &SaddleGrid,
        kind: GridKind,
        clear: ClearDepth,
    ) -> Option<Self> {
        let directions = kind.steps().len() / 2;
        let mut light = Self {
            blur_px2: [1.0, 0.0, 1.0],
            tone: 0.0,
            clipped_share: 1.0,
            noise: 0.0,
            kind,
            clear,
        };
        let every = (grid.len() * directions).div_ceil(BLUR_EDGES).max(1);
        let edges = grid.keys().flat_map(|&v| (0..directions).map(move |k| (v, k)));
        let mut by_direction: Vec<Vec<Profile>> = (0..directions).map(|_| Vec::new()).collect();
        // Every nth edge, with n prime to the number of directions, so that all have their share.
        let every = if every.is_multiple_of(directions) { every + 1 } else { every };
        for (vertex, k) in edges.step_by(every) {
            by_direction[k].extend(light.profile(image, grid, vertex, k));
        }
        let all = || by_direction.iter().flatten();
        let saturated = all().filter(|profile| profile.saturated).count();
        let count = all().count();
        if count < directions {
            return None;
        }
        if 2 * saturated > count {
            let least = LEAST_DEVIATION * f64::from(image.full_scale());
            light.clipped_share = clipped_share(&by_direction, least);
        }
        let (mut curvature, mut power) = (0.0, 0.0);
        let (mut squares, mut freedom) = (0.0, 0.0);
        let mut variances = 0.0;
        let mut widths = Vec::new();
        for profiles in by_direction.iter().filter(|profiles| !profiles.is_empty()) {
            let all: Vec<&Profile> = profiles.iter().collect();
            let (sigma_px, _) = best_width(&all, light.clipped_share);
            let mut outer = [0.0; 3];
            for profile in profiles {
                let DVec2 { x, y } = profile.normal;
                let share = 1.0 / profiles.len() as f64;
                outer = [0, 1, 2].map(|i| outer[i] + share * [x * x, 2.0 * x * y, y * y][i]);
                if let Some(fit) = profile.fit(sigma_px, light.clipped_share) {
                    curvature += fit.half_contrast * fit.curved;
                    power += fit.half_contrast.powi(2);
                    variances += profile.variance;
                    squares += fit.squares;
                    freedom += (ACROSS - 3) as f64 * fit.half_contrast.powi(2);
                }
            }
            widths.push((outer, sigma_px * sigma_px));
        }
        if power <= 0.0 {
            return None;
        }
        light.tone = (curvature / power).clamp(-MOST_CURVATURE, MOST_CURVATURE);
        if light.clipped_share < 1.0 {
            light.tone = 0.0;
        }
        // Contrasts are twice the amplitude. What the fits leave shows shapes of the blur that are no Gaussian, but
        // hardly noise, where samples lie closer than pixels.
        let left = squares / freedom * ALONG.len() as f64;
        light.noise = left.max(variances / power).sqrt() / 2.0;
        light.blur_px2 = covariance(&widths);
        Some(light)
    }

    /// Deviation of the blur in px, the mean of all directions.
    pub(crate) fn blur_px(&self) -> f64 {
        (0.5 * (self.blur_px2[0] + self.blur_px2[2])).sqrt()
    }

    /// The share of white that a pixel shows, of a brightness on the scale of black 0 and white 1; from
    /// the clipped share on it may be more.
    pub(crate) fn share(&self, brightness: f64) -> f64 {
        if self.clipped_share < 1.0 {
            return brightness * self.clipped_share;
        }
        let (kappa, v) = (self.tone, 2.0 * brightness - 1.0);
        if kappa.abs() < STRAIGHT {
            return brightness;
        }
        // v = S + κ(1 − S²).
        let under = 1.0 - 4.0 * kappa * (v - kappa);
        let s = (1.0 - under.max(0.0).sqrt()) / (2.0 * kappa);
        0.5 + 0.5 * s
    }

    /// Black and white over a tile whose corners are in the grid.
    pub(crate) fn levels(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        tile: Tile,
        known: &mut BTreeMap<(Vertex, usize), Option<[f64; 2]>>,
    ) -> Option<Levels> {
        let vertices: Vec<Vertex> = tile.vertices().collect();
        let [a, b, c] = tile.frame();
        let place = |v: Vertex| {
            if v == a {
                [0.0, 0.0]
            } else if v == b {
                [1.0, 0.0]
            } else if v == c {
                [0.0, 1.0]
            } else {
                [1.0, 1.0]
            }
        };
        let DVec2 { x: mu, y: mv } = self.kind.middle();
        let mut normal = Matrix3::<f64>::zeros();
        let slopes = EDGE_VARIANCE * (self.noise / SLOPE).powi(2);
        (1..3).for_each(|i| normal[(i, i)] = slopes);
        let mut right = [Vector3::zeros(); 2];
        for i in 0..vertices.len() {
            let (from, to) = (vertices[i], vertices[(i + 1) % vertices.len()]);
            let steps = self.kind.steps();
            let k = steps.iter().position(|&step| step == to - from)?;
            let half = steps.len() / 2;
            let edge = if k < half { (from, k) } else { (to, k - half) };
            let levels = *known
                .entry(edge)
                .or_insert_with(|| self.edge_levels(&self.profile(image, grid, edge.0, edge.1)?));
            let [dark, contrast] = levels?;
            let ([u0, v0], [u1, v1]) = (place(from), place(to));
            let row = Vector3::new(1.0, 0.5 * (u0 + u1) - mu, 0.5 * (v0 + v1) - mv);
            normal += row * row.transpose();
            right[0] += row * dark;
            right[1] += row * contrast;
        }
        let inverse = normal.try_inverse()?;
        let [dark, contrast] = right.map(|right| {
            let [middle, a, b]: [f64; 3] = (inverse * right).into();
            [middle - a * mu - b * mv, a, b]
        });
        Some(Levels { dark, contrast })
    }

    /// Black at an edge, and how much brighter white is.
    fn edge_levels(&self, profile: &Profile) -> Option<[f64; 2]> {
        let DVec2 { x, y } = profile.normal;
        let [xx, xy, yy] = self.blur_px2;
        let sigma_px = (x * x * xx + 2.0 * x * y * xy + y * y * yy).max(0.0).sqrt();
        let (mut n, mut s1, mut s2, mut v1, mut v2) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (&d, &value) in profile.distances_px.iter().zip(&profile.values) {
            let s = shown(d, sigma_px, self.clipped_share);
            let s = s + self.tone * (1.0 - s * s);
            n += 1.0;
            s1 += s;
            s2 += s * s;
            v1 += value;
            v2 += s * value;
        }
        let determinant = n * s2 - s1 * s1;
        if determinant < NO_EDGE {
            return None;
        }
        let half = (n * v2 - s1 * v1) / determinant;
        let middle = (s2 * v1 - s1 * v2) / determinant;
        (half > 0.0).then_some([middle - half, 2.0 * half])
    }

    /// What lies across the edge along step `k` from a vertex; `None` where a tile beside it leaves the image.
    fn profile(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        vertex: Vertex,
        k: usize,
    ) -> Option<Profile> {
        let steps = self.kind.steps();
        let at = |v: Vertex| grid.get(&v).map(|placed| placed.position);
        let (p, q) = (at(vertex)?, at(vertex + steps[k])?);
        let along = q - p;
        // Left of the edge on the print; y runs down in the image.
        let left = -along.perp() / along.x.hypot(along.y);
        let third = match self.kind {
            GridKind::Deltille => 1,
            GridKind::Checker => steps.len() / 4,
        };
        let far = [k + third, k + steps.len() - third].map(|k| at(vertex + steps[k % steps.len()]));
        let height = |far: Option<DVec2>| far.map(|far| (far - p).dot(left).abs());
        let heights = far.map(height);
        let known = heights[0].or(heights[1])?;
        let odd = k + if self.kind == GridKind::Checker {
            (vertex.row + vertex.col).rem_euclid(2) as usize
        } else {
            0
        };
        let dark_left = odd.is_multiple_of(2);
        let [left_px, right_px] = heights.map(|height| height.unwrap_or(known));
        let (dark_px, bright_px) =
            if dark_left { (left_px, right_px) } else { (right_px, left_px) };
        let bright = if dark_left { -left } else { left };
        let reach = [-self.clear.dark * dark_px, self.clear.bright * bright_px];
        let (right, lower) = (image.width() as f64 - 1.0, image.height() as f64 - 1.0);
        let mut saturated = 0;
        let full = SATURATED * f64::from(image.full_scale());
        let distances_px: [f64; ACROSS] = std::array::from_fn(|j| {
            reach[0] + (reach[1] - reach[0]) * j as f64 / (ACROSS - 1) as f64
        });
        let mut values = [0.0; ACROSS];
        let mut variance = 0.0;
        for (j, value) in values.iter_mut().enumerate() {
            let mut samples = [0.0; ALONG.len()];
            for (sample, t) in samples.iter_mut().zip(ALONG) {
                let DVec2 { x, y } = p + t * along + distances_px[j] * bright;
                if !(x >= 0.0 && y >= 0.0 && x <= right && y <= lower) {
                    return None;
                }
                *sample = f64::from(image.bilinear(x, y));
            }
            let [a, b, c] = samples;
            *value = (a + b + c) / 3.0;
            // What rises evenly cancels; 1 + 4 + 1 variances are left.
            variance += (a - 2.0 * b + c).powi(2) / (6 * ACROSS) as f64;
            saturated += usize::from(*value >= full);
        }
        let saturated = saturated >= 2;
        Some(Profile { distances_px, values, normal: bright, saturated, variance })
    }
}

/// What is left of S at a distance from an edge where everything from a share of white on looks white: on the
/// scale of black −1 and what looks white 1.
fn shown(distance_px: f64, sigma_px: f64, clipped_share: f64) -> f64 {
    let s = f64::from(erf_sqrt_half((distance_px / sigma_px) as f32));
    let share = (0.5 + 0.5 * s).min(clipped_share) / clipped_share;
    2.0 * share - 1.0
}

struct ProfileFit {
    half_contrast: f64,
    /// κ times the half contrast.
    curved: f64,
    squares: f64,
}

impl Profile {
    /// Least squares for o, a and aκ.
    fn fit(&self, sigma_px: f64, clipped_share: f64) -> Option<ProfileFit> {
        let mut normal = Matrix3::<f64>::zeros();
        let mut right = Vector3::zeros();
        let mut power = 0.0;
        for (&d, &value) in self.distances_px.iter().zip(&self.values) {
            let s = shown(d, sigma_px, clipped_share);
            let row = Vector3::new(1.0, s, 1.0 - s * s);
            normal += row * row.transpose();
            right += row * value;
            power += value * value;
        }
        // Sharp edges have no samples that tell the curvature, and what is cut off looks like it.
        normal[(2, 2)] += if clipped_share < 1.0 { HELD } else { HARDLY_HELD };
        let solution = normal.cholesky()?.solve(&right);
        let squares = (power - solution.dot(&right)).max(0.0);
        Some(ProfileFit { half_contrast: solution[1], curved: solution[2], squares })
    }
}

/// The width of the blur across edges of one direction that leaves least, px, and what it leaves.
fn best_width(profiles: &[&Profile], clipped_share: f64) -> (f64, f64) {
    let coarse = best_step(profiles, clipped_share, (0..BLUR_STEPS).step_by(COARSE_STEPS as usize));
    let around = (coarse.0 - COARSE_STEPS + 1).max(0)..(coarse.0 + COARSE_STEPS).min(BLUR_STEPS);
    let (step, left) = best_step(profiles, clipped_share, around);
    (LEAST_BLUR_PX * BLUR_STEP.powi(step), left)
}

/// Of some steps of the blur's deviation the one that leaves least, and what it leaves.
fn best_step(
    profiles: &[&Profile],
    clipped_share: f64,
    steps: impl Iterator<Item = i32>,
) -> (i32, f64) {
    let left = |step: i32| {
        let sigma_px = LEAST_BLUR_PX * BLUR_STEP.powi(step);
        // Where nothing of the edge is left it cannot be fitted.
        let squares = profiles
            .iter()
            .map(|p| p.fit(sigma_px, clipped_share).map_or(f64::INFINITY, |fit| fit.squares));
        squares.sum::<f64>()
    };
    let all = steps.map(|step| (step, left(step)));
    all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}

/// θ: the largest with which some edges of all directions leave nearly the least, or no more than samples of this
/// deviation do.
fn clipped_share(by_direction: &[Vec<Profile>], deviation: f64) -> f64 {
    let some: Vec<Vec<&Profile>> = by_direction
        .iter()
        .map(|profiles| {
            profiles.iter().step_by(profiles.len().div_ceil(CLIPPED_EDGES).max(1)).collect()
        })
        .collect();
    let left = |share: f64| some.iter().map(|profiles| best_width(profiles, share).1).sum::<f64>();
    let samples = ACROSS * some.iter().map(Vec::len).sum::<usize>();
    let tried = CLIPPED_SHARES.map(|share| (left(share), share));
    let least = tried.iter().map(|(left, _)| *left).fold(f64::INFINITY, f64::min);
    let limit = CLIPPING_GAIN * least.max(samples as f64 * deviation * deviation);
    tried.into_iter().find(|(left, _)| *left <= limit).map_or(1.0, |(_, share)| share)
}

/// The covariance Σ whose variances nᵀΣn are those given, as nearly as one can; a little rounder where the directions
/// do not tell it.
fn covariance(widths: &[([f64; 3], f64)]) -> [f64; 3] {
    /// Weight of being round, against one direction's equation.
    const ROUND: f64 = 0.01;
    /// Least variance in any direction, over that of the sharpest edges. It stays a covariance so, and motion may blur another
    /// direction less than all those of edges. From 0.15 to 0.6 tags read under strong motion change by 0.8 %; with 1 there are
    /// 2 % fewer.
    const SHARPEST: f64 = 0.3;
    let mean = widths.iter().map(|w| w.1).sum::<f64>() / widths.len().max(1) as f64;
    let mut normal = Matrix3::<f64>::identity() * ROUND;
    let mut right = Vector3::new(mean, 0.0, mean) * ROUND;
    for &(row, variance) in widths {
        let row = Vector3::from(row);
        normal += row * row.transpose();
        right += row * variance;
    }
    let solution =
        normal.try_inverse().map_or(Vector3::new(mean, 0.0, mean), |inverse| inverse * right);
    // Never sharper than the sharpest direction, so that it stays a covariance.
    let least = widths.iter().map(|w| w.1).fold(mean, f64::min) * SHARPEST;
    let (half_sum, half_difference) =
        (0.5 * (solution.x + solution.z), 0.5 * (solution.x - solution.z));
    let radius = half_difference.hypot(solution.y);
    let (low, high) = ((half_sum - radius).max(least), (half_sum + radius).max(least));
    let scale = if radius > 0.0 { 0.5 * (high - low) / radius } else { 0.0 };
    let middle = 0.5 * (high + low);
    [middle + scale * half_difference, scale * solution.y, middle - scale * half_difference]
}
