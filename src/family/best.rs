//! The best of all methods within a time limit: sources of invariant codes, arranged on the tag so
//! that as many words as possible satisfy the rules, then repaired and extended by local search.
//!
//! How far it gets depends on the time, so what it found is recorded in full
//! ([`AlgebraicConstruction`]) and gives the same codes again without any search.

use std::time::{Duration, Instant};

use rand::seq::{IndexedRandom, SliceRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::algebra::arrange::Arranger;
use super::algebra::cosets::{CosetGraph, CosetUnion, MAX_SYNDROME_BITS};
use super::algebra::quasicyclic::{Symmetry, random_code};
use super::algebra::record::has_free_centre;
use super::algebra::{AlgebraicConstruction, Arrangement, CycleSpace, Span, residue};
use super::bounds::bounds;
use super::polish::{Effort, polish};
use super::search::Search;
use super::{Construction, Control, Family, FamilyError, Rules, Screen, TagWords};
use crate::lattice::Dimension;

/// What to search and for how long.
#[derive(Clone, Debug)]
pub struct Best {
    /// Dimension of the tags.
    pub dimension: Dimension,
    /// Distance h.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// Time for all of it.
    pub time: Duration,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of codes at most.
    pub limit: Option<u64>,
    /// Whether local search may exchange codes at the end; without it the family is algebraic.
    pub exchange: bool,
}

/// A union, how it is arranged, and how many words pass.
#[derive(Clone, Debug)]
struct Candidate {
    source: String,
    union: CosetUnion,
    arrangement: Arrangement,
    worth: f64,
}

/// What a random linear code is drawn by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Shape {
    symmetry: Symmetry,
    /// Dimensions at most.
    most: u32,
}

/// One draw: how many orbits it has, how it was drawn, and an arrangement when it is worth one.
struct Draw {
    orbits: usize,
    shape: Option<Shape>,
    candidate: Option<Candidate>,
}

impl Best {
    /// Searches and makes a family of what was found. Progress is reported in thousandths of the
    /// time. When it is cancelled, the time is over: the family is the best so far, and only where
    /// nothing was found yet there is none.
    pub fn family(&self, name: &str, control: Control) -> Result<Family, FamilyError> {
        self.rules.check(self.dimension.bits())?;
        let screen = Screen::new(TagWords::new(self.dimension), self.distance, &self.rules);
        let start = Instant::now();
        // Most of the gain comes from good sources and arrangements, at 25 bits and fewer also
        // from exchanging codes, where there is time for it.
        let small = self.exchange && self.dimension.bits() <= super::polish::MAX_BITS;
        let until = |share: f64| start + self.time.mul_f64(share);
        let [sources, arrangements] = match (small, self.exchange_pays()) {
            (false, _) => [0.6, 1.0],
            (true, false) => [0.6, 0.9],
            (true, true) => [0.3, 0.5],
        };
        let most = self.most();
        let mut candidates = self.sources(until(sources), start, control);
        self.rearrange(&mut candidates, until(arrangements), start, control);

        let mut best: Option<(Vec<u64>, Construction)> = None;
        for candidate in candidates {
            let left = until(1.0).saturating_duration_since(Instant::now());
            let over = left.is_zero() || !small || control.is_cancelled();
            if best.as_ref().is_some_and(|(codes, _)| over || codes.len() >= most) {
                break;
            }
            let end = Instant::now() + left.mul_f64(0.7);
            let found = self.finish(&screen, &candidate, end, control)?;
            if best.as_ref().is_none_or(|(codes, _)| found.0.len() > codes.len()) {
                best = Some(found);
            }
            control.report(self.thousandths(start), 1000, best.as_ref().map_or(0, |b| b.0.len()));
        }
        let (codes, construction) = match best {
            Some(found) if !found.0.is_empty() => found,
            _ => self.search_alone(&screen, control)?,
        };
        let rules = self.rules.clone();
        Family::new(name, self.dimension, self.distance, codes, rules, construction)
    }

