//! Verification of meshes of solids: every face is rendered by a virtual camera, and every detected
//! corner is projected back onto the mesh.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::board::{BoardFinding, MATCH_EDGES, detect_alone, outline_alone, wrong_tones};
use super::face_page::{face_page, front};
use super::finding::shown;
use super::fit::AffineMap;
use super::marks::named;
use super::model::{Model, Triangle, View};
use super::texels::{self, Texels};
use super::tiles::{Pattern, PlacedPanel, TagLooks, expected};
use super::{FaceVerdict, Finding, Format, Verdict, Verifier};
use deltille_core::camera::{Camera, Pose};
use deltille_core::detection::Detection;
use deltille_core::lattice::Vertex;
use deltille_core::polygon::rectangle;
use deltille_core::raster::Gray;
use deltille_core::targets::{Corner, Panel, TagPlacement, Target, TargetSpec};
use deltille_core::words::counted;
use deltille_files::export::mesh::{LEAST_TEXELS_PER_BIT, PLATE_TRIANGLES, UNTAGGED_CELLS};

/// Largest deviation of a corner of a mesh, mm: a tenth of the error of a well glued panel. Of very large tiles, and of coarse
/// textures, it is 0.04 px of the picture, or 0.15 px of the texture.
pub const MESH_TOLERANCE_MM: f64 = 0.05;

/// Deviation of a corner of a neighbouring face, seen at a grazing angle, mm: less than half a
/// tile of any board that is detected so.
const GRAZING_TOLERANCE_MM: f64 = 1.0;

/// How exactly a corner is located in the picture, px: of a board of more than a metre that is more than the tolerance.
const LOCATED_PX: f64 = 0.04;

/// And in pixels of the texture: between two of them it is interpolated, which moves edges along its rows or columns.
const LOCATED_TEXELS: f64 = 0.15;

/// Coarser textures than are made, of so many px of the picture, are allowed no more.
const MOST_TEXEL_PX: f64 = CELL_PX / LEAST_TEXELS_PER_BIT;

/// Edge of a tag's cell in the picture, px.
const CELL_PX: f64 = 8.0;

/// Longest side of a picture, px.
const MAX_SIDE_PX: f64 = 4000.0;

/// Distance of the camera in radii of the face, and its step aside, so that it sees the face at an
/// angle of 11°, where depth matters.
const DISTANCE: f64 = 6.0;
const ASIDE: f64 = 1.2;

/// The camera's roll, 15°: no edge of triangles or squares runs along rows or columns of pixels, where samples would see
/// it in steps.
const ROLL_RAD: f64 = std::f64::consts::PI / 12.0;

/// Tolerance of a unit normal.
const NORMAL_SLACK: f64 = 1e-4;

/// A mesh this much larger or smaller, relative, is not looked at any further.
const MAX_SCALE_ERROR: f64 = 0.05;

/// Relative tolerance of the resolution of textures: vertices and texture coordinates are rounded.
const TEXEL_SLACK: f64 = 1e-2;

/// White around a face in its picture, px.
const AROUND_PX: f64 = 8.0;

/// A mesh with so many times the stated triangles is not looked at any further either.
const MOST_TRIANGLES: usize = 2;

/// A deviation of a mesh or a body to print. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum MeshFinding {
    /// A corner of a mesh is displaced.
    #[error(
        "corner {id} at row {row} col {col} off by ({:.3}, {:.3}, {:.3}) mm",
        shown(by_mm.x), shown(by_mm.y), shown(by_mm.z)
    )]
    CornerOff3d {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Found minus stated position in the target frame.
        by_mm: DVec3,
    },
    /// The surface of a body is not the stated one.
    #[error("{problem}")]
    Body {
        /// The deviation in words.
        problem: String,
    },
    /// Triangles of a mesh have wrong normals.
    #[error("{} with wrong normals", counted(*triangles, "triangle"))]
    Normals {
        /// Number of triangles.
        triangles: usize,
    },
    /// A tag of a mesh is not read, or reads with wrong bits.
    #[error("tag {id} at row {row} col {col} {}", how_read(*errors))]
    TagInexact {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Number of wrong bits; `None` when the tag was not read.
        errors: Option<u32>,
    },
}

