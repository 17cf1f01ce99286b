//! A corner fitted to raw pixels: the model of METHOD §4, by Levenberg–Marquardt.
//!
//! ```text
//!     I(u,v) = level + amplitude · T(f(h₁ … h_K)·g + (g − 1)·r),      g = 1 + g_u u + g_v v
//!     h_k    = (cos θ_k · (v − y) − sin θ_k · (u − x) − ½ κ_k t²) / s_k
//!     t      =  cos θ_k · (u − x) + sin θ_k · (v − y)
//!     s_k²   = s² · nᵀ M n,      n = (−sin θ_k, cos θ_k)
//! ```
//!
//! T is the camera's tone curve between the corner's black and white, r the sum of their light over
//! its difference ([`super::curve`]); of a linear camera T(S) = S and I = (level + amplitude·f)·g.
//! M, of trace 2, tells in which direction the picture is blurred more. Both, and halos in f, are the
//! same all over a picture and given: [`super::optics`]. What is brighter than white or darker than black
//! is seen as these; where pixels are, the model ends there too, so that they only count where it does not.
//!
//! Edges have curvatures κ where a lens bends them, which are given: a window is too small to tell
//! them from the position. (u, v) are pixels from the window's centre, f is the blurred corner of
//! [`super::blurred_corner`]. The blur s holds the pixel's own box as a variance of 1/12: against
//! exact integration that costs nothing measurable from 0.5 px of blur upwards (docs/measurements).
//! The slopes g are drawn to 0 by a weak prior, all else is free.
//!
//! The covariance is σ² (JᵀJ + prior)⁻¹ with the noise σ estimated from the residuals. It is honest
//! where the noise is white and the window shows nothing but the corner; JPEG's noise is not white.

use multiversion::multiversion;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::blurred_corner::{Deltille, Haloed, Orthant, Pattern, Shade};
use super::correlation::Influence;
use super::curve::Piece;
use super::optics::Optics;
use crate::raster::{Gray, Intensity};

/// Largest radius of a window, px.
pub const MAX_RADIUS: usize = 15;

/// Numbers that the widest processors work on at once.
const LANES: usize = 16;

/// Pixels of the largest window, rounded up to whole vectors.
const MAX_PIXELS: usize = ((2 * MAX_RADIUS + 1) * (2 * MAX_RADIUS + 1)).next_multiple_of(LANES);

/// Parameters of three edges; two leave the last one unused.
const PARAMS: usize = 10;

/// Places of the parameters: x, y, ln s, amplitude, level, g_u, g_v, then the angles.
const X: usize = 0;
const Y: usize = 1;
const LN_BLUR: usize = 2;
const AMPLITUDE: usize = 3;
const LEVEL: usize = 4;
const SLOPE: usize = 5;
const ANGLE: usize = 7;

/// Prior standard deviation of the illumination's relative slope, 1/px: 10 % across 200 px.
/// Light that falls to a tenth across 1600 px has 0.0014, which a window of 21 px still tells.
pub const SLOPE_PRIOR: f64 = 0.0005;

/// Most evaluations of the model; five are usual.
const MAX_EVALUATIONS: usize = 25;

/// The iteration ends with a step whose squared length, in standard deviations of the estimate, is
/// below this; the next would be smaller by orders of magnitude.
const CONVERGED: f64 = 0.01;

/// Black and white that differ by less than this part of the contrast have the same piece of a tone curve:
/// its curvature, at most a third, changes by as small a part of itself.
const SAME_LIGHT: f64 = 0.01;

/// Noise assumed at least, of the amplitude, so that noiseless images converge too.
const MIN_NOISE: f64 = 2e-5;

/// Blurs that can be told apart within a window: from that of a pixel's box to half the radius.
const MIN_BLUR_PX: f64 = 0.2;

/// A corner may not leave its start by more than this, px: the start is the polynomial's result.
pub const MAX_WAY_PX: f64 = 1.5;

/// Edges closer than this are one edge, or a wrong minimum: 75° of tilt leave 17°.
const MIN_ANGLE_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// Residuals larger than this part of the amplitude: the window shows something else.
const MAX_RESIDUAL: f64 = 0.35;

/// A position less certain than this is none, px.
const MAX_SIGMA_PX: f64 = 1.0;

