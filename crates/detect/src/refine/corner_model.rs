//! A corner fitted to raw pixels by Levenberg–Marquardt, see `docs/formulation.md`, “Measured corners”.
//!
//! ```text
//!     I(u,v) = level + amplitude · T(f(h₁ … h_K)·g + (g − 1)·r),      g = 1 + g_u u + g_v v
//!     h_k    = (cos θ_k · (v − y) − sin θ_k · (u − x) − ½ κ_k t²) / s_k
//!     t      =  cos θ_k · (u − x) + sin θ_k · (v − y)
//!     s_k²   = s² · nᵀ M n,      n = (−sin θ_k, cos θ_k)
//! ```
//!
//! Where ink has spread on the print, what is dark has grown: every line of a corner of three edges lies aside,
//! both halves the same way, by ink times the image of an edge across it, and the three miss each other. The
//! position is where they would meet on a print without. Of two edges the halves move against each other, and the corner stays.
//!
//! T is the camera's tone curve between the corner's black and white, r the sum of their light over
//! its difference ([`deltille_core::detection::tone`]); of a linear camera T(S) = S and I = (level + amplitude·f)·g.
//! M, of trace 2, tells in which direction the picture is blurred more; where it moved, by a box. Both, and
//! halos in f, are the same all over a picture and given: [`super::optics`]. What is brighter than white or
//! darker than black is seen as these; where pixels are, the model ends there too, so that they only count
//! where it does not.
//!
//! Edges have curvatures κ where a lens bends them, which are given: a window is too small to tell
//! them from the position. (u, v) are pixels from the window's centre, f is the blurred corner of
//! [`super::blurred_corner`]. The blur s holds the pixel's own box as a variance of 1/12: against
//! exact integration that costs nothing measurable from 0.5 px of blur upwards (docs/measurements).
//! The slopes g are drawn to 0 by a weak prior, all else is free.
//!
//! The covariance is σ² (JᵀJ + prior)⁻¹ with the noise σ estimated from the residuals. It is honest
//! where the noise is white and the window shows nothing but the corner; JPEG's noise is not white.

use glam::DVec2;
use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

use super::blurred_corner::{
    Deltille, FEW_NODES_RHO, Haloed, Inked, Orthant, Overlap, Pattern, Shade, SweptChecker,
    SweptDeltille, Triangle,
};
use super::correlation::Influence;
use super::optics::{INK_UNIT, Optics, PARAMS as COMMON_PARAMS, STEP, Spread};
use super::small_systems::solved;
use crate::lanes::LANES;
use deltille_core::damping::Damping;
use deltille_core::detection::{Piece, TONE_PARAMS};
use deltille_core::raster::ImageView;

/// Largest radius of a window, px.
pub const MAX_RADIUS: usize = 15;

/// Pixels of the largest window, rounded up to whole vectors.
const MAX_PIXELS: usize = ((2 * MAX_RADIUS + 1) * (2 * MAX_RADIUS + 1)).next_multiple_of(LANES);

/// Parameters of three edges; two leave the last one unused.
const PARAMS: usize = 10;

/// Columns that are multiplied with each other: parameters, residual, and what fills blocks of four.
const BLOCKED: usize = (PARAMS + 1usize).next_multiple_of(4);

/// Places of the parameters: the position's x.
const X: usize = 0;
/// Its y.
const Y: usize = 1;
/// ln s.
const LN_BLUR: usize = 2;
/// The amplitude.
const AMPLITUDE: usize = 3;
/// The level.
const LEVEL: usize = 4;
/// g_u, and g_v behind it.
const SLOPE: usize = 5;
/// The first angle; the others follow.
const ANGLE: usize = 7;

/// Prior standard deviation of the illumination's relative slope, 1/px: 10 % across 200 px.
/// Light that falls to a tenth across 1600 px has 0.0014, which a window of 21 px still tells.
pub const SLOPE_PRIOR: f64 = 0.0005;

/// Most evaluations of the model; five are usual.
const MAX_EVALUATIONS: usize = 25;

/// Damping of the first step, which starts from a fit to grey values without blur.
const DAMPING: f64 = 1e-3;

/// The least damping later on: less than that changes no digit of a step.
const LEAST_DAMPING: f64 = 1e-6;

/// With less damping than this a small step says that the minimum is near, and not that steps are kept short.
const HARDLY_DAMPED: f64 = 0.1;

/// The iteration ends with a step whose squared length, in standard deviations of the estimate, is
/// below this; the next would be smaller by orders of magnitude.
const CONVERGED: f64 = 0.25;

/// Or with one as short as this, in px, the logarithm of the blur and three times the angles: what it neglects is of the
/// order of its square, a fiftieth of a deviation in photographs.
const FINE: f64 = 0.03;

/// A rough fit ends with a step below this, in px and the logarithm of the blur; what is neglected is of the order of
/// its square.
const ROUGH: f64 = 0.15;

/// Black and white that differ by less than this part of the contrast have the same piece of a tone curve:
/// its curvature, at most a third, changes by as small a part of itself.
const SAME_LIGHT: f64 = 0.01;

/// The same for a start, whose light another fit finds anew.
const ROUGHLY_SAME_LIGHT: f64 = 0.1;

/// The logarithm of the blur changes by no more than this in one step: linear equations tell little of a blur that is e times
/// as wide.
const MOST_LN_BLUR: f64 = 1.0;

/// An angle moves its edge as much as the position does at this distance from the corner, px: where the smallest window ends.
const ARM_PX: f64 = 3.0;

/// Noise assumed at least, of the amplitude, so that noiseless images converge too.
const MIN_NOISE: f64 = 2e-5;

/// Blurs that can be told apart within a window: from that of a pixel's box to half the radius.
const MIN_BLUR_PX: f64 = 0.2;

/// A corner may not leave its start by more than this, px: the start is the polynomial's result.
pub const MAX_WAY_PX: f64 = 1.5;

/// Edges closer than this are one edge, or a wrong minimum: 75° of tilt leave 17°.
const MIN_ANGLE_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// Residuals larger than this part of the amplitude: the window shows something else, unless they differ from
/// pixel to pixel as much as noise does.
const MAX_RESIDUAL: f64 = 0.35;

/// Mean squared difference of neighbouring residuals over that of white noise, von Neumann's ratio, above which they
/// are noise; of what has a shape it is a fraction.
const MIN_WHITENESS: f64 = 0.7;

