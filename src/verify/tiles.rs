//! Every tile and every cell of a tag compared with the picture, pixel by pixel.
//!
//! This is independent of detection, and stricter: a cell that decoding would correct, a hairline
//! or a spot inside a tile is found.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use super::Finding;
use super::document::Page;
use super::fit::AffineMap;
use crate::family::{Decoder, Family};
use crate::lattice::{Orientation, TagCells, Tile, Vertex};
use crate::target::{Panel, Placement, TagPlacement};

/// Pixels nearer than this to a change of colour are left out, px: the half diagonal of a pixel
/// (0.71), over which an edge is smeared, and 0.02 mm at 300 dpi (0.24), and some blur.
pub(super) const EDGE_PX: f64 = 1.25;

/// A pixel is wrong when its ink differs by more than this from 0 or 1.
pub(super) const MAX_INK_ERROR: f64 = 0.3;

/// Tiles of one colour are alike where the ink of nine in ten is so near to their median.
const TONE_SPREAD: f64 = 0.1;

/// Counted pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    checked: usize,
    wrong: usize,
    /// Sum of the positions of wrong pixels.
    moment: [f64; 2],
}

impl Tally {
    fn mostly_wrong(&self) -> bool {
        2 * self.wrong > self.checked
    }
}

/// What a tile should look like.
struct Expected<'a> {
    black: bool,
    tag: Option<ExpectedTag<'a>>,
}

struct ExpectedTag<'a> {
    placement: TagPlacement,
    word: u64,
    looks: &'a TagLooks,
}

/// Where the cells of a panel's tags are, in tile coordinates.
pub(super) struct TagLooks {
    cells: TagCells,
    border: f64,
    width: f64,
    /// Bit of each cell, by (row, column, upright).
    bits: BTreeMap<(u32, u32, bool), u32>,
}

impl TagLooks {
    pub fn new(family: &Family, border: f64) -> Self {
        let cells = TagCells::new(family.dimension());
        let bits = cells.cells().iter().enumerate();
        let bits = bits.map(|(bit, c)| ((c.row, c.col, c.upright), bit as u32)).collect();
        let width = f64::from(family.dimension().rows()) + 3.0 * border;
        Self { cells, border, width, bits }
    }

    /// The bit of the cell at tile coordinates (u, v); `None` on the border.
    fn bit(&self, [u, v]: [f64; 2]) -> Option<u32> {
        let (u, v) = (u * self.width - self.border, v * self.width - self.border);
        if u < 0.0 || v < 0.0 {
            return None;
        }
        let upright = u.fract() + v.fract() < 1.0;
        self.bits.get(&(v as u32, u as u32, upright)).copied()
    }
}

/// The outcome for one panel.
#[derive(Debug, Default)]
pub(super) struct TileReport {
    pub findings: Vec<Finding>,
    pub tags_exact: usize,
    pub tiles: usize,
    /// Tiles of the wrong colour.
    pub wrong_tiles: usize,
}

/// A panel on its page, as found.
pub(super) struct PlacedPanel<'a> {
    pub page: &'a Page,
    pub panel: &'a Panel,
    pub placement: &'a Placement,
    /// From stated to found page positions.
    pub found_from_stated: AffineMap,
}