/// Limits of a sensor that nothing reaches.
const UNLIMITED: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// A corner of K edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner<const K: usize> {
    /// Position, px.
    pub position: [f64; 2],
    /// Standard deviation of the blur with the pixel's box in it, px.
    pub blur_px: f64,
    /// Half the contrast, of full scale; negative when the sector before the first edge is dark.
    pub amplitude: f64,
    /// Half-way between dark and bright, of full scale.
    pub level: f64,
    /// Relative change of the illumination per pixel.
    pub slope: [f64; 2],
    /// Image angles of the edges, rising within a half-turn, radians.
    pub angles: [f64; K],
    /// Curvatures of the edges, to the left of their directions (to greater v of u), 1/px.
    pub bends: [f64; K],
}

/// A fitted corner and what is known about its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted<const K: usize> {
    /// The corner.
    pub corner: Corner<K>,
    /// Covariance xx, xy, yy of the position, px².
    pub cov: [f64; 3],
    /// Standard deviation of the noise, of full scale.
    pub noise: f64,
}

/// Pixels around a corner, by their distance from the pixel in the middle.
#[derive(Clone, Debug)]
pub struct Window {
    radius: usize,
    count: usize,
    /// Columns, padded with zeros to whole vectors.
    u: Vec<f32>,
    /// Rows alike.
    v: Vec<f32>,
}

impl Window {
    /// The window of (2 · radius + 1)² pixels; radii above [`MAX_RADIUS`] are cut to it.
    pub fn new(radius: usize) -> Self {
        Self::of(radius, |_| true)
    }

    /// Those pixels (u, v) of such a window that are `seen`.
    pub fn of(radius: usize, seen: impl Fn([f64; 2]) -> bool) -> Self {
        let radius = radius.min(MAX_RADIUS);
        let reach = radius as i32;
        let places = (-reach..=reach).flat_map(|v| (-reach..=reach).map(move |u| [u, v]));
        let seen = places.filter(|place| seen(place.map(f64::from)));
        let (mut u, mut v): (Vec<f32>, Vec<f32>) = seen.map(|[u, v]| (u as f32, v as f32)).unzip();
        let count = u.len();
        u.resize(count.next_multiple_of(LANES), 0.0);
        v.resize(count.next_multiple_of(LANES), 0.0);
        Self { radius, count, u, v }
    }

    /// Half the side, px.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// How many pixels.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The pixels, each with its place (u, v); `None` where one lies outside the image.
    pub fn pixels<'a, T: Intensity>(
        &'a self,
        image: &'a Gray<T>,
        [x, y]: [usize; 2],
    ) -> Option<impl Iterator<Item = ([f32; 2], f32)> + 'a> {
        let inside = x >= self.radius
            && y >= self.radius
            && x + self.radius < image.width()
            && y + self.radius < image.height();
        let places = self.u[..self.count].iter().zip(&self.v[..self.count]);
        let at = move |u: f32, v: f32| {
            (x.wrapping_add_signed(u as isize), y.wrapping_add_signed(v as isize))
        };
        let is_in_image = |(&u, &v): (&f32, &f32)| {
            let (x, y) = at(u, v);
            x < image.width() && y < image.height()
        };
        let read = move |(&u, &v): (&f32, &f32)| {
            let (x, y) = at(u, v);
            ([u, v], image.at(x, y).to_f32() / T::FULL_SCALE)
        };
        (inside || places.clone().all(is_in_image)).then(|| places.map(read))
    }
}

/// One row a parameter, then the residual; a column a pixel.
type Columns = [[f32; MAX_PIXELS]; PARAMS + 1];

/// Fits corners; holds the work space, so one fitter serves one thread.
#[derive(Clone, Debug)]
pub struct CornerFitter {
    /// Pixels of full scale 1.
    pixels: Box<[f32; MAX_PIXELS]>,
    /// Derivatives by the parameters, then the residual.
    columns: Box<Columns>,
    /// Black and white that pixels have reached, or beyond all.
    limits: [f32; 2],
}

impl Default for CornerFitter {
    fn default() -> Self {
        Self {
            pixels: Box::new([0.0; MAX_PIXELS]),
            columns: Box::new([[0.0; MAX_PIXELS]; PARAMS + 1]),
            limits: UNLIMITED,
        }
    }
}

