//! Verification of every tile and every cell of a tag, pixel by pixel.
//!
//! This is independent of detection, and stricter: a cell that decoding would correct, a hairline
//! or a spot inside a tile is found.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use glam::DVec2;
use serde::Serialize;

use super::document::{MAX_INK_ERROR, Page};
use super::fit::AffineMap;
use super::marks;
use super::tile_table::TileTable;
use deltille_core::family::{Decoder, Family};
use deltille_core::lattice::{Cell, GridKind, TagCells, Tile, Vertex};
use deltille_core::statistics::median;
use deltille_core::targets::{Panel, TagPlacement};
use deltille_layout::{Placement, SheetLayout, SheetText};

/// Pixels nearer than this to a change of colour are ignored, px: the half diagonal of a pixel
/// (0.71), over which an edge is smeared, 0.02 mm at 300 dpi (0.24), and some blur.
pub(super) const EDGE_PX: f64 = 1.25;

/// Directions in which an edge is looked for beside a pixel: so many that no tip of a tile or cell,
/// of 60°, fits between two of them and reaches the pixel.
pub(super) const PROBES: u32 = 24;

/// Every so many of these are enough to count pixels.
const COARSE: usize = 3;

/// Tiles of one colour are alike where the ink of nine in ten is so near to their median.
const TONE_SPREAD: f64 = 0.1;

/// Tolerance of the positions of edges, px: twice the effect of rounding on edges along pixels, on
/// pages as they are drawn (0.02 mm at 300 dpi), and on pages that are resampled from others.
const MOVED_EDGE_PX: f64 = 0.25;
const SMEARED_MOVED_EDGE_PX: f64 = 0.5;

/// And of edges in a coarse texture, in its pixels: between two of them a picture is interpolated, which moves an edge along
/// rows or columns by up to a tenth, and its ends by more.
const MOVED_EDGE_TEXELS: f64 = 0.35;

/// A deviation of a tile or of the tag in it. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum TileFinding {
    /// A tile has the wrong colour.
    #[error("{}", tile_differs(*row, *col, *should_be_black))]
    TileColour {
        /// Row of its lower-left vertex.
        row: i32,
        /// Column of its lower-left vertex.
        col: i32,
        /// Whether it should be black.
        should_be_black: bool,
    },
    /// Part of a tile has the wrong colour.
    #[error(
        "spot of {area_mm2:.3} mm² at ({:.2}, {:.2}) mm in the tile at row {row} col {col}",
        at_mm.x, at_mm.y
    )]
    Blemish {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// The middle of the spot.
        at_mm: DVec2,
        /// Its area, mm².
        area_mm2: f64,
    },
    /// An edge of a tile, or of a cell in it, is displaced.
    #[error(
        "an edge at ({:.2}, {:.2}) mm in the tile at row {row} col {col} is {:.3} mm beside its \
         place, towards {}",
        at_mm.x, at_mm.y, by_mm.abs(), lighter_or_darker(*by_mm)
    )]
    EdgeMoved {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// Its position.
        at_mm: DVec2,
        /// Displacement, mm, positive where there is more black.
        by_mm: f64,
    },
    /// A tag reads as another one of its family.
    #[error("tag {id} at row {row} col {col} {}", what_reads(*id, *reads))]
    TagReads {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// The id that it reads.
        reads: u32,
        /// Counter-clockwise rotation, in thirds of a turn.
        turns: u8,
    },
    /// A tag has too many wrong cells to be corrected.
    #[error("tag {id} at row {row} col {col} unreadable: {} bits differ", bits.len())]
    TagUnreadable {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit.
        bits: Vec<u32>,
    },
    /// A tag has wrong cells that decoding would correct.
    #[error("tag {id} at row {row} col {col} damaged: {}", bits_differ(bits.len()))]
    TagDamaged {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit.
        bits: Vec<u32>,
    },
    /// A tag on a sheet of single tags is not at its stated position.
    #[error("tag {id} is not where it should be")]
    TagMissing {
        /// Stated id.
        id: u32,
    },
}

