//! The record of an algebraic family: enough to write its codes down again, and to prove them.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cosets::CosetUnion;
use super::ranked::Ranked;
use super::{Arrangement, CycleSpace, Span};
use crate::family::file::parse_word;
use crate::family::{FamilyError, Screen};
use crate::lattice::Dimension;

/// All that is needed to write down an algebraic family again.
///
/// The codes are one word of each orbit of the union of cosets, arranged on the tag, as far as the
/// rules admit them and no exchanged word excludes them; and the exchanged words. Where no word of
/// the union uses the central cell, it is white if the rules need it, else black. In order of the
/// smallest of the three turned words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlgebraicConstruction {
    /// Where the linear code comes from, in words.
    pub source: String,
    /// Basis of the linear code, in cycle coordinates, hexadecimal.
    pub basis: Vec<String>,
    /// One word of each coset, in cycle coordinates, hexadecimal.
    pub cosets: Vec<String>,
    /// Where its cycles go on the tag.
    pub arrangement: Arrangement,
    /// Words of the tag that local search put in, hexadecimal.
    pub exchanged: Vec<String>,
    /// Only so many codes are listed, the first in order; absent for all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<u64>,
    /// Seed of the search that found all this.
    pub seed: u64,
}

impl AlgebraicConstruction {
    /// Writes down the codes, in the order of the family.
    ///
    /// # Errors
    /// Where the record is not consistent, or its code words break the rules.
    pub fn codes(&self, screen: &Screen) -> Result<Vec<u64>, FamilyError> {
        let dimension = screen.words().dimension();
        let space = CycleSpace::of(dimension);
        if !self.arrangement.fits(space) {
            let problem = "does not arrange the cycles of such a tag";
            return Err(FamilyError::field("construction.arrangement", problem));
        }
        let union = CosetUnion {
            space,
            code: Span::of(self.words("basis", &self.basis, dimension)?),
            cosets: self.words("cosets", &self.cosets, dimension)?,
        };
        if union.code.dimension() > MOST_DIMENSIONS {
            return Err(FamilyError::field("construction.basis", "more than 26 dimensions"));
        }
        let exchanged = self.words("exchanged", &self.exchanged, dimension)?;
        let turned: Vec<u64> = exchanged.iter().flat_map(|&w| screen.words().turns(w)).collect();
        let mut codes = arranged(screen, &union, &self.arrangement);
        let apart = |code: &u64| {
            turned.par_iter().all(|other| (code ^ other).count_ones() >= screen.distance())
        };
        if !turned.is_empty() {
            codes.retain(apart);
        }
        codes.extend(exchanged);
        codes.sort_by_cached_key(|&code| screen.words().canonical(code));
        codes.truncate(self.limit.map_or(usize::MAX, |limit| limit as usize));
        Ok(codes)
    }

    /// The tag number `rank` of the whole linear code, whether or not it satisfies the rules; and
    /// how many there are. `None` when the construction is more than a linear code. The central
    /// cell, where the code does not use it, is black.
    pub fn by_rank(&self, dimension: Dimension, rank: u64) -> Option<(Option<u64>, u64)> {
        let space = CycleSpace::of(dimension);
        let words = |field, list| self.words(field, list, dimension).ok();
        let linear = self.exchanged.is_empty() && words("cosets", &self.cosets)? == [0];
        let code = Span::of(words("basis", &self.basis)?);
        if !linear || !self.arrangement.fits(space) {
            return None;
        }
        let ranked = Ranked::new(space, &code)?;
        let word = ranked.word(rank).map(|w| self.arrangement.apply(dimension, &[w])[0]);
        Some((word, ranked.len()))
    }

    /// The linear code and a word of each of its cosets as they are on the tag, and the central cell
    /// where no word uses it, else 0. `None` when the family is not of these alone.
    pub(in crate::family) fn on_the_tag(
        &self,
        dimension: Dimension,
    ) -> Option<(Span, Vec<u64>, u64)> {
        let space = CycleSpace::of(dimension);
        if !self.exchanged.is_empty() || !self.arrangement.fits(space) {
            return None;
        }
        let code = Span::of(self.words("basis", &self.basis, dimension).ok()?);
        let cosets = self.words("cosets", &self.cosets, dimension).ok()?;
        let union = CosetUnion { space, code, cosets };
        let centre = self.arrangement.bit_map(dimension).get(3 * space.cycles as usize).copied();
        let ignored = centre.filter(|_| has_free_centre(&union)).map_or(0, |bit| 1 << bit);
        let on_tag = |words: &[u64]| self.arrangement.apply(dimension, words);
        let zero = on_tag(&[0])[0];
        let code = Span::of(on_tag(union.code.rows()).into_iter().map(|row| row ^ zero));
        let cosets = on_tag(&union.cosets).into_iter().map(|word| word & !ignored).collect();
        Some((code, cosets, ignored))
    }

