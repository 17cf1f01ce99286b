use std::collections::BTreeMap;

use super::hidden::least_seen;
use crate::family::hex::parse_word;
use crate::family::lexicode::Lexicode;
use crate::family::{
    Confusion, Construction, Control, Family, PAIRS_COUNTED, Robust, Screen, TagWords,
    distance_histogram,
};
use crate::lattice::TagCells;

/// Results about a family, derived only from its codes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Smallest distance between any two words, among the compared codes and their rotations.
    pub min_distance: u32,
    /// Smallest distance between a code and a mirrored word in any rotation; `None` if not all pairs were compared.
    /// No family claims one, because a mirror affects all tags of a board in the same way.
    pub mirror_distance: Option<u32>,
    /// For each kind of hidden cells in the rules, the minimum distance in the visible cells among the compared
    /// codes.
    pub robust: Vec<Robust>,
    /// Two codes (or one, twice) at the minimum distance, if it is too small; else zeros.
    pub closest: [u32; 2],
    /// Whether all pairs were compared. Otherwise a sample was compared, and the distance was
    /// proven from the structure.
    pub all_compared: bool,
    /// Ids of codes that break a rule of the family.
    pub rule_breakers: Vec<u32>,
    /// Number of pairs, among the compared codes and their rotations, at each distance.
    pub histogram: BTreeMap<u32, u64>,
    /// Description of the part of the construction that was not repeated; empty if all of it was.
    pub unchecked: String,
    /// Wrong claims of the file; empty if the family is correct.
    pub failures: Vec<String>,
}

