//! Texture atlases: all faces of a solid packed in rows on one sheet, and the sides of a plate with boards.

use std::f64::consts::PI;

use glam::DVec2;

use super::board::draw_panel;
use super::{ArtworkError, Sheet};
use crate::Placement;
use deltille_core::targets::{Face, Panel, Target};

/// White gap between two faces, px: wider than the filters of the first mipmap levels reach.
const PADDING_PX: f64 = 16.0;

/// Faces of a solid, or sides of a plate with boards, in one image that serves as the texture of the mesh.
///
/// ```text
///    ╱╲‾‾╱╲‾‾╱      Faces stand alternately upright and upside down in rows. Their margins and the
///   ╱__╲╱__╲╱       padding are white, so that no filter mixes in pixels of another face.
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Resolution, pixels per metre.
    pub px_per_m: u32,
    /// Width and height of the texture, px.
    pub size_px: [u32; 2],
    /// Vertices of each face in the image, mm, in the order of the faces, or of the sides of a plate.
    pub outlines_mm: Vec<Vec<DVec2>>,
    /// Placement of the panel of each face, in the same order.
    placements: Vec<Placement>,
}

impl Atlas {
    /// Lays out faces at a resolution of `px_per_m` pixels per metre. The size of the texture is not limited here.
    pub fn of_faces(faces: &[Face], px_per_m: u32) -> Self {
        let mm_per_px = 1e3 / f64::from(px_per_m);
        let packing = Packing::tightest(faces, PADDING_PX * mm_per_px);
        let placements: Vec<Placement> = packing.placements().collect();
        let placed = faces.iter().zip(&placements);
        let outlines_mm = placed.map(|(face, placement)| {
            face.outline_mm.iter().map(|&p| placement.page_from_panel(p)).collect()
        });
        let outlines_mm = outlines_mm.collect();
        let size_px = (packing.size_mm / mm_per_px).ceil().as_uvec2().to_array();
        Self { px_per_m, size_px, outlines_mm, placements }
    }

    /// Lays out the sides of a plate one above the other: boards with their quiet zones, all the size of the first.
    pub fn of_plate(sides: &[Panel], px_per_m: u32) -> Self {
        let mm_per_px = 1e3 / f64::from(px_per_m);
        let padding = DVec2::splat(PADDING_PX * mm_per_px);
        let [left, lower, right, upper] = sides.first().map_or([0.0; 4], Panel::field_mm);
        let low = DVec2::new(left, lower);
        let plate = DVec2::new(right, upper) - low;
        let step = plate.y + padding.y;
        let all = DVec2::new(plate.x, sides.len() as f64 * step) + DVec2::new(2.0, 1.0) * padding;
        let (mut placements, mut outlines_mm) = (Vec::new(), Vec::new());
        for (index, panel) in sides.iter().enumerate() {
            let a = padding + index as f64 * step * DVec2::Y;
            placements.push(Placement { panel: panel.id, angle_rad: 0.0, origin_mm: a - low });
            let c = a + plate;
            outlines_mm.push(vec![a, DVec2::new(c.x, a.y), c, DVec2::new(a.x, c.y)]);
        }
        let size_px = (all / mm_per_px).ceil().as_uvec2().to_array();
        Self { px_per_m, size_px, outlines_mm, placements }
    }

    /// Returns the width and height of the image, mm: whole numbers of pixels.
    pub fn size_mm(&self) -> DVec2 {
        DVec2::from(self.size_px.map(f64::from)) * (1e3 / f64::from(self.px_per_m))
    }

    /// Draws the faces. `panels` are in the order of the faces.
    ///
    /// # Errors
    /// Returns an error if the family of the tags is unknown or lacks a code.
    pub fn drawn(&self, target: &Target, panels: &[Panel]) -> Result<Sheet, ArtworkError> {
        let mut shapes = Vec::new();
        for (panel, placement) in panels.iter().zip(&self.placements) {
            shapes.extend(draw_panel(target, panel, placement)?);
        }
        let DVec2 { x: width_mm, y: height_mm } = self.size_mm();
        Ok(Sheet { width_mm, height_mm, shapes })
    }
}

/// Faces packed in rows of equal count, alternately upright and upside down. Faces with four or more corners are packed
/// as their bounding rectangles.
pub(super) struct Packing {
    pub size_mm: DVec2,
    /// Rotation of each panel, rad, and position of its origin, mm.
    places: Vec<(f64, DVec2)>,
}

