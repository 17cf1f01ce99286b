//! The lengths that a frame measures.
//!
//! As in VDI/VDE 2634 part 1, lines in different directions of the measured volume, each with five lengths from one of its
//! ends. Its seven lines lie in a fixed arrangement of scale bars; here the target has a different pose in each frame, and the
//! lines are the longest ones on it.

use glam::DVec3;

/// Maximum number of lines in a frame.
const LINES: usize = 7;

/// Number of lengths on a line.
const LENGTHS: usize = 5;

/// Smallest angle between two lines: the cosine of 30°.
const APART: f64 = 0.866;

/// Smallest length, relative to the longest one.
const SHORTEST: f64 = 0.1;

/// Number of directions in which the outermost corners are candidates for the ends of lines.
const DIRECTIONS: usize = 64;

/// Pairs of corners by their indices, from their positions on the target, mm.
pub(super) fn lengths(corners: &[DVec3]) -> Vec<[usize; 2]> {
    let ends = outermost(corners);
    let length = |[a, b]: [usize; 2]| corners[a].distance(corners[b]);
    let pairs = ends.iter().enumerate().flat_map(|(n, &a)| ends[..n].iter().map(move |&b| [b, a]));
    let mut pairs: Vec<[usize; 2]> = pairs.collect();
    pairs.sort_by(|&a, &b| length(b).total_cmp(&length(a)).then(a.cmp(&b)));
    let Some(longest) = pairs.first().map(|&pair| length(pair)) else { return Vec::new() };
    let mut lines: Vec<([usize; 2], DVec3)> = Vec::new();
    for pair in pairs {
        let direction = (corners[pair[1]] - corners[pair[0]]).normalize_or_zero();
        let is_new = lines.iter().all(|(_, other)| other.dot(direction).abs() < APART);
        if is_new && length(pair) > SHORTEST * longest {
            lines.push((pair, direction));
        }
        if lines.len() == LINES {
            break;
        }
    }
    let mut found: Vec<[usize; 2]> = Vec::new();
    for ([start, end], _) in lines {
        for part in 1..=LENGTHS {
            let part = part as f64 / LENGTHS as f64;
            let wanted = corners[start].lerp(corners[end], part);
            let distance = |&i: &usize| corners[i].distance_squared(wanted);
            let nearest = (0..corners.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let pair = [start, nearest.unwrap_or(end)];
            if pair[0] != pair[1] && !found.contains(&pair) {
                found.push(pair);
            }
        }
    }
    found
}

/// The outermost corners in directions that are evenly distributed over a half sphere, by index.
fn outermost(corners: &[DVec3]) -> Vec<usize> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let mut found: Vec<usize> = (0..DIRECTIONS)
        .flat_map(|i| {
            let z = (i as f64 + 0.5) / DIRECTIONS as f64;
            let (sine, cosine) = (golden * i as f64).sin_cos();
            let direction = DVec3::new(cosine, sine, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
            let along = |&i: &usize| corners[i].dot(direction);
            let all = || 0..corners.len();
            let last = all().max_by(|a, b| along(a).total_cmp(&along(b)));
            [last, all().min_by(|a, b| along(a).total_cmp(&along(b)))]
        })
        .flatten()
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_board_have_different_directions_and_lengths() {
        let corners: Vec<DVec3> = (0..100)
            .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0) * 20.0)
            .collect();
        let found = lengths(&corners);
        assert!((15..=30).contains(&found.len()), "{}", found.len());
        let longest = found.iter().map(|&[a, b]| corners[a].distance(corners[b]));
        let longest = longest.fold(0.0, f64::max);
        assert!((longest - 180.0 * 2f64.sqrt()).abs() < 1e-9);
        assert!(lengths(&corners[..1]).is_empty());
    }
}
