//! `deltille calibrate`, `rig` and `pose` from files to files, and input that makes no camera.

use std::path::Path;
use std::process::Output;

use crate::common::command::{deltille, refused};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use glam::{DMat3, DQuat, DVec2, DVec3};
use predicates::str::contains;
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
    Target::build("board", &TargetSpec::Board(spec), Some(&family), None).unwrap()
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
        panel: Some(panel.id),
        mirrored: false,
        corners,
        tags: Vec::new(),
    };
    Detection {
        width: camera.width,
        height: camera.height,
        grids: vec![grid],
        ..Detection::default()
    }
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
        let detection = Detection { image: format!("{i:02}.png"), ..detection.clone() };
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
    let said = done(at, &format!("{CALIBRATE} --holdout 5 --format {formats} --report page.html"));
    assert!(said.contains("12 views, 864 corners, rms 0.05"), "{said}");
    assert!(said.contains("held out: 3 views, 216 corners, rms 0.05"), "{said}");
    let found = Camera::from_yaml(&std::fs::read_to_string(at.join("camera.yaml")).unwrap());
    assert!((found.unwrap().focal_px.x - 625.0).abs() < 0.5);
    for end in ["-opencv.yaml", "-ros.yaml", "-camchain.yaml", "-cameras.txt", "-transforms.json"] {
        assert!(at.join(format!("camera{end}")).exists(), "{end}");
    }
    for camera in ["camera.yaml", "camera-opencv.yaml", "camera-ros.yaml"] {
        let args = format!(
            "calibrate corners --target board.json --fixed-intrinsics {camera} -o again.yaml"
        );
        assert!(done(at, &args).contains("15 views, 1080 corners, rms 0.05"));
    }
}

#[test]
fn wrong_detections_among_good_ones_are_left_out() {
    let target = board(8, 9);
    let mut detections = detections(&target, 15, 0.7);
    mirror(&mut detections[4]);
    swap(&mut detections[7]);
    detections[9].grids[0].panel = Some(77);
    let folder = folder(&target, &detections);
    let result = deltille(folder.path(), CALIBRATE).success();
    let result = result.stdout(contains("12 views, 864 corners, rms 0.05"));
    let said = String::from_utf8_lossy(&result.get_output().stderr);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 3, "{said}");
    let out = |name: &str| {
        let file = Path::new("corners").join(name);
        format!("warning: left out: {}: ", file.display())
    };
    assert!(lines[0].starts_with(&format!("{}the labels are mirrored", out("04.json"))), "{said}");
    assert!(lines[1].starts_with(&out("07.json")) && lines[1].contains("exchanged?"), "{said}");
    assert!(lines[2].starts_with(&format!("{}panel 77 is not on", out("09.json"))), "{said}");
    let camera = json(&folder.path().join("camera.json"));
    let excluded = camera["excluded"].as_array().unwrap();
    let of_last = |key: &str| &excluded[2][key];
    assert_eq!(excluded.len(), 3, "{excluded:?}");
    assert_eq!((of_last("view"), of_last("image")), (&"09".into(), &"09.png".into()));
    assert_eq!((of_last("panel"), of_last("corners")), (&77.into(), &72.into()));
    assert!(of_last("reason").as_str().unwrap().starts_with("panel 77 is not on"), "{excluded:?}");
}

#[test]
fn a_wild_corner_is_told_beside_the_rms_of_the_others() {
    let target = board(8, 9);
    let mut detections = detections(&target, 10, 0.7);
    detections[3].grids[0].corners[20].x += 60.0;
    let folder = folder(&target, &detections);
    let output = output(folder.path(), &format!("{CALIBRATE} --print-scale 0.998,1.001"));
    assert_eq!((output.status.code(), &*String::from_utf8_lossy(&output.stderr)), (Some(0), ""));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("px without 1 outlier"), "{said}");
    let camera = json(&folder.path().join("camera.json"));
    assert_eq!(camera["print_scale"], serde_json::json!([0.998, 1.001]));
    assert_eq!(camera["outliers"], 1);
    let rms = ["rms_px", "inlier_rms_px"].map(|key| camera[key].as_f64().unwrap());
    assert!(rms[0] > 1.0 && rms[1] < 0.2, "{rms:?}");
}

