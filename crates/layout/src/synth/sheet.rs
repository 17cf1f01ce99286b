use glam::{DQuat, DVec2};
use kurbo::{BezPath, PathEl};

use super::{Scene, Surface};
use crate::artwork::{Paint, Shape, Sheet};
use crate::{Placement, Printing};
use deltille_core::camera::Pose;

/// Maximum deviation of the chords that replace curves of letters, mm.
const FLATTENING_MM: f64 = 0.005;

/// Returns the scene of a printed page, positioned by its first panel.
///
/// All panels of the page must lie in one plane of the target, as those of boards do. The page is one surface with the
/// id of its first panel and the corners of all panels.
pub fn scene_of_sheet(printing: &Printing, sheet: &Sheet, index: usize) -> Scene {
    let placements = printing.sheets.get(index).map_or(&[][..], |layout| &layout.placements);
    let panels = placements.iter().filter_map(|placement| {
        let panel = printing.target.panels.iter().find(|panel| panel.id == placement.panel)?;
        Some((placement, panel))
    });
    let mut surface: Option<Surface> = None;
    for (placement, panel) in panels {
        let surface = surface.get_or_insert_with(|| Surface {
            panel: panel.id,
            target_from_surface: target_from_page(placement, panel),
            paper_mm: rectangle(sheet.width_mm, sheet.height_mm),
            black_mm: black_areas(&sheet.shapes),
            corners: Vec::new(),
        });
        surface.corners.extend(panel.corners.iter().map(|corner| {
            (corner.id, corner.row, corner.col, placement.page_from_panel(corner.panel_mm))
        }));
    }
    Scene { surfaces: surface.into_iter().collect() }
}

fn rectangle(width: f64, height: f64) -> Vec<DVec2> {
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(DVec2::from).to_vec()
}

fn target_from_page(placement: &Placement, panel: &deltille_core::targets::Panel) -> Pose {
    let page_from_panel = Pose {
        rotation: DQuat::from_rotation_z(placement.angle_rad),
        translation: placement.origin_mm.extend(0.0),
    };
    panel.pose.to_pose().after(&page_from_panel.inverse())
}

/// Converts the filled shapes to polygons.
pub(super) fn black_areas(shapes: &[Shape]) -> Vec<Vec<Vec<DVec2>>> {
    shapes
        .iter()
        .filter(|shape| shape.paint == Paint::Fill)
        .map(|shape| polygons(&shape.path))
        .collect()
}

fn polygons(path: &BezPath) -> Vec<Vec<DVec2>> {
    let mut polygons: Vec<Vec<DVec2>> = Vec::new();
    kurbo::flatten(path, FLATTENING_MM, |element| match element {
        PathEl::MoveTo(p) => polygons.push(vec![DVec2::new(p.x, p.y)]),
        PathEl::LineTo(p) => {
            if let Some(polygon) = polygons.last_mut() {
                polygon.push(DVec2::new(p.x, p.y));
            }
        }
        _ => {}
    });
    polygons
}
