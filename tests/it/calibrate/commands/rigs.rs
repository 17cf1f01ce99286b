//! `deltille rig`, `pose` and `rectify` on files.

use std::path::Path;

use super::{CALIBRATE, board, camera, done, folder, json, kinds, output, refused, seen_whole};
use crate::common::page::Page;
use crate::common::solids::cuboctahedron;
use deltille::camera::{BrownConrady, Camera, CameraFile, Lens, Pose};
use deltille::detect::{Detection, Grid, GridCorner};
use deltille::export::detection;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use glam::{DMat3, DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

#[test]
fn a_pair_with_an_upside_down_camera_is_rectified_upright() {
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
            let found = seen_whole(&target, &camera(), &pose, &mut random);
            std::fs::create_dir_all(at.join(name)).unwrap();
            std::fs::write(at.join(format!("{name}/{index}.json")), detection::write(&found))
                .unwrap();
        }
    }
    done(at, "rig --camera first=first --camera second=second --target board.json --model radtan");
    let pair = "--camera second=second --camera first=first --target board.json --model radtan";
    done(at, &format!("rig {pair} --known-poses rig.json -o kept"));
    let [before, kept] = ["rig.json", "kept/rig.json"]
        .map(|rig| motion(&json(&at.join(rig))["cameras"][1]["camera_from_rig"]));
    let [turn, step] = kept.off(&before.inverse());
    assert!(turn.length() < 1e-9 && step.length() < 1e-6, "{before:?} {kept:?}");
    let other = "rig --camera a=first --camera second=second --target board.json";
    let expected = "--known-poses: rig.json needs a and another of the cameras";
    refused(at, &format!("{other} --known-poses rig.json"), &[expected]);
    let said = done(at, "rectify rig.json --pair first,second -o pair");
    assert!(said.contains("a point is in the same row of both images"), "{said}");
    let pair = json(&at.join("pair/first-second.json"));
    let view = &pair["views"][1];
    let [sd, fraction] =
        ["position_sd_px", "calibrated_fraction"].map(|name| view[name].as_f64().unwrap());
    assert!(sd > 0.0 && sd < 1.0 && fraction > 0.0 && fraction < 1.0, "{sd} {fraction}");
    let poses = json(&at.join("rig.json"))["pose_uncertainty"].clone();
    let named = ["first", "second"].map(|name| {
        poses.as_array().unwrap().iter().filter(move |of| of["camera"] == name).count()
    });
    assert_eq!(named, [1, 1], "{poses}");
    let several = "--camera: rig.json: this file contains 2 cameras; use `deltille rectify`";
    refused(at, "undistort --camera rig.json", &[several]);
    let one = "calibrate first --target board.json --force";
    refused(at, &format!("{one} -o board.yaml"), &["board.json is read by this command"]);
    refused(at, &format!("{one} --covariance board.json"), &["board.json is another file"]);
    // Their diagonals are 1 without a rotation.
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

/// An icosahedron in front of two cameras: rendered, detected, calibrated, and located.
#[test]
fn a_rig_is_calibrated_from_images() {
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
    done(
        at,
        &format!("rig {cameras} --target ico.json -o rig --model radtan --format kalibr,colmap"),
    );
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
    // An unreadable image does not stop the others, and has a line of its own.
    std::fs::write(at.join("broken.png"), "no picture").unwrap();
    let args = "pose left/0.png broken.png left/1.png --target ico.json --camera true.yaml";
    for (option, count) in [("", 2), (" --all-images", 3)] {
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
    // A net printed at 101 % makes a larger solid, which is proportionally farther away.
    let pose = "pose left/0.png --target ico.json --camera true.yaml --print-scale";
    let line: Value = serde_json::from_str(&done(at, &format!("{pose} 1.01"))).unwrap();
    let first: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    let [larger, planned] = [&line, &first].map(|line| motion(&line["camera_from_target"]));
    assert!((larger.translation - 1.01 * planned.translation).length() < 1e-3, "{larger:?}");
    done(
        at,
        &format!("rig {cameras} --target ico.json -o larger --model radtan --print-scale 1.01"),
    );
    let larger = &json(&at.join("larger/rig.json"))["cameras"][1]["camera_from_rig"];
    let planned = motion(&rig["cameras"][1]["camera_from_rig"]).translation;
    assert!((motion(larger).translation - 1.01 * planned).length() < 1e-2, "{larger}");
    let mut refused = Page::default();
    refused.refused(at, &format!("deltille {pose} 1.01,1.02"));
    refused
        .refused(at, &format!("deltille rig {cameras} --camera third=nowhere --target ico.json"));
    refused.is("rig");

    // Held-out frames, and a page with a section for each camera.
    let page = "--holdout 5 --report held --images left=left";
    std::fs::create_dir(at.join("held")).unwrap();
    done(at, &format!("rig {cameras} --target ico.json -o held --model radtan {page}"));
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

    // An outlier, and an image of another target.
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

/// Renders and detects images of a target in several poses by two cameras; returns the pose of the right camera.
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

/// A cube, and a solid of triangles and squares: the errors of the rig and of the poses of the target are within four
/// stated standard deviations.
#[test]
fn rigs_are_calibrated_from_images_of_squares() {
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

/// Detections of an icosahedron with a displaced panel 7, in `count` images.
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
    assert_eq!(kinds(&camera, "findings"), ["outside_image", "panel"]);
    let findings = camera["findings"].as_array().unwrap();
    let of_panel = findings.iter().find(|finding| finding["kind"] == "panel").unwrap();
    assert_eq!((&of_panel["panel"], &of_panel["excluded"]), (&id.into(), &true.into()));
    assert!((of_panel["displacement_mm"].as_f64().unwrap() - 0.6).abs() < 0.05, "{of_panel}");
    let outliers = camera["outliers"].as_u64().unwrap();
    assert!(outliers <= of_panel["corners"].as_u64().unwrap() + 2, "{outliers} {of_panel}");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains(&format!("Panel {id}: ")), "the page names it");
    // A displacement too small for outliers shows in the residuals; no displacement does not.
    for (by_mm, is_named) in [(0.15, true), (0.0, false)] {
        let detections = of_displaced_panel(&target, 20, DVec3::new(by_mm, 0.0, 0.0));
        let folder = self::folder(&target, &detections);
        done(folder.path(), CALIBRATE);
        let camera = json(&folder.path().join("camera.json"));
        let named = camera["diagnoses"].as_array().into_iter().flatten().any(|d| d["panel"] == id);
        assert_eq!(named, is_named, "{by_mm}: {}", camera["diagnoses"]);
    }
}

/// Boards of a `.dsc` that are listed each in its own plane have no relative poses, unless a `.tp` file gives them.
#[test]
fn boards_of_a_list_without_poses_are_independent() {
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
    let result = output(at, "calibrate none.json --target cube.dsc --model radtan");
    let stderr = String::from_utf8_lossy(&result.stderr).into_owned();
    assert!(stderr.contains("the poses of its 3 boards on the target are missing"), "{stderr}");
    assert!(stderr.contains("put cube.tp beside this file"), "{stderr}");

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
            "boards 0 and 2 have the same position",
        ),
    ] {
        std::fs::write(at.join("cube.tp"), wrong).unwrap();
        let error = read().unwrap_err().to_string();
        assert!(error.contains("cube.tp") && error.contains(why), "{error}");
    }
}
