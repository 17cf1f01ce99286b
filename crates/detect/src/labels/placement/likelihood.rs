//! Likelihood of the tiles of a grid under a placement.

use std::collections::BTreeSet;

use super::alternatives::{DIRTY, PLAIN_PARTS, SPOILT, add, greatest, mean, or_spoilt};
use super::labeller::{LabelTag, TagLabeller};
use super::motion::turns_of;
use super::sight::Sight;
use crate::grid::saddle_grid::mirrored;
use deltille_core::lattice::{LatticeMap, Tile, Vertex};

/// Minimum evidence of a single tile that proposes a placement, nats.
pub(super) const PROPOSING: f64 = 1.0;

/// A tile under a placement: log-likelihood ratios over random cells, nats.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    /// For the predicted content, for each probability in [`DIRTY`].
    pub(super) predicted: [f64; DIRTY.len()],
    /// For a board with tags in the same tiles, but another code in this one.
    pub(super) other_code: [f64; DIRTY.len()],
    /// For a board of arbitrary plain tiles and codes, for each fraction in [`PLAIN_PARTS`]; `None` for tiles beyond
    /// the panel.
    pub(super) of_board: Option<[f64; PLAIN_PARTS.len()]>,
}

/// A placement of a grid on a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Index of the [`Sight`](super::sight::Sight): the readings of all tiles in one way.
    pub(super) sight: usize,
    /// Index of the panel.
    pub(super) panel: usize,
    /// Motion of the lattice from the grid (mirrored if the sight is) to the panel.
    pub(super) map: LatticeMap,
    /// Evidence for it, nats. For a proposal: the sum over the tiles that support it.
    pub(super) evidence: f64,
}

impl TagLabeller {
    /// Returns the evidence for a placement, nats, from tiles without taken corners: the
    /// log-likelihood of its prediction minus that of the better of the two alternative boards.
    pub(super) fn evidence(
        &self,
        sight: &Sight,
        placement: &Placement,
        taken: &BTreeSet<Vertex>,
    ) -> f64 {
        let mut predicted = [0.0; DIRTY.len()];
        let mut other_codes = [0.0; DIRTY.len()];
        let mut of_board = [0.0; PLAIN_PARTS.len()];
        for tile in self.judged(sight, placement, taken) {
            add(&mut predicted, tile.predicted);
            add(&mut other_codes, tile.other_code);
            add(&mut of_board, tile.of_board.unwrap_or_default());
        }
        mean(predicted) - greatest(of_board).max(mean(other_codes))
    }

    /// Returns the evidence for a placement relative to natural images, nats, if a single tag
    /// supports it.
    pub(super) fn over_nature(&self, sight: &Sight, placement: &Placement) -> Option<f64> {
        let natural = self.natural.as_ref()?;
        let mut speaking = self.expected(placement).filter_map(|(tile, tag, rotations)| {
            let reading = *sight.index.get(&tile)?;
            let word = self.words.rotations() * tag.code + rotations;
            (f64::from(sight.evidence[reading][word]) > PROPOSING).then_some((reading, word))
        });
        let (Some((reading, word)), None) = (speaking.next(), speaking.next()) else { return None };
        let half_odds = &sight.readings[reading].half_odds;
        let white = |bit: usize| self.words.word(word) >> bit & 1 == 1;
        let sum = |(bit, &odds): (usize, &f32)| f64::from(if white(bit) { odds } else { -odds });
        let of_code: f64 = half_odds.iter().enumerate().map(sum).sum();
        Some(of_code - natural.log_likelihood(half_odds))
    }

    /// Returns the numbers of tiles that agree and disagree with a placement. A tile disagrees if a board of arbitrary
    /// content explains it clearly better.
    pub(super) fn agreement(&self, sight: &Sight, placement: &Placement) -> [usize; 2] {
        let against = |tile: &Judged| {
            greatest(tile.predicted) < tile.of_board.map_or(0.0, greatest) - PROPOSING
        };
        let (against, agreeing): (Vec<Judged>, Vec<Judged>) =
            self.judged(sight, placement, &BTreeSet::new()).partition(against);
        [agreeing.len(), against.len()]
    }

    /// Returns the tiles of a sight under a placement, without those that have a taken corner.
    pub(super) fn judged(
        &self,
        sight: &Sight,
        placement: &Placement,
        taken: &BTreeSet<Vertex>,
    ) -> impl Iterator<Item = Judged> {
        let free = |tile: Tile| {
            let side = |v: Vertex| if sight.way.mirrored { mirrored(v) } else { v };
            taken.is_empty() || tile.vertices().all(|v| !taken.contains(&side(v)))
        };
        let tiles = (0..sight.readings.len()).filter(move |&i| free(sight.readings[i].tile));
        tiles.filter_map(move |index| self.judge(sight, placement, index))
    }

    /// Judges a reading under a placement. Returns `None` if the placement predicts nothing for its tile.
    pub(super) fn judge(
        &self,
        sight: &Sight,
        placement: &Placement,
        index: usize,
    ) -> Option<Judged> {
        let panel = &self.panels[placement.panel];
        let (tile, shown) = (sight.readings[index].tile, &sight.shown[index]);
        let on_panel = placement.map.apply_tile(tile);
        if let Some(tag) = panel.tags.get(&on_panel) {
            let word = self.words.rotations() * tag.code + turns_of(placement.map, tile);
            // The boards for comparison have the best code other than the predicted one.
            let but = usize::from(shown.word == word);
            let evidence = sight.evidence[index][word].into();
            // If every tile has a tag, no plain tiles show how many are hidden.
            let hidden = |chance| if self.is_dense { chance } else { SPOILT };
            let predicted = DIRTY.map(|chance| or_spoilt(evidence, hidden(chance)));
            let other_code = [shown.code[but]; DIRTY.len()];
            let of_board = Some(shown.of_board[but]);
            Some(Judged { predicted, other_code, of_board })
        } else if panel.tiles.contains(&on_panel) {
            let predicted = shown.if_plain;
            let of_board = Some(shown.of_board[0]);
            Some(Judged { predicted, other_code: predicted, of_board })
        } else if self.panels_abut || sight.readings[index].has_hidden {
            None
        } else {
            let predicted = [SPOILT.ln(); DIRTY.len()];
            Some(Judged { predicted, other_code: predicted, of_board: None })
        }
    }

    /// Returns the tags of the panel under a placement: tile of the grid (mirrored if its sight is), tag, and number of
    /// counter-clockwise rotations of the tag in that tile.
    pub(super) fn expected(
        &self,
        placement: &Placement,
    ) -> impl Iterator<Item = (Tile, LabelTag, usize)> {
        let grid_from_panel = placement.map.inverse();
        self.panels[placement.panel].tags.iter().map(move |(&tile, &tag)| {
            let on_grid = grid_from_panel.apply_tile(tile);
            let a = grid_from_panel.apply(tile.frame()[0]);
            let rotations = on_grid.vertices().position(|v| v == a).unwrap_or(0);
            (on_grid, tag, rotations)
        })
    }
}
