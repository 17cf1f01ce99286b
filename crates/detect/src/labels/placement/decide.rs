//! Selects the placements of a grid that have sufficient evidence and no contradiction.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::labeller::{Budget, LabelPanel, LabelTag, Labelled, TagEvidence, TagLabeller, Way};
use super::likelihood::{PROPOSING, Placement};
use super::motion::panel_from_grid;
use super::sight::Sight;
use crate::grid::gaps::hidden::hidden_corners;
use crate::grid::saddle_grid::{SaddleGrid, mirrored};
use crate::labels::tags::{Read, Reading};
use crate::tiling::{CHECKER, DELTILLE};
use deltille_core::detection::DecodedTag;
use deltille_core::lattice::{GridKind, LatticeMap, Vertex};
use deltille_core::raster::ImageView;

/// Minimum evidence after correction for the number of placements, nats: 6 bits, so that fewer than one in 64 images
/// without the target is labelled. Markov's inequality adds a margin of about ten. For a board of other tags the margin
/// is much larger, because all of them would have to be hidden.
const MIN_EVIDENCE: f64 = 6.0 * std::f64::consts::LN_2;

/// Minimum lead over any other placement that puts the same corners elsewhere, nats.
const MIN_LEAD: f64 = 6.0 * std::f64::consts::LN_2;

/// Evidence from which mirrored placements are not tested, nats.
const BEYOND_DOUBT: f64 = 40.0;

/// Maximum number of placements that are evaluated, best proposals first.
const MAX_PROPOSALS: usize = 64;

/// Maximum number of tiles that are read in a grid. With this many tiles, the evidence is
/// conclusive or worthless.
pub(super) const MAX_TILES: usize = 2000;

/// Time to read a tile from the image, in comparisons of a tile with one word.
const READING_COST: usize = 1000;

/// Placements with sufficient evidence, and the reason if there are no others.
#[derive(Default)]
struct Placed {
    /// The placements, which share no corner of the grid.
    placements: Vec<Placement>,
    /// See [`TagEvidence::is_ambiguous`].
    is_ambiguous: bool,
    /// See [`TagEvidence::contradicted`].
    contradicted: Option<[usize; 2]>,
}

impl TagLabeller {
    /// Identifies the panels in a grid by its tags. Positions are px of `image`. Tiles with hidden corners are read only
    /// if the others do not suffice. `budget` is reduced by the cost; once it is exhausted, no more tiles are read.
    pub(crate) fn label(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        budget: &mut Budget,
    ) -> TagEvidence {
        let evidence = self.label_with(image, grid, &SaddleGrid::new(), budget);
        if !evidence.found.is_empty() || evidence.contradicted.is_some() {
            return evidence;
        }
        let hidden = match self.kind {
            GridKind::Deltille => hidden_corners::<DELTILLE>(grid),
            GridKind::Checker => hidden_corners::<CHECKER>(grid),
        };
        if hidden.is_empty() {
            return evidence;
        }
        let with_hidden = self.label_with(image, grid, &hidden, budget);
        if with_hidden.found.is_empty() { evidence } else { with_hidden }
    }

    fn label_with(
        &self,
        image: ImageView,
        grid: &SaddleGrid,
        hidden: &SaddleGrid,
        budget: &mut Budget,
    ) -> TagEvidence {
        let mut evidence = TagEvidence::default();
        let mut sights = Vec::new();
        for way in self.ways_to_read() {
            let cost = READING_COST + 2 * self.words.len();
            let most = (budget.0 / cost).min(MAX_TILES);
            if most == 0 {
                evidence.is_cut_short = true;
                return evidence;
            }
            let read = self.readers[way.reader].read(image, grid, hidden, way.inverted, most);
            let Read { readings, bit_px, blur_px } = read;
            budget.0 -= readings.len() * cost;
            evidence.tiles += readings.len();
            evidence.bit_px = evidence.bit_px.max(bit_px);
            evidence.blur_px = evidence.blur_px.max(blur_px);
            sights.push(self.sight(way, readings, &mut evidence));
        }
        self.decide(sights, grid, evidence)
    }

