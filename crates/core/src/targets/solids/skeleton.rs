//! A printable frame with a seat for a panel on every face.
//!
//! ```text
//!   the face's plane    ──╮rib╭── panel ────────╮   ╭─   The panel lies in its seat, so that its
//!                         │   │╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌│   │    outer side is on the face of the solid.
//!   thickness below it    │   ╰───╮         ╭───╯   │    The seat is a ledge around a window; the
//!                         │ ledge │ window  │       │    ribs between the seats reach out to the
//!   and wall below that   ╰───────╯         ╰───────╯    edges of the solid.
//! ```
//!
//! Every boundary on a face is its outline moved inwards in its own plane, so a seat is exact regardless of the
//! angles between faces. Panels are cut straight: nothing is mitred.

use std::f64::consts::PI;

use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::polyhedron::normal;
use crate::angles::{angle, tangent};
use crate::setting::Setting::{
    SkeletonPanelThicknessMm, SkeletonRibMm, SkeletonWallMm, SolidEdgeMm, SolidSkeleton,
};
use crate::targets::length::format_mm;
use crate::targets::{ClosedMesh, Polyhedron, TargetError};

/// Material left at the foot of a rib on either side of the edge, mm: two lines of a 0.4 mm nozzle.
const FOOT_MM: f64 = 0.8;

/// Least inradius of a window, mm: room for fingers and for removing support material.
const MIN_WINDOW_MM: f64 = 3.0;

/// Clearance around a panel in its seat, mm: the tolerance of printers and cutters.
const PLAY_MM: f64 = 0.15;

/// Relative spread of the face directions at a vertex below which they count as flat. The inner side then follows the
/// mean of the faces.
const FLAT: f64 = 0.05;

/// Ranges of thicknesses, mm.
const THICKNESS_MM: std::ops::RangeInclusive<f64> = 0.2..=50.0;

/// A printable frame with seats for panels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkeletonSpec {
    /// Thickness of the panels, including anything glued on them, mm.
    pub panel_thickness_mm: f64,
    /// Thickness of the frame below the panels, and least width of a ledge, mm.
    pub wall_mm: f64,
    /// Distance of a seat from the edges of its face, mm; `None` for the smallest one that gives a
    /// solid rib.
    pub rib_mm: Option<f64>,
}

impl Default for SkeletonSpec {
    /// Returns a frame of 4 mm for panels of 3 mm.
    fn default() -> Self {
        Self { panel_thickness_mm: 3.0, wall_mm: 4.0, rib_mm: None }
    }
}

/// The frame of a solid, for 3D printing.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Skeleton {
    /// Surface triangles in the target frame, counterclockwise from outside, mm.
    pub triangles_mm: Vec<[DVec3; 3]>,
    /// Distance of the panels from the edges of their faces, mm.
    pub panel_inset_mm: f64,
    /// Distance of the seats from the edges of their faces, mm.
    pub rib_mm: f64,
    /// Distance of the windows from the edges of their faces, mm.
    pub window_mm: f64,
}

