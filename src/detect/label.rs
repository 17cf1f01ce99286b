//! From readings of tags to panels, rows and columns.
//!
//! Every decoded tag proposes how the grid lies on a panel: a motion of the lattice. A proposal is
//! judged by all tags that it puts on readable tiles, not by the tag that made it: each tag that
//! reads as it should counts by how unlikely that is by chance, each that does not counts against.
//! So one false decode, or many, cannot outvote the board.

use std::collections::{BTreeMap, BTreeSet};

use super::detection::DecodedTag;
use super::grow::SaddleGrid;
use super::tags::{Reading, TagPlace, TagReader};
use crate::family::{Family, ball};
use crate::lattice::{GridKind, LatticeMap, Orientation, Tile, Vertex};
use crate::raster::{Gray, Intensity};
use crate::target::{Panel, Target};

/// Evidence against a proposal, in bits, for every tile whose tag does not read as it should: a
/// tag is hidden or spoiled once in sixteen times.
const MISMATCH_BITS: f64 = 4.0;

/// Evidence that must remain, in bits, after the number of ways to be wrong is taken into account.
const MIN_EVIDENCE_BITS: f64 = 6.0;

/// A grid, or a part of one, on a panel of the target.
#[derive(Clone, Debug)]
pub struct Labelled {
    /// Index of the panel in the target.
    pub panel: usize,
    /// Panel vertex of every grid vertex that belongs to it.
    pub vertices: BTreeMap<Vertex, Vertex>,
    /// Tags that agree, in panel vertices.
    pub tags: Vec<DecodedTag>,
}

/// Labels grids with the panels of a tagged target.
#[derive(Clone, Debug)]
pub struct TagLabeller {
    kind: GridKind,
    readers: Vec<TagReader>,
    family: String,
    codes: BTreeMap<u32, u64>,
    panels: Vec<LabelPanel>,
    /// Panel and tile of each tag id.
    places: BTreeMap<u32, Vec<(usize, Tile)>>,
}

#[derive(Clone, Debug)]
struct LabelPanel {
    /// Index into the readers, by where tags lie in their tiles.
    reader: usize,
    corners: BTreeSet<Vertex>,
    tags: BTreeMap<Tile, u32>,
}

impl TagLabeller {
    /// A labeller for the tags of `target`; `None` when it has no tags.
    pub fn new(target: &Target, family: &Family, max_errors: u32) -> Option<Self> {
        let mut tag_places: Vec<TagPlace> = Vec::new();
        let mut places: BTreeMap<u32, Vec<(usize, Tile)>> = BTreeMap::new();
        let mut panels = Vec::new();
        for (index, panel) in target.panels.iter().enumerate() {
            let place = TagPlace::of(panel);
            let reader = tag_places.iter().position(|&p| p == place).unwrap_or_else(|| {
                tag_places.push(place);
                tag_places.len() - 1
            });
            let tags: BTreeMap<Tile, u32> =
                panel.tags.iter().map(|tag| (panel.tag_tile(tag), tag.id)).collect();
            for (&tile, &id) in &tags {
                places.entry(id).or_default().push((index, tile));
            }
            panels.push(LabelPanel { reader, corners: panel_vertices(panel), tags });
        }
        let codes = places
            .keys()
            .filter_map(|&id| Some((id, family.code(id)?)))
            .collect::<BTreeMap<_, _>>();
        let readers =
            tag_places.iter().map(|&place| TagReader::new(family, place, max_errors)).collect();
        (!codes.is_empty()).then_some(Self {
            kind: family.kind(),
            readers,
            family: family.name().to_owned(),
            codes,
            panels,
            places,
        })
    }

    /// The panels in a grid, by the tags read in `image`.
    pub fn label<T: Intensity>(&self, image: &Gray<T>, grid: &SaddleGrid) -> Vec<Labelled> {
        let readings: Vec<BTreeMap<Tile, Reading>> = self
            .readers
            .iter()
            .map(|reader| reader.read_all(image, grid).into_iter().map(|r| (r.tile, r)).collect())
            .collect();
        let mut rest = grid.clone();
        let mut found = Vec::new();
        while let Some(labelled) = self.best(&readings, &rest) {
            rest.retain(|vertex, _| !labelled.vertices.contains_key(vertex));
            found.push(labelled);
        }
        found
    }

