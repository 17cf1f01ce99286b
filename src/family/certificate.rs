use std::collections::BTreeMap;

use super::{Family, Screen, TagWords, distance_histogram};
use crate::lattice::TagCells;

/// What was found out about a family from nothing but its codes.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Smallest distance between any two words among the codes and their turns.
    pub min_distance: u32,
    /// Two codes (or one, twice) that are this close.
    pub closest: [u32; 2],
    /// Codes that break a rule of the family.
    pub rule_breakers: Vec<u32>,
    /// Number of pairs, among the codes and their turns, at each distance.
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
/// the tables that the searches use.
pub fn certify(family: &Family) -> Certificate {
    let cells = TagCells::new(family.dimension());
    let codes = family.codes();
    let histogram = distance_histogram(family.dimension(), codes);
    let min_distance = histogram.keys().next().copied().unwrap_or(family.dimension().bits());
    let closest = closest_pair(&cells, codes, min_distance);
    let screen = Screen::new(TagWords::new(family.dimension()), family.distance(), family.rules());
    let rule_breakers: Vec<u32> = (0..)
        .zip(codes)
        .filter(|&(_, &code)| !admits(&cells, &screen, family, code))
        .map(|(id, _)| id)
        .collect();

    let mut failures = Vec::new();
    if min_distance < family.distance() {
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
    if histogram != *family.histogram() {
        failures.push("distance_histogram: differs from that of the codes".to_owned());
    }
    Certificate { min_distance, closest, rule_breakers, histogram, failures }
}

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