    /// Completes the evidence of a grid with the panels that its sights identify. The mirror image
    /// is tested only if the result of the direct image is uncertain.
    pub(super) fn decide(
        &self,
        mut sights: Vec<Sight>,
        grid: &SaddleGrid,
        mut evidence: TagEvidence,
    ) -> TagEvidence {
        let mut placed = self.place(&sights, grid);
        let beyond_doubt = |placed: &Placed| {
            !placed.placements.is_empty()
                && placed.placements.iter().all(|placement| placement.evidence > BEYOND_DOUBT)
        };
        if !beyond_doubt(&placed) {
            let in_mirror: Vec<Sight> = sights
                .iter()
                .map(|sight| {
                    let reader = &self.readers[sight.way.reader];
                    let readings = sight.readings.iter().map(|r| reader.mirrored(r)).collect();
                    let way = Way { mirrored: true, ..sight.way };
                    self.sight(way, readings, &mut TagEvidence::default())
                })
                .collect();
            sights.extend(in_mirror);
            placed = self.place(&sights, grid);
        }
        evidence.is_ambiguous = placed.is_ambiguous;
        evidence.contradicted = placed.contradicted;
        let labelled = |placement: &Placement| self.labelled(&sights, grid, placement);
        evidence.found = placed.placements.iter().map(labelled).collect();
        if evidence.found.is_empty() {
            let needed_bits = (self.family_words.max(1) as f64).log2();
            let is_unread = |reading: &&Reading| reading.information_bits() < needed_bits;
            let as_seen = sights.iter().filter(|sight| !sight.way.mirrored);
            evidence.unread = as_seen.flat_map(|sight| &sight.readings).filter(is_unread).count();
        }
        let mut taken = BTreeSet::new();
        for found in &mut evidence.found {
            found.vertices.retain(|vertex, _| taken.insert(*vertex));
        }
        evidence
    }

    /// Returns the ways to read the target's panels in a direct image.
    fn ways_to_read(&self) -> BTreeSet<Way> {
        let tagged = self.panels.iter().filter(|panel| !panel.tags.is_empty());
        tagged.map(LabelPanel::way).collect()
    }

    /// Returns the placements with sufficient evidence, best first. Each takes its corners from the
    /// grid. The others are evaluated again on the remaining tiles, because several faces of a
    /// solid may lie in one grid.
    fn place(&self, sights: &[Sight], grid: &SaddleGrid) -> Placed {
        let proposals = self.proposals(sights);
        let tiles: usize = sights.iter().map(|sight| sight.readings.len()).sum();
        // Bonferroni correction: the number of possible placements is about the number of tiles times their positions
        // and rotations. By coincidence, the best of n exceeds E with a probability of up to n e^−E.
        let ways = ((tiles * self.ways).max(1) as f64).ln();
        let mut placed = Placed::default();
        let mut taken = BTreeSet::new();
        loop {
            let mut judged: Vec<Placement> = proposals
                .iter()
                .map(|placement| {
                    let sight = &sights[placement.sight];
                    let evidence = self.evidence(sight, placement, &taken) - ways;
                    Placement { evidence, ..*placement }
                })
                .filter(|placement| placement.evidence >= MIN_EVIDENCE)
                .collect();
            judged.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
            let Some((best, others)) = judged.split_first() else {
                if placed.placements.is_empty()
                    && let Some(first) = proposals.first()
                    && first.evidence - ways >= MIN_EVIDENCE
                {
                    placed.contradicted = Some(self.agreement(&sights[first.sight], first));
                }
                break;
            };
            let vertices = self.on_panel(sights, grid, best);
            let rivals =
                others.iter().take_while(|other| other.evidence > best.evidence - MIN_LEAD);
            let is_ambiguous = rivals.into_iter().any(|rival| {
                self.on_panel(sights, grid, rival).keys().any(|v| vertices.contains_key(v))
            });
            // A rejected placement takes its corners, too: no other placement may label them.
            let before = taken.len();
            taken.extend(vertices.into_keys());
            let is_distinct_from_nature = || {
                let over_nature = self.over_nature(&sights[best.sight], best);
                over_nature.is_none_or(|evidence| evidence - ways >= MIN_EVIDENCE)
            };
            if is_ambiguous {
                placed.is_ambiguous = true;
            } else if is_distinct_from_nature() {
                placed.placements.push(*best);
            }
            if taken.len() == before {
                break;
            }
        }
        let mut placements = placed.placements.iter();
        placed.contradicted = placed.contradicted.or_else(|| {
            placements
                .find_map(|placement| self.contradiction(&sights[placement.sight], grid, placement))
        });
        if self.panels_abut && !placed.placements.is_empty() {
            let (surplus, counts) = self.together(sights, &placed.placements);
            if surplus < 0.0 {
                placed.contradicted = Some(counts);
            }
        }
        if placed.contradicted.is_some() {
            placed.placements.clear();
        }
        placed
    }

