//! A corner, its parameters, and the limits of a step.

use glam::DVec2;
use nalgebra::SVector;

use super::window::MAX_RADIUS;

/// Number of parameters of three edges; two leave the last one unused.
pub(super) const PARAMS: usize = 10;

/// Indices of the parameters: the position's x.
pub(super) const X: usize = 0;
/// The position's y.
pub(super) const Y: usize = 1;
/// ln s.
pub(super) const LN_BLUR: usize = 2;
/// The amplitude.
pub(super) const AMPLITUDE: usize = 3;
/// The level.
pub(super) const LEVEL: usize = 4;
/// g_u, followed by g_v.
pub(super) const SLOPE: usize = 5;
/// The first angle; the others follow.
pub(super) const ANGLE: usize = 7;

/// Maximum change of the logarithm of the blur in one step. Linear equations contain little
/// information about a blur that is e times as wide.
const MAX_LN_BLUR: f64 = 1.0;

/// Minimum blur, px: that of a pixel's box, as approximated by [`super::look::PixelBox`]. With less, blur and position of an
/// edge along a row or column could not be distinguished, because only one row of pixels is grey. The maximum is half the
/// radius.
pub(crate) const MIN_BLUR_PX: f64 = 0.273;

/// Minimum angle between edges. Closer ones are a single edge, or a wrong minimum: 75° of tilt leave 17°.
const MIN_ANGLE_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// Number of the corner's own parameters.
pub(crate) const OWN: usize = PARAMS;

/// A corner of K edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner<const K: usize> {
    /// Position, px.
    pub position: DVec2,
    /// Standard deviation of the blur including the pixel's box, px.
    pub blur_px: f64,
    /// Half the contrast, as a fraction of full scale; negative if the sector before the first edge
    /// is dark.
    pub amplitude: f64,
    /// Mean of dark and bright, as a fraction of full scale.
    pub level: f64,
    /// Relative change of the illumination per pixel.
    pub slope: DVec2,
    /// Image angles of the edges, increasing within 180°, radians.
    pub angles: [f64; K],
    /// Curvatures of the edges, to the left of their directions (towards greater v for the
    /// direction u), 1/px.
    pub bends: [f64; K],
    /// Distance from each edge of a point one edge length away on the print, px; 0 without a grid.
    pub across_px: [f64; K],
}

impl<const K: usize> Corner<K> {
    /// Returns the corner with its first J edges; further ones have no meaning.
    pub(crate) fn with_edges<const J: usize>(self) -> Corner<J> {
        let Self { position, blur_px, amplitude, level, slope, angles, bends, across_px } = self;
        let first = |edges: [f64; K]| std::array::from_fn(|k| edges.get(k).copied().unwrap_or(0.0));
        let [angles, bends, across_px] = [first(angles), first(bends), first(across_px)];
        Corner { position, blur_px, amplitude, level, slope, angles, bends, across_px }
    }

    /// Returns the corner after a step of its own parameters in the joint equations.
    pub(crate) fn stepped(&self, step: &SVector<f64, OWN>) -> Option<Self> {
        let mut moved = Self { position: DVec2::ZERO, ..*self }.moved(step, MAX_RADIUS)?;
        moved.position += self.position;
        Some(moved)
    }

    /// Returns the corner after a step; `None` if it leaves the range that the window can determine.
    pub(super) fn moved(&self, step: &SVector<f64, PARAMS>, radius: usize) -> Option<Self> {
        let mut corner = *self;
        corner.position += DVec2::new(step[X], step[Y]);
        corner.blur_px = (corner.blur_px * step[LN_BLUR].clamp(-MAX_LN_BLUR, MAX_LN_BLUR).exp())
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

    /// Returns whether black and white are those of another corner, within the tolerance for a piece of a tone curve.
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
