//! Drawings of boards and faces of solids for a laser or a plotter: black areas as closed outlines to engrave, and the
//! outline of the plate to cut, with kerf compensation.
//!
//! ```text
//!    ╲──────────╱      ╲───────╱       A beam removes half its width on either side of its path. So
//!     ╲ engrave╱        ╲─────╱        engraved areas are drawn smaller by that amount, and the plate
//!      ╲      ╱   →      ╲   ╱         larger. Tiles that meet in a corner therefore separate. Corners
//!       ╲    ╱            ╲ ╱          stay sharp: each edge is moved along its normal, and meets its
//!        ╳──╳                          neighbours at their new position.
//! ```
//!
//! Every outline has black on its left: outer outlines run counter-clockwise, holes clockwise, on a mirrored board too.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec2;

use super::atlas::Packing;
use super::cutting::{CutDrawing, CutLayer, CutPath, CuttingError, GAP_MM};
use super::{ArtworkError, board, cells};
use crate::{Placement, Printing};
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Face, Panel, TagPlacement, TagsIn, Target, TargetSpec};

/// Largest kerf, mm: smaller than the gap between two plates.
const WIDEST_KERF_MM: f64 = 3.0;

/// Largest fraction of the finest detail on a board that a kerf may take.
const KERF_PART: f64 = 0.25;

/// Number of sides of the polygon that approximates a disc: for a diameter of 50 mm it stays within a micrometre of the
/// circle.
const DISC_SIDES: u32 = 360;

/// A board, or a face of a solid, in a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserBoard<'a> {
    /// The board.
    pub panel: &'a Panel,
    /// Outline of the finished plate, counter-clockwise in the frame of the board, mm: tiles with their quiet zone, or
    /// the panel of a solid.
    pub plate_mm: Vec<DVec2>,
    /// Placement in the unmirrored drawing.
    placement: Placement,
    /// Right end of all plates, about which a mirrored drawing is reflected, mm; `None` if not mirrored.
    mirror_mm: Option<f64>,
}

impl LaserBoard<'_> {
    /// Maps a point between the mirrored and the unmirrored drawing, mm.
    fn mirrored(&self, point: DVec2) -> DVec2 {
        self.mirror_mm.map_or(point, |right| DVec2::new(right - point.x, point.y))
    }

    /// Returns the board coordinates of a point of the drawing, mm.
    pub fn board_from_drawing(&self, point: DVec2) -> DVec2 {
        self.placement.panel_from_page(self.mirrored(point))
    }

    /// Returns whether a point of the drawing lies on the plate.
    pub fn holds(&self, point: DVec2) -> bool {
        let point = self.board_from_drawing(point);
        let next = self.plate_mm.iter().cycle().skip(1);
        let mut sides = self.plate_mm.iter().zip(next);
        sides.all(|(&from, &to)| (to - from).perp_dot(point - from) >= 0.0)
    }

    /// Converts an outline in the frame of the board to a path of the drawing with the same orientation.
    fn path(&self, layer: CutLayer, outline: &[DVec2]) -> CutPath {
        let seen = outline.iter().map(|&point| self.placement.page_from_panel(point));
        let mut points_mm: Vec<DVec2> = seen.map(|point| self.mirrored(point)).collect();
        if self.mirror_mm.is_some() {
            points_mm.reverse();
        }
        CutPath { layer, closed: true, points_mm }
    }
}

/// Returns the boards or faces of a target side by side, in true size, mirrored if the print is.
///
/// # Errors
/// Returns an error if the target is neither made of boards nor a solid.
pub fn laser_boards(printing: &Printing) -> Result<Vec<LaserBoard<'_>>, CuttingError> {
    let target = &printing.target;
    let mut boards = match &target.spec {
        TargetSpec::Tags(_) => return Err(CuttingError::NotBoard(target.name.to_string())),
        TargetSpec::Solid(spec) => faces_in_rows(target, &spec.panel_faces()?),
        _ => plates_in_rows(target),
    };
    if printing.finish.mirrored {
        let seen = boards.iter().flat_map(|board| {
            board.plate_mm.iter().map(|&corner| board.placement.page_from_panel(corner).x)
        });
        let right = Some(seen.fold(0.0, f64::max));
        boards.iter_mut().for_each(|board| board.mirror_mm = right);
    }
    Ok(boards)
}