impl TileFinding {
    /// The same finding with its position converted to another frame.
    pub(super) fn moved(self, place: impl Fn(DVec2) -> DVec2) -> Self {
        match self {
            Self::Blemish { row, col, at_mm, area_mm2 } => {
                Self::Blemish { row, col, at_mm: place(at_mm), area_mm2 }
            }
            Self::EdgeMoved { row, col, at_mm, by_mm } => {
                Self::EdgeMoved { row, col, at_mm: place(at_mm), by_mm }
            }
            other => other,
        }
    }
}

/// The reading of a tag in words, where it differs.
fn what_reads(id: u32, reads: u32) -> String {
    if id == reads { "is turned".to_owned() } else { format!("reads {reads}") }
}

/// The number of differing bits in words.
fn bits_differ(bits: usize) -> String {
    let differ = if bits == 1 { "bit differs" } else { "bits differ" };
    format!("{bits} {differ}")
}

/// In which way a tile has the wrong colour.
fn tile_differs(row: i32, col: i32, should_be_black: bool) -> String {
    match should_be_black {
        true => format!("tile missing at row {row} col {col}"),
        false => format!("tile at row {row} col {col} is black instead of white"),
    }
}

/// To which side an edge lies that is so far beside its place, positive where more is black.
fn lighter_or_darker(by_mm: f64) -> &'static str {
    if by_mm > 0.0 { "white" } else { "black" }
}

/// Counted pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    checked: usize,
    wrong: usize,
    /// Sum of the positions of wrong pixels.
    moment: DVec2,
}

impl Tally {
    fn mostly_wrong(&self) -> bool {
        2 * self.wrong > self.checked
    }
}

/// The expected appearance of a tile.
pub(super) struct Expected<'a> {
    /// Black, as a whole or around its tag.
    black: bool,
    /// Black and white are exchanged.
    inverted: bool,
    tag: Option<ExpectedTag<'a>>,
}

impl Expected<'_> {
    /// Whether the tile is black at tile coordinates.
    pub fn is_black_at(&self, p: DVec2) -> bool {
        let Some(tag) = &self.tag else { return self.black };
        match tag.looks.region(p) {
            Region::Margin => self.black,
            Region::Border => !self.inverted,
            Region::Hole => self.inverted,
            Region::Cell(bit) => (tag.word >> bit & 1 == 0) != self.inverted,
        }
    }
}

/// The expected appearance of all tiles of a panel; `family` is that of its tiling.
pub(super) fn expected<'a>(
    panel: &Panel,
    family: Option<&Family>,
    looks: Option<&'a TagLooks>,
) -> BTreeMap<Tile, Expected<'a>> {
    let tags: BTreeMap<Tile, TagPlacement> =
        panel.tags.iter().map(|tag| (panel.tag_tile(tag), *tag)).collect();
    let expected = panel.tiles().into_iter().map(|tile| {
        let tag = tags.get(&tile).and_then(|&placement| {
            let word = family?.code(placement.id)?;
            Some(ExpectedTag { placement, word, looks: looks? })
        });
        let inverted = panel.inverted;
        (tile, Expected { black: tile.is_dark() != inverted, inverted, tag })
    });
    expected.collect()
}

/// The colours of a panel at any point.
pub(super) struct Pattern<'a> {
    panel: &'a Panel,
    table: TileTable<&'a Expected<'a>>,
}

impl<'a> Pattern<'a> {
    pub fn new(panel: &'a Panel, expected: &'a BTreeMap<Tile, Expected<'a>>) -> Self {
        let table = TileTable::new(expected.iter().map(|(&tile, expected)| (tile, expected)));
        Self { panel, table }
    }

    /// Whether a point of the panel, in edges, lies in a tile.
    pub fn has_tile_at(&self, at: DVec2) -> bool {
        self.table.get(self.panel.tile_at(at)).is_some()
    }

    /// Whether the panel is black at a point, in edges. Outside the tiles that is the colour of its field.
    pub fn is_black_at(&self, at: DVec2) -> bool {
        let tile = self.panel.tile_at(at);
        let Some(expected) = self.table.get(tile) else { return self.panel.inverted };
        if expected.tag.is_none() {
            return expected.black;
        }
        let [a, b, c] = tile.frame().map(|vertex| self.panel.position(vertex));
        let (ab, ac, p) = (b - a, c - a, at - a);
        expected.is_black_at(DVec2::new(p.perp_dot(ac), ab.perp_dot(p)) / ab.perp_dot(ac))
    }
}

