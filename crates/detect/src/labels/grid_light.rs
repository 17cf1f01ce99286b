//! Light and blur of a grid, measured before its tags are read: black and white at the edges of the tiles, and the
//! width of the edges.
//!
//! Let d be the signed distance from an edge, positive on the bright side. The brightness across the edge is
//!
//! ```text
//!     I(d) = o + a (S + κ (1 − S²)),     S = erf(d / √2σ),     σ² = nᵀ Σ n
//! ```
//!
//! with the normal n of the edge, the covariance Σ of the blur, and the curvature κ of the camera's tone curve. Edges
//! of several directions determine Σ. On checkerboards, which have only two directions, the brightness at the corners
//! completes it. If the blur is wider in one direction, S is also fitted as a Gaussian convolved with a box, as by
//! motion along a line at constant speed.
//!
//! Blur may spread the cells of a tag to its edges. Their mean brightness beside each edge is fitted too, as a step at
//! the distance at which tags begin.
//!
//! Limitations: the whole grid has one blur. Where white is saturated, less of the edge is visible: above a share θ of
//! white, everything is as bright as white, and S is clipped.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use glam::DVec2;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::grid_blur::{EdgeBlur, GridBlur, Spread, row};
use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::lattice::{GridKind, ROW_HEIGHT, Tile, Vertex};
use deltille_core::raster::ImageView;

/// Number of samples across an edge.
const ACROSS: usize = 13;

/// Positions along an edge that are averaged, far from its corners.
const ALONG: [f64; 3] = [0.38, 0.5, 0.62];

/// Number of edges that determine the blur. More edges gain nothing, because errors of the blur
/// model then dominate.
const BLUR_EDGES: usize = 150;

/// Ratio of successive standard deviations of the blur that are tried. The nearest is within 6 % of the true one.
const BLUR_STEP: f64 = 1.12;

/// Smallest standard deviation of the blur, px. Pixels and their interpolation are never sharper.
const MIN_BLUR_PX: f64 = 0.35;

/// Number of standard deviations that are tried. The last is 6 px, half a tile.
const BLUR_STEPS: i32 = 26;

/// Stride of the coarse search. A search of all steps around the best one follows.
const COARSE_STEPS: i32 = 4;

/// Number of edges per direction with which clipping and motion are searched for.
const SOME_EDGES: usize = 20;

/// Fraction of full scale from which a pixel may be saturated.
const SATURATED: f64 = 0.985;

/// Shares of white from which the sensor may saturate: white is overexposed up to eightfold.
const CLIPPED_SHARES: [f64; 8] = [1.0, 0.85, 0.65, 0.5, 0.35, 0.25, 0.18, 0.12];

/// Factor by which stronger clipping must reduce the sum of squares to be accepted. For the
/// sharp edges of a rendered page, whose white is at full scale, every share fits equally well.
const CLIPPING_GAIN: f64 = 1.5;

/// Minimum standard deviation of a sample, as a fraction of full scale: half a step of 8 bits.
const MIN_DEVIATION: f64 = 0.002;

/// Variance of the levels measured at an edge, relative to that of a sample. A few samples on either side determine
/// them.
const EDGE_VARIANCE: f64 = 0.16;

/// Standard deviation of the slopes of black and white over a tile, relative to the contrast. Steeper slopes are noise.
const SLOPE: f64 = 0.2;

/// Largest curvature of a tone curve. Gamma 2.6 between white and a black of 1/20 has 0.4.
const MAX_CURVATURE: f64 = 0.45;

/// Curvature below which the curve counts as straight. It changes a share of white by less than 0.0005, a quarter of
/// the rounding to 8 bits.
const STRAIGHT: f64 = 1e-3;

/// Determinant below which the equations of an edge have no solution. If S is ±1, the determinant is of the order of
/// the square of the number of samples. It vanishes if all S are the same.
const NO_EDGE: f64 = 1e-6;

