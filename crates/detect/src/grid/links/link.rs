//! Links each corner to the next corner along each of its rays.

use glam::DVec2;

use super::edge::{End, MAX_CHORD_RAD, is_clean};
use super::neighbours::Places;
use crate::corners::saddles::Saddle;
use crate::corners::sectors::turn;
use deltille_core::raster::Pyramid;

/// Number of nearest corners of similar contrast that are tested: up to six neighbours, the twelve behind them, and as
/// many unrelated ones.
const NEAREST: usize = 36;

/// Lower bound of the squared cosine of [`MAX_CHORD_RAD`].
const MIN_ALONG: f64 = 0.9;

/// Number of corners that are tested first; inside a board, they suffice.
const FIRST: usize = 12;

/// Maximum ratio of the contrasts of neighbouring corners. Illumination falls off slowly, and
/// weaker corners are noise on the paper around the board.
pub(crate) const MAX_CONTRAST_RATIO: f64 = 3.0;

/// The far end of an edge: a corner, and its ray that points back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link {
    /// Index of the corner.
    pub corner: usize,
    /// Index of its ray.
    pub ray: usize,
}

/// The links of a corner along its rays.
pub(crate) type Links<const N: usize> = [Option<Link>; N];

/// Returns the links of every corner along its N rays; links are mutual.
pub(crate) fn links<const N: usize>(pyramid: &Pyramid, saddles: &[Saddle<N>]) -> Vec<Links<N>> {
    let positions: Vec<DVec2> = saddles.iter().map(|saddle| saddle.position).collect();
    let places = Places::new(&positions);
    let directions = |saddle: &Saddle<N>| saddle.sectors.rays.map(DVec2::from_angle);
    let directions: Vec<Directions<N>> = saddles.iter().map(directions).collect();
    let corners = Corners { pyramid, saddles, directions: &directions };
    let mut found: Vec<Links<N>> = vec![[None; N]; saddles.len()];
    for index in 0..saddles.len() {
        // The grain of an enlarged image has hundreds of its own corners between those of a board.
        let alike = |other: usize| have_similar_contrast(&saddles[index], &saddles[other]);
        let first = places.nearest(index, FIRST, alike);
        corners.link_to(&mut found, index, &first);
        if found[index].contains(&None) {
            let all = places.nearest(index, NEAREST, alike);
            corners.link_to(&mut found, index, &all[first.len()..]);
        }
    }
    for a in 0..found.len() {
        for i in 0..N {
            if let Some(Link { corner, ray }) = found[a][i]
                && found[corner][ray] != Some(Link { corner: a, ray: i })
            {
                found[a][i] = None;
            }
        }
    }
    found
}

/// Unit vectors along rays.
type Directions<const N: usize> = [DVec2; N];

/// The corners to be linked.
struct Corners<'a, const N: usize> {
    pyramid: &'a Pyramid<'a>,
    saddles: &'a [Saddle<N>],
    directions: &'a [Directions<N>],
}

impl<const N: usize> Corners<'_, N> {
    /// Links the unlinked rays of a corner to `others`, sorted by distance. Each ray is linked to the nearest corner
    /// along it.
    fn link_to(&self, found: &mut [Links<N>], index: usize, others: &[usize]) {
        let saddle = &self.saddles[index];
        let mut links = found[index];
        for &corner in others {
            let other = &self.saddles[corner];
            let open = |i: usize| links[i].is_none() && self.may_be_along(index, i, other.position);
            let open: [bool; N] = std::array::from_fn(open);
            if !open.contains(&true) {
                continue;
            }
            let chord = chord_rad(saddle, other);
            for i in (0..N).filter(|&i| open[i] && is_along(saddle, i, chord)) {
                let Some(ray) = ray_back(chord, i, other) else {
                    continue;
                };
                // An edge that was followed from the other end is clean.
                let back = Some(Link { corner: index, ray: i });
                let is_known = corner < index && found[corner][ray] == back;
                if is_known || is_clean(self.pyramid, End::of(saddle, i), End::of(other, ray)) {
                    links[i] = Some(Link { corner, ray });
                }
            }
            if !links.contains(&None) {
                break;
            }
        }
        found[index] = links;
    }

    /// Returns whether a position may pass [`is_along`]: a fast test without angles, and less strict.
    fn may_be_along(&self, index: usize, i: usize, place: DVec2) -> bool {
        let off = place - self.saddles[index].position;
        let along = off.dot(self.directions[index][i]);
        along > 0.0 && along * along >= MIN_ALONG * off.length_squared()
    }
}

/// Returns the ray of `b` that points back along ray `i` of `a`; `None` if they do not face each other.
///
/// Seen from its two ends, an edge has its dark side on opposite sides, so the rays differ in
/// parity. Their contrasts are similar.
pub(crate) fn facing_ray<const N: usize>(a: &Saddle<N>, i: usize, b: &Saddle<N>) -> Option<usize> {
    let chord = chord_rad(a, b);
    (have_similar_contrast(a, b) && is_along(a, i, chord)).then(|| ray_back(chord, i, b)).flatten()
}

/// Returns whether the contrasts of two corners may be those of neighbours.
pub(crate) fn have_similar_contrast<const N: usize>(a: &Saddle<N>, b: &Saddle<N>) -> bool {
    let (ours, theirs) = (a.sectors.amplitude, b.sectors.amplitude);
    ours.max(theirs) <= MAX_CONTRAST_RATIO * ours.min(theirs)
}

/// Returns the image angle of the direction from one corner to another.
fn chord_rad<const N: usize>(a: &Saddle<N>, b: &Saddle<N>) -> f64 {
    (b.position - a.position).to_angle()
}

fn is_along<const N: usize>(saddle: &Saddle<N>, i: usize, chord: f64) -> bool {
    turn(chord, saddle.sectors.rays[i]).abs() <= MAX_CHORD_RAD
}

/// Returns the ray of a corner that points back to the origin of ray `i` of another.
fn ray_back<const N: usize>(chord: f64, i: usize, saddle: &Saddle<N>) -> Option<usize> {
    let back = chord + std::f64::consts::PI;
    let off = |j: usize| turn(back, saddle.sectors.rays[j]).abs();
    let j = (0..N).filter(|j| j % 2 != i % 2).min_by(|&p, &q| off(p).total_cmp(&off(q)))?;
    (off(j) <= MAX_CHORD_RAD).then_some(j)
}