/// A position less certain than this is none, px.
const MAX_SIGMA_PX: f64 = 1.0;

/// Limits of a sensor that nothing reaches.
const UNLIMITED: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// How far a fit goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accuracy {
    /// To some hundredths of a pixel: a start for another fit.
    Rough,
    /// As far as the noise allows.
    Full,
}

/// A corner of K edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner<const K: usize> {
    /// Position, px.
    pub position: DVec2,
    /// Standard deviation of the blur with the pixel's box in it, px.
    pub blur_px: f64,
    /// Half the contrast, of full scale; negative when the sector before the first edge is dark.
    pub amplitude: f64,
    /// Half-way between dark and bright, of full scale.
    pub level: f64,
    /// Relative change of the illumination per pixel.
    pub slope: DVec2,
    /// Image angles of the edges, rising within a half-turn, radians.
    pub angles: [f64; K],
    /// Curvatures of the edges, to the left of their directions (to greater v of u), 1/px.
    pub bends: [f64; K],
    /// How far from each edge something lies that is an edge of a tile away on the print, px; 0 where no grid
    /// tells it.
    pub across_px: [f64; K],
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
    /// Mean squared difference of neighbouring residuals over that of white noise: less where they have a shape.
    pub whiteness: f64,
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
    /// Pixels beside each other: the first, and how many.
    runs: Vec<([i32; 2], usize)>,
}

impl Window {
    /// The window of (2 · radius + 1)² pixels; radii above [`MAX_RADIUS`] are cut to it.
    pub fn new(radius: usize) -> Self {
        Self::of(radius, |_| true)
    }

    /// Those pixels (u, v) of such a window that are `seen`.
    pub fn of(radius: usize, seen: impl Fn(DVec2) -> bool) -> Self {
        Self::within(radius, |_| [f64::NEG_INFINITY, f64::INFINITY], seen)
    }

    /// Those of each row v that lie in its `span` and are `seen`.
    pub fn within(
        radius: usize,
        span: impl Fn(f64) -> [f64; 2],
        seen: impl Fn(DVec2) -> bool,
    ) -> Self {
        let radius = radius.min(MAX_RADIUS);
        let reach = radius as i32;
        let room = (2 * radius + 1).pow(2).next_multiple_of(LANES);
        let mut window = Self {
            radius,
            count: 0,
            u: Vec::with_capacity(room),
            v: Vec::with_capacity(room),
            runs: Vec::with_capacity(2 * radius + 1),
        };
        for v in -reach..=reach {
            let [first, last] = span(f64::from(v));
            let first = first.max(f64::from(-reach)).ceil() as i32;
            let last = last.min(f64::from(reach)).floor() as i32;
            let mut before = None;
            for u in (first..=last).filter(|&u| seen(DVec2::new(u.into(), v.into()))) {
                match window.runs.last_mut() {
                    Some((_, length)) if before == Some(u - 1) => *length += 1,
                    _ => window.runs.push(([u, v], 1)),
                }
                before = Some(u);
                window.u.push(u as f32);
                window.v.push(v as f32);
            }
        }
        window.count = window.u.len();
        window.u.resize(window.count.next_multiple_of(LANES), 0.0);
        window.v.resize(window.count.next_multiple_of(LANES), 0.0);
        window
    }

    /// Half the side, px.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// How many pixels.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Columns and rows of the pixels.
    pub fn places(&self) -> [&[f32]; 2] {
        [&self.u[..self.count], &self.v[..self.count]]
    }

    /// Takes the pixels around `centre`, full scale 1; `None` where one lies outside the image.
    fn read(&self, image: ImageView, centre: DVec2, pixels: &mut [f32; MAX_PIXELS]) -> Option<()> {
        let [x, y] = centre.as_ivec2().to_array();
        let mut rest = &mut pixels[..];
        for &([u, v], length) in &self.runs {
            let (first, row) = (usize::try_from(x + u).ok()?, usize::try_from(y + v).ok()?);
            let (run, after) = rest.split_at_mut(length);
            image.read_row(first, row, run)?;
            rest = after;
        }
        Some(())
    }
}

/// The pixels of a window about a pixel of a picture.
#[derive(Clone, Debug)]
pub struct Patch {
    /// The window.
    pub window: Window,
    /// The pixel in its middle.
    pub centre: DVec2,
}

/// What all corners have in common is told by further rows, behind the residual: amplitude · (1 − S²).
const RISE: usize = PARAMS + 1;
/// S.
const SHADE: usize = PARAMS + 2;
/// Derivatives by the two parameters of astigmatism.
const ASTIGMATISM: usize = PARAMS + 3;
/// Derivatives by the strength of the halo.
const HALO: usize = PARAMS + 5;
/// Derivatives by the ink.
const INK: usize = PARAMS + 6;
/// Derivatives by the parameters of the tone curve.
const TONE: usize = PARAMS + 7;
/// All of them, in blocks of four.
const ALL: usize = (TONE + TONE_PARAMS).next_multiple_of(4);

/// One row a parameter, then the residual; a column a pixel.
type Columns = [[f32; MAX_PIXELS]; ALL];

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
            columns: Box::new([[0.0; MAX_PIXELS]; ALL]),
            limits: UNLIMITED,
        }
    }
}

/// A parameter that all corners of a picture have in common.
#[derive(Clone, Debug)]
pub(crate) enum Common {
    /// One of the tone curve, and the optics with it a [`STEP`] further.
    Tone { parameter: usize, moved: Box<Optics> },
    /// The first or second of astigmatism.
    Astigmatism(usize),
    /// The strength of the halo.
    Halo,
    /// How far what is dark has grown on the print.
    Ink,
}

/// Parameters that are the corner's.
pub(crate) const OWN: usize = PARAMS;
/// Those of the optics, behind them.
pub(crate) const COMMON: usize = COMMON_PARAMS;
/// All of them.
const UNKNOWNS: usize = OWN + COMMON;

