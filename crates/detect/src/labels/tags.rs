//! Reads the tags in tiles: the odds that each cell is white.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::DVec2;

use super::cell_odds::Sample;
use super::grid_light::{GridLight, TagInsets};
use super::joint_cells::JointOdds;
use super::soft_cells::{CellModel, in_tile};
use super::tile_map::TileMap;
use crate::grid::saddle_grid::SaddleGrid;
use deltille_core::family::Family;
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::raster::ImageView;
use deltille_core::targets::{Panel, TagsIn};

/// Minimum contrast at the edges of a tile, relative to that at its corners.
const MIN_CONTRAST: f64 = 0.4;

/// Brightness above the surrounding white from which a sample counts as glare, relative to the
/// contrast. [`GLARE_NOISE`] standard deviations are added to it. Paper is never this bright.
const GLARE: f64 = 0.35;

/// Standard deviations of the noise added to [`GLARE`]. Without them, noise would erase white cells
/// only. Noise seldom exceeds 3σ.
const GLARE_NOISE: f64 = 3.0;

/// Fraction of full scale from which a pixel may be saturated.
const SATURATED: f64 = 0.985;

/// Half the interval over which the map of a tile is differentiated, in tile coordinates. It stays inside the tile,
/// because the centre of a triangle is at a third.
const BESIDE: f64 = 0.25;

/// Range in which shares of white are used as measured; values outside are not noise. Any margin of
/// 0.25 to 4 beyond black and white gives the same tags. Without a margin, 1.5 % fewer tags are
/// read, because noise exceeds the range.
const SHARES: [f64; 2] = [-0.5, 1.5];

/// The cells of a tile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reading {
    /// The tile, in the grid's vertices.
    pub tile: Tile,
    /// Half the log-odds that a cell has the colour around the border, by bit in the coordinates of [`Tile::frame`].
    pub half_odds: Vec<f32>,
    /// Whether a corner of the tile is hidden, so that it may lie beyond the panel.
    pub has_hidden: bool,
    /// Joint odds of the cells, if they are not known one by one.
    pub joint: Option<JointOdds>,
}

impl Reading {
    /// Returns the most likely word.
    pub(crate) fn word(&self) -> u64 {
        self.half_odds.iter().rev().fold(0, |word, odds| word << 1 | u64::from(*odds > 0.0))
    }

    /// Returns the information in the cells, bits: one for each certain cell, none for each
    /// undetermined cell.
    pub(crate) fn information_bits(&self) -> f64 {
        let known = |&half_odds: &f32| {
            let wrong = 1.0 / (1.0 + (2.0 * f64::from(half_odds.abs())).exp());
            let right = 1.0 - wrong;
            1.0 + right * right.log2() + wrong * wrong.max(f64::MIN_POSITIVE).log2()
        };
        self.half_odds.iter().map(known).sum()
    }
}

/// Position of the tags of a panel in their tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TagPlace {
    /// Width of the border, bit-widths along the edge.
    border_bits: f64,
    /// Blank margin between the edges of the tile and the border, bit-widths.
    margin_bits: f64,
    tags_in: TagsIn,
    /// Width of every second row and column of tiles, in edges, if these are gaps between tags.
    gap_edges: Option<f64>,
}

impl TagPlace {
    /// Returns the position of tags with a border of `border_bits`.
    pub(crate) fn with(border_bits: f64, tags_in: TagsIn) -> Self {
        Self { border_bits, margin_bits: tags_in.margin_bits(), tags_in, gap_edges: None }
    }

    /// Returns the position of the tags of `panel`.
    pub(crate) fn of(panel: &Panel) -> Self {
        let border_bits = panel.border_bits.unwrap_or(1.0);
        let (margin_bits, tags_in) = (panel.tag_margin_bits(), panel.tags_in);
        Self { border_bits, margin_bits, tags_in, gap_edges: panel.gap_edges }
    }
}

