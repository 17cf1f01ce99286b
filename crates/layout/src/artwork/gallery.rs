//! Sheets that show single tags with their ids.

use glam::DVec2;
use kurbo::{Affine, Point};

use super::board::{polygon, tag_outlines};
use super::{Paint, Part, Shape, Sheet, text};
use deltille_core::family::Family;
use deltille_core::lattice::{ROW_HEIGHT, TagCells};

/// Layout of a gallery of tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GalleryTile {
    /// Length of a tag's edge, mm.
    pub edge_mm: f64,
    /// Black border of a tag, in bit-widths along the edge.
    pub border_bits: f64,
    /// Number of tags in a row.
    pub columns: usize,
}

impl Default for GalleryTile {
    fn default() -> Self {
        Self { edge_mm: 30.0, border_bits: 1.5, columns: 5 }
    }
}

/// Size of the text (em), in edge lengths.
const TEXT: f64 = 0.13;
/// Space between two tags, and around all of them, in edge lengths.
const GAP: f64 = 0.25;

/// Draws the tags `ids` of a family, each with its id below, on a sheet of exactly the required size, mm.
///
/// Ids that the family does not contain are skipped; the caller should check them first. Tags are always drawn as
/// triangles.
///
/// # Errors
/// Returns an error if the font lacks a character of an id. The built-in font has all digits.
pub fn tag_gallery(
    family: &Family,
    ids: &[u32],
    style: GalleryTile,
) -> Result<Sheet, text::MissingGlyph> {
    let GalleryTile { edge_mm, border_bits, columns } = style;
    let cells = TagCells::new(family.dimension());
    let known: Vec<_> = ids.iter().filter_map(|&id| Some((id, family.code(id)?))).collect();
    let columns = columns.clamp(1, known.len().max(1));
    let rows = known.len().div_ceil(columns);
    let (gap, size) = (GAP * edge_mm, TEXT * edge_mm);
    let pitch = [edge_mm + gap, ROW_HEIGHT * edge_mm + 1.8 * size + gap];
    let height_mm = rows as f64 * pitch[1] + gap;

    let mut shapes = Vec::new();
    for (index, (id, word)) in known.into_iter().enumerate() {
        let x = gap + (index % columns) as f64 * pitch[0];
        let y = height_mm - (index / columns + 1) as f64 * pitch[1] + 1.8 * size;
        let place = |DVec2 { x: u, y: v }: DVec2| {
            Point::new(x + (u + v / 2.0) * edge_mm, y + v * ROW_HEIGHT * edge_mm)
        };
        let mut path = polygon([DVec2::ZERO, DVec2::X, DVec2::Y].map(place));
        for outline in tag_outlines(&cells, word, border_bits) {
            path.extend(polygon(outline.into_iter().map(place)));
        }
        let part = Part::Tile { panel: 0, row: 0, col: id as i32 };
        shapes.push(Shape { part, paint: Paint::Fill, path });

        let (glyphs, width) = text::outline(&id.to_string(), size)?;
        let path = Affine::translate((x + (edge_mm - width) / 2.0, y - 1.3 * size)) * glyphs;
        shapes.push(Shape { part: Part::Label { index }, paint: Paint::Fill, path });
    }
    Ok(Sheet { width_mm: columns as f64 * pitch[0] + gap, height_mm, shapes })
}
