use std::collections::BTreeMap;

use super::hidden::least_seen;
use crate::family::hex::parse_word;
use crate::family::lexicode::Lexicode;
use crate::family::{
    Confusion, Construction, Control, Family, PAIRS_COUNTED, Robust, Screen, TagWords,
    distance_histogram,
};
use crate::lattice::TagCells;

/// What was found out about a family from nothing but its codes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Smallest distance between any two words, among the codes compared and their turns.
    pub min_distance: u32,
    /// Smallest distance between a code and a word, a code in any turn, seen in a mirror; `None` where not all pairs were
    /// compared. No family claims one: a mirror shows all tags of a board alike.
    pub mirror_distance: Option<u32>,
    /// For each kind of hidden cells that the rules name the least distance found in those that are seen, among the
    /// codes compared.
    pub robust: Vec<Robust>,
    /// Two codes (or one, twice) that are this close, when that is too close; else zeros.
    pub closest: [u32; 2],
    /// Whether all pairs were compared; if not, a sample was, and the structure was proved.
    pub all_compared: bool,
    /// Codes that break a rule of the family.
    pub rule_breakers: Vec<u32>,
    /// Number of pairs, among the codes compared and their turns, at each distance.
    pub histogram: BTreeMap<u32, u64>,
    /// What of the construction was not repeated, in words; empty when all of it was.
    pub unchecked: String,
    /// What in the file does not hold; empty when the family is what it claims to be.
    pub failures: Vec<String>,
}

impl Certificate {
    /// Whether every claim of the family that was checked holds.
    pub fn holds(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Checks a family from its codes as [`certify_codes`] does, and its construction.
///
/// An algebraic construction is written down again and has to give the same codes. So is a lexicode
/// of up to 25 bits; of a larger one the first candidates are tried again, and have to give the
/// first codes. A search is not repeated.
///
/// ```
/// use deltille_core::family::{Family, certify};
///
/// let certificate = certify(&Family::shipped("delTag16h5")?);
/// assert!(certificate.holds());
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
                // Later candidates come round to the first again.
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
            certificate.unchecked = "that the search finds these codes again".to_owned();
            return certificate;
        }
        // Single tags are far from nothing; patches are: `places::distances`.
        Construction::Places => return certificate,
        Construction::Imported { .. } => {
            certificate.unchecked = "where the codes come from".to_owned();
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
            // What a family had before it grew comes first, in whatever order.
            let same = match family.beginnings() {
                [] => again == codes,
                _ => sorted(&again) == sorted(codes),
            };
            if !same {
                certificate
                    .failures
                    .push("construction: gives other codes than the file".to_owned());
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

/// Lexicodes of up to this many bits are built again whole: seconds.
const REBUILT_BITS: u32 = 25;

/// First candidates of a larger lexicode that are tried again.
const PREFIX: u64 = 1 << 22;

/// Checks the codes of a family: distance, rules and histogram; a second for 100,000 codes.
///
/// Turns are taken from [`TagCells::rotate`] and complexity from its list of neighbours, not from
/// the tables that the searches use. Up to 100,000 codes all pairs are compared. Beyond, the
/// distance is proved from the structure that the file records
/// ([`crate::family::algebra::AlgebraicConstruction::prove`]), and a sample of pairs is compared as well.
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
            _ => Err("too many codes to compare, and no structure to prove it by".to_owned()),
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
            "distance: codes {} and {} come as close as {min_distance}, the family claims {}",
            closest[0],
            closest[1],
            family.distance()
        ));
    }
    if let Some(first) = rule_breakers.first() {
        failures.push(match rule_breakers.len() {
            1 => format!("rules: code {first} breaks them"),
            many => format!("rules: {many} codes break them, the first is code {first}"),
        });
    }
    let seen =
        |asked: &Robust| Robust { distance: least_seen(&cells, &compared, asked.to), ..*asked };
    let robust: Vec<Robust> = family.rules().robust.iter().map(seen).collect();
    for (asked, found) in family.rules().robust.iter().zip(&robust) {
        if found.distance < asked.distance {
            let (to, left, asked) = (asked.to.name(), found.distance, asked.distance);
            failures.push(format!(
                "robust: with the cells of {to} hidden {left} are left that differ, the family claims {asked}"
            ));
        }
    }
    let all_compared = compared.len() == codes.len();
    if all_compared && histogram != *family.histogram() {
        failures.push("distance_histogram: differs from that of the codes".to_owned());
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

/// Codes of a very large family that are compared pair by pair.
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
        let turns = std::iter::successors(Some(code), |&word| Some(cells.rotate(word)));
        let turns: Vec<u64> = turns.take(usize::from(cells.kind().turns())).collect();
        if turns[1..].iter().any(|turn| (code ^ turn).count_ones() == distance) {
            return [i as u32; 2];
        }
        let near = |&other: &u64| turns.iter().any(|t| (t ^ other).count_ones() == distance);
        if let Some(j) = codes[..i].iter().position(near) {
            return [j as u32, i as u32];
        }
    }
    [0; 2]
}
