//! Shapes of the sheets and pages of a target: tiles with tags, check bars, lines, texts and logos.

use std::collections::BTreeMap;

use glam::DVec2;
use kurbo::{Affine, BezPath, Circle, Point, Rect, Shape as _};

use super::{ArtworkError, Paint, Part, Shape, Sheet, cells, check_bar, strokes_mm, text, window};
use crate::{Logo, Placement, Printing, SheetLayout, SheetLine, SheetPage, SheetText};
use deltille_core::family::Family;
use deltille_core::lattice::{TagCells, Tile};
use deltille_core::targets::{Panel, TagPlacement, TagsIn, Target};

/// Maximum distance between the curves of a disc and a circle, mm.
const DISC_TOLERANCE_MM: f64 = 1e-4;

/// Draws sheet `index` of a target, in the frame of the whole sheet, mm.
pub(super) fn sheet(printing: &Printing, index: usize) -> Result<Sheet, ArtworkError> {
    let (target, layout) = (&printing.target, &printing.sheets[index]);
    let mut shapes = Vec::new();
    for placement in &layout.placements {
        let panel = target.panels.iter().find(|panel| panel.id == placement.panel);
        let panel =
            panel.ok_or(ArtworkError::NoSuchPanel { sheet: index + 1, panel: placement.panel })?;
        shapes.extend(draw_panel(target, panel, placement)?);
    }
    shapes.extend(marks(layout, printing.logo.as_ref())?);
    Ok(Sheet { width_mm: layout.width_mm, height_mm: layout.height_mm, shapes })
}

/// Draws a page that shows part of a sheet, in the frame of the page, mm.
pub(super) fn page(
    sheet: &Sheet,
    printing: &Printing,
    layout: &SheetLayout,
    page: &SheetPage,
) -> Result<Sheet, ArtworkError> {
    let page_from_sheet = Affine::translate((page.sheet_at_mm.x, page.sheet_at_mm.y));
    let [x0, y0, x1, y1] = page.window_mm;
    let in_window = sheet.shapes.iter().filter_map(|shape| {
        let path = page_from_sheet * &shape.path;
        window::clip(Shape { path, ..shape.clone() }, Rect::new(x0, y0, x1, y1))
    });
    let mut shapes: Vec<Shape> = in_window.collect();
    // Indices of the page's own lines, texts and logos continue after those of the sheet.
    let (lines, texts) = (layout.lines.len(), layout.texts.len());
    let logos = layout.logos.len();
    shapes.extend(marks(&page.marks, printing.logo.as_ref())?.into_iter().map(|shape| {
        let part = match shape.part {
            Part::Line { kind, index } => Part::Line { kind, index: index + lines },
            Part::Label { index } => Part::Label { index: index + texts },
            Part::Logo { index } => Part::Logo { index: index + logos },
            part => part,
        };
        Shape { part, ..shape }
    }));
    let SheetLayout { width_mm, height_mm, .. } = page.marks;
    Ok(Sheet { width_mm, height_mm, shapes })
}

/// Draws the check bars, lines, texts and logos of a layout.
fn marks(layout: &SheetLayout, logo: Option<&Logo>) -> Result<Vec<Shape>, ArtworkError> {
    let mut shapes = Vec::new();
    for (index, bar) in layout.check_bars.iter().enumerate() {
        let path = check_bar::outline(bar);
        shapes.push(Shape { part: Part::CheckBar { index }, paint: Paint::Fill, path });
    }
    for (index, line) in drawn_lines(layout) {
        let mut path = BezPath::new();
        for [from, to] in strokes_mm(line) {
            path.move_to((from.x, from.y));
            path.line_to((to.x, to.y));
        }
        let part = Part::Line { kind: line.kind, index };
        shapes.push(Shape { part, paint: Paint::Stroke { width_mm: line.width_mm }, path });
    }
    for (index, label) in layout.texts.iter().enumerate() {
        let path = draw_text(label)?;
        shapes.push(Shape { part: Part::Label { index }, paint: Paint::Fill, path });
    }
    for (index, place) in layout.logos.iter().enumerate() {
        let outlines = logo.into_iter().flat_map(|logo| logo.outlines_mm(place));
        let mut path = BezPath::new();
        for outline in outlines {
            path.extend(polygon(outline.into_iter().map(|p| Point::new(p.x, p.y))));
        }
        shapes.push(Shape { part: Part::Logo { index }, paint: Paint::Fill, path });
    }
    Ok(shapes)
}

/// Iterates over the lines of a layout that are drawn, with their indices. Faces that touch without being connected
/// have one cutting line each, in opposite directions; only the first is drawn.
pub fn drawn_lines(layout: &SheetLayout) -> impl Iterator<Item = (usize, &SheetLine)> {
    let lines = layout.lines.iter().enumerate();
    lines.filter(|(index, line)| !layout.lines[..*index].iter().any(|drawn| is_back(drawn, line)))
}

/// Returns whether a line coincides with another in the opposite direction, to within half a line width.
fn is_back(line: &SheetLine, other: &SheetLine) -> bool {
    let near = |p: DVec2, q: DVec2| p.distance(q) < line.width_mm.min(other.width_mm) / 2.0;
    line.kind == other.kind && near(line.from_mm, other.to_mm) && near(line.to_mm, other.from_mm)
}

