//! Selects the unfolding of a solid to print: one piece, or the pieces that need the fewest pages.

use glam::DVec2;

use super::nest::{self, Outline, Place};
use super::tabs::{self, Tab};
use super::unfold::{self, Piece, Sides};
use deltille_core::targets::{Face, Polyhedron, SolidSpec};

/// Largest piece sizes to try, as fractions of the usable page: large pieces are less work to glue, small ones waste
/// less paper.
const PARTS_OF_ROOM: [f64; 6] = [1.0, 0.7, 0.5, 0.35, 0.25, 0.18];

/// Number of growth orders tried for each size.
const ORDERS: u64 = 4;

/// A net in its own frame: faces, and the tabs of each piece.
pub(super) struct Net {
    pub(super) pieces: Vec<Piece>,
    pub(super) tabs: Vec<Vec<Tab>>,
}

/// A net whose pieces are placed on pages.
pub(super) struct Nested {
    pub(super) net: Net,
    /// Position of each piece.
    pub(super) places: Vec<Place>,
    pub(super) pages: usize,
}

impl Nested {
    /// Returns the number of pages to print, then the number of pieces to glue.
    fn work(&self) -> [usize; 2] {
        [self.pages, self.net.pieces.len()]
    }
}

/// Returns the net that needs the fewest pages of this usable size; among equals, the one with the fewest pieces.
pub(super) fn nest_on(flat: &[Vec<DVec2>], sides: &Sides, room: DVec2) -> Option<Nested> {
    let mut best: Option<Nested> = None;
    for part in PARTS_OF_ROOM {
        let mut fewest = usize::MAX;
        for seed in 0..ORDERS {
            let most = room * part;
            let fit = |points: &[DVec2]| nest::fits(points, tabs::MAX_DEPTH_MM, most);
            let pieces = unfold::in_pieces_that_fit(flat, sides, seed, fit);
            fewest = fewest.min(pieces.len());
            let Some(net) = with_tabs(pieces, sides) else { continue };
            let outline = |(piece, tabs): (&Piece, &Vec<Tab>)| -> Outline {
                let faces = piece.iter().map(|face| face.corners.clone());
                faces.chain(tabs.iter().map(|tab| tab.corners.to_vec())).collect()
            };
            let outlines: Vec<Outline> = net.pieces.iter().zip(&net.tabs).map(outline).collect();
            let Some(places) = nest::nest(&outlines, room) else { continue };
            let pages = 1 + places.iter().map(|place| place.page).max().unwrap_or_default();
            let nested = Nested { net, places, pages };
            if best.as_ref().is_none_or(|best| nested.work() < best.work()) {
                best = Some(nested);
            }
        }
        // Single faces are the smallest possible pieces.
        if fewest == flat.len() {
            break;
        }
    }
    best
}

/// Returns the unfoldings that have room for tabs, best first.
pub(super) fn nets(
    solid: &Polyhedron,
    spec: &SolidSpec,
    faces: &[Face],
    sides: &Sides,
) -> Vec<Net> {
    let flat = outlines(faces);
    let with_tabs = |pieces: Vec<Piece>| with_tabs(pieces, sides);
    let unfoldings = unfold::unfoldings(solid, &spec.shape, &flat);
    let nets: Vec<Net> = unfoldings.into_iter().filter_map(with_tabs).collect();
    if !nets.is_empty() {
        return nets;
    }
    // A single face has room for all of its tabs.
    let sizes = std::iter::successors(Some(flat.len()), |most| Some(most * 3 / 4));
    let mut fewest = sizes.take_while(|&most| most > 0).filter_map(|most| {
        let small = unfold::in_small_pieces(solid, &flat, most).filter_map(with_tabs);
        small.min_by_key(|net| net.pieces.len())
    });
    fewest.next().into_iter().collect()
}

pub(super) fn outlines(faces: &[Face]) -> Vec<Vec<DVec2>> {
    faces.iter().map(|face| face.outline_mm.clone()).collect()
}

fn with_tabs(pieces: Vec<Piece>, sides: &Sides) -> Option<Net> {
    let tabs = tabs::place(&pieces, sides)?;
    Some(Net { pieces, tabs })
}