impl Packing {
    /// Returns the packing with the shortest longer side over all numbers of faces per row; `padding` in mm.
    pub(super) fn tightest(faces: &[Face], padding: f64) -> Self {
        let packings = (1..=faces.len()).map(|columns| Self::new(faces, columns, padding));
        let side = |packing: &Self| packing.size_mm.max_element();
        let tightest = packings.min_by(|a, b| side(a).total_cmp(&side(b)));
        tightest.unwrap_or(Self { size_mm: DVec2::ZERO, places: Vec::new() })
    }

    /// Iterates over the placement of each face on the sheet, numbered from 0.
    pub(super) fn placements(&self) -> impl Iterator<Item = Placement> {
        let places = self.places.iter().zip(0..);
        places.map(|(&(angle_rad, origin_mm), panel)| Placement { panel, angle_rad, origin_mm })
    }

    fn new(faces: &[Face], columns: usize, padding: f64) -> Self {
        // The padding is measured perpendicular to slanted edges; the flattest edge determines the gap along a row.
        let shapes: Vec<Vec<DVec2>> = faces.iter().map(packed_shape).collect();
        let triangles = shapes.iter().filter(|shape| shape.len() == 3);
        let slants = triangles.flat_map(|shape| {
            [shape[0], shape[1]].map(|end| {
                let slant = shape[2] - end;
                slant.y / slant.x.hypot(slant.y)
            })
        });
        let gap = padding / slants.fold(1.0, f64::min);
        let height = |shape: &Vec<DVec2>| shape[2].y - shape[0].y;
        let row_height = shapes.iter().map(height).fold(0.0, f64::max);
        let mut packing = Self { size_mm: DVec2::ZERO, places: Vec::with_capacity(faces.len()) };
        let mut last: Option<Vec<DVec2>> = None;
        for (index, shape) in shapes.iter().enumerate() {
            if index.is_multiple_of(columns) {
                packing.size_mm.y += if index == 0 { padding } else { row_height + padding };
                last = None;
            }
            let upright = (index % columns).is_multiple_of(2);
            let turn = if upright { 1.0 } else { -1.0 };
            // The lower edge of an upright face, or the apex of an inverted one, lies at the bottom of the row.
            let lowest = if upright { shape[0].y } else { -shape[2].y };
            let y = packing.size_mm.y - lowest;
            let shape: Vec<DVec2> = shape.iter().map(|&p| turn * p + DVec2::Y * y).collect();
            let left = shape.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
            let x = match &last {
                None => padding - left,
                Some(before) => shift_beside(before, &shape) + gap,
            };
            let shape: Vec<DVec2> = shape.into_iter().map(|p| p + DVec2::X * x).collect();
            let right = shape.iter().map(|p| p.x).fold(0.0, f64::max);
            packing.size_mm.x = packing.size_mm.x.max(right + padding);
            packing.places.push((if upright { 0.0 } else { PI }, DVec2::new(x, y)));
            last = Some(shape);
        }
        packing.size_mm.y += row_height + padding;
        packing
    }
}

/// Returns the outline of a triangle, or the bounding rectangle of another face, starting at its lower-left corner, mm
/// in the panel frame.
fn packed_shape(face: &Face) -> Vec<DVec2> {
    let outline = &face.outline_mm;
    if outline.len() == 3 {
        return outline.clone();
    }
    let low = outline.iter().copied().reduce(DVec2::min).unwrap_or_default();
    let high = outline.iter().copied().reduce(DVec2::max).unwrap_or_default();
    vec![low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)]
}

/// Returns the shift along x, mm, at which `shape` touches `before` from the right.
///
/// The facing outlines of both shapes are straight between their vertices, so the shapes touch at the height of a
/// vertex.
fn shift_beside(before: &[DVec2], shape: &[DVec2]) -> f64 {
    let heights = before.iter().chain(shape).map(|p| p.y);
    let needed = heights.filter_map(|y| {
        let [_, right] = extent_at(before, y)?;
        let [left, _] = extent_at(shape, y)?;
        Some(right - left)
    });
    needed.fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the left and right end of a convex shape at height y; `None` if it does not reach that height.
fn extent_at(shape: &[DVec2], y: f64) -> Option<[f64; 2]> {
    let mut extent: Option<[f64; 2]> = None;
    for i in 0..shape.len() {
        let (a, b) = (shape[i], shape[(i + 1) % shape.len()]);
        if y < a.y.min(b.y) || y > a.y.max(b.y) {
            continue;
        }
        let at = |t: f64| a.x + (b.x - a.x) * t;
        let xs = if a.y == b.y { [a.x, b.x] } else { [at((y - a.y) / (b.y - a.y)); 2] };
        let [left, right] = extent.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
        extent = Some([left.min(xs[0]).min(xs[1]), right.max(xs[0]).max(xs[1])]);
    }
    extent
}