/// Arranges the plates of boards in rows from below, with about as many columns as rows.
fn plates_in_rows(target: &Target) -> Vec<LaserBoard<'_>> {
    let columns = (target.panels.len() as f64).sqrt().ceil() as usize;
    let mut boards = Vec::new();
    let mut lower = 0.0;
    for row in target.panels.chunks(columns.max(1)) {
        let (mut left, mut height) = (0.0, 0.0f64);
        for panel in row {
            let [x0, y0, x1, y1] = panel.field_mm();
            let origin_mm = DVec2::new(left - x0, lower - y0);
            let placement = Placement { panel: panel.id, angle_rad: 0.0, origin_mm };
            let plate_mm = rectangle(panel.field_mm()).to_vec();
            boards.push(LaserBoard { panel, plate_mm, placement, mirror_mm: None });
            height = height.max(y1 - y0);
            left += x1 - x0 + GAP_MM;
        }
        lower += height + GAP_MM;
    }
    boards
}

/// Arranges the panels of a solid as in a drawing without engraving.
fn faces_in_rows<'a>(target: &'a Target, faces: &[Face]) -> Vec<LaserBoard<'a>> {
    let placements: Vec<Placement> = Packing::tightest(faces, GAP_MM).placements().collect();
    let plates = faces.iter().map(|face| face.outline_mm.clone()).zip(placements);
    let boards = target.panels.iter().zip(plates).map(|(panel, (plate_mm, placement))| {
        LaserBoard { panel, plate_mm, placement, mirror_mm: None }
    });
    boards.collect()
}

/// Draws all boards or faces of a target for a beam of the given width, mm. Finished plates lie to the right of and
/// above the origin.
///
/// # Errors
/// Returns an error if the target is neither made of boards nor a solid, the family of its tags is unknown or lacks a
/// code, or the beam is too wide.
pub fn to_laser(printing: &Printing, kerf_mm: f64) -> Result<CutDrawing, CuttingError> {
    let boards = laser_boards(printing)?;
    let target = &printing.target;
    let family = target.family().map_err(ArtworkError::from)?;
    let finest = target.panels.iter().map(|panel| finest_mm(panel, family));
    let most_mm = (KERF_PART * finest.fold(f64::INFINITY, f64::min)).min(WIDEST_KERF_MM);
    if !(0.0..=most_mm).contains(&kerf_mm) {
        return Err(CuttingError::Kerf { kerf_mm, most_mm });
    }
    let half = kerf_mm / 2.0;
    let mut paths = Vec::new();
    for board in &boards {
        let dark = dark_outlines(target, board.panel, kerf_mm == 0.0)?;
        let dark = dark.iter().map(|outline| moved_inwards(outline, half));
        paths.extend(dark.map(|outline| board.path(CutLayer::Engrave, &outline)));
        // Holes come first, because a plate may move once it is cut out.
        let cut = holes(board.panel).chain([board.plate_mm.clone()]);
        paths.extend(cut.map(|outline| board.path(CutLayer::Cut, &moved_inwards(&outline, -half))));
    }
    Ok(CutDrawing { paths })
}

/// Returns the smallest length on a board, mm: the edge of a tag cell or a tile, the diameter of a disc or hole, or
/// twice the narrowest black ring around a hole.
fn finest_mm(panel: &Panel, family: Option<&Family>) -> f64 {
    let family = family.filter(|_| panel.border_bits.is_some());
    let family = family.and_then(|family| family.of_tiling(panel.kind));
    let bit_mm = |family: &Family| panel.edge_mm / family.cells().width(panel.tag_inset_bits());
    let gap = panel.gap_edges.map(|gap| gap * panel.edge_mm);
    let ring = panel.hole_mm.zip(family).and_then(|(hole_mm, family)| {
        let free = family.rules().free?.radius_bits(family.dimension());
        Some(2.0 * free * bit_mm(family) - hole_mm)
    });
    let lengths = [family.map(bit_mm), gap, panel.discs_mm, panel.hole_mm, ring];
    lengths.into_iter().flatten().fold(panel.edge_mm, f64::min)
}

