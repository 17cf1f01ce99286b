//! Consensus among the corners of an image, before anything is known about the camera.
//!
//! Any lens images three neighbours in a row nearly in a row, at nearly equal distances:
//!
//! ```text
//!     a ───── b ───── c        |a − 2b + c| < ¼ |c − a|
//! ```
//!
//! Corners that are connected by these triples belong to one smooth map of the board. The largest
//! connected set is correct if most corners are: wrong positions connect to nothing, and labels
//! that are off by a tile connect only to each other. A calibration starts from this set. The final
//! set of corners is selected later with the estimated camera.

use std::collections::BTreeMap;

use crate::input::observation::{MIN_CORNERS, Observation, Sighting, View};
use deltille_core::statistics::median;

/// Maximum deviation of the middle corner from the mean of its neighbours, as a fraction of their
/// distance. The ratio of the two distances is then at most 5 : 3. A board shows this ratio only
/// where it nearly touches the lens. A label that is off by a tile gives a third.
const UNEVEN: f64 = 0.25;

/// Steps (rows, columns) between neighbours, on either lattice.
const STEPS: [(i32, i32); 4] = [(0, 1), (1, 0), (1, -1), (1, 1)];

/// Longest of these steps relative to the shortest: this admits the diagonals of squares, but not
/// the long ones of rhombi.
const LONGEST_STEP: f64 = 1.5;

/// Longest triple relative to the usual length. Three wrong corners may lie in a row, but hardly
/// ever at the distance of neighbours.
const LONGEST_TRIPLE: f64 = 4.0;

/// The view with only those corners of each sighting that agree, and only the sightings that have
/// any. If no sighting has any, for example on panels of a few corners, the view is unchanged.
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

/// Indices of the largest set of corners that triples connect; `None` if it is too small for a
/// pose.
fn largest_agreement(corners: &[Observation]) -> Option<Vec<usize>> {
    let triples = agreeing_triples(corners);
    // Disjoint sets (union-find): each corner points to another member of its set.
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
    largest.filter(|largest| largest.len() >= MIN_CORNERS)
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
