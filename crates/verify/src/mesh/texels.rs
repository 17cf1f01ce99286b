//! Comparison of the texture of a face, texel by texel, over everything that a viewer shows of it.
//!
//! ```text
//!    ·───·───·     A viewer interpolates between the four texels around a point, so a triangle
//!    │ ╱‾│‾‾╲│     shows each texel (·) that lies less than one texel from it along both axes,
//!    ·╱──·───·     also those just outside. All of them have the colour of the face there.
//! ```

use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DAffine2, DMat2, DVec2};
use rayon::prelude::*;

use crate::document::page::{MAX_INK_ERROR, Page};
use crate::mesh::flat_face::Front;
use crate::mesh::measures::MESH_TOLERANCE_MM;
use crate::model::mesh::{Model, Triangle};
use crate::panel::pattern::{EDGE_PX, PROBES, Pattern};
use deltille_core::raster::Gray;
use deltille_core::targets::Panel;

/// Minimum area of a triangle on the texture of a printed face, squared texels.
const MIN_AREA: f64 = 1e-6;

/// Texels at a distance of exactly one are not shown: their weight is 0.
const OPEN: f64 = 1e-6;

/// Tolerance of positions on small tags, cells: a third of the distance from the middle of a triangular cell to its
/// edges, so that a cell is not all edge.
const MOVED_CELLS: f64 = 0.1;

/// [`MAX_INK_ERROR`] as a difference of grey values.
const MAX_SHADE_ERROR: u8 = (MAX_INK_ERROR * 255.0) as u8;

/// A face and its texture.
pub(super) struct Texels<'a> {
    pub model: &'a Model,
    pub panel: &'a Panel,
    pub pattern: &'a Pattern<'a>,
    /// Edge of a tag cell, mm; infinite without tags.
    pub cell_mm: f64,
    /// Outline of the black field of an inverted panel, counter-clockwise, mm.
    pub field: Vec<DVec2>,
    /// Whether the field is the whole face, so that its outline is not a printed edge.
    pub fills_face: bool,
}