/// The normal equations of a corner and the optics.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// JᵀJ with the prior on the slopes, and ones for parameters of the corner that are not there.
    pub matrix: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Jᵀr alike.
    pub gradient: SVector<f64, UNKNOWNS>,
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
    /// Sines and cosines of the angles.
    turns: [(f64, f64); K],
    /// 1/s_k, 1/px.
    sharpness: [f64; K],
    /// ∂ ln s_k/∂θ_k.
    by_turn: [f64; K],
    /// Correlation of the blur along the first two normals, and its derivatives by their angles.
    rho: f64,
    rho_by_angle: [f64; 2],
    /// ∂ ln s_k/∂e and ∂ρ/∂e of both parameters of astigmatism.
    by_astigmatism: [[f64; K]; 2],
    rho_by_astigmatism: [f64; 2],
    /// Curve between black and white.
    piece: Piece,
    /// Strength of the halo, and its width over that of the blur.
    halo: [f32; 2],
    /// ∂ ln s/∂α of the blur that the pattern has, at one steepness of the edges.
    core_by_halo: f32,
    /// Half of the picture's way across the edges while it was taken, in units of the blur, where it moved, and
    /// its derivatives by the angles and by both parameters of astigmatism.
    way: Option<[f32; K]>,
    way_by_turn: [f64; K],
    way_by_astigmatism: [[f64; K]; 2],
    /// How far ink displaces the edges, in units of the blur, its derivatives by the ink, and what is between.
    displaced: [f64; K],
    by_ink: [f64; K],
    triangle: Option<Triangle>,
    /// The darkest and the brightest that is seen.
    limits: [f32; 2],
}

/// How far an ink of 1 displaces the edges, in units of the blur.
///
/// What is dark lies on the right of the first and the third edge where the contrast is positive, and on the
/// left of the second. Of two edges each half moves its own way, and the corner stays.
fn by_ink<const K: usize>(corner: &Corner<K>, sharpness: [f64; K]) -> [f64; K] {
    std::array::from_fn(|k| match (K, k) {
        (3, 1) => -INK_UNIT * corner.amplitude.signum() * corner.across_px[k] * sharpness[k],
        (3, _) => INK_UNIT * corner.amplitude.signum() * corner.across_px[k] * sharpness[k],
        _ => 0.0,
    })
}

/// The triangle between three edges that ink displaces, with its derivatives by ln s, the angles and the ink; beside
/// the corner the sines and cosines of its angles.
fn triangle<const K: usize>(
    corner: &Corner<K>,
    turns: [(f64, f64); K],
    optics: &Optics,
    spread: &Spread,
) -> Triangle {
    /// Of the logarithm of the blur, radians and units of ink: a quotient neglects some ten-thousandth.
    const STEP: f64 = 1e-4;
    let core = optics.core();
    let overlap = |blur_px: f64, turns: [(f64, f64); K], ink: f64| {
        let core_px = blur_px * core;
        let normals = turns.map(|(sin, cos)| [-sin, cos]);
        let product = |a, b| spread.product(a, b);
        let lengths = normals.map(|n| product(n, n).sqrt());
        let rho = product(normals[0], normals[1]) / (lengths[0] * lengths[1]);
        let displaced = by_ink(corner, lengths.map(|l| 1.0 / (core_px * l))).map(|by| by * ink);
        // n₃ as a sum of n₁ and n₂.
        let sine =
            |from: usize, to: usize| turns[to].0 * turns[from].1 - turns[to].1 * turns[from].0;
        let a = sine(2, 1) / sine(0, 1) * lengths[0] / lengths[2];
        let b = sine(0, 2) / sine(0, 1) * lengths[1] / lengths[2];
        let c = a * displaced[0] + b * displaced[1] - displaced[2];
        let [x, y] = [0, 1]
            .map(|k| (spread.way[0] * normals[k][0] + spread.way[1] * normals[k][1]) / lengths[k]);
        // A box of half the length x has the variance x²/3.
        let cov = [1.0 + x * x / 3.0, rho + x * y / 3.0, 1.0 + y * y / 3.0];
        Overlap::between([a, b, c], cov, displaced[0].signum())
    };
    let there = std::array::from_fn(|parameter| match parameter {
        0 => overlap(corner.blur_px * STEP.exp(), turns, optics.ink),
        1..=3 => {
            let mut turned = turns;
            turned[parameter - 1] = (corner.angles[parameter - 1] + STEP).sin_cos();
            overlap(corner.blur_px, turned, optics.ink)
        }
        _ => overlap(corner.blur_px, turns, optics.ink + STEP),
    });
    Triangle::new(overlap(corner.blur_px, turns, optics.ink), there, STEP)
}

