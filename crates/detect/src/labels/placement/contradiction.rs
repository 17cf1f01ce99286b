//! Contradictions: content that no print can show, which refutes a placement regardless of its evidence.

use std::collections::BTreeSet;

use super::alternatives::{SPOILT, greatest};
use super::labeller::{LabelTag, TagLabeller};
use super::likelihood::{PROPOSING, Placement};
use super::motion::turns_of;
use super::sight::{CLEARLY_OTHER, Sight};
use crate::grid::saddle_grid::{SaddleGrid, mirrored};
use deltille_core::lattice::Vertex;
use deltille_core::statistics::median;

/// Contrast of a corner, relative to that predicted from its neighbours, above which no tile is
/// missing there. At the tip of a border tile, one dark tile of three or two is missing. That
/// leaves 2/3 to 0.8, or half, of the contrast.
const FULL_CONTRAST: f64 = 0.9;

impl TagLabeller {
    /// Returns the numbers of tiles that agree with and contradict a placement, if some contradict it beyond doubt.
    /// These are clear codes that a hidden tile does not show by coincidence, and a grid that continues beyond an
    /// isolated panel.
    pub(super) fn contradiction(
        &self,
        sight: &Sight,
        grid: &SaddleGrid,
        placement: &Placement,
    ) -> Option<[usize; 2]> {
        let tags = &self.panels[placement.panel].tags;
        let is_elsewhere = |index: usize| {
            let (tile, shown) = (sight.readings[index].tile, &sight.shown[index]);
            let is_here = |tag: &LabelTag| {
                self.words.rotations() * tag.code + turns_of(placement.map, tile) == shown.word
            };
            let is_predicted =
                tags.get(&placement.map.apply_tile(tile)).is_some_and(is_here) && !shown.is_foreign;
            let is_of_panel = || {
                let mut places = self.places[shown.word / self.words.rotations()].iter();
                places.any(|&(panel, _)| panel == placement.panel)
            };
            shown.code[0] > CLEARLY_OTHER && !is_predicted && (shown.is_foreign || is_of_panel())
        };
        // Position codes are numerous and similar, so a misread code is another valid code.
        let readings = 0..sight.readings.len();
        let elsewhere = readings.filter(|&index| !self.is_dense && is_elsewhere(index)).count();
        let beyond = if self.panels_abut { 0 } else { self.beyond(sight, grid, placement) };
        let is_beyond_doubt = elsewhere > 0 || beyond as f64 * -SPOILT.ln() > CLEARLY_OTHER;
        is_beyond_doubt.then(|| {
            let [agreeing, disagreeing] = self.agreement(sight, placement);
            [agreeing, disagreeing.max(elsewhere).max(beyond)]
        })
    }

    /// Returns the number of corners beyond the panel which show that the print continues there.
    /// Along its border, tips of tiles may be mistaken for corners. These form a single row and
    /// have less contrast, because a tile is missing at each. If most corners next to the panel
    /// have full contrast, they count. Tiles with all corners beyond the panel always count.
    fn beyond(&self, sight: &Sight, grid: &SaddleGrid, placement: &Placement) -> usize {
        let Some(kind) = sight.readings.first().map(|reading| reading.tile.kind()) else {
            return 0;
        };
        let side = |v: Vertex| if sight.way.mirrored { mirrored(v) } else { v };
        let corners = &self.panels[placement.panel].corners;
        let is_on = |v: Vertex| corners.contains(&placement.map.apply(side(v)));
        let on_panel = |v: Vertex| grid.get(&v).filter(|_| is_on(v)).map(|placed| placed.amplitude);
        let beyond: BTreeSet<Vertex> = grid.keys().copied().filter(|&v| !is_on(v)).collect();
        let tiles = beyond.iter().flat_map(|&vertex| kind.tiles_from(vertex));
        let tiles = tiles.filter(|tile| tile.vertices().all(|v| beyond.contains(&v))).count();
        // Contrasts relative to those predicted by two collinear corners on the panel.
        let contrasts = beyond.iter().filter_map(|&vertex| {
            let predicted = kind.neighbours(vertex).filter_map(|next| {
                let (near, far) = (on_panel(next)?, on_panel(next + (next - vertex))?);
                Some(near * near / far)
            });
            Some(grid[&vertex].amplitude / median(predicted.collect())?)
        });
        let contrasts: Vec<f64> = contrasts.collect();
        let full = contrasts.iter().filter(|&&contrast| contrast > FULL_CONTRAST).count();
        tiles.max(if 2 * full > contrasts.len() { full } else { 0 })
    }

    /// Returns the joint evidence, nats, of all tiles of a grid that show codes, for all its placements; each panel
    /// counts once. It compares them with a board that has the same codes anywhere. Also returns the numbers of tiles
    /// that agree and disagree.
    pub(super) fn together(&self, sights: &[Sight], placements: &[Placement]) -> (f64, [usize; 2]) {
        let mut panels = BTreeSet::new();
        let once: Vec<&Placement> = placements.iter().filter(|p| panels.insert(p.panel)).collect();
        let mut surplus = 0.0;
        let mut counts = [0; 2];
        for at in once.iter().map(|placement| placement.sight).collect::<BTreeSet<usize>>() {
            let sight = &sights[at];
            let codes = sight.shown.iter().map(|shown| shown.code[0]).enumerate();
            for (index, code) in codes.filter(|&(_, code)| code > PROPOSING) {
                let mut here = once.iter().filter(|placement| placement.sight == at);
                let judged = here.find_map(|placement| self.judge(sight, placement, index));
                let predicted = judged.map_or(SPOILT.ln(), |tile| greatest(tile.predicted));
                surplus += predicted - code;
                counts[usize::from(predicted < code)] += 1;
            }
        }
        (surplus, counts)
    }
}