/// The normal equations of a corner and the optics.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// How many of the parameters are the corner's.
    pub own: usize,
    /// JᵀJ with the prior on the slopes.
    pub matrix: DMatrix<f64>,
    /// Jᵀr alike.
    pub gradient: DVector<f64>,
    /// rᵀr.
    pub cost: f64,
    /// Standard deviation of the residuals.
    pub noise: f64,
}

/// The normal equations at one place.
#[derive(Clone, Copy, Debug)]
struct Normal {
    /// JᵀJ, with ones for parameters that are not there.
    matrix: SMatrix<f64, PARAMS, PARAMS>,
    /// Jᵀr.
    gradient: SVector<f64, PARAMS>,
    /// rᵀr.
    cost: f64,
}

/// What the optics make of a corner with K edges.
#[derive(Clone, Copy, Debug)]
struct Look<const K: usize> {
    /// 1/s_k, 1/px.
    sharpness: [f64; K],
    /// ∂ ln s_k/∂θ_k.
    by_turn: [f64; K],
    /// Correlation of the blur along the first two normals, and its derivatives by their angles.
    rho: f64,
    rho_by_angle: [f64; 2],
    /// Curve between black and white.
    piece: Piece,
    /// Strength of the halo, and its width over that of the blur.
    halo: [f32; 2],
    /// The darkest and the brightest that is seen.
    limits: [f32; 2],
}

impl<const K: usize> Look<K> {
    fn of(corner: &Corner<K>, optics: &Optics, piece: Piece, limits: [f32; 2]) -> Self {
        let [e1, e2] = optics.astigmatism;
        let normals = corner.angles.map(|angle| [-angle.sin(), angle.cos()]);
        let tangents = corner.angles.map(|angle| [-angle.cos(), -angle.sin()]);
        let product = |a: [f64; 2], b: [f64; 2]| {
            (1.0 + e1) * a[0] * b[0] + e2 * (a[0] * b[1] + a[1] * b[0]) + (1.0 - e1) * a[1] * b[1]
        };
        let squares = normals.map(|n| product(n, n));
        let by_turn = std::array::from_fn(|k| product(tangents[k], normals[k]) / squares[k]);
        let lengths = (squares[0] * squares[1]).sqrt();
        let rho = product(normals[0], normals[1]) / lengths;
        let rho_by_angle = [
            product(tangents[0], normals[1]) / lengths - rho * by_turn[0],
            product(normals[0], tangents[1]) / lengths - rho * by_turn[1],
        ];
        Self {
            sharpness: squares.map(|square| 1.0 / (corner.blur_px * square.sqrt())),
            by_turn,
            rho,
            rho_by_angle,
            piece,
            halo: optics.halo.map(|h| h as f32),
            limits,
        }
    }

    fn haloed<P>(&self, pattern: P) -> Haloed<P> {
        let [strength, width] = self.halo;
        Haloed { pattern, strength, narrower: 1.0 / width }
    }
}

impl CornerFitter {
    /// The corner near `start`; `None` when the window leaves the image or the fit is no corner.
    pub fn fit<const K: usize, T: Intensity>(
        &mut self,
        image: &Gray<T>,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
    ) -> Option<Fitted<K>> {
        let centre = self.load(image, window, start.position)?;
        let local = [0, 1].map(|i| start.position[i] - centre[i]);
        let start = Corner { position: local, ..*start };
        let mut fitted = self.descend(window, &start, optics);
        if fitted.is_none() && self.limits != UNLIMITED {
            // Black and white may lie just there: a drawn page has no others, and nothing but them.
            self.limits = UNLIMITED;
            fitted = self.descend(window, &start, optics);
        }
        fitted.map(|fitted| {
            let position = [0, 1].map(|i| fitted.corner.position[i] + centre[i]);
            Fitted { corner: Corner { position, ..fitted.corner }, ..fitted }
        })
    }