/// The reading of a tag in words.
fn how_read(errors: Option<u32>) -> String {
    match errors {
        Some(errors) => format!("read with {}", counted(errors as usize, "wrong bit")),
        None => "not read".to_owned(),
    }
}

/// The finding about a mesh with another number of triangles than stated.
pub(super) fn other_count(found: usize, stated: usize) -> Option<Finding> {
    let problem = || format!("{} instead of {stated}", counted(found, "triangle"));
    (found != stated).then(|| MeshFinding::Body { problem: problem() }.into())
}

/// Whether a mesh has so many triangles that it is another one.
pub(super) fn is_other_mesh(found: usize, stated: usize) -> bool {
    found > MOST_TRIANGLES * stated
}

/// Compares a loaded mesh with the target.
pub(super) fn verify(verifier: &Verifier, path: &Path, model: Model, format: Format) -> Verdict {
    let mut findings = Vec::new();
    let mut faces = Vec::new();
    let scale = scale(verifier, &model);
    if let Some((scale, radius_mm)) = scale
        && (scale - 1.0).abs() * radius_mm > MESH_TOLERANCE_MM
    {
        findings.push(BoardFinding::Scale { panel: verifier.target().panels[0].id, scale }.into());
    }
    let stated = match &verifier.target().spec {
        // As many as the faces have, all of which are looked at: there is nothing else.
        TargetSpec::Solid(spec) => Some(spec.polyhedron().triangles_mm().len()),
        spec if spec.is_on_plate() => {
            findings.extend(beside_boards(&model, sides(verifier.target())));
            Some(PLATE_TRIANGLES)
        }
        _ => None,
    };
    if let Some(stated) = stated {
        let found = model.triangles.len();
        findings.extend(other_count(found, stated));
        if is_other_mesh(found, stated) {
            return Verdict::new(path, format, findings);
        }
    }
    let is_beyond = |uv: &DVec2| uv.cmplt(DVec2::ZERO).any() || uv.cmpgt(DVec2::ONE).any();
    if model.triangles.iter().flat_map(|triangle| &triangle.uv).any(is_beyond)
        || texels::are_shared(&model)
    {
        let problem = "triangles that share a part of a texture, or lie beyond it".to_owned();
        findings.push(MeshFinding::Body { problem }.into());
        return Verdict::new(path, format, findings);
    }
    let wrong = model.triangles.iter().filter(|triangle| {
        let normal = triangle.winding().normalize_or_zero();
        triangle.normals.iter().any(|n| n.distance(normal) > NORMAL_SLACK)
    });
    let wrong = wrong.count();
    if wrong > 0 {
        findings.push(MeshFinding::Normals { triangles: wrong }.into());
    }
    if scale.is_none_or(|(scale, _)| (scale - 1.0).abs() < MAX_SCALE_ERROR) {
        let panels = verifier.target().panels.par_iter();
        let done = AtomicUsize::new(0);
        let check = |panel| {
            let verdict = check_face(verifier, &model, panel);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            verifier.tell(done, verifier.target().panels.len());
            verdict
        };
        faces = panels.map(check).collect();
    }
    if findings.is_empty() && faces.iter().all(|face| face.findings.is_empty()) {
        let surface = wrong_surface(verifier, &model);
        findings.extend(surface.or_else(|| not_on_faces(verifier, &model)));
    }
    let mut verdict = Verdict::new(path, format, findings);
    verdict.passed &= faces.iter().all(|face| face.findings.is_empty());
    Verdict { faces, ..verdict }
}

/// The panels of a plate: its sides, or that of the first of several boards.
fn sides(target: &Target) -> &[Panel] {
    let count = if target.spec.is_rigid() { target.panels.len() } else { 1 };
    &target.panels[..count.min(target.panels.len())]
}