/// Prior information that keeps the curvature at 0 where the samples do not determine it. Unit: the information of a
/// sample half-way up an edge.
const STRONG_PRIOR: f64 = 1e6;

/// The same where samples do determine the curvature: a tenth of a sample.
const WEAK_PRIOR: f64 = 0.1;

/// Prior information that keeps the brightness of tags, relative to their background, at 0 where no sample shows them.
/// They are half of the contrast brighter or darker, and a sample deviates by a tenth of that.
const TAG_PRIOR: f64 = 0.01;

/// Depth from the edge at which untagged tiles, bright and dark, are sampled, in tile coordinates.
const PLAIN_DEPTH: f64 = 0.2;

/// Minimum depth if a tag leaves less room.
const MIN_DEPTH: f64 = 0.06;

/// Distance from the edges of tiles to their tags, in tile coordinates; infinite without tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TagInsets {
    /// In dark tiles.
    pub dark: f64,
    /// In bright tiles.
    pub bright: f64,
}

/// Light and blur of a grid.
#[derive(Clone, Debug)]
pub(crate) struct GridLight {
    /// Lens, motion, pixel and interpolation together.
    pub blur: GridBlur,
    /// κ.
    pub tone: f64,
    /// θ: the share of white from which pixels are saturated; 1 if white is not saturated.
    pub clipped_share: f64,
    /// Standard deviation of a sample from the model, relative to the contrast.
    pub noise: f64,
    /// Sum of the squared residuals, relative to that of the contrasts.
    pub misfit: f64,
    /// Growth of dark areas on every side, in edges of tiles.
    shift: f64,
    kind: GridKind,
    insets: TagInsets,
}

/// Black and white over a tile, as planes of its coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    dark: [f64; 3],
    contrast: [f64; 3],
}

impl Levels {
    /// Returns the level of black at a point of the tile, and the contrast to white.
    pub(crate) fn at(&self, DVec2 { x: u, y: v }: DVec2) -> [f64; 2] {
        [self.dark, self.contrast].map(|[a, b, c]| a + b * u + c * v)
    }
}

/// An edge and the samples across it.
struct Profile {
    distances_px: [f64; ACROSS],
    values: [f64; ACROSS],
    normal: DVec2,
    /// Distances to the tags in the dark and the bright tile, px.
    tags_px: [f64; 2],
    saturated: bool,
    /// Variance of a sample, from the differences along the edge.
    variance: f64,
}