/// Black and white levels next to the edges of tiles that were read, by vertex and direction.
type EdgeLevels = BTreeMap<(Vertex, usize), Option<[f64; 2]>>;

/// Reads the tags of one family that have the same position in their tiles.
#[derive(Clone, Debug)]
pub(crate) struct TagReader {
    kind: GridKind,
    tags_in: TagsIn,
    gap_edges: Option<f64>,
    model: CellModel,
    insets: TagInsets,
    /// For each bit, the bit whose cell takes its position in a mirror image.
    mirror: Vec<u8>,
    /// Bits of cells that no code uses, and that may contain a hole.
    free: u64,
}

/// Readings of a grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Read {
    /// Tiles that may carry a tag.
    pub readings: Vec<Reading>,
    /// Median length of a bit, px.
    pub bit_px: f64,
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
}

impl TagReader {
    /// Creates a reader for tags in this position.
    pub(crate) fn new(family: &Family, place: TagPlace) -> Self {
        let TagPlace { border_bits, margin_bits, tags_in, gap_edges } = place;
        let cells = family.cells();
        let inset_bits = margin_bits + border_bits;
        let width = cells.width(inset_bits);
        let insets = match tags_in {
            TagsIn::Black => TagInsets { dark: border_bits / width, bright: f64::INFINITY },
            TagsIn::White => TagInsets { dark: f64::INFINITY, bright: margin_bits / width },
        };
        let model = CellModel::new(&cells, inset_bits, margin_bits);
        Self {
            kind: family.kind(),
            tags_in,
            gap_edges,
            model,
            insets,
            mirror: cells.mirror(),
            free: family.free_cells(),
        }
    }

    /// Reads tiles of a grid whose corners are known, or predicted if they are `hidden`. Reads only tiles that may carry
    /// a tag, on an inverted or a normal board. At most `most` tiles are read, spread over the grid.
    pub(crate) fn read(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        hidden: &SaddleGrid,
        inverted: bool,
        most: usize,
    ) -> Read {
        let TagInsets { dark, bright } = self.insets;
        let insets = if inverted { TagInsets { dark: bright, bright: dark } } else { self.insets };
        let Some(light) = GridLight::of(image, grid, self.kind, insets, 0.0) else {
            return Read::default();
        };
        let dark = (self.tags_in == TagsIn::Black) != inverted;
        let mut placed = Cow::Borrowed(grid);
        if !hidden.is_empty() {
            placed.to_mut().extend(hidden);
        }
        let tiles: Vec<Tile> = placed
            .keys()
            .flat_map(|&v| self.kind.tiles_from(v))
            .filter(|tile| tile.is_dark() == dark)
            .filter(|tile| tile.vertices().all(|v| placed.contains_key(&v)))
            .filter(|tile| tile.vertices().any(|v| grid.contains_key(&v)))
            .collect();
        let every = tiles.len().div_ceil(most.max(1)).max(1);
        let mut edges = EdgeLevels::new();
        let mut bits_px = Vec::new();
        let mut readings = Vec::new();
        for &tile in tiles.iter().step_by(every) {
            let map = TileMap::new(&placed, tile, self.gap_edges);
            let read =
                map.and_then(|map| self.read_tile(image, grid, tile, &map, &light, &mut edges));
            if let Some((reading, bit_px)) = read {
                readings.push(reading);
                bits_px.push(bit_px);
            }
        }
        let bit_px = deltille_core::statistics::median(bits_px).unwrap_or(0.0);
        Read { readings, bit_px, blur_px: light.blur_px() }
    }

    /// Returns the word of an untagged tile, which has a single colour.
    pub(crate) fn plain_word(&self) -> u64 {
        match self.tags_in {
            TagsIn::Black => 0,
            TagsIn::White => u64::MAX,
        }
    }

