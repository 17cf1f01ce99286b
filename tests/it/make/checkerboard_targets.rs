//! `deltille checkerboard`: its output and errors, and tagged checkerboards in synthetic images with exact ground
//! truth.

use std::collections::BTreeMap;

use crate::common::command::deltille;
use crate::common::page::Page;
use crate::common::view::tilted;
use deltille::camera::{Camera, KannalaBrandt, Lens, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::dsc::{self, Dialect};
use deltille::family::{Decoder, Family, TagWords, square_names};
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::raster::Gray;
use deltille::synth::{Light, Scene, Truth, scene_of_sheet};
use deltille::targets::{BoardSpec, TagSpec, TagsIn};
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn spec(rows: u32, cols: u32, tags_in: TagsIn) -> BoardSpec {
    let tags = Some(TagSpec::for_squares(tags_in));
    BoardSpec { board_id: 4, tags, ..BoardSpec::new(GridKind::Checker, rows, cols, 20.0) }
}

fn build(spec: &BoardSpec) -> Printing {
    Printing::new("board", spec.clone()).unwrap()
}

/// Every word with up to ⌊(h−1)/2⌋ wrong cells decodes to its tag and rotation, in all four rotations.
#[test]
fn square_tags_keep_their_distance_and_decode_in_every_rotation() {
    for name in square_names() {
        let family = Family::shipped(name).unwrap();
        let words = TagWords::of(GridKind::Checker, family.dimension());
        let all: Vec<u64> =
            family.codes().iter().flat_map(|&code| turns_of(&words, code)).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| (a ^ b).count_ones() >= family.distance()), "{name}");
        }
        let decoder = Decoder::new(&family);
        let wrong = (0..family.correctable()).fold(0u64, |bits, i| bits | 1 << (3 * i + 1));
        for (id, &code) in (0..).zip(family.codes()) {
            for (rotations, word) in (0..).zip(turns_of(&words, code)) {
                let decoded = decoder.decode(word ^ wrong, family.correctable()).unwrap();
                assert_eq!((decoded.id, decoded.rotations), (id, rotations), "{name}");
            }
        }
    }
}

/// Returns the words of a square tag in its four rotations.
fn turns_of(words: &TagWords, code: u64) -> [u64; 4] {
    let once = words.rotate(code);
    let twice = words.rotate(once);
    [code, once, twice, words.rotate(twice)]
}

#[test]
fn short_family_names_are_accepted() {
    assert_eq!(Family::shipped("t36h11").unwrap().name(), "aprilTag36h11");
    assert_eq!(Family::shipped("aprilTag36h11").unwrap().code(0), Some(0xd_5d62_8584));
}

struct Board {
    detector: Detector,
    scene: Scene,
    centre_mm: DVec3,
}

fn board(spec: &BoardSpec) -> Board {
    let target = build(spec);
    let detector = Detector::for_target(&target.target, DetectorConfig::default()).unwrap();
    let sheets = target.draw().unwrap().sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let centre_mm = target.target.panels[0].middle_mm();
    Board { detector, scene, centre_mm }
}

impl Board {
    /// Returns an image and its ground truth, viewed at `tilt` from the normal and rotated about the line of sight.
    fn seen(
        &self,
        rng: &mut ChaCha8Rng,
        camera: &Camera,
        mm: f64,
        tilt: f64,
    ) -> (Detection, Truth) {
        let pose = tilted(rng, self.centre_mm, mm, tilt);
        let light = Light::default().seed(rng.random()).gradient(DVec2::new(0.5, -0.3));
        let image: Gray<u8> =
            self.scene.render(camera, &pose, &light).map(|v| (v * 255.0 + 0.5) as u8);
        (self.detector.detect(&image, "view"), self.scene.truth(camera, &pose, 0.0))
    }
}

/// Returns the distance of every labelled corner from the true position; panics on a wrong label.
fn errors(detection: &Detection, truth: &Truth) -> Vec<f64> {
    let by_id: BTreeMap<u32, _> = truth.corners.iter().map(|c| (c.id, c)).collect();
    let labelled = detection.grids.iter().filter(|grid| grid.panel.is_some());
    labelled
        .flat_map(|grid| &grid.corners)
        .map(|corner| {
            let truth = by_id[&corner.id.expect("all corners are labelled")];
            assert_eq!((corner.row, corner.col), (truth.row, truth.col));
            let error = (corner.x - truth.x).hypot(corner.y - truth.y);
            assert!(error < 2.0, "corner {} is {error} px off: a wrong label", truth.id);
            error
        })
        .collect()
}

