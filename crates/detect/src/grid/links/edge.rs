//! Tests whether an edge of the tiling joins two corners.

use glam::DVec2;

use crate::corners::saddles::Saddle;
use crate::corners::sectors::turn;
use crate::tiling::kind;
use deltille_core::lattice::GridKind;
use deltille_core::raster::Pyramid;

/// Largest angle between the chord of an edge and the rays at its ends. Over one tile, a fisheye lens bends an edge by
/// up to 20°, half of it at either end. The rays add a few degrees of noise.
pub(crate) const MAX_CHORD_RAD: f64 = 18.0 * std::f64::consts::PI / 180.0;

/// Number of sampled positions along the edge.
const STATIONS: usize = 8;

/// Fraction of the edge at either end that is not sampled, because blur mixes the sectors there.
const END: f64 = 0.15;

/// Distance of the samples from the edge, as a fraction of the height of the tile on that side. They lie well inside
/// the border of a tag (0.16 at 1.5 bits of 25) and, on all but tiny tiles, beyond the blur.
const SIDE: f64 = 0.08;

/// The same for squares, as a fraction of the edge. A neighbouring square near the edge of a fisheye image may be ten
/// times as long as wide, and the samples stay on its near half.
const SQUARE_SIDE: f64 = 0.04;

/// Minimum distance of the samples from the edge, px of the level.
const MIN_SIDE_PX: f64 = 1.2;

/// Sine of the angle between this edge and the next edges of a tile, below which the samples do not
/// follow the slant of the tile.
const MIN_ACROSS: f64 = 0.1;

/// Minimum deviation of a sample from the level, relative to the amplitude of the corners.
const MIN_DEVIATION: f64 = 0.25;

/// Number of sampled positions that may fail: a scratch or a highlight, not a gap.
const ALLOWED_FAILURES: usize = 1;

/// An end of an edge: a corner, and its ray along the edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End<'a, const N: usize> {
    /// The corner.
    pub corner: &'a Saddle<N>,
    /// Index of its ray.
    pub ray: usize,
}

impl<'a, const N: usize> End<'a, N> {
    /// Creates the end at a corner whose ray has this index.
    #[inline]
    pub(crate) fn of(corner: &'a Saddle<N>, ray: usize) -> Self {
        Self { corner, ray }
    }
}

/// Follows the edge between two ends, and returns whether its sides keep their colours.
///
/// The edge is modelled as the cubic through both corners with the directions of both rays. If the rays fit a circular
/// arc, it is the arc of the paper.
pub(crate) fn is_clean<const N: usize>(pyramid: &Pyramid, from: End<N>, to: End<N>) -> bool {
    is_clean_along(pyramid, from, to, |ends| ends)
}

/// Tests an edge like [`is_clean`]. The edge may also be the circular arc along one of the rays, or straight, because
/// blur spreads the rays of narrow sectors.
pub(crate) fn is_clean_somehow<const N: usize>(
    pyramid: &Pyramid,
    from: End<N>,
    to: End<N>,
) -> bool {
    let shapes: [fn(Slopes) -> Slopes; 4] =
        [|ends| ends, |[start, _]| [start, -start], |[_, end]| [-end, end], |_| [0.0; 2]];
    shapes.into_iter().any(|shape| is_clean_along(pyramid, from, to, shape))
}

/// Slopes of an edge relative to its chord at either end.
type Slopes = [f64; 2];