    /// The proposal with the most evidence among the corners not yet labelled.
    fn best(&self, readings: &[BTreeMap<Tile, Reading>], grid: &SaddleGrid) -> Option<Labelled> {
        let available = |tile: Tile| tile.vertices().all(|vertex| grid.contains_key(&vertex));
        let mut proposals: BTreeSet<(usize, LatticeMap)> = BTreeSet::new();
        let mut tiles = 0;
        for (reader, readings) in readings.iter().enumerate() {
            for reading in readings.values().filter(|reading| available(reading.tile)) {
                tiles += 1;
                let Some(decoded) = reading.decoded else { continue };
                for &(panel, tile) in self.places.get(&decoded.id).into_iter().flatten() {
                    if self.panels[panel].reader == reader {
                        proposals
                            .insert((panel, panel_from_grid(reading.tile, tile, decoded.turns)));
                    }
                }
            }
        }
        let ways = (usize::from(self.kind.turns()) * tiles * self.codes.len()).max(1);
        let (evidence, panel, map) = proposals
            .into_iter()
            .map(|(panel, map)| {
                let readings = &readings[self.panels[panel].reader];
                (self.evidence(readings, panel, map, &available), panel, map)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0).then((b.1, b.2).cmp(&(a.1, a.2))))?;
        if evidence - (ways as f64).log2() < MIN_EVIDENCE_BITS {
            return None;
        }
        Some(self.labelled(readings, grid, panel, map))
    }

    /// Evidence in bits for a proposal.
    fn evidence(
        &self,
        readings: &BTreeMap<Tile, Reading>,
        panel: usize,
        map: LatticeMap,
        available: &impl Fn(Tile) -> bool,
    ) -> f64 {
        let reader = &self.readers[self.panels[panel].reader];
        let bits = reader.cells().dimension().bits();
        self.expected(panel, map)
            .filter(|&(tile, ..)| available(tile))
            .filter_map(|(tile, id, turns)| Some((readings.get(&tile)?, id, turns)))
            .map(|(reading, id, turns)| match self.errors(reading, id, turns) {
                errors if errors <= reader.max_errors() => {
                    f64::from(bits) - ball(bits, errors).log2()
                }
                _ => -MISMATCH_BITS,
            })
            .sum()
    }

    /// Grid tile, id and turns of every tag of a panel under a proposal.
    fn expected(
        &self,
        panel: usize,
        panel_from_grid: LatticeMap,
    ) -> impl Iterator<Item = (Tile, u32, u8)> {
        let grid_from_panel = panel_from_grid.inverse();
        self.panels[panel].tags.iter().map(move |(&tile, &id)| {
            let on_grid = grid_from_panel.apply_tile(tile);
            let a = grid_from_panel.apply(tile.frame()[0]);
            let turns = on_grid.vertices().position(|v| v == a).unwrap_or(0);
            (on_grid, id, turns as u8)
        })
    }

    /// Differing bits between a reading and the tag `id` turned by `turns`.
    fn errors(&self, reading: &Reading, id: u32, turns: u8) -> u32 {
        let cells = self.readers[0].cells();
        let word =
            (0..turns).fold(self.codes.get(&id).copied().unwrap_or(0), |w, _| cells.rotate(w));
        (word ^ reading.word).count_ones()
    }

    fn labelled(
        &self,
        readings: &[BTreeMap<Tile, Reading>],
        grid: &SaddleGrid,
        panel: usize,
        map: LatticeMap,
    ) -> Labelled {
        let LabelPanel { reader, corners, .. } = &self.panels[panel];
        let vertices = grid
            .keys()
            .map(|&vertex| (vertex, map.apply(vertex)))
            .filter(|(_, on_panel)| corners.contains(on_panel))
            .collect::<BTreeMap<_, _>>();
        let max_errors = self.readers[*reader].max_errors();
        let mut tags: Vec<DecodedTag> = self
            .expected(panel, map)
            .filter(|(tile, ..)| tile.vertices().all(|v| grid.contains_key(&v)))
            .filter_map(|(tile, id, turns)| {
                let errors = self.errors(readings[*reader].get(&tile)?, id, turns);
                let Vertex { row, col } = map.apply_tile(tile).anchor;
                let family = self.family.clone();
                (errors <= max_errors).then_some(DecodedTag { id, family, row, col, errors })
            })
            .collect();
        tags.sort_by_key(|tag| (tag.row, tag.col));
        Labelled { panel, vertices, tags }
    }
}

/// The vertices of a panel's corners.
pub fn panel_vertices(panel: &Panel) -> BTreeSet<Vertex> {
    panel.corners.iter().map(|corner| Vertex::new(corner.row, corner.col)).collect()
}

/// The motion that takes the grid tile to the panel's `tile` when the tag in it is turned
/// counter-clockwise `turns` times, by 120° or 90°, against the grid.
fn panel_from_grid(on_grid: Tile, tile: Tile, turns: u8) -> LatticeMap {
    // The tag's lower-left vertex lies on vertex `turns` of the grid tile, and its lower edge
    // points along step 2·turns, on an inverted tile half a turn further; on a square along step
    // `turns`.
    let kind = tile.kind();
    let steps = kind.steps().len() as i32 / i32::from(kind.turns());
    let half_turn = if on_grid.orientation == Orientation::Inverted { 3 } else { 0 };
    let from = on_grid.vertices().nth(usize::from(turns)).unwrap_or(on_grid.anchor);
    LatticeMap::taking(kind, from, tile.anchor, -(steps * i32::from(turns) + half_turn))
}
