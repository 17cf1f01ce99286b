//! Labels and positions on synthetic photographs, for which the truth is exact.

use std::collections::BTreeMap;

use crate::common::view::tilted;
use deltille::camera::{Camera, KannalaBrandt, Lens, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::Gray;
use deltille::synth::{Light, Scene, Truth, scene_of_sheet};
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::{DVec2, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

struct Board {
    target: Target,
    scene: Scene,
    centre_mm: DVec3,
}

fn board(tags: Option<TagSpec>, inverted: bool) -> Board {
    let plain = BoardSpec::new(GridKind::Deltille, 8, 9, 18.0);
    let spec = BoardSpec { board_id: 4, tags, inverted, ..plain };
    let target = Printing::new("board", spec).unwrap();
    let sheets = target.draw().unwrap().sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let centre_mm = target.target.panels[0].middle_mm();
    Board { target: target.target, scene, centre_mm }
}

impl Board {
    fn detector(&self) -> Detector {
        Detector::for_target(&self.target, DetectorConfig::default()).unwrap()
    }

    fn seen_from(&self, rng: &mut ChaCha8Rng, distance_mm: f64, tilt: f64) -> Pose {
        tilted(rng, self.centre_mm, distance_mm, tilt)
    }
}

fn eight_bits(image: &Gray<f32>) -> Gray<u8> {
    image.map(|v| (v * 255.0 + 0.5) as u8)
}

/// Returns the distance of every detected corner from the corner with the same id; panics on a wrong label.
fn errors(detection: &Detection, truth: &Truth) -> Vec<f64> {
    let by_id: BTreeMap<u32, _> = truth.corners.iter().map(|c| (c.id, c)).collect();
    detection
        .grids
        .iter()
        .flat_map(|grid| &grid.corners)
        .map(|corner| {
            let id = corner.id.expect("all corners are labelled");
            let truth = by_id.get(&id).expect("the corner is visible");
            assert_eq!((corner.row, corner.col), (truth.row, truth.col));
            let error = (corner.x - truth.x).hypot(corner.y - truth.y);
            assert!(error < 2.0, "corner {id} is {error} px off: a wrong label");
            error
        })
        .collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn every_corner_of_a_tagged_board_is_labelled_up_to_60_degrees() {
    let board = board(Some(TagSpec::default()), false);
    let detector = board.detector();
    let camera = Camera::pinhole(1280, 960, 0.9);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut all = Vec::new();
    for view in 0..24u32 {
        let tilt = f64::from(view) / 24.0 * 60f64.to_radians();
        let pose = board.seen_from(&mut rng, 330.0, tilt);
        let light = Light::default().seed(view.into()).gradient(DVec2::new(0.5, -0.3));
        let image = eight_bits(&board.scene.render(&camera, &pose, &light));
        let truth = board.scene.truth(&camera, &pose, 14.0);
        let everything = board.scene.truth(&camera, &pose, 0.0);
        let detection = detector.detect(&image, "view");
        assert_eq!(detection.grids.len(), 1, "view {view}");
        assert_eq!(detection.grids[0].panel, Some(4));
        let found = errors(&detection, &everything);
        assert!(
            found.len() >= truth.corners.len(),
            "view {view}: {} of {}",
            found.len(),
            truth.corners.len()
        );
        all.extend(found);
    }
    assert!(rms(&all) < 0.03, "rms {}", rms(&all));
}

#[test]
fn a_fisheye_view_and_an_inverted_board_are_labelled_too() {
    let mut camera = Camera::pinhole(1600, 1200, 1.2);
    camera.focal_px = DVec2::splat(420.0);
    camera.lens = Lens::KannalaBrandt(KannalaBrandt { k: vec![-0.02, 0.002, 0.0, 0.0] });
    for inverted in [false, true] {
        let board = board(Some(TagSpec::default()), inverted);
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for view in 0..6u32 {
            let pose = board.seen_from(&mut rng, 110.0, 0.1 * f64::from(view));
            let light = Light::default().seed(view.into());
            let image = eight_bits(&board.scene.render(&camera, &pose, &light));
            let detection = board.detector().detect(&image, "view");
            let truth = board.scene.truth(&camera, &pose, 14.0);
            let found = errors(&detection, &board.scene.truth(&camera, &pose, 0.0));
            assert!(
                found.len() * 100 >= truth.corners.len() * 97,
                "{} of {}",
                found.len(),
                truth.corners.len()
            );
            assert!(rms(&found) < 0.04, "rms {}", rms(&found));
        }
    }
}

#[test]
fn an_untagged_board_seen_whole_is_labelled_by_its_outline() {
    let board = board(None, false);
    let camera = Camera::pinhole(1280, 960, 0.9);
    let pose = board.seen_from(&mut ChaCha8Rng::seed_from_u64(3), 330.0, 0.4);
    let image = eight_bits(&board.scene.render(&camera, &pose, &Light::default()));
    let found =
        errors(&board.detector().detect(&image, "view"), &board.scene.truth(&camera, &pose, 0.0));
    assert_eq!(found.len(), 72);
}

/// A board of known size is searched on coarser levels first, one of unknown size on all levels.
#[test]
fn whole_boards_have_the_same_positions_on_coarser_levels() {
    let camera = Camera::pinhole(1280, 960, 0.9);
    for kind in [GridKind::Deltille, GridKind::Checker] {
        let board = BoardSpec { tags: None, ..BoardSpec::new(kind, 8, 9, 18.0) };
        let spec = TargetSpec::Board(board);
        let target = Printing::build("board", &spec, None, Some(&PaperSpec::default())).unwrap();
        let sheets = target.draw().unwrap().sheets;
        let scene = scene_of_sheet(&target, &sheets[0], 0);
        let detector = |size| Detector::for_grid(kind, size, DetectorConfig::default());
        let (whole, any) = (detector(Some((8, 9))), detector(None));
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for view in 0..6u32 {
            let (distance_mm, tilt) = (300.0 + 120.0 * f64::from(view), 0.15 * f64::from(view));
            let pose = tilted(&mut rng, target.target.panels[0].middle_mm(), distance_mm, tilt);
            let light = Light::default().seed(view.into());
            let image = eight_bits(&scene.render(&camera, &pose, &light));
            let places = |found: Detection| -> Vec<DVec2> {
                found.grids.iter().flat_map(|grid| &grid.corners).map(|c| c.position()).collect()
            };
            let [whole, any] = [&whole, &any].map(|detector| places(detector.detect(&image, "")));
            assert_eq!(whole.len(), 72, "view {view}");
            for place in whole {
                let nearest_px =
                    any.iter().map(|other| other.distance(place)).fold(f64::INFINITY, f64::min);
                assert!(nearest_px < 0.01, "{kind:?}, view {view}: {nearest_px} px");
            }
        }
    }
}

/// A part of the board with one tag in it is enough for absolute labels.
#[test]
fn partial_views_are_labelled_by_few_tags() {
    let board = board(Some(TagSpec::default()), false);
    let camera = Camera::pinhole(640, 480, 0.5);
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut labelled, mut views) = (0, 0);
    for view in 0..20 {
        let pose = board.seen_from(&mut rng, 180.0, 0.5);
        let image = eight_bits(&board.scene.render(&camera, &pose, &Light::default()));
        let detection = board.detector().detect(&image, "view");
        let truth = board.scene.truth(&camera, &pose, 0.0);
        views += usize::from(truth.corners.len() > 8);
        for grid in detection.grids.iter().filter(|grid| grid.panel.is_some()) {
            labelled += 1;
            assert!(!grid.tags.is_empty(), "view {view}");
            let mut one = detection.clone();
            one.grids = vec![grid.clone()];
            assert!(rms(&errors(&one, &truth)) < 0.03);
        }
    }
    assert!(labelled * 10 >= views * 9, "{labelled} of {views}");
}
