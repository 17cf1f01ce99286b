//! Reading tags out of tiles.

use super::grow::SaddleGrid;
use super::small_cells;
use super::tile_map::TileMap;
use crate::family::{Decoded, Decoder, Family};
use crate::lattice::{Orientation, TagCells, Tile};
use crate::raster::{Gray, Intensity};

/// Where the white beside an edge is sampled: distance from the edge in barycentric units.
const OUTSIDE: f64 = 0.12;

/// Places along an edge where white and border are sampled.
const ALONG: [f64; 3] = [0.3, 0.5, 0.7];

/// The border must be darker than the white by this part of the contrast of the tile's corners.
const MIN_CONTRAST: f64 = 0.5;

/// Points of a cell that are averaged: its centre, and half-way from there to its corners.
const CELL_POINTS: usize = 4;

/// Cells with shorter sides than this are read together where one by one they make no code, px:
/// larger ones show their own brightness in the middle.
const SMALL_CELL_PX: f64 = 5.0;

/// Blurs that are tried then, px: that of a sharp photograph, and with some motion or defocus.
const SMALL_CELL_BLURS_PX: [f64; 2] = [0.8, 1.2];

/// The cells of a tile, read as a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The tile, in the grid's vertices.
    pub tile: Tile,
    /// Bits as cells of the tile with A, B, C = [`Tile::vertices`].
    pub word: u64,
    /// The nearest code, where one is near enough.
    pub decoded: Option<Decoded>,
}

/// Reads the tags of one family with one border width.
#[derive(Clone, Debug)]
pub struct TagReader {
    cells: TagCells,
    border_bits: f64,
    decoder: Decoder,
    max_errors: u32,
}

impl TagReader {
    /// A reader for tags with a border of `border_bits`; corrects up to `max_errors` bits.
    pub fn new(family: &Family, border_bits: f64, max_errors: u32) -> Self {
        let cells = TagCells::new(family.dimension());
        Self { cells, border_bits, decoder: Decoder::new(family), max_errors }
    }

    /// The layout of the cells.
    pub fn cells(&self) -> &TagCells {
        &self.cells
    }

    /// Most bits that are corrected.
    pub fn max_errors(&self) -> u32 {
        self.max_errors
    }

    /// Reads every tile of a grid whose corners are known and whose border can be told from the
    /// white around it: dark tiles as they are, bright ones as tags of an inverted board.
    pub fn read_all<T: Intensity>(&self, image: &Gray<T>, grid: &SaddleGrid) -> Vec<Reading> {
        let tiles = grid.keys().flat_map(|&v| [Tile::upright(v), Tile::inverted(v)]);
        tiles.filter_map(|tile| self.read(image, grid, tile)).collect()
    }

    fn read<T: Intensity>(
        &self,
        image: &Gray<T>,
        grid: &SaddleGrid,
        tile: Tile,
    ) -> Option<Reading> {
        let map = TileMap::new(grid, tile)?;
        let sample = |point: [f64; 2]| {
            let [x, y] = map.image_from_tile(point);
            let inside = x >= 0.0
                && y >= 0.0
                && x <= (image.width() - 1) as f64
                && y <= (image.height() - 1) as f64;
            inside.then(|| f64::from(image.bilinear(x, y)))
        };
        let width = f64::from(self.cells.dimension().rows()) + 3.0 * self.border_bits;
        let around = Plane::fit(edge_points(-OUTSIDE), sample)?;
        let border = Plane::fit(edge_points(0.5 * self.border_bits / width), sample)?;
        let contrast = around.at([1.0 / 3.0; 2]) - border.at([1.0 / 3.0; 2]);
        let sign = if tile.orientation == Orientation::Upright { 1.0 } else { -1.0 };
        if sign * contrast < MIN_CONTRAST * corner_contrast::<T>(grid, tile) {
            return None;
        }
        let mut word = 0;
        for bit in 0..self.cells.dimension().bits() {
            let corners = self.cells.corners(bit, self.border_bits);
            let centre = self.cells.centre(bit, self.border_bits);
            let half_way = corners.map(|c| [(c[0] + centre[0]) / 2.0, (c[1] + centre[1]) / 2.0]);
            let points = [centre, half_way[0], half_way[1], half_way[2]];
            let mut sum = 0.0;
            for point in points {
                sum += sample(point)?;
            }
            let threshold = (around.at(centre) + border.at(centre)) / 2.0;
            // A cell of the colour around the tile is a 1, on inverted boards as well.
            let one = sign * (sum / CELL_POINTS as f64 - threshold) > 0.0;
            word |= u64::from(one) << bit;
        }
        let decode = |word| self.decoder.decode(word, self.max_errors);
        let mut reading = Reading { tile, word, decoded: decode(word) };
        if reading.decoded.is_none() && longest_side_px(&map) / width < SMALL_CELL_PX {
            let levels = |point: [f64; 2]| [border.at(point), around.at(point)];
            let words = SMALL_CELL_BLURS_PX.into_iter().filter_map(|blur_px| {
                small_cells::word(image, &map, &self.cells, self.border_bits, blur_px, levels)
            });
            let readings = words.map(|word| Reading { tile, word, decoded: decode(word) });
            reading = readings.into_iter().find(|r| r.decoded.is_some()).unwrap_or(reading);
        }
        Some(reading)
    }
}

/// The longest side of a tile, px.
fn longest_side_px(map: &TileMap) -> f64 {
    let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|point| map.image_from_tile(point));
    let sides = [[a, b], [b, c], [c, a]].map(|[p, q]| (p[0] - q[0]).hypot(p[1] - q[1]));
    sides.into_iter().fold(0.0, f64::max)
}

/// Points along the three edges of a tile, `inside` it in barycentric units (negative: outside).
fn edge_points(inside: f64) -> impl Iterator<Item = [f64; 2]> {
    ALONG.into_iter().flat_map(move |t| {
        let t = inside + t * (1.0 - 3.0 * inside);
        let rest = 1.0 - inside - t;
        [[t, inside], [inside, t], [t, rest]]
    })
}

/// Contrast between dark and bright around the corners of a tile, in units of the image.
fn corner_contrast<T: Intensity>(grid: &SaddleGrid, tile: Tile) -> f64 {
    let amplitudes = tile.vertices().into_iter().filter_map(|v| grid.get(&v));
    let least = amplitudes.map(|p| p.amplitude).fold(f64::INFINITY, f64::min);
    2.0 * least * f64::from(T::FULL_SCALE / crate::raster::PYRAMID_FULL_SCALE)
}

/// Brightness as a plane over tile coordinates.
struct Plane([f64; 3]);

impl Plane {
    /// Least squares; `None` when a sample is missing.
    fn fit(
        points: impl Iterator<Item = [f64; 2]>,
        sample: impl Fn([f64; 2]) -> Option<f64>,
    ) -> Option<Self> {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for [u, v] in points {
            let row = nalgebra::Vector3::new(1.0, u, v);
            normal += row * row.transpose();
            right += row * sample([u, v])?;
        }
        let solution = normal.try_inverse()? * right;
        Some(Self([solution.x, solution.y, solution.z]))
    }

    fn at(&self, [u, v]: [f64; 2]) -> f64 {
        self.0[0] + self.0[1] * u + self.0[2] * v
    }
}
