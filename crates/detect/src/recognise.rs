//! Recognises the target in an image by its tags alone.
//!
//! Tiles of a grid are read as tags of every known family. If the codes of a family are
//! statistically significant, they determine the rotation of the grid. The ids of its tags increase
//! by row and column, so they give the number of tags per row and the width of the board. The
//! result is a guess. It is accepted if the detector labels the image with it: the evidence of the
//! whole board decides, as for a given target.

use std::collections::{BTreeMap, BTreeSet};

use super::detector::Detector;
use super::levels::{MIN_LEVEL_SIDE, levels_of};
use super::tiling::{CHECKER, DELTILLE, kind};
use crate::corners::saddles::SaddleFinder;
use crate::grid::grids::grids;
use crate::grid::saddle_grid::SaddleGrid;
use crate::labels::placement::motion::panel_from_grid;
use crate::labels::tags::{Read, TagPlace, TagReader};
use deltille_core::family::{Decoder, Family};
use deltille_core::lattice::{GridKind, LatticeMap, Tile, Vertex};
use deltille_core::raster::{ImageView, Pyramid};
use deltille_core::targets::{
    BoardSpec, SolidShape, SolidSpec, TagSpec, TagsIn, Target, TargetSpec, board_vertices,
    tagged_tiles,
};

/// Maximum number of grids that are read, the largest first.
const MAX_GRIDS: usize = 4;

/// Minimum number of corners of a grid that is read. A tag needs the corners of its tile and of the
/// neighbouring tiles.
const MIN_CORNERS: usize = 12;

/// Maximum number of tiles that are read in a grid.
const MAX_TILES: usize = 600;

/// Minimum evidence of significant tags, nats. For each way to read the tags, noise exceeds it once
/// in a million.
const MIN_EVIDENCE: f64 = 18.0;

/// Cost of a corner seen beyond a board, relative to a corner of the board that is not seen.
/// Occluders hide corners, but hardly anything looks like a corner. With 3, an outer row is
/// accepted if a quarter of its corners are visible; with 1, it would need half of them.
const COST_BEYOND: usize = 3;

/// Maximum number of rows and columns of a board beyond the visible ones.
const MAX_BEYOND: u32 = 12;

/// Largest tag spacing that is tried.
const WIDEST_SPACING: i32 = 8;

/// One in this many tags may contradict a candidate board.
const ODD_TAGS: usize = 12;

/// A recognised target.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Recognised {
    /// The target. Its edges have the default length, because an image does not show the size of a print.
    pub target: Target,
    /// Number of tags that were read.
    pub tags: usize,
    /// Number of corners of the target, and number of them visible in the image. The board may
    /// extend beyond the image. If the second number is smaller, the actual board may be larger
    /// than this target.
    pub corners: [usize; 2],
}

/// Recognises targets by the tags of given families: a board of any rows, columns and ids, or a solid with default
/// settings.
///
/// ```
/// use deltille_detect::Recogniser;
/// use deltille_core::family::Family;
/// use deltille_core::raster::Gray;
///
/// let recogniser = Recogniser::new(vec![Family::shipped("delTag25h7")?]);
/// assert!(recogniser.recognise(&Gray::<u8>::new(640, 480)).is_none());
/// # Ok::<(), deltille_core::family::FamilyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Recogniser {
    /// Families by layout of cells: tiling and number of bits.
    alike: BTreeMap<(GridKind, u32), Vec<Known>>,
}

/// A family to read.
#[derive(Clone, Debug)]
struct Known {
    family: Family,
    decoder: Decoder,
}

impl Recogniser {
    /// Creates a recogniser of these families.
    pub fn new(families: Vec<Family>) -> Self {
        let mut alike = BTreeMap::<_, Vec<Known>>::new();
        for family in families {
            let decoder = Decoder::new(&family);
            let key = (family.kind(), family.dimension().bits());
            alike.entry(key).or_default().push(Known { family, decoder });
        }
        Self { alike }
    }