impl<const K: usize> Look<K> {
    fn of(corner: &Corner<K>, optics: &Optics, piece: Piece, limits: [f32; 2]) -> Self {
        let spread = optics.spread(K);
        let turns = corner.angles.map(f64::sin_cos);
        let normals = turns.map(|(sin, cos)| [-sin, cos]);
        let tangents = turns.map(|(sin, cos)| [-cos, -sin]);
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
        let triangle = is_inked.then(|| triangle(corner, turns, optics, &spread));
        Self {
            turns,
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

    /// Whether there is a halo.
    fn has_halo(&self) -> bool {
        self.halo[0] != 0.0
    }

    fn haloed<P: Copy>(&self, pattern: P) -> Haloed<P> {
        self.haloed_of(|_| pattern)
    }

    /// The same of a pattern that has lengths of its own, which are to be multiplied by a number.
    fn haloed_of<P>(&self, pattern: impl Fn(f32) -> P) -> Haloed<P> {
        let [strength, width] = self.halo;
        Haloed {
            pattern: pattern(1.0),
            wide: pattern(1.0 / width),
            strength,
            narrower: 1.0 / width,
        }
    }
}

impl CornerFitter {
    /// The corner near `start`; `None` when the window leaves the image or the fit is no corner.
    pub fn fit<const K: usize>(
        &mut self,
        image: ImageView,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
        accuracy: Accuracy,
    ) -> Option<Fitted<K>> {
        let centre = self.load(image, window, start.position)?;
        let start = Corner { position: start.position - centre, ..*start };
        let mut fitted = self.descend(window, &start, optics, accuracy);
        if fitted.is_none() && self.limits != UNLIMITED {
            // Black and white may lie just there: a drawn page has no others, and nothing but them.
            self.limits = UNLIMITED;
            fitted = self.descend(window, &start, optics, accuracy);
        }
        fitted.map(|fitted| {
            let position = fitted.corner.position + centre;
            Fitted { corner: Corner { position, ..fitted.corner }, ..fitted }
        })
    }

    /// [`Self::fit`] to the pixels that are loaded, in window coordinates.
    fn descend<const K: usize>(
        &mut self,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
        accuracy: Accuracy,
    ) -> Option<Fitted<K>> {
        let start = *start;
        let freedom = (window.count - (ANGLE + K)) as f64;
        let mut corner = start;
        let mut damping = Damping::from(DAMPING).at_least(LEAST_DAMPING, 0.0);
        // The curve's piece is held, so that steps know all that they change, and made anew after the first
        // step, which finds the light, and for what came of them all.
        let mut toned = start;
        let mut piece = optics.piece(toned.level, toned.amplitude);
        let mut normal = self.normal(window, &corner, optics, piece);
        let mut converged = false;
        for evaluations in 1..MAX_EVALUATIONS {
            let noise = noise(&normal, &corner, freedom);
            let (mut matrix, mut gradient) = with_prior(&normal, &corner, noise);
            if corner.blur_px <= MIN_BLUR_PX && gradient[LN_BLUR] < 0.0 {
                // No sharper than that.
                (0..PARAMS).for_each(|i| (matrix[(i, LN_BLUR)], matrix[(LN_BLUR, i)]) = (0.0, 0.0));
                (matrix[(LN_BLUR, LN_BLUR)], gradient[LN_BLUR]) = (1.0, 0.0);
            }
            let mut damped = matrix;
            for i in 0..PARAMS {
                damped[(i, i)] = damping.grown(damped[(i, i)]);
            }
            let rows = std::array::from_fn::<[f64; PARAMS + 1], PARAMS, _>(|i| {
                std::array::from_fn(|j| if j < PARAMS { damped[(i, j)] } else { gradient[i] })
            });
            let solution = solved(rows)?;
            let step = SVector::from_fn(|i, _| solution[i][PARAMS]);
            let Some(moved) = corner.moved(&step, window.radius) else {
                damping.stiffen();
                continue;
            };
            let is_toned_anew =
                |tolerance| optics.is_toned() && !moved.is_lit_like(&toned, tolerance);
            let (is_last, tolerance) = match accuracy {
                Accuracy::Full => {
                    let small = step.dot(&(matrix * step)) < CONVERGED * noise * noise;
                    (small || is_within(&step, FINE), SAME_LIGHT)
                }
                Accuracy::Rough => (is_within(&step, ROUGH), ROUGHLY_SAME_LIGHT),
            };
            if is_last && damping.part() < HARDLY_DAMPED {
                converged = true;
                corner = moved;
                if !is_toned_anew(tolerance) {
                    normal.cost = (normal.cost - gradient.dot(&step)).max(0.0);
                    break;
                }
                toned = moved;
                piece = optics.piece(toned.level, toned.amplitude);
                normal = self.normal(window, &corner, optics, piece);
                continue;
            }
            if evaluations == 1 && is_toned_anew(SAME_LIGHT) {
                toned = moved;
                piece = optics.piece(toned.level, toned.amplitude);
            }
            let there = self.normal(window, &moved, optics, piece);
            let weight = (noise / SLOPE_PRIOR).powi(2);
            let prior = |c: &Corner<K>| weight * c.slope.length_squared();
            if there.cost + prior(&moved) <= normal.cost + prior(&corner) {
                (corner, normal) = (moved, there);
                damping.ease();
            } else {
                damping.stiffen();
            }
        }
        let noise = noise(&normal, &corner, freedom);
        let matrix = with_prior(&normal, &corner, noise).0;
        let rows = std::array::from_fn::<[f64; PARAMS + 2], PARAMS, _>(|i| {
            std::array::from_fn(|j| match j.checked_sub(PARAMS) {
                None => matrix[(i, j)],
                Some(column) => f64::from(i == column),
            })
        });
        let solution = solved(rows)?;
        let cov = |i: usize, j: usize| noise * noise * solution[i][PARAMS + j];
        let way = corner.position.distance(start.position);
        let whiteness = self.whiteness(window);
        let trusted = converged
            && way <= MAX_WAY_PX
            && corner.edges_are_apart()
            && (noise < MAX_RESIDUAL * corner.amplitude.abs() || whiteness > MIN_WHITENESS)
            && cov(X, X) + cov(Y, Y) < MAX_SIGMA_PX * MAX_SIGMA_PX;
        trusted.then_some(Fitted {
            corner,
            cov: std::array::from_fn(|i| {
                let (row, column) = [(X, X), (X, Y), (Y, Y)][i];
                optics.inflation * cov(row, column) + optics.shift[i]
            }),
            noise,
            whiteness,
        })
    }

    /// Takes the pixels around a position; the centre of the window, or `None` outside the image.
    fn load(&mut self, image: ImageView, window: &Window, position: DVec2) -> Option<DVec2> {
        let centre = position.round();
        window.read(image, centre, &mut self.pixels)?;
        let (low, high) = ends(&self.pixels[..window.count]);
        self.limits = [
            if low <= 0.0 { low } else { UNLIMITED[0] },
            if high >= 1.0 { high } else { UNLIMITED[1] },
        ];
        Some(centre)
    }

    /// The pixels around a position, full scale 1; `None` where one lies outside the image.
    pub(crate) fn pixels(
        &mut self,
        image: ImageView,
        window: &Window,
        position: DVec2,
    ) -> Option<&[f32]> {
        self.load(image, window, position)?;
        Some(&self.pixels[..window.count])
    }

    /// Von Neumann's ratio of the residuals along the rows: 1 for white noise.
    fn whiteness(&self, window: &Window) -> f64 {
        let mut rest = &self.columns[PARAMS][..window.count];
        let (mut sum, mut of_steps, mut steps) = (0.0, 0.0, 0);
        for &(_, length) in &window.runs {
            let (run, after) = rest.split_at(length);
            let [square, of_step] = squares(run).map(f64::from);
            sum += square;
            of_steps += of_step;
            steps += length - 1;
            rest = after;
        }
        of_steps / (2 * steps) as f64 / (sum / window.count as f64)
    }

    /// The normal equations of the pixels at a corner in window coordinates.
    fn normal<const K: usize>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: &Optics,
        piece: Piece,
    ) -> Normal {
        self.fill::<K, false>(window, corner, optics, piece);
        let products = products::<BLOCKED>(&mut self.columns, window.count);
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

    /// The normal equations at a corner in picture coordinates, from the pixels of a patch, with the parameters of
    /// the optics behind its own; `None` outside the image.
    pub(crate) fn joint<const K: usize>(
        &mut self,
        image: ImageView,
        patch: &Patch,
        corner: &Corner<K>,
        optics: &Optics,
        common: &[Common],
    ) -> Option<Joint> {
        let Patch { window, centre } = patch;
        self.load(image, window, *centre)?;
        let corner = Corner { position: corner.position - centre, ..*corner };
        let params = ANGLE + K;
        let toned = |optics: &Optics| optics.piece(corner.level, corner.amplitude);
        let piece = toned(optics);
        self.fill::<K, true>(window, &corner, optics, piece);
        let columns = &mut *self.columns;
        let mut rows = [None; UNKNOWNS];
        (0..params).for_each(|i| rows[i] = Some(i));
        for (row, common) in rows[OWN..].iter_mut().zip(common) {
            *row = Some(match common {
                Common::Tone { parameter, moved } => {
                    let there = toned(moved).terms;
                    let slopes = std::array::from_fn(|j| (there[j] - piece.terms[j]) / STEP as f32);
                    let slopes = Piece { terms: slopes, ratio: 0.0 };
                    let (filled, tones) = columns.split_at_mut(TONE);
                    let shown = filled[RISE].iter().zip(&filled[SHADE]).take(window.count);
                    for (by, (rise, &shade)) in tones[*parameter].iter_mut().zip(shown) {
                        *by = rise * slopes.bulge(shade);
                    }
                    TONE + parameter
                }
                Common::Astigmatism(i) => ASTIGMATISM + i,
                Common::Halo => HALO,
                Common::Ink => INK,
            });
        }
        let products = products::<ALL>(columns, window.count);
        let product = |i: usize, j: usize| products[i.min(j)][i.max(j)];
        let (mut matrix, mut gradient) = (SMatrix::zeros(), SVector::zeros());
        for (i, row) in rows.into_iter().enumerate() {
            let Some(row) = row else {
                matrix[(i, i)] = 1.0;
                continue;
            };
            gradient[i] = product(row, PARAMS);
            for (j, column) in rows.into_iter().enumerate().take(i + 1) {
                let value = column.map_or(0.0, |column| product(row, column));
                (matrix[(i, j)], matrix[(j, i)]) = (value, value);
            }
        }
        let cost = product(PARAMS, PARAMS);
        let noise = (cost / (window.count - params) as f64).sqrt();
        let noise = noise.max(MIN_NOISE * corner.amplitude.abs());
        let weight = (noise / SLOPE_PRIOR).powi(2);
        for (i, slope) in corner.slope.to_array().iter().enumerate() {
            matrix[(SLOPE + i, SLOPE + i)] += weight;
            gradient[SLOPE + i] -= weight * slope;
        }
        Some(Joint { matrix, gradient, cost, noise })
    }

    /// What the pixels of a fitted corner do to its position, and what is left of them; the corner as for
    /// [`Self::joint`].
    pub(crate) fn influence<const K: usize>(
        &mut self,
        image: ImageView,
        patch: &Patch,
        corner: &Corner<K>,
        optics: &Optics,
    ) -> Option<Influence> {
        let Patch { window, centre } = patch;
        self.load(image, window, *centre)?;
        let corner = Corner { position: corner.position - centre, ..*corner };
        let piece = optics.piece(corner.level, corner.amplitude);
        let normal = self.normal(window, &corner, optics, piece);
        let freedom = (window.count - (ANGLE + K)) as f64;
        let noise = noise(&normal, &corner, freedom);
        let factor = with_prior(&normal, &corner, noise).0.cholesky()?;
        let inverse = factor.inverse();
        let root = factor.l().try_inverse()?;
        let column = |weights: [f32; PARAMS]| -> Vec<f32> {
            let mut sums = vec![0.0; window.count];
            let columns = weights.iter().zip(&self.columns[..ANGLE + K]);
            // Half of those of a triangle are nothing.
            for (weight, column) in columns.filter(|(weight, _)| **weight != 0.0) {
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
            twice_middle: (2.0 * corner.position).round().as_ivec2().to_array(),
            residuals: self.columns[PARAMS][..window.count].to_vec(),
            on_position: [X, Y].map(|i| column(row(&inverse, i))),
            hat: (0..ANGLE + K).map(|i| column(row(&root, i))).collect(),
            noise,
        })
    }

    /// Fills the columns of a corner in window coordinates; those of what corners have in common where it is
    /// `JOINT`ly fitted.
    fn fill<const K: usize, const JOINT: bool>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: &Optics,
        piece: Piece,
    ) {
        let look = Look::of(corner, optics, piece, self.limits);
        let (columns, pixels) = (&mut *self.columns, &*self.pixels);
        // By constants first: what they rule out is not compiled.
        if K == 2 {
            let is_square = look.rho.abs() <= FEW_NODES_RHO;
            match (look.way, is_square) {
                (Some(way), true) => {
                    let (still, way) = (Orthant::of_few_nodes(look.rho), [way[0], way[1]]);
                    fill_swept_checker::<K, JOINT, 3>(
                        columns, pixels, window, corner, &look, still, way,
                    );
                }
                (Some(way), false) => {
                    let (still, way) = (Orthant::new(look.rho), [way[0], way[1]]);
                    fill_swept_checker::<K, JOINT, 6>(
                        columns, pixels, window, corner, &look, still, way,
                    );
                }
                (None, true) => {
                    fill_square::<K, JOINT>(columns, pixels, window, corner, &look);
                }
                (None, false) => {
                    fill_checker::<K, JOINT>(columns, pixels, window, corner, &look);
                }
            }
        } else {
            match (look.way, look.triangle) {
                (Some(way), _) => {
                    let way = std::array::from_fn(|k| way.get(k).copied().unwrap_or(0.0));
                    fill_swept_deltille::<K, JOINT>(columns, pixels, window, corner, &look, way);
                }
                (None, Some(triangle)) => {
                    fill_inked_deltille::<K, JOINT>(
                        columns, pixels, window, corner, &look, triangle,
                    );
                }
                (None, None) => {
                    fill_deltille::<K, JOINT>(columns, pixels, window, corner, &look);
                }
            }
        }
    }
}

/// Whether a step in position, px, and blur, by its logarithm, is shorter than this, and what one in angles moves at
/// [`ARM_PX`].
fn is_within(step: &SVector<f64, PARAMS>, limit: f64) -> bool {
    step[X].hypot(step[Y]) < limit
        && step[LN_BLUR].abs() < limit
        && step.iter().skip(ANGLE).all(|turn| turn.abs() < limit / ARM_PX)
}

/// The least and the greatest.
#[multiversion(targets("x86_64+avx2"))]
fn ends(values: &[f32]) -> (f32, f32) {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    // Comparisons, as the least of two numbers asks for more where one may be none.
    for chunk in chunks {
        for k in 0..LANES {
            low[k] = if chunk[k] < low[k] { chunk[k] } else { low[k] };
            high[k] = if chunk[k] > high[k] { chunk[k] } else { high[k] };
        }
    }
    for k in 0..rest.len() {
        low[k] = low[k].min(rest[k]);
        high[k] = high[k].max(rest[k]);
    }
    let mut width = LANES / 2;
    while width > 0 {
        for k in 0..width {
            low[k] = low[k].min(low[k + width]);
            high[k] = high[k].max(high[k + width]);
        }
        width /= 2;
    }
    (low[0], high[0])
}

/// Sums of the squares of the values, and of the differences between those that follow each other.
#[multiversion(targets("x86_64+avx2"))]
fn squares(values: &[f32]) -> [f32; 2] {
    /// Of two sums, each in one vector of the processors that this is compiled for.
    const WIDTH: usize = LANES / 2;
    let (mut sums, mut sums_of_steps) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
    let count = values.len().saturating_sub(1) / WIDTH;
    for i in 0..count {
        let nine = &values[i * WIDTH..(i + 1) * WIDTH + 1];
        for k in 0..WIDTH {
            sums[k] += nine[k] * nine[k];
            sums_of_steps[k] += (nine[k + 1] - nine[k]) * (nine[k + 1] - nine[k]);
        }
    }
    let rest = &values[count * WIDTH..];
    for k in 0..rest.len() {
        let step = if k + 1 < rest.len() { rest[k + 1] - rest[k] } else { 0.0 };
        sums[k % WIDTH] += rest[k] * rest[k];
        sums_of_steps[k % WIDTH] += step * step;
    }
    let (mut sum, mut sum_of_steps) = (0.0, 0.0);
    for k in 0..WIDTH {
        sum += sums[k];
        sum_of_steps += sums_of_steps[k];
    }
    [sum, sum_of_steps]
}

impl<const K: usize> Corner<K> {
    /// The corner with its first J edges; further ones mean nothing.
    pub fn with_edges<const J: usize>(self) -> Corner<J> {
        let Self { position, blur_px, amplitude, level, slope, angles, bends, across_px } = self;
        let first = |edges: [f64; K]| std::array::from_fn(|k| edges.get(k).copied().unwrap_or(0.0));
        let [angles, bends, across_px] = [first(angles), first(bends), first(across_px)];
        Corner { position, blur_px, amplitude, level, slope, angles, bends, across_px }
    }

