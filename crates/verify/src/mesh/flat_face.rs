//! The texture of a mesh face, drawn flat as seen from its front, so that the face can be compared like a printed
//! page.

use glam::{DVec2, DVec3};

use crate::document::page::Page;
use crate::model::mesh::{Model, Triangle};
use crate::model::samples::{SAMPLES, for_each_sample, pixels};
use crate::verifier::Verifier;
use deltille_core::polygon;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Panel, TargetSpec};
use deltille_layout::Placement;

/// Largest distance of the triangles of a face from the plane of its panel, and of their corners from its outline,
/// mm.
const IN_PLANE_MM: f64 = 0.25;

/// A triangle on the front of a face.
pub(super) struct Front<'a> {
    pub triangle: &'a Triangle,
    /// Its corners in the panel frame, mm: replaced by those of the face where they are close.
    pub flat: [DVec2; 3],
}

/// Returns the triangles of a mesh that lie on a face and are visible from its front. `outline` is that of the face,
/// counter-clockwise in the panel frame, mm.
pub(super) fn front<'a>(model: &'a Model, panel: &Panel, outline: &[DVec2]) -> Vec<Front<'a>> {
    let sides = || outline.iter().zip(outline.iter().cycle().skip(1));
    let is_in = |p: DVec2| {
        sides()
            .all(|(&from, &to)| (to - from).normalize_or_zero().perp_dot(p - from) >= -IN_PLANE_MM)
    };
    let front = model.triangles.iter().filter_map(|triangle| {
        let flat = triangle.vertices_mm.map(|v| panel.pose.panel_from_target(v));
        let is_level = flat.iter().all(|p| p.z.abs() <= IN_PLANE_MM);
        let flat = flat.map(DVec3::truncate);
        let is_front = polygon::area(&flat) > 0.0 && flat.iter().all(|&p| is_in(p));
        let corner = |p: DVec2| {
            let corner = outline.iter().find(|corner| corner.distance(p) <= IN_PLANE_MM);
            corner.copied().unwrap_or(p)
        };
        (is_level && is_front).then(|| Front { triangle, flat: flat.map(corner) })
    });
    front.collect()
}

/// Returns the texture of a loaded mesh on the face of a panel, seen from its front, as a page, and the placement of
/// the panel on that page. The page is white where no triangle lies on the face.
///
/// `area_mm` contains the left, lower, right and upper bound of the page in the panel frame; `px_per_mm` is its
/// resolution.
pub(super) fn face_page(
    model: &Model,
    panel: &Panel,
    front: &[Front],
    area_mm: [f64; 4],
    px_per_mm: f64,
) -> (Page, Placement) {
    let [left, lower, right, upper] = area_mm;
    let (width_mm, height_mm) = (right - left, upper - lower);
    let [width, height] =
        [width_mm, height_mm].map(|mm| (mm * px_per_mm).ceil().max(1.0) as usize * SAMPLES);
    let scale = px_per_mm * SAMPLES as f64;
    let mut shades = vec![u8::MAX; width * height];
    // Size of the largest texture pixel, px of the page: it smears edges by the same amount.
    let mut texel_px = 0.0f64;
    for Front { triangle, flat } in front {
        // In samples of the page, with centres at integers; y points down there and up on the panel.
        let corners = flat.map(|p| DVec2::new(p.x - left, upper - p.y) * scale - 0.5);
        let (texture, size) = model.texture(triangle);
        texel_px = texel_px.max(model.texel_mm(triangle) * px_per_mm);
        let texels = triangle.uv.map(|uv| (uv * size - 0.5).to_array());
        for_each_sample(corners, texels, [width, height], |at, [u, v]| {
            shades[at] = (texture.bilinear(u, v) + 0.5) as u8;
        });
    }
    let image = pixels(&shades, width);
    let (smear_px, left_px) = (1.0 + texel_px, 0.0);
    let page = Page { width_mm, height_mm, px_per_mm, image, smear_px, texel_px, left_px };
    (page, Placement { panel: panel.id, angle_rad: 0.0, origin_mm: DVec2::new(-left, -lower) })
}

/// Returns the outline of a panel's face, or of the side of a plate, counter-clockwise in the panel frame, mm.
pub(super) fn face_outline_mm(verifier: &Verifier, panel: &Panel) -> Vec<DVec2> {
    let of_plate = || rectangle(panel.field_mm()).to_vec();
    let TargetSpec::Solid(spec) = &verifier.target().spec else { return of_plate() };
    let solid = spec.polyhedron();
    let index = verifier.target().panels.iter().position(|p| p.id == panel.id);
    let Some(index) = index.filter(|&index| index < solid.faces.len()) else {
        return of_plate();
    };
    let corners = solid.corners_mm(index).into_iter();
    corners.map(|v| panel.pose.panel_from_target(v).truncate()).collect()
}
