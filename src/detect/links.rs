//! Which corner follows which along each of the rays.

use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::edge::{MAX_CHORD_RAD, is_clean};
use super::saddles::Saddle;
use super::sectors::turn;
use crate::raster::Gray;

/// Nearest corners looked at: up to six neighbours, the twelve behind them, and as many strangers.
const NEAREST: usize = 36;

/// Contrasts of neighbouring corners differ by less than this factor: light falls off slowly, and
/// what is weaker is noise on the paper beside the board.
const MAX_CONTRAST_RATIO: f64 = 3.0;

/// The far end of an edge: a corner, and which of its rays looks back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// Index of the corner.
    pub corner: usize,
    /// Index of its ray.
    pub ray: usize,
}

/// The links of a corner along its rays.
pub type Links<const N: usize> = [Option<Link>; N];

/// For every corner the links along its N rays; links are mutual.
pub fn links<const N: usize>(image: &Gray<i16>, saddles: &[Saddle<N>]) -> Vec<Links<N>> {
    let places = saddles.iter().enumerate().map(|(i, s)| GeomWithData::new(s.position, i));
    let tree = RTree::bulk_load(places.collect());
    let mut found: Vec<Links<N>> = saddles
        .iter()
        .enumerate()
        .map(|(index, saddle)| {
            let near: Vec<usize> = tree
                .nearest_neighbor_iter(saddle.position)
                .map(|place| place.data)
                .filter(|&other| other != index)
                .take(NEAREST)
                .collect();
            std::array::from_fn(|ray| nearest_along(image, saddles, saddle, ray, &near))
        })
        .collect();
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

/// The nearest corner that a clean edge joins to ray `i` of `saddle`.
fn nearest_along<const N: usize>(
    image: &Gray<i16>,
    saddles: &[Saddle<N>],
    saddle: &Saddle<N>,
    i: usize,
    near: &[usize],
) -> Option<Link> {
    near.iter().find_map(|&corner| {
        let other = &saddles[corner];
        let j = facing_ray(saddle, i, other)?;
        is_clean(image, saddle, i, other, j).then_some(Link { corner, ray: j })
    })
}

/// The ray of `b` that looks back along ray `i` of `a`; `None` when they do not face each other.
///
/// Opposite ends of an edge see its dark side on opposite hands, so the rays differ in parity, and
/// their contrasts are alike.
pub fn facing_ray<const N: usize>(a: &Saddle<N>, i: usize, b: &Saddle<N>) -> Option<usize> {
    let (ours, theirs) = (a.sectors.amplitude, b.sectors.amplitude);
    if ours.max(theirs) > MAX_CONTRAST_RATIO * ours.min(theirs) {
        return None;
    }
    let [dx, dy] = [b.position[0] - a.position[0], b.position[1] - a.position[1]];
    let chord = dy.atan2(dx);
    if turn(chord, a.sectors.rays[i]).abs() > MAX_CHORD_RAD {
        return None;
    }
    let back = chord + std::f64::consts::PI;
    let off = |j: usize| turn(back, b.sectors.rays[j]).abs();
    let j = (0..N).filter(|j| j % 2 != i % 2).min_by(|&p, &q| off(p).total_cmp(&off(q)))?;
    (off(j) <= MAX_CHORD_RAD).then_some(j)
}