/// What of a plate is on no side with a board, and should be white and behind all of them.
fn beside_boards(model: &Model, sides: &[Panel]) -> Option<Finding> {
    let problem = model.triangles.iter().find_map(|triangle| {
        let heights = |side: &Panel| triangle.vertices_mm.map(|v| side.pose.panel_from_target(v).z);
        if sides.iter().flat_map(heights).any(|z| z > MESH_TOLERANCE_MM) {
            return Some("a part of the plate stands before the board");
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

/// Largest distance from the origin on the mesh over that on the target's solid, and the latter,
/// mm.
fn scale(verifier: &Verifier, model: &Model) -> Option<(f64, f64)> {
    let TargetSpec::Solid(spec) = &verifier.target().spec else { return None };
    let radius = |lengths: &mut dyn Iterator<Item = f64>| lengths.fold(0.0, f64::max);
    let stated = radius(&mut spec.polyhedron().vertices_mm.iter().map(|v| v.length()));
    let vertices = model.triangles.iter().flat_map(|triangle| triangle.vertices_mm);
    let found = radius(&mut vertices.map(|v| v.length()));
    Some((found / stated, stated))
}

/// A camera before a face, from where the target says that it is; on one side of it from where
/// nothing hides the face, if there is one.
fn view(verifier: &Verifier, model: &Model, panel: &Panel) -> (View, f64) {
    let centre = panel.middle_mm();
    let corners = || panel.corners.iter().map(|c| c.target_mm);
    let radius = corners().map(|c| c.distance(centre)).fold(0.0, f64::max) + 2.0 * panel.edge_mm;
    let family = verifier.family.and_then(|family| family.of_tiling(panel.kind));
    let cells = family.map(|family| family.cells().width(panel.tag_inset_bits()));
    let cell_mm = panel.edge_mm / cells.unwrap_or(UNTAGGED_CELLS);
    let px_per_mm = (CELL_PX / cell_mm).min(MAX_SIDE_PX / (2.0 * radius));
    let [x, y, z] = [0, 1, 2].map(|axis| panel.pose.matrix().col(axis));
    let side = (2.0 * radius * px_per_mm).ceil().max(64.0) as u32;
    let from = |aside: DVec3| {
        let eye = centre + radius * (DISTANCE * z + ASIDE * aside);
        let mut camera = Camera::pinhole(side, side, 1.0);
        camera.focal_px = DVec2::splat(px_per_mm * eye.distance(centre));
        let up = ROLL_RAD.cos() * y + ROLL_RAD.sin() * x;
        View { camera, camera_from_target: Pose::looking_at(eye, centre, up) }
    };
    let open = |view: &View| {
        corners().all(|corner| {
            let pixel = view.camera.project(view.camera_from_target.apply(corner));
            let met = pixel.and_then(|pixel| view.meet(model, pixel));
            met.is_some_and(|met| met.distance(corner) < GRAZING_TOLERANCE_MM)
        })
    };
    let first = from(x);
    if open(&first) {
        return (first, px_per_mm);
    }
    let others = [y, -x, -y, DVec3::ZERO].map(from);
    (others.into_iter().find(open).unwrap_or(first), px_per_mm)
}

fn check_face(verifier: &Verifier, model: &Model, panel: &Panel) -> FaceVerdict {
    let (view, px_per_mm) = view(verifier, model, panel);
    let image = view.render(model);
    let detection = match panel.tags.is_empty() {
        true => {
            let outline = outline_alone(panel).into_iter().filter_map(|place| {
                let seen = view.camera_from_target.apply(panel.pose.target_from_panel(place));
                view.camera.project(seen)
            });
            detect_alone(panel, (image.clone(), u8::MAX), &outline.collect::<Vec<_>>())
        }
        false => verifier.detector.detect(&image, "face"),
    };
    let mut verdict = FaceVerdict {
        panel: panel.id,
        px_per_mm,
        corners: panel.corners.len(),
        corners_found: 0,
        tags: panel.tags.len(),
        tags_exact: 0,
        max_deviation_mm: 0.0,
        findings: Vec::new(),
    };
    let seen = seen_corners(verifier, panel, &detection, |pixel| view.meet(model, pixel));
    if !seen.iter().any(|seen| seen.panel.id == panel.id) {
        let mirrored = sees(&verifier.detector.detect(&mirror(image), "mirror"), panel.id);
        let panel = panel.id;
        let finding = if mirrored {
            BoardFinding::Mirrored { panel }
        } else {
            BoardFinding::PanelMissing { panel }
        };
        verdict.findings.push(finding.into());
        return verdict;
    }
    check_corners(model, panel, &seen, &mut verdict);
    let is_off =
        |finding: &Finding| matches!(finding, Finding::Mesh(MeshFinding::CornerOff3d { .. }));
    if verdict.findings.iter().any(is_off) {
        // All other deviations follow from that.
        return verdict;
    }
    check_print(verifier, model, panel, px_per_mm, &mut verdict);
    if !verdict.findings.is_empty() {
        return verdict;
    }
    let own = || detection.grids.iter().filter(|grid| grid.panel == Some(panel.id));
    // Tags at the rim, which have no corner of the board at some of theirs, were compared cell by cell alone.
    let is_read = |tag: &&TagPlacement| {
        panel.tag_tile(tag).vertices().all(|vertex| panel.corner_at(vertex).is_some())
    };
    verdict.tags_exact = panel.tags.len() - panel.tags.iter().filter(is_read).count();
    for tag in panel.tags.iter().filter(is_read) {
        let same = |found: &&deltille_core::detection::DecodedTag| {
            (found.id, found.row, found.col) == (tag.id, tag.row, tag.col)
        };
        let errors = own().flat_map(|grid| &grid.tags).find(same).map(|found| found.errors);
        if errors == Some(0) {
            verdict.tags_exact += 1;
        } else {
            let (id, row, col) = (tag.id, tag.row, tag.col);
            verdict.findings.push(MeshFinding::TagInexact { id, row, col, errors }.into());
        }
    }
    verdict
}

/// Compares the texture on the face, tile by tile and cell by cell, and looks for other marks.
fn check_print(
    verifier: &Verifier,
    model: &Model,
    panel: &Panel,
    px_per_mm: f64,
    verdict: &mut FaceVerdict,
) {
    let outline = verifier.face_outline_mm(panel);
    let front = front(model, panel, &outline);
    // Texels just beside the face are on the page, too.
    let around_mm = DVec2::splat(AROUND_PX / px_per_mm);
    let low = outline.iter().copied().reduce(DVec2::min).unwrap_or_default() - around_mm;
    let high = outline.iter().copied().reduce(DVec2::max).unwrap_or_default() + around_mm;
    let area_mm = [low.x, low.y, high.x, high.y];
    let (mut page, placement) = face_page(model, panel, &front, area_mm, px_per_mm);
    page.texel_px = page.texel_px.min(MOST_TEXEL_PX);
    let placed = PlacedPanel::new(&page, panel, &placement, AffineMap::IDENTITY);
    if let Some(finding) = wrong_tones(&placed) {
        verdict.findings.push(finding);
        return;
    }
    let report = placed.check_tiles(verifier.family);
    verdict.tags_exact = report.tags_exact;
    let on_panel = |place: DVec2| place + low;
    let are_right = report.findings.is_empty();
    let of_tiles = report.findings.into_iter().map(|finding| finding.moved(on_panel).into());
    verdict.findings.extend(of_tiles);
    let family = verifier.family.and_then(|family| family.of_tiling(panel.kind));
    let looks = family.map(|family| TagLooks::new(family, panel));
    let expected = expected(panel, family, looks.as_ref());
    let texels = Texels {
        model,
        panel,
        pattern: &Pattern::new(panel, &expected),
        field: panel.field_outline_mm(),
        fills_face: panel.rim_mm.is_none(),
    };
    match texels.wrong(&front, &page, low, are_right) {
        Ok(wrong) => {
            let spots = named(&page, wrong).into_iter();
            verdict.findings.extend(spots.map(|spot| spot.moved(on_panel).into()));
        }
        Err(problem) => {
            verdict.findings.push(MeshFinding::Body { problem: problem.to_owned() }.into());
        }
    }
}

impl Verifier<'_> {
    /// The outline of a panel's face, or of the side of a plate, counter-clockwise in the panel frame, mm.
    fn face_outline_mm(&self, panel: &Panel) -> Vec<DVec2> {
        let of_plate = || rectangle(panel.field_mm()).to_vec();
        let TargetSpec::Solid(spec) = &self.target().spec else { return of_plate() };
        let solid = spec.polyhedron();
        let index = self.target().panels.iter().position(|p| p.id == panel.id);
        let Some(index) = index.filter(|&index| index < solid.faces.len()) else {
            return of_plate();
        };
        let corners = solid.corners_mm(index).into_iter();
        corners.map(|v| panel.pose.panel_from_target(v).truncate()).collect()
    }
}

/// What is wrong with a mesh beside its faces: triangles of a solid that lie on none of them, or in another order, textures
/// of different resolutions, or ink in a texture that no triangle shows.
fn not_on_faces(verifier: &Verifier, model: &Model) -> Option<Finding> {
    let body = |problem: String| Some(MeshFinding::Body { problem }.into());
    let panels = match &verifier.target().spec {
        TargetSpec::Solid(_) => verifier.target().panels.as_slice(),
        _ => sides(verifier.target()),
    };
    let on_face = |panel: &Panel| front(model, panel, &verifier.face_outline_mm(panel));
    let fronts: Vec<&Triangle> =
        panels.iter().flat_map(on_face).map(|front| front.triangle).collect();
    let (on_faces, all) = (fronts.len(), model.triangles.len());
    if on_faces != all && matches!(verifier.target().spec, TargetSpec::Solid(_)) {
        return body(format!("{on_faces} of {all} triangles lie on the faces"));
    }
    if !fronts.iter().zip(&model.triangles).all(|(front, next)| std::ptr::eq(*front, next)) {
        return body("triangles in another order than that of the faces".to_owned());
    }
    let texels = || fronts.iter().map(|triangle| model.texel_mm(triangle));
    let (finest, coarsest) = (texels().fold(f64::INFINITY, f64::min), texels().fold(0.0, f64::max));
    if coarsest > (1.0 + TEXEL_SLACK) * finest {
        return body(format!("textures of {finest:.4} to {coarsest:.4} mm for a pixel"));
    }
    let [texture, column, row] = texels::hidden(model)?;
    body(format!(
        "ink at column {column}, row {row} of texture {}, which no face shows",
        texture + 1
    ))
}

/// A corner that is seen in the picture of a face.
struct Seen<'a> {
    /// The panel that it is of.
    panel: &'a Panel,
    stated: &'a Corner,
    /// Where it is on the mesh, mm; not a number where its ray misses that.
    at_mm: DVec3,
}

/// The corners in the picture of a face: those of all panels that are labelled, or, where the panel has no tags, those
/// that are near to its own.
fn seen_corners<'a>(
    verifier: &'a Verifier,
    panel: &'a Panel,
    detection: &Detection,
    meet: impl Fn(DVec2) -> Option<DVec3>,
) -> Vec<Seen<'a>> {
    let mut all = Vec::new();
    for grid in &detection.grids {
        let labelled = verifier.target().panels.iter().find(|panel| Some(panel.id) == grid.panel);
        for corner in &grid.corners {
            let at_mm = meet(corner.position()).unwrap_or(DVec3::NAN);
            let stated = match labelled {
                Some(panel) => panel
                    .corner_at(Vertex::new(corner.row, corner.col))
                    .filter(|stated| corner.id == Some(stated.id)),
                None if panel.tags.is_empty() => panel
                    .corners
                    .iter()
                    .find(|stated| stated.target_mm.distance(at_mm) < MATCH_EDGES * panel.edge_mm),
                None => None,
            };
            let panel = labelled.unwrap_or(panel);
            all.extend(stated.map(|stated| Seen { panel, stated, at_mm }));
        }
    }
    all
}

