//! Verification of two bodies for 3D printing, as 3MF. Both must be closed, with the black one inlaid in the white
//! one; their common surface is compared like a printed page, face by face. A skeleton is a single body, see
//! [`super::shape`].
//!
//! Vertices lie on a face, below it on the floor of the inlay, or on the back of a plate; triangles
//! are parallel or perpendicular to the face. The outline visible on the surface is therefore the
//! outline of the bodies at every depth, and volumes follow from areas.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::body::shape;
use crate::document::page::Page;
use crate::finding::any::Finding;
use crate::finding::mesh::MeshFinding;
use crate::mesh::measures;
use crate::model::stl::Facet;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::names::file_name;
use crate::reading::reader::Reader;
use crate::sheet::face_picture::FacePicture;
use crate::sheet::whole;
use crate::syntax::inspect;
use crate::verdict::{InlayVerdict, SheetVerdict, Verdict};
use crate::verifier::Verifier;
use deltille_core::polygon;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Panel, TargetSpec};
use deltille_files::export::inlay::Body;
use deltille_files::export::threemf;
use deltille_layout::SheetLayout;

/// Tolerance of coordinates, mm: they are written as decimals with nine digits after the point.
const SLACK_MM: f64 = 1e-5;

/// Relative tolerance of areas and volumes.
const RELATIVE_SLACK: f64 = 1e-6;

/// Largest fraction of a pixel that both bodies, or neither, may cover: a thousandth of a millimetre along its side.
const MAX_BESIDE: f32 = 0.01;

type Triangle = [DVec3; 3];

/// A face with a board.
struct Face<'a> {
    panel: &'a Panel,
    /// Outline of the face, counter-clockwise in the panel frame, mm.
    outline: Vec<DVec2>,
}

/// Reads a 3MF and compares it with the target. The file name determines whether it is a board, a
/// solid or a skeleton.
///
/// # Errors
///
/// Returns an error if the file cannot be read or the target does not have these bodies. Deviations are findings of
/// the verdict.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
) -> Result<Verdict, DocumentError> {
    let is_skeleton = file_name(path).ends_with(&threemf::skeleton_name(""));
    let names = if is_skeleton { threemf::SKELETON } else { threemf::INLAY };
    let (refused, bodies) = inspect::bodies(reader, path, names, &verifier.printing)?;
    match <[Body; 2]>::try_from(bodies) {
        _ if !refused.is_empty() => Ok(Verdict::new(path, Format::ThreeMf, refused)),
        Ok(bodies) => inlaid(verifier, path, &bodies),
        Err(bodies) => skeleton(verifier, path, &bodies),
    }
}

/// Compares the body of a skeleton.
fn skeleton(verifier: &Verifier, path: &Path, bodies: &[Body]) -> Result<Verdict, DocumentError> {
    if let Some(problem) = bodies.iter().find_map(not_closed) {
        return Ok(Verdict::new(path, Format::ThreeMf, vec![MeshFinding::Body { problem }.into()]));
    }
    let facets = bodies.iter().flat_map(triangles_of).map(|vertices_mm| {
        let [a, b, c] = vertices_mm;
        Facet { normal: (b - a).cross(c - a).normalize_or_zero(), vertices_mm }
    });
    shape::compare(verifier, path, &facets.collect::<Vec<_>>(), Format::ThreeMf)
}

