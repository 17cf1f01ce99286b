//! Verification of bodies for 3D printing, as STL, and of skeletons, as 3MF: a closed surface of the stated shape
//! with its normals outwards.
//!
//! A skeleton carries a panel on each face. It is probed from outside with rays, which must hit the plane of the face
//! on the ribs, stop deeper by the panel thickness in the seats, and pass through the windows. It is then compared
//! triangle by triangle, as a solid is.
//!
//! ```text
//!      ray   ray      ray    ray
//!       │     │        │      │
//!     ▄▄▼▄▄   │        │      │        face
//!     █████▄▄▄▼▄▄▄▄▄▄▄▄▼▄▄    │        panel thickness below it
//!     ████████████████████    ▼ …
//!      rib        seat       window
//! ```

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::finding::any::Finding;
use crate::finding::mesh::MeshFinding;
use crate::mesh::measures::{MESH_TOLERANCE_MM, is_other_mesh, other_count, volume};
use crate::model::stl::{Facet, load_stl};
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::Reader;
use crate::syntax::{findings, inspect};
use crate::verdict::{BodyVerdict, Verdict};
use crate::verifier::Verifier;
use deltille_core::targets::{
    ClosedMesh, Incircle, Polyhedron, Skeleton, SkeletonSpec, TargetSpec,
};
use deltille_files::export::{stl, threemf};

/// Tolerance of the difference between a stated unit normal and that of its triangle: vertices are in single
/// precision, and some triangles are small.
const NORMAL_SLACK: f64 = 1e-3;

/// Maximum deviation of the ratio of the volumes from 1: vertices are in single precision.
const VOLUME_SLACK: f64 = 1e-4;

/// Rays start this far above a face, mm, and keep this distance from the lines where ribs, seats and windows meet,
/// mm: the depth is undefined on those lines.
const ABOVE_MM: f64 = 0.5;
const BESIDE_MM: f64 = 0.02;

/// Number of triangles nearest to the stated centroid to compare: some triangles share a centroid.
const SAME_MIDDLE: usize = 4;

/// Positions along a side of a face, as fractions of its length, at which rays are sent.
const POSITIONS: [f64; 3] = [0.15, 0.5, 0.85];

/// Reads an STL, and compares it with the target.
///
/// # Errors
///
/// Returns an error if the file cannot be read or the target does not have this body. Deviations are findings of the
/// verdict.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
) -> Result<Verdict, DocumentError> {
    let (refused, _) = inspect::check(reader, path, Format::Stl, &verifier.printing)?;
    if findings::refuse(&refused) {
        return Ok(Verdict::new(path, Format::Stl, refused));
    }
    Ok(compare(verifier, path, &load_stl(reader, path)?, Format::Stl)?.with(refused))
}

/// Compares the triangles of a solid or of its skeleton with the target. The file name determines
/// which of the two it is.
///
/// # Errors
///
/// Returns an error if the target is not a solid, or if the file is named as a skeleton and the target has none.
/// Deviations are findings of the verdict.
pub(super) fn compare(
    verifier: &Verifier,
    path: &Path,
    facets: &[Facet],
    format: Format,
) -> Result<Verdict, DocumentError> {
    let unreadable = |problem: &str| DocumentError::unreadable(path, problem);
    let target = verifier.target();
    let TargetSpec::Solid(spec) = &target.spec else {
        return Err(unreadable("the target is not a solid"));
    };
    let artifact = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let solid = spec.polyhedron();
    let mut body = BodyVerdict {
        triangles: facets.len(),
        volume_mm3: volume(facets.iter().map(|facet| facet.vertices_mm)),
        seats: 0,
        max_deviation_mm: 0.0,
    };
    let is_skeleton = [stl::skeleton_name(""), threemf::skeleton_name("")]
        .iter()
        .any(|end| artifact.ends_with(end));
    let skeleton = match spec.skeleton.as_ref().filter(|_| is_skeleton) {
        Some(skeleton) => Some((
            Skeleton::new(&solid, skeleton).map_err(|error| unreadable(&error.to_string()))?,
            skeleton,
        )),
        None if is_skeleton => return Err(unreadable("the target has no skeleton")),
        None => None,
    };
    let stated = match &skeleton {
        Some((skeleton, _)) => skeleton.triangles_mm.clone(),
        None => solid.triangles_mm(),
    };
    let mut findings = Vec::new();
    if is_other_mesh(facets.len(), stated.len()) {
        findings.extend(other_count(facets.len(), stated.len()));
    } else {
        findings = check_surface(facets);
        let wrong_seats = skeleton.map_or_else(Vec::new, |(skeleton, spec)| {
            check_seats(facets, &solid, &skeleton, spec, &mut body)
        });
        // If a seat is wrong, its triangles would only repeat that finding.
        if wrong_seats.is_empty() {
            check_triangles(facets, &stated, &mut body, &mut findings);
        }
        findings.extend(wrong_seats);
    }
    Ok(Verdict { body: Some(body), ..Verdict::new(path, format, findings) })
}