    /// Returns a reading as seen in a mirror.
    pub(crate) fn mirrored(&self, reading: &Reading) -> Reading {
        let tile = reading.tile;
        Reading {
            tile: Tile { anchor: Vertex::new(tile.anchor.col, tile.anchor.row), ..tile },
            half_odds: self.mirror.iter().map(|&bit| reading.half_odds[usize::from(bit)]).collect(),
            has_hidden: reading.has_hidden,
            joint: None,
        }
    }

    fn read_tile(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        tile: Tile,
        map: &TileMap,
        light: &GridLight,
        edges: &mut EdgeLevels,
    ) -> Option<(Reading, f64)> {
        let levels = light.levels(image, grid, tile, edges)?;
        let middle = self.kind.middle();
        let [_, contrast] = levels.at(middle);
        if contrast < MIN_CONTRAST * corner_contrast(image, grid, tile) {
            return None;
        }
        let width = self.model.width();
        let at = |by: DVec2| map.image_from_tile(middle + by);
        let along = [DVec2::X, DVec2::Y].map(|axis| {
            let by = BESIDE * axis;
            (at(by) - at(-by)) / (2.0 * BESIDE * width)
        });
        let blur = in_tile(&light.blur, along, light.noise)?;
        let mixing = self.model.mixing(blur)?;
        let (right, lower) = (image.width() as f64 - 1.0, image.height() as f64 - 1.0);
        // Cells of the colour around the border are 1: the dark ones on inverted boards.
        let inverted = tile.is_dark() != (self.tags_in == TagsIn::Black);
        let full = SATURATED * f64::from(image.full_scale());
        let brightest = 1.0 + GLARE + GLARE_NOISE * light.noise;
        let mut samples = Vec::with_capacity(self.model.points().len());
        for (bit, &point) in self.model.points_by_bit() {
            let DVec2 { x, y } = map.image_from_tile(point);
            let is_free = self.free >> bit & 1 == 1;
            if is_free || !(x >= 0.0 && y >= 0.0 && x <= right && y <= lower) {
                samples.push(Sample::Erased);
                continue;
            }
            let value = f64::from(image.bilinear(x, y));
            let [dark, contrast] = levels.at(point);
            let brightness = (value - dark) / contrast;
            let share = light.share(brightness).clamp(SHARES[0], SHARES[1]) as f32;
            let saturated = value >= full;
            samples.push(if contrast <= 0.0 || contrast.is_nan() || brightness > brightest {
                Sample::Erased
            } else if saturated && light.clipped_share < 1.0 {
                Sample::AtLeast(light.clipped_share as f32)
            } else {
                Sample::Share(share)
            });
        }
        if inverted {
            for sample in &mut samples {
                *sample = match *sample {
                    Sample::Share(share) => Sample::Share(1.0 - share),
                    Sample::AtLeast(share) => Sample::Share(1.0 - share),
                    Sample::Erased => Sample::Erased,
                };
            }
        }
        let joint = self.model.joint_odds(&mixing, &samples);
        let mut half_odds = mixing.half_odds(&samples);
        // Cells in a hole contain no information.
        for (bit, odds) in half_odds.iter_mut().enumerate() {
            if self.free >> bit & 1 == 1 {
                *odds = 0.0;
            }
        }
        let length = |step: DVec2| step.x.hypot(step.y);
        let has_hidden = !tile.vertices().all(|v| grid.contains_key(&v));
        let bit_px = length(along[0]).max(length(along[1]));
        Some((Reading { tile, half_odds, has_hidden, joint }, bit_px))
    }
}

