//! Verification of every tile and every cell of a tag, pixel by pixel.
//!
//! This is independent of detection, and stricter: it finds a cell that decoding would correct, and a hairline or
//! spot inside a tile.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec2;

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

    /// Counts wrong pixels by cell; the key `None` is the area around the cells, or a plain tile.
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
        // Extent of a circle along the tile's heights, as fractions of them.
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
                // A plain tile has one colour wherever its edges are far enough away.
                let is_far = expected.tag.is_none() && clear_of_edges(p);
                let is_uniform = |around: &[DVec2], step: usize| {
                    is_far
                        || around.iter().step_by(step).all(|&off| {
                            let q = p + off;
                            inside(q) && black_at(q) == black
                        })
                };
                // A circle alone would miss cells narrower than it.
                let is_wrong = error > MAX_INK_ERROR
                    && is_uniform(&around, 1)
                    && (error > most_at_edges || is_uniform(&further, 1));
                // Most pixels are right, and those need no closer examination.
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
        // Cells too small to contain a pixel clear of their edges are judged by their centres.
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