#[test]
fn a_camera_that_did_not_take_the_pictures_is_named() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 10, 0.7));
    let radial = [4.0, 0.0, 0.0];
    let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
    let other = Camera { focal_px: DVec2::splat(200.0), lens, ..camera() };
    std::fs::write(folder.path().join("other.yaml"), other.to_yaml()).unwrap();
    let args = "calibrate corners --target board.json --fixed-intrinsics other.yaml";
    let output = output(folder.path(), args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("other.yaml: with this camera corners are off by"), "{said}");
    assert!(!folder.path().join("poses.yaml").exists());
}

#[test]
fn a_pole_within_the_image_is_told() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 10, 0.7));
    // The same lens, its numerator and denominator each with a factor that is zero near r² = 1.44.
    let [k1, k2] = [-0.17, 0.02];
    let (zero, pole) = (-1.0 / 1.44, -1.0 / (1.44 + 1e-9));
    let radial = [k1 + zero, k2 + k1 * zero, k2 * zero];
    let denominator = [pole, 0.0, 0.0];
    let lens = BrownConrady { radial, denominator, ..BrownConrady::default() };
    let lens = Lens::BrownConrady(lens);
    std::fs::write(folder.path().join("pole.yaml"), Camera { lens, ..camera() }.to_yaml()).unwrap();
    let args = "calibrate corners --target board.json --fixed-intrinsics pole.yaml";
    let output = output(folder.path(), &format!("{args} --report page.html"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    // 1.2 (1 − 0.17 · 1.44 + 0.02 · 1.44²) · 625 px.
    assert!(said.contains("the lens is good up to 597 px from the principal point"), "{said}");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("The lens is good up to 597 px"));
}

#[test]
fn a_calibration_that_does_not_fit_says_why_and_so_does_its_page() {
    let flat = board(8, 9);
    let mut bent = flat.clone();
    for corner in &mut bent.panels[0].corners {
        let at = &mut corner.target_mm;
        at.z += 2.0 * ((at.x - 150.0) / 100.0).powi(2);
    }
    let other = BrownConrady { radial: [-0.12, 0.02, 0.0], ..BrownConrady::default() };
    let other = Camera { lens: Lens::BrownConrady(other), ..camera() };
    let told = |seen: &Target, args: &str| {
        let folder = folder(&flat, &detections(seen, 15, 0.7));
        std::fs::write(folder.path().join("other.yaml"), other.to_yaml()).unwrap();
        let args = format!("calibrate corners --target board.json {args} --report page.html");
        let output = output(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0));
        let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
        (String::from_utf8(output.stderr).unwrap(), page)
    };
    for (seen, args, cause) in [
        (&bent, "--model radtan", "try --board-shape"),
        (&flat, "--model radtan --print-scale 1.2,1.1", "--print-scale 1.2,1.1 is not how it was"),
        (&flat, "--fixed-intrinsics other.yaml", "the camera that was given is another one"),
        (&flat, "--model rational", "take --model radtan, which holds this lens as well"),
    ] {
        let (said, page) = told(seen, args);
        assert!(said.contains("warning: ") && said.contains(cause), "{args}: {said}");
        assert!(page.contains("class=\"warning\"") && page.contains(cause), "{args}");
        assert!(args.contains("rational") || !page.contains("no strong pattern"), "{args}");
    }
    let (said, page) = told(&flat, "--model radtan");
    assert!(said.is_empty() && page.contains("no strong pattern"), "{said}");
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
    let said = String::from_utf8(output(at, &format!("{args} --shape poses.json")).stderr).unwrap();
    assert!(said.contains("--shape: poses.json: no `board_shape` in it"), "{said}");
}