/// Compares a white and a black body with the board or the solid of a target.
fn inlaid(verifier: &Verifier, path: &Path, bodies: &[Body; 2]) -> Result<Verdict, DocumentError> {
    let faces = faces(verifier).ok_or_else(|| {
        DocumentError::unreadable(path, "the target is neither a board nor a solid")
    })?;
    let triangles = bodies.each_ref().map(triangles_of);
    let [white_mm3, black_mm3] =
        triangles.each_ref().map(|triangles| measures::volume(triangles.iter().copied()));
    let fronts: Vec<[Vec<[DVec2; 3]>; 2]> = (faces.par_iter())
        .map(|face| triangles.each_ref().map(|triangles| face.front(triangles)))
        .collect();
    let black_mm2: f64 = fronts.iter().map(|[_, black]| area(black)).sum();
    let plate = match &verifier.target().spec {
        spec if spec.is_on_plate() => {
            let depths =
                triangles[0].iter().flatten().map(|&v| -faces[0].panel.pose.panel_from_target(v).z);
            Some(depths.fold(0.0, f64::max))
        }
        _ => None,
    };
    let inlay = InlayVerdict {
        triangles: triangles.iter().map(Vec::len).sum(),
        inlay_mm: black_mm3 / black_mm2,
        plate_mm: plate,
        white_mm3,
        black_mm3,
    };
    let closed = ["white", "black"].into_iter().zip(bodies).filter_map(|(name, body)| {
        not_closed(body).map(|problem| format!("{name} body: {problem}"))
    });
    let problem = closed
        .chain(wrong_shape(&faces, &triangles, &inlay))
        .chain(not_filled(verifier, &faces, &fronts, &inlay))
        .next();
    if let Some(problem) = problem {
        return Ok(Verdict::new(path, Format::ThreeMf, vec![MeshFinding::Body { problem }.into()]));
    }
    let done = AtomicUsize::new(0);
    let sheets: Vec<SheetVerdict> = (faces.par_iter().zip(&fronts).enumerate())
        .map(|(index, (face, fronts))| {
            let (page, layout, problem) = surface(verifier, face, fronts);
            let problem = problem.map(|problem| MeshFinding::Body { problem }.into());
            let mut sheet = SheetVerdict::new(index, &page, problem.into_iter().collect());
            whole::compare(verifier, &page, &layout, &mut sheet);
            verifier.report_progress(done.fetch_add(1, Ordering::Relaxed) + 1, faces.len());
            sheet
        })
        .collect();
    let mut verdict = Verdict::new(path, Format::ThreeMf, Vec::<Finding>::new());
    verdict.passed = sheets.iter().all(|sheet| sheet.findings.is_empty());
    Ok(Verdict { sheets, inlay: Some(inlay), ..verdict })
}

fn triangles_of(body: &Body) -> Vec<Triangle> {
    let places = |triangle: &[usize; 3]| triangle.map(|vertex| body.vertices_mm[vertex]);
    body.triangles.iter().map(places).collect()
}

/// Returns the faces of a target that is one board or a solid.
fn faces<'a>(verifier: &'a Verifier) -> Option<Vec<Face<'a>>> {
    let panels = &verifier.target().panels;
    match (&verifier.target().spec, panels.as_slice()) {
        (spec, [panel]) if spec.is_on_plate() => {
            Some(vec![Face { panel, outline: rectangle(panel.field_mm()).to_vec() }])
        }
        (TargetSpec::Solid(spec), _) => {
            let solid = spec.polyhedron();
            let outlines = (0..solid.faces.len()).map(|face| solid.corners_mm(face));
            let faces = outlines.zip(panels).map(|(corners, panel)| {
                let flat = |corner| panel.pose.panel_from_target(corner).truncate();
                Face { panel, outline: corners.into_iter().map(flat).collect() }
            });
            Some(faces.collect())
        }
        _ => None,
    }
}

impl Face<'_> {
    /// Whether a point lies within the outline.
    fn is_in(&self, point: DVec2) -> bool {
        let next = self.outline.iter().cycle().skip(1);
        self.outline
            .iter()
            .zip(next)
            .all(|(&from, &to)| (to - from).normalize_or_zero().perp_dot(point - from) >= -SLACK_MM)
    }

    /// Returns the triangles of the face that point outwards, in its frame.
    fn front(&self, triangles: &[Triangle]) -> Vec<[DVec2; 3]> {
        let flat =
            triangles.iter().map(|triangle| triangle.map(|v| self.panel.pose.panel_from_target(v)));
        let level = flat.filter(|triangle| triangle.iter().all(|v| v.z.abs() <= SLACK_MM));
        let fronts = level.map(|triangle| triangle.map(DVec3::truncate)).filter(|corners| {
            polygon::area(corners) > 0.0 && corners.iter().all(|&corner| self.is_in(corner))
        });
        fronts.collect()
    }

    /// Whether a triangle lies on this face or below it at one of these depths, is parallel or
    /// perpendicular to it, and has a nonzero area.
    fn has(&self, triangle: &Triangle, depths_mm: &[f64]) -> bool {
        let flat = triangle.map(|v| self.panel.pose.panel_from_target(v));
        let is_near = |v: DVec3| {
            let at_depth = |depth: &f64| (v.z + depth).abs() <= SLACK_MM;
            depths_mm.iter().any(at_depth) && self.is_in(v.truncate())
        };
        if !flat.into_iter().all(is_near) {
            return false;
        }
        let [a, b, c] = flat;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let is_level = (a.z - b.z).abs() <= SLACK_MM && (b.z - c.z).abs() <= SLACK_MM;
        let across = polygon::area(&flat.map(DVec3::truncate)).abs();
        let is_upright = across <= SLACK_MM * longest;
        (b - a).cross(c - a).length() > SLACK_MM * longest && (is_level != is_upright)
    }
}

