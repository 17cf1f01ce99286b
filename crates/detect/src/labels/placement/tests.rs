//! Labels of boards whose tiles are read with certainty, in part, or under noise.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::decide::MAX_TILES;
use super::labeller::{Labelled, TagEvidence, TagLabeller, Way};
use super::motion::{panel_from_grid, panel_vertices, turns_of};
use crate::grid::saddle_grid::{PlacedSaddle, SaddleGrid, mirrored};
use crate::labels::tags::Reading;
use deltille_core::family::{Decoder, Family, shipped_names, square_names};
use deltille_core::lattice::{Tile, Vertex};
use deltille_core::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};

/// Noise, as a fraction of full scale, at which more than a tenth of the cells of 4 px per bit are
/// misread.
const NOISE_OF_A_TENTH: f64 = 0.335;

/// Half odds of a certain cell.
const SURE: f32 = 2.6;

/// By the first reader, in a direct image.
const AS_SEEN: Way = Way { reader: 0, inverted: false, mirrored: false };

/// Returns the evidence for `asked` if the tiles of `shown` are read with certainty, in the grid of a direct or
/// mirrored image.
fn found_in(family: &Family, asked: &Target, shown: &Target, flopped: bool) -> TagEvidence {
    found_by(&TagLabeller::new(asked, family, None).unwrap(), family, shown, flopped)
}

/// The same with a given labeller.
fn found_by(labeller: &TagLabeller, family: &Family, shown: &Target, flopped: bool) -> TagEvidence {
    let side = |v: Vertex| if flopped { mirrored(v) } else { v };
    let panel = &shown.panels[0];
    let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
    let grid: SaddleGrid = panel_vertices(panel).into_iter().map(|v| (side(v), placed)).collect();
    let reader = &labeller.readers[0];
    let codes: BTreeMap<Tile, u64> =
        panel.tags.iter().map(|tag| (panel.tag_tile(tag), family.code(tag.id).unwrap())).collect();
    let reading = |tile: Tile| {
        // Untagged tiles are black.
        let code = codes.get(&tile).copied().unwrap_or(0);
        let odds = |bit: u32| if code >> bit & 1 == 1 { SURE } else { -SURE };
        let half_odds = (0..family.dimension().bits()).map(odds).collect();
        let upright = Reading { tile, half_odds, has_hidden: false, joint: None };
        if flopped { reader.mirrored(&upright) } else { upright }
    };
    let whole = |reading: &Reading| reading.tile.vertices().all(|v| grid.contains_key(&v));
    let dark = panel.tiles().into_iter().filter(|tile| tile.is_dark());
    let readings = dark.map(reading).filter(whole).collect();
    let mut evidence = TagEvidence::default();
    let sight =
        labeller.sight(Way { inverted: panel.inverted, ..AS_SEEN }, readings, &mut evidence);
    labeller.decide(vec![sight], &grid, evidence)
}

fn board(family: &Family, first_id: u32) -> Option<Target> {
    board_of(family, [8, 9], TagSpec { first_id, ..TagSpec::default() })
}

fn board_of(family: &Family, [rows, cols]: [u32; 2], tags: TagSpec) -> Option<Target> {
    let mut spec = BoardSpec::new(family.kind(), rows, cols, 20.0);
    spec.tags = Some(TagSpec { family: family.name().to_owned(), ..tags });
    Target::build("board", &TargetSpec::Board(spec), Some(family)).ok()
}

/// Boards of every family with about this many first ids, direct and mirrored.
fn labels_are_those_of_the_print(first_ids: usize) {
    for name in shipped_names().into_iter().chain(square_names()) {
        let family = Family::shipped(name).unwrap();
        let decoder = Decoder::new(&family);
        let step = family.len().div_ceil(first_ids);
        (0..family.len().div_ceil(step)).into_par_iter().for_each(|index| {
            let first_id = index * step;
            let Some(target) = board(&family, first_id as u32) else {
                return;
            };
            let labeller =
                TagLabeller::with_decoder(&target, &family, None, || decoder.clone()).unwrap();
            for flopped in [false, true] {
                let found = found_by(&labeller, &family, &target, flopped).found;
                let of = format!("{name}, first id {first_id}, flopped: {flopped}");
                assert_eq!(found.len(), 1, "{of}");
                assert_eq!(found[0].mirrored, flopped, "{of}");
                let right = |(from, to): (&Vertex, &Vertex)| {
                    *to == if flopped { mirrored(*from) } else { *from }
                };
                assert!(found[0].vertices.iter().all(right), "{of}");
                assert_eq!(found[0].vertices.len(), target.panels[0].corners.len(), "{of}");
            }
        });
    }
}

