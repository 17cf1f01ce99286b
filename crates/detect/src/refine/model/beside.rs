//! Effect of the borders of tags beside a corner on its window.
//!
//! A tag in a white tile has a black border. In small tiles it is visible near the corner: a square whose edges are
//! parallel to those of the corner, at distances that the target states. The blurred square is added to the pattern of
//! the corner, and moves with it.

use glam::DVec2;

use super::corner::Corner;
use super::window::{Border, MAX_PIXELS, Window};
use crate::refine::blurred_corner::Orthant;
use crate::refine::optics::{Optics, Spread};
use crate::refine::pattern::Shade;

/// Largest correlation of the blur across two sides; beyond it, a square is a line.
const MAX_RHO: f64 = 0.99;

/// Distance from an edge beyond which it changes nothing, in units of the blur.
const FAR: f32 = 4.5;

/// Change of the pattern f at every pixel, and its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Beside {
    pub(super) f: [f32; MAX_PIXELS],
    pub(super) by_position: [[f32; MAX_PIXELS]; 2],
    /// With respect to the logarithm of the blur.
    pub(super) by_scale: [f32; MAX_PIXELS],
    /// Whether there is no change.
    is_none: bool,
}

impl Default for Beside {
    fn default() -> Self {
        let none = [0.0; MAX_PIXELS];
        Self { f: none, by_position: [none; 2], by_scale: none, is_none: true }
    }
}

impl Beside {
    /// Computes the change for a corner in window coordinates.
    pub(super) fn fill<const K: usize>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: &Optics,
    ) {
        if !self.is_none {
            *self = Self::default();
        }
        for border in &window.borders {
            self.is_none = false;
            let square = Square::new(border, corner, optics);
            for i in 0..window.count {
                let place = DVec2::new(window.u[i].into(), window.v[i].into()) - corner.position;
                let [f, by_x, by_y, by_scale] = square.at(place);
                self.f[i] += f;
                self.by_position[0][i] += by_x;
                self.by_position[1][i] += by_y;
                self.by_scale[i] += by_scale;
            }
        }
    }
}

/// Signed distance in units of the blur across an edge: slope and offset.
#[derive(Clone, Copy)]
struct Side {
    normal: DVec2,
    offset: f64,
}

impl Side {
    /// Creates the side through two points, px, positive on the side of a third.
    fn new([a, b]: [DVec2; 2], inside: DVec2, core_px: f64, spread: &Spread) -> Self {
        let normal = (b - a).perp().normalize_or_zero();
        let normal = normal * normal.dot(inside - a).signum();
        let n = normal.to_array();
        // A box of half length w has the variance w²/3.
        let moved = DVec2::from(spread.way).dot(normal);
        let blur_px = core_px * (spread.product(n, n) + moved * moved / 3.0).sqrt();
        Self { normal: normal / blur_px, offset: -normal.dot(a) / blur_px }
    }

    fn at(&self, place: DVec2) -> f32 {
        (self.normal.dot(place) + self.offset) as f32
    }
}

/// A blurred square beside a corner.
struct Square {
    /// Along both directions, the side at its first corner, positive inside, and the opposite one, positive beyond.
    sides: [[Side; 2]; 2],
    orthant: Orthant<6>,
    /// Change of f within the square.
    change: f32,
    /// Strength of the halo, and its width relative to the blur.
    halo: [f32; 2],
}

impl Square {
    fn new<const K: usize>(border: &Border, corner: &Corner<K>, optics: &Optics) -> Self {
        let [first, second, opposite, last] = *border;
        let spread = optics.spread(K);
        let core_px = corner.blur_px * optics.core();
        let side = |ends, inside| Side::new(ends, inside, core_px, &spread);
        let beyond = |from: DVec2, to: DVec2| to + (to - from);
        let sides = [
            [side([first, last], second), side([second, opposite], beyond(first, second))],
            [side([first, second], last), side([last, opposite], beyond(first, last))],
        ];
        let [n, m] = sides.map(|[near, _]| near.normal.to_array());
        let rho = spread.product(n, m) / (spread.product(n, n) * spread.product(m, m)).sqrt();
        // f is the product of the signs of the distances from both edges.
        let from_edges = corner.angles.iter().take(2);
        let from_edges = from_edges.map(|&angle| DVec2::from_angle(angle).perp_dot(first));
        let in_tile: f64 = from_edges.map(f64::signum).product();
        Self {
            sides,
            orthant: Orthant::new(rho.clamp(-MAX_RHO, MAX_RHO)),
            change: -2.0 * in_tile as f32,
            halo: optics.halo.map(|halo| halo as f32),
        }
    }

    /// Returns the change of f at a position, px from the corner, and its derivatives with respect to the position of the
    /// corner and to the logarithm of the blur.
    fn at(&self, place: DVec2) -> [f32; 4] {
        let [strength, width] = self.halo;
        let reach = if strength == 0.0 { FAR } else { FAR * width };
        let mut sum = [0.0; 4];
        // A square is a quadrant, without those that begin at its far sides.
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let sides = [self.sides[0][i], self.sides[1][j]];
            let h = sides.map(|side| side.at(place));
            if h.iter().any(|&h| h < -reach) {
                continue;
            }
            let Shade { mut f, mut slopes, .. } = self.orthant.quadrant(h);
            if strength != 0.0 {
                let wide = self.orthant.quadrant(h.map(|h| h / width));
                f += strength * (f - wide.f);
                for (slope, wide) in slopes.iter_mut().zip(wide.slopes) {
                    *slope += strength * (*slope - wide / width);
                }
            }
            let change = if i == j { self.change } else { -self.change };
            sum[0] += change * f;
            for ((side, slope), h) in sides.iter().zip(slopes).zip(h) {
                sum[1] -= change * slope * side.normal.x as f32;
                sum[2] -= change * slope * side.normal.y as f32;
                sum[3] -= change * slope * h;
            }
        }
        sum
    }
}
