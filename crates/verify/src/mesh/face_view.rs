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
pub(super) const MAX_SIDE_PX: f64 = 4000.0;

/// Edge of a tag cell, and of a tile without a tag, below which an image of [`MAX_SIDE_PX`] does not show the whole face:
/// smaller cells are misread, smaller tiles are missed where corners are seen at an angle.
const MIN_CELL_PX: f64 = 6.0;
const MIN_EDGE_PX: f64 = 16.0;

/// Number of corners of a panel with and without tags above which it is seen in windows, and the longest side of these,
/// edges. The detector reads some of the tiles of a large grid only, at least 800, and refines up to 20,000 corners.
const MAX_CORNERS: [usize; 2] = [1200, 20_000];
const MAX_SIDE_EDGES: [f64; 2] = [24.0, 120.0];

/// Overlap of the windows of a face, px: corners and tags at the border of one are seen whole in the next. A tile with
/// the largest tag has fewer than 20 cells.
const OVERLAP_PX: f64 = 320.0;

/// Distance of the camera in radii of the face, and its sideways offset, so that it sees the face at an angle of 11°,
/// where depth matters.
const DISTANCE: f64 = 6.0;
const ASIDE: f64 = 1.2;

/// Roll of the camera, 15°: no edge of a triangle or square runs along rows or columns of pixels,
/// where sampling would make it a staircase.
const ROLL_RAD: f64 = std::f64::consts::PI / 12.0;

/// Returns a camera in front of the stated position of a face, on a side from which nothing hides the face, if there
/// is one, and its resolution. Its image may be larger than [`MAX_SIDE_PX`]: see [`windows`].
pub(super) fn view(verifier: &Verifier, model: &Model, panel: &Panel) -> (View, f64) {
    let centre = panel.middle_mm();
    let corners = || panel.corners.iter().map(|c| c.target_mm);
    let radius = corners().map(|c| c.distance(centre)).fold(0.0, f64::max) + 2.0 * panel.edge_mm;
    let family = verifier.family().and_then(|family| family.of_tiling(panel.kind));
    let cells = family.map(|family| family.cells().width(panel.tag_inset_bits()));
    let cell_mm = panel.edge_mm / cells.unwrap_or(UNTAGGED_CELLS);
    let whole = MAX_SIDE_PX / (2.0 * radius);
    let needed = if cells.is_some() { MIN_CELL_PX / cell_mm } else { MIN_EDGE_PX / panel.edge_mm };
    let is_whole = whole >= needed && panel.corners.len() <= MAX_CORNERS[kind(panel)];
    let px_per_mm = match (is_whole, cells) {
        (true, _) => whole.min(CELL_PX / cell_mm),
        (false, Some(_)) => CELL_PX / cell_mm,
        (false, None) => whole.max(needed).min(CELL_PX / cell_mm),
    };
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

/// Returns 0 for a panel with tags, 1 without.
fn kind(panel: &Panel) -> usize {
    usize::from(panel.tags.is_empty())
}

/// Returns the parts of a view that show corners of a panel, of at most [`MAX_SIDE_PX`] and overlapping: the view itself
/// if it is not larger.
pub(super) fn windows(view: &View, panel: &Panel, px_per_mm: f64) -> Vec<View> {
    let side = f64::from(view.camera.width);
    let max_px = match panel.corners.len() <= MAX_CORNERS[kind(panel)] {
        true => MAX_SIDE_PX,
        false => MAX_SIDE_PX.min(MAX_SIDE_EDGES[kind(panel)] * px_per_mm * panel.edge_mm),
    };
    // A side is rounded up.
    if side <= max_px + 1.0 {
        return vec![View { camera: view.camera.clone(), ..*view }];
    }
    let count = ((side - OVERLAP_PX) / (max_px - OVERLAP_PX)).ceil();
    let step = ((side - OVERLAP_PX) / count).ceil();
    let window_px = step + OVERLAP_PX;
    let corners: Vec<DVec2> = (panel.corners.iter())
        .filter_map(|corner| view.camera.project(view.camera_from_target.apply(corner.target_mm)))
        .collect();
    let firsts = (0..count as u32).flat_map(|row| (0..count as u32).map(move |col| (col, row)));
    let parts = firsts.filter_map(|(col, row)| {
        let first = step * DVec2::new(col.into(), row.into());
        let is_in = |at: &DVec2| {
            (*at - first).min_element() >= 0.0 && (*at - first).max_element() < window_px
        };
        let mut camera = view.camera.clone();
        (camera.width, camera.height) = (window_px as u32, window_px as u32);
        camera.centre_px -= first;
        corners.iter().any(is_in).then_some(View { camera, ..*view })
    });
    parts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{BoardSpec, Target};

    /// Each corner of a large board is away from the border of a window.
    #[test]
    fn windows_overlap_at_corners() {
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let spec = BoardSpec { tags: None, ..BoardSpec::new(kind, 200, 230, 1.0) };
            let target = Target::new("large", spec).unwrap();
            let panel = &target.panels[0];
            let middle = panel.middle_mm();
            let camera_from_target =
                Pose::looking_at(middle + DVec3::new(90.0, 0.0, 500.0), middle, DVec3::Y);
            let view = View { camera: Camera::pinhole(12_000, 12_000, 0.8), camera_from_target };
            let windows = windows(&view, panel, 28.0);
            assert!(windows.iter().all(|window| f64::from(window.camera.width) <= MAX_SIDE_PX));
            for corner in &panel.corners {
                let at = camera_from_target.apply(corner.target_mm);
                let is_in = |window: &View| {
                    let pixel = window.camera.project(at).unwrap();
                    window.camera.sees(pixel, OVERLAP_PX / 2.0 - 1.0)
                };
                assert!(windows.iter().any(is_in), "{corner:?}");
            }
        }
    }
}
