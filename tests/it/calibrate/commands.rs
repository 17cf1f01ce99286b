//! `deltille calibrate`, `rig` and `pose` from files to files, and input that makes no camera.

use std::path::Path;
use std::process::Output;

use crate::common::command::deltille;
use crate::common::page::Page;
use crate::common::solids::cuboctahedron;
use deltille::camera::{BrownConrady, Camera, CameraFile, Lens, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use glam::{DMat3, DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

fn output(folder: &Path, args: &str) -> Output {
    deltille(folder, args).get_output().clone()
}

/// What a command that has to succeed says on standard output.
fn done(folder: &Path, args: &str) -> String {
    let result = deltille(folder, args).success();
    String::from_utf8(result.get_output().stdout.clone()).unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn board(rows: u32, cols: u32) -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = BoardSpec::new(GridKind::Deltille, rows, cols, 20.0);
    Target::build("board", &TargetSpec::Board(spec), Some(&family)).unwrap()
}

fn camera() -> Camera {
    let radial = [-0.17, 0.02, 0.0];
    let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
    Camera { centre_px: DVec2::new(804.0, 606.0), ..Camera::centred(1600, 1200, 625.0, lens) }
}

/// What a detector finds of a board of one panel that is seen whole.
fn detection(target: &Target, camera: &Camera, pose: &Pose, random: &mut ChaCha8Rng) -> Detection {
    let panel = &target.panels[0];
    let corners = panel.corners.iter().map(|corner| {
        let (x, y) = camera.project(pose.apply(corner.target_mm)).unwrap().into();
        let mut off = || random.random_range(-0.1..0.1);
        let (row, col, id) = (corner.row, corner.col, Some(corner.id));
        GridCorner { row, col, id, x: x + off(), y: y + off(), cov: None }
    });
    let corners = corners.collect();
    let grid = Grid {
        kind: panel.kind,
        target: None,
        panel: Some(panel.id),
        mirrored: false,
        corners,
        tags: Vec::new(),
    };
    Detection::new("", [camera.width, camera.height], vec![grid])
}

/// Detections of a board in so many pictures, tilted by up to 0.7 rad.
fn detections(target: &Target, count: usize, tilt_rad: f64) -> Vec<Detection> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let middle = DVec3::new(150.0, 80.0, 0.0);
    let poses = (0..count).map(|_| {
        let mut any = |reach: f64| random.random_range(-reach..reach);
        let tilt = DVec3::new(any(1.0), any(1.0), 0.0) * tilt_rad;
        // y up on the print is y down in the camera: half a turn about x faces the board.
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(any(120.0), any(70.0), 400.0 + any(100.0));
        Pose { rotation, translation: centre - rotation * middle }
    });
    let poses: Vec<Pose> = poses.collect();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    poses.iter().map(|pose| detection(target, &camera(), pose, &mut random)).collect()
}

/// A folder with `board.json` and the detections in `corners`.
fn folder(target: &Target, detections: &[Detection]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("board.json"), target.to_json()).unwrap();
    std::fs::create_dir(folder.path().join("corners")).unwrap();
    for (i, detection) in detections.iter().enumerate() {
        let mut detection = detection.clone();
        detection.image = format!("{i:02}.png");
        let path = folder.path().join(format!("corners/{i:02}.json"));
        std::fs::write(path, detection::write(&detection)).unwrap();
    }
    folder
}

const CALIBRATE: &str = "calibrate corners --target board.json --model radtan";

/// Exchanges rows with columns.
fn swap(detection: &mut Detection) {
    for corner in &mut detection.grids[0].corners {
        (corner.row, corner.col) = (corner.col, corner.row);
    }
}

/// Turns left to right.
fn mirror(detection: &mut Detection) {
    for corner in &mut detection.grids[0].corners {
        corner.x = 1599.0 - corner.x;
    }
}

#[test]
fn a_camera_is_calibrated_and_read_back() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 15, 0.7));
    let at = folder.path();
    let formats = "own,opencv,ros,kalibr,colmap,nerfstudio";
    done(at, &format!("{CALIBRATE} --holdout 5 --format {formats} --report page.html"));
    let views = |of: &Value, count: usize| {
        let views = of["views"].as_array().unwrap();
        assert!(views.iter().all(|view| view["corner_count"] == 72 && view["corners"].is_null()));
        let rms_px = of["rms_px"].as_f64().unwrap();
        assert!(views.len() == count && (0.04..0.07).contains(&rms_px), "{count} {rms_px}");
    };
    let written = json(&at.join("camera.json"));
    views(&written, 12);
    views(&written["held_out"], 3);
    let found = Camera::from_yaml(&std::fs::read_to_string(at.join("camera.yaml")).unwrap());
    assert!((found.unwrap().focal_px.x - 625.0).abs() < 0.5);
    for end in ["-opencv.yaml", "-ros.yaml", "-camchain.yaml", "-cameras.txt", "-transforms.json"] {
        assert!(at.join(format!("camera{end}")).exists(), "{end}");
    }
    for camera in ["camera.yaml", "camera-opencv.yaml", "camera-ros.yaml"] {
        let args = format!(
            "calibrate corners --target board.json --fixed-intrinsics {camera} -o again.yaml"
        );
        done(at, &args);
        views(&json(&at.join("again.json")), 15);
    }
}

/// The kinds of what is said of an estimate.
fn kinds<'a>(of: &'a Value, list: &str) -> Vec<&'a str> {
    let all = of[list].as_array().into_iter().flatten();
    all.map(|said| said["kind"].as_str().unwrap()).collect()
}