impl GridLight {
    /// Measures a grid whose dark areas have grown by `shift` edges on every side; `None` if too little of it is visible.
    pub(crate) fn of(
        image: ImageView,
        grid: &SaddleGrid,
        kind: GridKind,
        insets: TagInsets,
        shift: f64,
    ) -> Option<Self> {
        let directions = kind.steps().len() / 2;
        let mut light = Self {
            blur: GridBlur::gaussian(&[], &[]),
            tone: 0.0,
            clipped_share: 1.0,
            noise: 0.0,
            misfit: 0.0,
            shift,
            kind,
            insets,
        };
        let every = (grid.len() * directions).div_ceil(BLUR_EDGES).max(1);
        let edges = grid.keys().flat_map(|&v| (0..directions).map(move |k| (v, k)));
        let mut by_direction: Vec<Vec<Profile>> = (0..directions).map(|_| Vec::new()).collect();
        // Every nth edge, with n coprime to the number of directions, so that all directions are sampled.
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
            let least = MIN_DEVIATION * f64::from(image.full_scale());
            light.clipped_share = clipped_share(&by_direction, least);
        }
        let mut variances = Vec::new();
        let mut sigmas_px = Vec::new();
        for profiles in by_direction.iter().filter(|profiles| !profiles.is_empty()) {
            let (sigma_px, _) =
                best_width(&profiles.iter().collect::<Vec<_>>(), light.clipped_share);
            let share = 1.0 / profiles.len() as f64;
            let rows = profiles.iter().map(|profile| row(profile.normal, profile.normal));
            let mean = rows.fold([0.0; 3], |sum, row| [0, 1, 2].map(|i| sum[i] + share * row[i]));
            variances.push(Spread { row: mean, value_px2: sigma_px * sigma_px });
            sigmas_px.extend(std::iter::repeat_n(EdgeBlur::gaussian(sigma_px), profiles.len()));
        }
        let mut fitted = Fitted::of(all().zip(sigmas_px), light.clipped_share);
        light.set_tone(&fitted)?;
        light.blur = GridBlur::gaussian(&variances, &[]);
        if kind == GridKind::Checker {
            let diagonal = light.diagonal(image, grid);
            light.blur = GridBlur::gaussian(&variances, diagonal.as_slice());
        }
        let some: Vec<&Profile> = some_of(&by_direction).into_iter().flatten().collect();
        let cost = |blur: &GridBlur| {
            let fits = some.iter().map(|profile| (*profile, blur.across(profile.normal)));
            Fitted::of(fits, light.clipped_share).squares
        };
        if let Some(motion) = light.blur.as_motion(cost) {
            let swept = all().map(|profile| (profile, motion.across(profile.normal)));
            let swept = Fitted::of(swept, light.clipped_share);
            if swept.squares < fitted.squares {
                (fitted, light.blur) = (swept, motion);
                light.set_tone(&fitted)?;
            }
        }
        // Contrasts are twice the amplitude. Residuals of the fits include blur of another shape, but hardly any noise
        // where samples are denser than pixels.
        light.misfit = fitted.squares / fitted.power;
        let left = fitted.squares / fitted.freedom * ALONG.len() as f64;
        light.noise = left.max(fitted.variances / fitted.power).sqrt() / 2.0;
        Some(light)
    }

    /// Sets the curvature of the tone curve; `None` without contrast.
    fn set_tone(&mut self, fitted: &Fitted) -> Option<()> {
        if fitted.power <= 0.0 {
            return None;
        }
        self.tone = (fitted.curvature / fitted.power).clamp(-MAX_CURVATURE, MAX_CURVATURE);
        if self.clipped_share < 1.0 {
            self.tone = 0.0;
        }
        Some(())
    }

    /// Measures the blur along the diagonals of a checkerboard. With the correlation ρ of the blur across both edges, the
    /// brightness at a corner is 2/π asin ρ.
    fn diagonal(&self, image: ImageView, grid: &SaddleGrid) -> Option<Spread> {
        let steps = self.kind.steps();
        let every = grid.len().div_ceil(BLUR_EDGES).max(1);
        let (mut sum, mut rows, mut count) = (0.0, [0.0; 3], 0.0);
        for (&vertex, placed) in grid.iter().step_by(every) {
            let [Some(first), Some(second)] = [0, 1].map(|k| self.profile(image, grid, vertex, k))
            else {
                continue;
            };
            let next = grid[&(vertex + steps[1])].position - placed.position;
            // Both normals on the side of the tile between the steps.
            let towards = |normal: DVec2, step: DVec2| normal * normal.dot(step).signum();
            let along = grid[&(vertex + steps[0])].position - placed.position;
            let normals = [towards(first.normal, next), towards(second.normal, along)];
            let is_bright = first.normal.dot(next) > 0.0;
            let levels = [&first, &second].map(|profile| self.edge_levels(profile));
            let [Some(a), Some(b)] = levels else { continue };
            let DVec2 { x, y } = placed.position;
            let [dark, contrast] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let share = self.share((f64::from(image.bilinear(x, y)) - dark) / contrast);
            let brightness = (2.0 * share - 1.0).clamp(-1.0, 1.0);
            let rho = (FRAC_PI_2 * if is_bright { brightness } else { -brightness }).sin();
            let [s, t] = normals.map(|normal| self.blur.across(normal).sigma_px);
            sum += rho * s * t;
            let row = row(normals[0], normals[1]);
            rows = [0, 1, 2].map(|i| rows[i] + row[i]);
            count += 1.0;
        }
        (count > 0.0).then(|| Spread { row: rows.map(|of| of / count), value_px2: sum / count })
    }

    /// Returns the standard deviation of the blur, px, averaged over all directions.
    pub(crate) fn blur_px(&self) -> f64 {
        self.blur.mean_px()
    }

    /// Returns the share of white in a pixel. `brightness` is on the scale of black 0 and white 1.
    /// Above the clipped share, the result is a lower bound.
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

    /// Returns black and white over a tile, from the edges whose corners are in the grid.
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
            if !grid.contains_key(&from) || !grid.contains_key(&to) {
                continue;
            }
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

    /// Returns the level of black at an edge, and the contrast to white.
    fn edge_levels(&self, profile: &Profile) -> Option<[f64; 2]> {
        let blur = self.blur.across(profile.normal);
        let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::zeros());
        for (&d, &value) in profile.distances_px.iter().zip(&profile.values) {
            let [s, tag] = profile.shown(d, blur, self.clipped_share);
            let row = Vector3::new(1.0, s + self.tone * (1.0 - s * s), tag);
            normal += row * row.transpose();
            right += row * value;
        }
        if normal[(0, 0)] * normal[(1, 1)] - normal[(0, 1)].powi(2) < NO_EDGE {
            return None;
        }
        normal[(2, 2)] += TAG_PRIOR;
        let solution = normal.cholesky()?.solve(&right);
        let [middle, half] = [solution[0], solution[1]];
        (half > 0.0).then_some([middle - half, 2.0 * half])
    }

    /// Samples across the edge along step `k` from a vertex. Returns `None` if a tile next to it
    /// extends beyond the image.
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
        let [dark_depth, bright_depth] =
            [self.insets.dark, self.insets.bright].map(|inset| inset.clamp(MIN_DEPTH, PLAIN_DEPTH));
        let reach = [-dark_depth * dark_px, bright_depth * bright_px];
        let tags_px = [self.insets.dark * dark_px, self.insets.bright * bright_px];
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
            // A linear slope cancels; 1 + 4 + 1 variances remain.
            variance += (a - 2.0 * b + c).powi(2) / (6 * ACROSS) as f64;
            saturated += usize::from(*value >= full);
        }
        let saturated = saturated >= 2;
        let edge_px = match self.kind {
            GridKind::Deltille => known / ROW_HEIGHT,
            GridKind::Checker => known,
        };
        let distances_px = distances_px.map(|px| px - self.shift * edge_px);
        Some(Profile { distances_px, values, normal: bright, tags_px, saturated, variance })
    }
}