impl Texels<'_> {
    /// Marks the pixels of a page where a texel of `front` has the wrong colour; those on tiles only if `with_tiles`
    /// is set. Returns an error if the texture cannot be compared.
    pub(super) fn wrong(
        &self,
        front: &[Front],
        page: &Page,
        low: DVec2,
        with_tiles: bool,
    ) -> Result<Vec<bool>, &'static str> {
        let (width, height) = (page.image.width(), page.image.height());
        let mut wrong = vec![false; width * height];
        for Front { triangle, flat } in front {
            let (texture, size) = self.model.texture(triangle);
            let corners = triangle.uv.map(|uv| uv * size - 0.5);
            let panel_from_texel = affine(corners, *flat)
                .ok_or("a triangle of a printed face has no area on the texture")?;
            let rows: Vec<_> = rows(corners, texture).collect();
            let texel_mm = self.model.texel_mm(triangle);
            let found: Vec<DVec2> = (rows.into_par_iter())
                .flat_map_iter(|(row, columns)| {
                    let other = self.other_colours(texture.row(row), columns, |column| {
                        panel_from_texel.transform_point2(DVec2::new(column as f64, row as f64))
                    });
                    other.into_iter().filter(|&place| !self.is_edge(place, texel_mm, with_tiles))
                })
                .collect();
            for place in found {
                let last = DVec2::new(width as f64 - 1.0, height as f64 - 1.0);
                let at = page.px_from_page(place - low).round().clamp(DVec2::ZERO, last);
                wrong[at.y as usize * width + at.x as usize] = true;
            }
        }
        Ok(wrong)
    }

    /// Returns the positions on the panel, mm, of the texels of a row that have another colour than the panel there.
    fn other_colours(
        &self,
        row: &[u8],
        columns: Range<usize>,
        place: impl Fn(usize) -> DVec2,
    ) -> Vec<DVec2> {
        let is_inside = |column| self.inside_mm(place(column)) >= 0.0;
        let way = (place(1) - place(0)) / self.panel.edge_mm;
        let mut other = Vec::new();
        let mut first = columns.start;
        while first < columns.end {
            let at = place(first) / self.panel.edge_mm;
            let black = self.pattern.is_black_at(at) && is_inside(first);
            let same = self.pattern.same_along(at, way) as usize;
            let mut end = columns.end.min(same.saturating_add(first + 1));
            if self.panel.inverted && !(is_inside(first) && is_inside(end - 1)) {
                end = first + 1;
            }
            let shade = if black { 0 } else { u8::MAX };
            let is_other = |&column: &usize| row[column].abs_diff(shade) > MAX_SHADE_ERROR;
            other.extend((first..end).filter(is_other).map(&place));
            first = end;
        }
        other
    }

    /// Whether a position on the panel, mm, is part of an edge, or of a tile unless `with_tiles` is set.
    fn is_edge(&self, place: DVec2, texel_mm: f64, with_tiles: bool) -> bool {
        let at = place / self.panel.edge_mm;
        if !with_tiles && self.pattern.has_tile_at(at) {
            return true;
        }
        let inside = self.inside_mm(place);
        let colour = self.pattern.is_black_at(at);
        // Around drawn edges: within the tolerance of positions, plus the smear of rendering.
        let smear_mm = EDGE_PX * texel_mm;
        let near_mm = smear_mm + MESH_TOLERANCE_MM.min(MOVED_CELLS * self.cell_mm);
        let field_mm = if self.fills_face { smear_mm } else { near_mm };
        if inside.abs() <= field_mm {
            return true;
        }
        let mut probes = (0..PROBES).map(|n| f64::from(n) * TAU / f64::from(PROBES));
        // A circle alone would miss cells narrower than it.
        probes.any(|angle| {
            [smear_mm, near_mm].iter().any(|radius_mm| {
                let probe = radius_mm / self.panel.edge_mm * DVec2::from_angle(angle);
                self.pattern.is_black_at(at + probe) != colour
            })
        })
    }

    /// Returns how far a position lies within the field of an inverted panel, mm; other panels have no field.
    fn inside_mm(&self, place: DVec2) -> f64 {
        if !self.panel.inverted {
            return f64::INFINITY;
        }
        let next = self.field.iter().cycle().skip(1);
        let depths = self
            .field
            .iter()
            .zip(next)
            .map(|(&from, &to)| (to - from).normalize_or_zero().perp_dot(place - from));
        depths.fold(f64::INFINITY, f64::min)
    }
}

/// Returns the map from texels to the panel, mm, given the corners of a triangle on both; `None` if it has no area on
/// the texture.
fn affine(texels: [DVec2; 3], flat: [DVec2; 3]) -> Option<DAffine2> {
    let sides = |[a, b, c]: [DVec2; 3]| DMat2::from_cols(b - a, c - a);
    let of_texture = sides(texels);
    let has_area = of_texture.determinant().abs() >= MIN_AREA;
    let matrix = has_area.then(|| sides(flat) * of_texture.inverse())?;
    Some(DAffine2::from_mat2_translation(matrix, flat[0] - matrix * texels[0]))
}