    /// [`Self::fit`] to the pixels that are loaded, in window coordinates.
    fn descend<const K: usize>(
        &mut self,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
    ) -> Option<Fitted<K>> {
        let start = *start;
        let freedom = (window.count - (ANGLE + K)) as f64;
        let mut corner = start;
        let mut damping = 1e-3;
        // The curve's piece is held, so that steps know all that they change, and made anew for what came
        // of it.
        let mut toned = start;
        let mut piece = optics.piece(toned.level, toned.amplitude);
        let mut normal = self.normal(window, &corner, (optics, piece));
        let mut converged = false;
        for _ in 1..MAX_EVALUATIONS {
            let noise = noise(&normal, &corner, freedom);
            let (mut matrix, mut gradient) = with_prior(&normal, &corner, noise);
            if corner.blur_px <= MIN_BLUR_PX && gradient[LN_BLUR] < 0.0 {
                // No sharper than that.
                (0..PARAMS).for_each(|i| (matrix[(i, LN_BLUR)], matrix[(LN_BLUR, i)]) = (0.0, 0.0));
                (matrix[(LN_BLUR, LN_BLUR)], gradient[LN_BLUR]) = (1.0, 0.0);
            }
            let mut damped = matrix;
            for i in 0..PARAMS {
                damped[(i, i)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&gradient);
            let Some(moved) = corner.moved(&step, window.radius) else {
                damping *= 10.0;
                continue;
            };
            if step.dot(&(matrix * step)) < CONVERGED * noise * noise && damping < 0.1 {
                corner = moved;
                converged = true;
                if !optics.is_toned() || corner.is_lit_like(&toned) {
                    break;
                }
                toned = corner;
                piece = optics.piece(toned.level, toned.amplitude);
                normal = self.normal(window, &corner, (optics, piece));
                continue;
            }
            let there = self.normal(window, &moved, (optics, piece));
            let weight = (noise / SLOPE_PRIOR).powi(2);
            let prior = |c: &Corner<K>| weight * (c.slope[0].powi(2) + c.slope[1].powi(2));
            if there.cost + prior(&moved) <= normal.cost + prior(&corner) {
                (corner, normal) = (moved, there);
                damping = (damping * 0.1).max(1e-6);
            } else {
                damping *= 10.0;
            }
        }
        let noise = noise(&normal, &corner, freedom);
        let inverse = with_prior(&normal, &corner, noise).0.cholesky()?.inverse() * noise * noise;
        let way =
            (corner.position[0] - start.position[0]).hypot(corner.position[1] - start.position[1]);
        let trusted = converged
            && way <= MAX_WAY_PX
            && corner.edges_are_apart()
            && noise < MAX_RESIDUAL * corner.amplitude.abs()
            && inverse[(X, X)] + inverse[(Y, Y)] < MAX_SIGMA_PX * MAX_SIGMA_PX;
        trusted.then_some(Fitted {
            corner,
            cov: [(X, X), (X, Y), (Y, Y)].map(|at| optics.inflation * inverse[at]),
            noise,
        })
    }

    /// Takes the pixels around a position; the centre of the window, or `None` outside the image.
    fn load<T: Intensity>(
        &mut self,
        image: &Gray<T>,
        window: &Window,
        position: [f64; 2],
    ) -> Option<[f64; 2]> {
        let centre = position.map(f64::round);
        let pixels = window.pixels(image, centre.map(|c| c as usize))?;
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (out, (_, pixel)) in self.pixels.iter_mut().zip(pixels) {
            *out = pixel;
            (low, high) = (low.min(pixel), high.max(pixel));
        }
        self.limits = [
            if low <= 0.0 { low } else { UNLIMITED[0] },
            if high >= 1.0 { high } else { UNLIMITED[1] },
        ];
        Some(centre)
    }

    /// The normal equations of the pixels at a corner in window coordinates.
    fn normal<const K: usize>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: (&Optics, Piece),
    ) -> Normal {
        self.fill(window, corner, optics);
        let columns = &mut *self.columns;
        let products = products(columns, ANGLE + K, window.count);
        let mut normal = Normal {
            matrix: SMatrix::identity(),
            gradient: SVector::zeros(),
            cost: products[PARAMS][PARAMS],
        };
        for (i, row) in products.iter().enumerate().take(ANGLE + K) {
            normal.gradient[i] = row[PARAMS];
            for (j, &product) in row.iter().enumerate().take(ANGLE + K).skip(i) {
                normal.matrix[(i, j)] = product;
                normal.matrix[(j, i)] = product;
            }
        }
        normal
    }

