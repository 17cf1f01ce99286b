//! The family file (`docs/formats.md`, “Family”): reading with checks of every field, writing, fingerprint.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::fingerprint::fingerprint;
use crate::Name;
use crate::family::algebra::AlgebraicConstruction;
use crate::family::hex::parse_word;
use crate::family::{
    Beginning, Family, FamilyError, Rules, SCHEMA, TagWords, false_positive_rates,
};
use crate::lattice::{Dimension, GridKind};

/// Construction of the codes of a family.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Construction {
    /// Candidates `start`, `start + step`, … modulo 2^bits are tried in order. A candidate is kept
    /// if it satisfies the rules and is far enough from all those kept before (`docs/families.md`,
    /// “The published construction”).
    Lexicode {
        /// First candidate, hexadecimal.
        start: String,
        /// Difference of successive candidates.
        step: u64,
        /// Number of candidates tried.
        candidates: u64,
    },
    /// A union of cosets of a linear code, arranged on the tag, with some codes exchanged
    /// ([`crate::family::algebra`]).
    Algebraic(AlgebraicConstruction),
    /// Local search without initial codes (`deltille_search::Search`); the same seed, rounds and
    /// steps give the same codes.
    Search {
        /// Seed of the random choices.
        seed: u64,
        /// Rounds of the search.
        rounds: u32,
        /// Moves in each round.
        steps: u64,
    },
    /// Positions on boards ([`crate::family::positions`]).
    #[serde(alias = "places")]
    Positions,
    /// Codes from another source.
    Imported {
        /// Description of the source.
        source: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FamilyFile {
    schema: String,
    name: String,
    /// The tiling whose tiles the tags fill.
    #[serde(default, skip_serializing_if = "is_deltille")]
    kind: GridKind,
    bits: u32,
    distance: u32,
    fingerprint: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    beginnings: Vec<Beginning>,
    construction: Construction,
    rules: Rules,
    /// Number of pairs among the codes and their rotations at each distance.
    distance_histogram: BTreeMap<u32, u64>,
    /// The index is the number of corrected bits.
    false_positive_rate: Vec<f64>,
    codes: Vec<String>,
}

fn is_deltille(kind: &GridKind) -> bool {
    *kind == GridKind::Deltille
}

pub(in crate::family) fn from_json(json: &str) -> Result<Family, FamilyError> {
    // The schema is checked first, so that a file of another version is reported as one.
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    let Head { schema } = serde_json::from_str(json)?;
    if schema != SCHEMA {
        return Err(FamilyError::Schema { found: schema });
    }
    let file: FamilyFile = serde_json::from_str(json)?;
    if file.construction == Construction::Positions {
        // Position codes are computed and not listed.
        let known = Family::places();
        if (&file.name, &file.fingerprint) != (&known.name, &known.fingerprint) {
            let problem = format!("only {} has position codes", known.name);
            return Err(FamilyError::field("construction", problem));
        }
        return Ok(known);
    }
    let dimension =
        Dimension::from_bits(file.bits).map_err(|e| FamilyError::field("bits", e.to_string()))?;
    let codes = file
        .codes
        .iter()
        .enumerate()
        .map(|(id, text)| parse_word(text).ok_or((id, text)))
        .collect::<Result<Vec<u64>, _>>()
        .map_err(|(id, text)| {
            let problem = format!("`{text}` is not a hexadecimal word (example: 0x08f50a7)");
            FamilyError::field(format!("codes[{id}]"), problem)
        })?;
    check_form(&file.name, file.kind, dimension, file.distance, &codes, &file.rules)?;
    let free = file.rules.free;
    let used = dimension.bits() - free.map_or(0, |free| free.mask(dimension).count_ones());
    let rates = false_positive_rates(file.kind, used, file.distance, codes.len());
    let same = |(stated, rate): (&f64, &f64)| (stated - rate).abs() <= 1e-9 * rate;
    if rates.len() != file.false_positive_rate.len()
        || !file.false_positive_rate.iter().zip(&rates).all(same)
    {
        let problem =
            format!("it does not match the rates of {} codes, which are {rates:?}", codes.len());
        return Err(FamilyError::Claim { field: "false_positive_rate".to_owned(), problem });
    }
    let fingerprint = fingerprint(file.kind, dimension, file.distance, free, &codes);
    if fingerprint != file.fingerprint {
        let problem = format!(
            "the file states {}, but its codes have {fingerprint}: codes were altered, added or lost; \
             fetch or generate the file again",
            file.fingerprint
        );
        return Err(FamilyError::Claim { field: "fingerprint".to_owned(), problem });
    }
    let family = Family {
        name: file.name,
        kind: file.kind,
        dimension,
        distance: file.distance,
        codes,
        rules: file.rules,
        construction: file.construction,
        histogram: file.distance_histogram,
        fingerprint,
        beginnings: Vec::new(),
        squares: None,
    };
    family.with_beginnings(file.beginnings)
}

pub(in crate::family) fn to_json(family: &Family) -> String {
    let words = TagWords::of(family.kind, family.dimension);
    let listed = if family.is_position_family() { &[] } else { family.codes() };
    let file = FamilyFile {
        schema: SCHEMA.to_owned(),
        name: family.name.clone(),
        kind: family.kind,
        bits: family.dimension.bits(),
        distance: family.distance,
        fingerprint: family.fingerprint.clone(),
        beginnings: family.beginnings.clone(),
        construction: family.construction.clone(),
        rules: family.rules.clone(),
        distance_histogram: family.histogram.clone(),
        false_positive_rate: family.false_positive_rates(),
        codes: listed.iter().map(|&code| words.hex(code)).collect(),
    };
    let mut json = serde_json::to_string_pretty(&file).expect("plain data has a JSON form");
    json.push('\n');
    json
}

/// Checks everything that does not need a comparison of all pairs of codes.
pub(in crate::family) fn check_form(
    name: &str,
    kind: GridKind,
    dimension: Dimension,
    distance: u32,
    codes: &[u64],
    rules: &Rules,
) -> Result<(), FamilyError> {
    let bits = dimension.bits();
    Name::without_dots(name).map_err(|problem| FamilyError::field("name", problem))?;
    if !(1..=bits).contains(&distance) {
        let problem = format!("{distance} is not between 1 and {bits}, the number of bits");
        return Err(FamilyError::field("distance", problem));
    }
    check_name(name, dimension, distance)?;
    rules.check(bits)?;
    if kind == GridKind::Checker && !(rules.robust.is_empty() && rules.free.is_none()) {
        let problem = "only triangular tags can have hidden or free cells";
        return Err(FamilyError::field("rules", problem));
    }
    if codes.is_empty() {
        return Err(FamilyError::field("codes", "the list is empty"));
    }
    let words = TagWords::of(kind, dimension);
    if let Some(id) = codes.iter().position(|&code| code > dimension.mask()) {
        let problem = format!("{} has more than {bits} bits", words.hex(codes[id]));
        return Err(FamilyError::field(format!("codes[{id}]"), problem));
    }
    let free = rules.free.map_or(0, |free| free.mask(dimension));
    if let Some(id) = codes.iter().position(|&code| code & free != 0) {
        let problem = format!("{} uses a free cell", words.hex(codes[id]));
        return Err(FamilyError::Claim { field: format!("codes[{id}]"), problem });
    }
    let mut by_name: Vec<(u64, usize)> =
        (0..codes.len()).map(|id| (words.canonical(codes[id]), id)).collect();
    by_name.sort_unstable();
    if let Some(pair) = by_name.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let (first, second) = (pair[0].1, pair[1].1);
        let problem = format!(
            "{} repeats code {first}, possibly rotated: remove one",
            words.hex(codes[second])
        );
        return Err(FamilyError::Claim { field: format!("codes[{second}]"), problem });
    }
    Ok(())
}

/// Checks that a name such as d25h7 or delTag25h7 does not state other bits or another distance.
///
/// # Errors
/// Returns an error with both the stated and the actual values.
pub fn check_name(name: &str, dimension: Dimension, distance: u32) -> Result<(), FamilyError> {
    let rest = ["delTag", "aprilTag", "d"].iter().find_map(|prefix| name.strip_prefix(prefix));
    let number = |text: &str| text.parse::<u32>().ok();
    let stated = rest.and_then(|rest| rest.split_once('h'));
    let stated = stated.and_then(|(bits, distance)| Some((number(bits)?, number(distance)?)));
    match stated {
        Some(stated) if stated != (dimension.bits(), distance) => {
            let problem = format!(
                "`{name}` states {} bits and distance {}, but the family has {} bits and distance \
                 {distance}",
                stated.0,
                stated.1,
                dimension.bits()
            );
            Err(FamilyError::Claim { field: "name".to_owned(), problem })
        }
        _ => Ok(()),
    }
}
