//! The best of all methods within a time limit: the best construction on record, and sources of invariant
//! codes, arranged on the tag so that as many words as possible satisfy the rules, then repaired and
//! extended by local search.
//!
//! How far it gets depends on the time, so what it found is recorded in full
//! ([`AlgebraicConstruction`]) and gives the same codes again without any search. With an amount of work
//! instead of a time the same seed gives the same codes on every machine.

mod budget;
mod legs;

use std::collections::HashSet;
use std::time::Duration;

pub use budget::Budget;
use budget::{End, Spent, is_past};
pub use legs::Checkpoint;
use rand::seq::{IndexedRandom, SliceRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::joint::{AllWords, Joint};
use super::local::Search;
use super::polish::{Effort, polish};
use super::robust::with_the_most_codes;
use crate::algebra::arrange::Arranger;
use crate::algebra::coset_graph::{CosetGraph, MAX_SYNDROME_BITS};
use crate::algebra::quasicyclic::{Symmetry, random_code};
use crate::algebra::{bch, residue};
use deltille_core::family::algebra::CosetUnion;
use deltille_core::family::algebra::Ranked;
use deltille_core::family::algebra::{AlgebraicConstruction, Arrangement, CycleSpace, Span};
use deltille_core::family::algebra::{has_free_centre, stride_of};
use deltille_core::family::bounds_of_cells;
use deltille_core::family::parse_word;
use deltille_core::family::shipped_names;
use deltille_core::family::{
    Construction, Control, Family, FamilyError, Progress, Rules, Screen, TagWords,
};
use deltille_core::lattice::{Dimension, GridKind};

/// What to search and for how long.
///
/// ```
/// use deltille_search::best::{Best, Budget};
/// use deltille_core::family::Control;
/// use deltille_core::lattice::Dimension;
///
/// let search = Best::new(Dimension::from_bits(9)?, 5, Budget::Work(1)).seed(7);
/// let family = search.family("own9h5", None, Control::default())?;
/// assert!(!family.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Best {
    /// Dimension of the tags.
    pub dimension: Dimension,
    /// Least distance h between any two codes in any turn.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// How long to search.
    pub budget: Budget,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of codes at most.
    pub limit: Option<u64>,
    /// Whether local search may exchange codes at the end; without it the family is algebraic.
    pub exchange: bool,
}

impl Best {
    /// A search for all codes that satisfy the published rules of their distance, local search included.
    pub fn new(dimension: Dimension, distance: u32, budget: Budget) -> Self {
        let rules = Rules::published(distance);
        Self { dimension, distance, rules, budget, seed: 0, limit: None, exchange: true }
    }

    /// With other rules for single codes.
    #[must_use]
    pub fn rules(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// With other random choices.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With so many codes at most.
    #[must_use]
    pub fn limit(self, limit: Option<u64>) -> Self {
        Self { limit, ..self }
    }

    /// With local search at the end, or without; see [`Self::exchange`].
    #[must_use]
    pub fn exchange(self, exchange: bool) -> Self {
        Self { exchange, ..self }
    }
}

/// Words by which an arrangement is judged, at most: of very many a part tells which is good.
const JUDGED_WORDS: usize = 30_000;

/// Codes of which no more words than of so many dimensions are listed and put in order; of larger ones those are listed
/// that a stride meets.
const LISTED_DIMENSIONS: u32 = 24;

/// Codes of a construction with a stride, where nothing else is said.
const STRIDED_CODES: u64 = 1 << 20;

/// Batches of codes that are drawn in a step of work.
pub const DRAWS: u64 = 4;

/// What a search starts from.
#[derive(Clone, Debug)]
pub struct Start {
    /// Name of the family on record.
    pub family: String,
    /// Its codes, as far as they satisfy the rules.
    pub codes: Vec<u64>,
    construction: AlgebraicConstruction,
}

/// A union and how it is arranged.
#[derive(Clone, Debug)]
struct Candidate {
    source: String,
    union: CosetUnion,
    arrangement: Arrangement,
    /// Codes that are expected of it, those counted in part that local search may repair.
    worth: f64,
    /// Codes that it has as it is, at least.
    sure: usize,
    /// What local search made of it.
    codes: Vec<u64>,
}

/// The candidate that has the most codes as it is, of all that there were: what is told of a search is also written.
struct Surest {
    /// Codes that are known without it.
    known: usize,
    candidate: Option<Candidate>,
}

impl Surest {
    fn codes(&self) -> usize {
        self.candidate.as_ref().map_or(0, |candidate| candidate.sure).max(self.known)
    }

