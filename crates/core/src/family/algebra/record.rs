//! The record of an algebraic family: enough to list its codes again and to prove their distance.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cosets::CosetUnion;
use super::ranked::Ranked;
use super::weights::weights;
use super::{Arrangement, CycleSpace, Placing, Span};
use crate::family::hex::parse_word;
use crate::family::{FamilyError, Screen};
use crate::lattice::Dimension;

/// The construction of an algebraic family, as stored in its file.
///
/// The union of cosets is arranged on the tag. Each orbit gives one code if the rules admit it and no exchanged word
/// is too close; the exchanged words are codes too. If cells may be hidden, words of the union may be too close to
/// each other. They are then taken in order, each only if it is far enough from those before it. If no word of the
/// union uses the central cell, it is black, or white if only that satisfies the rules. Codes are sorted by the
/// smallest of the three rotated words.
///
/// A linear code may have far more words than can be listed. With a [`stride`](Self::stride), the
/// codes are the tags 0, stride, 2·stride, … ([`Self::by_rank`]) that the rules admit, in this
/// order. So they are distributed over the whole code. The first tags in order would all start with
/// black cells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlgebraicConstruction {
    /// Description of the linear code's origin, for readers.
    pub source: String,
    /// Basis of the linear code, in cycle coordinates, hexadecimal.
    pub basis: Vec<String>,
    /// One word of each coset, in cycle coordinates, hexadecimal.
    pub cosets: Vec<String>,
    /// Placement of the code's cycles on the tag.
    pub arrangement: Arrangement,
    /// Words of the tag that local search added in exchange for others, hexadecimal.
    pub exchanged: Vec<String>,
    /// Number of listed codes, the first in order; absent if all are listed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<u64>,
    /// Step between the numbers of listed tags of a linear code, modulo the number of tags; the two
    /// are coprime. A `limit` is then required. For each code that the limit allows, at most 64
    /// numbers are tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stride: Option<u64>,
    /// Seed of the search that found the construction.
    pub seed: u64,
}

impl AlgebraicConstruction {
    /// Lists the codes as words of the tag, in the order of the family. `screen` contains dimension, distance and
    /// rules.
    ///
    /// # Errors
    /// Returns an error if a word does not parse or is too long for the dimension, the arrangement does not fit it,
    /// or the basis has more than 26 dimensions.
    pub fn codes(&self, screen: &Screen) -> Result<Vec<u64>, FamilyError> {
        let dimension = screen.words().dimension();
        let space = CycleSpace::of(dimension);
        if !self.arrangement.fits(space) {
            let problem = "it does not fit the cycles of tags of this dimension";
            return Err(FamilyError::field("construction.arrangement", problem));
        }
        if let Some(stride) = self.stride {
            return self.strided(screen, stride);
        }
        let union = self.union(dimension)?;
        let exchanged = self.words("exchanged", &self.exchanged, dimension)?;
        let turned: Vec<u64> =
            exchanged.iter().flat_map(|&w| screen.words().rotations(w)).collect();
        let mut codes = arranged(screen, &union, &self.arrangement);
        let order = |codes: &mut Vec<u64>| {
            codes.sort_by_cached_key(|&code| screen.words().canonical(code));
        };
        let limit = self.limit.map_or(usize::MAX, |limit| limit as usize);
        if screen.is_robust() && !(exchanged.is_empty() && self.is_apart(screen, &union)) {
            order(&mut codes);
            codes = taken_in_order(screen, exchanged.into_iter().chain(codes), limit);
        } else if !turned.is_empty() {
            codes.retain(|&code| screen.is_apart_from(code, &turned));
            codes.extend(exchanged);
        }
        order(&mut codes);
        codes.truncate(limit);
        Ok(codes)
    }

    /// Lists the codes of a construction with a stride.
    fn strided(&self, screen: &Screen, stride: u64) -> Result<Vec<u64>, FamilyError> {
        /// Maximum number of codes: with 64 bits, they take one gigabyte of memory and a file of
        /// two gigabytes.
        const MAX_CODES: u64 = 1 << 27;
        /// Number of tags tried for each code.
        const TRIED: u64 = 64;
        let wrong = |field, problem: &str| {
            FamilyError::field(format!("construction.{field}"), problem.to_owned())
        };
        let dimension = screen.words().dimension();
        let ranked = self.ranked(dimension).ok_or_else(|| {
            wrong(
                "stride",
                "a stride needs a single linear code that is invariant under rotation, without cosets or exchanged words",
            )
        })?;
        if screen.is_robust() && !self.is_apart(screen, &self.union(dimension)?) {
            return Err(wrong(
                "stride",
                "with cells hidden, the distance between words of the linear code is too small",
            ));
        }
        let count = ranked.len();
        if count == 0 || greatest_common_divisor(stride, count) != 1 {
            let problem = format!("{stride} and the number of tags, {count}, are not coprime");
            return Err(wrong("stride", &problem));
        }
        let limit = self.limit.filter(|&limit| limit <= MAX_CODES);
        let limit =
            limit.ok_or_else(|| wrong("limit", "a stride needs a limit of at most 2^27 codes"))?;
        let place = Placing::new(&self.arrangement, dimension);
        let centre = self.free_centre(dimension)?;
        let numbers = (0..count.min(limit.saturating_mul(TRIED))).scan(0u64, |next, _| {
            let number = *next;
            *next = ((u128::from(number) + u128::from(stride)) % u128::from(count)) as u64;
            Some(number)
        });
        let words = numbers.filter_map(|number| ranked.word(number));
        let codes = words.filter_map(|word| choice(screen, place.on_tag(word), centre));
        Ok(codes.take(limit as usize).collect())
    }