#[test]
fn flopped_boards_are_recognised() {
    labels_are_those_of_the_print(5);
}

#[test]
#[ignore = "some minutes"]
fn flopped_boards_of_every_first_id_are_recognised() {
    labels_are_those_of_the_print(usize::MAX);
}

/// The same board with other ids of the family is not the target.
#[test]
fn boards_of_other_ids_get_no_labels() {
    for name in shipped_names().into_iter().chain(square_names()) {
        let family = Family::shipped(name).unwrap();
        let asked = board(&family, 0).unwrap();
        let count = asked.panels[0].tags.len() as u32;
        for first_id in [count, 2 * count] {
            let Some(shown) = board(&family, first_id) else {
                continue;
            };
            for flopped in [false, true] {
                let found = found_in(&family, &asked, &shown, flopped).found;
                assert!(found.is_empty(), "{name}, first id {first_id}, {flopped}: {found:?}");
            }
        }
    }
}

/// Boards of the same family and ids, but with other distances between the tags or of another size: if some tags agree,
/// other tiles contradict.
#[test]
fn boards_of_the_same_ids_in_other_positions_get_no_labels() {
    let mut contradicted = 0;
    for name in shipped_names().into_iter().chain(square_names()) {
        let family = Family::shipped(name).unwrap();
        let asked = board(&family, 0).unwrap();
        for (size, spacing) in [([8, 9], 2), ([8, 9], 4), ([8, 9], 5), ([9, 12], 3), ([6, 7], 3)] {
            let tags = TagSpec { spacing, ..TagSpec::default() };
            let Some(shown) = board_of(&family, size, tags) else {
                continue;
            };
            for flopped in [false, true] {
                let evidence = found_in(&family, &asked, &shown, flopped);
                let of = format!("{name}, {size:?}, spacing {spacing}, flopped: {flopped}");
                assert!(evidence.found.is_empty(), "{of}: {:?}", evidence.found);
                contradicted += usize::from(evidence.contradicted.is_some());
            }
        }
    }
    assert!(contradicted > 20, "only {contradicted} boards are contradicted by other tiles");
}

/// Boards of the same ids with other rows and columns are labelled only if all of their tags and corners are in the same
/// positions. The rest of the target then counts as hidden. A single tag of 16 cells is not sufficient evidence.
#[test]
fn boards_of_other_rows_and_columns_get_no_labels() {
    let sizes = (5..12).flat_map(|rows| (6..13).map(move |cols| (rows, cols)));
    let sizes: Vec<(u32, u32)> = sizes.filter(|&size| size != (8, 9)).collect();
    for name in shipped_names() {
        let family = Family::shipped(name).unwrap();
        if family.dimension().bits() <= 16 {
            continue;
        }
        let asked = board(&family, 0).unwrap();
        for &(rows, cols) in &sizes {
            let Some(shown) = board_of(&family, [rows, cols], TagSpec::default()) else {
                continue;
            };
            for found in found_in(&family, &asked, &shown, false).found {
                let of = format!("{name}, {rows} x {cols}");
                assert_eq!(found.tags.len(), shown.panels[0].tags.len(), "{of}");
                assert!(found.vertices.len() + 2 >= (rows * cols) as usize, "{of}");
            }
        }
    }
}

