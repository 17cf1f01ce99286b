//! Checks of a mesh that are independent of the print: its size, its vertices, whether it is
//! closed, and the triangles beside its faces.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::finding::any::Finding;
use crate::finding::mesh::MeshFinding;
use crate::finding::shown::shown;
use crate::mesh::flat_face::{face_outline_mm, front};
use crate::mesh::measures::{self, MESH_TOLERANCE_MM};
use crate::mesh::texels;
use crate::model::mesh::{Model, Triangle};
use crate::verifier::Verifier;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Panel, Target, TargetSpec};

/// Relative tolerance of the resolution of textures: vertices and texture coordinates are rounded.
const TEXEL_SLACK: f64 = 1e-2;

/// The panels of a plate: its sides, or that of the first of several boards.
pub(super) fn sides(target: &Target) -> &[Panel] {
    let count = if target.spec.is_rigid() { target.panels.len() } else { 1 };
    &target.panels[..count.min(target.panels.len())]
}

/// Checks the parts of a plate outside the sides with boards: they must be white and behind all boards.
pub(super) fn beside_boards(model: &Model, sides: &[Panel]) -> Option<Finding> {
    let problem = model.triangles.iter().find_map(|triangle| {
        let heights = |side: &Panel| triangle.vertices_mm.map(|v| side.pose.panel_from_target(v).z);
        if sides.iter().flat_map(heights).any(|z| z > MESH_TOLERANCE_MM) {
            return Some("a part of the plate protrudes in front of the board");
        }
        if sides.iter().any(|side| heights(side).iter().all(|z| z.abs() <= MESH_TOLERANCE_MM)) {
            return None;
        }
        let (texture, size) = model.texture(triangle);
        let [a, b, c] = triangle.uv.map(|uv| uv * size - 0.5);
        let is_one = a.distance(b) + a.distance(c) < 1e-6;
        let is_white = is_one && texture.bilinear(a.x, a.y) > 254.5;
        (!is_white).then_some("a side or the back of the plate is not white")
    });
    problem.map(|problem| MeshFinding::Body { problem: problem.to_owned() }.into())
}

/// Returns the ratio of the largest distance from the origin on the mesh to that on the target's solid, and the
/// latter, mm.
pub(super) fn scale(verifier: &Verifier, model: &Model) -> Option<(f64, f64)> {
    let TargetSpec::Solid(spec) = &verifier.target().spec else { return None };
    let radius = |lengths: &mut dyn Iterator<Item = f64>| lengths.fold(0.0, f64::max);
    let stated = radius(&mut spec.polyhedron().vertices_mm.iter().map(|v| v.length()));
    let vertices = model.triangles.iter().flat_map(|triangle| triangle.vertices_mm);
    let found = radius(&mut vertices.map(|v| v.length()));
    Some((found / stated, stated))
}

/// Checks a mesh beside its faces: triangles of a solid that lie on no face or are in a different order, textures of
/// different resolutions, and ink in a texture that no triangle shows.
pub(super) fn not_on_faces(verifier: &Verifier, model: &Model) -> Option<Finding> {
    let body = |problem: String| Some(MeshFinding::Body { problem }.into());
    let panels = match &verifier.target().spec {
        TargetSpec::Solid(_) => verifier.target().panels.as_slice(),
        _ => sides(verifier.target()),
    };
    let on_face = |panel: &Panel| front(model, panel, &face_outline_mm(verifier, panel));
    let fronts: Vec<&Triangle> =
        panels.iter().flat_map(on_face).map(|front| front.triangle).collect();
    let (on_faces, all) = (fronts.len(), model.triangles.len());
    if on_faces != all && matches!(verifier.target().spec, TargetSpec::Solid(_)) {
        return body(format!("{on_faces} of {all} triangles lie on the faces"));
    }
    if !fronts.iter().zip(&model.triangles).all(|(front, next)| std::ptr::eq(*front, next)) {
        return body("triangles in a different order than the faces".to_owned());
    }
    let texels = || fronts.iter().map(|triangle| model.texel_mm(triangle));
    let (finest, coarsest) = (texels().fold(f64::INFINITY, f64::min), texels().fold(0.0, f64::max));
    if coarsest > (1.0 + TEXEL_SLACK) * finest {
        return body(format!(
            "textures with different pixel sizes: {finest:.4} to {coarsest:.4} mm"
        ));
    }
    let [texture, column, row] = texels::hidden(model)?;
    body(format!(
        "ink at column {column}, row {row} of texture {}, in an area that no face shows",
        texture + 1
    ))
}

/// Checks the surface if everything on it is right: its vertices, and that it is closed.
pub(super) fn wrong_surface(verifier: &Verifier, model: &Model) -> Option<Finding> {
    let stated: Vec<DVec3> = match &verifier.target().spec {
        TargetSpec::Solid(spec) => spec.polyhedron().vertices_mm,
        spec if spec.is_on_plate() => {
            plate_vertices(verifier.target().panels.first()?, spec.two_sided_mm(), model)
        }
        _ => return None,
    };
    let body = |problem: String| Some(MeshFinding::Body { problem }.into());
    let index_of =
        |place: DVec3| stated.iter().position(|stated| stated.distance(place) <= MESH_TOLERANCE_MM);
    let mut edges = BTreeSet::new();
    for triangle in &model.triangles {
        let mut corners = [0; 3];
        for (corner, place) in corners.iter_mut().zip(triangle.vertices_mm) {
            let Some(index) = index_of(place) else {
                let DVec3 { x, y, z } = place;
                return body(format!(
                    "unexpected vertex at ({}, {}, {}) mm",
                    shown(x),
                    shown(y),
                    shown(z)
                ));
            };
            *corner = index;
        }
        let [a, b, c] = corners;
        for edge in [[a, b], [b, c], [c, a]] {
            if edge[0] == edge[1] || !edges.insert(edge) {
                return body("triangles that overlap, or have no area".to_owned());
            }
        }
    }
    let is_open = edges.iter().any(|&[a, b]| !edges.contains(&[b, a]));
    if is_open {
        return body("the surface is open".to_owned());
    }
    let triangles = model.triangles.iter().map(|triangle| triangle.vertices_mm);
    let volume = measures::volume(triangles);
    let least = match &verifier.target().spec {
        TargetSpec::Solid(spec) => measures::volume(spec.polyhedron().triangles_mm().into_iter()),
        _ => {
            let [a, b, _, d, e, ..] = stated[..] else { return None };
            a.distance(b) * a.distance(d) * a.distance(e)
        }
    };
    ((volume / least - 1.0).abs() > VOLUME_SLACK).then(|| {
        let problem = format!("a volume of {:.2} cm³ instead of {:.2}", volume / 1e3, least / 1e3);
        MeshFinding::Body { problem }.into()
    })
}

/// Relative tolerance of a volume: that of vertices displaced within their tolerance, on the smallest bodies.
const VOLUME_SLACK: f64 = 0.1;

/// Returns the vertices of the plate of a board: the corners of its field, and those behind them by its thickness.
fn plate_vertices(panel: &Panel, thickness_mm: Option<f64>, model: &Model) -> Vec<DVec3> {
    let front = rectangle(panel.field_mm()).map(|corner| panel.pose.target_from_panel(corner));
    let vertices = model.triangles.iter().flat_map(|triangle| triangle.vertices_mm);
    let depth = vertices.map(|v| -panel.pose.panel_from_target(v).z).fold(0.0, f64::max);
    let depth = thickness_mm.unwrap_or(depth);
    let behind = front.map(|place| place - depth * panel.pose.matrix().z_axis);
    front.into_iter().chain(behind).collect()
}
