//! The number of crossings of outlines. The union of areas has a corner at each crossing, so a small file with long crossing
//! lines could exhaust memory.

use glam::DVec2;

use super::area::Straight;

/// Whether at most `most` pairs of lines meet outside a common end.
pub(super) fn are_at_most<'a>(most: usize, all: impl Iterator<Item = &'a Straight>) -> bool {
    let mut lines: Vec<[DVec2; 2]> = Vec::new();
    for outline in all.flat_map(|straight| &straight.outlines) {
        let next = outline.iter().cycle().skip(1);
        lines.extend(outline.iter().zip(next).map(|(&a, &b)| [a, b].map(DVec2::from)));
    }
    let left = |line: &[DVec2; 2]| line[0].x.min(line[1].x);
    lines.sort_by(|a, b| left(a).total_cmp(&left(b)));
    let mut found = 0;
    for (index, line) in lines.iter().enumerate() {
        let right = line[0].x.max(line[1].x);
        let beside = lines[index + 1..].iter().take_while(|other| left(other) <= right);
        found += beside.filter(|other| meet(line, other)).count();
        if found > most {
            return false;
        }
    }
    true
}

fn meet(&[a, b]: &[DVec2; 2], &[c, d]: &[DVec2; 2]) -> bool {
    if a.y.max(b.y) < c.y.min(d.y) || c.y.max(d.y) < a.y.min(b.y) {
        return false;
    }
    if a == c || a == d || b == c || b == d {
        return false;
    }
    let side = |from: DVec2, to: DVec2, point: DVec2| (to - from).perp_dot(point - from);
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_and_overlapping_lines_meet_but_neighbours_do_not() {
        let line = |a: (f64, f64), b: (f64, f64)| [a, b].map(DVec2::from);
        let level = line((0.0, 0.0), (4.0, 0.0));
        assert!(meet(&level, &line((1.0, -1.0), (2.0, 1.0))));
        assert!(meet(&level, &line((1.0, 0.0), (5.0, 0.0))));
        assert!(!meet(&level, &line((4.0, 0.0), (5.0, 1.0))));
        assert!(!meet(&level, &line((5.0, -1.0), (5.0, 1.0))));
    }
}