    /// The normal equations at a corner in picture coordinates, from the window around the pixel `centre`, with
    /// the parameters of the optics behind its own, each of which is told by optics that are `moved` by a
    /// step; `None` outside the image.
    pub(super) fn joint<const K: usize, T: Intensity>(
        &mut self,
        image: &Gray<T>,
        (window, centre): (&Window, [f64; 2]),
        corner: &Corner<K>,
        optics: &Optics,
        moved: &[(Optics, f32)],
    ) -> Option<Joint> {
        self.load(image, window, centre)?;
        let position = [0, 1].map(|i| corner.position[i] - centre[i]);
        let corner = Corner { position, ..*corner };
        let params = ANGLE + K;
        let mut rows: Vec<Vec<f32>> = Vec::with_capacity(moved.len());
        let toned = |optics: &Optics| optics.piece(corner.level, corner.amplitude);
        for (moved, step) in moved {
            self.fill(window, &corner, (moved, toned(moved)));
            rows.push(self.columns[PARAMS][..window.count].iter().map(|r| -r / step).collect());
        }
        self.fill(window, &corner, (optics, toned(optics)));
        let residual = self.columns[PARAMS][..window.count].to_vec();
        for (row, (_, step)) in rows.iter_mut().zip(moved) {
            row.iter_mut().zip(&residual).for_each(|(d, r)| *d += r / step);
        }
        let own = self.columns[..params].iter().map(|column| column[..window.count].to_vec());
        let rows: Vec<Vec<f32>> = own.chain(rows).chain([residual]).collect();
        let n = rows.len() - 1;
        let mut matrix = DMatrix::zeros(n, n);
        let mut gradient = DVector::zeros(n);
        for i in 0..n {
            gradient[i] = dot(&rows[i], &rows[n]);
            for j in i..n {
                matrix[(i, j)] = dot(&rows[i], &rows[j]);
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        let cost = dot(&rows[n], &rows[n]);
        let noise = (cost / (window.count - params) as f64).sqrt();
        let noise = noise.max(MIN_NOISE * corner.amplitude.abs());
        let weight = (noise / SLOPE_PRIOR).powi(2);
        for (i, slope) in corner.slope.iter().enumerate() {
            matrix[(SLOPE + i, SLOPE + i)] += weight;
            gradient[SLOPE + i] -= weight * slope;
        }
        Some(Joint { own: params, matrix, gradient, cost, noise })
    }

    /// What the pixels of a fitted corner do to its position, and what is left of them; the corner as for
    /// [`Self::joint`].
    pub(super) fn influence<const K: usize, T: Intensity>(
        &mut self,
        image: &Gray<T>,
        (window, centre): (&Window, [f64; 2]),
        corner: &Corner<K>,
        optics: &Optics,
    ) -> Option<Influence> {
        self.load(image, window, centre)?;
        let position = [0, 1].map(|i| corner.position[i] - centre[i]);
        let corner = Corner { position, ..*corner };
        let piece = optics.piece(corner.level, corner.amplitude);
        let normal = self.normal(window, &corner, (optics, piece));
        let freedom = (window.count - (ANGLE + K)) as f64;
        let noise = noise(&normal, &corner, freedom);
        let factor = with_prior(&normal, &corner, noise).0.cholesky()?;
        let inverse = factor.inverse();
        let root = factor.l().try_inverse()?;
        let column = |weights: [f32; PARAMS]| -> Vec<f32> {
            let mut sums = vec![0.0; window.count];
            for (weight, column) in weights.iter().zip(&self.columns[..ANGLE + K]) {
                sums.iter_mut().zip(column).for_each(|(sum, value)| *sum += weight * value);
            }
            sums
        };
        let row = |matrix: &SMatrix<f64, PARAMS, PARAMS>, i: usize| {
            std::array::from_fn(|p| matrix[(i, p)] as f32)
        };
        let places = window.u.iter().zip(&window.v).take(window.count);
        Some(Influence {
            places: places.map(|(&u, &v)| [u as i32, v as i32]).collect(),
            residuals: self.columns[PARAMS][..window.count].to_vec(),
            on_position: [X, Y].map(|i| column(row(&inverse, i))),
            hat: (0..ANGLE + K).map(|i| column(row(&root, i))).collect(),
            noise,
        })
    }

    /// Fills the columns of a corner in window coordinates.
    fn fill<const K: usize>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        (optics, piece): (&Optics, Piece),
    ) {
        let look = Look::of(corner, optics, piece, self.limits);
        let (columns, pixels) = (&mut *self.columns, &*self.pixels);
        match (K, optics.has_halo()) {
            (2, false) => fill_checker(columns, pixels, window, corner, &look),
            (2, true) => fill_checker_with_halo(columns, pixels, window, corner, &look),
            (_, false) => fill_deltille(columns, pixels, window, corner, &look),
            (_, true) => fill_deltille_with_halo(columns, pixels, window, corner, &look),
        }
    }
}

impl<const K: usize> Corner<K> {
    /// The corner with its first J edges; further ones mean nothing.
    pub fn with_edges<const J: usize>(self) -> Corner<J> {
        let Self { position, blur_px, amplitude, level, slope, .. } = self;
        let first = |edges: [f64; K]| std::array::from_fn(|k| edges.get(k).copied().unwrap_or(0.0));
        let (angles, bends) = (first(self.angles), first(self.bends));
        Corner { position, blur_px, amplitude, level, slope, angles, bends }
    }