/// Compares every corner with where it should be on the mesh; neighbouring faces in the picture must be where they belong,
/// too.
fn check_corners(model: &Model, panel: &Panel, seen: &[Seen], verdict: &mut FaceVerdict) {
    let mut found = BTreeSet::new();
    let located_mm = LOCATED_PX.max(LOCATED_TEXELS * texel_px(model, panel, verdict.px_per_mm))
        / verdict.px_per_mm;
    for Seen { panel: of, stated, at_mm } in seen {
        let own = of.id == panel.id;
        let tolerance_mm = if own { MESH_TOLERANCE_MM } else { GRAZING_TOLERANCE_MM };
        let tolerance_mm = tolerance_mm.max(located_mm);
        let by_mm = at_mm - stated.target_mm;
        let deviation_mm = by_mm.length();
        if own {
            found.insert(stated.id);
            verdict.max_deviation_mm = verdict.max_deviation_mm.max(deviation_mm);
        }
        // A ray that misses the mesh counts as off.
        if deviation_mm.is_nan() || deviation_mm > tolerance_mm {
            let (id, row, col) = (stated.id, stated.row, stated.col);
            verdict.findings.push(MeshFinding::CornerOff3d { id, row, col, by_mm }.into());
        }
    }
    verdict.corners_found = found.len();
    let missing = panel.corners.iter().filter(|corner| !found.contains(&corner.id));
    let finding = |corner: &Corner| {
        let Corner { id, row, col, .. } = *corner;
        BoardFinding::CornerMissing { id, row, col }.into()
    };
    verdict.findings.extend(missing.map(finding));
}