/// Returns the contrast between dark and bright around the corners of a tile, in units of the image.
fn corner_contrast(image: ImageView, grid: &SaddleGrid, tile: Tile) -> f64 {
    let amplitudes = tile.vertices().filter_map(|v| grid.get(&v));
    let least = amplitudes.map(|p| p.amplitude).fold(f64::INFINITY, f64::min);
    2.0 * least * f64::from(image.full_scale() / deltille_core::raster::PYRAMID_FULL_SCALE)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::Detector;
    use deltille_core::camera::{Camera, Pose};
    use deltille_core::family::{Construction, Family, FreeCells, Rules};
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{BoardSpec, TagSpec, Target, TargetSpec};

    use deltille_layout::synth::{Light, scene_of_sheet};
    use deltille_layout::{PaperSpec, Printing};

    /// Returns the ids of the tags read from a printed board of 8 × 10 corners, each with its number of wrong cells.
    fn read_back(printed: &Printing, target: &Target) -> Vec<(u32, u32)> {
        let sheets = printed.draw().unwrap().sheets;
        let scene = scene_of_sheet(printed, &sheets[0], 0);
        let middle = DVec3::new(80.0, 60.0, 0.0);
        let pose = Pose::looking_at(DVec3::new(100.0, 20.0, 340.0), middle, DVec3::Y);
        let light = Light::default().noise(0.01);
        let image = scene.render(&Camera::pinhole(1280, 960, 1.0), &pose, &light);
        let image = image.map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        let detector = Detector::new(target).unwrap();
        let found = detector.detect(&image, "view");
        assert!(found.grids.iter().all(|grid| grid.kind == GridKind::Deltille));
        let tags = found.grids.iter().flat_map(|grid| &grid.tags);
        tags.map(|tag| (tag.id, tag.errors)).collect()
    }

    /// The largest tags, whose cells fill a machine word, are read like others, also on inverted boards.
    #[test]
    fn tags_of_64_cells_are_read() {
        for inverted in [false, true] {
            let tags = TagSpec { family: "d64h12".to_owned(), first_id: 77, ..TagSpec::default() };
            let spec = BoardSpec { tags: Some(tags), inverted, ..BoardSpec::deltille(8, 10, 20.0) };
            let board = Printing::new("board", spec).unwrap();
            let mut read = read_back(&board, &board.target);
            read.sort_unstable();
            let printed = (77..).take(board.target.panels[0].tags.len()).map(|id| (id, 0));
            assert_eq!(read, printed.collect::<Vec<_>>(), "inverted: {inverted}");
        }
    }

    /// All tags of a board are read without an error, for any content of the free cells.
    #[test]
    fn content_of_free_cells_does_not_matter() {
        for like in ["delTag25h7", "delTag36h9"] {
            let like = Family::shipped(like).unwrap();
            let free = FreeCells::Centre.mask(like.dimension());
            let codes: Vec<u64> =
                like.codes().iter().copied().filter(|code| code & free == 0).collect();
            let of = |codes: Vec<u64>, free| {
                let (dimension, distance) = (like.dimension(), like.distance());
                let source = Construction::Imported { source: "a test".to_owned() };
                let rules = Rules { free, ..Rules::NONE };
                Family::new("holed", dimension, distance, codes, rules, source).unwrap()
            };
            let family = of(codes.clone(), Some(FreeCells::Centre));
            let tags = TagSpec { family: "holed".to_owned(), ..TagSpec::default() };
            let spec = BoardSpec { tags: Some(tags), ..BoardSpec::deltille(8, 10, 20.0) };
            let (spec, paper) = (TargetSpec::Board(spec), PaperSpec::default());
            let board = Target::build("board", &spec, Some(&family)).unwrap();
            let tags = board.panels[0].tags.len();
            for shown in [0, free, free & 0x5555_5555_5555, free & 0x0f0f_0f0f_0f0f] {
                // As printed, or with something bright in the hole.
                let printed = of(codes.iter().map(|code| code | shown).collect(), None);
                let printed =
                    Printing::build("board", &spec, Some(&printed), Some(&paper)).unwrap();
                let read = read_back(&printed, &board);
                let read: Vec<u32> = read.into_iter().map(|(_, errors)| errors).collect();
                assert_eq!(read, vec![0; tags], "{} shows {shown:#x}", like.name());
            }
        }
    }
}