impl Skeleton {
    /// Makes the frame of a solid.
    ///
    /// # Errors
    /// Returns an error if there is no room for seats, ledges and windows.
    pub fn new(solid: &Polyhedron, spec: &SkeletonSpec) -> Result<Self, TargetError> {
        let SkeletonSpec { panel_thickness_mm: thickness, wall_mm: wall, rib_mm } = *spec;
        let thicknesses = [(SkeletonPanelThicknessMm, thickness), (SkeletonWallMm, wall)];
        for (setting, mm) in thicknesses {
            if !THICKNESS_MM.contains(&mm) {
                let problem = format!("{} is not between 0.2 mm and 50 mm", format_mm(mm));
                return Err(TargetError::invalid(setting, problem));
            }
        }
        // A point h below two faces that meet at θ is h cot(θ/2) inside their edge.
        let sharpest = solid.dihedral_angles_rad().into_iter().fold(PI, f64::min);
        let inside = |below: f64| below / tangent(sharpest / 2.0);
        let least_rib = inside(thickness) + FOOT_MM;
        let rib = rib_mm.unwrap_or(least_rib);
        if !(rib >= least_rib - 1e-9 && rib.is_finite()) {
            let problem = format!(
                "{} leaves no base for the rib where faces meet at {:.1}°: use at least {:.1} mm, or thinner \
                 panels",
                format_mm(rib),
                sharpest.to_degrees(),
                (least_rib * 10.0).ceil() / 10.0
            );
            return Err(TargetError::invalid(SkeletonRibMm, problem));
        }
        let window = (rib + wall).max(inside(thickness + wall) + wall);
        let faces = || (0..solid.faces.len()).map(|face| solid.corners_mm(face));
        let inradius =
            faces().map(|corners| Incircle::of(&corners).radius).fold(f64::MAX, f64::min);
        if window + MIN_WINDOW_MM > inradius {
            let problem = format!(
                "seats and ledges take {:.1} mm from the edges, but the smallest face has only \
                 {inradius:.1} mm from edge to centre: use thinner {SkeletonWallMm} or panels, or \
                 a larger {SolidEdgeMm}",
                window + MIN_WINDOW_MM
            );
            return Err(TargetError::invalid(SolidSkeleton, problem));
        }
        let inner = inner_vertices(solid, thickness + wall);
        let mut triangles_mm = Vec::new();
        for (face, corners) in faces().enumerate() {
            let circle = Incircle::of(&corners);
            let at = |inset, below| circle.inset(&corners, inset, below);
            let loops = [
                corners.clone(),
                at(rib, 0.0),
                at(rib, thickness),
                at(window, thickness),
                at(window, thickness + wall),
                solid.faces[face].iter().map(|&vertex| inner[vertex]).collect(),
            ];
            for (outer, next) in loops.iter().zip(&loops[1..]) {
                for i in 0..outer.len() {
                    let j = (i + 1) % outer.len();
                    triangles_mm.push([outer[i], outer[j], next[j]]);
                    triangles_mm.push([outer[i], next[j], next[i]]);
                }
            }
        }
        let vertices: Vec<DVec3> = triangles_mm.iter().flatten().copied().collect();
        let indices: Vec<[usize; 3]> =
            (0..triangles_mm.len()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        match ClosedMesh::new(&vertices, &indices) {
            Ok((_, false)) => {}
            _ => {
                let problem = format!(
                    "the frame would intersect itself: use thinner {SkeletonWallMm} or panels"
                );
                return Err(TargetError::invalid(SolidSkeleton, problem));
            }
        }
        Ok(Self { triangles_mm, panel_inset_mm: rib + PLAY_MM, rib_mm: rib, window_mm: window })
    }
}

/// Limit for moving the sides of a convex polygon in space inwards; for a triangle, the inscribed circle.
pub struct Incircle {
    /// Centre of the circle; for other polygons the mean of the corners.
    pub centre: DVec3,
    /// Radius of the circle, in the unit of the corners; for other polygons, the inward distance at
    /// which the first side vanishes.
    pub radius: f64,
    /// Unit normal of the polygon.
    pub normal: DVec3,
}

impl Incircle {
    /// Computes the circle of a polygon with these corners.
    pub fn of(corners: &[DVec3]) -> Self {
        let normal = normal(corners);
        if let [a, b, c] = *corners {
            let lengths = [b.distance(c), c.distance(a), a.distance(b)];
            let around: f64 = lengths.iter().sum();
            let centre = (a * lengths[0] + b * lengths[1] + c * lengths[2]) / around;
            let radius = normal.length() / around;
            return Self { centre, radius, normal: normal.normalize_or_zero() };
        }
        let normal = normal.normalize_or_zero();
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let ways = inward_directions(corners, normal);
        // A side becomes shorter as its ends approach each other along it.
        let side = |i: usize| {
            let j = (i + 1) % corners.len();
            let along = corners[j] - corners[i];
            along.length_squared() / (ways[i] - ways[j]).dot(along)
        };
        let radius = (0..corners.len()).map(side).filter(|h| *h > 0.0).fold(f64::MAX, f64::min);
        Self { centre, radius, normal }
    }