/// Tests an edge like [`is_clean`]. Its slopes follow from those of the rays.
fn is_clean_along<const N: usize>(
    pyramid: &Pyramid,
    End { corner: a, ray: i }: End<N>,
    End { corner: b, ray: j }: End<N>,
    shape: impl Fn(Slopes) -> Slopes,
) -> bool {
    // The coarser of the levels that show the corners sharply shows the edge between them.
    let level = a.level.max(b.level);
    let image = &pyramid.levels()[level];
    let from = Pyramid::from_level_0(level, a.position);
    let way = Pyramid::from_level_0(level, b.position) - from;
    let length = way.x.hypot(way.y);
    let chord = way.to_angle();
    // Slopes of the curve relative to its chord at the two ends.
    let start = turn(chord, a.sectors.rays[i]).tan();
    let end = turn(chord + std::f64::consts::PI, b.sectors.rays[j]).tan();
    let [start, end] = shape([start, end]);
    // Rays run to the left, counter-clockwise on the print. So the tile on the left lies between rays i and i + 1 here,
    // and between j and j − 1 there.
    let side = |at_a: usize, at_b: usize| {
        let cot = |saddle: &Saddle<N>, p: usize, q: usize| {
            1.0 / turn(saddle.sectors.rays[p], saddle.sectors.rays[q]).abs().tan()
        };
        let side = match kind::<N>() {
            GridKind::Deltille => SIDE * length / (cot(a, i, at_a) + cot(b, j, at_b)).max(1.0),
            GridKind::Checker => {
                let sin = |saddle: &Saddle<N>, p: usize, q: usize| {
                    turn(saddle.sectors.rays[p], saddle.sectors.rays[q]).abs().sin()
                };
                SQUARE_SIDE * length * sin(a, i, at_a).min(sin(b, j, at_b))
            }
        };
        side.max(MIN_SIDE_PX)
    };
    let (lefts, rights) = (((i + 1) % N, (j + N - 1) % N), ((i + N - 1) % N, (j + 1) % N));
    let (left_side, right_side) = (side(lefts.0, lefts.1), side(rights.0, rights.1));
    // Unit vectors along the chord and to its left on the print.
    let along = way / length;
    let left = -along.perp();
    // Displacement along the edge per step away from it, by the next edges of a tile. It keeps the samples within a
    // slanted tile.
    let next_edges = |(at_a, at_b): (usize, usize)| {
        [a.sectors.rays[at_a], b.sectors.rays[at_b]].map(|ray| {
            let ray = DVec2::from_angle(ray);
            DVec2::new(ray.dot(along), ray.dot(left))
        })
    };
    let (next_left, next_right) = (next_edges(lefts), next_edges(rights));
    let lean = |[at_a, at_b]: [DVec2; 2], t: f64| {
        let DVec2 { x: ahead, y: across } = (1.0 - t) * at_a + t * at_b;
        if across.abs() > MIN_ACROSS { ahead / across } else { 0.0 }
    };
    let dark_left = i.is_multiple_of(2);
    let amplitude = a.sectors.amplitude.min(b.sectors.amplitude);
    let mut failures = 0;
    for station in 0..STATIONS {
        let t = END + (1.0 - 2.0 * END) * (station as f64 + 0.5) / STATIONS as f64;
        // Hermite cubic in units of the length; image angles fall to the left, hence the signs.
        let offset = length * (-start * t * (1.0 - t) * (1.0 - t) + end * t * t * (1.0 - t));
        let deviation = |away: f64, next| {
            let (ahead, lateral) = (t * length + lean(next, t) * away, offset + away);
            let DVec2 { x, y } = from + along * ahead + left * lateral;
            let level = a.sectors.level + t * (b.sectors.level - a.sectors.level);
            f64::from(image.bilinear(x, y)) - level
        };
        let (on_left, on_right) =
            (deviation(left_side, next_left), deviation(-right_side, next_right));
        let (dark, bright) = if dark_left { (on_left, on_right) } else { (on_right, on_left) };
        let clean = dark < -MIN_DEVIATION * amplitude && bright > MIN_DEVIATION * amplitude;
        failures += usize::from(!clean);
        if failures > ALLOWED_FAILURES {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corners::sectors::Sectors;
    use deltille_core::raster::Gray;

    /// Dark above the arc y = 50 + bulge, bright below; corners at x = 20 and x = 80.
    fn scene(bulge: f64) -> (Gray<u16>, Saddle<6>, Saddle<6>) {
        let image = Gray::from_fn(100, 100, |x, y| {
            let t = (x as f64 - 20.0) / 60.0;
            if (y as f64) < 50.0 + 4.0 * bulge * t * (1.0 - t) { 6400 } else { 44800 }
        });
        let slope = (4.0 * bulge / 60.0).atan();
        let saddle = |x: f64, rays| Saddle {
            position: DVec2::new(x, 49.5),
            sectors: Sectors { rays, level: 400.0, amplitude: 250.0 },
            level: 0,
        };
        let mut from = [0.0; 6];
        let mut to = [0.0; 6];
        from[0] = slope;
        to[3] = std::f64::consts::PI - slope;
        (image, saddle(20.0, from), saddle(80.0, to))
    }

    #[test]
    fn straight_and_bent_edges_are_clean_in_both_directions() {
        for bulge in [-6.0, 0.0, 6.0] {
            let (image, a, b) = scene(bulge);
            let image = Pyramid::new(&image, 1, 8);
            assert!(is_clean(&image, End::of(&a, 0), End::of(&b, 3)), "bulge {bulge}");
            assert!(is_clean(&image, End::of(&b, 3), End::of(&a, 0)), "bulge {bulge}, backwards");
        }
    }

    #[test]
    fn wrong_colours_and_flat_images_are_not_clean() {
        let (image, a, b) = scene(0.0);
        for image in [image.map(|v| 51200 - v), Gray::new(100, 100)] {
            let image = Pyramid::new(&image, 1, 8);
            assert!(!is_clean(&image, End::of(&a, 0), End::of(&b, 3)));
        }
    }
}