    /// The corner after a step of its own parameters in the joint equations.
    pub(crate) fn stepped(&self, step: &SVector<f64, OWN>) -> Option<Self> {
        let mut moved = Self { position: DVec2::ZERO, ..*self }.moved(step, MAX_RADIUS)?;
        moved.position += self.position;
        Some(moved)
    }

    /// The corner after a step; `None` when it leaves what the window can tell.
    fn moved(&self, step: &SVector<f64, PARAMS>, radius: usize) -> Option<Self> {
        let mut corner = *self;
        corner.position += DVec2::new(step[X], step[Y]);
        corner.blur_px = (corner.blur_px * step[LN_BLUR].clamp(-MOST_LN_BLUR, MOST_LN_BLUR).exp())
            .max(MIN_BLUR_PX);
        corner.amplitude += step[AMPLITUDE];
        corner.level += step[LEVEL];
        corner.slope += DVec2::new(step[SLOPE], step[SLOPE + 1]);
        for (k, angle) in corner.angles.iter_mut().enumerate() {
            *angle += step[ANGLE + k];
        }
        let reach = radius as f64;
        let sensible = corner.blur_px <= reach
            && corner.position.abs().max_element() < reach
            && corner.edges_are_apart();
        sensible.then_some(corner)
    }

    /// Whether black and white are where another has them, as far as a tone curve's piece can tell.
    fn is_lit_like(&self, other: &Self, tolerance: f64) -> bool {
        let change = (self.level - other.level).abs().max((self.amplitude - other.amplitude).abs());
        change <= tolerance * self.amplitude.abs()
    }