    /// Returns the target in an image; `None` if the image shows no tags of a known family.
    pub fn recognise<'a>(&self, image: impl Into<ImageView<'a>>) -> Option<Recognised> {
        let image = image.into();
        let pyramid = Pyramid::new(image, levels_of(image), MIN_LEVEL_SIDE);
        let mut all = self.sightings::<DELTILLE>(image, &pyramid);
        all.extend(self.sightings::<CHECKER>(image, &pyramid));
        all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        all.truncate(MAX_GRIDS);
        let boards = all.iter().filter_map(|seen| Some((seen, TargetSpec::Board(seen.board()?))));
        let solids =
            all.iter().take(1).flat_map(|seen| seen.solids().into_iter().map(move |of| (seen, of)));
        // Two faces of a solid may look like a board, which then has fewer corners.
        let guesses = boards.take(1).chain(solids);
        let known = guesses.filter_map(|(seen, spec)| confirmed(image, seen, spec));
        known.reduce(|best, other| if other.corners[1] > best.corners[1] { other } else { best })
    }
}

/// Builds the guessed target and returns it if the detector labels the image with it.
fn confirmed(image: ImageView, seen: &Sighting, spec: TargetSpec) -> Option<Recognised> {
    let name = match &spec {
        TargetSpec::Solid(solid) => solid.shape.name(),
        _ => "board",
    };
    let target = Target::build(name, &spec, Some(seen.family)).ok()?;
    let detector = Detector::new(&target).ok()?;
    let found = detector.detect(image, "");
    let labelled = found.grids.iter().filter(|grid| grid.panel.is_some());
    let shown: usize = labelled.map(|grid| grid.corners.len()).sum();
    let all = target.panels.iter().map(|panel| panel.corners.len()).sum();
    (shown > 0).then_some(Recognised { target, tags: seen.tags.len(), corners: [all, shown] })
}

/// A tag that was read.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Its tile in the grid.
    tile: Tile,
    id: u32,
    rotations: u8,
}

/// Tags of a family in a grid, all with the same orientation.
struct Sighting<'a> {
    kind: GridKind,
    family: &'a Family,
    border_bits: f64,
    tags_in: TagsIn,
    inverted: bool,
    /// Lower left vertex and id of each tag, in the upright grid.
    tags: Vec<(Vertex, u32)>,
    /// Corners of the upright grid.
    corners: BTreeSet<Vertex>,
    /// Log-likelihood ratio over noise, nats.
    evidence: f64,
}

impl Recogniser {
    /// Reads the grids of a tiling.
    fn sightings<const N: usize>(&self, image: ImageView, pyramid: &Pyramid) -> Vec<Sighting<'_>> {
        let kind = kind::<N>();
        let of_kind = self.alike.iter().filter(|((of, _), _)| *of == kind);
        let alike: Vec<&Vec<Known>> = of_kind.map(|(_, alike)| alike).collect();
        if alike.is_empty() {
            return Vec::new();
        }
        let finder = SaddleFinder::<N>::new();
        let mut found = grids(&finder, pyramid, &finder.find(pyramid), None);
        found.retain(|grid| grid.len() >= MIN_CORNERS);
        found.truncate(MAX_GRIDS);
        let places = match kind {
            GridKind::Deltille => vec![(TagsIn::Black, TagSpec::default().border_bits)],
            GridKind::Checker => [TagsIn::Black, TagsIn::White]
                .map(|tags_in| (tags_in, TagSpec::for_squares(tags_in).border_bits))
                .to_vec(),
        };
        let mut all = Vec::new();
        for families in alike {
            for &(tags_in, border_bits) in &places {
                // The layout of cells is the same, so tiles are read once for all families.
                let place = TagPlace::with(border_bits, tags_in);
                let reader = TagReader::new(&families[0].family, place);
                for (grid, inverted) in found.iter().flat_map(|grid| [(grid, false), (grid, true)])
                {
                    let read = reader.read(image, grid, &SaddleGrid::new(), inverted, MAX_TILES);
                    all.extend(families.iter().filter_map(|known| {
                        let (tags, evidence) = same_orientation(&read, known, &reader)?;
                        let family = &known.family;
                        let way = Way { kind, family, border_bits, tags_in, inverted };
                        Some(way.sighting(&tags, evidence, grid))
                    }));
                }
            }
        }
        all
    }
}

