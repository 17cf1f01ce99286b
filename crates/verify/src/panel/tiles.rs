//! Verification of every tile and every cell of a tag, pixel by pixel.
//!
//! This is independent of detection, and stricter: it finds a cell that decoding would correct, and a hairline or
//! spot inside a tile.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use crate::document::page::MAX_INK_ERROR;
use crate::finding::tile::TileFinding;
use crate::panel::pattern::{EDGE_PX, Expected, ExpectedTag, PROBES, TagLooks, expected};
use crate::panel::placed::PlacedPanel;
use deltille_core::family::{Decoder, Family};
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::targets::TagPlacement;

/// Step between counted pixels along each axis, px.
const COARSE: usize = 3;

/// Tolerance of edge positions, px: twice the effect of rounding on edges parallel to the pixel
/// rows, on rendered pages (0.02 mm at 300 dpi) and on pages resampled from others.
const MOVED_EDGE_PX: f64 = 0.25;
const SMEARED_MOVED_EDGE_PX: f64 = 0.5;

/// The same for edges in a coarse texture, in its pixels: interpolation between two of them moves edges along a row
/// or column by up to a tenth, and their ends by more.
const MOVED_EDGE_TEXELS: f64 = 0.35;

/// Counted pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    checked: usize,
    wrong: usize,
    /// Sum of the positions of the wrong pixels.
    moment: DVec2,
}

impl Tally {
    fn of(position: DVec2, is_wrong: bool) -> Self {
        let mut tally = Self::default();
        tally.count(position, is_wrong);
        tally
    }

    fn count(&mut self, position: DVec2, is_wrong: bool) {
        self.checked += 1;
        if is_wrong {
            self.wrong += 1;
            self.moment += position;
        }
    }

    fn mostly_wrong(&self) -> bool {
        2 * self.wrong > self.checked
    }
}

/// The result for one panel.
#[derive(Debug, Default)]
pub(crate) struct TileReport {
    pub findings: Vec<TileFinding>,
    pub tags_exact: usize,
    pub tiles: usize,
    /// Number of tiles of the wrong colour.
    pub wrong_tiles: usize,
}

impl<'a> PlacedPanel<'a> {
    /// Compares all tiles of the panel.
    pub(crate) fn check_tiles(&self, family: Option<&Family>) -> TileReport {
        let family = family.and_then(|family| family.of_tiling(self.panel.kind));
        let looks = family.map(|family| TagLooks::new(family, self.panel));
        // Needed only if something is wrong.
        let decoder = OnceCell::new();
        let mut report = TileReport::default();
        let expected = expected(self.panel, family, looks.as_ref());
        let tallies: Vec<Tallies> = (expected.par_iter())
            .map(|(&tile, expected)| TileInImage::new(self, tile, expected).tallies())
            .collect();
        for ((&tile, expected), tallies) in expected.iter().zip(&tallies) {
            report.tiles += 1;
            self.judge(tile, expected, tallies, family, &decoder, &mut report);
        }
        if report.findings.is_empty() {
            let is_smeared = self.page.smear_px > 0.0;
            let tolerance_px = if is_smeared { SMEARED_MOVED_EDGE_PX } else { MOVED_EDGE_PX };
            let tolerance_px = tolerance_px.max(MOVED_EDGE_TEXELS * self.page.texel_px);
            let moved = self.moved_edges(&expected, tolerance_px);
            report.findings.extend(moved.into_iter().map(|moved| TileFinding::EdgeMoved {
                row: moved.tile.anchor.row,
                col: moved.tile.anchor.col,
                at_mm: moved.at_mm,
                by_mm: moved.by_mm,
            }));
        }
        report
    }

