use glam::DVec2;
use nalgebra::{RowVector2, SMatrix, SVector};

use super::grow::SaddleGrid;
use crate::lattice::{Tile, Vertex};

/// Weight of a tile's own corners in the fit; the surroundings only bend the map.
const OWN_WEIGHT: f64 = 8.0;

/// Penalty on the bending terms, in units of one corner's equation: where few corners are known
/// the map falls back to an affine one.
const BENDING_PENALTY: f64 = 0.05;

/// Image positions of the points of a tile: a quadratic map fitted to its corners and to the
/// corners around it, so that perspective and distortion are followed.
#[derive(Clone, Debug)]
pub struct TileMap {
    /// Coefficients of 1, u, v, u², uv, v² for x and for y.
    coefficients: [[f64; 6]; 2],
}

impl TileMap {
    /// The map of `tile`, in the coordinates of [`Tile::frame`]; `None` unless all its corners are
    /// in the grid.
    pub fn new(grid: &SaddleGrid, tile: Tile) -> Option<Self> {
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
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let mut right = SMatrix::<f64, 6, 2>::zeros();
        for k in 3..6 {
            normal[(k, k)] = BENDING_PENALTY * BENDING_PENALTY;
        }
        for (vertex, position) in &known {
            let weight = if own.clone().any(|v| v == *vertex) { OWN_WEIGHT } else { 1.0 };
            let row = SVector::from(monomials(tile_coordinates(tile.frame(), *vertex)));
            let row = row * weight;
            normal += row * row.transpose();
            right += row * (RowVector2::new(position.x, position.y) * weight);
        }
        let solution = normal.cholesky()?.solve(&right);
        let column = |k: usize| std::array::from_fn(|i| solution[(i, k)]);
        Some(Self { coefficients: [column(0), column(1)] })
    }

    /// Image position of the tile point (u, v), px.
    pub fn image_from_tile(&self, point: DVec2) -> DVec2 {
        let monomials = monomials(point);
        let value = |row: [f64; 6]| row.iter().zip(&monomials).map(|(c, m)| c * m).sum::<f64>();
        self.coefficients.map(value).into()
    }
}

fn monomials(DVec2 { x: u, y: v }: DVec2) -> [f64; 6] {
    [1.0, u, v, u * u, u * v, v * v]
}

/// Coordinates of a vertex in the frame of a tile: the two edges from A are steps along
/// the row and the column.
fn tile_coordinates([a, b, _]: [Vertex; 3], vertex: Vertex) -> DVec2 {
    let offset = vertex - a;
    // Upright: B − A is one column; inverted: B − A is one column backwards, and so is C − A.
    let sign = f64::from((b - a).col);
    sign * DVec2::new(offset.col.into(), offset.row.into())
}