    /// A proof, from the structure of the code, that words of the family and their turns are
    /// `distance` apart; or the reason why it is none. Takes time in proportion to the number of
    /// codes, not to its square.
    ///
    /// The basis has to span a code that the turn leaves invariant and whose lightest word weighs
    /// `distance` or more (all are looked at), and each code, arranged back, has to lie in it. Then
    /// any two words are as far apart as some word of the linear code is heavy.
    ///
    /// # Errors
    /// The reason why it is no proof.
    pub fn prove(&self, screen: &Screen, codes: &[u64]) -> Result<(), String> {
        let dimension = screen.words().dimension();
        let space = CycleSpace::of(dimension);
        let words = |field, list| self.words(field, list, dimension).map_err(|e| e.to_string());
        let code = Span::of(words("basis", &self.basis)?);
        let cosets = words("cosets", &self.cosets)?;
        if !self.arrangement.fits(space) || code.dimension() > MOST_DIMENSIONS {
            return Err("the construction does not fit such tags".to_owned());
        }
        if !self.exchanged.is_empty() || cosets != [0] {
            return Err("not a linear code alone".to_owned());
        }
        if !code.rows().iter().all(|&row| code.contains(space.turn(row))) {
            return Err("the linear code changes when the tag turns".to_owned());
        }
        let light = |word: &u64| (1..screen.distance()).contains(&word.count_ones());
        if code.words().any(|word| light(&word)) {
            return Err("the linear code has too light a word".to_owned());
        }
        let union = CosetUnion { space, code, cosets };
        // The free centre is no part of the linear code: it only adds distance.
        let ignored = if has_free_centre(&union) { 1u64 << (space.bits() - 1) } else { 0 };
        let translation = self.arrangement.translation(space);
        let map = self.arrangement.bit_map(dimension);
        let back =
            |tag: u64| (0..).zip(&map).fold(0u64, |word, (i, &from)| word | (tag >> from & 1) << i);
        let belongs = |&tag: &u64| union.code.contains((back(tag) ^ translation) & !ignored);
        match codes.par_iter().position_first(|tag| !belongs(tag)) {
            Some(id) => Err(format!("code {id} is not in the linear code")),
            None => Ok(()),
        }
    }

    fn words(
        &self,
        field: &str,
        texts: &[String],
        dimension: Dimension,
    ) -> Result<Vec<u64>, FamilyError> {
        texts
            .iter()
            .map(|text| {
                parse_word(text).filter(|&word| word <= dimension.mask()).ok_or_else(|| {
                    let problem = format!("`{text}` is not a word of {} bits", dimension.bits());
                    FamilyError::field(format!("construction.{field}"), problem)
                })
            })
            .collect()
    }
}

/// Beyond this the list of words would not fit in memory.
const MOST_DIMENSIONS: u32 = 26;

/// The words of a union on the tag, one of each orbit, as far as the screen admits them.
fn arranged(screen: &Screen, union: &CosetUnion, arrangement: &Arrangement) -> Vec<u64> {
    let dimension = screen.words().dimension();
    let words = arrangement.apply(dimension, &union.orbits());
    if !has_free_centre(union) {
        return words.into_iter().filter(|&w| screen.admits(w)).collect();
    }
    let centre = 1u64 << arrangement.bit_map(dimension)[3 * union.space.cycles as usize];
    let choose =
        |word: u64| [word & !centre, word | centre].into_iter().find(|&w| screen.admits(w));
    words.into_par_iter().filter_map(choose).collect()
}

/// Whether the space has a central bit that no word of the union uses.
pub(in crate::family) fn has_free_centre(union: &CosetUnion) -> bool {
    let centre = 1u64 << (union.space.bits() - 1);
    union.space.centre
        && union.code.rows().iter().chain(&union.cosets).all(|word| word & centre == 0)
}