    fn keep(&mut self, candidates: &[Candidate]) {
        let best = candidates.iter().max_by_key(|candidate| candidate.sure);
        if let Some(best) = best.filter(|best| best.sure > self.codes()) {
            self.candidate = Some(best.clone());
        }
    }
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
    /// The best construction on record for such tags: of a shipped family with these bits and this distance or a
    /// greater one, as far as its codes satisfy the rules.
    pub fn start(&self) -> Option<Start> {
        let screen = self.screen();
        let on_record = |name: &str| {
            let family = Family::shipped(name).ok()?;
            let Construction::Algebraic(construction) = family.construction() else { return None };
            let fits = family.dimension() == self.dimension && family.distance() >= self.distance;
            let limit = self.limit.or(construction.stride.and(construction.limit));
            let construction = AlgebraicConstruction { limit, ..construction.clone() };
            // Exchanged words are listed whatever the rules.
            let admitted = |word: &String| parse_word(word).is_some_and(|w| screen.admits(w));
            let all_admitted = construction.exchanged.iter().all(admitted);
            let construction = match all_admitted && self.exchange {
                true => construction,
                false => AlgebraicConstruction { exchanged: Vec::new(), ..construction },
            };
            let codes = fits.then(|| construction.codes(&screen).ok()).flatten()?;
            Some(Start { family: name.to_owned(), codes, construction })
        };
        let all = shipped_names().into_iter().filter_map(on_record);
        all.filter(|start| !start.codes.is_empty()).max_by_key(|start| start.codes.len())
    }

    /// The family that a search starts from.
    ///
    /// # Errors
    /// Where the name speaks of other bits or another distance.
    pub fn family_of(&self, name: &str, start: &Start) -> Result<Family, FamilyError> {
        let construction = Construction::Algebraic(start.construction.clone());
        let (codes, rules) = (start.codes.clone(), self.rules.clone());
        Family::new(name, self.dimension, self.distance, codes, rules, construction)
    }

    /// The space that codes are drawn in: without the cells that none may use, which are its last cycles.
    fn space(&self) -> CycleSpace {
        let whole = CycleSpace::of(self.dimension);
        let free = self.rules.free.map_or(0, |free| free.mask(self.dimension).count_ones());
        let centre = whole.centre && free % 3 != 1;
        CycleSpace { cycles: whole.cycles - free / 3, centre }
    }

    fn screen(&self) -> Screen {
        Screen::new(TagWords::new(self.dimension), self.distance, &self.rules)
    }

    /// Searches once with the whole budget: codes at least as many as those it starts from.
    fn leg(
        &self,
        screen: &Screen,
        start: Option<&Start>,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        /// Share of the time in which codes on record are exchanged.
        const FOR_RECORD: f64 = 0.15;
        /// Share of what is left until which arrangements are judged by local search.
        const JOINT: f64 = 0.85;
        // Most of the gain comes from good sources and arrangements, at 25 bits and fewer also
        // from exchanging codes, where there is time for it.
        let small = self.exchange && self.dimension.bits() <= super::polish::MAX_BITS;
        let [sources, arrangements] = match (small, self.exchange_pays()) {
            (false, _) => [0.6, 1.0],
            (true, false) => [0.6, 0.9],
            (true, true) => [0.3, 0.45],
        };
        let spent =
            Spent::new(self.budget, if small && start.is_some() { FOR_RECORD } else { 0.0 });
        let most = self.most();
        let mut best: Option<(Vec<u64>, Construction)> = None;
        if let Some(Start { codes, construction, .. }) = start {
            control.tell(0, 1000, codes.len());
            let (codes, construction) = (codes.clone(), construction.clone());
            let end = spent.until(0.0);
            best = Some(self.exchanged(screen, construction, codes, end, &spent, control)?);
        }
        let known = best.as_ref().map_or(0, |b| b.0.len());
        let mut surest = Surest { known, candidate: None };
        let mut candidates = self.sources(&spent, sources, &mut surest, control);
        self.rearrange(&mut candidates, &spent, arrangements, &mut surest, control);
        if small && self.exchange_pays() {
            let record = start.and_then(|start| self.on_record(start));
            self.jointly(screen, &mut candidates, record, &spent, JOINT, &mut surest, control);
        }

        let mut is_first = true;
        for mut candidate in candidates {
            let end = spent.until(1.0);
            let over = match self.budget {
                Budget::Time(..) => is_past(end),
                Budget::Work(_) => !is_first,
            };
            let over = over || !small || control.is_cancelled();
            // What may be large is not written down only to be compared when time is short.
            let over = over && (!is_first || control.is_cancelled());
            if best.as_ref().is_some_and(|(codes, _)| over || codes.len() >= most) {
                break;
            }
            is_first = false;
            let end = end.map(|end| end.after(0.7));
            let found = std::mem::take(&mut candidate.codes);
            let construction = self.construction(screen, candidate);
            let (codes, construction) = with_exchanged(screen, construction, &found)?;
            let found = self.exchanged(screen, construction, codes, end, &spent, control)?;
            if best.as_ref().is_none_or(|(codes, _)| found.0.len() > codes.len()) {
                best = Some(found);
            }
            control.tell(spent.thousandths(), 1000, best.as_ref().map_or(0, |b| b.0.len()));
        }
        // What was judged to be worth more may have ended with less.
        let least = best.as_ref().map_or(0, |b| b.0.len());
        if let Some(mut surest) = surest.candidate.filter(|surest| surest.sure > least) {
            let codes = std::mem::take(&mut surest.codes);
            let construction = self.construction(screen, surest);
            let (codes, construction) = with_exchanged(screen, construction, &codes)?;
            if codes.len() > least {
                best = Some((codes, Construction::Algebraic(construction)));
            }
        }
        match best {
            Some(found) if !found.0.is_empty() => Ok(found),
            _ => self.search_alone(screen, control),
        }
    }

