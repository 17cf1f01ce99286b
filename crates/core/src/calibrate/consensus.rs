//! Corners of a picture that agree with each other, before anything is known of the camera.
//!
//! Through any lens three neighbours in a row lie nearly in a row, at nearly equal distances:
//!
//! ```text
//!     a ───── b ───── c        |a − 2b + c| < ¼ |c − a|
//! ```
//!
//! Corners that such triples tie to each other are one smooth map of the board. The largest set of them
//! is right where most corners are: wrong places tie to nothing, and labels that are off by a tile tie
//! to each other only. It is where a calibration starts from; what takes part in its end is judged
//! again, by the camera.

use std::collections::BTreeMap;

use super::problem::Observation;
use super::view::{LEAST_CORNERS, Sighting, View};
use crate::statistics::median;

/// How far the middle of three may lie from the middle, as a part of the whole: the two ways are then as
/// 5 to 3 at most, which a board shows only where it nearly touches the lens. A label that is off
/// by a tile makes a third.
const UNEVEN: f64 = 0.25;

/// Steps along which neighbours lie, on either lattice.
const STEPS: [(i32, i32); 4] = [(0, 1), (1, 0), (1, -1), (1, 1)];

/// The longest of these, by the shortest: the diagonals of squares are among them, the long ones of
/// rhombi are not.
const LONGEST_STEP: f64 = 1.5;

/// Three wrong corners may lie in a row, but hardly at the distance of neighbours: a triple is no longer
/// than so many times the usual.
const LONGEST_TRIPLE: f64 = 4.0;

/// The view with only those corners of each sighting that agree, and only sightings of which some do; as
/// it is where that is none, as on panels of a few corners.
pub(super) fn agreeing(view: &View) -> View {
    let of_sighting = |sighting: &Sighting| {
        let agree = largest_agreement(&sighting.observations)?;
        let observations = agree.into_iter().map(|index| sighting.observations[index]);
        Some(Sighting { panel: sighting.panel, observations: observations.collect() })
    };
    let sightings: Vec<Sighting> = view.sightings.iter().filter_map(of_sighting).collect();
    match sightings.is_empty() {
        true => view.clone(),
        false => View { sightings, ..view.clone() },
    }
}

/// The largest set of corners that triples tie to each other; `None` where it is too small for a pose.
fn largest_agreement(corners: &[Observation]) -> Option<Vec<usize>> {
    let triples = agreeing_triples(corners);
    // The set of each corner, by one of its members.
    let mut sets: Vec<usize> = (0..corners.len()).collect();
    let find = |sets: &[usize], mut corner: usize| {
        while sets[corner] != corner {
            corner = sets[corner];
        }
        corner
    };
    for triple in &triples {
        let first = find(&sets, triple[0]);
        for &other in &triple[1..] {
            let root = find(&sets, other);
            sets[root] = first;
        }
    }
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for corner in 0..corners.len() {
        members.entry(find(&sets, corner)).or_default().push(corner);
    }
    let largest = members.into_values().max_by_key(Vec::len);
    largest.filter(|largest| largest.len() >= LEAST_CORNERS)
}

fn agreeing_triples(corners: &[Observation]) -> Vec<[usize; 3]> {
    let places: BTreeMap<(i32, i32), usize> = corners
        .iter()
        .enumerate()
        .map(|(index, corner)| ((corner.row, corner.col), index))
        .collect();
    let mut found = Vec::new();
    let mut shortest_mm = f64::INFINITY;
    for (b, corner) in corners.iter().enumerate() {
        for (rows, cols) in STEPS {
            let at = |sign: i32| places.get(&(corner.row + sign * rows, corner.col + sign * cols));
            let (Some(&a), Some(&c)) = (at(-1), at(1)) else { continue };
            let step_mm = corners[c].panel_mm.distance(corners[a].panel_mm) / 2.0;
            shortest_mm = shortest_mm.min(step_mm);
            let [a_px, b_px, c_px] = [a, b, c].map(|index| corners[index].pixel);
            let (along, uneven) = (c_px - a_px, a_px - 2.0 * b_px + c_px);
            let length = along.x.hypot(along.y);
            if uneven.x.hypot(uneven.y) < UNEVEN * length {
                found.push(([a, b, c], step_mm, length));
            }
        }
    }
    found.retain(|(_, step_mm, _)| *step_mm <= LONGEST_STEP * shortest_mm);
    let usual = median(found.iter().map(|(_, _, length)| *length).collect()).unwrap_or(0.0);
    found.retain(|(_, _, length)| *length <= LONGEST_TRIPLE * usual);
    found.into_iter().map(|(triple, ..)| triple).collect()
}
