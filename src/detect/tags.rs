//! Reading tags out of tiles.

use super::grow::SaddleGrid;
use super::small_cells;
use super::tile_map::TileMap;
use crate::family::{Decoded, Decoder, Family};
use crate::lattice::{GridKind, TagCells, Tile};
use crate::raster::{Gray, Intensity};
use crate::target::{Panel, TagsIn};

/// Where the white beside an edge is sampled: distance from the edge in barycentric units.
const OUTSIDE: f64 = 0.12;

/// Places along an edge where white and border are sampled.
const ALONG: [f64; 3] = [0.3, 0.5, 0.7];

/// The border must be darker than the white by this part of the contrast of the tile's corners.
const MIN_CONTRAST: f64 = 0.5;

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
    /// Bits as cells of the tile in the coordinates of [`Tile::frame`].
    pub word: u64,
    /// The nearest code, where one is near enough.
    pub decoded: Option<Decoded>,
}

/// How the tags of a panel lie in their tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagPlace {
    /// Width of the border, bit-widths along the edge.
    border_bits: f64,
    /// Blank between the edges of the tile and the border.
    margin_bits: f64,
    tags_in: TagsIn,
}

impl TagPlace {
    /// That of the tags of `panel`.
    pub fn of(panel: &Panel) -> Self {
        let border_bits = panel.border_bits.unwrap_or(1.0);
        Self { border_bits, margin_bits: panel.tag_margin_bits(), tags_in: panel.tags_in }
    }
}

/// Reads the tags of one family that lie alike in their tiles.
#[derive(Clone, Debug)]
pub struct TagReader {
    cells: TagCells,
    tags_in: TagsIn,
    /// Where the white around the border is sampled, inside the tile's edges in tile coordinates;
    /// negative is outside.
    white_at: f64,
    /// Where the border is sampled.
    border_at: f64,
    /// Centre of each bit's cell, and the points of the cell that are averaged: its centre, and
    /// half-way from there to its corners.
    samples: Vec<([f64; 2], Vec<[f64; 2]>)>,
    /// Border and margin together, bit-widths.
    inset_bits: f64,
    decoder: Decoder,
    max_errors: u32,
}

impl TagReader {
    /// A reader for tags that lie so in their tiles; corrects up to `max_errors` bits.
    pub fn new(family: &Family, place: TagPlace, max_errors: u32) -> Self {
        let TagPlace { border_bits, margin_bits, tags_in } = place;
        let cells = family.cells();
        let inset = margin_bits + border_bits;
        let width = cells.width(inset);
        let samples = |bit: u32| {
            let centre = cells.centre(bit, inset);
            let half_way = |c: [f64; 2]| [0, 1].map(|i| (c[i] + centre[i]) / 2.0);
            let corners = cells.corners(bit, inset).into_iter().map(half_way);
            (centre, std::iter::once(centre).chain(corners).collect())
        };
        Self {
            tags_in,
            inset_bits: inset,
            white_at: match tags_in {
                TagsIn::Black => -OUTSIDE,
                TagsIn::White => 0.5 * margin_bits / width,
            },
            border_at: (margin_bits + 0.5 * border_bits) / width,
            samples: (0..cells.dimension().bits()).map(samples).collect(),
            decoder: Decoder::new(family),
            max_errors,
            cells,
        }
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
    /// white around it: tiles of the right colour as they are, others as tags of an inverted board.
    pub fn read_all<T: Intensity>(&self, image: &Gray<T>, grid: &SaddleGrid) -> Vec<Reading> {
        let tiles = grid.keys().flat_map(|&v| self.cells.kind().tiles_at(v));
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
        let kind = self.cells.kind();
        let around = Plane::fit(edge_points(kind, self.white_at), sample)?;
        let border = Plane::fit(edge_points(kind, self.border_at), sample)?;
        let contrast = around.at(kind.middle()) - border.at(kind.middle());
        let sign = if tile.is_dark() == (self.tags_in == TagsIn::Black) { 1.0 } else { -1.0 };
        if sign * contrast < MIN_CONTRAST * corner_contrast::<T>(grid, tile) {
            return None;
        }
        let mut word = 0;
        for (bit, (centre, points)) in self.samples.iter().enumerate() {
            let mut sum = 0.0;
            for &point in points {
                sum += sample(point)?;
            }
            let threshold = (around.at(*centre) + border.at(*centre)) / 2.0;
            // A cell of the colour around the border is a 1, on inverted boards as well.
            let one = sign * (sum / points.len() as f64 - threshold) > 0.0;
            word |= u64::from(one) << bit;
        }
        let decode = |word| self.decoder.decode(word, self.max_errors);
        let mut reading = Reading { tile, word, decoded: decode(word) };
        if reading.decoded.is_none()
            && longest_side_px(kind, &map) / self.cells.width(self.inset_bits) < SMALL_CELL_PX
        {
            let levels = |point: [f64; 2]| [border.at(point), around.at(point)];
            let words = SMALL_CELL_BLURS_PX.into_iter().filter_map(|blur_px| {
                small_cells::word(image, &map, &self.cells, self.inset_bits, blur_px, levels)
            });
            let readings = words.map(|word| Reading { tile, word, decoded: decode(word) });
            reading = readings.into_iter().find(|r| r.decoded.is_some()).unwrap_or(reading);
        }
        Some(reading)
    }
}

/// The longest side of a tile, px.
fn longest_side_px(kind: GridKind, map: &TileMap) -> f64 {
    let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|point| map.image_from_tile(point));
    let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    let along = length(a, b).max(length(a, c));
    if kind == GridKind::Deltille { along.max(length(b, c)) } else { along }
}

/// Points along the edges of a tile, `inside` it in tile coordinates (negative: outside).
fn edge_points(kind: GridKind, inside: f64) -> impl Iterator<Item = [f64; 2]> {
    let left = 1.0 - kind.insets() * inside;
    ALONG.into_iter().flat_map(move |t| {
        let t = inside + t * left;
        let far = 1.0 - inside;
        let last: &[[f64; 2]] = match kind {
            GridKind::Deltille => &[[t, far - t]],
            GridKind::Checker => &[[t, far], [far, t]],
        };
        [[t, inside], [inside, t]].into_iter().chain(last.to_vec())
    })
}

/// Contrast between dark and bright around the corners of a tile, in units of the image.
fn corner_contrast<T: Intensity>(grid: &SaddleGrid, tile: Tile) -> f64 {
    let amplitudes = tile.vertices().filter_map(|v| grid.get(&v));
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