struct ExpectedTag<'a> {
    placement: TagPlacement,
    word: u64,
    looks: &'a TagLooks,
}

/// The places of the cells of the tags of a panel, in tile coordinates.
pub(super) struct TagLooks {
    cells: TagCells,
    /// From the edges of the tile to the border, and to the cells, bit-widths.
    margin: f64,
    inset: f64,
    width: f64,
    /// Radius of the hole in the middle of a triangle, edges.
    hole: Option<f64>,
    /// Bit of each cell, in rows of `columns` places, two to a column: inverted, upright.
    bits: Vec<Option<u32>>,
    columns: usize,
}

/// A part of a tile with a tag.
#[derive(Clone, Copy, PartialEq)]
enum Region {
    Margin,
    Border,
    Cell(u32),
    Hole,
}

impl TagLooks {
    pub fn new(family: &Family, panel: &Panel) -> Self {
        let cells = family.cells();
        let (margin, inset) = (panel.tag_margin_bits(), panel.tag_inset_bits());
        let most = |of: fn(&Cell) -> u32| {
            cells.cells().iter().map(of).max().map_or(0, |most| most as usize + 1)
        };
        let columns = most(|cell| cell.col);
        let mut bits = vec![None; most(|cell| cell.row) * columns * 2];
        for (bit, cell) in (0..).zip(cells.cells()) {
            let place = cell.row as usize * columns + cell.col as usize;
            bits[2 * place + usize::from(cell.upright)] = Some(bit);
        }
        let width = cells.width(inset);
        let hole = panel.hole_mm.map(|diameter| diameter / 2.0 / panel.edge_mm);
        Self { cells, margin, inset, width, hole, bits, columns }
    }

    /// The region at tile coordinates.
    fn region(&self, p: DVec2) -> Region {
        if let Some(radius) = self.hole {
            // The edges that the coordinates are along meet at 60°.
            let from_middle = p - 1.0 / 3.0;
            let squared = from_middle.length_squared() + from_middle.x * from_middle.y;
            if squared < radius * radius {
                return Region::Hole;
            }
        }
        if let Some(bit) = self.bit(p) {
            return Region::Cell(bit);
        }
        // Only squares have a margin.
        let margin = self.margin / self.width;
        match p.min_element() >= margin && p.max_element() <= 1.0 - margin {
            true => Region::Border,
            false => Region::Margin,
        }
    }

    /// The bit of the cell at tile coordinates (u, v); `None` beside the cells.
    fn bit(&self, p: DVec2) -> Option<u32> {
        let DVec2 { x: u, y: v } = p * self.width - self.inset;
        if u < 0.0 || v < 0.0 {
            return None;
        }
        let upright = self.cells.kind() == GridKind::Checker || u.fract() + v.fract() < 1.0;
        let (row, col) = (v as usize, u as usize);
        if col >= self.columns {
            return None;
        }
        let place = row * self.columns + col;
        self.bits.get(2 * place + usize::from(upright)).copied().flatten()
    }
}

/// The outcome for one panel.
#[derive(Debug, Default)]
pub(super) struct TileReport {
    pub findings: Vec<TileFinding>,
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
    /// Where the panel's x axis points on the page.
    along: DVec2,
    /// The corners of rectangles around texts where they are stated, px: what is in them is compared by itself.
    texts: Vec<[DVec2; 4]>,
}

impl<'a> PlacedPanel<'a> {
    pub fn new(
        page: &'a Page,
        panel: &'a Panel,
        placement: &'a Placement,
        found_from_stated: AffineMap,
    ) -> Self {
        let along = DVec2::from_angle(placement.angle_rad);
        Self { page, panel, placement, found_from_stated, along, texts: Vec::new() }
    }