#[test]
fn what_is_wrong_is_told_on_the_terminal_in_the_file_and_on_the_page() {
    let flat = board(8, 9);
    let good = detections(&flat, 15, 0.7);
    let lens = |lens: BrownConrady| Camera { lens: Lens::BrownConrady(lens), ..camera() };
    let radial = |radial: [f64; 3]| BrownConrady { radial, ..BrownConrady::default() };
    let foreign = Camera { focal_px: DVec2::splat(200.0), ..lens(radial([4.0, 0.0, 0.0])) };
    let other = lens(radial([-0.12, 0.02, 0.0]));
    // The same lens, its numerator and denominator each with a factor that is zero near r² = 1.44.
    let [k1, k2] = [-0.17, 0.02];
    let (zero, pole) = (-1.0 / 1.44, -1.0 / (1.44 + 1e-9));
    let factors = radial([k1 + zero, k2 + k1 * zero, k2 * zero]);
    let pole = lens(BrownConrady { denominator: [pole, 0.0, 0.0], ..factors });

    let mut page = Page::default();
    let mut told = |title: &str, detections: &[Detection], args: &str| {
        let folder = folder(&flat, detections);
        let path = |name: &str| folder.path().join(name);
        for (name, camera) in [("foreign", &foreign), ("other", &other), ("pole", &pole)] {
            std::fs::write(path(&format!("{name}.yaml")), camera.to_yaml()).unwrap();
        }
        page.title(title);
        let args = format!("calibrate corners --target board.json {args} -o out.yaml");
        let command = format!("deltille {args} --report page.html");
        let is_first = title == "Nothing is wrong";
        let run = if is_first { Page::run } else { Page::warned };
        let output = run(&mut page, folder.path(), &command);
        if output.status.code() != Some(0) {
            assert_eq!(output.status.code(), Some(1));
            assert!(!path("out.yaml").exists() && !path("out.json").exists());
            return Value::Null;
        }
        // What is said is the same everywhere.
        let (found, shown) = (json(&path("out.json")), std::fs::read(path("page.html")).unwrap());
        let (said, shown) =
            (String::from_utf8(output.stderr).unwrap(), String::from_utf8(shown).unwrap());
        // Options are kept on one line.
        let shown = shown.replace("<span class=\"option\">", "").replace("</span>", "");
        for diagnosis in found["diagnoses"].as_array().into_iter().flatten() {
            let text = diagnosis["text"].as_str().unwrap();
            assert!(said.contains(text), "{text}: {said}");
            let [first, rest] = [&text[..1], &text[1..]];
            let on_page = first.to_uppercase() + &rest.replace('&', "&amp;").replace('<', "&lt;");
            assert!(shown.contains(text) || shown.contains(&on_page), "{text}");
        }
        found
    };

    let found = told("Nothing is wrong", &good, "--model radtan");
    assert!(kinds(&found, "diagnoses").is_empty() && found["outliers"] == 0, "{found}");

    let mut wrong = good.clone();
    mirror(&mut wrong[4]);
    swap(&mut wrong[7]);
    wrong[9].grids[0].panel = Some(77);
    let found = told("Wrong detections among good ones", &wrong, "--model radtan");
    let excluded = found["excluded"].as_array().unwrap().iter();
    let excluded: Vec<[&Value; 4]> =
        excluded.map(|one| ["view", "image", "panel", "corners"].map(|key| &one[key])).collect();
    let expected = [("04", 0), ("07", 0), ("09", 77)]
        .map(|(view, panel)| serde_json::json!([view, format!("{view}.png"), panel, 72]));
    assert_eq!(serde_json::json!(excluded), serde_json::json!(expected));
    assert_eq!(found["views"].as_array().unwrap().len(), 12);

    let mut wild = good.clone();
    wild[3].grids[0].corners[20].x += 60.0;
    let found = told("A wild corner", &wild, "--model radtan --print-scale 0.998,1.001");
    assert_eq!(found["print_scale"], serde_json::json!([0.998, 1.001]));
    assert_eq!(found["outliers"], 1);
    let rms = ["rms_px", "inlier_rms_px"].map(|key| found[key].as_f64().unwrap());
    assert!(rms[0] > 1.0 && rms[1] < 0.2, "{rms:?}");

    told("Another camera took the pictures", &good, "--fixed-intrinsics foreign.yaml");
    let found = told("A pole within the image", &good, "--fixed-intrinsics pole.yaml");
    let [diagnosis] = &found["diagnoses"].as_array().unwrap()[..] else { panic!("{found}") };
    // 1.2 (1 − 0.17 · 1.44 + 0.02 · 1.44²) · 625 px.
    assert_eq!(diagnosis["kind"], "lens_ends");
    assert!((diagnosis["steady_px"].as_f64().unwrap() - 597.4).abs() < 1.0, "{diagnosis}");

    let mut bent = flat.clone();
    for corner in &mut bent.panels[0].corners {
        let at = &mut corner.target_mm;
        at.z += 2.0 * ((at.x - 150.0) / 100.0).powi(2);
    }
    let bent = detections(&bent, 15, 0.7);
    for (title, seen, args, kind, key, value) in [
        ("A bent sheet", &bent, "--model radtan", "remedy", "instead", "board_shape"),
        (
            "A print scale that is wrong",
            &good,
            "--model radtan --print-scale 1.2,1.1",
            "stretched_board",
            "kind",
            "stretched_board",
        ),
        (
            "Not quite this camera",
            &good,
            "--fixed-intrinsics other.yaml",
            "remedy",
            "instead",
            "camera",
        ),
        (
            "More parameters than the lens has",
            &good,
            "--model rational",
            "ill_conditioned",
            "sufficient",
            "radtan",
        ),
    ] {
        let found = told(title, seen, args);
        let mut said = found["diagnoses"].as_array().unwrap().iter();
        assert!(said.any(|d| d["kind"] == kind && d[key] == value), "{title}: {said:?}");
    }
    page.is("calibrate-warnings");
}

