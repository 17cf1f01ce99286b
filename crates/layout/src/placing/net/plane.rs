//! Convex polygons in the plane: their distance, and rigid motions.

use glam::DVec2;

use deltille_core::angles::direction;

/// Overlap that rounding causes between two polygons that share an edge, mm. Coordinates in metres have errors a
/// million times smaller.
pub(crate) const TOUCHING_MM: f64 = 1e-6;

/// Returns the signed distance of two convex polygons, both counter-clockwise, mm. A positive value is a lower bound of
/// their distance, a negative one the depth of their overlap.
///
/// Two convex polygons are disjoint if and only if a line along an edge of one of them separates them. So the sign is
/// exact up to rounding errors of [`TOUCHING_MM`].
pub(crate) fn gap_mm(a: &[DVec2], b: &[DVec2]) -> f64 {
    let beyond_edges_of = |a: &[DVec2], b: &[DVec2]| {
        let edges = a.iter().zip(a.iter().cycle().skip(1));
        let gaps = edges.filter_map(|(&p, &q)| {
            let outwards = (p - q).perp().try_normalize()?;
            Some(b.iter().map(|&v| outwards.dot(v - p)).fold(f64::INFINITY, f64::min))
        });
        gaps.fold(f64::NEG_INFINITY, f64::max)
    };
    beyond_edges_of(a, b).max(beyond_edges_of(b, a))
}

/// A rotation about the origin, followed by a shift: `p ↦ turn · p + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Unit vector: image of the x axis.
    pub turn: DVec2,
    /// Image of the origin, mm.
    pub shift: DVec2,
}

impl Motion {
    /// Returns the motion that moves a to p, and rotates the direction from a to b into that from p to q.
    pub(crate) fn carrying([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> Self {
        let (from, to) = ((b - a).normalize_or_zero(), (q - p).normalize_or_zero());
        let turn = DVec2::new(from.dot(to), from.perp_dot(to));
        Self { turn, shift: p - turn.rotate(a) }
    }

    /// Returns the counter-clockwise rotation by an angle.
    pub(crate) fn turning(angle_rad: f64) -> Self {
        Self { turn: direction(angle_rad), shift: DVec2::ZERO }
    }

    /// Returns the image of a point.
    pub(crate) fn apply(&self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn triangle(at: DVec2, angle: f64) -> [DVec2; 3] {
        [0.0, 120.0, 240.0].map(|degrees: f64| at + DVec2::from_angle(angle + degrees.to_radians()))
    }

    #[test]
    fn triangles_that_share_an_edge_touch() {
        let [a, b, c] = triangle(DVec2::ZERO, 0.3);
        let mirrored = a + b - c;
        assert!(gap_mm(&[a, b, c], &[b, a, mirrored]).abs() < TOUCHING_MM);
    }

    proptest! {
        /// If the gap is positive, no point lies in both triangles. The overlap vanishes only once the centres are far
        /// enough apart.
        #[test]
        fn the_sign_matches_whether_a_common_point_exists(
            x in -3.0f64..3.0, y in -3.0f64..3.0, angle in 0.0f64..6.3, u in 0.0f64..1.0, v in 0.0f64..1.0,
        ) {
            let (a, b) = (triangle(DVec2::ZERO, 0.0), triangle(DVec2::new(x, y), angle));
            let gap = gap_mm(&a, &b);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let inside = b[0] + (b[1] - b[0]) * u + (b[2] - b[0]) * v;
            let in_a = (0..3).all(|i| (a[(i + 1) % 3] - a[i]).perp_dot(inside - a[i]) >= 0.0);
            prop_assert!(!(in_a && gap > 0.0));
            let apart = DVec2::new(x, y).length();
            prop_assert!(apart < 2.0 || gap >= -1e-12);
            prop_assert!(apart > 1.0 || gap <= 1e-12);
            prop_assert!((gap_mm(&b, &a) - gap).abs() < 1e-12);
        }

        #[test]
        fn a_motion_carries_edge_to_edge(angle in -3.0f64..3.0, x in -9.0f64..9.0) {
            let [a, b, c] = triangle(DVec2::new(x, 1.0), 0.2);
            let other = triangle(DVec2::new(1.0, x), angle);
            let motion = Motion::carrying([a, b], [other[0], other[1]]);
            for (from, to) in [a, b, c].into_iter().zip(other) {
                prop_assert!(motion.apply(from).distance(to) < 1e-12);
            }
        }
    }
}