    /// Returns the words of the union on the tag that the screen admits individually, and the
    /// exchanged words.
    ///
    /// # Errors
    /// Returns an error if the record is invalid, see [`Self::codes`].
    pub fn words_of_the_union(&self, screen: &Screen) -> Result<Vec<u64>, FamilyError> {
        let dimension = screen.words().dimension();
        let mut words = arranged(screen, &self.union(dimension)?, &self.arrangement);
        words.extend(self.words("exchanged", &self.exchanged, dimension)?);
        words.sort_by_cached_key(|&word| screen.words().canonical(word));
        words.dedup_by_key(|word| screen.words().canonical(*word));
        Ok(words)
    }

    /// Returns whether all pairs of words of the union, arranged on the tag, are far enough apart.
    fn is_apart(&self, screen: &Screen, union: &CosetUnion) -> bool {
        let dimension = screen.words().dimension();
        let zero = self.arrangement.apply(dimension, &[0])[0];
        let near = union.differences_lighter_than(screen.reach());
        let near = self.arrangement.apply(dimension, &near);
        near.into_iter().all(|word| screen.is_apart(word ^ zero))
    }

    /// Returns the union of cosets, in cycle coordinates.
    ///
    /// # Errors
    /// Returns an error if a word does not parse or is too long for the dimension, or the basis has more than 26
    /// dimensions.
    pub fn union(&self, dimension: Dimension) -> Result<CosetUnion, FamilyError> {
        let code = Span::of(self.words("basis", &self.basis, dimension)?);
        if code.dimension() > MAX_DIMENSIONS {
            return Err(FamilyError::field(
                "construction.basis",
                "the basis has more than 26 dimensions",
            ));
        }
        let cosets = self.words("cosets", &self.cosets, dimension)?;
        Ok(CosetUnion { space: CycleSpace::of(dimension), code, cosets })
    }

    /// Returns tag number `rank` of the whole linear code as a word of the tag, whether or not it satisfies the
    /// rules, and the number of tags. The tag is `None` beyond that number. Returns `None` if the construction is
    /// more than a linear code, or its record is inconsistent. A central cell that the code does not use is black,
    /// unless the arrangement inverts it.
    pub fn by_rank(&self, dimension: Dimension, rank: u64) -> Option<(Option<u64>, u64)> {
        let ranked = self.ranked(dimension)?;
        let word = ranked.word(rank).map(|w| self.arrangement.apply(dimension, &[w])[0]);
        Some((word, ranked.len()))
    }

    /// Numbers the tags of a single linear code; `None` for any other or inconsistent record.
    fn ranked(&self, dimension: Dimension) -> Option<Ranked> {
        let space = CycleSpace::of(dimension);
        let words = |field, list| self.words(field, list, dimension).ok();
        let linear = self.exchanged.is_empty() && words("cosets", &self.cosets)? == [0];
        let code = Span::of(words("basis", &self.basis)?);
        if !linear || !self.arrangement.fits(space) {
            return None;
        }
        Ranked::new(space, &code)
    }

    /// Returns the central cell of the tag if no word uses it; else 0.
    fn free_centre(&self, dimension: Dimension) -> Result<u64, FamilyError> {
        let (space, code) =
            (CycleSpace::of(dimension), self.words("basis", &self.basis, dimension)?);
        let cosets = self.words("cosets", &self.cosets, dimension)?;
        let union = CosetUnion { space, code: Span::of(code), cosets };
        Ok(centre_of(&union, &self.arrangement, dimension))
    }

    /// Returns the linear code and one word of each of its cosets, as words of the tag. The last
    /// value is a mask of the central cell if no word uses it, else 0. Returns `None` if the family
    /// has exchanged words, or the record is inconsistent.
    pub fn on_the_tag(&self, dimension: Dimension) -> Option<(Span, Vec<u64>, u64)> {
        let space = CycleSpace::of(dimension);
        if !self.exchanged.is_empty() || !self.arrangement.fits(space) {
            return None;
        }
        let code = Span::of(self.words("basis", &self.basis, dimension).ok()?);
        let cosets = self.words("cosets", &self.cosets, dimension).ok()?;
        let union = CosetUnion { space, code, cosets };
        let ignored = centre_of(&union, &self.arrangement, dimension);
        let on_tag = |words: &[u64]| self.arrangement.apply(dimension, words);
        let zero = on_tag(&[0])[0];
        let code = Span::of(on_tag(union.code.rows()).into_iter().map(|row| row ^ zero));
        let cosets = on_tag(&union.cosets).into_iter().map(|word| word & !ignored).collect();
        Some((code, cosets, ignored))
    }

