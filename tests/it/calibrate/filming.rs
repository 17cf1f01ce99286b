//! `deltille calibrate` from videos, recordings and photographs.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::glam::{DQuat, DVec3};
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{BoardSpec, Target};
use serde_json::Value;

const SIZE: [usize; 2] = [320, 240];
const FOCAL_PX: f64 = 300.0;

/// Number of poses, and of frames at each.
const POSES: usize = 12;
const RESTS: usize = 4;

/// A folder with the description of a board.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 5 --cols 6 --edge 30mm").success();
    folder
}

/// Frames of a person who holds the board at one pose after the other.
fn frames() -> Vec<Vec<u8>> {
    seen_from(Pose::IDENTITY)
}

/// These frames in a camera whose pose relative to the first one is given.
fn seen_from(camera_from_first: Pose) -> Vec<Vec<u8>> {
    let target = Target::new("board", BoardSpec::deltille(5, 6, 30.0)).unwrap();
    let scene = scene_of_target(&target).unwrap();
    let [width, height] = SIZE.map(|side| side as u32);
    let camera =
        Camera::centred(width, height, FOCAL_PX, Lens::BrownConrady(BrownConrady::default()));
    let middle = target.panels[0].middle_mm();
    let frame = |index: usize| {
        // The board moves before and after the first frame of each pose.
        let (pose, rest) = (index / RESTS, index % RESTS);
        let pose = pose as f64 + if rest == 0 { -0.5 } else { 0.0 };
        let (sin, cos) = (2.4 * pose).sin_cos();
        let tilt = DQuat::from_scaled_axis(DVec3::new(0.6 * cos, 0.6 * sin, 0.2 * sin));
        let rotation = tilt * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(40.0 * sin, 25.0 * cos, 330.0);
        let pose = Pose { rotation, translation: centre - rotation * middle };
        let pose = camera_from_first.after(&pose);
        let light = Light::default().noise(0.005).seed(index as u64);
        let image = scene.render(&camera, &pose, &light).map(|grey| (255.0 * grey + 0.5) as u8);
        image.pixels().to_vec()
    };
    (0..POSES * RESTS).map(frame).collect()
}