    /// Whether there is time to gain more by exchanging codes than better sources gain: in a few
    /// seconds not even the conflicts are counted.
    fn exchange_pays(&self) -> bool {
        const LEAST: Duration = Duration::from_secs(20);
        let is_long = match self.budget {
            Budget::Time(time, _) => time >= LEAST,
            Budget::Work(_) => true,
        };
        self.exchange && is_long
    }

    /// No family is larger; once there are so many codes, the search is over.
    fn most(&self) -> usize {
        let cells = self.space().bits();
        let bounds = bounds_of_cells(GridKind::Deltille, cells, self.distance);
        let least = bounds.linear_programming.min(bounds.sphere_packing);
        usize::try_from(least).unwrap_or(usize::MAX)
    }

    /// Draws unions of cosets until a share of the time is over; the most promising first.
    fn sources(
        &self,
        spent: &Spent,
        share: f64,
        surest: &mut Surest,
        control: Control,
    ) -> Vec<Candidate> {
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
        let until = spent.until(share);
        let halt = || is_past(until) || control.is_cancelled();
        let steps = spent.rounds(u64::MAX / BATCH / DRAWS);
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
        let (count, orbits) = union.some_orbits(JUDGED_WORDS);
        let share = WORTH_A_TRY[usize::from(most_orbits > MANY_ORBITS)];
        if count == 0 || (count as f64) < share * most_orbits as f64 {
            return Draw { orbits: count, shape, candidate: None };
        }
        let arranger = self.arranger(&union, orbits);
        let (worth, arrangement) = arranger.anneal(random.random(), STEPS, halt);
        let (sure, codes) = (arranger.sure(&arrangement), Vec::new());
        let candidate = Some(Candidate { source, union, arrangement, worth, sure, codes });
        Draw { orbits: count, shape, candidate }
    }

    fn arranger_of(&self, union: &CosetUnion) -> Arranger {
        self.arranger(union, union.some_orbits(JUDGED_WORDS).1)
    }

    /// What arranges a union, judged by some of its orbits.
    fn arranger(&self, union: &CosetUnion, orbits: Vec<u64>) -> Arranger {
        /// A changed cell makes up to three pairs differ, and about this share of such words can
        /// be had without conflict.
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
            && self.dimension.bits() <= super::polish::MAX_BITS
            && min_distance(union) > self.distance
        {
            arranger.with_nearly(REPAIR.0, REPAIR.1)
        } else {
            arranger
        }
    }

    /// The extended BCH code of most dimensions that has the distance and cells in the middle for no code where these are
    /// free; with hidden cells, whose light words have to be listed, of no more than can be. `None` of other tags, and where
    /// no word of it is moved by a turn.
    fn bch_code(&self) -> Option<(String, Span)> {
        if self.dimension.bits() != bch::space().bits() {
            return None;
        }
        let most = if self.rules.robust.is_empty() { u32::MAX } else { LISTED_DIMENSIONS };
        let least = self.distance.saturating_sub(1) / 2;
        let free = self.rules.free.map_or(0, |_| bch::space().mask() ^ self.space().mask());
        let codes = (least..).map(|errors| (errors, bch::extended(errors).vanishing_on(free)));
        let (errors, code) = codes.into_iter().find(|(_, code)| code.dimension() <= most)?;
        let is_moved = code.rows().iter().any(|&row| bch::space().turn(row) != row);
        let source = format!(
            "extended BCH code of length 64, distance {}{}",
            2 * errors + 2,
            if free == 0 { "" } else { ", shortened by the position 0" }
        );
        is_moved.then_some((source, code))
    }