#[test]
fn options_that_contradict_each_other_or_the_disk_are_refused() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 4, 0.7));
    let at = folder.path();
    std::fs::write(at.join("known.yaml"), camera().to_yaml()).unwrap();
    std::fs::create_dir(at.join("other")).unwrap();
    std::fs::create_dir(at.join("blank")).unwrap();
    image::GrayImage::new(64, 48).save(at.join("blank/0.png")).unwrap();
    let rig = "rig --camera a=corners --target board.json";
    let cases = [
        (format!("{rig} --camera b=./corners"), "a and b have the same folder"),
        (
            format!("{rig} --camera b=other --known a=known.yaml --known a=known.yaml"),
            "--known: a is given twice",
        ),
        (
            format!("{rig} --camera b=other -o known.yaml"),
            "-o: known.yaml is a file where a folder",
        ),
        (
            "calibrate corners --grid deltille --edge -20mm --model radtan".to_owned(),
            "--edge: -20 is not between 0.001 and 100000 mm",
        ),
        ("experiment table2 blank".to_owned(), "blank: 0 of 1 images show the board whole"),
    ];
    for (args, reason) in cases {
        let said = refused(at, &args);
        assert!(said.contains(reason), "{args}: {said}");
    }
}

#[test]
fn input_that_makes_no_camera_is_refused_by_its_cause() {
    let target = board(8, 9);
    let good = detections(&target, 10, 0.7);
    let said = |target: &Target, detections: &[Detection]| {
        let folder = folder(target, detections);
        let said = refused(folder.path(), CALIBRATE);
        let written = ["camera.yaml", "camera.json"].map(|name| folder.path().join(name).exists());
        assert_eq!(written, [false; 2]);
        said
    };
    let one = said(&target, &good[..1]);
    assert!(one.contains("usable views: 1 of 1; a calibration needs at least 3"), "{one}");

    let parallel = said(&target, &detections(&target, 10, 0.001));
    assert!(parallel.contains("all views are parallel"), "{parallel}");

    let mut mirrored = good.clone();
    mirrored.iter_mut().for_each(mirror);
    let mirrored = said(&target, &mirrored);
    assert!(mirrored.contains("00: the labels are mirrored"), "{mirrored}");
    assert!(mirrored.contains("10 of 10"), "{mirrored}");

    let mut swapped = good.clone();
    swapped.iter_mut().for_each(swap);
    let swapped = said(&target, &swapped);
    assert!(swapped.contains("rows and columns exchanged?"), "{swapped}");

    let mut mixed = good.clone();
    (mixed[3].width, mixed[3].height) = (800, 600);
    let mixed = said(&target, &mixed);
    assert!(mixed.contains("00 is 1600 × 1200 px, 03 is 800 × 600 px"), "{mixed}");

    let foreign = said(&board(6, 7), &good);
    assert!(foreign.contains("the target does not belong to this detection"), "{foreign}");
}

#[test]
fn a_file_of_another_kind_is_not_replaced() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 5, 0.7));
    let at = folder.path();
    std::fs::write(at.join("known.yaml"), camera().to_yaml()).unwrap();
    let pose = "--pose 3.1415926,0,0,-150,80,400";
    done(at, &format!("render board.json --camera known.yaml {pose} -o photos/00.png"));
    let before = |name: &str| std::fs::read(at.join(name)).unwrap();
    let kept = ["board.json", "corners/00.json", "photos/00.json", "photos/00.png"];
    let contents = kept.map(before);
    let cases = [
        (
            format!("{CALIBRATE} -o board.yaml --report page.html"),
            "board.json holds deltille/target/1",
        ),
        (format!("{CALIBRATE} -o corners/00.yaml"), "corners/00.json holds deltille/detection/1"),
        (
            format!("render board.json --camera known.yaml {pose} -o board.png"),
            "board.json holds deltille/target/1",
        ),
        (
            "detect photos --target board.json -o photos".to_owned(),
            "photos/00.json holds deltille/truth/1, which would be lost: choose another place",
        ),
        (
            "octahedron --stl --name 00 -o photos".to_owned(),
            "photos/00.json holds deltille/truth/1",
        ),
    ];
    for (args, reason) in cases {
        let said = refused(at, &args);
        assert!(said.contains(reason), "{args}: {said}");
    }
    assert_eq!(kept.map(before), contents);
    for unwanted in ["board.yaml", "page.html", "corners/00.yaml", "board.png", "photos/00.stl"] {
        assert!(!at.join(unwanted).exists(), "{unwanted}");
    }
    // The same kind is: a second run.
    done(at, &format!("{CALIBRATE} -o again.yaml"));
    done(at, &format!("{CALIBRATE} -o again.yaml"));
}