    /// The corner after a step of its own parameters in the joint equations.
    pub(super) fn stepped(&self, step: &[f64]) -> Option<Self> {
        let mut whole = SVector::<f64, PARAMS>::zeros();
        whole.iter_mut().zip(step).for_each(|(to, from)| *to = *from);
        let mut moved = Self { position: [0.0; 2], ..*self }.moved(&whole, MAX_RADIUS)?;
        moved.position = [0, 1].map(|i| moved.position[i] + self.position[i]);
        Some(moved)
    }

    /// The corner after a step; `None` when it leaves what the window can tell.
    fn moved(&self, step: &SVector<f64, PARAMS>, radius: usize) -> Option<Self> {
        let mut corner = *self;
        corner.position[0] += step[X];
        corner.position[1] += step[Y];
        corner.blur_px = (corner.blur_px * step[LN_BLUR].clamp(-1.0, 1.0).exp()).max(MIN_BLUR_PX);
        corner.amplitude += step[AMPLITUDE];
        corner.level += step[LEVEL];
        for (i, slope) in corner.slope.iter_mut().enumerate() {
            *slope += step[SLOPE + i];
        }
        for (k, angle) in corner.angles.iter_mut().enumerate() {
            *angle += step[ANGLE + k];
        }
        let reach = radius as f64;
        let sensible = corner.blur_px <= reach
            && corner.position.iter().all(|c| c.abs() < reach)
            && corner.edges_are_apart();
        sensible.then_some(corner)
    }

    /// Whether black and white are where another has them, as far as a tone curve's piece can tell.
    fn is_lit_like(&self, other: &Self) -> bool {
        let change = (self.level - other.level).abs().max((self.amplitude - other.amplitude).abs());
        change <= SAME_LIGHT * self.amplitude.abs()
    }

    fn edges_are_apart(&self) -> bool {
        let last = self.angles[0] + std::f64::consts::PI;
        self.angles.windows(2).all(|pair| pair[1] - pair[0] > MIN_ANGLE_RAD)
            && last - self.angles[K - 1] > MIN_ANGLE_RAD
    }
}

#[multiversion(targets = "simd")]
fn fill_checker<const C: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    fill(columns, pixels, window, corner, look, Orthant::new(look.rho));
}

#[multiversion(targets = "simd")]
fn fill_checker_with_halo<const C: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    fill(columns, pixels, window, corner, look, look.haloed(Orthant::new(look.rho)));
}

#[multiversion(targets = "simd")]
fn fill_deltille<const C: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    fill(columns, pixels, window, corner, look, Deltille);
}

#[multiversion(targets = "simd")]
fn fill_deltille_with_halo<const C: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    fill(columns, pixels, window, corner, look, look.haloed(Deltille));
}