    /// A linear code: an extended BCH code, a shortened quadratic-residue code or a random quasi-cyclic one, by turns.
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

    /// Arranges the candidates thoroughly; the best first.
    fn rearrange(
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

    /// What is on record, as a candidate.
    fn on_record(&self, start: &Start) -> Option<Candidate> {
        let construction = &start.construction;
        let union = construction.union(self.dimension).ok()?;
        let (source, arrangement) = (construction.source.clone(), construction.arrangement.clone());
        let (codes, sure) = (start.codes.clone(), start.codes.len());
        Some(Candidate { source, union, arrangement, worth: 0.0, sure, codes })
    }

    /// Arranges the best candidates, and what is on record, for what local search makes of them; the best first.
    #[expect(clippy::too_many_arguments)]
    fn jointly(
        &self,
        screen: &Screen,
        candidates: &mut Vec<Candidate>,
        record: Option<Candidate>,
        spent: &Spent,
        share: f64,
        surest: &mut Surest,
        control: Control,
    ) {
        /// Candidates that are worth it.
        const KEPT: usize = 3;
        /// Steps of the first round; each has half as many more.
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

    /// The record of a candidate.
    fn construction(&self, screen: &Screen, candidate: Candidate) -> AlgebraicConstruction {
        let words = screen.words();
        let hex = |list: &[u64]| list.iter().map(|&w| words.hex(w)).collect();
        let CosetUnion { space, code, cosets } = &candidate.union;
        let is_large = code.dimension() > LISTED_DIMENSIONS;
        let ranked = is_large.then(|| Ranked::new(*space, code)).flatten();
        let stride = ranked.map(|ranked| stride_of(ranked.len()));
        AlgebraicConstruction {
            source: candidate.source,
            basis: hex(code.rows()),
            cosets: hex(cosets),
            arrangement: candidate.arrangement,
            exchanged: Vec::new(),
            limit: self.limit.or(stride.map(|_| STRIDED_CODES)),
            stride,
            seed: self.seed,
        }
    }

    /// The codes of a construction, some of them exchanged where that gains more.
    fn exchanged(
        &self,
        screen: &Screen,
        construction: AlgebraicConstruction,
        codes: Vec<u64>,
        end: Option<End>,
        spent: &Spent,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        if !self.exchange {
            return Ok((codes, Construction::Algebraic(construction)));
        }
        let halt = || is_past(end) || control.is_cancelled();
        let (codes, construction) = with_the_most_codes(screen, construction, codes, halt)?;
        if self.dimension.bits() > super::polish::MAX_BITS {
            return Ok((codes, Construction::Algebraic(construction)));
        }
        let rounds = spent.rounds(50) as u32;
        let effort = Effort { seed: self.seed, rounds, steps: 400_000, most: self.most() };
        let known = codes.len();
        let report = |progress: Progress| {
            spent.step();
            control.tell(spent.thousandths(), 1000, progress.codes.max(known));
        };
        let within = control.report(&report);
        let polished = polish(screen, codes.clone(), effort, within, || is_past(end));
        if polished.len() <= codes.len() {
            return Ok((codes, Construction::Algebraic(construction)));
        }
        let construction = AlgebraicConstruction { seed: self.seed, ..construction };
        let (codes, construction) = with_exchanged(screen, construction, &polished)?;
        Ok((codes, Construction::Algebraic(construction)))
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
        let search = Search::new(self.seed, 3);
        let codes = search.codes(screen, control)?;
        Ok((codes, search.construction(search.rounds)))
    }
}

/// The record of a construction of which so many words were exchanged that it has these codes, or more; what it has
/// where there are none.
fn with_exchanged(
    screen: &Screen,
    construction: AlgebraicConstruction,
    codes: &[u64],
) -> Result<(Vec<u64>, AlgebraicConstruction), FamilyError> {
    let words = screen.words();
    if codes.is_empty() {
        return Ok((construction.codes(screen)?, construction));
    }
    let plain = AlgebraicConstruction { exchanged: Vec::new(), ..construction };
    let own: HashSet<u64> = plain.codes(screen)?.iter().map(|&w| words.canonical(w)).collect();
    let exchanged = codes.iter().filter(|&&code| !own.contains(&words.canonical(code)));
    let exchanged = exchanged.map(|&word| words.hex(word)).collect();
    let construction = AlgebraicConstruction { exchanged, ..plain };
    let found = construction.codes(screen)?;
    if found.len() >= codes.len() {
        return Ok((found, construction));
    }
    // With hidden cells, words that are taken in order can be others.
    let listed = codes.iter().map(|&word| words.hex(word)).collect();
    let construction = AlgebraicConstruction { exchanged: listed, ..construction };
    Ok((construction.codes(screen)?, construction))
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