#[test]
fn what_is_no_detection_is_passed_over_in_a_folder_and_named_where_it_was_meant() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 6, 0.7));
    let at = folder.path();
    done(at, &format!("{CALIBRATE} -o corners/camera.yaml"));
    let again = output(at, CALIBRATE);
    let said = String::from_utf8(again.stderr).unwrap();
    assert!(again.status.success(), "{said}");
    assert!(
        said.contains("left out: 1 file in the folder that hold no detection, such as"),
        "{said}"
    );
    assert!(String::from_utf8(again.stdout).unwrap().contains("6 views"));

    std::fs::remove_file(at.join("corners/camera.json")).unwrap();
    std::fs::create_dir(at.join("foreign")).unwrap();
    std::fs::copy(at.join("board.json"), at.join("foreign/board.json")).unwrap();
    image::GrayImage::new(64, 48).save(at.join("0.png")).unwrap();
    let calibrate = |of: &str, with: &str| format!("calibrate {of} --target {with} --model radtan");
    let cases = [
        (
            calibrate("corners camera.json", "board.json"),
            "camera.json: this is a deltille/calibration/1 file, not a detection",
        ),
        (calibrate("foreign", "board.json"), "foreign: no detection among the .json files"),
        (calibrate("0.png", "board.json"), "0.png: no text: pictures go to `deltille detect`"),
        (
            calibrate("corners", "corners/00.json"),
            "corners/00.json: this is a deltille/detection/1 file, not a target",
        ),
        (
            "calibrate corners --target board.json --fixed-intrinsics camera.json".to_owned(),
            "camera.json: this is a deltille/calibration/1 file, not a camera: give the .yaml",
        ),
        (
            "calibrate corners --grid checker --edge 20mm --model radtan".to_owned(),
            "00: the board in it has the other tiling",
        ),
        (format!("{CALIBRATE} --print-scale -1,1"), "`-1` is no measured length"),
        (format!("{CALIBRATE} -o new.yaml --report 0.png/page.html"), "0.png is no folder"),
    ];
    for (args, reason) in cases {
        let said = refused(at, &args);
        assert!(said.contains(reason), "{args}: {said}");
    }
    assert!(!at.join("new.yaml").exists());
}

#[test]
fn nothing_counts_twice() {
    let target = board(8, 9);
    let all = detections(&target, 6, 0.7);
    let folder = folder(&target, &all);
    let at = folder.path();
    let renamed = Detection { image: "copy.png".to_owned(), ..all[0].clone() };
    std::fs::write(at.join("copy.json"), detection::write(&renamed)).unwrap();
    let args = CALIBRATE.replace("corners", "corners copy.json corners/01.json");
    let result = output(at, &args);
    let [said, warned] =
        [result.stdout, result.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(said.contains("6 views, 432 corners"), "{said}");
    for (again, first) in [("copy.json", "corners/00.json"), ("corners/01.json", "corners/01.json")]
    {
        let line = format!("warning: {again}: the same corners as in {first}, counted");
        assert!(warned.contains(&line), "{warned}");
    }

    let refused_as = |detection: &Detection| {
        std::fs::write(at.join("corners/00.json"), detection::write(detection)).unwrap();
        refused(at, CALIBRATE)
    };
    let mut grid_twice = all[0].clone();
    grid_twice.grids.push(grid_twice.grids[0].clone());
    let said = refused_as(&grid_twice);
    assert!(said.contains("corners/00.json: grids[1] is grids[0] again"), "{said}");
    let mut corner_twice = all[0].clone();
    let first = corner_twice.grids[0].corners[0];
    corner_twice.grids[0].corners.push(GridCorner { x: first.x + 1.0, ..first });
    let said = refused_as(&corner_twice);
    assert!(said.contains("grids[0].corners[72]: another corner has this row and col"), "{said}");
}

#[test]
fn a_plain_board_that_is_cut_off_is_called_that() {
    let mut pictures = detections(&board(8, 9), 6, 0.7);
    let cut = &mut pictures[2].grids[0];
    cut.panel = None;
    cut.corners.truncate(20);
    for corner in &mut cut.corners {
        (corner.row, corner.id) = (corner.row - 1, None);
    }
    let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 8, 9, 20.0) };
    let plain = Target::build("board", &TargetSpec::Board(spec), None, None).unwrap();
    let folder = folder(&plain, &pictures);
    let result = output(folder.path(), CALIBRATE);
    let said = String::from_utf8(result.stderr).unwrap();
    assert!(result.status.success(), "{said}");
    let reason = "02.json: its rows and columns are not those of the target: without tags they are";
    assert!(said.contains(reason) && !said.contains("does not belong"), "{said}");
}

