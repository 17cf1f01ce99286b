//! One search with the whole budget: from sources to a complete construction, with exchanged codes if that gains
//! more.

use std::collections::HashSet;

use super::arranged::{Candidate, Surest};
use super::budget::{Budget, End, Spent, is_past};
use super::request::{Best, LISTED_DIMENSIONS, Start};
use crate::local::Search;
use crate::polish::{Effort, polish};
use crate::robust::with_the_most_codes;
use deltille_core::family::algebra::{AlgebraicConstruction, CosetUnion, Ranked, stride_of};
use deltille_core::family::{Construction, Control, FamilyError, Progress, Screen};

/// Default number of codes of a construction with a stride.
const STRIDED_CODES: u64 = 1 << 20;

impl Best {
    /// Searches once with the whole budget; finds at least as many codes as it starts from.
    pub(super) fn leg(
        &self,
        screen: &Screen,
        start: Option<&Start>,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        /// Fraction of the time for exchanging codes on record.
        const FOR_RECORD: f64 = 0.15;
        /// Fraction of the remaining time after which local search no longer judges arrangements.
        const JOINT: f64 = 0.85;
        // Good sources and arrangements give most of the gain. Up to 25 bits, exchanging codes helps too if there is
        // time.
        let small = self.exchange && self.dimension.bits() <= crate::polish::MAX_BITS;
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
            // Listing a large construction only for comparison is skipped when time is short.
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
        // A candidate that was judged better may have ended with fewer codes.
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

    /// Returns the record of a candidate.
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

    /// Returns the codes of a construction, some of them exchanged if that gains more.
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
        if self.dimension.bits() > crate::polish::MAX_BITS {
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

    /// Runs local search alone, for distances that leave no room for a linear code.
    fn search_alone(
        &self,
        screen: &Screen,
        control: Control,
    ) -> Result<(Vec<u64>, Construction), FamilyError> {
        if self.dimension.bits() > crate::polish::MAX_BITS {
            control.check()?;
            return Err(FamilyError::field("codes", "no code was found"));
        }
        let search = Search::new(self.seed, 3);
        let codes = search.codes(screen, control)?;
        Ok((codes, search.construction(search.rounds)))
    }
}

/// Returns the record of a construction with enough exchanged words to give these codes, or more; unchanged if there
/// are no codes.
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
    // With hidden cells, taking words in order may give other codes.
    let listed = codes.iter().map(|&word| words.hex(word)).collect();
    let construction = AlgebraicConstruction { exchanged: listed, ..construction };
    Ok((construction.codes(screen)?, construction))
}