impl Certificate {
    /// Returns whether every checked claim of the family holds.
    pub fn is_valid(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Checks the codes of a family like [`certify_codes`], and its construction.
///
/// An algebraic construction is repeated and must give the same codes. So is a lexicode of up to 25 bits. For a
/// larger one, the first candidates are tried again and must give the first codes. A search is not repeated.
///
/// ```
/// use deltille_core::family::{Family, certify};
///
/// let certificate = certify(&Family::shipped("delTag16h5")?);
/// assert!(certificate.is_valid());
/// # Ok::<(), deltille_core::family::FamilyError>(())
/// ```
pub fn certify(family: &Family) -> Certificate {
    let mut certificate = certify_codes(family);
    let screen = Screen::new(TagWords::new(family.dimension()), family.distance(), family.rules());
    let again = match family.construction() {
        Construction::Algebraic(construction) => {
            construction.codes(&screen).map_err(|e| e.to_string())
        }
        Construction::Lexicode { start, step, candidates } => match parse_word(start) {
            None => Err(format!("construction.start: `{start}` is not a hexadecimal word")),
            Some(start) => {
                let bits = family.dimension().bits();
                // Candidates wrap around to the first one.
                let all = (*candidates).min(family.dimension().mask().saturating_add(1));
                let candidates = if bits <= REBUILT_BITS { all } else { all.min(PREFIX) };
                if candidates < all {
                    certificate.unchecked =
                        format!("all but the first {candidates} candidates of the lexicode");
                }
                let lexicode = Lexicode {
                    dimension: family.dimension(),
                    distance: family.distance(),
                    rules: family.rules().clone(),
                    start: start & family.dimension().mask(),
                    step: *step,
                    candidates,
                };
                lexicode.codes(Control::default()).map_err(|e| e.to_string())
            }
        },
        Construction::Search { .. } => {
            certificate.unchecked = "whether the search reproduces these codes".to_owned();
            return certificate;
        }
        // Single tags have almost no distance; patches do: `places::distances`.
        Construction::Positions => return certificate,
        Construction::Imported { .. } => {
            certificate.unchecked = "the origin of the codes".to_owned();
            return certificate;
        }
    };
    match again {
        Err(problem) => certificate.failures.push(problem),
        Ok(again) => {
            let whole = certificate.unchecked.is_empty();
            let codes = if whole {
                family.codes()
            } else {
                family.codes().get(..again.len()).unwrap_or_default()
            };
            // Codes from before the family grew come first, in any order.
            let same = match family.beginnings() {
                [] => again == codes,
                _ => sorted(&again) == sorted(codes),
            };
            if !same {
                certificate
                    .failures
                    .push("construction: it yields other codes than those in the file".to_owned());
            }
        }
    }
    certificate
}

fn sorted(codes: &[u64]) -> Vec<u64> {
    let mut codes = codes.to_vec();
    codes.sort_unstable();
    codes
}

/// Largest number of bits at which lexicodes are rebuilt completely: this takes seconds.
const REBUILT_BITS: u32 = 25;

/// Number of first candidates of a larger lexicode that are tried again.
const PREFIX: u64 = 1 << 22;

/// Checks the codes of a family: distance, rules and histogram; takes a second for 100,000 codes.
///
/// Rotations come from [`TagCells::rotate`] and complexity from its list of neighbours, not from the tables that the
/// searches use. Up to 100,000 codes, all pairs are compared. Beyond that, the distance is proven
/// from the structure that
/// the file records ([`crate::family::algebra::AlgebraicConstruction::prove`]), and a sample of pairs is compared
/// too.
pub fn certify_codes(family: &Family) -> Certificate {
    let cells = family.cells();
    let codes = family.codes();
    let screen = Screen::new(
        TagWords::of(family.kind(), family.dimension()),
        family.distance(),
        family.rules(),
    );
    let rule_breakers: Vec<u32> = (0..)
        .zip(codes)
        .filter(|&(_, &code)| !admits(&cells, &screen, family, code))
        .map(|(id, _)| id)
        .collect();

    let mut failures = Vec::new();
    let compared = if codes.len() <= PAIRS_COUNTED {
        codes.to_vec()
    } else {
        let proof = match family.construction() {
            Construction::Algebraic(construction) => construction.prove(&screen, codes),
            _ => {
                Err("there are too many codes to compare, and no structure for a proof".to_owned())
            }
        };
        failures.extend(proof.err().map(|reason| format!("distance: {reason}")));
        let step = codes.len().div_ceil(SAMPLE);
        codes.iter().copied().step_by(step).collect()
    };
    let histogram = distance_histogram(family.kind(), family.dimension(), &compared);
    let min_distance = histogram.keys().next().copied().unwrap_or(family.dimension().bits());
    let mut closest = [0; 2];
    if min_distance < family.distance() {
        closest = closest_pair(&cells, &compared, min_distance).map(|i| {
            let code = compared[i as usize];
            codes.iter().position(|&c| c == code).unwrap_or(0) as u32
        });
        failures.push(format!(
            "distance: codes {} and {} differ in {min_distance} cells, but the family claims {}",
            closest[0],
            closest[1],
            family.distance()
        ));
    }
    if let Some(first) = rule_breakers.first() {
        failures.push(match rule_breakers.len() {
            1 => format!("rules: code {first} breaks a rule"),
            many => format!("rules: {many} codes break a rule; the first is code {first}"),
        });
    }
    let seen =
        |asked: &Robust| Robust { distance: least_seen(&cells, &compared, asked.to), ..*asked };
    let robust: Vec<Robust> = family.rules().robust.iter().map(seen).collect();
    for (asked, found) in family.rules().robust.iter().zip(&robust) {
        if found.distance < asked.distance {
            let (to, left, asked) = (asked.to.name(), found.distance, asked.distance);
            failures.push(format!(
                "robust: with the cells of {to} hidden, codes differ in only {left} cells, but the family claims {asked}"
            ));
        }
    }
    let all_compared = compared.len() == codes.len();
    if all_compared && histogram != *family.histogram() {
        failures.push("distance_histogram: it differs from that of the codes".to_owned());
    }
    let unchecked = String::new();
    let mirror_distance = all_compared
        .then(|| Confusion::between(family, family)?.mirrored.into_keys().next())
        .flatten();
    Certificate {
        min_distance,
        mirror_distance,
        robust,
        closest,
        all_compared,
        rule_breakers,
        histogram,
        unchecked,
        failures,
    }
}

/// Number of codes of a very large family that are compared pair by pair.
const SAMPLE: usize = 20_000;

fn admits(cells: &TagCells, screen: &Screen, family: &Family, code: u64) -> bool {
    let rules = family.rules();
    let bit = |i: u8| code >> i & 1;
    let free = family.free_cells();
    let counts = |&&[a, b]: &&[u8; 2]| (free >> a | free >> b) & 1 == 0 && bit(a) != bit(b);
    let differing = cells.neighbours().iter().filter(counts).count() as u32;
    let white = code.count_ones();
    code & free == 0
        && differing >= screen.min_pairs()
        && white >= rules.black_distance
        && family.used_cells() - white >= rules.white_distance
}

fn closest_pair(cells: &TagCells, codes: &[u64], distance: u32) -> [u32; 2] {
    for (i, &code) in codes.iter().enumerate() {
        let rotations = std::iter::successors(Some(code), |&word| Some(cells.rotate(word)));
        let rotations: Vec<u64> = rotations.take(usize::from(cells.kind().rotations())).collect();
        if rotations[1..].iter().any(|turn| (code ^ turn).count_ones() == distance) {
            return [i as u32; 2];
        }
        let near = |&other: &u64| rotations.iter().any(|t| (t ^ other).count_ones() == distance);
        if let Some(j) = codes[..i].iter().position(near) {
            return [j as u32, i as u32];
        }
    }
    [0; 2]
}