/// Returns findings unless the surface is closed, in one piece and oriented outwards, and the stated normals are
/// those of the triangles.
fn check_surface(facets: &[Facet]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let vertices: Vec<DVec3> = facets.iter().flat_map(|facet| facet.vertices_mm).collect();
    let indices: Vec<[usize; 3]> =
        (0..facets.len()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let problem = match ClosedMesh::new(&vertices, &indices) {
        Ok((_, false)) => None,
        Ok((_, true)) => Some("it is inside out".to_owned()),
        Err(error) => Some(error.to_string()),
    };
    findings.extend(problem.map(|problem| MeshFinding::Body { problem }.into()));
    // NaN compares as false, so check it separately.
    let wrong = facets.iter().filter(|facet| {
        let [a, b, c] = facet.vertices_mm;
        let off = facet.normal.distance((b - a).cross(c - a).normalize_or_zero());
        off.is_nan() || off > NORMAL_SLACK
    });
    let triangles = wrong.count();
    if triangles > 0 {
        findings.push(MeshFinding::Normals { triangles }.into());
    }
    findings
}

/// Adds findings unless the file has exactly the stated triangles, mm. Triangles may come in any order and begin with
/// any vertex. A wrong volume is reported as a wrong scale, which would otherwise be repeated for every triangle.
fn check_triangles(
    facets: &[Facet],
    stated: &[[DVec3; 3]],
    body: &mut BodyVerdict,
    findings: &mut Vec<Finding>,
) {
    let volume_mm3 = volume(stated.iter().copied());
    if (body.volume_mm3 / volume_mm3 - 1.0).abs() > VOLUME_SLACK {
        let [found, stated] = [body.volume_mm3, volume_mm3].map(|mm3| mm3 / 1e3);
        let scale = (found / stated).cbrt();
        let problem =
            format!("volume of {found:.1} cm³ instead of {stated:.1} cm³ (scale {scale:.4})");
        findings.push(MeshFinding::Body { problem }.into());
        return;
    }
    findings.extend(other_count(facets.len(), stated.len()));
    let middle = |corners: &[DVec3; 3]| (corners.iter().sum::<DVec3>() / 3.0).to_array();
    let places = facets.iter().map(|facet| GeomWithData::new(middle(&facet.vertices_mm), facet));
    let places = RTree::bulk_load(places.collect());
    let deviation = |facet: &Facet, triangle: &[DVec3; 3]| {
        let turned = |turn: usize| {
            let apart = (0..3).map(|i| facet.vertices_mm[(i + turn) % 3].distance(triangle[i]));
            apart.fold(0.0, f64::max)
        };
        (0..3).map(turned).fold(f64::INFINITY, f64::min)
    };
    for (index, triangle) in stated.iter().enumerate() {
        let near = places.nearest_neighbor_iter(middle(triangle)).take(SAME_MIDDLE);
        let nearest = near.map(|near| deviation(near.data, triangle)).fold(f64::INFINITY, f64::min);
        if nearest > MESH_TOLERANCE_MM {
            let [x, y, z] = middle(triangle);
            let problem = format!(
                "triangle {index}, around ({x:.2}, {y:.2}, {z:.2}) mm, is missing; the nearest is off by \
                 {nearest:.3} mm"
            );
            findings.push(MeshFinding::Body { problem }.into());
        } else {
            body.max_deviation_mm = body.max_deviation_mm.max(nearest);
        }
    }
}

/// Returns findings about faces whose ribs, seats and windows do not have the stated depths, mm, found by rays along
/// the inward normal of each face. Counts the seats that agree.
fn check_seats(
    facets: &[Facet],
    solid: &Polyhedron,
    skeleton: &Skeleton,
    spec: &SkeletonSpec,
    body: &mut BodyVerdict,
) -> Vec<Finding> {
    let (thickness, through) = (spec.panel_thickness_mm, spec.panel_thickness_mm + spec.wall_mm);
    let (rib, window) = (skeleton.rib_mm, skeleton.window_mm);
    // Distance from the edges, and the depth there; `None` in the window.
    let felt = [
        (rib / 2.0, Some(0.0)),
        (rib - BESIDE_MM, Some(0.0)),
        (rib + BESIDE_MM, Some(thickness)),
        ((rib + window) / 2.0, Some(thickness)),
        (window - BESIDE_MM, Some(thickness)),
        (window + BESIDE_MM, None),
    ];
    let faces: Vec<(usize, f64, Option<String>)> = (0..solid.faces.len())
        .into_par_iter()
        .map(|face| {
            let corners = solid.corners_mm(face);
            let circle = Incircle::of(&corners);
            let mut most = 0.0f64;
            for (inset, stated) in felt {
                let outline = circle.inset(&corners, inset, -ABOVE_MM);
                let sides = outline.iter().zip(outline.iter().cycle().skip(1));
                for at in sides.flat_map(|(from, to)| POSITIONS.map(|part| from.lerp(*to, part))) {
                    let found = depth(facets, at, -circle.normal) - ABOVE_MM;
                    let off = match stated {
                        Some(stated) => (found - stated).abs(),
                        None => (through - found).max(0.0),
                    };
                    if off > MESH_TOLERANCE_MM {
                        let below = stated.map_or("open".to_owned(), |mm| format!("{mm:.3} mm"));
                        let problem = format!(
                            "face {face}: {inset:.2} mm from its edge, the skeleton has a depth of {found:.3} \
                             mm instead of {below}"
                        );
                        return (face, most, Some(problem));
                    }
                    most = most.max(off);
                }
            }
            (face, most, None)
        })
        .collect();
    let mut findings = Vec::new();
    for (_, off, problem) in faces {
        body.seats += usize::from(problem.is_none());
        body.max_deviation_mm = body.max_deviation_mm.max(off);
        findings.extend(problem.map(|problem| MeshFinding::Body { problem }.into()));
    }
    findings
}

/// Returns the distance along a ray with a unit direction to the first triangle that it hits, mm; infinity if it hits
/// none.
fn depth(facets: &[Facet], from: DVec3, direction: DVec3) -> f64 {
    let meets = facets.iter().filter_map(|facet| {
        let [a, b, c] = facet.vertices_mm;
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a - from) / normal.dot(direction);
        let p = from + direction * t;
        let inside =
            [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (v - u).cross(p - u).dot(normal) >= 0.0);
        (t >= 0.0 && inside).then_some(t)
    });
    meets.fold(f64::INFINITY, f64::min)
}
