//! A face seen by a virtual camera: every detected corner is projected back onto the mesh.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use crate::finding::any::Finding;
use crate::finding::board::BoardFinding;
use crate::finding::mesh::MeshFinding;
use crate::mesh::face_view::{GRAZING_TOLERANCE_MM, MAX_SIDE_PX, MAX_TEXEL_PX, view, windows};
use crate::mesh::measures::MESH_TOLERANCE_MM;
use crate::mesh::print::check_print;
use crate::model::mesh::Model;
use crate::model::view::View;
use crate::panel::alone::{MATCH_EDGES, detect_alone, outline_alone};
use crate::verdict::FaceVerdict;
use crate::verifier::Verifier;
use deltille_core::detection::Detection;
use deltille_core::lattice::Vertex;
use deltille_core::raster::Gray;
use deltille_core::targets::{Corner, Panel, TagPlacement};

/// Accuracy of a corner's position in the image, px; on boards larger than a metre this exceeds the tolerance.
const LOCATED_PX: f64 = 0.04;

/// The same in pixels of the texture: interpolation between two of them moves edges along its rows or columns.
const LOCATED_TEXELS: f64 = 0.15;

pub(super) fn check_face(verifier: &Verifier, model: &Model, panel: &Panel) -> FaceVerdict {
    let (whole, px_per_mm) = view(verifier, model, panel);
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
    let windows = windows(&whole, panel, px_per_mm);
    let detections: Vec<Detection> =
        windows.iter().map(|view| detect(verifier, panel, view, view.render(model))).collect();
    let seen: Vec<Seen> = (windows.iter().zip(&detections))
        .flat_map(|(view, found)| {
            seen_corners(verifier, panel, found, |pixel| view.meet(model, pixel))
        })
        .collect();
    if !seen.iter().any(|seen| seen.panel.id == panel.id) {
        let is_mirrored = |view: &View| {
            sees(&verifier.detector.detect(&mirror(view.render(model)), "mirror"), panel.id)
        };
        let mirrored = windows.iter().any(is_mirrored);
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
        // All other deviations follow from this one.
        return verdict;
    }
    let page_px_per_mm = px_per_mm.min(px_per_mm * MAX_SIDE_PX / f64::from(whole.camera.width));
    check_print(verifier, model, panel, page_px_per_mm, &mut verdict);
    if !verdict.findings.is_empty() {
        return verdict;
    }
    let grids = || detections.iter().flat_map(|detection| &detection.grids);
    let own = || grids().filter(|grid| grid.panel == Some(panel.id));
    // Tags at the rim without board corners at some of their vertices were compared cell by cell only.
    let is_read = |tag: &&TagPlacement| {
        panel.tag_tile(tag).vertices().all(|vertex| panel.corner_at(vertex).is_some())
    };
    verdict.tags_exact = panel.tags.len() - panel.tags.iter().filter(is_read).count();
    for tag in panel.tags.iter().filter(is_read) {
        let same = |found: &&deltille_core::detection::DecodedTag| {
            (found.id, found.row, found.col) == (tag.id, tag.row, tag.col)
        };
        // Of windows, the one that shows most of the tag.
        let errors = own().flat_map(|grid| &grid.tags).filter(same).map(|found| found.errors).min();
        if errors == Some(0) {
            verdict.tags_exact += 1;
        } else {
            let (id, row, col) = (tag.id, tag.row, tag.col);
            verdict.findings.push(MeshFinding::TagInexact { id, row, col, errors }.into());
        }
    }
    verdict
}

/// Detects a face in an image of it.
fn detect(verifier: &Verifier, panel: &Panel, view: &View, image: Gray<u8>) -> Detection {
    if !panel.tags.is_empty() {
        return verifier.detector.detect(&image, "face");
    }
    let outline = outline_alone(panel).into_iter().filter_map(|place| {
        let seen = view.camera_from_target.apply(panel.pose.target_from_panel(place));
        view.camera.project(seen)
    });
    detect_alone(panel, image, u8::MAX, &outline.collect::<Vec<_>>())
}

/// A corner seen in the image of a face.
struct Seen<'a> {
    /// The panel that it belongs to.
    panel: &'a Panel,
    stated: &'a Corner,
    /// Position on the mesh, mm; NaN if its ray misses the mesh.
    at_mm: DVec3,
}

/// Returns the corners in the image of a face: those of all labelled panels, or, for a panel without tags, those near
/// its own.
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
                None if panel.tags.is_empty() => corner_near(panel, at_mm),
                None => None,
            };
            let panel = labelled.unwrap_or(panel);
            all.extend(stated.map(|stated| Seen { panel, stated, at_mm }));
        }
    }
    all
}

/// Returns the corner within [`MATCH_EDGES`] of a position, mm, which is NaN if a ray misses the mesh.
fn corner_near(panel: &Panel, at_mm: DVec3) -> Option<&Corner> {
    let at = panel.pose.panel_from_target(at_mm).truncate() / panel.edge_mm;
    let mut near = panel.tile_at(at).vertices().filter_map(|vertex| panel.corner_at(vertex));
    near.find(|stated| stated.target_mm.distance(at_mm) < MATCH_EDGES * panel.edge_mm)
}

/// Compares every corner with its stated position on the mesh. Neighbouring faces in the image must be at their
/// positions, too.
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
        // A ray that misses the mesh counts as a deviation.
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

/// Returns the size of the largest pixel of the texture on the front of a panel, px of an image of it.
fn texel_px(model: &Model, panel: &Panel, px_per_mm: f64) -> f64 {
    let sides = model.triangles.iter().filter_map(|triangle| {
        let is_front = |v: &DVec3| panel.pose.panel_from_target(*v).z.abs() <= MESH_TOLERANCE_MM;
        triangle.vertices_mm.iter().all(is_front).then(|| model.texel_mm(triangle))
    });
    (sides.fold(0.0, f64::max) * px_per_mm).min(MAX_TEXEL_PX)
}

fn sees(detection: &Detection, panel: u32) -> bool {
    detection.grids.iter().any(|grid| grid.panel == Some(panel))
}

fn mirror(mut image: Gray<u8>) -> Gray<u8> {
    let width = image.width();
    image.pixels_mut().chunks_exact_mut(width).for_each(<[u8]>::reverse);
    image
}