/// An icosahedron before two cameras, rendered, detected, calibrated, and its poses found.
#[test]
fn a_rig_is_calibrated_from_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let target = Target::build("ico", &spec, Some(&family), None).unwrap();
    std::fs::write(at.join("ico.json"), target.to_json()).unwrap();
    let camera = Camera::centred(1200, 900, 1700.0, camera().lens);
    std::fs::write(at.join("true.yaml"), camera.to_yaml()).unwrap();
    let eye = DVec3::new(200.0, 20.0, 0.0);
    let right = Pose::looking_at(eye, DVec3::new(0.0, 0.0, 650.0), DVec3::NEG_Y);
    let places = [("left", Pose::IDENTITY), ("right", right)];
    for (name, place) in &places {
        for frame in 0..5 {
            let i = f64::from(frame);
            let turn = DVec3::new(0.9 - 0.5 * i, 1.1 * i - 2.0, 0.4 * i);
            let translation = DVec3::new(20.0 * i - 40.0, 30.0 - 15.0 * i, 600.0 + 25.0 * i);
            let rotation = DQuat::from_scaled_axis(turn);
            let pose = place.after(&Pose { rotation, translation });
            let (turn, at_mm) = (pose.rotation.to_scaled_axis(), pose.translation);
            let pose = turn.to_array().into_iter().chain(at_mm.to_array());
            let pose: Vec<String> = pose.map(|v| v.to_string()).collect();
            let file = format!("{name}/{frame}.png");
            let args = format!("render ico.json --camera true.yaml -o {file} --seed {frame}");
            std::fs::create_dir_all(at.join(name)).unwrap();
            done(at, &format!("{args} --pose {}", pose.join(",")));
        }
        done(at, &format!("detect {name} --target ico.json -o corners/{name}"));
    }
    let cameras = "--camera left=corners/left --camera right=corners/right";
    let said = done(at, &format!("rig {cameras} --target ico.json -o rig --format kalibr,colmap"));
    assert!(said.starts_with("2 cameras, 5 frames, rms 0.0"), "{said}");
    let rig = json(&at.join("rig/rig.json"));
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
    let said = refused(at, &format!("{pose} 1.01,1.02"));
    assert!(said.contains("--print-scale: faces that are stretched in one direction"), "{said}");

    // Frames that took no part, and a page with a section for each camera.
    let page = "--holdout 5 --report held --images left=left";
    std::fs::create_dir(at.join("held")).unwrap();
    let said = done(at, &format!("rig {cameras} --target ico.json -o held {page}"));
    let [first, .., held_out] = said.lines().filter(|l| l.contains("rms")).collect::<Vec<_>>()[..]
    else {
        panic!("{said}")
    };
    assert!(first.starts_with("2 cameras, 4 frames, rms 0.0"), "{said}");
    assert!(held_out.starts_with("held out: 1 frame, rms 0.0"), "{said}");
    let rig = json(&at.join("held/rig.json"));
    let names = |of: &Value| -> Vec<String> {
        let frames = of["frames"].as_array().unwrap().iter();
        frames.map(|frame| frame["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!((names(&rig).len(), names(&rig["held_out"])), (4, vec!["4".to_owned()]));
    for camera in rig["cameras"].as_array().unwrap() {
        let views = camera["views"].as_array().unwrap();
        let corners = views.iter().map(|view| view["corners"].as_array().unwrap().len());
        assert_eq!(Some(corners.sum::<usize>() as u64), camera["corners"].as_u64());
    }
    let page = std::fs::read_to_string(at.join("held/rig-report.html")).unwrap();
    let of_cameras = page.match_indices("class=\"camera\">").count();
    let pictures = page.matches("data:image/png").count();
    assert_eq!((of_cameras, pictures), (2, 5), "sections of cameras and pictures of the left one");

    let wrong = refused(at, &format!("rig {cameras} --camera third=nowhere --target ico.json"));
    assert!(wrong.contains("third") && wrong.contains("nowhere"), "{wrong}");

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
    let right = said.lines().find(|line| line.starts_with("right: ")).unwrap();
    assert!(right.contains(" px without ") && right.contains(" outlier"), "{said}");
    let rig = json(&at.join("rig/rig.json"));
    let right = |key: &str| rig["cameras"][1][key].as_f64().unwrap();
    assert!(right("outliers") >= 1.0 && right("rms_px") > 3.0 * right("inlier_rms_px"), "{said}");
    let excluded = &rig["excluded"][0];
    assert_eq!([&excluded["camera"], &excluded["view"]], ["left", "3"], "{excluded}");
    assert_eq!(excluded["panel"], 99);
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
        let detection = Detection { image: image.to_owned(), ..found[i].clone() };
        std::fs::write(path(&format!("corners/{i:02}.json")), detection::write(&detection))
            .unwrap();
    }
    std::fs::write(path("camera.yaml"), camera().to_yaml()).unwrap();
    let text = std::fs::read_to_string(path("board.json")).unwrap();
    for name in ["../../x", "/tmp/x", "..", "a\u{1b}[31mb", ""] {
        let named = format!("\"name\": {}", serde_json::to_string(name).unwrap());
        std::fs::write(path("bad.json"), text.replacen("\"name\": \"board\"", &named, 1)).unwrap();
        for args in [
            "render bad.json --camera camera.yaml -o out",
            "detect --target bad.json photo.png -o out",
            "verify bad.json",
            "calibrate corners --target bad.json --model radtan -o out/camera.yaml",
        ] {
            let said = refused(folder.path(), args);
            assert!(said.contains("bad.json") && said.contains("`name`"), "{args}: {said}");
            assert!(!said.contains('\u{1b}'), "{args}: {said}");
        }
    }
    let rig = "rig --camera ../left=corners --camera right=corners --target board.json -o out";
    assert!(refused(folder.path(), rig).contains("--camera"));
    assert!(!path("out").exists());

    // A picture beside the folder of pictures is not shown.
    std::fs::create_dir(path("photos")).unwrap();
    image::GrayImage::from_pixel(64, 48, image::Luma([99])).save(path("secret.png")).unwrap();
    let args = "calibrate corners --target board.json --model radtan --images photos --report page.html -o camera2.yaml";
    let result = deltille(folder.path(), args).success();
    let said = String::from_utf8(result.get_output().stderr.clone()).unwrap();
    assert!(said.contains("6 of 6 pictures are not in photos"), "{said}");
    assert!(!said.contains('\u{1b}'), "{said}");
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
            faces.then(|| Grid { kind, panel, mirrored: false, corners, tags: Vec::new() })
        });
        Detection { width: 1600, height: 1200, grids: grids.collect(), ..Detection::default() }
    });
    pictures.collect()
}

#[test]
fn a_displaced_panel_is_named_on_the_terminal_in_the_file_and_on_the_page() {
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let target = Target::build("board", &spec, Some(&family), None).unwrap();
    let mut detections = of_displaced_panel(&target, 20, DVec3::new(0.0, 0.36, 0.48));
    detections[2].grids[0].corners[3].y = 1e5;
    let folder = folder(&target, &detections);
    let output = output(folder.path(), &format!("{CALIBRATE} --report page.html"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    let id = target.panels[7].id;
    assert!(said.contains(&format!("warning: panel {id}: ")), "{said}");
    assert!(said.contains("it seems displaced by 0.6"), "{said}");
    assert!(said.contains("view 02: 1 corner of "), "{said}");
    let camera = json(&folder.path().join("camera.json"));
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
        let output = self::output(folder.path(), CALIBRATE);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(said.contains(&format!("most of all panel {id}")), is_named, "{by_mm}: {said}");
    }
}
