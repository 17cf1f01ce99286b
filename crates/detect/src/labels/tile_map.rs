use glam::DVec2;
use nalgebra::{RowVector2, SMatrix, SVector};

use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::lattice::{Tile, Vertex};

/// Weight of a tile's own corners in the fit. Other corners only bend the map.
const OWN_WEIGHT: f64 = 8.0;

/// Penalty on the bending terms, in units of one corner's equation. If few corners are known, the map becomes affine.
const BENDING_PENALTY: f64 = 0.05;

/// Image positions of the points of a tile: a quadratic map fitted to its corners and to those around it, so that it
/// follows perspective and distortion.
#[derive(Clone, Debug)]
pub(crate) struct TileMap {
    /// Coefficients of 1, u, v, u², uv, v² for x and for y.
    coefficients: [[f64; 6]; 2],
}

impl TileMap {
    /// Creates the map of `tile`, in the coordinates of [`Tile::frame`]. Returns `None` unless all its corners are in
    /// the grid. `gap` is the width of every second row and column of tiles, in edges, if these are gaps between tags.
    pub(crate) fn new(grid: &SaddleGrid, tile: Tile, gap: Option<f64>) -> Option<Self> {
        let kind = tile.kind();
        let own = tile.vertices();
        let mut around: Vec<Vertex> = own.clone().flat_map(|v| kind.neighbours(v)).collect();
        around.sort();
        around.dedup();
        let at = |v: &Vertex| grid.get(v).map(|placed| placed.position);
        for vertex in own.clone() {
            at(&vertex)?;
        }
        let known: Vec<(Vertex, DVec2)> =
            around.iter().filter_map(|v| Some((*v, at(v)?))).collect();
        let beyond = gap.map_or(1.0, |gap| next_tiles(&known, tile, gap));
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let mut right = SMatrix::<f64, 6, 2>::zeros();
        for k in 3..6 {
            normal[(k, k)] = BENDING_PENALTY * BENDING_PENALTY;
        }
        for (vertex, position) in &known {
            let weight = if own.clone().any(|v| v == *vertex) { OWN_WEIGHT } else { 1.0 };
            let place = tile_coordinates(tile.frame(), *vertex);
            let place = place.map(|along| along.clamp(0.0, 1.0) * (1.0 - beyond) + along * beyond);
            let row = SVector::from(monomials(place));
            let row = row * weight;
            normal += row * row.transpose();
            right += row * (RowVector2::new(position.x, position.y) * weight);
        }
        let solution = normal.cholesky()?.solve(&right);
        let column = |k: usize| std::array::from_fn(|i| solution[(i, k)]);
        Some(Self { coefficients: [column(0), column(1)] })
    }

    /// Returns the image position of the tile point (u, v), px.
    pub(crate) fn image_from_tile(&self, point: DVec2) -> DVec2 {
        let monomials = monomials(point);
        let value = |row: [f64; 6]| row.iter().zip(&monomials).map(|(c, m)| c * m).sum::<f64>();
        self.coefficients.map(value).into()
    }
}

/// Returns the width of the tiles next to a tile, in widths of that tile, if every second tile is a
/// gap. The distance of the corners beyond the tile shows whether the tile is a tag or a small
/// square.
fn next_tiles(known: &[(Vertex, DVec2)], tile: Tile, gap: f64) -> f64 {
    let own: Vec<Vertex> = tile.vertices().collect();
    let (mut inside, mut outside) = ((0.0, 0.0), (0.0, 0.0));
    for (i, (vertex, place)) in known.iter().enumerate() {
        for (other, there) in &known[..i] {
            let step = *vertex - *other;
            if step.row.abs() + step.col.abs() != 1 {
                continue;
            }
            let sum = match (own.contains(vertex), own.contains(other)) {
                (true, true) => &mut inside,
                (false, false) => continue,
                _ => &mut outside,
            };
            *sum = (sum.0 + place.distance(*there), sum.1 + 1.0);
        }
    }
    let is_gap = outside.0 * inside.1 > inside.0 * outside.1;
    if is_gap { 1.0 / gap } else { gap }
}

fn monomials(DVec2 { x: u, y: v }: DVec2) -> [f64; 6] {
    [1.0, u, v, u * u, u * v, v * v]
}

/// Returns the coordinates of a vertex in the frame of a tile. The two edges from A are steps along the row and the
/// column.
fn tile_coordinates([a, b, _]: [Vertex; 3], vertex: Vertex) -> DVec2 {
    let offset = vertex - a;
    // Upright: B − A is one column. Inverted: B − A is one column backwards, and so is C − A.
    let sign = f64::from((b - a).col);
    sign * DVec2::new(offset.col.into(), offset.row.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::saddle_grid::PlacedSaddle;
    use deltille_core::lattice::GridKind;

    /// Tiles of an AprilGrid, seen frontally: the map of each tile returns its true centre,
    /// including tiles at the border of the grid.
    #[test]
    fn gaps_between_tags_do_not_bend_the_map() {
        let gap = 0.3;
        let along = |index: i32| f64::from(index / 2) * (1.0 + gap) + f64::from(index % 2);
        let at = |v: Vertex| 100.0 * DVec2::new(along(v.col), along(v.row));
        let vertices = (0..4).flat_map(|row| (0..4).map(move |col| Vertex::new(row, col)));
        let grid: SaddleGrid =
            vertices.map(|v| (v, PlacedSaddle { position: at(v), amplitude: 100.0 })).collect();
        for (row, col) in [(0, 0), (0, 2), (2, 2), (1, 1)] {
            let tile = GridKind::Checker.tag_tile(Vertex::new(row, col));
            let middle = (at(tile.anchor) + at(tile.anchor + Vertex::new(1, 1))) / 2.0;
            let place =
                |gap| TileMap::new(&grid, tile, gap).unwrap().image_from_tile(DVec2::splat(0.5));
            assert!(place(Some(gap)).distance(middle) < 1e-3, "{row} {col}");
            assert!((row, col) == (1, 1) || place(None).distance(middle) > 1.0, "{row} {col}");
        }
    }
}