    fn edges_are_apart(&self) -> bool {
        let last = self.angles[0] + std::f64::consts::PI;
        self.angles.windows(2).all(|pair| pair[1] - pair[0] > MIN_ANGLE_RAD)
            && last - self.angles[K - 1] > MIN_ANGLE_RAD
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_checker<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = Orthant::new(look.rho);
    if JOINT || look.has_halo() {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, look.haloed(still));
    } else {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, still);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_square<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = Orthant::of_few_nodes(look.rho);
    if JOINT || look.has_halo() {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, look.haloed(still));
    } else {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, still);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
) {
    let still = Deltille;
    if JOINT || look.has_halo() {
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, look.haloed(still));
    } else {
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, still);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn fill_inked_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    triangle: Triangle,
) {
    if JOINT || look.has_halo() {
        let pattern = Inked { edges: look.haloed(Deltille), triangle };
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, pattern);
    } else {
        let pattern = Inked { edges: Deltille, triangle };
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, pattern);
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill_swept_checker<const C: usize, const JOINT: bool, const NODES: usize>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    still: Orthant<NODES>,
    [across, along]: [f32; 2],
) {
    let swept = |by: f32| SweptChecker { pattern: still, way: [across * by, along * by] };
    if JOINT || look.has_halo() {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, look.haloed_of(swept));
    } else {
        fill::<2, C, JOINT>(columns, pixels, window, corner, look, swept(1.0));
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill_swept_deltille<const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    way: [f32; 3],
) {
    let swept = |by: f32| SweptDeltille::new(way.map(|way| way * by));
    if let Some(triangle) = look.triangle {
        let pattern = Inked { edges: look.haloed_of(swept), triangle };
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, pattern);
    } else if JOINT || look.has_halo() {
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, look.haloed_of(swept));
    } else {
        fill::<3, C, JOINT>(columns, pixels, window, corner, look, swept(1.0));
    }
}