    /// Proves from the structure of the code that the words of the family and their rotations are `screen.distance()`
    /// apart. The time is proportional to the number of codes, not to its square.
    ///
    /// The basis must span a code that is invariant under the rotation and whose lightest nonzero word weighs at
    /// least the distance. (All words of the code, or all of the dual code, are weighed.) Each of `codes`, mapped
    /// back to cycle coordinates, must lie in it. Then the sum of any two words is a word of the linear code, and
    /// their distance is its weight.
    ///
    /// # Errors
    /// Returns why the proof fails; the distance may be correct nevertheless.
    pub fn prove(&self, screen: &Screen, codes: &[u64]) -> Result<(), String> {
        let dimension = screen.words().dimension();
        let space = CycleSpace::of(dimension);
        let words = |field, list| self.words(field, list, dimension).map_err(|e| e.to_string());
        let code = Span::of(words("basis", &self.basis)?);
        let cosets = words("cosets", &self.cosets)?;
        if !self.arrangement.fits(space) {
            return Err("the construction does not fit tags of this dimension".to_owned());
        }
        if !self.exchanged.is_empty() || cosets != [0] {
            return Err("the construction is more than a linear code".to_owned());
        }
        if !code.rows().iter().all(|&row| code.contains(space.rotate(row))) {
            return Err("the linear code is not invariant under rotation of the tag".to_owned());
        }
        let weights = weights(&code, space.bits());
        let weights = weights
            .ok_or("the linear code and its dual have too many words to compute all weights")?;
        if (1..screen.distance()).any(|weight| weights[weight as usize] > 0) {
            return Err(
                "the linear code has a word whose weight is less than the distance".to_owned()
            );
        }
        if screen.is_robust() && code.dimension() > MAX_DIMENSIONS {
            return Err("the linear code has too many words to check with hidden cells".to_owned());
        }
        let union = CosetUnion { space, code, cosets };
        if screen.is_robust() && !self.is_apart(screen, &union) {
            return Err(
                "with cells hidden, the distance between words of the linear code is too small"
                    .to_owned(),
            );
        }
        // A free centre is not part of the linear code: it can only add distance.
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

/// Largest number of dimensions; beyond it, the list of words would not fit in memory.
const MAX_DIMENSIONS: u32 = 26;

/// Returns the words that are far enough from all those taken before, up to `limit`.
fn taken_in_order(screen: &Screen, words: impl Iterator<Item = u64>, limit: usize) -> Vec<u64> {
    let (mut taken, mut turned) = (Vec::new(), Vec::new());
    for word in words {
        if taken.len() < limit && screen.is_apart_from(word, &turned) {
            taken.push(word);
            turned.extend(screen.words().rotations(word));
        }
    }
    taken
}

/// Returns the words of a union on the tag that the screen admits, one of each orbit.
pub fn arranged(screen: &Screen, union: &CosetUnion, arrangement: &Arrangement) -> Vec<u64> {
    let dimension = screen.words().dimension();
    let words = arrangement.apply(dimension, &union.orbits());
    if !has_free_centre(union) {
        return words.into_iter().filter(|&w| screen.admits(w)).collect();
    }
    let centre = centre_of(union, arrangement, dimension);
    words.into_par_iter().filter_map(|word| choice(screen, word, centre)).collect()
}

/// Returns the code of a word that the screen admits. A free central cell is black, or white if
/// only that satisfies the
/// rules.
fn choice(screen: &Screen, word: u64, free_centre: u64) -> Option<u64> {
    match free_centre {
        0 => screen.admits(word).then_some(word),
        centre => [word & !centre, word | centre].into_iter().find(|&word| screen.admits(word)),
    }
}

/// Returns the central cell of the tag if no word of a union uses it; else 0.
fn centre_of(union: &CosetUnion, arrangement: &Arrangement, dimension: Dimension) -> u64 {
    match has_free_centre(union) {
        true => 1 << arrangement.bit_map(dimension)[3 * union.space.cycles as usize],
        false => 0,
    }
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Returns a stride that distributes any number of tags evenly: about the golden section of their number.
pub fn stride_of(tags: u64) -> u64 {
    let golden = (tags as f64 * 0.618_033_988_749_895) as u64;
    let coprime = |stride: &u64| greatest_common_divisor(*stride, tags) == 1;
    (golden.max(1)..).find(coprime).unwrap_or(1)
}

/// Returns whether the space has a central bit that no word of the union uses.
pub fn has_free_centre(union: &CosetUnion) -> bool {
    let centre = 1u64 << (union.space.bits() - 1);
    union.space.centre
        && union.code.rows().iter().chain(&union.cosets).all(|word| word & centre == 0)
}