/// Returns the outlines of the black areas of a board, in its frame, mm. Areas that meet only in a corner stay
/// separate. `simple` outlines pass no corner twice.
fn dark_outlines(
    target: &Target,
    panel: &Panel,
    simple: bool,
) -> Result<Vec<Vec<DVec2>>, ArtworkError> {
    if let Some(diameter) = panel.discs_mm {
        return Ok(panel.corners.iter().map(|corner| disc(corner.panel_mm, diameter)).collect());
    }
    // Dark tiles of an inverted board are printed white.
    let inside = !panel.inverted;
    let around = outlines(panel.kind, panel.dark_tiles().into_iter(), inside, simple);
    let mut dark: Vec<Vec<DVec2>> = around
        .into_iter()
        .map(|outline| outline.into_iter().map(|vertex| panel.lattice_mm(vertex)).collect())
        .collect();
    if panel.inverted {
        dark.push(panel.field_outline_mm());
    }
    for tag in &panel.tags {
        dark.extend(tag_outlines(target, panel, tag, simple)?);
    }
    dark.extend(holes(panel).map(|mut hole| {
        if panel.inverted {
            hole.reverse();
        }
        hole
    }));
    Ok(dark)
}

/// Iterates over the holes of the tags of a panel, clockwise in its frame, mm.
fn holes(panel: &Panel) -> impl Iterator<Item = Vec<DVec2>> {
    let of_tag = move |(tag, diameter): (&TagPlacement, f64)| {
        let mut outline = disc(panel.tag_middle_mm(tag), diameter);
        outline.reverse();
        outline
    };
    panel.tags.iter().filter_map(|tag| Some((tag, panel.hole_mm?))).map(of_tag)
}

/// Returns the outline of a disc, counter-clockwise, mm.
fn disc(middle: DVec2, diameter: f64) -> Vec<DVec2> {
    let angles = (0..DISC_SIDES).map(|n| TAU * f64::from(n) / f64::from(DISC_SIDES));
    angles.map(|angle| middle + diameter / 2.0 * DVec2::from_angle(angle)).collect()
}

/// Returns the outlines of the black areas of a tag, in the frame of its board, mm.
fn tag_outlines(
    target: &Target,
    panel: &Panel,
    tag: &TagPlacement,
    simple: bool,
) -> Result<Vec<Vec<DVec2>>, ArtworkError> {
    let (cells, word) = board::tag_word(target, panel, tag)?;
    let inset = panel.tag_inset_bits();
    let width = cells.width(inset);
    let at = |cell: i32| (inset + f64::from(cell)) / width;
    let white = cells::white_cells(&cells, word);
    let mut dark: Vec<Vec<DVec2>> = outlines(cells.kind(), white, panel.inverted, simple)
        .into_iter()
        .map(|outline| outline.into_iter().map(|v| DVec2::new(at(v.col), at(v.row))).collect())
        .collect();
    let tile = panel.tag_tile(tag);
    if panel.tags_in == TagsIn::White {
        let border = board::tile_corners(panel, tile, panel.tag_margin_bits() / width);
        let mut border: Vec<DVec2> = border.collect();
        if panel.inverted {
            border.reverse();
        }
        dark.push(border);
    }
    let place = |at: &DVec2| panel.position_in_tile(tile, *at) * panel.edge_mm;
    Ok(dark.iter().map(|outline| outline.iter().map(place).collect()).collect())
}

/// Returns the outlines of tiles as vertices where they bend, with the tiles on the left, or on the right if not
/// `inside`. `simple` outlines also keep the vertices where they meet others, so that they still meet after coordinates
/// are rounded.
fn outlines(
    kind: GridKind,
    tiles: impl Iterator<Item = Tile>,
    inside: bool,
    simple: bool,
) -> Vec<Vec<Vertex>> {
    let walks = cells::walks(kind, tiles, inside).into_iter();
    let parts = walks.flat_map(|walk| if simple { cells::simple(walk) } else { vec![walk] });
    let walks: Vec<cells::Walk> = parts.collect();
    let mut passed = BTreeMap::<Vertex, usize>::new();
    for (vertex, _) in walks.iter().flatten() {
        *passed.entry(*vertex).or_default() += 1;
    }
    let vertices = |walk: &cells::Walk| {
        let before = walk.iter().cycle().skip(walk.len() - 1);
        let steps = walk.iter().zip(before);
        let kept = steps.filter(|((vertex, heading), (_, before))| {
            heading != before || (simple && passed[vertex] > 1)
        });
        kept.map(|((vertex, _), _)| *vertex).collect()
    };
    walks.iter().map(vertices).collect()
}