/// Fills the columns of derivatives and residuals.
#[inline(always)]
fn fill<const K: usize, const C: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    pattern: impl Pattern<K>,
) {
    let [x, y] = corner.position.map(|c| c as f32);
    // Directions of the edges, in units of the blur across them.
    let sines: [f32; K] =
        std::array::from_fn(|k| (corner.angles[k].sin() * look.sharpness[k]) as f32);
    let cosines: [f32; K] =
        std::array::from_fn(|k| (corner.angles[k].cos() * look.sharpness[k]) as f32);
    let bends: [f32; K] = std::array::from_fn(|k| (corner.bends[k] / look.sharpness[k]) as f32);
    let by_turn: [f32; K] = std::array::from_fn(|k| look.by_turn[k] as f32);
    let by_angle: [f32; K] =
        std::array::from_fn(|k| look.rho_by_angle.get(k).map_or(0.0, |&by| by as f32));
    let (amplitude, level) = (corner.amplitude as f32, corner.level as f32);
    let [gu, gv] = corner.slope.map(|g| g as f32);
    let (piece, [low, high]) = (look.piece, look.limits);
    let n = window.u.len().min(MAX_PIXELS);
    let (us, vs) = (&window.u[..n], &window.v[..n]);
    for i in 0..n {
        let (u, v) = (us[i], vs[i]);
        let (du, dv) = (u - x, v - y);
        let along: [f32; K] = std::array::from_fn(|k| cosines[k] * du + sines[k] * dv);
        let h: [f32; K] = std::array::from_fn(|k| {
            cosines[k] * dv - sines[k] * du - 0.5 * bends[k] * along[k] * along[k]
        });
        let Shade { f, slopes, correlation } = pattern.at(h);
        let change = gu * u + gv * v;
        let gain = 1.0 + change;
        let (tone, steepness) = piece.at(f * gain + change * piece.ratio);
        let model = level + amplitude * tone;
        let seen = if model > low && model < high { 1.0 } else { 0.0 };
        let by_shade = amplitude * steepness * seen;
        let light = by_shade * gain;
        let (mut by_x, mut by_y, mut by_scale) = (0.0, 0.0, 0.0);
        for k in 0..K {
            let bent = bends[k] * along[k];
            by_x += slopes[k] * (sines[k] + bent * cosines[k]);
            by_y -= slopes[k] * (cosines[k] - bent * sines[k]);
            by_scale -= slopes[k] * h[k];
            let turned = along[k] + h[k] * by_turn[k];
            columns[ANGLE + k][i] = light * (correlation * by_angle[k] - slopes[k] * turned);
        }
        let by_light = by_shade * (f + piece.ratio);
        columns[X][i] = light * by_x;
        columns[Y][i] = light * by_y;
        columns[LN_BLUR][i] = light * by_scale;
        columns[AMPLITUDE][i] = seen * (tone - steepness * change * piece.ratio);
        columns[LEVEL][i] = seen * (1.0 + steepness * change);
        columns[SLOPE][i] = u * by_light;
        columns[SLOPE + 1][i] = v * by_light;
        columns[PARAMS][i] = pixels[i] - model.max(low).min(high);
    }
}

/// Sum of products, in runs that a vector holds.
#[multiversion(targets = "simd")]
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0f32; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    f64::from(sums.iter().sum::<f32>() + rest)
}

/// The noise that the residuals show.
fn noise<const K: usize>(normal: &Normal, corner: &Corner<K>, freedom: f64) -> f64 {
    (normal.cost / freedom).sqrt().max(MIN_NOISE * corner.amplitude.abs())
}

/// The normal equations with the prior on the slopes.
fn with_prior<const K: usize>(
    normal: &Normal,
    corner: &Corner<K>,
    noise: f64,
) -> (SMatrix<f64, PARAMS, PARAMS>, SVector<f64, PARAMS>) {
    let weight = (noise / SLOPE_PRIOR).powi(2);
    let (mut matrix, mut gradient) = (normal.matrix, normal.gradient);
    for (i, slope) in corner.slope.iter().enumerate() {
        matrix[(SLOPE + i, SLOPE + i)] += weight;
        gradient[SLOPE + i] -= weight * slope;
    }
    (matrix, gradient)
}

/// Products of each two of the first `params` columns and the last, over `count` pixels; only the
/// upper half is filled.
#[multiversion(targets = "simd")]
fn products(columns: &mut Columns, params: usize, count: usize) -> [[f64; PARAMS + 1]; PARAMS + 1] {
    let padded = count.next_multiple_of(LANES).min(MAX_PIXELS);
    for column in columns.iter_mut() {
        column[count..padded].fill(0.0);
    }
    let mut products = [[0.0; PARAMS + 1]; PARAMS + 1];
    for i in (0..params).chain([PARAMS]) {
        for j in (i..params).chain([PARAMS]) {
            let (a, _) = columns[i][..padded].as_chunks::<LANES>();
            let (b, _) = columns[j][..padded].as_chunks::<LANES>();
            let mut sums = [0.0f32; LANES];
            for (a, b) in a.iter().zip(b) {
                for k in 0..LANES {
                    sums[k] += a[k] * b[k];
                }
            }
            products[i][j] = f64::from(sums.iter().sum::<f32>());
        }
    }
    products
}
