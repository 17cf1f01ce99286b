//! Glue tabs: a trapezoid on one side of every cut edge.
//!
//! ```text
//!        b'──────a'            outside
//!       ╱          ╲
//!   ───b────────────a───       the edge; the face's side runs counter-clockwise from a to b
//!            face
//! ```

use std::collections::BTreeMap;

use glam::DVec2;

use super::plane::{TOUCHING_MM, gap_mm};
use super::unfold::{Piece, Side, Sides};
use deltille_core::angles::tangent;
use deltille_core::polygon::bounds;

/// Depth of a tab as a fraction of its edge, and its minimum and maximum, mm: the minimum fits the text, the maximum is
/// sufficient for gluing.
const DEPTH: (f64, f64, f64) = (0.15, 4.0, MAX_DEPTH_MM);

/// Maximum depth of a tab, mm.
pub(super) const MAX_DEPTH_MM: f64 = 9.0;

/// Angles between the edge of a tab and its legs, degrees, in the order tried: the usual one, flatter ones for narrow
/// gaps, and a steep one for short edges.
const LEGS_DEG: [f64; 4] = [45.0, 30.0, 20.0, 60.0];

/// Angle by which the legs of a tab could be steeper without touching anything, degrees: room for scissors between a
/// tab and its neighbours.
const SPARE_DEG: f64 = 4.0;

/// Fractions of the edge left free at each end, in the order tried.
const INSETS: [f64; 4] = [0.0, 0.06, 0.15, 0.27];

/// Fractions of the full depth, in the order tried.
const DEPTHS: [f64; 4] = [1.0, 0.8, 0.6, 0.45];

/// Minimum distance of a tab from faces and tabs that share no vertex with it, mm.
const CLEARANCE_MM: f64 = 0.5;

/// A tab on a side of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tab {
    /// The side to which it is attached.
    pub side: Side,
    /// Its corners, counter-clockwise: b, a, a', b' of the figure; mm.
    pub corners: [DVec2; 4],
    /// Its depth, mm.
    pub depth_mm: f64,
}

/// Gives each cut edge a tab on one of its sides; `None` if an edge has room on neither side. Each piece lies in its
/// own plane.
///
/// The tab goes on the side where it is larger. If both are equal, it goes on the side with the lower number in its
/// face, so that the tabs of a regular net all point the same way round.
pub(super) fn place(pieces: &[Piece], sides: &Sides) -> Option<Vec<Vec<Tab>>> {
    let mut tabs: Vec<Vec<Tab>> = vec![Vec::new(); pieces.len()];
    let mut places = BTreeMap::new();
    for (p, piece) in pieces.iter().enumerate() {
        places.extend(piece.iter().enumerate().map(|(f, face)| (face.face, (p, f))));
    }
    for (own, partner) in cut_edges(pieces, sides) {
        let best = [own, partner].into_iter().filter_map(|side| {
            let &(p, f) = places.get(&side.face)?;
            let tab = largest(&pieces[p], f, side, &tabs[p])?;
            Some((p, tab))
        });
        let (p, tab) = best.max_by(|(_, a), (_, b)| {
            let order =
                |tab: &Tab| (std::cmp::Reverse(tab.side.side), std::cmp::Reverse(tab.side.face));
            a.size().total_cmp(&b.size()).then_with(|| order(a).cmp(&order(b)))
        })?;
        tabs[p].push(tab);
    }
    Some(tabs)
}

/// Returns the edges of the solid along which the net is cut, as pairs of sides in the order of faces.
pub(super) fn cut_edges(pieces: &[Piece], sides: &Sides) -> Vec<(Side, Side)> {
    let faces = || pieces.iter().flatten();
    let folded: Vec<(Side, Side)> = faces().filter_map(|face| face.hinge).collect();
    let mut all: Vec<(Side, Side)> = faces()
        .flat_map(|face| sides.of(face.face))
        .filter_map(|side| Some((side, sides.partner(side)?)))
        .filter(|(own, partner)| own < partner)
        .filter(|&(a, b)| !folded.contains(&(a, b)) && !folded.contains(&(b, a)))
        .collect();
    all.sort_unstable();
    all
}

impl Tab {
    /// Returns depth times length, rounded so that equal tabs compare equal.
    fn size(&self) -> f64 {
        let [b, a, ..] = self.corners;
        (self.depth_mm * a.distance(b) * 1e6).round() / 1e6
    }

    fn new(side: Side, [from, to]: [DVec2; 2], depth: f64, inset: f64, leg_deg: f64) -> Self {
        let along = (to - from).normalize_or_zero();
        let outwards = -along.perp();
        let length = from.distance(to);
        let (a, b) = (from + along * inset * length, to - along * inset * length);
        let step = along * (depth / tangent(leg_deg.to_radians()));
        let corners = [b, a, a + outwards * depth + step, b + outwards * depth - step];
        Self { side, corners, depth_mm: depth }
    }

    /// Returns whether the outer edge is at least half as long as the inner one.
    fn is_wide(&self) -> bool {
        let [b, a, far_a, far_b] = self.corners;
        (far_b - far_a).dot(b - a) >= 0.5 * (b - a).length_squared()
    }
}

/// Returns the largest tab that fits on a side of face `at` of a piece.
fn largest(piece: &Piece, at: usize, side: Side, tabs: &[Tab]) -> Option<Tab> {
    let ends = piece[at].ends(side.side);
    let (part, least, most) = DEPTH;
    let full = (part * ends[0].distance(ends[1])).clamp(least, most);
    let depths = DEPTHS.iter().map(|part| (part * full).max(least));
    let mut shapes = depths.flat_map(|depth| {
        INSETS.iter().flat_map(move |&inset| LEGS_DEG.iter().map(move |&leg| (depth, inset, leg)))
    });
    let obstacles = || {
        let faces = piece.iter().enumerate().filter(|&(f, _)| f != at);
        faces.map(|(_, face)| &face.corners[..]).chain(tabs.iter().map(|tab| &tab.corners[..]))
    };
    // Only nearby polygons can be touched.
    let [x0, y0, x1, y1] = bounds(&ends);
    let reach = full + CLEARANCE_MM;
    let near: Vec<&[DVec2]> = obstacles()
        .filter(|other| {
            let [left, lower, right, upper] = bounds(*other);
            left < x1 + reach && right > x0 - reach && lower < y1 + reach && upper > y0 - reach
        })
        .collect();
    shapes.find_map(|(depth, inset, leg)| {
        let tab = Tab::new(side, ends, depth, inset, leg);
        let swept = Tab::new(side, ends, depth, inset, (leg + SPARE_DEG).min(89.0));
        (tab.is_wide() && near.iter().all(|other| is_clear(&swept, other))).then_some(tab)
    })
}

/// Returns whether a tab stays clear of a polygon, which may touch an end of its edge.
fn is_clear(tab: &Tab, other: &[DVec2]) -> bool {
    let [b, a, ..] = tab.corners;
    let meet = other.iter().any(|v| v.distance(a).min(v.distance(b)) < TOUCHING_MM);
    gap_mm(&tab.corners, other) >= if meet { -TOUCHING_MM } else { CLEARANCE_MM }
}