/// Sums over the fits of profiles.
#[derive(Default)]
struct Fitted {
    /// κ, weighted by the power.
    curvature: f64,
    /// Squares of half the contrast.
    power: f64,
    variances: f64,
    squares: f64,
    freedom: f64,
}

impl Fitted {
    fn of<'a>(profiles: impl Iterator<Item = (&'a Profile, EdgeBlur)>, clipped_share: f64) -> Self {
        let mut sums = Self::default();
        for (profile, blur) in profiles {
            if let Some(fit) = profile.fit(blur, clipped_share) {
                sums.curvature += fit.half_contrast * fit.curved;
                sums.power += fit.half_contrast.powi(2);
                sums.variances += profile.variance;
                sums.squares += fit.squares;
                sums.freedom += (ACROSS - 3) as f64 * fit.half_contrast.powi(2);
            }
        }
        sums
    }
}

struct ProfileFit {
    half_contrast: f64,
    /// κ times half the contrast.
    curved: f64,
    squares: f64,
}

impl Profile {
    /// Returns the visible part of S at a distance from the edge, if everything above a share of white looks white, and
    /// that of the tags beside it. Scale: black is −1, and apparent white is 1.
    fn shown(&self, distance_px: f64, blur: EdgeBlur, clipped_share: f64) -> [f64; 2] {
        let white = |distance_px: f64| 0.5 + 0.5 * blur.step(distance_px);
        let share = white(distance_px).min(clipped_share) / clipped_share;
        let beyond = |inset_px: f64, inside_px: f64| match inset_px.is_finite() {
            true => white(inside_px - inset_px),
            false => 0.0,
        };
        let [dark, bright] = self.tags_px;
        [2.0 * share - 1.0, beyond(dark, -distance_px) - beyond(bright, distance_px)]
    }

