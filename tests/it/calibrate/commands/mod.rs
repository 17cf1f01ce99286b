//! `deltille calibrate`, `rig` and `pose` on files, and input that cannot be calibrated.

mod accepted;
mod cameras;
mod names;
mod rigs;
mod robots;
mod still_calibrated;
mod timing;

use std::path::Path;
use std::process::Output;

use crate::common::command::deltille;
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

fn output(folder: &Path, args: &str) -> Output {
    deltille(folder, args).get_output().clone()
}

/// The standard output of a command that must succeed.
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

/// The detection of a fully visible board of one panel.
fn seen_whole(target: &Target, camera: &Camera, pose: &Pose, random: &mut ChaCha8Rng) -> Detection {
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

/// Detections of a board in `count` images, tilted by up to 0.7 rad.
fn detections(target: &Target, count: usize, tilt_rad: f64) -> Vec<Detection> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let middle = DVec3::new(150.0, 80.0, 0.0);
    let poses = (0..count).map(|_| {
        let mut any = |reach: f64| random.random_range(-reach..reach);
        let tilt = DVec3::new(any(1.0), any(1.0), 0.0) * tilt_rad;
        // y up on the print is y down in the camera: a rotation by 180° about x faces the board.
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let centre = DVec3::new(any(120.0), any(70.0), 400.0 + any(100.0));
        Pose { rotation, translation: centre - rotation * middle }
    });
    let poses: Vec<Pose> = poses.collect();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    poses.iter().map(|pose| seen_whole(target, &camera(), pose, &mut random)).collect()
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

/// Mirrors left and right.
fn mirror(detection: &mut Detection) {
    for corner in &mut detection.grids[0].corners {
        corner.x = 1599.0 - corner.x;
    }
}
/// Expects one line with the name of a file and advice, and exit code 2.
fn refused(folder: &Path, args: &str, words: &[&str]) {
    let said = String::from_utf8(output(folder, args).stderr).unwrap();
    deltille(folder, args).code(2);
    assert_eq!(said.lines().count(), 1, "{args}: {said}");
    assert!(words.iter().all(|words| said.contains(words)), "{args}: {said}");
}

/// The kinds of the diagnoses of an estimate.
fn kinds<'a>(of: &'a Value, list: &str) -> Vec<&'a str> {
    let all = of[list].as_array().into_iter().flatten();
    all.map(|said| said["kind"].as_str().unwrap()).collect()
}