    /// Whether there is time to gain more by exchanging codes than better sources gain: in a few
    /// seconds not even the conflicts are counted.
    fn exchange_pays(&self) -> bool {
        const LEAST: Duration = Duration::from_secs(20);
        self.exchange && self.time >= LEAST
    }

    /// No family is larger; once there are so many codes, the search is over.
    fn most(&self) -> usize {
        let bounds = bounds(self.dimension, self.distance);
        bounds.linear_programming.min(bounds.sphere_packing) as usize
    }

    fn thousandths(&self, start: Instant) -> u64 {
        let share = start.elapsed().as_secs_f64() / self.time.as_secs_f64().max(1e-3);
        (1000.0 * share.min(1.0)) as u64
    }

    /// Draws unions of cosets until the time is over; the most promising first.
    fn sources(&self, until: Instant, start: Instant, control: Control) -> Vec<Candidate> {
        /// Draws between two looks at the clock.
        const BATCH: u64 = 16;
        /// Candidates kept for a thorough arrangement.
        const KEPT: usize = 6;
        /// Shapes of random codes to draw more of.
        const PROMISING: usize = 4;
        let mut kept: Vec<Candidate> = Vec::new();
        let mut promising: Vec<(usize, Shape)> = Vec::new();
        let mut most_orbits = 0;
        let enough = self.most();
        let halt = || Instant::now() >= until || control.is_cancelled();
        let mut draw = 0;
        loop {
            let most = most_orbits;
            let batch: Vec<Draw> = (draw..draw + BATCH)
                .into_par_iter()
                // However short the time is, there are some draws.
                .filter(|&i| !control.is_cancelled() && (i < BATCH || !halt()))
                .map(|i| self.candidate(self.seed.wrapping_add(i), i, most, &promising, &halt))
                .collect();
            draw += BATCH;
            for Draw { orbits, shape, candidate } in batch {
                most_orbits = most_orbits.max(orbits);
                if let Some(shape) = shape {
                    match promising.iter_mut().find(|(_, s)| *s == shape) {
                        Some((best, _)) => *best = orbits.max(*best),
                        None => promising.push((orbits, shape)),
                    }
                }
                let Some(candidate) = candidate else { continue };
                let same = |c: &Candidate| {
                    c.union.code == candidate.union.code && c.worth == candidate.worth
                };
                if !kept.iter().any(same) {
                    kept.push(candidate);
                }
            }
            kept.sort_by(|a, b| b.worth.total_cmp(&a.worth));
            kept.truncate(KEPT);
            promising.sort_by_key(|&(best, shape)| (std::cmp::Reverse(best), shape));
            promising.truncate(PROMISING);
            let best = kept.first().map_or(0, |c| c.worth as usize);
            control.report(self.thousandths(start), 1000, best);
            if halt() || best >= enough {
                return kept;
            }
        }
    }

    /// One draw, with a quick arrangement when it has nearly the most orbits seen.
    fn candidate(
        &self,
        seed: u64,
        draw: u64,
        most_orbits: usize,
        promising: &[(usize, Shape)],
        halt: &(dyn Fn() -> bool + Sync),
    ) -> Draw {
        /// Share of the most orbits seen from which on an arrangement is tried. Small codes differ
        /// more in how many of their words pass, and are arranged quickly.
        const WORTH_A_TRY: [f64; 2] = [0.75, 0.93];
        const MANY_ORBITS: usize = 1_000;
        /// Steps of the quick arrangement.
        const STEPS: u32 = 3_000;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let Some((source, code, shape)) = self.linear_code(draw, promising, &mut random) else {
            return Draw { orbits: 0, shape: None, candidate: None };
        };
        let union = self.with_cosets(code, &mut random, halt);
        let orbits = union.orbits();
        let count = orbits.len();
        let share = WORTH_A_TRY[usize::from(most_orbits > MANY_ORBITS)];
        if count == 0 || (count as f64) < share * most_orbits as f64 {
            return Draw { orbits: count, shape, candidate: None };
        }
        let arranger = self.arranger(&union, orbits);
        let (worth, arrangement) = arranger.anneal(random.random(), STEPS, halt);
        let candidate = Some(Candidate { source, union, arrangement, worth });
        Draw { orbits: count, shape, candidate }
    }