/// The outermost corners are the narrowest, with nothing but the panel's margin beyond them.
#[test]
fn the_outermost_corners_are_found_through_a_fisheye_lens() {
    let lens = Lens::KannalaBrandt(KannalaBrandt { k: vec![0.01, -0.005, 0.0, 0.0] });
    let camera = Camera::centred(1280, 960, 330.0, lens);
    let board = board(&spec(8, 11, TagsIn::Black));
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (mut found, mut all) = (0, 0);
    for view in 0..24 {
        let tilt = f64::from(view % 6) * 0.2;
        let mm = rng.random_range(60.0..160.0);
        let (detection, truth) = board.seen(&mut rng, &camera, mm, tilt);
        let is_outermost = |row: i32, col: i32| row == 0 || row == 7 || col == 0 || col == 10;
        // Windows end at the border of the image.
        let seen = truth.corners.iter().filter(|c| camera.sees(DVec2::new(c.x, c.y), 8.0));
        let ids: Vec<u32> = seen.filter(|c| is_outermost(c.row, c.col)).map(|c| c.id).collect();
        errors(&detection, &truth);
        let has = |id: &&u32| {
            detection.grids.iter().flat_map(|grid| &grid.corners).any(|c| c.id == Some(**id))
        };
        found += ids.iter().filter(has).count();
        all += ids.len();
    }
    assert!(100 * found >= 98 * all, "{found} of {all}");
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn tagged_checkerboards_are_labelled_whichever_squares_carry_the_tags() {
    let camera = Camera::pinhole(1280, 960, 0.9);
    for (tags_in, inverted) in [
        (TagsIn::Black, false),
        (TagsIn::White, false),
        (TagsIn::Black, true),
        (TagsIn::White, true),
    ] {
        let board = board(&BoardSpec { inverted, ..spec(7, 9, tags_in) });
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut all, mut visible) = (Vec::new(), 0);
        for view in 0..8 {
            let tilt = f64::from(view) / 8.0 * 55f64.to_radians();
            let (detection, truth) = board.seen(&mut rng, &camera, 330.0, tilt);
            let found = errors(&detection, &truth);
            visible += truth.corners.len();
            all.extend(found);
        }
        assert!(
            all.len() * 100 >= visible * 97,
            "{tags_in:?} {inverted}: {} of {visible}",
            all.len()
        );
        assert!(rms(&all) < 0.04, "{tags_in:?} {inverted}: rms {}", rms(&all));
    }
}

/// A part of the board with one tag in it is enough for absolute labels.
#[test]
fn partial_views_are_labelled_by_few_tags() {
    let board = board(&spec(8, 11, TagsIn::Black));
    let camera = Camera::pinhole(640, 480, 0.5);
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut labelled, mut single) = (0, 0);
    for _ in 0..20 {
        let (detection, truth) = board.seen(&mut rng, &camera, 180.0, 0.5);
        let found = errors(&detection, &truth);
        assert!(found.is_empty() || rms(&found) < 0.04, "rms {}", rms(&found));
        labelled += usize::from(detection.grids.iter().any(|grid| grid.panel == Some(4)));
        single += usize::from(detection.grids.iter().any(|grid| grid.tags.len() == 1));
    }
    println!("{labelled} of 20 views labelled, {single} by a single tag");
    assert!(labelled >= 18, "{labelled} of 20");
}

#[test]
fn plain_boards_are_labelled_where_they_are_fully_visible() {
    let camera = Camera::pinhole(1280, 960, 0.9);
    for inverted in [false, true] {
        let board = board(&BoardSpec { tags: None, inverted, ..spec(6, 9, TagsIn::Black) });
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..6 {
            let (detection, truth) = board.seen(&mut rng, &camera, 330.0, 0.4);
            assert_eq!(errors(&detection, &truth).len(), 54);
        }
    }
}

#[test]
fn several_boards_are_distinguished_by_their_tags() {
    let target = build(&BoardSpec { boards: 3, ..spec(5, 7, TagsIn::Black) });
    let camera = Camera::pinhole(1280, 960, 0.9);
    let sheets = target.draw().unwrap().sheets;
    let detector = Detector::for_target(&target.target, DetectorConfig::default()).unwrap();
    for (index, sheet) in sheets.iter().enumerate() {
        let scene = scene_of_sheet(&target, sheet, index);
        let centre = DVec3::new(60.0, 40.0, 0.0);
        let pose = Pose::looking_at(centre + DVec3::new(80.0, 60.0, 300.0), centre, DVec3::Y);
        let image = scene.render(&camera, &pose, &Light::default());
        let detection = detector.detect(&image.map(|v| (v * 255.0 + 0.5) as u8), "view");
        assert_eq!(detection.grids[0].panel, Some(4 + index as u32));
        assert_eq!(errors(&detection, &scene.truth(&camera, &pose, 0.0)).len(), 35);
    }
}

