//! A corner, its parameters, and how far steps may take them.

use glam::DVec2;
use nalgebra::SVector;

use super::window::MAX_RADIUS;

/// Parameters of three edges; two leave the last one unused.
pub(super) const PARAMS: usize = 10;

/// Places of the parameters: the position's x.
pub(super) const X: usize = 0;
/// Its y.
pub(super) const Y: usize = 1;
/// ln s.
pub(super) const LN_BLUR: usize = 2;
/// The amplitude.
pub(super) const AMPLITUDE: usize = 3;
/// The level.
pub(super) const LEVEL: usize = 4;
/// g_u, and g_v behind it.
pub(super) const SLOPE: usize = 5;
/// The first angle; the others follow.
pub(super) const ANGLE: usize = 7;

/// The logarithm of the blur changes by no more than this in one step: linear equations tell little of a blur that is e times
/// as wide.
const MOST_LN_BLUR: f64 = 1.0;

/// Blurs that can be told apart within a window: from that of a pixel's box to half the radius.
pub(super) const MIN_BLUR_PX: f64 = 0.2;

/// Edges closer than this are one edge, or a wrong minimum: 75° of tilt leave 17°.
const MIN_ANGLE_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// Parameters that are the corner's.
pub(crate) const OWN: usize = PARAMS;

/// A corner of K edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner<const K: usize> {
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

impl<const K: usize> Corner<K> {
    /// The corner with its first J edges; further ones mean nothing.
    pub(crate) fn with_edges<const J: usize>(self) -> Corner<J> {
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
    pub(super) fn moved(&self, step: &SVector<f64, PARAMS>, radius: usize) -> Option<Self> {
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
    pub(super) fn is_lit_like(&self, other: &Self, tolerance: f64) -> bool {
        let change = (self.level - other.level).abs().max((self.amplitude - other.amplitude).abs());
        change <= tolerance * self.amplitude.abs()
    }

    pub(super) fn edges_are_apart(&self) -> bool {
        let last = self.angles[0] + std::f64::consts::PI;
        self.angles.windows(2).all(|pair| pair[1] - pair[0] > MIN_ANGLE_RAD)
            && last - self.angles[K - 1] > MIN_ANGLE_RAD
    }
}