/// Fills the columns of derivatives and residuals.
#[inline(always)]
fn fill<const K: usize, const C: usize, const JOINT: bool>(
    columns: &mut Columns,
    pixels: &[f32; MAX_PIXELS],
    window: &Window,
    corner: &Corner<C>,
    look: &Look<C>,
    pattern: impl Pattern<K>,
) {
    let [x, y] = corner.position.as_vec2().to_array();
    // Directions of the edges, in units of the blur across them.
    let sines: [f32; K] = std::array::from_fn(|k| (look.turns[k].0 * look.sharpness[k]) as f32);
    let cosines: [f32; K] = std::array::from_fn(|k| (look.turns[k].1 * look.sharpness[k]) as f32);
    let bends: [f32; K] = std::array::from_fn(|k| (corner.bends[k] / look.sharpness[k]) as f32);
    let by_turn: [f32; K] = std::array::from_fn(|k| look.by_turn[k] as f32);
    let by_angle: [f32; K] =
        std::array::from_fn(|k| look.rho_by_angle.get(k).map_or(0.0, |&by| by as f32));
    let by_astigmatism: [[f32; K]; 2] =
        [0, 1].map(|e| std::array::from_fn(|k| look.by_astigmatism[e][k] as f32));
    let rho_by_astigmatism = look.rho_by_astigmatism.map(|by| by as f32);
    let way_by_turn: [f32; K] = std::array::from_fn(|k| look.way_by_turn[k] as f32);
    let way_by_astigmatism: [[f32; K]; 2] =
        [0, 1].map(|e| std::array::from_fn(|k| look.way_by_astigmatism[e][k] as f32));
    let displaced: [f32; K] = std::array::from_fn(|k| look.displaced[k] as f32);
    let by_ink: [f32; K] = std::array::from_fn(|k| look.by_ink[k] as f32);
    let (amplitude, level) = (corner.amplitude as f32, corner.level as f32);
    let [gu, gv] = corner.slope.as_vec2().to_array();
    let (piece, [low, high]) = (look.piece, look.limits);
    let n = window.u.len().min(MAX_PIXELS);
    let (us, vs) = (&window.u[..n], &window.v[..n]);
    for i in 0..n {
        let (u, v) = (us[i], vs[i]);
        let (du, dv) = (u - x, v - y);
        let along: [f32; K] = std::array::from_fn(|k| cosines[k] * du + sines[k] * dv);
        let h: [f32; K] = std::array::from_fn(|k| {
            cosines[k] * dv - sines[k] * du - 0.5 * bends[k] * along[k] * along[k] - displaced[k]
        });
        let Shade { f, slopes, correlation, halo, triangle, way } = pattern.at(h);
        let change = gu * u + gv * v;
        let gain = 1.0 + change;
        let shade = f * gain + change * piece.ratio;
        let (tone, steepness) = piece.at(shade);
        let model = level + amplitude * tone;
        let seen = if model > low && model < high { 1.0 } else { 0.0 };
        let by_shade = amplitude * steepness * seen;
        let light = by_shade * gain;
        let (mut by_x, mut by_y, mut by_scale) = (0.0, 0.0, triangle[0]);
        for k in 0..K {
            let bent = bends[k] * along[k];
            by_x += slopes[k] * (sines[k] + bent * cosines[k]);
            by_y -= slopes[k] * (cosines[k] - bent * sines[k]);
            by_scale -= slopes[k] * h[k];
            let across = cosines[k] * dv - sines[k] * du;
            let turned = along[k] + bent * across + h[k] * by_turn[k];
            let by = correlation * by_angle[k] - slopes[k] * turned + triangle[1 + k];
            let by = by + way[k] * way_by_turn[k];
            columns[ANGLE + k][i] = light * by;
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
        if JOINT {
            columns[RISE][i] = amplitude * seen * (1.0 - shade * shade);
            columns[SHADE][i] = shade;
            columns[HALO][i] = light * (halo + by_scale * look.core_by_halo);
            let mut by = triangle[4];
            for k in 0..K {
                by -= slopes[k] * by_ink[k];
            }
            columns[INK][i] = light * by;
            for e in 0..2 {
                let mut by = correlation * rho_by_astigmatism[e];
                for k in 0..K {
                    by -= slopes[k] * h[k] * by_astigmatism[e][k];
                    by += way[k] * way_by_astigmatism[e][k];
                }
                columns[ASTIGMATISM + e][i] = light * by;
            }
        }
    }
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
    for (i, slope) in corner.slope.to_array().iter().enumerate() {
        matrix[(SLOPE + i, SLOPE + i)] += weight;
        gradient[SLOPE + i] -= weight * slope;
    }
    (matrix, gradient)
}

/// Products of each two of the first N columns, over `count` pixels; only the upper half is filled.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn products<const N: usize>(columns: &mut Columns, count: usize) -> [[f64; N]; N] {
    let padded = count.next_multiple_of(LANES).min(MAX_PIXELS);
    // All of the last vector, as bits: a choice for each pixel would be a branch.
    let kept: [u32; LANES] =
        std::array::from_fn(|k| if padded - LANES + k < count { u32::MAX } else { 0 });
    for column in columns.iter_mut().take(N) {
        if let Some(last) = column[..padded].last_chunk_mut::<LANES>() {
            for (value, kept) in last.iter_mut().zip(kept) {
                *value = f32::from_bits(value.to_bits() & kept);
            }
        }
    }
    let mut products = [[0.0; N]; N];
    for i in (0..N).step_by(2) {
        for j in (i / 4 * 4..N).step_by(4) {
            let mut sums = [[0.0; HALF]; 8];
            products_of_blocks(&columns[i..i + 2], &columns[j..j + 4], padded, &mut sums);
            for (k, eight) in sums.iter().enumerate() {
                products[i + k / 4][j + k % 4] = f64::from(sum_of_eight(eight));
            }
        }
    }
    products
}

/// Lanes of a sum of products: so many of eight sums stay in registers.
const HALF: usize = LANES / 2;

