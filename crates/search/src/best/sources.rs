//! Codes that are invariant under a rotation of the tag, constructed or drawn at random, and unions of their cosets.

use rand::seq::{IndexedRandom, SliceRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::arranged::{Candidate, JUDGED_WORDS, Surest};
use super::budget::{Spent, is_past};
use super::request::{Best, LISTED_DIMENSIONS};
use crate::algebra::coset_graph::{CosetGraph, MAX_SYNDROME_BITS};
use crate::algebra::quasicyclic::{Symmetry, random_code};
use crate::algebra::{bch, residue};
use deltille_core::family::Control;
use deltille_core::family::algebra::{CosetUnion, Span};

/// Batches of codes drawn per step of work.
pub const DRAWS: u64 = 4;

/// Largest number of syndrome bits that are tabulated in a search that draws many codes.
const SYNDROME_BITS: u32 = if MAX_SYNDROME_BITS < 24 { MAX_SYNDROME_BITS } else { 24 };

/// Parameters for drawing a random linear code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Shape {
    symmetry: Symmetry,
    /// Maximum number of dimensions.
    most: u32,
}

/// One draw: its number of orbits, its parameters, and an arrangement if it is worth one.
struct Draw {
    orbits: usize,
    shape: Option<Shape>,
    candidate: Option<Candidate>,
}

impl Best {
    /// Draws unions of cosets until a fraction of the time has elapsed; returns the most promising
    /// first.
    pub(super) fn sources(
        &self,
        spent: &Spent,
        share: f64,
        surest: &mut Surest,
        control: Control,
    ) -> Vec<Candidate> {
        /// Draws between two checks of the clock.
        const BATCH: u64 = 16;
        /// Number of candidates kept for a thorough arrangement.
        const KEPT: usize = 6;
        /// Number of shapes of random codes that are drawn again.
        const PROMISING: usize = 4;
        let mut kept: Vec<Candidate> = Vec::new();
        let mut promising: Vec<(usize, Shape)> = Vec::new();
        let mut most_orbits = 0;
        let enough = self.most();
        let until = spent.until(share);
        let halt = || is_past(until) || control.is_cancelled();
        let steps = spent.rounds(u64::MAX / BATCH / DRAWS);
        let mut draw = 0;
        loop {
            let most = most_orbits;
            let batch: Vec<Draw> = (draw..draw + BATCH)
                .into_par_iter()
                // There are always some draws, however short the time is.
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
            surest.keep(&kept);
            kept.sort_by(|a, b| b.worth.total_cmp(&a.worth));
            kept.truncate(KEPT);
            promising.sort_by_key(|&(best, shape)| (std::cmp::Reverse(best), shape));
            promising.truncate(PROMISING);
            if draw.is_multiple_of(BATCH * DRAWS) {
                spent.step();
            }
            control.tell(spent.thousandths(), 1000, surest.codes());
            if halt() || surest.codes() >= enough || draw >= steps * BATCH * DRAWS {
                return kept;
            }
        }
    }

    /// Makes one draw, with a quick arrangement if its number of orbits is close to the largest so
    /// far.
    fn candidate(
        &self,
        seed: u64,
        draw: u64,
        most_orbits: usize,
        promising: &[(usize, Shape)],
        halt: &(dyn Fn() -> bool + Sync),
    ) -> Draw {
        /// Fraction of the most orbits so far above which an arrangement is tried. Small codes differ more in the
        /// fraction of their words that pass, and are arranged quickly.
        const TRY_THRESHOLD: [f64; 2] = [0.75, 0.93];
        const MANY_ORBITS: usize = 1_000;
        /// Number of steps of the quick arrangement.
        const STEPS: u32 = 3_000;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let Some((source, code, shape)) = self.linear_code(draw, promising, &mut random) else {
            return Draw { orbits: 0, shape: None, candidate: None };
        };
        let union = self.with_cosets(code, &mut random, halt);
        let (count, orbits) = union.some_orbits(JUDGED_WORDS);
        let share = TRY_THRESHOLD[usize::from(most_orbits > MANY_ORBITS)];
        if count == 0 || (count as f64) < share * most_orbits as f64 {
            return Draw { orbits: count, shape, candidate: None };
        }
        let arranger = self.arranger(&union, orbits);
        let (worth, arrangement) = arranger.anneal(random.random(), STEPS, halt);
        let (sure, codes) = (arranger.sure(&arrangement), Vec::new());
        let candidate = Some(Candidate { source, union, arrangement, worth, sure, codes });
        Draw { orbits: count, shape, candidate }
    }

    /// Returns the extended BCH code with the most dimensions that has the distance and leaves free
    /// central cells unused.
    /// With hidden cells, its light words must be few enough to be listed. Returns `None` for other tags, or if a
    /// rotation moves none of its words.
    fn bch_code(&self) -> Option<(String, Span)> {
        if self.dimension.bits() != bch::space().bits() {
            return None;
        }
        let most = if self.rules.robust.is_empty() { u32::MAX } else { LISTED_DIMENSIONS };
        let least = self.distance.saturating_sub(1) / 2;
        let free = self.rules.free.map_or(0, |_| bch::space().mask() ^ self.space().mask());
        let codes = (least..).map(|errors| (errors, bch::extended(errors).vanishing_on(free)));
        let (errors, code) = codes.into_iter().find(|(_, code)| code.dimension() <= most)?;
        let is_moved = code.rows().iter().any(|&row| bch::space().rotate(row) != row);
        let source = format!(
            "extended BCH code of length 64, distance {}{}",
            2 * errors + 2,
            if free == 0 { "" } else { ", shortened by the position 0" }
        );
        is_moved.then_some((source, code))
    }

    /// Returns a linear code: alternately an extended BCH code, a shortened quadratic-residue code, and a random
    /// quasi-cyclic one.
    fn linear_code(
        &self,
        draw: u64,
        promising: &[(usize, Shape)],
        random: &mut ChaCha8Rng,
    ) -> Option<(String, Span, Option<Shape>)> {
        let space = self.space();
        let primes: Vec<u32> = residue::PRIMES
            .into_iter()
            .filter(|&q| residue::min_distance(q) >= self.distance)
            .filter(|&q| residue::space(q).cycles >= space.cycles)
            .collect();
        if let Some((source, code)) = self.bch_code() {
            return Some((source, code, None));
        }
        // Checking a random code of 49 bits takes a long time, and the code is far smaller.
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
        /// Largest number of dimensions: beyond it, even the list of words of a linear code is long.
        const MAX_DIMENSIONS: u32 = 20;
        let bits = space.bits();
        // Small codes leave room for many cosets, as long as syndromes can be tabulated.
        let least = bits.saturating_sub(SYNDROME_BITS).max(1);
        let most = if random.random_bool(0.5) || bits > 25 {
            MAX_DIMENSIONS
        } else {
            least + random.random_range(2..=6)
        };
        // Half of the draws use the best shapes so far.
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
        /// Numbers of random starts of the clique search; in small spaces they are almost free.
        const STARTS: [u64; 2] = [40, 8];
        let space = self.space();
        let alone = CosetUnion { space, code: code.clone(), cosets: vec![0] };
        if space.bits() - code.dimension() > SYNDROME_BITS || code.dimension() > LISTED_DIMENSIONS {
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
}