/// One line with the name of a file and what to do, exit code 2.
fn refused(folder: &Path, args: &str, words: &[&str]) {
    let said = String::from_utf8(output(folder, args).stderr).unwrap();
    deltille(folder, args).code(2);
    assert_eq!(said.lines().count(), 1, "{args}: {said}");
    assert!(words.iter().all(|words| said.contains(words)), "{args}: {said}");
}

#[test]
fn a_pair_with_a_camera_upside_down_is_rectified_as_upright_as_the_first() {
    let target = board(8, 9);
    let second_from_first = Pose {
        rotation: DQuat::from_euler(glam::EulerRot::XYZ, 0.02, -0.03, 3.13),
        translation: DVec3::new(120.0, 2.0, 3.0),
    };
    let folder = folder(&target, &[]);
    let at = folder.path();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for index in 0..10 {
        let mut any = |reach: f64| random.random_range(-reach..reach);
        let tilt = DVec3::new(any(0.6), any(0.6), any(0.2));
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(60.0 + any(40.0), any(40.0), 450.0 + any(80.0));
        let pose = Pose { rotation, translation: centre - rotation * DVec3::new(150.0, 80.0, 0.0) };
        for (name, pose) in [("first", pose), ("second", second_from_first.after(&pose))] {
            let found = detection(&target, &camera(), &pose, &mut random);
            std::fs::create_dir_all(at.join(name)).unwrap();
            std::fs::write(at.join(format!("{name}/{index}.json")), detection::write(&found))
                .unwrap();
        }
    }
    done(at, "rig --camera first=first --camera second=second --target board.json --model radtan");
    let said = done(at, "rectify rig.json --pair first,second -o pair");
    assert!(said.contains("a point is in the same row of both pictures"), "{said}");
    let pair = json(&at.join("pair/first-second.json"));
    // Their diagonals are 1 where nothing is rotated.
    let upright: Vec<f64> = [0, 4, 8]
        .map(|place| pair["views"][0]["view_from_camera"][place].as_f64().unwrap())
        .to_vec();
    assert!(upright.iter().all(|cosine| *cosine > 0.99), "{upright:?}");
    let views = ["first", "second"].map(|name| {
        let text = std::fs::read_to_string(at.join(format!("pair/{name}-rectified.yaml")));
        CameraFile::from_yaml(&text.unwrap()).unwrap()
    });
    assert!(views.iter().all(|view| view.calibrated_with == [target.identity()]));
}

#[test]
fn pictures_that_show_no_board_are_told_with_the_reason_of_most() {
    let reasons = |kinds: &[&str]| {
        let mut found = Detection::new("", [1600, 1200], Vec::new());
        let figures = serde_json::json!({"id": 4, "tags": 1, "corners": 0});
        let reason = |kind: &&str| {
            serde_json::from_value(serde_json::json!({"kind": kind, "figures": figures})).unwrap()
        };
        found.reasons = kinds.iter().map(reason).collect();
        found
    };
    let empty = [
        reasons(&["no_corners"]),
        reasons(&["other_ids", "other_ids"]),
        reasons(&["other_ids"]),
        reasons(&[]),
    ];
    let folder = folder(&board(8, 9), &empty);
    let why = "no board of this kind in 4 pictures; 2 of them: 1 tag whose id the target does not have, such as 4";
    refused(folder.path(), CALIBRATE, &[why]);
    std::fs::create_dir(folder.path().join("b")).unwrap();
    let rig = "rig --camera a=corners --camera b=b --target board.json";
    refused(folder.path(), rig, &["--camera a", why]);
}

#[test]
fn a_folder_that_is_given_twice_is_told_in_a_line() {
    let folder = folder(&board(8, 9), &detections(&board(8, 9), 6, 0.7));
    let command = CALIBRATE.replacen("corners", "corners corners", 1);
    let said = String::from_utf8(output(folder.path(), &command).stderr).unwrap();
    let copies: Vec<&str> = said.lines().filter(|line| line.contains("counted once")).collect();
    let [line] = copies.as_slice() else { panic!("{said}") };
    assert!(line.contains("corners/00.json") && line.ends_with("5 more likewise"), "{line}");
}

#[test]
fn a_file_without_the_shape_of_a_sheet_is_refused_with_what_makes_one() {
    let folder = folder(&board(8, 9), &detections(&board(8, 9), 6, 0.7));
    let at = folder.path();
    done(at, CALIBRATE);
    for (name, text) in [("list.json", "[1]"), ("cut.json", "{"), ("other.yaml", "width: 1")] {
        std::fs::write(at.join(name), text).unwrap();
    }
    for name in ["list.json", "cut.json", "other.yaml", "board.json", "camera.json"] {
        refused(at, &format!("{CALIBRATE} --shape {name}"), &["--shape", name, "--board-shape"]);
    }
}