    fn judge(
        &self,
        tile: Tile,
        expected: &Expected,
        tallies: &Tallies,
        family: Option<&Family>,
        decoder: &OnceCell<Decoder>,
        report: &mut TileReport,
    ) {
        let Vertex { row, col } = tile.anchor;
        let plain = tallies.get(&None).copied().unwrap_or_default();
        if plain.mostly_wrong() {
            report.wrong_tiles += 1;
            report.findings.push(TileFinding::TileColour {
                row,
                col,
                should_be_black: expected.black,
            });
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
            moment: sum.moment + t.moment,
        });
        if spot.wrong > 0 {
            let n = spot.wrong as f64;
            report.findings.push(TileFinding::Blemish {
                row,
                col,
                at_mm: self.page.page_from_px(spot.moment / n),
                area_mm2: n / self.page.px_per_mm.powi(2),
            });
        }
    }
}

/// Counted pixels by cell; the key `None` is the area around the cells, or a plain tile.
type Tallies = BTreeMap<Option<u32>, Tally>;

/// A tile in the image.
struct TileInImage<'a> {
    placed: &'a PlacedPanel<'a>,
    expected: &'a Expected<'a>,
    /// Origin and sides of the tile coordinates, px.
    a: DVec2,
    ab: DVec2,
    ac: DVec2,
    /// Positions on circles around a pixel, in tile coordinates: within its smear, and within that of its page.
    around: Vec<DVec2>,
    further: Vec<DVec2>,
    /// Extent of the larger circle along the sides, and along the third side of a triangle.
    reach: DVec2,
    slanting: f64,
}

/// A pixel of a tile.
#[derive(Clone, Copy)]
struct Pixel {
    position: DVec2,
    /// In tile coordinates.
    at: DVec2,
    /// Whether it should be black.
    black: bool,
    /// Difference of its ink.
    error: f64,
}

impl<'a> TileInImage<'a> {
    fn new(placed: &'a PlacedPanel<'a>, tile: Tile, expected: &'a Expected<'a>) -> Self {
        let [a, b, c] = placed.frame_px(tile);
        let mut tile = Self {
            placed,
            expected,
            a,
            ab: b - a,
            ac: c - a,
            around: Vec::new(),
            further: Vec::new(),
            reach: DVec2::ZERO,
            slanting: 0.0,
        };
        let circle = |radius_px: f64| -> Vec<DVec2> {
            (0..PROBES)
                .map(|i| f64::from(i) * TAU / f64::from(PROBES))
                .map(|angle| tile.uv(radius_px * DVec2::from_angle(angle)))
                .collect()
        };
        (tile.around, tile.further) = (circle(EDGE_PX), circle(EDGE_PX + placed.page.smear_px));
        let further = tile.further.iter();
        tile.reach = further.clone().fold(DVec2::ZERO, |most, off| most.max(off.abs()));
        tile.slanting = further.map(|off| off.element_sum().abs()).fold(0.0, f64::max);
        tile
    }

    /// Returns a displacement in the image, px, in tile coordinates.
    fn uv(&self, p: DVec2) -> DVec2 {
        DVec2::new(p.perp_dot(self.ac), self.ab.perp_dot(p)) / self.ab.perp_dot(self.ac)
    }

    fn is_triangle(&self) -> bool {
        self.placed.panel.kind == GridKind::Deltille
    }

    fn contains(&self, DVec2 { x: u, y: v }: DVec2) -> bool {
        let is_below = if self.is_triangle() { u + v <= 1.0 } else { u <= 1.0 && v <= 1.0 };
        u >= 0.0 && v >= 0.0 && is_below
    }

    /// Whether the tile has one colour around a position, as a plain tile has wherever its edges are far enough away.
    fn is_far_from_edges(&self, at: DVec2) -> bool {
        let is_below = match self.is_triangle() {
            true => at.element_sum() <= 1.0 - self.slanting,
            false => at.cmple(1.0 - self.reach).all(),
        };
        self.expected.tag.is_none() && at.cmpge(self.reach).all() && is_below
    }

