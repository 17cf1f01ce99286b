//! Polygons in the plane, as lists of corners; the first corner is not repeated at the end.

use glam::DVec2;

/// Returns the area, positive if the corners run counterclockwise with y up.
///
/// ```
/// use glam::DVec2;
///
/// let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 3.0]].map(DVec2::from);
/// assert_eq!(deltille_core::polygon::area(&corners), 3.0);
/// ```
pub fn area(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(p, &q)| p.perp_dot(q)).sum::<f64>()
}

/// Returns the rectangle with the given left, lower, right and upper ends, counterclockwise with y up from the lower
/// left corner.
pub fn rectangle([left, lower, right, upper]: [f64; 4]) -> [DVec2; 4] {
    [(left, lower), (right, lower), (right, upper), (left, upper)].map(DVec2::from)
}

/// Returns the left, lower, right and upper end of a set of points.
pub fn bounds<'a>(points: impl IntoIterator<Item = &'a DVec2>) -> [f64; 4] {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (least, most) =
        points.into_iter().fold(start, |(least, most), &p| (least.min(p), most.max(p)));
    [least.x, least.y, most.x, most.y]
}

/// Computes the convex hull, counterclockwise with y up (Andrew's monotone chain). Returns fewer than three points
/// unchanged.
pub fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut points.iter().copied());
    let upper = half(&mut points.iter().rev().copied());
    [lower, upper].concat()
}

/// Moves all sides of a convex polygon outwards by `by`; corners run counterclockwise with y up.
pub fn grown(polygon: &[DVec2], by: f64) -> Vec<DVec2> {
    let count = polygon.len();
    let outwards = |i: usize| -(polygon[(i + 1) % count] - polygon[i]).perp().normalize_or_zero();
    let corner = |i: usize| {
        let (before, after) = (outwards((i + count - 1) % count), outwards(i));
        polygon[i] + by * (before + after) / (1.0 + before.dot(after))
    };
    (0..count).map(corner).collect()
}

/// Returns the part of a polygon where a linear function is positive (Sutherland and Hodgman 1974). Parts of a
/// non-convex polygon stay joined along the line; the joining strip has no area.
pub fn clip(polygon: &[DVec2], at: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (at_p, at_q) = (at(p), at(q));
        if at_p >= 0.0 {
            kept.push(p);
        }
        if (at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0) {
            kept.push(p + (q - p) * (at_p / (at_p - at_q)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_grid_is_its_four_corners() {
        let grid = (0..12).map(|i| DVec2::new(f64::from(i % 4), f64::from(i / 4)));
        let expected = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]].map(DVec2::from);
        assert_eq!(hull(grid.collect()), expected);
        assert_eq!(area(&expected), 6.0);
        assert_eq!(area(&clip(&expected, |p| p.x - 2.0)), 2.0);
    }

    #[test]
    fn fewer_than_three_points_have_no_area() {
        let [a, b] = [DVec2::ZERO, DVec2::X];
        assert_eq!(hull(vec![b, a, b]), [a, b]);
        assert_eq!([area(&[]), area(&[a, b])], [0.0; 2]);
    }
}