    /// Returns the polygon with its sides moved inwards, and lowered below its plane.
    pub fn inset(&self, corners: &[DVec3], inset: f64, below: f64) -> Vec<DVec3> {
        let down = self.normal * below;
        if corners.len() == 3 {
            let scale = (self.radius - inset) / self.radius;
            let moved = |v: &DVec3| self.centre + (v - self.centre) * scale - down;
            return corners.iter().map(moved).collect();
        }
        let ways = inward_directions(corners, self.normal);
        corners.iter().zip(ways).map(|(v, way)| v + way * inset - down).collect()
    }
}

/// Returns the displacement of each corner of a convex polygon when its sides move inwards by one unit.
///
/// It moves along d = (m + n) / (1 + m·n), as d·m = d·n = 1 with the inward normals m and n of its two sides.
fn inward_directions(corners: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let count = corners.len();
    let inwards =
        |i: usize| normal.cross(corners[(i + 1) % count] - corners[i % count]).normalize_or_zero();
    (0..count)
        .map(|i| {
            let (m, n) = (inwards(i + count - 1), inwards(i));
            (m + n) / (1.0 + m.dot(n))
        })
        .collect()
}

/// Returns the vertices of the inner side: each at the distance `below` from the planes of all
/// faces around the vertex, inwards. This is exact where three faces meet or the faces are evenly
/// arranged, and a least-squares fit elsewhere.
fn inner_vertices(solid: &Polyhedron, below: f64) -> Vec<DVec3> {
    let mut normals = vec![Vec::new(); solid.vertices_mm.len()];
    for (index, face) in solid.faces.iter().enumerate() {
        let normal = solid.normal(index);
        face.iter().for_each(|&vertex| normals[vertex].push(normal));
    }
    let moved = |(vertex, normals): (&DVec3, &Vec<DVec3>)| {
        let n = normals.len();
        let rows = DMatrix::from_fn(n, 3, |row, column| normals[row][column]);
        let svd = rows.svd(true, true);
        let most = svd.singular_values.max();
        let step = svd.solve(&DVector::from_element(n, -below), FLAT * most);
        step.map_or(*vertex, |step| *vertex + DVec3::new(step[0], step[1], step[2]))
    };
    solid.vertices_mm.iter().zip(&normals).map(moved).collect()
}

impl Polyhedron {
    /// Returns the angles between the two faces at each edge, measured inside, radians, in the order of
    /// [`Self::edges`]. They are below π at convex edges.
    pub fn dihedral_angles_rad(&self) -> Vec<f64> {
        let mut sides = std::collections::BTreeMap::<[usize; 2], Vec<(usize, DVec3)>>::new();
        for (index, face) in self.faces.iter().enumerate() {
            let normal = self.normal(index);
            for i in 0..face.len() {
                let [from, to, apex] = [0, 1, 2].map(|step| face[(i + step) % face.len()]);
                sides.entry([from.min(to), from.max(to)]).or_default().push((apex, normal));
            }
        }
        let inside = |edge: [usize; 2]| {
            let [(_, one), (apex, other), ..] = sides[&edge].as_slice() else { return PI };
            let between = angle(one.cross(*other).length(), one.dot(*other));
            // The edge is concave if the second face extends beyond the plane of the first.
            let hollow = one.dot(self.vertices_mm[*apex] - self.vertices_mm[edge[0]]) > 0.0;
            if hollow { PI + between } else { PI - between }
        };
        self.edges().into_iter().map(inside).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    /// Computes the volume below the surface, by the divergence theorem.
    fn volume(triangles: &[[DVec3; 3]]) -> f64 {
        triangles.iter().map(|[a, b, c]| DMat3::from_cols(*a, *b, *c).determinant() / 6.0).sum()
    }

    #[test]
    fn dihedral_angles_match_known_values() {
        for (solid, cosine) in [
            (Polyhedron::tetrahedron(50.0), 1.0 / 3.0),
            (Polyhedron::octahedron(50.0), -1.0 / 3.0),
            (Polyhedron::icosahedron(50.0), -(5f64.sqrt()) / 3.0),
            (Polyhedron::cuboid(DVec3::new(50.0, 40.0, 30.0)), 0.0),
        ] {
            for angle in solid.dihedral_angles_rad() {
                assert!((angle.cos() - cosine).abs() < 1e-12);
            }
        }
    }

    /// The volume of the frame is that of the solid without its inside, its seats and its windows.
    #[test]
    fn volume_equals_the_sum_of_its_parts() {
        for solid in [Polyhedron::icosahedron(150.0), Polyhedron::octahedron(150.0)] {
            let spec = SkeletonSpec::default();
            let frame = Skeleton::new(&solid, &spec).unwrap();
            let whole = volume(&solid.triangles_mm());
            let circle = Incircle::of(&solid.corners_mm(0));
            let depth = circle.centre.dot(circle.normal);
            let hollow = (1.0 - 7.0 / depth).powi(3) * whole;
            let area = |inset: f64| 3.0 * 3f64.sqrt() * (circle.radius - inset).powi(2);
            let cut = area(frame.rib_mm) * 3.0 + area(frame.window_mm) * 4.0;
            let expected = whole - hollow - cut * solid.faces.len() as f64;
            let found = volume(&frame.triangles_mm);
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }

    /// The same for a box with different sides.
    #[test]
    fn cuboid_volume_equals_the_sum_of_its_parts() {
        let size = DVec3::new(200.0, 150.0, 100.0);
        let solid = Polyhedron::cuboid(size);
        let frame = Skeleton::new(&solid, &SkeletonSpec::default()).unwrap();
        let shrunk = |by: f64| size - 2.0 * by;
        let area = |inset: f64| {
            let DVec3 { x, y, z } = shrunk(inset);
            2.0 * (x * y + y * z + z * x)
        };
        let cut = area(frame.rib_mm) * 3.0 + area(frame.window_mm) * 4.0;
        let expected = size.element_product() - shrunk(7.0).element_product() - cut;
        let found = volume(&frame.triangles_mm);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn frames_without_room_are_rejected_with_a_remedy() {
        let message = |solid: Polyhedron, spec: SkeletonSpec| {
            Skeleton::new(&solid, &spec).unwrap_err().to_string()
        };
        let spec = SkeletonSpec::default();
        let thin = SkeletonSpec { rib_mm: Some(1.0), ..spec };
        assert!(
            message(Polyhedron::icosahedron(150.0), thin)
                .contains("`SkeletonSpec::rib_mm`: 1 mm leaves no base")
        );
        assert!(
            message(Polyhedron::tetrahedron(50.0), spec).contains("a larger `SolidSpec::edge_mm`")
        );
        let none = SkeletonSpec { wall_mm: 0.0, ..spec };
        assert!(message(Polyhedron::icosahedron(150.0), none).contains("`SkeletonSpec::wall_mm`"));
    }
}