/// Returns the rows of a texture that a triangle shows in part, each with its columns. Texels are at integers.
fn rows(corners: [DVec2; 3], texture: &Gray<u8>) -> impl Iterator<Item = (usize, Range<usize>)> {
    let (width, height) = (texture.width(), texture.height());
    // The range of texels that lie within one texel of an extent; its end is past the last of them.
    let reached = |[low, high]: [f64; 2], size: usize| {
        let last = size as f64 - 1.0;
        let first = (low - 1.0 + OPEN).ceil().clamp(0.0, last) as usize;
        first..(high + 1.0 - OPEN).floor().clamp(0.0, last) as usize + 1
    };
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    };
    let across = extent(&mut corners.iter().map(|corner| corner.y));
    reached(across, height).map(move |row| {
        // The part of the triangle within one row of this one; beyond the edge of the texture its last row is shown.
        let first = if row == 0 { f64::NEG_INFINITY } else { row as f64 - 1.0 };
        let last = if row + 1 == height { f64::INFINITY } else { row as f64 + 1.0 };
        let sides = (0..3).map(|i| [corners[i], corners[(i + 1) % 3]]);
        let mut ends = sides.flat_map(|[a, b]| {
            let at = |y: f64| a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
            let crosses = |y: f64| (a.y < y) != (b.y < y);
            let crossings = [first, last].map(|y| crosses(y).then(|| at(y)));
            let corner = (first..=last).contains(&a.y).then_some(a.x);
            crossings.into_iter().chain([corner]).flatten()
        });
        let [low, high] = extent(&mut ends);
        let columns = if low > high { 0..0 } else { reached([low, high], width) };
        (row, columns)
    })
}

/// Whether the triangles show so much of the textures that they must share parts of them; each should have its own.
pub(super) fn are_shared(model: &Model) -> bool {
    let area = |triangle: &Triangle| {
        let (_, size) = model.texture(triangle);
        let [a, b, c] = triangle.uv.map(|uv| uv * size);
        (b - a).perp_dot(c - a).abs() / 2.0
    };
    let shown: f64 = model.triangles.iter().map(area).sum();
    let pixels: usize = model.textures.iter().map(|texture| texture.pixels().len()).sum();
    shown > pixels as f64
}

/// Finds a texel that is not white although no triangle shows it, as texture, column and row: coarser levels of a
/// texture would blend it into a face.
pub(super) fn hidden(model: &Model) -> Option<[usize; 3]> {
    (0..model.textures.len()).find_map(|index| {
        let texture = &model.textures[index];
        let mut shown: Vec<Vec<Range<usize>>> = vec![Vec::new(); texture.height()];
        for triangle in model.triangles.iter().filter(|triangle| triangle.texture == index) {
            let (_, size) = model.texture(triangle);
            for (row, columns) in rows(triangle.uv.map(|uv| uv * size - 0.5), texture) {
                shown[row].push(columns);
            }
        }
        shown.par_iter_mut().enumerate().find_map_first(|(row, ranges)| {
            ranges.sort_unstable_by_key(|range| range.start);
            let mut begin = 0;
            let end = texture.width()..texture.width();
            ranges.iter().chain([&end]).find_map(|range| {
                let gap = begin..range.start.max(begin);
                begin = begin.max(range.end);
                let is_inked = |&column: &usize| texture.at(column, row) != u8::MAX;
                gap.into_iter().find(is_inked).map(|column| [index, column, row])
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every texel used for interpolation at a point of a triangle is among its rows.
    #[test]
    fn all_interpolated_texels_are_in_the_rows() {
        let texture = Gray::<u8>::new(12, 9);
        let corners = [DVec2::new(1.3, 0.2), DVec2::new(10.9, 3.7), DVec2::new(4.4, 7.9)];
        let mut listed = [[false; 12]; 9];
        rows(corners, &texture).for_each(|(row, columns)| listed[row][columns].fill(true));
        let mut taken = [[false; 12]; 9];
        let steps = || (0..=100).map(|step| f64::from(step) / 100.0);
        for (u, v) in steps().flat_map(|u| steps().map(move |v| (u, v * (1.0 - u)))) {
            let [a, b, c] = corners;
            let at = a + u * (b - a) + v * (c - a);
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                taken[at.y as usize + y][at.x as usize + x] = true;
            }
        }
        for (row, column) in (0..9).flat_map(|row| (0..12).map(move |column| (row, column))) {
            assert!(listed[row][column] || !taken[row][column], "row {row}, column {column}");
        }
        assert!(listed.iter().flatten().filter(|&&listed| !listed).count() > 30);
    }
}