/// From the eleventh picture on the focal length is 2 % longer.
#[test]
fn a_change_of_zoom_ends_with_an_error_that_names_the_view() {
    let target = board(8, 9);
    let mut seen = detections(&target, 20, 0.7);
    let zoomed = |v: f64, centre: f64| centre + 1.02 * (v - centre);
    for corner in seen[10..].iter_mut().flat_map(|of| &mut of.grids[0].corners) {
        (corner.x, corner.y) = (zoomed(corner.x, 804.0), zoomed(corner.y, 606.0));
    }
    let folder = folder(&target, &seen);
    let result = output(folder.path(), &format!("{CALIBRATE} --report page.html"));
    let said = String::from_utf8(result.stderr).unwrap();
    assert!(said.contains("from 10 on") && said.contains("lock zoom"), "{said}");
    assert_eq!(result.status.code(), Some(1));
    let written = json(&folder.path().join("camera.json"));
    let change = &written["diagnoses"][0];
    assert_eq!((&change["kind"], &change["from_view"]), (&"changed_camera".into(), &"10".into()));
    let focal = |i: usize| change["focal_px"][i].as_f64().unwrap();
    assert!((focal(1) / focal(0) - 1.02).abs() < 1e-3, "{change}");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("The views do not show one camera"));
    // What is said of such a camera is no measure of a change.
    let result = output(folder.path(), "compare camera.json camera.json --distance 1m");
    let said = String::from_utf8(result.stderr).unwrap();
    assert!(said.contains("camera.json: the calibration failed: the views do not"), "{said}");
}

#[test]
fn the_shape_of_a_sheet_is_taken_along() {
    let flat = board(8, 9);
    let mut bent = flat.clone();
    for corner in &mut bent.panels[0].corners {
        let at = &mut corner.target_mm;
        at.z += 3.0 * ((at.x - 150.0) / 100.0).powi(2) - 2.0 * ((at.y - 80.0) / 80.0).powi(2);
    }
    let folder = folder(&flat, &detections(&bent, 15, 0.7));
    let at = folder.path();
    done(at, &format!("{CALIBRATE} --board-shape --print-scale 1.001,1.002"));
    let args = "calibrate corners --target board.json --fixed-intrinsics camera.yaml";
    let rms = |args: &str| {
        done(at, args);
        json(&at.join("poses.json"))["rms_px"].as_f64().unwrap()
    };
    let with = rms(&format!("{args} --shape camera.json"));
    let without = rms(args);
    assert!(with < 0.06 && without > 3.0 * with, "{with} {without}");
}

#[test]
fn what_calibrate_refuses() {
    let target = board(8, 9);
    let good = detections(&target, 6, 0.7);
    let folder = folder(&target, &good);
    let at = folder.path();
    let mut page = Page::default();
    std::fs::write(at.join("known.yaml"), camera().to_yaml()).unwrap();
    for name in ["blank", "foreign", "other"] {
        std::fs::create_dir(at.join(name)).unwrap();
    }
    image::GrayImage::new(64, 48).save(at.join("blank/0.png")).unwrap();
    std::fs::copy(at.join("board.json"), at.join("foreign/board.json")).unwrap();
    let pose = "--pose 3.1415926,0,0,-150,80,400";
    done(at, &format!("render board.json --camera known.yaml {pose} -o photos/00.png"));

    page.title("Files of other kinds in the folder are passed over");
    done(at, &format!("{CALIBRATE} -o corners/camera.yaml"));
    page.warned(at, &format!("deltille {CALIBRATE}"));
    std::fs::remove_file(at.join("corners/camera.json")).unwrap();
    page.title("Where they were meant, they are named");
    for args in [
        "corners camera.json --target board.json --model radtan",
        "foreign --target board.json --model radtan",
        "blank/0.png --target board.json --model radtan",
        "corners --target corners/00.json --model radtan",
        "corners --target board.json --fixed-intrinsics camera.json",
        "corners --target board.json --fixed-intrinsics known.yaml --shape camera.json",
    ] {
        page.refused(at, &format!("deltille calibrate {args}"));
    }
    page.title("Nothing of another kind is replaced");
    for args in [
        format!("{CALIBRATE} -o board.yaml --report page.html"),
        format!("{CALIBRATE} -o corners/00.yaml"),
        format!("{CALIBRATE} -o new.yaml --report blank/0.png/page.html"),
        format!("render board.json --camera known.yaml {pose} -o board.png"),
        "detect photos --target board.json -o photos".to_owned(),
        "octahedron --stl --name 00 -o photos".to_owned(),
    ] {
        page.refused(at, &format!("deltille {args}"));
    }
    page.title("Options that say nothing, or contradict each other or the pictures");
    for args in [
        "calibrate corners --target board.json",
        "calibrate corners --grid deltille --edge -20mm --model radtan",
        "calibrate corners --grid checker --edge 20mm --model radtan",
        "calibrate corners --target board.json --model radtan --print-scale -1,1",
        "rig --camera a=corners --camera b=./corners --target board.json",
        "rig --camera a=corners --camera b=other --known a=known.yaml --known a=known.yaml --target board.json",
        "rig --camera a=corners --camera b=other -o known.yaml --target board.json",
        "rig --camera ../left=corners --camera right=corners --target board.json -o out",
        "rig --camera a=corners --camera b=nowhere --target board.json",
        "experiment table2 blank",
    ] {
        page.refused(at, &format!("deltille {args}"));
    }

    page.title("Nothing counts twice");
    let mut renamed = good[0].clone();
    renamed.image = "copy.png".to_owned();
    std::fs::write(at.join("copy.json"), detection::write(&renamed)).unwrap();
    let twice = CALIBRATE.replace("corners", "corners copy.json corners/01.json");
    page.warned(at, &format!("deltille {twice}"));
    assert_eq!(json(&at.join("camera.json"))["views"].as_array().unwrap().len(), 6);

    let with = |count: usize, change: &dyn Fn(&mut Detection)| {
        let mut changed = good.clone();
        changed[..count].iter_mut().for_each(change);
        changed
    };
    let copied = |seen: &mut Detection| seen.grids.push(seen.grids[0].clone());
    let corner_twice = |seen: &mut Detection| {
        let first = seen.grids[0].corners[0];
        seen.grids[0].corners.push(GridCorner { x: first.x + 1.0, ..first });
    };
    let smaller = |seen: &mut Detection| (seen.width, seen.height) = (800, 600);
    for (title, target, detections) in [
        ("A grid again", &target, with(1, &copied)),
        ("A corner again", &target, with(1, &corner_twice)),
        ("A single view", &target, good[..1].to_vec()),
        ("Parallel views", &target, self::detections(&target, 6, 0.001)),
        ("Mirrored views", &target, with(6, &mirror)),
        ("Rows and columns exchanged", &target, with(6, &swap)),
        ("Two sizes", &target, with(1, &smaller)),
        ("Another board", &board(6, 7), good.clone()),
    ] {
        page.title(title);
        page.refused(self::folder(target, &detections).path(), &format!("deltille {CALIBRATE}"));
    }

    page.title("A plain board that is cut off");
    let cut_off = |seen: &mut Detection| {
        let cut = &mut seen.grids[0];
        cut.panel = None;
        cut.corners.truncate(20);
        cut.corners.iter_mut().for_each(|c| (c.row, c.id) = (c.row - 1, None));
    };
    let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 8, 9, 20.0) };
    let plain = Target::build("board", &TargetSpec::Board(spec), None).unwrap();
    page.warned(self::folder(&plain, &with(1, &cut_off)).path(), &format!("deltille {CALIBRATE}"));
    page.is("calibrate");
}