/// Writes frames as an uncompressed video without colour.
fn write_video(path: &Path, rate: u32, frames: &[Vec<u8>]) {
    let mut file = fs::File::create(path).unwrap();
    writeln!(file, "YUV4MPEG2 W{} H{} F{rate}:1 Cmono", SIZE[0], SIZE[1]).unwrap();
    for frame in frames {
        file.write_all(b"FRAME\n").unwrap();
        file.write_all(frame).unwrap();
    }
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Runs `deltille calibrate`, and returns what it says on standard error.
fn calibrated(folder: &Path, args: &str) -> String {
    let args = format!("calibrate {args} --target board.json");
    let done = deltille(folder, &args).success();
    String::from_utf8(done.get_output().stderr.clone()).unwrap()
}

fn focal_is_right(found: &Value) {
    let focal = &found["parameters"][0];
    let [value, sd] = ["value", "sd"].map(|key| focal[key].as_f64().unwrap());
    assert!((value - FOCAL_PX).abs() < 5.0 * sd, "{focal}");
}

#[test]
fn a_video_becomes_a_camera() {
    let folder = folder();
    let at = folder.path();
    write_video(&at.join("film.y4m"), 30, &frames());
    let said = calibrated(at, "film.y4m --model plumb_bob --views 10 -o few.yaml");
    assert!(said.contains("note: --model plumb_bob is radtan5 (radtan and k3) here"), "{said}");
    assert!(said.contains("48 frames, 48 with the target, "), "{said}");
    let few = json(&at.join("few.json"));
    focal_is_right(&few);
    // The still frames are used; those in motion are not.
    let views = few["views"].as_array().unwrap();
    let number = |view: &Value| -> usize {
        view["name"].as_str().unwrap().strip_prefix("film-").unwrap().parse().unwrap()
    };
    assert_eq!(views.len(), 10);
    assert!(views.iter().all(|view| number(view) % RESTS == 2), "{views:?}");
    // Without any option, a model is selected.
    calibrated(at, "film.y4m");
    focal_is_right(&json(&at.join("camera.json")));
}

#[test]
fn videos_of_two_cameras_become_a_rig() {
    let folder = folder();
    let at = folder.path();
    let rotation = DQuat::from_rotation_y(0.1);
    let translation = DVec3::new(-45.0, 2.0, 3.0);
    let right = seen_from(Pose { rotation, translation });
    write_video(&at.join("left.y4m"), 30, &frames());
    // The second frame of each two is missing.
    let right: Vec<Vec<u8>> = right.into_iter().step_by(2).collect();
    write_video(&at.join("right.y4m"), 15, &right);
    let rig = "rig --camera left=left.y4m --camera right=right.y4m --target board.json";
    let exact = "--model radtan --board-accuracy 0 -o rig";
    let done = deltille(at, &format!("{rig} --views 10 {exact}")).success();
    let said = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    let sets = "24 sets of simultaneous images, at most 0.0 ms apart (limit 16.7 ms); 24 images of left without a partner";
    assert!(said.contains(sets), "{said}");
    let found = json(&at.join("rig/rig.json"));
    assert_eq!(found["frames"].as_array().unwrap().len(), 10);
    let motion = &found["cameras"][1]["camera_from_rig"];
    for (axis, expected) in translation.to_array().into_iter().enumerate() {
        let [value, sd] =
            ["translation_mm", "translation_sd_mm"].map(|key| motion[key][axis].as_f64().unwrap());
        assert!((value - expected).abs() < 5.0 * sd, "{motion}");
    }
    found["cameras"].as_array().unwrap().iter().for_each(focal_is_right);
    // Other frames of these videos agree with it.
    let check =
        "check rig/rig.json --camera left=left.y4m --camera right=right.y4m --target board.json";
    deltille(at, &format!("{check} --views 6 --board-accuracy 0")).success();

    let mut page = Page::default();
    page.title("Recordings that are not those of a rig");
    let sample = Path::new(crate::common::REPOSITORY).join("tests/recordings/run.mcap");
    fs::copy(sample, at.join("run.mcap")).unwrap();
    fs::create_dir(at.join("photos")).unwrap();
    image::GrayImage::new(64, 64).save(at.join("photos/a.png")).unwrap();
    for inputs in [
        "run.mcap",
        "run.mcap --topic /camera/image",
        "run.mcap --topic /camera/image --topic /camera/image",
        "run.mcap --topic /camera/image --topic /rear",
        "run.mcap --topic ../up=/camera/image --topic /right",
        "left.y4m",
        "left.y4m --topic /camera/image --topic /right",
        "--camera left=left.y4m --camera right=run.mcap",
        "--camera left=left.y4m --camera right=run.mcap --topic /right",
        "--camera left=left.y4m --camera right=run.mcap --topic rear=/right",
        "--camera left=left.y4m --camera right=run.mcap --topic right=/camera/image",
        "--camera left=left.y4m --camera right=photos",
    ] {
        page.refused(at, &format!("deltille rig {inputs} --target board.json -o none"));
    }
    assert!(!at.join("none").exists());
    page.is("rig-filming");
}

#[test]
fn photographs_become_a_camera() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("photos")).unwrap();
    for (index, frame) in frames().into_iter().enumerate().skip(2).step_by(RESTS) {
        let [width, height] = SIZE.map(|side| side as u32);
        let image = image::GrayImage::from_raw(width, height, frame).unwrap();
        image.save(at.join(format!("photos/{index}.png"))).unwrap();
    }
    calibrated(at, "photos --model radtan");
    let found = json(&at.join("camera.json"));
    focal_is_right(&found);
    assert_eq!(found["views"].as_array().unwrap().len(), POSES);

    let mut page = Page::default();
    page.title("Input that cannot be calibrated");
    deltille(at, "detect photos --target board.json -o corners").success();
    fs::copy(
        Path::new(crate::common::REPOSITORY).join("tests/recordings/run.mcap"),
        at.join("run.mcap"),
    )
    .unwrap();
    fs::create_dir(at.join("empty")).unwrap();
    image::GrayImage::new(64, 64).save(at.join("empty/a.png")).unwrap();
    for inputs in [
        "photos",
        "run.mcap --target board.json",
        "photos corners --target board.json",
        "photos run.mcap --target board.json",
        "absent.mp4 --target board.json",
        "photos --target board.json --model lens",
    ] {
        page.refused(at, &format!("deltille calibrate {inputs}"));
    }
    page.is("filming");
}