/// Returns why a body is not closed: every edge must have one triangle on either side.
fn not_closed(body: &Body) -> Option<String> {
    let mut edges = BTreeSet::new();
    for &[a, b, c] in &body.triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            if edge[0] == edge[1] || !edges.insert(edge) {
                return Some("triangles that overlap, or have no area".to_owned());
            }
        }
    }
    let is_open = edges.iter().any(|&[a, b]| !edges.contains(&[b, a]));
    is_open.then(|| "the surface is open".to_owned())
}

/// Returns a triangle that is neither on a face nor a wall or the floor of an inlay.
fn wrong_shape(
    faces: &[Face],
    triangles: &[Vec<Triangle>; 2],
    inlay: &InlayVerdict,
) -> Option<String> {
    let depths = [
        [0.0, inlay.inlay_mm].into_iter().chain(inlay.plate_mm).collect(),
        vec![0.0, inlay.inlay_mm],
    ];
    let bodies = ["white", "black"].into_iter().zip(triangles.iter().zip(depths));
    bodies.into_iter().find_map(|(name, (triangles, depths))| {
        let is_wrong = |triangle: &&Triangle| !faces.iter().any(|face| face.has(triangle, &depths));
        let wrong = triangles.par_iter().find_first(is_wrong)?;
        let [x, y, z] = (wrong.iter().sum::<DVec3>() / 3.0).to_array();
        Some(format!(
            "{name} body: a triangle around ({x:.2}, {y:.2}, {z:.2}) mm that is not on a face, a wall or the \
             floor of the inlay"
        ))
    })
}

/// Checks that the bodies together fill the faces and the whole volume.
fn not_filled(
    verifier: &Verifier,
    faces: &[Face],
    fronts: &[[Vec<[DVec2; 3]>; 2]],
    inlay: &InlayVerdict,
) -> Option<String> {
    let same = |found: f64, stated: f64| (found / stated - 1.0).abs() <= RELATIVE_SLACK;
    for (face, [white, black]) in faces.iter().zip(fronts) {
        let (found, stated) = (area(white) + area(black), polygon::area(&face.outline));
        if !same(found, stated) {
            let [found, stated] = [found, stated].map(|mm2| mm2 / 1e2);
            return Some(format!("the bodies cover {found:.2} cm² of a face of {stated:.2} cm²"));
        }
    }
    let stated = match (&verifier.target().spec, inlay.plate_mm) {
        (TargetSpec::Solid(spec), _) => {
            measures::volume(spec.polyhedron().triangles_mm().into_iter())
        }
        (_, plate_mm) => polygon::area(&faces[0].outline) * plate_mm.unwrap_or_default(),
    };
    let found = inlay.white_mm3 + inlay.black_mm3;
    let [white, black, whole] = [inlay.white_mm3, inlay.black_mm3, stated].map(|mm3| mm3 / 1e3);
    (!same(found, stated)).then(|| {
        format!("{white:.2} cm³ white and {black:.2} cm³ black instead of {whole:.2} cm³ in total")
    })
}

/// Returns the area of triangles, mm².
fn area(triangles: &[[DVec2; 3]]) -> f64 {
    triangles.iter().map(|corners| polygon::area(corners)).sum()
}

/// Returns a face as a page, its expected appearance, and the pixels that both bodies or neither of
/// them cover.
fn surface(
    verifier: &Verifier,
    face: &Face,
    [white, black]: &[Vec<[DVec2; 3]>; 2],
) -> (Page, SheetLayout, Option<String>) {
    let picture = FacePicture::new(verifier, face.panel, &face.outline);
    let dark = || black.iter().map(|corners| (corners.as_slice(), 1.0));
    let both = white.iter().map(|corners| (corners.as_slice(), 1.0)).chain(dark());
    let beside = picture.covered(both.chain([(face.outline.as_slice(), -1.0)]));
    let worst = beside.pixels().iter().position(|part| part.abs() > MAX_BESIDE);
    let problem = worst.map(|index| {
        let [x, y] = picture.place(index).to_array();
        let id = face.panel.id;
        format!("the bodies overlap, or leave a gap, around ({x:.2}, {y:.2}) mm on board {id}")
    });
    let (page, layout) = picture.inked(dark());
    (page, layout, problem)
}