proptest! {
    #[test]
    fn descriptions_come_back_from_both_dialects(
        rows in 3u32..12, cols in 3u32..12, spacing in 1u32..4, original: bool,
    ) {
        let mut spec = spec(rows, cols, TagsIn::Black);
        spec.tags.as_mut().unwrap().spacing = spacing;
        let target = build(&spec);
        prop_assert_eq!(&Printing::from_json(&target.to_json()).unwrap(), &target);
        let dialect = if original { Dialect::Original } else { Dialect::Fork };
        let read = dsc::read(&dsc::write(&target.target, dialect).unwrap(), "board").unwrap();
        prop_assert_eq!(&read.family, &target.target.family);
        let (a, b) = (&target.target.panels[0], &read.panels[0]);
        prop_assert_eq!((a.id, a.kind, a.matrix, a.border_bits), (b.id, b.kind, b.matrix, b.border_bits));
        prop_assert_eq!((&a.corners, &a.tags), (&b.corners, &b.tags));
    }
}

#[test]
fn a_checkerboard_is_written_verified_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "--rows 5 --cols 6 --edge 20mm --pdf --save-template t.toml",
        "--template t.toml --tags t36h11 --name tags --svg --png --dsc",
        "--template t.toml --tags t36h11 --tag-spacing 3 -o odd",
    ] {
        assert!(page.run(at, &format!("deltille checkerboard {args}")).status.success(), "{args}");
    }
    for target in ["tags.json", "tags.dsc"] {
        deltille(at, &format!("detect --target {target} tags.png --format orpc,json -o found"))
            .success();
        let read = |name: &str| std::fs::read_to_string(at.join("found").join(name)).unwrap();
        let found = deltille::export::detection::read(&read("tags.json")).unwrap();
        assert_eq!((found.grids[0].corners.len(), found.grids[0].tags.len()), (30, 6), "{target}");
        let orpc = read("tags.orpc");
        assert!(orpc.contains("num_corners: 30") && orpc.contains("\n0,29,1,"), "{orpc}");
    }
    deltille(at, "verify tags.json").success();

    page.title("Rejected");
    for args in [
        "--tags delTag25h7",
        "--tags 16h5",
        "--tag-spacing 2",
        "--tags t36h11 --tag-border 0.8",
        "--tags t36h11 --tags-in white --dsc",
        "--tags t16h5 --tag-spacing 1 --boards 9",
    ] {
        page.refused(at, &format!("deltille checkerboard --rows 5 --cols 6 -o out {args}"));
    }
    page.refused(at, "deltille checkerboard --rows 2 --cols 4 -o out");
    page.is("checkerboard");
}

/// Reads the tags of the sheets with OpenCV. Tags in white squares are read from the whole page, those in black
/// squares one by one on white, because OpenCV searches for black on white.
const OPENCV: &str = r#"
import json, sys, cv2, numpy as np
detector = cv2.aruco.ArucoDetector(
    cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
for name in sys.argv[1:]:
    target, image = json.load(open(name + ".json")), cv2.imread(name + ".png", 0)
    sheet, panel = target["sheets"][0], target["panels"][0]
    px, edge = image.shape[1] / sheet["width_mm"], panel["edge_mm"]
    assert sheet["placements"][0]["angle_rad"] == 0
    ox, oy = sheet["placements"][0]["origin_mm"]
    for tag in panel["tags"]:
        x = round((tag["col"] * edge + ox) * px)
        y = round((sheet["height_mm"] - (tag["row"] + 1) * edge - oy) * px)
        side = round(edge * px)
        square = np.full((side + 60, side + 60), 255, np.uint8)
        square[30:-30, 30:-30] = image[y:y + side, x:x + side]
        corners, ids, _ = detector.detectMarkers(square)
        assert ids is not None and ids.ravel().tolist() == [tag["id"]], (name, tag, ids)
        # OpenCV counts corners of AprilTags from the lower right one, clockwise.
        first = corners[0][0][0]
        assert (first > (side + 60) / 2).all(), (name, tag, first)
    if panel.get("tags_in") == "white":
        _, ids, _ = detector.detectMarkers(image)
        assert sorted(ids.ravel().tolist()) == [tag["id"] for tag in panel["tags"]], ids
    print("OpenCV", cv2.__version__, "reads", len(panel["tags"]), "tags of", name)
"#;

#[test]
#[cfg_attr(not(has_opencv), ignore = "no OpenCV: set DELTILLE_PYTHON to a Python that has it")]
fn opencv_reads_the_tags() {
    let python = std::env::var_os("DELTILLE_PYTHON").expect("it was set when this was built");
    let folder = tempfile::tempdir().unwrap();
    for colour in ["black", "white"] {
        let args = format!(
            "checkerboard --rows 8 --cols 11 --edge 20mm --tags t36h11 --tags-in {colour} \
             --tag-border 1 --first-id 300 --png --name {colour}"
        );
        deltille(folder.path(), &args).success();
    }
    let mut command = std::process::Command::new(&python);
    let output = command.current_dir(&folder).args(["-c", OPENCV, "black", "white"]).output();
    let output = output.unwrap();
    print!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