/// Returns a closed outline with each edge moved to its left by a length, mm, or to its right if negative. Edges end
/// where they meet their moved neighbours.
pub fn moved_inwards(outline: &[DVec2], by_mm: f64) -> Vec<DVec2> {
    let count = outline.len();
    let normal =
        |from: usize| (outline[(from + 1) % count] - outline[from % count]).normalize().perp();
    let corner = |i: usize| {
        let (before, after) = (normal(i + count - 1), normal(i));
        outline[i] + (before + after) * (by_mm / (1.0 + before.dot(after)))
    };
    (0..count).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use deltille_core::polygon;
    use deltille_core::targets::BoardSpec;

    /// The area on a layer, mm².
    fn area(drawing: &CutDrawing, layer: CutLayer) -> f64 {
        let of_layer = drawing.paths.iter().filter(|path| path.layer == layer);
        of_layer.map(|path| polygon::area(&path.points_mm)).sum()
    }

    /// Area of the black shapes of a board in its frame, mm².
    fn drawn(target: &Target) -> f64 {
        let shapes = super::super::panel_shapes(target, &target.panels[0]).unwrap();
        // White loops run in the opposite direction to black ones, inside a field as inside a tile.
        shapes.iter().map(|shape| even_odd(&shape.path)).sum()
    }

    /// Area of a path with nested loops, by the even-odd rule.
    fn even_odd(path: &kurbo::BezPath) -> f64 {
        use kurbo::Shape;
        let elements = path.elements();
        let loops = elements.chunk_by(|_, next| !matches!(next, kurbo::PathEl::MoveTo(_)));
        let loops: Vec<kurbo::BezPath> =
            loops.map(|l| kurbo::BezPath::from_vec(l.to_vec())).collect();
        let depth = |of: &kurbo::BezPath| {
            // A point just inside the first edge.
            let Some(kurbo::PathSeg::Line(edge)) = of.segments().next() else { return 0 };
            let along = edge.p1 - edge.p0;
            let side = of.area().signum();
            let inside =
                edge.p0.midpoint(edge.p1) + kurbo::Vec2::new(-along.y, along.x) * (1e-6 * side);
            loops.iter().filter(|around| around.winding(inside) != 0).count()
        };
        loops.iter().map(|l| if depth(l) % 2 == 1 { l.area().abs() } else { -l.area().abs() }).sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// The black of a drawing matches the print. A kerf removes half its width along each edge, and moving the
        /// edges back restores the original area.
        #[test]
        fn black_matches_the_print(
            rows in 3u32..7, cols in 3u32..7, kind in 0..4, inverted: bool, first_id in 0u32..40,
        ) {
            let mut spec = match kind {
                0 => BoardSpec::deltille(rows, cols, 20.0),
                1 => BoardSpec { tags: None, ..BoardSpec::deltille(rows, cols, 20.0) },
                2 => BoardSpec::checkerboard(rows, cols, 20.0),
                _ => BoardSpec { tags: None, ..BoardSpec::checkerboard(rows, cols, 20.0) },
            };
            spec.inverted = inverted;
            if let Some(tags) = &mut spec.tags {
                tags.first_id = first_id;
                tags.spacing = 2;
            }
            let printing = Printing::new("board", spec).unwrap();
            let target = &printing.target;
            let exact = to_laser(&printing, 0.0).unwrap();
            let black = drawn(target);
            prop_assert!((area(&exact, CutLayer::Engrave) / black - 1.0).abs() < 1e-9);
            let kerf = 0.1;
            let narrow = to_laser(&printing, kerf).unwrap();
            let back = |path: &CutPath| match path.layer {
                CutLayer::Engrave => moved_inwards(&path.points_mm, -kerf / 2.0),
                _ => moved_inwards(&path.points_mm, kerf / 2.0),
            };
            let paths: Vec<CutPath> = narrow.paths.iter()
                .map(|path| CutPath { points_mm: back(path), ..path.clone() }).collect();
            let again = CutDrawing { paths };
            prop_assert!((area(&again, CutLayer::Engrave) / black - 1.0).abs() < 1e-9);
            for layer in [CutLayer::Engrave, CutLayer::Cut] {
                let less = area(&again, layer) - area(&narrow, layer);
                prop_assert!(less.abs() > 0.0 && (less > 0.0) == (layer == CutLayer::Engrave));
            }
        }
    }
}