impl PlacedPanel<'_> {
    /// Stated page position of a point of the panel.
    pub fn page_from_panel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.placement.angle_rad.sin_cos();
        let [ox, oy] = self.placement.origin_mm;
        [cos * x - sin * y + ox, sin * x + cos * y + oy]
    }

    /// Stated panel position of a point of the page.
    pub fn panel_from_page(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.placement.angle_rad.sin_cos();
        let [ox, oy] = self.placement.origin_mm;
        let (x, y) = (x - ox, y - oy);
        [cos * x + sin * y, cos * y - sin * x]
    }

    /// The ink of the tiles that should be white and black, in the middle of plain tiles; `None`
    /// where those of one colour are not alike, so that the picture shows something else.
    pub fn tones(&self) -> Option<[f64; 2]> {
        let tagged: BTreeSet<Vertex> =
            self.panel.tags.iter().map(|tag| Vertex::new(tag.row, tag.col)).collect();
        let mut inks = [Vec::new(), Vec::new()];
        for tile in self.tiles() {
            let upright = tile.orientation == Orientation::Upright;
            if upright && tagged.contains(&tile.anchor) {
                continue;
            }
            let [a, b, c] = self.vertices_px(tile);
            let centre = [0, 1].map(|i| (a[i] + b[i] + c[i]) / 3.0);
            inks[usize::from(upright != self.panel.inverted)].push(self.page.ink(centre));
        }
        let tone = |inks: &mut Vec<f64>| {
            inks.sort_by(f64::total_cmp);
            let median = *inks.get(inks.len() / 2)?;
            let alike = inks.iter().filter(|ink| (*ink - median).abs() <= TONE_SPREAD).count();
            (10 * alike >= 9 * inks.len()).then_some(median)
        };
        let [white, black] = &mut inks;
        Some([tone(white)?, tone(black)?])
    }

    /// Picture positions of a tile's vertices.
    fn vertices_px(&self, tile: Tile) -> [[f64; 2]; 3] {
        tile.vertices().map(|v| {
            let stated = self.page_from_panel(v.position().map(|x| x * self.panel.edge_mm));
            self.page.px_from_page(self.found_from_stated.apply(stated))
        })
    }

    /// Compares all tiles of the panel.
    pub fn check_tiles(&self, family: Option<&Family>) -> TileReport {
        let looks = family.map(|f| TagLooks::new(f, self.panel.border_bits.unwrap_or_default()));
        let tags: BTreeMap<Vertex, TagPlacement> =
            self.panel.tags.iter().map(|t| (Vertex::new(t.row, t.col), *t)).collect();
        // Needed only where something is wrong.
        let decoder = OnceCell::new();
        let mut report = TileReport::default();
        for tile in self.tiles() {
            let upright = tile.orientation == Orientation::Upright;
            let tag = tags.get(&tile.anchor).filter(|_| upright).and_then(|&placement| {
                let word = family?.code(placement.id)?;
                Some(ExpectedTag { placement, word, looks: looks.as_ref()? })
            });
            let expected = Expected { black: upright != self.panel.inverted, tag };
            let tally = self.compare(tile, &expected);
            report.tiles += 1;
            self.judge(tile, &expected, &tally, family, &decoder, &mut report);
        }
        report
    }

    /// The drawn tiles, and all tiles of the other colour that touch a corner.
    pub fn tiles(&self) -> BTreeSet<Tile> {
        let mut tiles: BTreeSet<Tile> = self.panel.upright_tiles().into_iter().collect();
        for corner in &self.panel.corners {
            let v = Vertex::new(corner.row, corner.col);
            for step in [Vertex::new(0, -1), Vertex::new(-1, 0), Vertex::new(-1, -1)] {
                tiles.insert(Tile::inverted(v + step));
            }
        }
        tiles
    }

    /// Counts wrong pixels, by cell; the key `None` is the border of a tag, or a plain tile.
    fn compare(&self, tile: Tile, expected: &Expected) -> BTreeMap<Option<u32>, Tally> {
        let [a, b, c] = self.vertices_px(tile);
        let (ab, ac) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let det = ab[0] * ac[1] - ab[1] * ac[0];
        let uv = |[x, y]: [f64; 2]| [(x * ac[1] - y * ac[0]) / det, (y * ab[0] - x * ab[1]) / det];
        let around: Vec<[f64; 2]> = (0..8)
            .map(|i| f64::from(i) * std::f64::consts::FRAC_PI_4)
            .map(|angle| uv([EDGE_PX * angle.cos(), EDGE_PX * angle.sin()]))
            .collect();
        let bit = |p: [f64; 2]| expected.tag.as_ref().and_then(|tag| tag.looks.bit(p));
        let ink = |bit: Option<u32>| {
            let white_cell =
                expected.tag.as_ref().zip(bit).is_some_and(|(t, b)| t.word >> b & 1 == 1);
            expected.black != white_cell
        };
        let inside = |[u, v]: [f64; 2]| u >= 0.0 && v >= 0.0 && u + v <= 1.0;

        let mut tallies = BTreeMap::<Option<u32>, Tally>::new();
        let image = &self.page.image;
        let low = |i: usize| a[i].min(b[i]).min(c[i]).ceil().max(0.0) as usize;
        let high = |i: usize, size: usize| {
            ((a[i].max(b[i]).max(c[i]).floor() + 1.0).max(0.0) as usize).min(size)
        };
        for y in low(1)..high(1, image.height()) {
            for x in low(0)..high(0, image.width()) {
                let position = [x as f64, y as f64];
                let p = uv([position[0] - a[0], position[1] - a[1]]);
                if !inside(p) {
                    continue;
                }
                let here = bit(p);
                let black = ink(here);
                let uniform = around.iter().all(|d| {
                    let q = [p[0] + d[0], p[1] + d[1]];
                    inside(q) && ink(bit(q)) == black
                });
                if !uniform {
                    continue;
                }
                let found = 1.0 - f64::from(image.at(x, y)) / 255.0;
                let tally = tallies.entry(here).or_default();
                tally.checked += 1;
                if (found - f64::from(u8::from(black))).abs() > MAX_INK_ERROR {
                    tally.wrong += 1;
                    tally.moment[0] += position[0];
                    tally.moment[1] += position[1];
                }
            }
        }
        // Cells too small for a pixel clear of their edges are judged by their centres.
        if let Some(tag) = &expected.tag {
            for bit in 0..tag.looks.cells.dimension().bits() {
                tallies.entry(Some(bit)).or_insert_with(|| {
                    let [u, v] = tag.looks.cells.centre(bit, tag.looks.border);
                    let at = [0, 1].map(|i| a[i] + u * ab[i] + v * ac[i]);
                    let wrong = (self.page.ink(at) > 0.5) != ink(Some(bit));
                    Tally { checked: 1, wrong: usize::from(wrong), moment: at }
                });
            }
        }
        tallies
    }

    fn judge(
        &self,
        tile: Tile,
        expected: &Expected,
        tallies: &BTreeMap<Option<u32>, Tally>,
        family: Option<&Family>,
        decoder: &OnceCell<Decoder>,
        report: &mut TileReport,
    ) {
        let Vertex { row, col } = tile.anchor;
        let plain = tallies.get(&None).copied().unwrap_or_default();
        if plain.mostly_wrong() {
            report.wrong_tiles += 1;
            report.findings.push(Finding::TileColour { row, col, should_be_black: expected.black });
            return;
        }
        let flipped: Vec<u32> = tallies
            .iter()
            .filter(|(_, tally)| tally.mostly_wrong())
            .filter_map(|(&bit, _)| bit)
            .collect();
        if let Some(tag) = &expected.tag {
            match read_tag(tag, &flipped, family, decoder) {
                Some(finding) => report.findings.push(finding),
                None => report.tags_exact += 1,
            }
        }
        let spots = tallies.values().filter(|tally| !tally.mostly_wrong());
        let spot = spots.fold(Tally::default(), |sum, t| Tally {
            checked: sum.checked + t.checked,
            wrong: sum.wrong + t.wrong,
            moment: [sum.moment[0] + t.moment[0], sum.moment[1] + t.moment[1]],
        });
        if spot.wrong > 0 {
            let n = spot.wrong as f64;
            report.findings.push(Finding::Blemish {
                row,
                col,
                at_mm: self.page.page_from_px(spot.moment.map(|m| m / n)),
                area_mm2: n / self.page.px_per_mm.powi(2),
            });
        }
    }
}

/// What is wrong with a tag whose cells `flipped` have the wrong colour.
fn read_tag(
    tag: &ExpectedTag,
    flipped: &[u32],
    family: Option<&Family>,
    decoder: &OnceCell<Decoder>,
) -> Option<Finding> {
    let TagPlacement { id, row, col } = tag.placement;
    if flipped.is_empty() {
        return None;
    }
    let family = family?;
    let decoder = decoder.get_or_init(|| Decoder::new(family));
    let word = flipped.iter().fold(tag.word, |word, bit| word ^ 1 << bit);
    let bits = flipped.to_vec();
    let decoded = decoder.decode(word, family.correctable());
    Some(match decoded {
        Some(read) if (read.id, read.turns) != (id, 0) => {
            Finding::TagReads { id, row, col, reads: read.id, turns: read.turns }
        }
        Some(_) => Finding::TagDamaged { id, row, col, bits },
        None => Finding::TagUnreadable { id, row, col, bits },
    })
}
