//! A virtual camera in front of a face.

use glam::{DVec2, DVec3};

use crate::model::mesh::Model;
use crate::model::view::View;
use crate::verifier::Verifier;
use deltille_core::camera::{Camera, Pose};
use deltille_core::targets::Panel;
use deltille_files::export::mesh::{MIN_TEXELS_PER_BIT, UNTAGGED_CELLS};

/// Tolerance of a corner of a neighbouring face seen at a grazing angle, mm: less than half a tile
/// of any board that can be detected at such an angle.
pub(super) const GRAZING_TOLERANCE_MM: f64 = 1.0;

/// Largest size of a texture pixel that widens the tolerance, px of the image: coarser textures are never written.
pub(super) const MAX_TEXEL_PX: f64 = CELL_PX / MIN_TEXELS_PER_BIT;

/// Edge of a tag cell in the image, px.
const CELL_PX: f64 = 8.0;

/// Longest side of an image, px.
const MAX_SIDE_PX: f64 = 4000.0;

/// Distance of the camera in radii of the face, and its sideways offset, so that it sees the face at an angle of 11°,
/// where depth matters.
const DISTANCE: f64 = 6.0;
const ASIDE: f64 = 1.2;

/// Roll of the camera, 15°: no edge of a triangle or square runs along rows or columns of pixels,
/// where sampling would make it a staircase.
const ROLL_RAD: f64 = std::f64::consts::PI / 12.0;

/// Returns a camera in front of the stated position of a face, on a side from which nothing hides the face, if there
/// is one.
pub(super) fn view(verifier: &Verifier, model: &Model, panel: &Panel) -> (View, f64) {
    let centre = panel.middle_mm();
    let corners = || panel.corners.iter().map(|c| c.target_mm);
    let radius = corners().map(|c| c.distance(centre)).fold(0.0, f64::max) + 2.0 * panel.edge_mm;
    let family = verifier.family().and_then(|family| family.of_tiling(panel.kind));
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