/// Side of the largest pixel of the texture on the front of a panel, px of a picture of it.
fn texel_px(model: &Model, panel: &Panel, px_per_mm: f64) -> f64 {
    let sides = model.triangles.iter().filter_map(|triangle| {
        let is_front = |v: &DVec3| panel.pose.panel_from_target(*v).z.abs() <= MESH_TOLERANCE_MM;
        triangle.vertices_mm.iter().all(is_front).then(|| model.texel_mm(triangle))
    });
    (sides.fold(0.0, f64::max) * px_per_mm).min(MOST_TEXEL_PX)
}

/// What is wrong with the surface where everything on it is right: its vertices, and that it is closed.
fn wrong_surface(verifier: &Verifier, model: &Model) -> Option<Finding> {
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
                    "a vertex at ({}, {}, {}) mm where the body has none",
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
    let volume = super::body::volume(triangles);
    let least = match &verifier.target().spec {
        TargetSpec::Solid(spec) => {
            super::body::volume(spec.polyhedron().triangles_mm().into_iter())
        }
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

/// Relative tolerance of a volume: that of vertices that are off by what they may, on the smallest bodies.
const VOLUME_SLACK: f64 = 0.1;

/// The vertices of the plate of a board: the corners of its field, and those behind them by the thickness that it has.
fn plate_vertices(panel: &Panel, thickness_mm: Option<f64>, model: &Model) -> Vec<DVec3> {
    let front = rectangle(panel.field_mm()).map(|corner| panel.pose.target_from_panel(corner));
    let vertices = model.triangles.iter().flat_map(|triangle| triangle.vertices_mm);
    let depth = vertices.map(|v| -panel.pose.panel_from_target(v).z).fold(0.0, f64::max);
    let depth = thickness_mm.unwrap_or(depth);
    let behind = front.map(|place| place - depth * panel.pose.matrix().z_axis);
    front.into_iter().chain(behind).collect()
}

fn sees(detection: &Detection, panel: u32) -> bool {
    detection.grids.iter().any(|grid| grid.panel == Some(panel))
}

fn mirror(mut image: Gray<u8>) -> Gray<u8> {
    let width = image.width();
    image.pixels_mut().chunks_exact_mut(width).for_each(<[u8]>::reverse);
    image
}