/// Draws the tiles of a panel on its page, mm: one shape per tile, or one field for an inverted panel.
pub(super) fn draw_panel(
    target: &Target,
    panel: &Panel,
    placement: &Placement,
) -> Result<Vec<Shape>, ArtworkError> {
    let page_from_panel = Affine::translate((placement.origin_mm.x, placement.origin_mm.y))
        * Affine::rotate(placement.angle_rad);
    if let Some(diameter) = panel.discs_mm {
        let discs = panel.corners.iter().map(|corner| {
            let path = page_from_panel * disc(corner.panel_mm, diameter);
            let part = Part::Tile { panel: panel.id, row: corner.row, col: corner.col };
            Shape { part, paint: Paint::Fill, path }
        });
        return Ok(discs.collect());
    }
    let mut drawn: BTreeMap<Tile, BezPath> =
        panel.dark_tiles().into_iter().map(|tile| (tile, tile_outline(panel, tile, 0.0))).collect();
    for tag in &panel.tags {
        let (cells, word) = tag_word(target, panel, tag)?;
        let tile = panel.tag_tile(tag);
        if panel.tags_in == TagsIn::White {
            let margin = panel.tag_margin_bits() / cells.width(panel.tag_inset_bits());
            drawn.insert(tile, tile_outline(panel, tile, margin));
        }
        let path = drawn.entry(tile).or_default();
        tag_outlines(&cells, word, panel.tag_inset_bits())
            .for_each(|outline| path.extend(in_tile(panel, tile, outline)));
        if let Some(diameter) = panel.hole_mm {
            path.extend(disc(panel.tag_middle_mm(tag), diameter));
        }
    }
    let paths = drawn.into_iter().map(|(tile, path)| (tile, page_from_panel * path));
    if panel.inverted {
        let field = panel.field_outline_mm().into_iter().map(|p| Point::new(p.x, p.y));
        let mut field = page_from_panel * polygon(field);
        paths.for_each(|(_, path)| field.extend(path));
        let part = Part::Field { panel: panel.id };
        return Ok(vec![Shape { part, paint: Paint::Fill, path: field }]);
    }
    let shapes = paths.map(|(tile, path)| {
        let (row, col) = (tile.anchor.row, tile.anchor.col);
        Shape { part: Part::Tile { panel: panel.id, row, col }, paint: Paint::Fill, path }
    });
    Ok(shapes.collect())
}

/// Returns the cells and the code word of a tag.
pub(super) fn tag_word(
    target: &Target,
    panel: &Panel,
    tag: &TagPlacement,
) -> Result<(TagCells, u64), ArtworkError> {
    let family = target.family()?.and_then(|family| family.of_tiling(panel.kind));
    let word = family.and_then(|family| Some((family.cells(), family.code(tag.id)?)));
    word.ok_or_else(|| ArtworkError::NoSuchTag {
        id: tag.id,
        row: tag.row,
        col: tag.col,
        family: family.map_or_else(String::new, |family| family.name().to_owned()),
        len: family.map_or(0, Family::len),
    })
}

/// Converts points from tile coordinates to a polygon in the frame of the panel, mm.
fn in_tile(panel: &Panel, tile: Tile, outline: impl IntoIterator<Item = DVec2>) -> BezPath {
    polygon(outline.into_iter().map(|at| {
        let place = panel.position_in_tile(tile, at) * panel.edge_mm;
        Point::new(place.x, place.y)
    }))
}

/// Returns the outline of a disc, mm.
pub(super) fn disc(middle: DVec2, diameter: f64) -> BezPath {
    Circle::new((middle.x, middle.y), diameter / 2.0).to_path(DISC_TOLERANCE_MM)
}

/// Returns the outline of a tile in the frame of its panel, mm, moved inwards by the fraction `inside` of its edge.
fn tile_outline(panel: &Panel, tile: Tile, inside: f64) -> BezPath {
    in_tile(panel, tile, tile_corners(panel, tile, inside))
}

/// Iterates over the corners of a tile in tile coordinates, moved inwards by the fraction `inside` of its edge.
pub(super) fn tile_corners(
    panel: &Panel,
    tile: Tile,
    inside: f64,
) -> impl Iterator<Item = DVec2> + use<> {
    let middle = panel.kind.middle();
    let left = 1.0 - panel.kind.insets() * inside;
    let corners = tile.vertices().map(move |vertex| vertex - tile.anchor);
    let corners = corners.map(|corner| DVec2::new(corner.col.into(), corner.row.into()));
    corners.map(move |corner| middle + left * (corner - middle))
}

/// Iterates over the outlines of the white areas of a tag in tile coordinates (u along the lower edge, v along the left
/// edge, 0..1).
pub(super) fn tag_outlines(
    cells: &TagCells,
    word: u64,
    inset: f64,
) -> impl Iterator<Item = Vec<DVec2>> {
    let width = cells.width(inset);
    let at = move |cell: i32| (inset + f64::from(cell)) / width;
    cells::white_outlines(cells, word)
        .into_iter()
        .map(move |outline| outline.into_iter().map(|v| DVec2::new(at(v.col), at(v.row))).collect())
}

/// Returns the outline of a line of text on its page, mm, scaled down if it exceeds its maximum
/// width.
pub(super) fn draw_text(label: &SheetText) -> Result<BezPath, text::MissingGlyph> {
    let size = label.cap_height_mm / text::CAP_HEIGHT;
    let (path, width) = text::outline(&label.text.to_string(), size)?;
    let fit = (label.max_width_mm / width).min(1.0);
    let place = Affine::translate((label.at_mm.x, label.at_mm.y)) * Affine::rotate(label.angle_rad);
    Ok(place * Affine::scale(fit) * path)
}

/// Returns a closed polygon through the points.
pub(super) fn polygon(points: impl IntoIterator<Item = Point>) -> BezPath {
    let mut path = BezPath::new();
    for (i, point) in points.into_iter().enumerate() {
        if i == 0 { path.move_to(point) } else { path.line_to(point) }
    }
    path.close_path();
    path
}