    /// The same among the texts of its sheet, some of which may stand in its tiles.
    pub fn among(mut self, layout: &SheetLayout) -> Self {
        let [left, lower, right, upper] = self.panel.bounds_mm();
        let rectangle = |text: &SheetText| {
            let first = self.panel_from_page(text.at_mm);
            let inside = (left..right).contains(&first.x) && (lower..upper).contains(&first.y);
            inside.then(|| marks::rectangle_px(self.page, text))?
        };
        self.texts = layout.texts.iter().filter_map(rectangle).collect();
        self
    }

    /// Whether a pixel belongs to a text, or one within `near_px` of it.
    pub fn is_text(&self, px: DVec2, near_px: f64) -> bool {
        self.texts.iter().any(|corners| {
            (0..4).all(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                // Counter-clockwise on the page, so clockwise in the picture.
                (b - a).normalize_or_zero().perp_dot(px - a) <= near_px
            })
        })
    }

    /// Stated page position of a point of the panel.
    pub fn page_from_panel(&self, point: DVec2) -> DVec2 {
        self.along.rotate(point) + self.placement.origin_mm
    }

    /// Stated panel position of a point of the page.
    pub fn panel_from_page(&self, point: DVec2) -> DVec2 {
        let back = DVec2::new(self.along.x, -self.along.y);
        back.rotate(point - self.placement.origin_mm)
    }

    /// The ink of the tiles that should be white and black, in the middle of plain tiles; `None`
    /// where those of one colour are not alike, so that the picture shows something else.
    pub fn tones(&self) -> Option<[f64; 2]> {
        let tagged: BTreeSet<Tile> =
            self.panel.tags.iter().map(|tag| self.panel.tag_tile(tag)).collect();
        let mut inks = [Vec::new(), Vec::new()];
        for tile in self.panel.tiles() {
            if tagged.contains(&tile) {
                continue;
            }
            let [a, b, c] = self.frame_px(tile);
            let DVec2 { x: u, y: v } = self.panel.kind.middle();
            let centre = a + u * (b - a) + v * (c - a);
            if self.is_text(centre, 0.0) {
                continue;
            }
            inks[usize::from(tile.is_dark() != self.panel.inverted)].push(self.page.ink(centre));
        }
        let tone = |inks: &Vec<f64>| {
            let median = median(inks.clone())?;
            let alike = inks.iter().filter(|ink| (*ink - median).abs() <= TONE_SPREAD).count();
            (10 * alike >= 9 * inks.len()).then_some(median)
        };
        let [white, black] = &inks;
        Some([tone(white)?, tone(black)?])
    }

    /// Picture positions of a tile's A, B and C.
    fn frame_px(&self, tile: Tile) -> [DVec2; 3] {
        tile.frame().map(|vertex| self.px_of(vertex))
    }

    /// Picture position of a vertex.
    pub fn px_of(&self, vertex: Vertex) -> DVec2 {
        let stated = self.page_from_panel(self.panel.lattice_mm(vertex));
        self.page.px_from_page(self.found_from_stated.apply(stated))
    }

    /// Compares all tiles of the panel.
    pub fn check_tiles(&self, family: Option<&Family>) -> TileReport {
        let family = family.and_then(|family| family.of_tiling(self.panel.kind));
        let looks = family.map(|family| TagLooks::new(family, self.panel));
        // Needed only where something is wrong.
        let decoder = OnceCell::new();
        let mut report = TileReport::default();
        let expected = expected(self.panel, family, looks.as_ref());
        for (&tile, expected) in &expected {
            let tally = self.compare(tile, expected);
            report.tiles += 1;
            self.judge(tile, expected, &tally, family, &decoder, &mut report);
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

    /// Counts wrong pixels, by cell; the key `None` is what is around the cells, or a plain tile.
    fn compare(&self, tile: Tile, expected: &Expected) -> BTreeMap<Option<u32>, Tally> {
        let [a, b, c] = self.frame_px(tile);
        let (ab, ac) = (b - a, c - a);
        let det = ab.perp_dot(ac);
        let uv = |p: DVec2| DVec2::new(p.perp_dot(ac), ab.perp_dot(p)) / det;
        let circle = |radius_px: f64| -> Vec<DVec2> {
            (0..PROBES)
                .map(|i| f64::from(i) * TAU / f64::from(PROBES))
                .map(|angle| uv(radius_px * DVec2::from_angle(angle)))
                .collect()
        };
        let (around, further) = (circle(EDGE_PX), circle(EDGE_PX + self.page.smear_px));
        let most_at_edges = self.page.max_ink_error_at_edges();
        let bit = |p: DVec2| expected.tag.as_ref().and_then(|tag| tag.looks.bit(p));
        let black_at = |p: DVec2| expected.is_black_at(p);
        let inside = |DVec2 { x: u, y: v }: DVec2| match self.panel.kind {
            GridKind::Deltille => u >= 0.0 && v >= 0.0 && u + v <= 1.0,
            GridKind::Checker => u >= 0.0 && v >= 0.0 && u <= 1.0 && v <= 1.0,
        };
        // Parts of the tile's heights that a circle reaches.
        let reach = further.iter().fold(DVec2::ZERO, |most, off| most.max(off.abs()));
        let slanting = further.iter().map(|off| off.element_sum().abs()).fold(0.0, f64::max);
        let clear_of_edges = |p: DVec2| {
            let near = p.cmpge(reach).all();
            near && match self.panel.kind {
                GridKind::Deltille => p.element_sum() <= 1.0 - slanting,
                GridKind::Checker => p.cmple(1.0 - reach).all(),
            }
        };
        let fourth = match self.panel.kind {
            GridKind::Deltille => c,
            GridKind::Checker => b + c - a,
        };

        let mut tallies = BTreeMap::<Option<u32>, Tally>::new();
        let image = &self.page.image;
        let low = a.min(b).min(c).min(fourth).ceil();
        let high = a.max(b).max(c).max(fourth).floor() + 1.0;
        let end = |high: f64, size: usize| (high.max(0.0) as usize).min(size);
        for y in low.y.max(0.0) as usize..end(high.y, image.height()) {
            for x in low.x.max(0.0) as usize..end(high.x, image.width()) {
                let position = DVec2::new(x as f64, y as f64);
                let p = uv(position - a);
                if !inside(p) || self.is_text(position, 0.0) {
                    continue;
                }
                let here = bit(p);
                let black = black_at(p);
                let found = 1.0 - f64::from(image.at(x, y)) / 255.0;
                let error = (found - f64::from(u8::from(black))).abs();
                // A plain tile is of one colour wherever its edges are far enough.
                let is_far = expected.tag.is_none() && clear_of_edges(p);
                let is_uniform = |around: &[DVec2], step: usize| {
                    is_far
                        || around.iter().step_by(step).all(|&off| {
                            let q = p + off;
                            inside(q) && black_at(q) == black
                        })
                };
                let is_wrong = error > most_at_edges && is_uniform(&around, 1)
                    || error > MAX_INK_ERROR && is_uniform(&further, 1);
                // Most pixels are right, and those that are need not be looked at as closely.
                if !is_wrong && !is_uniform(&around, COARSE) {
                    continue;
                }
                let tally = tallies.entry(here).or_default();
                tally.checked += 1;
                if is_wrong {
                    tally.wrong += 1;
                    tally.moment += position;
                }
            }
        }
        // Cells too small for a pixel clear of their edges are judged by their centres.
        if let Some(tag) = &expected.tag {
            for bit in 0..tag.looks.cells.dimension().bits() {
                tallies.entry(Some(bit)).or_insert_with(|| {
                    let centre = tag.looks.cells.centre(bit, tag.looks.inset);
                    let at = a + centre.x * ab + centre.y * ac;
                    let wrong = (self.page.ink(at) > 0.5) != black_at(centre);
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

/// The finding about a tag whose cells `flipped` have the wrong colour.
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
        Some(read) if (read.id, read.turns) != (id, 0) => {
            TileFinding::TagReads { id, row, col, reads: read.id, turns: read.turns }
        }
        Some(_) => TileFinding::TagDamaged { id, row, col, bits },
        None => TileFinding::TagUnreadable { id, row, col, bits },
    })
}