/// Products of two columns with four others: eight sums that do not wait for each other. They are named one by one so
/// that each is a vector.
#[inline(always)]
fn products_of_blocks(
    two: &[[f32; MAX_PIXELS]],
    four: &[[f32; MAX_PIXELS]],
    count: usize,
    sums: &mut [[f32; HALF]; 8],
) {
    let (a, _) = two[0][..count].as_chunks::<HALF>();
    let (b, _) = two[1][..count].as_chunks::<HALF>();
    let (c, _) = four[0][..count].as_chunks::<HALF>();
    let (d, _) = four[1][..count].as_chunks::<HALF>();
    let (e, _) = four[2][..count].as_chunks::<HALF>();
    let (f, _) = four[3][..count].as_chunks::<HALF>();
    let [mut ac, mut ad, mut ae, mut af] = [[0.0; HALF]; 4];
    let [mut bc, mut bd, mut be, mut bf] = [[0.0; HALF]; 4];
    for (((((a, b), c), d), e), f) in a.iter().zip(b).zip(c).zip(d).zip(e).zip(f) {
        for k in 0..HALF {
            ac[k] += a[k] * c[k];
            ad[k] += a[k] * d[k];
            ae[k] += a[k] * e[k];
            af[k] += a[k] * f[k];
            bc[k] += b[k] * c[k];
            bd[k] += b[k] * d[k];
            be[k] += b[k] * e[k];
            bf[k] += b[k] * f[k];
        }
    }
    *sums = [ac, ad, ae, af, bc, bd, be, bf];
}

/// Their sum, by halves.
#[inline(always)]
fn sum_of_eight(lanes: &[f32; HALF]) -> f32 {
    let mut four = [0.0; HALF / 2];
    for k in 0..HALF / 2 {
        four[k] = lanes[k] + lanes[k + HALF / 2];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::raster::Gray;

    /// A corner aside of its window's centre, in slanting light, whose edges are bent.
    fn corner<const K: usize>(amplitude: f64) -> Corner<K> {
        Corner {
            position: DVec2::new(0.3, -0.2),
            blur_px: 1.1,
            amplitude,
            level: 0.5,
            slope: DVec2::new(0.0004, -0.0002),
            angles: std::array::from_fn(|k| 0.4 + 1.1 * k as f64),
            bends: std::array::from_fn(|k| 0.004 * k as f64 - 0.003),
            across_px: std::array::from_fn(|k| 20.0 + k as f64),
        }
    }

    /// A picture as it is, and one that is blurred unevenly, with a halo and ink.
    fn optics() -> [Optics; 2] {
        let mut all = Optics::default();
        (all.astigmatism, all.halo, all.ink) = ([0.2, -0.15], [0.3, 2.5], 0.4);
        [Optics::default(), all]
    }

    /// What the model shows of a corner at the pixels of a window.
    fn shown<const K: usize>(window: &Window, corner: &Corner<K>, optics: &Optics) -> Vec<f32> {
        let mut fitter = CornerFitter::default();
        let piece = optics.piece(corner.level, corner.amplitude);
        fitter.fill::<K, false>(window, corner, optics, piece);
        fitter.columns[PARAMS][..window.count].iter().map(|residual| -residual).collect()
    }

    #[test]
    fn derivatives_are_those_of_what_is_shown() {
        fn check<const K: usize>(corner: &Corner<K>, optics: &Optics) {
            let window = Window::new(8);
            let mut fitter = CornerFitter::default();
            let piece = optics.piece(corner.level, corner.amplitude);
            fitter.fill::<K, false>(&window, corner, optics, piece);
            for parameter in 0..ANGLE + K {
                let size = if (SLOPE..ANGLE).contains(&parameter) { 1e-3 } else { 4e-3 };
                let [after, before] = [size, -size].map(|by| {
                    let mut step = SVector::zeros();
                    step[parameter] = by;
                    shown(&window, &corner.moved(&step, window.radius).unwrap(), optics)
                });
                let column = &fitter.columns[parameter][..window.count];
                let scale = column.iter().fold(0.0f32, |most, by| most.max(by.abs()));
                for ((by, after), before) in column.iter().zip(after).zip(before) {
                    let quotient = (after - before) / (2.0 * size as f32);
                    let off = (by - quotient).abs() / scale;
                    // What ink leaves between three edges is told by difference quotients itself.
                    let most = if optics.ink == 0.0 { 1e-3 } else { 2e-2 };
                    assert!(off < most, "{K} edges, parameter {parameter}: {by} {quotient}");
                }
            }
        }
        for (optics, amplitude) in optics().iter().zip([0.35, -0.35]) {
            check::<2>(&corner(amplitude), optics);
            check::<3>(&corner(amplitude), optics);
        }
    }

    /// Of what the model shows the fit leaves nothing, and finds every parameter, from a start beside it.
    #[test]
    fn a_corner_is_found_in_its_own_picture() {
        fn check<const K: usize>(truth: &Corner<K>, optics: &Optics) {
            const MIDDLE: usize = 12;
            let window = Window::new(9);
            let whole = Window::new(MIDDLE);
            let pixels = shown(&whole, truth, optics);
            let side = 2 * MIDDLE + 1;
            let picture = Gray::from_fn(side, side, |x, y| pixels[y * side + x]);
            let position = truth.position + MIDDLE as f64;
            let start = Corner {
                position: position + DVec2::new(-0.4, 0.3),
                blur_px: 0.8 * truth.blur_px,
                amplitude: 0.8 * truth.amplitude,
                slope: DVec2::ZERO,
                angles: truth.angles.map(|angle| angle + 0.05),
                ..*truth
            };
            let mut fitter = CornerFitter::default();
            let found = fitter.fit((&picture).into(), &window, &start, optics, Accuracy::Full);
            let found = found.expect("a corner");
            assert!(found.noise < 1e-3 * truth.amplitude.abs(), "{K} edges: {found:?}");
            let found = found.corner;
            let off = found.position - position;
            assert!(off.length() < 1e-3, "{K} edges: {off:?}");
            let pairs = [
                (found.blur_px, truth.blur_px),
                (found.amplitude, truth.amplitude),
                (found.level, truth.level),
            ];
            let angles = found.angles.into_iter().zip(truth.angles);
            for (found, truth) in pairs.into_iter().chain(angles) {
                assert!((found - truth).abs() < 3e-3, "{K} edges: {found} {truth}");
            }
        }
        for (optics, amplitude) in optics().iter().zip([0.35, -0.35]) {
            check::<2>(&corner(amplitude), optics);
            check::<3>(&corner(amplitude), optics);
        }
    }
}