/// A way to read tags.
struct Way<'a> {
    kind: GridKind,
    family: &'a Family,
    border_bits: f64,
    tags_in: TagsIn,
    inverted: bool,
}

impl<'a> Way<'a> {
    /// Returns the tags of a grid, rotated so that the first tag is upright.
    fn sighting(self, seen: &[Seen], evidence: f64, grid: &SaddleGrid) -> Sighting<'a> {
        let Self { kind, family, border_bits, tags_in, inverted } = self;
        let upright = LatticeMap::new(kind, i32::from(turns_of(kind, &seen[0])), Vertex::new(0, 0));
        let at = |seen: &Seen| {
            let lower_left = seen.tile.vertices().nth(usize::from(seen.rotations));
            (upright.apply(lower_left.unwrap_or(seen.tile.anchor)), seen.id)
        };
        let tags = seen.iter().map(at).collect();
        let corners = grid.keys().map(|&v| upright.apply(v)).collect();
        Sighting { kind, family, border_bits, tags_in, inverted, tags, corners, evidence }
    }
}

/// Returns the number of lattice rotations that make a tag upright.
fn turns_of(kind: GridKind, seen: &Seen) -> u8 {
    panel_from_grid(seen.tile, kind.tag_tile(Vertex::new(0, 0)), seen.rotations).rotations()
}

/// Returns the tags of a family that have a common orientation, as they have on a board, and the
/// evidence for them. Returns `None` if they are not significant.
fn same_orientation(
    read: &Read,
    Known { family, decoder }: &Known,
    reader: &TagReader,
) -> Option<(Vec<Seen>, f64)> {
    let chances = family.false_positive_rates();
    let mut by_turns = BTreeMap::<u8, (Vec<Seen>, f64)>::new();
    for reading in &read.readings {
        let word = reading.word();
        if word == reader.plain_word() {
            continue;
        }
        let Some(decoded) = decoder.decode(word, family.correctable() / 2) else { continue };
        let chance = chances.get(decoded.errors as usize).copied().unwrap_or(1.0);
        let seen = Seen { tile: reading.tile, id: decoded.id, rotations: decoded.rotations };
        let (tags, evidence) = by_turns.entry(turns_of(family.kind(), &seen)).or_default();
        tags.push(seen);
        // Some tiles may look like tags by coincidence.
        *evidence -= (chance * read.readings.len() as f64).min(1.0).ln();
    }
    let best = by_turns.into_values().max_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|(tags, evidence)| tags.len() > 1 && *evidence > MIN_EVIDENCE)
}