    /// Returns the placements that single tiles propose, sorted by the evidence of these tiles. The
    /// sum omits evidence against a placement, because it only selects the placements that are
    /// evaluated.
    fn proposals(&self, sights: &[Sight]) -> Vec<Placement> {
        let rotations = self.words.rotations();
        let mut sums: HashMap<(usize, usize, LatticeMap), f64> = HashMap::new();
        for (index, sight) in sights.iter().enumerate() {
            for (reading, evidence) in sight.readings.iter().zip(&sight.evidence) {
                for (word, &evidence) in evidence.iter().enumerate() {
                    if f64::from(evidence) < PROPOSING {
                        continue;
                    }
                    for &(panel, tile) in &self.places[word / rotations] {
                        let Way { reader, inverted, .. } = self.panels[panel].way();
                        if (reader, inverted) == (sight.way.reader, sight.way.inverted) {
                            let map = panel_from_grid(reading.tile, tile, (word % rotations) as u8);
                            *sums.entry((index, panel, map)).or_default() += f64::from(evidence);
                        }
                    }
                }
            }
        }
        let mut proposals: Vec<Placement> = sums
            .into_iter()
            .map(|((sight, panel, map), evidence)| Placement { sight, panel, map, evidence })
            .collect();
        let key = |p: &Placement| (p.sight, p.panel, p.map);
        proposals
            .sort_unstable_by(|a, b| b.evidence.total_cmp(&a.evidence).then(key(a).cmp(&key(b))));
        proposals.truncate(MAX_PROPOSALS);
        proposals
    }

    /// Returns the panel vertex of every grid vertex that a placement maps to a corner of its panel.
    fn on_panel(
        &self,
        sights: &[Sight],
        grid: &SaddleGrid,
        placement: &Placement,
    ) -> BTreeMap<Vertex, Vertex> {
        let is_mirrored = sights[placement.sight].way.mirrored;
        let side = |v: Vertex| if is_mirrored { mirrored(v) } else { v };
        let corners = &self.panels[placement.panel].corners;
        grid.keys()
            .map(|&vertex| (vertex, placement.map.apply(side(vertex))))
            .filter(|(_, on_panel)| corners.contains(on_panel))
            .collect()
    }

    /// Returns the corners and tags of a placement.
    fn labelled(&self, sights: &[Sight], grid: &SaddleGrid, placement: &Placement) -> Labelled {
        let sight = &sights[placement.sight];
        let mut tags: Vec<DecodedTag> = self
            .expected(placement)
            .filter_map(|(tile, LabelTag { id, code }, rotations)| {
                let reading = *sight.index.get(&tile)?;
                let word = self.words.rotations() * code + rotations;
                let errors = (self.words.word(word) ^ sight.readings[reading].word()).count_ones();
                let Vertex { row, col } = placement.map.apply_tile(tile).anchor;
                let family = self.family.clone();
                (sight.evidence[reading][word] > 0.0).then_some(DecodedTag {
                    id,
                    family,
                    row,
                    col,
                    errors,
                })
            })
            .collect();
        tags.sort_by_key(|tag| (tag.row, tag.col));
        Labelled {
            panel: placement.panel,
            mirrored: sight.way.mirrored,
            vertices: self.on_panel(sights, grid, placement),
            tags,
        }
    }
}