    /// Whether the tile has the colour of a pixel at each `step`-th of these positions around it.
    fn is_uniform(&self, pixel: &Pixel, around: &[DVec2], step: usize) -> bool {
        self.is_far_from_edges(pixel.at)
            || around.iter().step_by(step).all(|&off| {
                let at = pixel.at + off;
                self.contains(at) && self.expected.is_black_at(at) == pixel.black
            })
    }

    /// Whether a pixel has the wrong colour although no edge is near.
    fn is_wrong(&self, pixel: &Pixel) -> bool {
        // A circle alone would miss cells narrower than it.
        pixel.error > MAX_INK_ERROR
            && self.is_uniform(pixel, &self.around, 1)
            && (pixel.error > self.placed.page.max_ink_error_at_edges()
                || self.is_uniform(pixel, &self.further, 1))
    }

    /// Returns the pixels of the tile that show no text.
    fn pixels(&self) -> impl Iterator<Item = Pixel> {
        let (a, ab, ac) = (self.a, self.ab, self.ac);
        let corners = [a + ab, a + ac, if self.is_triangle() { a } else { a + ab + ac }];
        let low = corners.into_iter().fold(a, DVec2::min);
        let high = corners.into_iter().fold(a, DVec2::max);
        let texts = self.placed.texts_within(low, high);
        let image = &self.placed.page.image;
        let range = |low: f64, high: f64, size: usize| {
            low.ceil().max(0.0) as usize..((high.floor() + 1.0).max(0.0) as usize).min(size)
        };
        let columns = range(low.x, high.x, image.width());
        let places = range(low.y, high.y, image.height())
            .flat_map(move |y| columns.clone().map(move |x| (x, y)));
        places.filter_map(move |(x, y)| {
            let position = DVec2::new(x as f64, y as f64);
            let at = self.uv(position - a);
            if !self.contains(at) || texts.iter().any(|text| text.is_near(position, 0.0)) {
                return None;
            }
            let black = self.expected.is_black_at(at);
            let ink = 1.0 - f64::from(image.at(x, y)) / 255.0;
            let error = (ink - f64::from(u8::from(black))).abs();
            Some(Pixel { position, at, black, error })
        })
    }

    /// Counts pixels by cell. Counts none if all are right.
    fn tallies(&self) -> Tallies {
        let mut tallies = Tallies::new();
        if self.pixels().any(|pixel| self.is_wrong(&pixel)) {
            let bit = |at: DVec2| self.expected.tag.as_ref().and_then(|tag| tag.looks.bit(at));
            for pixel in self.pixels() {
                let is_wrong = self.is_wrong(&pixel);
                if is_wrong || self.is_uniform(&pixel, &self.around, COARSE) {
                    tallies.entry(bit(pixel.at)).or_default().count(pixel.position, is_wrong);
                }
            }
        }
        // Cells too small to contain a pixel clear of their edges are judged by their centres.
        if let Some(tag) = &self.expected.tag {
            for bit in 0..tag.looks.cells.dimension().bits() {
                let centre = tag.looks.cells.centre(bit, tag.looks.inset);
                let position = self.a + centre.x * self.ab + centre.y * self.ac;
                let is_black = self.placed.page.ink(position) > 0.5;
                let is_wrong = is_black != self.expected.is_black_at(centre);
                tallies.entry(Some(bit)).or_insert_with(|| Tally::of(position, is_wrong));
            }
        }
        tallies
    }
}

/// Returns the finding about a tag whose cells `flipped` have the wrong colour.
fn read_tag(
    tag: &ExpectedTag,
    flipped: &[u32],
    family: Option<&Family>,
    decoder: &OnceCell<Decoder>,
) -> Option<TileFinding> {
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
        Some(read) if (read.id, read.rotations) != (id, 0) => {
            TileFinding::TagReads { id, row, col, reads: read.id, rotations: read.rotations }
        }
        Some(_) => TileFinding::TagDamaged { id, row, col, bits },
        None => TileFinding::TagUnreadable { id, row, col, bits },
    })
}
