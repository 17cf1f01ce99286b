//! `deltille calibrate` and `compare` from files to files.

use super::{
    CALIBRATE, board, camera, detections, done, folder, json, kinds, mirror, output, refused,
    seen_whole, swap,
};
use crate::common::page::Page;
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

#[test]
fn several_boards_calibrate_a_camera_and_their_relative_pose_is_estimated() {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let boards = [("a", 0), ("b", 100)].map(|(name, first_id)| {
        let mut spec = BoardSpec::new(GridKind::Deltille, 8, 9, 20.0);
        spec.tags.as_mut().unwrap().first_id = first_id;
        Target::build(name, &TargetSpec::Board(spec), Some(&family)).unwrap()
    });
    let beside =
        Pose { rotation: DQuat::from_rotation_y(0.2), translation: DVec3::new(230.0, 15.0, 4.0) };
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let seen = (0..15).map(|_| {
        let mut any = |reach: f64| random.random_range(-reach..reach);
        let tilt = DVec3::new(any(0.6), any(0.6), 0.0);
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(any(60.0), any(40.0), 550.0);
        let pose = Pose { rotation, translation: centre - rotation * DVec3::new(230.0, 80.0, 0.0) };
        let mut both = Detection::new("", [1600, 1200], Vec::new());
        for (board, pose) in boards.iter().zip([pose, pose.after(&beside)]) {
            let of_board = seen_whole(board, &camera(), &pose, &mut random);
            both.targets.push(board.identity());
            let name = || Some(board.name.to_string());
            both.grids
                .extend(of_board.grids.into_iter().map(|grid| Grid { target: name(), ..grid }));
        }
        both
    });
    let seen: Vec<Detection> = seen.collect();
    let folder = folder(&boards[0], &seen);
    let at = folder.path();
    for board in &boards {
        std::fs::write(at.join(format!("{}.json", board.name)), board.to_json()).unwrap();
    }
    let both = "calibrate corners --target a.json --target b.json --model radtan";
    let text = done(at, &format!("{both} --report page.html"));
    assert!(text.lines().any(|line| line.starts_with("target b: at (")), "{text}");
    let found = json(&at.join("camera.json"));
    let of_b = &found["targets"][1];
    let at_mm = of_b["scene_from_target"]["translation_mm"].as_array().unwrap();
    let off = |axis: usize| at_mm[axis].as_f64().unwrap() - beside.translation[axis];
    assert!((0..3).all(|axis| off(axis).abs() < 0.2), "{of_b}");
    assert!((found["parameters"][0]["value"].as_f64().unwrap() - 625.0).abs() < 0.5);
    let page = std::fs::read_to_string(at.join("page.html")).unwrap();
    assert!(page.contains("Relative target poses"));
    refused(at, &format!("{both} --measure-target"), &["--measure-target: there are 2 targets"]);
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

#[test]
fn problems_are_reported_on_the_terminal_in_the_file_and_on_the_page() {
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
    let mut diagnosed = |title: &str, detections: &[Detection], args: &str| {
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
        // The sentences are the same everywhere.
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

    let found = diagnosed("Nothing is wrong", &good, "--model radtan");
    assert!(kinds(&found, "diagnoses").is_empty() && found["outliers"] == 0, "{found}");

    let mut wrong = good.clone();
    mirror(&mut wrong[4]);
    swap(&mut wrong[7]);
    wrong[9].grids[0].panel = Some(77);
    let found = diagnosed("Wrong detections among good ones", &wrong, "--model radtan");
    let excluded = found["excluded"].as_array().unwrap().iter();
    let excluded: Vec<[&Value; 4]> =
        excluded.map(|one| ["view", "image", "panel", "corners"].map(|key| &one[key])).collect();
    let expected = [("04", 0), ("07", 0), ("09", 77)]
        .map(|(view, panel)| serde_json::json!([view, format!("{view}.png"), panel, 72]));
    assert_eq!(serde_json::json!(excluded), serde_json::json!(expected));
    assert_eq!(found["views"].as_array().unwrap().len(), 12);

    let mut wild = good.clone();
    wild[3].grids[0].corners[20].x += 60.0;
    let found = diagnosed("An outlier", &wild, "--model radtan --print-scale 0.998,1.001");
    assert_eq!(found["print_scale"], serde_json::json!([0.998, 1.001]));
    assert_eq!(found["outliers"], 1);
    let rms = ["rms_px", "inlier_rms_px"].map(|key| found[key].as_f64().unwrap());
    assert!(rms[0] > 1.0 && rms[1] < 0.2, "{rms:?}");

    diagnosed("Another camera took the images", &good, "--fixed-intrinsics foreign.yaml");
    let found = diagnosed("A pole within the image", &good, "--fixed-intrinsics pole.yaml");
    let [diagnosis] = &found["diagnoses"].as_array().unwrap()[..] else { panic!("{found}") };
    // 1.2 (1 − 0.17 · 1.44 + 0.02 · 1.44²) · 625 px.
    assert_eq!(diagnosis["kind"], "non_monotonic_lens");
    assert!((diagnosis["monotonic_px"].as_f64().unwrap() - 597.4).abs() < 1.0, "{diagnosis}");

    let mut bent = flat.clone();
    for corner in &mut bent.panels[0].corners {
        let at = &mut corner.target_mm;
        at.z += 2.0 * ((at.x - 150.0) / 100.0).powi(2);
    }
    let bent = detections(&bent, 15, 0.7);
    for (title, seen, args, kind, key, value) in [
        ("A bent sheet", &bent, "--model radtan", "remedy", "alternative", "board_shape"),
        (
            "A wrong print scale",
            &good,
            "--model radtan --print-scale 1.2,1.1",
            "stretched_board",
            "kind",
            "stretched_board",
        ),
        (
            "A slightly different camera",
            &good,
            "--fixed-intrinsics other.yaml",
            "remedy",
            "alternative",
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
        let found = diagnosed(title, seen, args);
        let mut said = found["diagnoses"].as_array().unwrap().iter();
        assert!(said.any(|d| d["kind"] == kind && d[key] == value), "{title}: {said:?}");
    }
    page.is("calibrate-warnings");
}

#[test]
fn images_without_a_board_are_reported_with_the_most_common_reason() {
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
    let why = "no board of this kind found in 4 images; 2 of them: 1 tag not on the target, for example id 4";
    refused(folder.path(), CALIBRATE, &[why]);
    std::fs::create_dir(folder.path().join("b")).unwrap();
    std::fs::copy(folder.path().join("corners/00.json"), folder.path().join("b/00.json")).unwrap();
    let rig = "rig --camera a=corners --camera b=b --target board.json";
    refused(folder.path(), rig, &["--camera a", why]);
}

#[test]
fn a_repeated_folder_is_reported_in_one_line() {
    let folder = folder(&board(8, 9), &detections(&board(8, 9), 6, 0.7));
    let command = CALIBRATE.replacen("corners", "corners corners", 1);
    let said = String::from_utf8(output(folder.path(), &command).stderr).unwrap();
    let copies: Vec<&str> = said.lines().filter(|line| line.contains("counted once")).collect();
    let [line] = copies.as_slice() else { panic!("{said}") };
    assert!(line.contains("corners/00.json") && line.ends_with("5 more duplicates"), "{line}");
}

#[test]
fn photographs_of_two_cameras_are_named_in_one_warning() {
    let target = board(6, 7);
    let mut seen = detections(&target, 10, 0.5);
    for (index, found) in seen.iter_mut().enumerate() {
        let model = if index < 3 { "R5\u{1b}[2J" } else { "R6" };
        let file = serde_json::json!({"camera": {"make": "Canon", "model": model, "focal_mm": 24}});
        found.file = serde_json::from_value(file).unwrap();
    }
    let at = folder(&target, &seen);
    let result =
        output(at.path(), "calibrate corners --target board.json --model radtan -o camera.yaml");
    let said = String::from_utf8(result.stderr).unwrap();
    let line = "warning: corners: photographs of 2 cameras: Canon R5\\u{1b}[2J (3 images), Canon R6 (7 images); calibrate \
                each camera separately\n";
    assert_eq!(said.matches("photographs").count(), 1, "{said}");
    assert!(said.contains(line), "{said}");
}

#[test]
fn a_file_without_a_board_shape_is_refused_with_advice() {
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

/// From the eleventh image on, the focal length is 2 % longer.
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
    assert!(page.contains("The camera changed between views"));
    // The uncertainty of a failed calibration cannot show whether a change is significant.
    let result = output(folder.path(), "compare camera.json camera.json --distance 1m");
    let said = String::from_utf8(result.stderr).unwrap();
    assert!(said.contains("camera.json: the calibration failed: the camera changed"), "{said}");
}

#[test]
fn the_shape_of_a_sheet_is_stored_and_used() {
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
fn calibrate_refuses_wrong_input() {
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

    page.title("Files of other kinds in the folder are skipped");
    done(at, &format!("{CALIBRATE} -o corners/camera.yaml"));
    page.warned(at, &format!("deltille {CALIBRATE}"));
    std::fs::remove_file(at.join("corners/camera.json")).unwrap();
    page.title("Files of other kinds given by name are reported");
    for args in [
        "corners camera.json --target board.json --model radtan",
        "foreign --target board.json --model radtan",
        "corners --target corners/00.json --model radtan",
        "corners --target board.json --fixed-intrinsics corners/00.json",
        "corners --target board.json --fixed-intrinsics known.yaml --shape camera.json",
    ] {
        page.refused(at, &format!("deltille calibrate {args}"));
    }
    page.title("Files of other kinds are not replaced");
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
    page.title("Options without effect, or in contradiction to each other or to the images");
    for args in [
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

    page.title("A cut-off board without tags");
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

/// Neither camera files nor given cameras have uncertainties, so there is no basis for a verdict.
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
            let found = seen_whole(&target, &camera(), &pose, &mut random);
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
        let (code, stdout) = code(&format!("compare {args} --region image -o said.json"));
        assert_eq!(code, Some(3), "{stdout}");
        assert!(stdout.contains("cannot determine whether the camera has changed"), "{stdout}");
        let which = format!("{which} calibration");
        assert!(stdout.contains(&which), "{stdout}");
        let said = json(&at.join("said.json"));
        assert!(said["cameras"][0]["significant"].is_null());
        assert!(said["cameras"][0]["undecided"].as_str().unwrap().contains(&which));
    }
    // Differences within the tolerance and equal cameras need no uncertainties.
    assert_eq!(code("compare a.yaml b.yaml --region image --tolerance 50").0, Some(0));
    assert_eq!(code("compare a.yaml a.yaml").0, Some(0));
}
