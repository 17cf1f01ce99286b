use std::collections::BTreeMap;

use super::{Construction, Family, PAIRS_COUNTED, Screen, TagWords, distance_histogram};
use crate::lattice::TagCells;

/// What was found out about a family from nothing but its codes.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Smallest distance between any two words, among the codes compared and their turns.
    pub min_distance: u32,
    /// Two codes (or one, twice) that are this close, when that is too close; else zeros.
    pub closest: [u32; 2],
    /// Whether all pairs were compared; if not, a sample was, and the structure was proved.
    pub all_compared: bool,
    /// Codes that break a rule of the family.
    pub rule_breakers: Vec<u32>,
    /// Number of pairs, among the codes compared and their turns, at each distance.
    pub histogram: BTreeMap<u32, u64>,
    /// What in the file does not hold; empty when the family is what it claims to be.
    pub failures: Vec<String>,
}

impl Certificate {
    /// Whether every claim of the family holds.
    pub fn holds(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Checks every claim of a family from its codes: distance, rules and statistics.
///
/// Turns are taken from [`TagCells::rotate`] and complexity from its list of neighbours, not from
/// the tables that the searches use. Up to 100,000 codes all pairs are compared. Beyond, the
/// distance is proved from the structure that the file records
/// ([`super::algebra::AlgebraicConstruction::prove`]), and a sample of pairs is compared as well.
/// An algebraic construction is written down again and has to give the same codes.
pub fn certify(family: &Family) -> Certificate {
    let cells = TagCells::new(family.dimension());
    let codes = family.codes();
    let screen = Screen::new(TagWords::new(family.dimension()), family.distance(), family.rules());
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
    let histogram = distance_histogram(family.dimension(), &compared);
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
        let many = rule_breakers.len();
        failures.push(format!("rules: {many} codes break them, the first is code {first}"));
    }
    if let Construction::Algebraic(construction) = family.construction() {
        match construction.codes(&screen) {
            Ok(again) if again == codes => {}
            Ok(_) => failures.push("construction: gives other codes than the file".to_owned()),
            Err(error) => failures.push(error.to_string()),
        }
    }
    let all_compared = compared.len() == codes.len();
    if all_compared && histogram != *family.histogram() {
        failures.push("distance_histogram: differs from that of the codes".to_owned());
    }
    Certificate { min_distance, closest, all_compared, rule_breakers, histogram, failures }
}

/// Codes of a very large family that are compared pair by pair.
const SAMPLE: usize = 20_000;

fn admits(cells: &TagCells, screen: &Screen, family: &Family, code: u64) -> bool {
    let rules = family.rules();
    let bit = |i: u8| code >> i & 1;
    let differing = cells.neighbours().iter().filter(|&&[a, b]| bit(a) != bit(b)).count() as u32;
    let white = code.count_ones();
    differing >= screen.min_pairs
        && white >= rules.black_distance
        && family.dimension().bits() - white >= rules.white_distance
}

fn closest_pair(cells: &TagCells, codes: &[u64], distance: u32) -> [u32; 2] {
    for (i, &code) in codes.iter().enumerate() {
        let once = cells.rotate(code);
        if (code ^ once).count_ones() == distance {
            return [i as u32; 2];
        }
        let turns = [code, once, cells.rotate(once)];
        let near = |&other: &u64| turns.iter().any(|t| (t ^ other).count_ones() == distance);
        if let Some(j) = codes[..i].iter().position(near) {
            return [j as u32, i as u32];
        }
    }
    [0; 2]
}
