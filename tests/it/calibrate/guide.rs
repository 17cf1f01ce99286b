//! `deltille guide` on folders that fill up while it watches.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::glam::{DMat3, DQuat, DVec3};
use deltille::lattice::GridKind;
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{BoardSpec, Target};
use serde_json::Value;

fn board() -> Target {
    Target::new("desk", BoardSpec::new(GridKind::Deltille, 8, 10, 20.0)).unwrap()
}

fn camera() -> Camera {
    let lens = BrownConrady { radial: [-0.2, 0.05, 0.0], ..BrownConrady::default() };
    Camera::centred(1024, 768, 900.0, Lens::BrownConrady(lens))
}

/// The photograph of a board at a pose, as a PNG.
fn photograph(target: &Target, pose: &Pose, seed: u64) -> Vec<u8> {
    let scene = scene_of_target(target).unwrap();
    let light = Light::default().noise(0.01).seed(seed);
    let image = scene.render(&camera(), pose, &light).map(|grey| (255.0 * grey + 0.5) as u8);
    let (width, height) = (image.width() as u32, image.height() as u32);
    let image = image::GrayImage::from_raw(width, height, image.pixels().to_vec()).unwrap();
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

/// Poses of a person who was asked to tilt the board.
fn poses(target: &Target, count: usize) -> Vec<Pose> {
    let middle = target.panels[0].middle_mm();
    let pose = |index: usize| {
        let (sin, cos) = (2.4 * index as f64).sin_cos();
        let tilt = DQuat::from_scaled_axis(DVec3::new(0.5 * cos, 0.5 * sin, 0.2 * sin));
        let rotation = tilt * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(50.0 * sin, 30.0 * cos, 330.0);
        Pose { rotation, translation: centre - rotation * middle }
    };
    (0..count).map(pose).collect()
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The pose proposed in a file.
fn proposed(next: &Value) -> Pose {
    let numbers = |of: &Value| -> Vec<f64> {
        of.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let motion = &next["camera_from_target"];
    let rotation: [f64; 9] = numbers(&motion["rotation"]).try_into().unwrap();
    Pose {
        rotation: DQuat::from_mat3(&DMat3::from_cols_array(&rotation).transpose()),
        translation: DVec3::from_slice(&numbers(&motion["translation_mm"])),
    }
}

#[test]
fn proposed_photographs_are_taken_until_they_suffice() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let target = board();
    std::fs::write(at.join("desk.json"), target.to_json()).unwrap();
    std::fs::create_dir(at.join("photos")).unwrap();
    let command = "guide photos --target desk.json --once -o next.json --picture next.svg";

    let empty = deltille(at, command).success().get_output().clone();
    assert!(said(&empty).contains("hold the board in the middle"), "{}", said(&empty));
    assert!(!at.join("next.json").exists(), "the image size is not known");

    let mut pose = poses(&target, 1)[0];
    let mut sure = Vec::new();
    for index in 0..8 {
        let png = photograph(&target, &pose, index);
        std::fs::write(at.join(format!("photos/{index}.png")), png).unwrap();
        let output = deltille(at, command).success().get_output().clone();
        let next = json(&at.join("next.json"));
        assert_eq!(next["schema"], "deltille/next-view/1");
        assert_eq!(next["views"], index + 1, "{}", said(&output));
        assert!(said(&output).contains(next["description"].as_str().unwrap()), "{}", said(&output));
        let svg = std::fs::read_to_string(at.join("next.svg")).unwrap();
        let circles = svg.matches("<circle").count();
        assert_eq!(circles, next["corners"].as_array().unwrap().len());
        assert_eq!(svg.matches("<polyline").count(), 1, "an arrow shows the upper side");
        sure.push(next["uncertainty_px"].as_f64());
        pose = proposed(&next);
    }
    let sure: Vec<f64> = sure.into_iter().flatten().collect();
    assert!(sure.len() > 4, "a camera from the fourth photograph on: {sure:?}");
    let falls = sure.windows(2).all(|pair| pair[1] < pair[0]);
    assert!(falls, "every proposed photograph reduces the uncertainty: {sure:?}");

    // The program ends immediately, because the photographs suffice.
    let until = 1.01 * sure[sure.len() - 1];
    let watch = format!("guide photos --target desk.json --until {until} --picture next.png");
    let output = deltille(at, &watch).success().get_output().clone();
    assert!(said(&output).contains("done: calibrate with the photographs in photos"));
    let picture = image::open(at.join("next.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (1024, 768));
    let last = image::open(at.join("photos/7.png")).unwrap();
    assert!(picture.to_rgb8() == last.to_rgb8(), "no outline is drawn at the end");
}

#[test]
fn images_of_the_most_common_size_count_once_each() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let target = board();
    std::fs::write(at.join("desk.json"), target.to_json()).unwrap();
    std::fs::create_dir(at.join("photos")).unwrap();
    let command = "guide photos --target desk.json --once";
    std::fs::write(
        at.join("photos/a.png"),
        reduced(&photograph(&target, &poses(&target, 1)[0], 0), 8),
    )
    .unwrap();
    let output = deltille(at, command).code(1).get_output().clone();
    assert!(said(&output).contains("hold the board in the middle"), "{}", said(&output));

    let poses = poses(&target, 5);
    for (index, pose) in poses.iter().enumerate() {
        let png = photograph(&target, pose, index as u64);
        let small = index == 0;
        let png = if small { reduced(&png, 2) } else { png };
        std::fs::write(at.join(format!("photos/b{index}.png")), &png).unwrap();
        std::fs::write(at.join(format!("photos/c{index}.png")), &png).unwrap();
    }
    let output = deltille(at, command).success().get_output().clone();
    assert!(said(&output).contains("\n4 views: projection uncertainty"), "{}", said(&output));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr
            .contains("b0.png: excluded: it has 512 × 384 pixels, but most images have 1024 × 768"),
        "{stderr}"
    );
    assert!(stderr.contains("c3: excluded: it is a copy of the image of b3"), "{stderr}");
}

/// An image reduced by a whole number.
fn reduced(png: &[u8], by: u32) -> Vec<u8> {
    let image = image::load_from_memory(png).unwrap();
    let (width, height) = (image.width() / by, image.height() / by);
    let small = image.resize_exact(width, height, image::imageops::FilterType::Triangle);
    let mut png = std::io::Cursor::new(Vec::new());
    small.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

#[test]
fn a_growing_photograph_is_awaited_and_other_files_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let target = board();
    std::fs::write(at.join("desk.json"), target.to_json()).unwrap();
    std::fs::create_dir(at.join("photos")).unwrap();
    let poses = poses(&target, 5);
    for (index, pose) in poses[..4].iter().enumerate() {
        let png = photograph(&target, pose, index as u64);
        std::fs::write(at.join(format!("photos/{index}.png")), png).unwrap();
    }
    let last = photograph(&target, &poses[4], 4);
    let growing = at.join("photos/4.png");
    std::fs::write(&growing, &last[..last.len() / 2]).unwrap();
    std::fs::write(at.join("photos/note.png"), "no picture").unwrap();
    let child = Command::new(env!("CARGO_BIN_EXE_deltille"))
        .current_dir(at)
        .args(["guide", "photos", "--target", "desk.json", "--once"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    std::fs::write(&growing, &last).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let said = said(&output);
    assert!(said.contains("4.png: 80 corners") && said.contains("5 views: "), "{said}");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("note.png") && !stderr.contains("4.png"), "{stderr}");
}

#[test]
fn wrong_options_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("desk.json"), board().to_json()).unwrap();
    let loose = BoardSpec { boards: 2, ..BoardSpec::new(GridKind::Deltille, 8, 10, 20.0) };
    std::fs::write(at.join("two.json"), Target::new("two", loose).unwrap().to_json()).unwrap();
    std::fs::create_dir(at.join("photos")).unwrap();
    std::fs::write(at.join("mine.json"), "{}").unwrap();
    let mut page = Page::default();
    for arguments in [
        "nowhere --target desk.json",
        "photos --target nothing.json",
        "photos --target two.json",
        "photos --target desk.json --model spline",
        "photos --target desk.json --model auto",
        "photos --target desk.json --until 0",
        "photos --target desk.json --nearest 1m --farthest 50cm",
        "photos --target desk.json --picture next.gif",
        "photos --target desk.json --picture photos/next.png",
        "photos --target desk.json -o mine.json",
        "photos --target desk.json --camera desk.json",
        "photos --target desk.json --once",
    ] {
        page.run(at, &format!("deltille guide {arguments}"));
    }
    page.is("guide");
}
