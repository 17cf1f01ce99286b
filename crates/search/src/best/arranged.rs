//! Unions of cosets arranged on the tag, judged by the number of words that satisfy the rules, or by the result of
//! local search.

use rayon::prelude::*;

use super::budget::{Spent, is_past};
use super::request::{Best, Start};
use crate::algebra::arrange::Arranger;
use crate::joint::{AllWords, Joint};
use deltille_core::family::algebra::{Arrangement, CosetUnion, has_free_centre};
use deltille_core::family::{Control, Screen};

/// Maximum number of words from which an arrangement is scored. If there are more, a sample is
/// sufficient.
pub(super) const JUDGED_WORDS: usize = 30_000;

/// A union and its arrangement.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) source: String,
    pub(super) union: CosetUnion,
    pub(super) arrangement: Arrangement,
    /// Expected number of codes; codes that local search may repair count fractionally.
    pub(super) worth: f64,
    /// Guaranteed number of codes without local search.
    pub(super) sure: usize,
    /// Codes after local search.
    pub(super) codes: Vec<u64>,
}

/// The candidate with the most guaranteed codes so far; it ensures that the result has the number
/// of codes that progress reports state.
pub(super) struct Surest {
    /// Number of codes known without the candidate.
    pub(super) known: usize,
    pub(super) candidate: Option<Candidate>,
}

impl Surest {
    pub(super) fn codes(&self) -> usize {
        self.candidate.as_ref().map_or(0, |candidate| candidate.sure).max(self.known)
    }

    pub(super) fn keep(&mut self, candidates: &[Candidate]) {
        let best = candidates.iter().max_by_key(|candidate| candidate.sure);
        if let Some(best) = best.filter(|best| best.sure > self.codes()) {
            self.candidate = Some(best.clone());
        }
    }
}

impl Best {
    fn arranger_of(&self, union: &CosetUnion) -> Arranger {
        self.arranger(union, union.some_orbits(JUDGED_WORDS).1)
    }

    /// Creates the arranger of a union, judged by some of its orbits.
    pub(super) fn arranger(&self, union: &CosetUnion, orbits: Vec<u64>) -> Arranger {
        /// Number of differing pairs that changing one cell can add, and the approximate fraction of these repaired
        /// words without conflict.
        const REPAIR: (u32, f64) = (3, 0.45);
        let free_centre = has_free_centre(union);
        let arranger =
            Arranger::new(self.dimension, self.distance, &self.rules, orbits, free_centre);
        let screen = self.screen();
        let arranger = match screen.is_robust() {
            true => arranger.with_sums(union.differences_lighter_than(screen.reach())),
            false => arranger,
        };
        if self.exchange_pays()
            && self.rules.min_complexity > 0.0
            && self.dimension.bits() <= crate::polish::MAX_BITS
            && min_distance(union) > self.distance
        {
            arranger.with_nearly(REPAIR.0, REPAIR.1)
        } else {
            arranger
        }
    }

    /// Arranges the candidates thoroughly; returns the best first.
    pub(super) fn rearrange(
        &self,
        candidates: &mut [Candidate],
        spent: &Spent,
        share: f64,
        surest: &mut Surest,
        control: Control,
    ) {
        let until = spent.until(share);
        let over = || is_past(until) || control.is_cancelled();
        let arrangers: Vec<Arranger> =
            candidates.iter().map(|c| self.arranger_of(&c.union)).collect();
        let enough = self.most();
        let mut steps = 4_000;
        for round in 0..spent.rounds(u64::MAX) {
            candidates.par_iter_mut().zip(&arrangers).for_each(|(candidate, arranger)| {
                if !over() {
                    let seed = self.seed.wrapping_add(1_000_003 * (round + 1));
                    let (worth, arrangement) = arranger.anneal(seed, steps, over);
                    if worth > candidate.worth {
                        candidate.sure = arranger.sure(&arrangement);
                        (candidate.worth, candidate.arrangement) = (worth, arrangement);
                    }
                }
            });
            surest.keep(candidates);
            spent.step();
            control.tell(spent.thousandths(), 1000, surest.codes());
            if over() || candidates.is_empty() || surest.codes() >= enough {
                break;
            }
            steps = (steps * 3 / 2).min(200_000);
        }
        candidates.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    }

    /// Returns the construction on record as a candidate.
    pub(super) fn on_record(&self, start: &Start) -> Option<Candidate> {
        let construction = &start.construction;
        let union = construction.union(self.dimension).ok()?;
        let (source, arrangement) = (construction.source.clone(), construction.arrangement.clone());
        let (codes, sure) = (start.codes.clone(), start.codes.len());
        Some(Candidate { source, union, arrangement, worth: 0.0, sure, codes })
    }

    /// Arranges the best candidates and the construction on record for the best result of local search; returns the
    /// best first.
    #[expect(clippy::too_many_arguments)]
    pub(super) fn jointly(
        &self,
        screen: &Screen,
        candidates: &mut Vec<Candidate>,
        record: Option<Candidate>,
        spent: &Spent,
        share: f64,
        surest: &mut Surest,
        control: Control,
    ) {
        /// Number of candidates that are refined.
        const KEPT: usize = 3;
        /// Steps of the first round; each further round has 50 % more than the previous one.
        const STEPS: u32 = 60;
        let until = spent.until(share);
        let over = || is_past(until) || control.is_cancelled();
        candidates.truncate(KEPT);
        candidates.extend(record);
        let arrangers: Vec<Arranger> =
            candidates.iter().map(|c| self.arranger_of(&c.union)).collect();
        let all = AllWords::new(screen, &over);
        let mut steps = STEPS;
        for round in 0..spent.rounds(u64::MAX) {
            candidates.par_iter_mut().zip(&arrangers).for_each(|(candidate, arranger)| {
                let Candidate { union, arrangement, sure, codes, .. } = candidate;
                let joint = Joint { screen, union, arranger, all: all.as_ref() };
                let seed = self.seed.wrapping_add(1_000_033 * (round + 1));
                let (better, found) = joint.anneal(arrangement, seed, steps, &over);
                if found.len() > codes.len() {
                    *sure = found.len();
                    (*arrangement, *codes) = (better, found);
                }
            });
            surest.keep(candidates);
            spent.step();
            control.tell(spent.thousandths(), 1000, surest.codes());
            if over() || candidates.is_empty() || surest.codes() >= self.most() {
                break;
            }
            steps = steps * 3 / 2;
        }
        candidates.sort_by_key(|c| std::cmp::Reverse(c.codes.len()));
    }
}

/// Computes the minimum distance of a union of cosets.
fn min_distance(union: &CosetUnion) -> u32 {
    let differences = union
        .cosets
        .iter()
        .enumerate()
        .flat_map(|(i, a)| union.cosets[..=i].iter().map(move |b| a ^ b));
    differences
        .flat_map(|shift| union.code.words().map(move |w| (w ^ shift).count_ones()))
        .filter(|&weight| weight > 0)
        .min()
        .unwrap_or(u32::MAX)
}