    fn arranger(&self, union: &CosetUnion, orbits: Vec<u64>) -> Arranger {
        /// A changed cell makes up to three pairs differ, and about this share of such words can
        /// be had without conflict.
        const REPAIR: (u32, f64) = (3, 0.45);
        /// Words by which an arrangement is judged, at most.
        const JUDGED_WORDS: usize = 30_000;
        let free_centre = has_free_centre(union);
        // Of very many words a part tells which arrangement is good.
        let step = orbits.len().div_ceil(JUDGED_WORDS);
        let orbits = orbits.into_iter().step_by(step.max(1)).collect();
        let arranger =
            Arranger::new(self.dimension, self.distance, &self.rules, orbits, free_centre);
        if self.exchange_pays()
            && self.rules.min_complexity > 0.0
            && self.dimension.bits() <= super::polish::MAX_BITS
            && min_distance(union) > self.distance
        {
            arranger.with_nearly(REPAIR.0, REPAIR.1)
        } else {
            arranger
        }
    }

    /// A linear code: a shortened quadratic-residue code or a random quasi-cyclic one, by turns.
    fn linear_code(
        &self,
        draw: u64,
        promising: &[(usize, Shape)],
        random: &mut ChaCha8Rng,
    ) -> Option<(String, Span, Option<Shape>)> {
        let space = CycleSpace::of(self.dimension);
        let primes: Vec<u32> = residue::PRIMES
            .into_iter()
            .filter(|&q| residue::min_distance(q) >= self.distance)
            .filter(|&q| residue::space(q).cycles >= space.cycles)
            .collect();
        // A random code of 49 bits takes long to check and is far smaller.
        let only_residue = self.dimension.bits() > 36;
        if (draw.is_multiple_of(4) || only_residue) && !primes.is_empty() {
            let q = *primes.choose(random).expect("not empty");
            let whole = residue::space(q);
            let mut keep: Vec<u32> = (0..whole.cycles).collect();
            keep.shuffle(random);
            keep.truncate(space.cycles as usize);
            keep.sort_unstable();
            let source = format!("extended quadratic-residue code of length {}", q + 1);
            let source = if keep.len() < whole.cycles as usize {
                format!("{source}, shortened to the cycles {keep:?}")
            } else {
                source
            };
            let code = residue::shortened(&residue::extended(q), whole, &keep);
            return Some((source, code, None));
        }
        let symmetries = Symmetry::all(space);
        let drawn = symmetries[random.random_range(0..symmetries.len())];
        /// Beyond this even the list of words of a linear code is long.
        const MOST_DIMENSIONS: u32 = 20;
        let bits = space.bits();
        // Small codes leave room for many cosets, as long as syndromes can be tabulated.
        let least = bits.saturating_sub(SYNDROME_BITS).max(1);
        let most = if random.random_bool(0.5) || bits > 25 {
            MOST_DIMENSIONS
        } else {
            least + random.random_range(2..=6)
        };
        // Half of the draws follow the shapes that did best so far.
        let shape = match promising.choose(random) {
            Some(&(_, shape)) if random.random_bool(0.5) => shape,
            _ => Shape { symmetry: drawn, most },
        };
        let Shape { symmetry, most } = shape;
        let code = random_code(space, symmetry, self.distance, most, 60, random);
        let source = format!(
            "quasi-cyclic code of dimension {}, cycles shifted in blocks of {}{}",
            code.dimension(),
            symmetry.block,
            if symmetry.twisted { ", twisted" } else { "" }
        );
        (code.dimension() > 0).then_some((source, code, Some(shape)))
    }

