//! Content of the tiles of a grid, independent of the placement.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::alternatives::{DIRTY, PLAIN_PARTS, or_spoilt};
use super::labeller::{TagEvidence, TagLabeller, Way};
use crate::labels::tags::Reading;
use deltille_core::lattice::Tile;

/// Minimum evidence, nats, that a tile certainly shows a code that is not predicted: a code that
/// the target does not have, or has elsewhere.
pub(super) const CLEARLY_OTHER: f64 = 7.0;

/// Readings of the tiles of a grid in one way.
pub(super) struct Sight {
    /// How they were read.
    pub(super) way: Way,
    /// Index of the reading of each tile.
    pub(super) index: BTreeMap<Tile, usize>,
    /// The readings; their tiles are mirrored with them.
    pub(super) readings: Vec<Reading>,
    /// Λ of each reading for each word of the target, nats.
    pub(super) evidence: Vec<Vec<f32>>,
    /// Content of each reading.
    pub(super) shown: Vec<Shown>,
}

/// Content of a tile, independent of the placement: log-likelihood ratios over random cells, nats.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// If it is predicted to be plain, for each probability in [`DIRTY`].
    pub(super) if_plain: [f64; DIRTY.len()],
    /// The word of the target that fits best.
    pub(super) word: usize,
    /// Whether a code of the family that the target does not have fits better.
    pub(super) is_foreign: bool,
    /// For random cells or the best of all codes, whichever fits better: with `word` among the codes, and without it.
    pub(super) code: [f64; 2],
    /// For a board with each fraction of plain tiles in [`PLAIN_PARTS`], whose other tiles show the
    /// best code: with `word` and without it, as above.
    pub(super) of_board: [[f64; PLAIN_PARTS.len()]; 2],
}

impl TagLabeller {
    /// Compares readings with all words of the target. Adds further findings to `noted`, for
    /// example codes of the family that the target does not have.
    pub(super) fn sight(&self, way: Way, readings: Vec<Reading>, noted: &mut TagEvidence) -> Sight {
        let plain = self.readers[way.reader].plain_word();
        let mut evidence = Vec::with_capacity(readings.len());
        let mut shown = Vec::with_capacity(readings.len());
        // Those of all words, by model.
        let mut half_squares = BTreeMap::new();
        for reading in &readings {
            let word = reading.word();
            let mut of_words = match &reading.joint {
                Some(joint) => {
                    let of_model =
                        half_squares.entry(Arc::as_ptr(&joint.model)).or_insert_with(|| {
                            let all = self.words.iter();
                            all.map(|word| joint.model.half_square(word)).collect::<Vec<f32>>()
                        });
                    let products = self.words.products(&joint.linear);
                    let terms = products.into_iter().zip(of_model);
                    terms.map(|(product, half)| joint.evidence(product, *half)).collect()
                }
                None => self.words.evidence(&reading.half_odds),
            };
            if let Some(max_errors) = self.max_errors {
                for (index, evidence) in of_words.iter_mut().enumerate() {
                    if (self.words.word(index) ^ word).count_ones() > max_errors {
                        *evidence = f32::NEG_INFINITY;
                    }
                }
            }
            shown.push(self.shown(reading, plain, &of_words, noted));
            evidence.push(of_words);
        }
        let index = readings.iter().enumerate().map(|(i, reading)| (reading.tile, i)).collect();
        Sight { way, index, readings, evidence, shown }
    }

    /// Returns the content of a tile, by its evidence for the words of the target. `plain` is the word of an untagged
    /// tile.
    fn shown(
        &self,
        reading: &Reading,
        plain: u64,
        of_words: &[f32],
        noted: &mut TagEvidence,
    ) -> Shown {
        // e^Λ has the mean 1 for each of n words, so that of the best is up to n: ln n is subtracted.
        let among = |words: usize| (words.max(1) as f64).ln();
        let (mut word, mut most, mut second) = (0, f32::NEG_INFINITY, f32::NEG_INFINITY);
        for (index, &evidence) in of_words.iter().enumerate() {
            if evidence > most {
                (word, second, most) = (index, most, evidence);
            } else {
                second = second.max(evidence);
            }
        }
        let of_target = |evidence: f32| f64::from(evidence) - among(of_words.len());
        let mut code = [most, second].map(|evidence| of_target(evidence).max(0.0));
        let evidence_of = |word: u64| match &reading.joint {
            Some(joint) => joint.evidence_of(word),
            None => self.words.evidence_of(word, &reading.half_odds),
        };
        // A code of the family that the target does not have may fit better than all of these.
        let mut is_foreign = false;
        if let Some(decoder) = &self.decoder
            && let Some(decoded) = decoder.decode(reading.word(), self.sure_errors)
            && self.words.code_of(decoded.id).is_none()
        {
            let evidence = evidence_of(decoder.word(decoded));
            let clear = f64::from(evidence) - among(self.family_words);
            if evidence > most {
                is_foreign = true;
                code = code.map(|code| code.max(clear));
                if clear > CLEARLY_OTHER {
                    noted.foreign_ids.insert(decoded.id);
                }
            }
        } else if is_word(reading) && most < 0.0 {
            noted.no_codes += 1;
        }
        let plain = f64::from(evidence_of(plain));
        let of_board = code.map(|code| {
            PLAIN_PARTS.map(|part| (part * plain.exp() + (1.0 - part) * code.exp()).ln())
        });
        let if_plain = DIRTY.map(|chance| or_spoilt(plain, chance));
        Shown { if_plain, word, is_foreign, code, of_board }
    }
}

/// Returns whether the cells of a tile are read with certainty and are not all the same.
fn is_word(reading: &Reading) -> bool {
    /// Half odds of a cell that is right 19 times out of 20.
    const SURE: f32 = 1.5;
    /// Minimum fraction of certain cells. With 9 of 10, 11 of 64 boards of other families are
    /// recognised as such, and 3 of 160 other boards, all dirty, are mistaken for one. With 8 of
    /// 10, it is 15 and 9; with 19 of 20, 10 and 1.
    const SURE_CELLS: [usize; 2] = [9, 10];
    /// At least one in this many cells must have the other colour, because an untagged tile has one
    /// colour except for dirt. A random code of 16 cells fails this test once in 240, one of 25
    /// cells once in 1100. With 3, no dirt counts as a tag, but 1 in 5 tags of 16 cells is missed.
    const MIN_OTHER: usize = 6;
    // Free cells contain no information.
    let n = reading.half_odds.iter().filter(|odds| odds.abs() > 0.0).count();
    let sure = |sign: f32| reading.half_odds.iter().filter(|&&odds| sign * odds > SURE).count();
    let (white, black) = (sure(1.0), sure(-1.0));
    SURE_CELLS[1] * (white + black) >= SURE_CELLS[0] * n && MIN_OTHER * white.min(black) >= n
}