impl Sighting<'_> {
    fn tag_spec(&self, spacing: u32, first_id: u32) -> TagSpec {
        let (family, border_bits, tags_in) =
            (self.family.name().to_owned(), self.border_bits, self.tags_in);
        TagSpec { family, first_id, spacing, border_bits, tags_in, hole_mm: None }
    }

    /// Returns the smallest board that has these tags at these positions and contains these
    /// corners.
    fn board(&self) -> Option<BoardSpec> {
        let range = |of: fn(&Vertex) -> i32| {
            let least = self.corners.iter().map(of).min()?;
            Some(self.corners.iter().map(of).max()? - least + 1)
        };
        let rows = range(|v| v.row)?;
        let cols = match self.kind {
            GridKind::Checker => range(|v| v.col)?,
            GridKind::Deltille => self.longest_row()?,
        };
        let sizes = |seen: i32| (seen - 2).max(2) as u32..=(seen.max(2) as u32 + MAX_BEYOND);
        let mut best: Option<(usize, BoardSpec)> = None;
        for rows in sizes(rows) {
            for cols in sizes(cols) {
                let vertices = board_vertices(self.kind, rows, cols);
                let board: BTreeSet<Vertex> = vertices.iter().copied().collect();
                for spacing in self.spacings() {
                    let Some((first_id, shift)) = self.laid_on(&vertices, spacing) else {
                        continue;
                    };
                    let on_board =
                        self.corners.iter().filter(|&&v| board.contains(&(v + shift))).count();
                    // Corners seen beyond the board are evidence against it.
                    let cost =
                        board.len() - on_board + COST_BEYOND * (self.corners.len() - on_board);
                    if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                        let spec = BoardSpec {
                            tags: Some(self.tag_spec(spacing as u32, first_id)),
                            inverted: self.inverted,
                            ..BoardSpec::new(self.kind, rows, cols, 1.0)
                        };
                        best = Some((cost, spec));
                    }
                }
            }
        }
        let (_, spec) = best?;
        Some(BoardSpec { edge_mm: BoardSpec::DEFAULT_EDGE_MM, ..spec })
    }

    /// Returns the number of corners in the longest row.
    fn longest_row(&self) -> Option<i32> {
        let mut counts = BTreeMap::<i32, i32>::new();
        self.corners.iter().for_each(|v| *counts.entry(v.row).or_default() += 1);
        counts.into_values().max()
    }

    /// Returns the spacings that fit the positions of the tags.
    fn spacings(&self) -> impl Iterator<Item = i32> + use<> {
        let gcd = |mut a: i32, mut b: i32| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a.abs()
        };
        let (first, _) = self.tags[0];
        let common = self
            .tags
            .iter()
            .fold(0, |common, (at, _)| gcd(gcd(common, at.row - first.row), at.col - first.col));
        (1..=WIDEST_SPACING).filter(move |spacing| common % spacing == 0).rev()
    }

    /// Returns the first id with which a board of these corners explains the tags, and the shift
    /// from the grid to the board.
    fn laid_on(&self, vertices: &[Vertex], spacing: i32) -> Option<(u32, Vertex)> {
        let places = tagged_tiles(self.kind, vertices, spacing as u32, self.tags_in);
        let index: BTreeMap<Vertex, u32> = places.iter().copied().zip(0..).collect();
        let odd = self.tags.len() / ODD_TAGS;
        // At least one of these tags must fit the board.
        self.tags.iter().take(odd + 1).find_map(|&(at, id)| {
            index.iter().find_map(|(&place, &k)| {
                let (first_id, shift) = (id.checked_sub(k)?, place - at);
                let is_there = |&&(at, id): &&(Vertex, u32)| {
                    index.get(&(at + shift)).is_some_and(|k| first_id + k == id)
                };
                let agreeing = self.tags.iter().filter(is_there).count();
                (agreeing > 1 && agreeing + odd >= self.tags.len()).then_some((first_id, shift))
            })
        })
    }

    /// Returns the solids with default settings that may have these tags.
    fn solids(&self) -> Vec<TargetSpec> {
        let usual = TagSpec::default();
        if self.kind != GridKind::Deltille || self.family.name() != usual.family || self.inverted {
            return Vec::new();
        }
        let shapes = [SolidShape::Icosahedron, SolidShape::Octahedron, SolidShape::Tetrahedron];
        let made = shapes.into_iter().filter_map(|shape| {
            let spec = SolidSpec::new(shape);
            let margin_mm = spec.comfortable_margin_mm().ok()?;
            Some(TargetSpec::Solid(SolidSpec { margin_mm, ..spec }))
        });
        made.collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use deltille_core::camera::{Camera, Pose};
    use deltille_core::family::shipped_families;
    use deltille_core::raster::Gray;
    use deltille_layout::synth::{Light, scene_of_target};

    /// Renders an image of a target from a camera at `eye` that points at `at`, mm.
    fn picture(target: &Target, eye: [f64; 3], at: [f64; 3]) -> Gray<f32> {
        let scene = scene_of_target(target).unwrap();
        let pose = Pose::looking_at(DVec3::from(eye), DVec3::from(at), DVec3::Y);
        let camera = Camera::pinhole(1280, 960, 1.0);
        scene.render(&camera, &pose, &Light::default())
    }

    fn board(spec: &BoardSpec) -> Target {
        Target::new("board", spec.clone()).unwrap()
    }

    fn recogniser() -> Recogniser {
        Recogniser::new(shipped_families().map(|of| Family::shipped(of.name).unwrap()).collect())
    }

    fn recognised(target: &Target, eye: [f64; 3], at: [f64; 3]) -> Option<Recognised> {
        recogniser().recognise(&picture(target, eye, at))
    }

    #[test]
    fn boards_are_recognised_with_their_ids_in_any_orientation() {
        let mut with_tags = BoardSpec::deltille(8, 12, 20.0);
        with_tags.tags = Some(TagSpec {
            family: "delTag36h11".to_owned(),
            first_id: 7,
            spacing: 2,
            ..TagSpec::default()
        });
        let mut checker = BoardSpec::new(GridKind::Checker, 7, 10, 20.0);
        checker.tags = Some(TagSpec { first_id: 30, ..TagSpec::for_squares(TagsIn::Black) });
        let mut white = checker.clone();
        white.tags = Some(TagSpec::for_squares(TagsIn::White));
        let inverted = BoardSpec { inverted: true, ..BoardSpec::deltille(9, 10, 20.0) };
        let recogniser = recogniser();
        for spec in [BoardSpec::deltille(10, 11, 20.0), with_tags, checker, white, inverted] {
            let target = board(&spec);
            // From above, and from behind the upper edge: upside down.
            for (eye, up) in [([140.0, 20.0, 330.0], 1.0), ([60.0, 160.0, 350.0], -1.0)] {
                let scene = scene_of_target(&target).unwrap();
                let middle = DVec3::new(120.0, 80.0, 0.0);
                let pose = Pose::looking_at(DVec3::from(eye), middle, up * DVec3::Y);
                let image =
                    scene.render(&Camera::pinhole(1280, 960, 1.0), &pose, &Light::default());
                let found = recogniser.recognise(&image).unwrap_or_else(|| panic!("{spec:?}"));
                assert_eq!(found.target.spec, TargetSpec::Board(spec.clone()));
                let corners = target.panels[0].corners.len();
                let [all, shown] = found.corners;
                assert!(all == corners && shown <= all && shown + 3 > all, "{shown}: {spec:?}");
            }
        }
    }

    #[test]
    fn the_visible_part_of_a_cut_board_is_recognised() {
        let target = board(&BoardSpec::deltille(14, 16, 20.0));
        // The lower left part.
        let found = recognised(&target, [100.0, 70.0, 230.0], [100.0, 70.0, 0.0]).unwrap();
        let TargetSpec::Board(spec) = &found.target.spec else { panic!("not a board") };
        let tags = spec.tags.as_ref().unwrap();
        assert_eq!((tags.family.as_str(), tags.spacing), ("delTag25h7", 3));
        let [all, seen] = found.corners;
        assert!(seen > 45 && seen <= all, "{seen} of {all}");
        // The printed board contains the ids of the tags that were read.
        let ids: BTreeSet<u32> = target.panels[0].tags.iter().map(|tag| tag.id).collect();
        let guessed = &found.target.panels[0].tags;
        assert!(guessed.iter().filter(|tag| ids.contains(&tag.id)).count() >= found.tags);
    }

    #[test]
    fn the_usual_icosahedron_is_recognised() {
        let spec = SolidSpec::new(SolidShape::Icosahedron);
        let margin_mm = spec.comfortable_margin_mm().unwrap();
        let target = Target::new("icosahedron", SolidSpec { margin_mm, ..spec }).unwrap();
        let found = recognised(&target, [150.0, 220.0, 600.0], [0.0, 0.0, 0.0]).unwrap();
        assert!(found.target.panels == target.panels, "{:?}", found.target.spec);
        assert!(found.corners[1] > 100, "{:?}", found.corners);
    }

    #[test]
    fn untagged_boards_are_not_recognised() {
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let target = board(&BoardSpec { tags: None, ..BoardSpec::new(kind, 9, 10, 20.0) });
            let eye = [100.0, 80.0, 330.0];
            assert_eq!(recognised(&target, eye, [100.0, 80.0, 0.0]), None, "{kind:?}");
        }
    }
}