    fn with_cosets(
        &self,
        code: Span,
        random: &mut ChaCha8Rng,
        halt: &(dyn Fn() -> bool + Sync),
    ) -> CosetUnion {
        /// Random starts of the clique search; in small spaces they cost next to nothing.
        const STARTS: [u64; 2] = [40, 8];
        let space = CycleSpace::of(self.dimension);
        let alone = CosetUnion { space, code: code.clone(), cosets: vec![0] };
        if space.bits() - code.dimension() > SYNDROME_BITS {
            return alone;
        }
        let Some(graph) = CosetGraph::new(space, code, self.distance, halt) else { return alone };
        if graph.vertices() == 0 {
            return alone;
        }
        let first: u64 = random.random();
        (0..STARTS[usize::from(space.bits() > 16)])
            .take_while(|&i| i == 0 || !halt())
            .map(|i| graph.grow(first.wrapping_add(i), halt))
            .max_by_key(|union| union.orbits().len())
            .unwrap_or(alone)
    }

    /// Arranges the candidates thoroughly; the best first.
    fn rearrange(
        &self,
        candidates: &mut [Candidate],
        until: Instant,
        start: Instant,
        control: Control,
    ) {
        let over = || Instant::now() >= until || control.is_cancelled();
        let arrangers: Vec<Arranger> =
            candidates.iter().map(|c| self.arranger(&c.union, c.union.orbits())).collect();
        let enough = self.most();
        let mut steps = 4_000;
        for round in 0.. {
            candidates.par_iter_mut().zip(&arrangers).for_each(|(candidate, arranger)| {
                if !over() {
                    let seed = self.seed.wrapping_add(1_000_003 * (round + 1));
                    let (worth, arrangement) = arranger.anneal(seed, steps, over);
                    if worth > candidate.worth {
                        (candidate.worth, candidate.arrangement) = (worth, arrangement);
                    }
                }
            });
            let best = candidates.iter().map(|c| c.worth as usize).max().unwrap_or(0);
            control.report(self.thousandths(start), 1000, best);
            if over() || candidates.is_empty() || best >= enough {
                break;
            }
            steps = (steps * 3 / 2).min(200_000);
        }
        candidates.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    }

    /// The codes of a candidate, exchanged where that gains some.
    fn finish(
        &self,
        screen: &Screen,
        candidate: &Candidate,
        end: Instant,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        let words = screen.words();
        let hex = |list: &[u64]| list.iter().map(|&w| words.hex(w)).collect();
        let mut construction = AlgebraicConstruction {
            source: candidate.source.clone(),
            basis: hex(candidate.union.code.rows()),
            cosets: hex(&candidate.union.cosets),
            arrangement: candidate.arrangement.clone(),
            exchanged: Vec::new(),
            limit: self.limit,
            seed: self.seed,
        };
        let codes = construction.codes(screen)?;
        if !self.exchange || self.dimension.bits() > super::polish::MAX_BITS {
            return Ok((codes, Construction::Algebraic(construction)));
        }
        let effort = Effort { seed: self.seed, rounds: 50, steps: 400_000, most: self.most() };
        let quiet = Control { report: None, ..control };
        let polished = polish(screen, codes.clone(), effort, quiet, || Instant::now() >= end);
        let exchanged: Vec<u64> =
            polished.into_iter().filter(|code| !codes.contains(code)).collect();
        construction.exchanged = hex(&exchanged);
        Ok((construction.codes(screen)?, Construction::Algebraic(construction)))
    }

    /// Local search alone, for distances that leave no room for a linear code.
    fn search_alone(
        &self,
        screen: &Screen,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        if self.dimension.bits() > super::polish::MAX_BITS {
            control.check()?;
            return Err(FamilyError::field("codes", "none was found"));
        }
        let search = Search { seed: self.seed, rounds: 3, steps: Search::STEPS };
        let codes = search.codes(screen, control)?;
        Ok((codes, search.construction(search.rounds)))
    }
}

/// Syndromes of up to this many bits are tabulated in a search that draws many codes.
const SYNDROME_BITS: u32 = if MAX_SYNDROME_BITS < 24 { MAX_SYNDROME_BITS } else { 24 };

/// Minimum distance of a union of cosets.
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