    /// Fits o, a, aκ and the brightness of the tags by least squares.
    fn fit(&self, blur: EdgeBlur, clipped_share: f64) -> Option<ProfileFit> {
        let mut normal = Matrix4::<f64>::zeros();
        let mut right = Vector4::zeros();
        let mut power = 0.0;
        for (&d, &value) in self.distances_px.iter().zip(&self.values) {
            let [s, tag] = self.shown(d, blur, clipped_share);
            let row = Vector4::new(1.0, s, 1.0 - s * s, tag);
            normal += row * row.transpose();
            right += row * value;
            power += value * value;
        }
        // Sharp edges have no samples that determine the curvature, and clipping resembles a
        // curvature.
        normal[(2, 2)] += if clipped_share < 1.0 { STRONG_PRIOR } else { WEAK_PRIOR };
        normal[(3, 3)] += TAG_PRIOR;
        let solution = normal.cholesky()?.solve(&right);
        let squares = (power - solution.dot(&right)).max(0.0);
        Some(ProfileFit { half_contrast: solution[1], curved: solution[2], squares })
    }
}

/// Returns the width of the blur, px, that fits edges of one direction best, and its sum of squares.
fn best_width(profiles: &[&Profile], clipped_share: f64) -> (f64, f64) {
    let coarse = best_step(profiles, clipped_share, (0..BLUR_STEPS).step_by(COARSE_STEPS as usize));
    let around = (coarse.0 - COARSE_STEPS + 1).max(0)..(coarse.0 + COARSE_STEPS).min(BLUR_STEPS);
    let (step, left) = best_step(profiles, clipped_share, around);
    (MIN_BLUR_PX * BLUR_STEP.powi(step), left)
}

/// Returns the step whose blur fits the profiles best, and its sum of squared residuals.
fn best_step(
    profiles: &[&Profile],
    clipped_share: f64,
    steps: impl Iterator<Item = i32>,
) -> (i32, f64) {
    let left = |step: i32| {
        let blur = EdgeBlur::gaussian(MIN_BLUR_PX * BLUR_STEP.powi(step));
        // If nothing of the edge remains visible, it cannot be fitted.
        let squares = profiles
            .iter()
            .map(|p| p.fit(blur, clipped_share).map_or(f64::INFINITY, |fit| fit.squares));
        squares.sum::<f64>()
    };
    let all = steps.map(|step| (step, left(step)));
    all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}

/// Returns some profiles of each direction.
fn some_of(by_direction: &[Vec<Profile>]) -> Vec<Vec<&Profile>> {
    let some = |profiles: &Vec<Profile>| profiles.len().div_ceil(SOME_EDGES).max(1);
    by_direction.iter().map(|profiles| profiles.iter().step_by(some(profiles)).collect()).collect()
}

/// Returns θ, the largest share for which edges of all directions fit nearly best, or fit within
/// the scatter of samples with this standard deviation.
fn clipped_share(by_direction: &[Vec<Profile>], deviation: f64) -> f64 {
    let some = some_of(by_direction);
    let left = |share: f64| some.iter().map(|profiles| best_width(profiles, share).1).sum::<f64>();
    let samples = ACROSS * some.iter().map(Vec::len).sum::<usize>();
    let tried = CLIPPED_SHARES.map(|share| (left(share), share));
    let least = tried.iter().map(|(left, _)| *left).fold(f64::INFINITY, f64::min);
    let limit = CLIPPING_GAIN * least.max(samples as f64 * deviation * deviation);
    tried.into_iter().find(|(left, _)| *left <= limit).map_or(1.0, |(_, share)| share)
}