/// An icosahedron before two cameras, rendered, detected, calibrated, and its poses found.
#[test]
fn a_rig_is_calibrated_from_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let target = Target::build("ico", &spec, Some(&family)).unwrap();
    std::fs::write(at.join("ico.json"), target.to_json()).unwrap();
    let camera = Camera::centred(1200, 900, 1700.0, camera().lens);
    std::fs::write(at.join("true.yaml"), camera.to_yaml()).unwrap();
    let right = photographed(at, "ico", 5);
    let cameras = "--camera left=corners/left --camera right=corners/right";
    done(at, &format!("rig {cameras} --target ico.json -o rig --format kalibr,colmap"));
    let rig = json(&at.join("rig/rig.json"));
    assert!(rig["rms_px"].as_f64().unwrap() < 0.1, "{}", rig["rms_px"]);
    let found = motion(&rig["cameras"][1]["camera_from_rig"]);
    let [turn, step] = found.off(&right);
    assert!(turn.length() < 2e-3 && step.length() < 1.0, "{found:?} {right:?}");
    for file in ["left.yaml", "right.yaml", "camchain.yaml", "cameras.txt", "rig_config.json"] {
        assert!(at.join("rig").join(file).exists(), "{file}");
    }

    let lines = done(at, "pose left --target ico.json --camera true.yaml");
    assert_eq!(lines.lines().count(), 5, "{lines}");
    for line in lines.lines() {
        let found: Value = serde_json::from_str(line).unwrap();
        let picture = Path::new(found["image"].as_str().unwrap()).with_extension("json");
        let truth = &json(&at.join("left").join(picture))["camera_from_target"];
        let [found, truth] = [&found["camera_from_target"], truth].map(motion);
        let [turn, step] = found.off(&truth);
        assert!(turn.length() < 1e-3 && step.length() < 0.5, "{found:?} {truth:?}");
    }
    // A picture that cannot be read ends nothing, and has a line where each has one.
    std::fs::write(at.join("broken.png"), "no picture").unwrap();
    let args = "pose left/0.png broken.png left/1.png --target ico.json --camera true.yaml";
    for (option, count) in [("", 2), (" --every-picture", 3)] {
        let output = output(at, &format!("{args}{option}"));
        assert_eq!(output.status.code(), Some(1));
        let said = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<Value> =
            said.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(lines.len(), count, "{said}");
        assert_eq!(
            lines.iter().filter(|line| line["camera_from_target"].is_null()).count(),
            count - 2
        );
    }
    // A net printed at 101 % makes a larger solid, so much farther away.
    let pose = "pose left/0.png --target ico.json --camera true.yaml --print-scale";
    let line: Value = serde_json::from_str(&done(at, &format!("{pose} 1.01"))).unwrap();
    let first: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    let [larger, planned] = [&line, &first].map(|line| motion(&line["camera_from_target"]));
    assert!((larger.translation - 1.01 * planned.translation).length() < 1e-3, "{larger:?}");
    done(at, &format!("rig {cameras} --target ico.json -o larger --print-scale 1.01"));
    let larger = &json(&at.join("larger/rig.json"))["cameras"][1]["camera_from_rig"];
    let planned = motion(&rig["cameras"][1]["camera_from_rig"]).translation;
    assert!((motion(larger).translation - 1.01 * planned).length() < 1e-2, "{larger}");
    let mut refused = Page::default();
    refused.refused(at, &format!("deltille {pose} 1.01,1.02"));
    refused
        .refused(at, &format!("deltille rig {cameras} --camera third=nowhere --target ico.json"));
    refused.is("rig");

    // Frames that took no part, and a page with a section for each camera.
    let page = "--holdout 5 --report held --images left=left";
    std::fs::create_dir(at.join("held")).unwrap();
    done(at, &format!("rig {cameras} --target ico.json -o held {page}"));
    let rig = json(&at.join("held/rig.json"));
    let rms = [&rig, &rig["held_out"]].map(|of| of["rms_px"].as_f64().unwrap());
    assert!(rms.iter().all(|rms| *rms < 0.1), "{rms:?}");
    let names = |of: &Value| -> Vec<String> {
        let frames = of["frames"].as_array().unwrap().iter();
        frames.map(|frame| frame["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!((names(&rig).len(), names(&rig["held_out"])), (4, vec!["4".to_owned()]));
    for camera in rig["cameras"].as_array().unwrap() {
        let views = camera["views"].as_array().unwrap();
        let corners = views.iter().map(|view| view["corner_count"].as_u64().unwrap());
        assert_eq!(Some(corners.sum::<u64>()), camera["corners"].as_u64());
    }
    let page = std::fs::read_to_string(at.join("held/rig-report.html")).unwrap();
    let of_cameras = page.match_indices("class=\"camera\">").count();
    let pictures = page.matches("data:image/png").count();
    assert_eq!(
        (of_cameras, pictures),
        (2, 7),
        "sections of cameras, pictures and a sample of the left one"
    );

    // A wild corner, and a picture of another target.
    let path = at.join("corners/right/1.json");
    let mut wild = json(&path);
    let x = &mut wild["grids"][0]["corners"][3]["x"];
    *x = (x.as_f64().unwrap() + 40.0).into();
    std::fs::write(&path, wild.to_string()).unwrap();
    let path = at.join("corners/left/3.json");
    let mut foreign = json(&path);
    foreign["grids"][0]["panel"] = 99.into();
    std::fs::write(&path, foreign.to_string()).unwrap();
    let said = done(at, &format!("rig {cameras} --target ico.json -o rig"));
    let rig = json(&at.join("rig/rig.json"));
    let right = |key: &str| rig["cameras"][1][key].as_f64().unwrap();
    assert!(right("outliers") >= 1.0 && right("rms_px") > 3.0 * right("inlier_rms_px"), "{said}");
    let excluded = &rig["excluded"][0];
    assert_eq!([&excluded["camera"], &excluded["view"]], ["left", "3"], "{excluded}");
    assert_eq!(excluded["panel"], 99);
}

/// Photographs of a target in several poses by two cameras, and what is found in them; where the right camera is.
fn photographed(at: &Path, target: &str, frames: u32) -> Pose {
    let eye = DVec3::new(200.0, 20.0, 0.0);
    let right = Pose::looking_at(eye, DVec3::new(0.0, 0.0, 650.0), DVec3::NEG_Y);
    let places = [("left", Pose::IDENTITY), ("right", right)];
    for (name, place) in &places {
        for frame in 0..frames {
            let i = f64::from(frame);
            let turn = DVec3::new(0.9 - 0.5 * i, 1.1 * i - 2.0, 0.4 * i);
            let translation = DVec3::new(20.0 * i - 40.0, 30.0 - 15.0 * i, 600.0 + 25.0 * i);
            let rotation = DQuat::from_scaled_axis(turn);
            let pose = place.after(&Pose { rotation, translation });
            let (turn, at_mm) = (pose.rotation.to_scaled_axis(), pose.translation);
            let pose = turn.to_array().into_iter().chain(at_mm.to_array());
            let pose: Vec<String> = pose.map(|v| v.to_string()).collect();
            let file = format!("{name}/{frame}.png");
            let args = format!("render {target}.json --camera true.yaml -o {file} --seed {frame}");
            std::fs::create_dir_all(at.join(name)).unwrap();
            done(at, &format!("{args} --pose {}", pose.join(",")));
        }
        done(at, &format!("detect {name} --target {target}.json -o corners/{name}"));
    }
    right
}

/// A cube, and a solid of triangles and squares: the rig and the poses of the target are where they were, within four of
/// the deviations that are stated.
#[test]
fn rigs_are_calibrated_from_pictures_of_squares() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let camera = Camera::centred(1200, 900, 1700.0, camera().lens);
    std::fs::write(at.join("true.yaml"), camera.to_yaml()).unwrap();
    std::fs::write(at.join("mesh.obj"), cuboctahedron(90.0)).unwrap();
    done(at, "cube --edge 120mm --name cube");
    done(at, "solid --mesh mesh.obj --tiles 6 --name cubocta");
    for target in ["cube", "cubocta"] {
        let right = photographed(at, target, 6);
        let cameras = "--camera left=corners/left --camera right=corners/right";
        done(at, &format!("rig {cameras} --target {target}.json -o rig-{target}"));
        let rig = json(&at.join(format!("rig-{target}/rig.json")));
        is_within_four_deviations(&rig["cameras"][1]["camera_from_rig"], &right);
        for line in
            done(at, &format!("pose left --target {target}.json --camera true.yaml")).lines()
        {
            let found: Value = serde_json::from_str(line).unwrap();
            let picture = Path::new(found["image"].as_str().unwrap()).with_extension("json");
            let truth = &json(&at.join("left").join(picture))["camera_from_target"];
            is_within_four_deviations(&found["camera_from_target"], &motion(truth));
        }
        for folder in ["left", "right", "corners"] {
            std::fs::remove_dir_all(at.join(folder)).unwrap();
        }
    }
}

#[track_caller]
fn is_within_four_deviations(found: &Value, truth: &Pose) {
    let deviations = |key: &str| {
        let numbers = found[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
        DVec3::from_slice(&numbers.collect::<Vec<f64>>())
    };
    let [turn, step] = motion(found).off(truth);
    for (off, sd) in [(turn, "rotation_sd_rad"), (step, "translation_sd_mm")] {
        let parts = off / deviations(sd);
        assert!(parts.abs().max_element() < 4.0, "{sd}: {parts}");
    }
}

fn motion(value: &Value) -> Pose {
    let numbers = |key: &str| {
        let numbers = value[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
        numbers.collect::<Vec<f64>>()
    };
    let rotation = DMat3::from_cols_slice(&numbers("rotation")).transpose();
    let translation = DVec3::from_slice(&numbers("translation_mm"));
    Pose { rotation: DQuat::from_mat3(&rotation), translation }
}

/// What a file calls a target, a camera or a picture leads to no other folder, and does nothing to a terminal.
#[test]
fn names_in_files_lead_nowhere() {
    let target = board(8, 9);
    let found = detections(&target, 6, 0.7);
    let folder = folder(&target, &found);
    let path = |name: &str| folder.path().join(name);
    for (i, image) in ["../secret.png", "a\u{1b}[31m.png"].into_iter().enumerate() {
        let mut detection = found[i].clone();
        detection.image = image.to_owned();
        std::fs::write(path(&format!("corners/{i:02}.json")), detection::write(&detection))
            .unwrap();
    }
    std::fs::write(path("camera.yaml"), camera().to_yaml()).unwrap();
    let text = std::fs::read_to_string(path("board.json")).unwrap();
    let mut page = Page::default();
    for name in ["../../x", "/tmp/x", "..", "a\u{1b}[31mb", ""] {
        let name = serde_json::to_string(name).unwrap();
        page.title(&name);
        let named = format!("\"name\": {name}");
        std::fs::write(path("bad.json"), text.replacen("\"name\": \"board\"", &named, 1)).unwrap();
        let commands = [
            "verify bad.json",
            "render bad.json --camera camera.yaml -o out",
            "detect --target bad.json photo.png -o out",
            "calibrate corners --target bad.json --model radtan -o out/camera.yaml",
        ];
        for args in &commands[..if name.contains("31m") { 4 } else { 1 }] {
            page.refused(folder.path(), &format!("deltille {args}"));
        }
    }

    // A picture beside the folder of pictures is not shown.
    std::fs::create_dir(path("photos")).unwrap();
    image::GrayImage::from_pixel(64, 48, image::Luma([99])).save(path("secret.png")).unwrap();
    let args = "calibrate corners --target board.json --model radtan --images photos --report page.html -o camera2.yaml";
    page.title("Pictures that are not there");
    assert!(page.warned(folder.path(), &format!("deltille {args}")).status.success());
    page.is("names");
    assert!(!std::fs::read_to_string(path("page.html")).unwrap().contains("data:image"));
}

/// Detections of an icosahedron of which panel 7 is displaced, in so many pictures.
fn of_displaced_panel(target: &Target, count: usize, by_mm: DVec3) -> Vec<Detection> {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let lens = Lens::BrownConrady(BrownConrady::default());
    let camera = Camera::centred(1600, 1200, 1300.0, lens);
    let pictures = (0..count).map(|_| {
        let mut any = |reach: f64| random.random_range(-reach..reach);
        let rotation = DQuat::from_scaled_axis(DVec3::new(any(3.0), any(3.0), any(3.0)));
        let translation = DVec3::new(any(20.0), any(20.0), 420.0 + any(80.0));
        let pose = Pose { rotation, translation };
        let grids = target.panels.iter().enumerate().filter_map(|(index, panel)| {
            let mut place = panel.pose.to_pose();
            if index == 7 {
                place.translation += by_mm;
            }
            let pose = pose.after(&place);
            let faces = (pose.rotation * DVec3::Z).dot(-pose.translation.normalize()) > 0.4;
            let corners = panel.corners.iter().map(|corner| {
                let (x, y) = camera.project(pose.apply(corner.panel_mm.extend(0.0)))?.into();
                let mut off = || random.random_range(-0.1..0.1);
                let (row, col, id) = (corner.row, corner.col, Some(corner.id));
                Some(GridCorner { row, col, id, x: x + off(), y: y + off(), cov: None })
            });
            let corners: Vec<GridCorner> = corners.collect::<Option<_>>()?;
            let (kind, panel) = (panel.kind, Some(panel.id));
            faces.then(|| Grid {
                kind,
                target: None,
                panel,
                mirrored: false,
                corners,
                tags: Vec::new(),
            })
        });
        Detection::new("", [1600, 1200], grids.collect())
    });
    pictures.collect()
}

#[test]
fn a_displaced_panel_is_named_on_the_terminal_in_the_file_and_on_the_page() {
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let target = Target::build("board", &spec, Some(&family)).unwrap();
    let mut detections = of_displaced_panel(&target, 20, DVec3::new(0.0, 0.36, 0.48));
    detections[2].grids[0].corners[3].y = 1e5;
    let folder = folder(&target, &detections);
    let mut page = Page::default();
    let output = page.warned(folder.path(), &format!("deltille {CALIBRATE} --report page.html"));
    page.is("calibrate-panels");
    assert_eq!(output.status.code(), Some(0));
    let id = target.panels[7].id;
    let camera = json(&folder.path().join("camera.json"));
    assert_eq!(kinds(&camera, "findings"), ["outside_picture", "panel"]);
    let findings = camera["findings"].as_array().unwrap();
    let of_panel = findings.iter().find(|finding| finding["kind"] == "panel").unwrap();
    assert_eq!((&of_panel["panel"], &of_panel["left_out"]), (&id.into(), &true.into()));
    assert!((of_panel["moved_mm"].as_f64().unwrap() - 0.6).abs() < 0.05, "{of_panel}");
    let outliers = camera["outliers"].as_u64().unwrap();
    assert!(outliers <= of_panel["corners"].as_u64().unwrap() + 2, "{outliers} {of_panel}");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains(&format!("Panel {id}: ")), "the page names it");
    // Of less than makes outliers the residuals tell, and of nothing they tell nothing.
    for (by_mm, is_named) in [(0.15, true), (0.0, false)] {
        let detections = of_displaced_panel(&target, 20, DVec3::new(by_mm, 0.0, 0.0));
        let folder = self::folder(&target, &detections);
        done(folder.path(), CALIBRATE);
        let camera = json(&folder.path().join("camera.json"));
        let named = camera["diagnoses"].as_array().into_iter().flatten().any(|d| d["panel"] == id);
        assert_eq!(named, is_named, "{by_mm}: {}", camera["diagnoses"]);
    }
}

/// Camera files have no uncertainties, and neither have cameras that were given: no verdict has a basis then.
#[test]
fn a_comparison_without_uncertainties_is_undecided() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (target, mut random) = (board(6, 8), ChaCha8Rng::seed_from_u64(3));
    std::fs::write(at.join("board.json"), target.to_json()).unwrap();
    for part in ["a", "b"] {
        std::fs::create_dir(at.join(part)).unwrap();
        for view in 0..8 {
            let pose = crate::common::view::tilted(
                &mut random,
                target.panels[0].middle_mm(),
                300.0,
                0.1 + 0.08 * f64::from(view),
            );
            let found = detection(&target, &camera(), &pose, &mut random);
            let text = detection::write(&found);
            std::fs::write(at.join(format!("{part}/{view}.json")), text).unwrap();
        }
        done(at, &format!("calibrate {part} --target board.json --model radtan -o {part}.yaml"));
    }
    let code = |args: &str| {
        let result = output(at, args);
        (result.status.code(), String::from_utf8_lossy(&result.stdout).into_owned())
    };
    assert_eq!(code("compare a.json b.json").0, Some(0));
    for (args, which) in
        [("a.yaml b.yaml", "both"), ("a.yaml b.json", "the first"), ("a.json b.yaml", "the second")]
    {
        let (code, told) = code(&format!("compare {args} --region image -o said.json"));
        assert_eq!(code, Some(3), "{told}");
        assert!(told.contains("cannot judge whether the camera has changed"), "{told}");
        assert!(told.contains(&format!("the uncertainties of {which} are not known")), "{told}");
        let said = json(&at.join("said.json"));
        assert!(said["cameras"][0]["significant"].is_null());
        assert!(said["cameras"][0]["undecided"].as_str().unwrap().contains(which));
    }
    // What is tolerated needs no uncertainty, and what is the same is the same.
    assert_eq!(code("compare a.yaml b.yaml --region image --tolerance 50").0, Some(0));
    assert_eq!(code("compare a.yaml a.yaml").0, Some(0));
}

/// Boards of a `.dsc` that are each listed in their own plane have no poses to each other, unless a `.tp` has them.
#[test]
fn boards_of_a_list_without_poses_are_each_taken_by_itself() {
    use deltille::export::dsc::{self, Dialect};
    use deltille::limits::Limits;
    use deltille::target_file;

    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = BoardSpec { boards: 3, ..BoardSpec::new(GridKind::Deltille, 5, 6, 20.0) };
    let sheets = Target::build("cube", &TargetSpec::Board(spec), Some(&family)).unwrap();
    std::fs::write(at.join("cube.dsc"), dsc::write(&sheets, Dialect::Fork).unwrap()).unwrap();
    let read = || target_file::read(&at.join("cube.dsc"), &Limits::default());

    let loose = read().unwrap();
    assert!(loose.target.is_loose() && loose.target.overlapping_boards() == Some([0, 1]));
    let told = output(at, "calibrate none.json --target cube.dsc --model radtan");
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("the poses of its 3 boards on the target are missing"), "{told}");
    assert!(told.contains("put cube.tp beside it"), "{told}");

    let poses = "#calibration date\n0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1\n 0 0 -1 617.5\n0 1 0 4\n1 0 0 12\n\
                 2\n0 0 1 -10\n0 1 0 3\n-1 0 0 618\n7\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
    std::fs::write(at.join("cube.tp"), poses).unwrap();
    let cube = read().unwrap();
    assert!(!cube.target.is_loose());
    let corner = cube.target.panels[1].corners[7];
    let [x, y] = corner.panel_mm.to_array();
    assert!(corner.target_mm.distance(DVec3::new(617.5, 4.0 + y, 12.0 + x)) < 1e-9);

    for (wrong, why) in [
        (poses.replace("2\n0 0 1 -10", "3\n0 0 1 -10"), "board 2 of the .dsc has no pose"),
        (poses.replace(" 0 0 -1 617.5", " 0 0 1 617.5"), "R of board 1 is not a rotation"),
        (poses.replace("0 1 0 3", "0 1 0"), "four numbers"),
        (poses.replace("\n1\n", "\n0\n"), "board 0 has two poses"),
        (
            poses.split("2\n0 0 1").next().unwrap().to_owned() + "2\n1 0 0 5\n0 1 0 0\n0 0 1 0\n",
            "boards 0 and 2 in the same place",
        ),
    ] {
        std::fs::write(at.join("cube.tp"), wrong).unwrap();
        let error = read().unwrap_err().to_string();
        assert!(error.contains("cube.tp") && error.contains(why), "{error}");
    }
}