/// A board has the tags of some faces, but not in the arrangement of the solid: around each face
/// that fits, and between these faces, there are other tags.
#[test]
fn boards_are_not_taken_for_faces_of_solids() {
    for name in shipped_names() {
        let family = Family::shipped(name).unwrap();
        let tags = TagSpec { family: name.to_owned(), ..TagSpec::default() };
        for tiles in [7, 10] {
            let tags = tags.clone();
            let spec =
                SolidSpec { tiles, tags: Some(tags), ..SolidSpec::new(SolidShape::Octahedron) };
            let Ok(solid) = Target::build("o", &TargetSpec::Solid(spec), Some(&family)) else {
                continue;
            };
            // Smaller boards have only the tags of a face, or one more.
            for size in [[10, 11], [12, 16]] {
                let Some(shown) = board_of(&family, size, TagSpec::default()) else {
                    continue;
                };
                let evidence = found_in(&family, &solid, &shown, false);
                let of = format!("{name}, {tiles} tiles a side, {size:?}");
                assert!(evidence.found.is_empty(), "{of}: {:?}", evidence.found);
                assert!(evidence.contradicted.is_some(), "{of}");
            }
        }
    }
}

/// A part of the board with one tag, with nothing else in the image, is labelled. It is not
/// labelled if a single other tile clearly belongs to another board.
#[test]
fn one_tag_labels_where_nothing_contradicts_it() {
    let family = Family::shipped("delTag25h7").unwrap();
    let target = board(&family, 0).unwrap();
    let labeller = TagLabeller::new(&target, &family, None).unwrap();
    let panel = &target.panels[0];
    let tag = &panel.tags[panel.tags.len() / 2];
    let of_code = |tile: Tile, code: u64, sure: f32| {
        let odds = |bit: u32| if code >> bit & 1 == 1 { sure } else { -sure };
        Reading { tile, half_odds: (0..25).map(odds).collect(), has_hidden: false, joint: None }
    };
    let tile = panel.tag_tile(tag);
    let beside = Tile { anchor: tile.anchor + Vertex::new(0, 1), ..tile };
    let foreign = family.code(200).unwrap();
    let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
    for (what, other, labelled) in [
        ("a plain tile", of_code(beside, 0, SURE), true),
        ("nothing clear", of_code(beside, foreign, 0.1), true),
        ("dirt", of_code(beside, 0b1_0110_1001, SURE), true),
        ("a tag of the target", of_code(beside, family.code(0).unwrap(), SURE), false),
        ("another tag", of_code(beside, foreign, SURE), false),
    ] {
        let readings = vec![of_code(tile, family.code(tag.id).unwrap(), SURE), other];
        let vertices = readings.iter().flat_map(|reading| reading.tile.vertices());
        let grid: SaddleGrid = vertices.map(|v| (v, placed)).collect();
        let mut evidence = TagEvidence::default();
        let sight = labeller.sight(AS_SEEN, readings, &mut evidence);
        let found = labeller.decide(vec![sight], &grid, evidence).found;
        assert_eq!(found.len(), usize::from(labelled), "{what}");
        for (from, to) in found.iter().flat_map(|found| &found.vertices) {
            assert_eq!(from, to, "{what}");
        }
    }
}

/// A white corner, which is common in natural images, is a code of a family without a complexity
/// rule. Alone, it is not sufficient for a label. With another tag next to it, it is sufficient,
/// and so is a complex code alone.
#[test]
fn one_natural_looking_tag_gives_no_labels() {
    let complex = Family::shipped("d36h9").unwrap();
    let codes = [&[0xf_0000_0000], &complex.codes()[..20]].concat();
    let source = deltille_core::family::Construction::Imported { source: "here".to_owned() };
    let rules = deltille_core::family::Rules::NONE;
    let family = Family::new("plain", complex.dimension(), 9, codes.clone(), rules, source);
    let family = family.unwrap();
    let target = board(&family, 0).unwrap();
    let labeller = TagLabeller::new(&target, &family, None).unwrap();
    let panel = &target.panels[0];
    let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
    for (shown, labelled) in [(vec![0], false), (vec![0, 1], true), (vec![1], true)] {
        let reading = |&id: &usize| {
            let odds = |bit: u32| if codes[id] >> bit & 1 == 1 { SURE } else { -SURE };
            let tag = panel.tags.iter().find(|tag| tag.id as usize == id).unwrap();
            Reading {
                tile: panel.tag_tile(tag),
                half_odds: (0..36).map(odds).collect(),
                has_hidden: false,
                joint: None,
            }
        };
        let readings: Vec<Reading> = shown.iter().map(reading).collect();
        let vertices = readings.iter().flat_map(|reading| reading.tile.vertices());
        let grid: SaddleGrid = vertices.map(|v| (v, placed)).collect();
        let mut evidence = TagEvidence::default();
        let sight = labeller.sight(AS_SEEN, readings, &mut evidence);
        let found = labeller.decide(vec![sight], &grid, evidence).found;
        assert_eq!(!found.is_empty(), labelled, "{shown:?}");
    }
}

/// Patches of three by four tiles of a board of a thousand tiles, anywhere, rotated and mirrored. One of twenty cells
/// is misread, and three of ten tiles are hidden by objects that show other cells.
#[test]
fn patches_of_dense_boards_tell_their_place() {
    use rand::{Rng, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    /// Noise of a cell at which one of twenty is misread.
    const NOISE: f64 = 0.608;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let spec = BoardSpec { tags: Some(TagSpec::dense()), ..BoardSpec::deltille(32, 33, 10.0) };
    let target =
        Target::build("dense", &TargetSpec::Board(spec), Some(&Family::shipped("dense9").unwrap()));
    let (target, family) = (target.unwrap(), Family::shipped("dense9").unwrap());
    let labeller = TagLabeller::new(&target, &family, None).unwrap();
    let panel = &target.panels[0];
    let codes: BTreeMap<Tile, u64> =
        panel.tags.iter().map(|tag| (panel.tag_tile(tag), family.code(tag.id).unwrap())).collect();
    let cells = family.cells();
    let (mut labelled, mut tried) = (0, 0);
    for trial in 0..300 {
        let anchor = panel.tags[rng.random_range(0..panel.tags.len())];
        let anchor = Vertex::new(anchor.row, anchor.col);
        let at = |row, col| Tile::upright(anchor + Vertex::new(row, col));
        let patch = (0..3).flat_map(|row| (0..4).map(move |col| at(row, col)));
        let map = panel_from_grid(Tile::upright(Vertex::new(0, 0)), at(0, 0), (trial % 3) as u8);
        let flopped = trial % 2 == 1;
        let shown: Vec<Tile> = patch.filter(|tile| codes.contains_key(tile)).collect();
        if shown.len() < 12 {
            continue;
        }
        tried += 1;
        let readings: Vec<Reading> = shown
            .iter()
            .map(|tile| {
                let on_grid = map.inverse().apply_tile(*tile);
                let turned = (0..turns_of(map, on_grid)).fold(codes[tile], |w, _| cells.rotate(w));
                let word = if rng.random_bool(0.3) { rng.random() } else { turned };
                let odds = |bit: u32| {
                    let cell = if word >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    let odds = (cell + NOISE * noise) / (NOISE * NOISE);
                    odds.clamp(-2.6, 2.6) as f32
                };
                let reading = Reading {
                    tile: on_grid,
                    half_odds: (0..9).map(odds).collect(),
                    has_hidden: false,
                    joint: None,
                };
                if flopped { labeller.readers[0].mirrored(&reading) } else { reading }
            })
            .collect();
        let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
        let vertices = readings.iter().flat_map(|reading| reading.tile.vertices());
        let grid: SaddleGrid = vertices.map(|v| (v, placed)).collect();
        let mut evidence = TagEvidence::default();
        let sight = labeller.sight(AS_SEEN, readings, &mut evidence);
        let found = labeller.decide(vec![sight], &grid, evidence).found;
        labelled += found.len();
        for (from, to) in found.iter().flat_map(|found| &found.vertices) {
            let seen = if flopped { mirrored(*from) } else { *from };
            assert_eq!(*to, map.apply(seen), "trial {trial}");
            assert_eq!(found[0].mirrored, flopped, "trial {trial}");
        }
    }
    println!("{labelled} of {tried} patches were labelled");
    assert!(labelled * 10 > tried * 9, "{labelled} of {tried}");
}

/// Statistics of reading single tags of d36h11, 4 px per bit, under noise.
#[derive(Debug, Default)]
struct NoisyTags {
    tags: usize,
    /// Cells that are more likely the opposite of the printed one.
    cell_errors: usize,
    /// Their expected number by the odds.
    expected_errors: f32,
    /// Tags with no more wrong cells than the family corrects.
    by_decisions: usize,
    /// Tags that label the corners around them.
    by_evidence: usize,
    /// Other words under the same noise, and how often each method mistakes them for a tag.
    words: usize,
    false_decisions: usize,
    false_evidence: usize,
    /// Λ of each tag if no other word has more, and the greatest of each of the other words.
    of_tags: Vec<f32>,
    of_words: Vec<f32>,
}

impl NoisyTags {
    /// Returns the fraction of tags read by evidence, at the rate of false tags of decisions cell by cell.
    fn read_at_the_rate_of_decisions(&self) -> f64 {
        let mut of_words = self.of_words.clone();
        of_words.sort_by(|a, b| b.total_cmp(a));
        let least = of_words[self.false_decisions];
        let read = self.of_tags.iter().filter(|&&evidence| evidence > least).count();
        read as f64 / self.tags as f64
    }
}

fn most(evidence: &[f32]) -> f32 {
    evidence.iter().copied().fold(f32::NEG_INFINITY, f32::max)
}

fn noisy_tags(noise: f64, views: u64, words_a_view: usize) -> NoisyTags {
    use rand::{Rng, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let family = Family::shipped("d36h11").unwrap();
    let target = board(&family, 0).unwrap();
    let labeller = TagLabeller::new(&target, &family, None).unwrap();
    let scene = deltille_layout::synth::scene_of_target(&target).unwrap();
    let panel = &target.panels[0];
    let camera = deltille_core::camera::Camera::pinhole(160, 160, 0.3);
    let bits_across = family.cells().width(panel.tag_inset_bits());
    let distance_mm = camera.focal_px.x * panel.edge_mm / bits_across / 4.0;
    let mut seen = NoisyTags::default();
    for seed in 0..views {
        let tag = &panel.tags[seed as usize % panel.tags.len()];
        let tile = panel.tag_tile(tag);
        // Only the corners of the tag's tile and of the tiles that touch it are visible.
        let near: BTreeSet<Vertex> = tile
            .vertices()
            .chain(tile.vertices().flat_map(|v| family.kind().neighbours(v)))
            .collect();
        let places: Vec<DVec3> =
            tile.vertices().filter_map(|v| Some(panel.corner_at(v)?.target_mm)).collect();
        let centre = places.iter().sum::<DVec3>() / places.len() as f64;
        let roll: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        let up = DVec3::new(roll.cos(), roll.sin(), 0.0);
        let eye = centre + distance_mm * DVec3::new(0.1, 0.05, 1.0);
        let pose = deltille_core::camera::Pose::looking_at(eye, centre, up);
        let light = deltille_layout::synth::Light::default().noise(noise).seed(seed);
        let image = scene.render(&camera, &pose, &light);
        let grid: SaddleGrid = scene
            .truth(&camera, &pose, 0.0)
            .corners
            .iter()
            .filter(|corner| near.contains(&Vertex::new(corner.row, corner.col)))
            .map(|corner| {
                let placed =
                    PlacedSaddle { position: DVec2::new(corner.x, corner.y), amplitude: 1.0 };
                (Vertex::new(corner.row, corner.col), placed)
            })
            .collect();
        let readings = labeller.readers[0]
            .read((&image).into(), &grid, &SaddleGrid::new(), false, MAX_TILES)
            .readings;
        let Some(at) = readings.iter().position(|r| r.tile == tile) else {
            continue;
        };
        let code = family.code(tag.id).unwrap();
        let found = |readings: Vec<Reading>| {
            let mut evidence = TagEvidence::default();
            let sight = labeller.sight(AS_SEEN, readings, &mut evidence);
            let found = labeller.decide(vec![sight], &grid, evidence).found;
            found.into_iter().find(|found| !found.mirrored)
        };
        let errors = (readings[at].word() ^ code).count_ones();
        seen.tags += 1;
        seen.cell_errors += errors as usize;
        let wrong = |odds: &f32| 1.0 / (1.0 + (2.0 * odds.abs()).exp());
        seen.expected_errors += readings[at].half_odds.iter().map(wrong).sum::<f32>();
        seen.by_decisions += usize::from(errors <= family.correctable());
        let evidence = labeller.words.evidence(&readings[at].half_odds);
        let of_tag = labeller.words.evidence_of(code, &readings[at].half_odds);
        if of_tag > most(&evidence) - 1e-3 {
            seen.of_tags.push(of_tag);
        }
        let right = |found: Labelled| found.vertices.iter().all(|(from, to)| from == to);
        seen.by_evidence += usize::from(found(readings.clone()).is_some_and(right));
        for _ in 0..words_a_view {
            // Randomly flipped cells show a random word under this noise.
            let mut other = readings.clone();
            for odds in &mut other[at].half_odds {
                *odds *= if rng.random() { 1.0 } else { -1.0 };
            }
            seen.of_words.push(most(&labeller.words.evidence(&other[at].half_odds)));
            let word = other[at].word();
            let is_near = |index: usize| {
                (labeller.words.word(index) ^ word).count_ones() <= family.correctable()
            };
            seen.words += 1;
            seen.false_decisions += usize::from((0..labeller.words.len()).any(is_near));
            seen.false_evidence += usize::from(found(other).is_some());
        }
    }
    seen
}

/// Under noise that flips some 10.5 % of cells, decisions cell by cell read 83 % of the tags.
#[test]
#[ignore = "a minute; prints the rates"]
fn evidence_reads_noisy_tags_with_no_more_errors_than_decisions() {
    let seen = noisy_tags(NOISE_OF_A_TENTH, 4000, 50);
    let [tags, words] = [seen.tags, seen.words].map(|n| n as f64);
    let cell_errors = seen.cell_errors as f64 / (36.0 * tags);
    let read = seen.read_at_the_rate_of_decisions();
    println!(
        "{cell_errors:.4} of cells wrong, {:.4} by the odds; by decisions {:.4} read and {:.6} of other words; by evidence {read:.4} \
         at the same rate; labelled {:.4} and {:.6} of other words",
        f64::from(seen.expected_errors) / (36.0 * tags),
        seen.by_decisions as f64 / tags,
        seen.false_decisions as f64 / words,
        seen.by_evidence as f64 / tags,
        seen.false_evidence as f64 / words,
    );
    assert!((0.103..0.113).contains(&cell_errors));
    assert!(read >= 0.95);
    assert!(seen.false_evidence <= seen.false_decisions);
    assert!(seen.by_evidence > seen.by_decisions);
}

/// Random content of a board's tiles is mistaken for tags of another board less often than allowed.
#[test]
fn boards_of_random_words_get_no_labels() {
    use rand::{Rng, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
    let tags = [TagSpec { family: "d16h5".to_owned(), ..TagSpec::default() }, TagSpec::dense()];
    for tags in tags {
        let family = Family::shipped(&tags.family).unwrap();
        let bits = family.dimension().bits();
        let target = board_of(&family, [8, 9], tags).unwrap();
        let labeller = TagLabeller::new(&target, &family, None).unwrap();
        let panel = &target.panels[0];
        let grid: SaddleGrid = panel_vertices(panel).into_iter().map(|v| (v, placed)).collect();
        let wrong = (0..1000).filter(|trial| {
            // From a single tile, which is the hardest case to reject, to many tiles. Cells are
            // certain or nearly undetermined.
            let tiles = grid.keys().map(|&v| Tile::upright(v)).take(1 + trial % 40);
            let strength = [2.6, 1.0, 0.3][trial % 3];
            let readings = tiles
                .map(|tile| {
                    let odds = |_| if rng.random() { strength } else { -strength };
                    Reading {
                        tile,
                        half_odds: (0..bits).map(odds).collect(),
                        has_hidden: false,
                        joint: None,
                    }
                })
                .collect();
            let mut evidence = TagEvidence::default();
            let sight = labeller.sight(AS_SEEN, readings, &mut evidence);
            !labeller.decide(vec![sight], &grid, evidence).found.is_empty()
        });
        assert_eq!(wrong.count(), 0, "{}", family.name());
    }
}
