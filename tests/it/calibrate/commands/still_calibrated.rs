//! `deltille check`: the three answers and their exit codes.

use super::{
    CALIBRATE, board, camera, detections, done, folder, json, output, refused, seen_whole,
};
use deltille::camera::{Camera, Pose};
use deltille::detect::Detection;
use deltille::export::detection;
use deltille::targets::Target;
use glam::{DQuat, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::path::Path;

/// Views of a camera, tilted by these angles to all sides.
pub(super) fn views(
    target: &Target,
    camera: &Camera,
    tilts_rad: &[f64],
    seed: u64,
) -> Vec<Detection> {
    beside(target, camera, &Pose::IDENTITY, tilts_rad, seed)
}

/// The same views of a camera with this pose on the rig.
pub(super) fn beside(
    target: &Target,
    camera: &Camera,
    camera_from_rig: &Pose,
    tilts_rad: &[f64],
    seed: u64,
) -> Vec<Detection> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let middle = target.panels[0].middle_mm();
    let pose = |(index, &tilt): (usize, &f64)| {
        let side = DVec3::new(f64::cos(2.0 * index as f64), f64::sin(2.0 * index as f64), 0.0);
        let facing = DQuat::from_rotation_x(std::f64::consts::PI);
        let rotation = DQuat::from_scaled_axis(side * tilt) * facing;
        let centre = DVec3::new(60.0 * side.x, 40.0 * side.y, 330.0);
        camera_from_rig.after(&Pose { rotation, translation: centre - rotation * middle })
    };
    let poses: Vec<Pose> = tilts_rad.iter().enumerate().map(pose).collect();
    poses.iter().map(|pose| seen_whole(target, camera, pose, &mut random)).collect()
}

pub(super) fn write(at: &Path, name: &str, detections: &[Detection]) {
    std::fs::create_dir_all(at.join(name)).unwrap();
    for (index, found) in detections.iter().enumerate() {
        let mut found = found.clone();
        found.image = format!("{index}.png");
        std::fs::write(at.join(format!("{name}/{index}.json")), detection::write(&found)).unwrap();
    }
}

/// The exit code, the printed text and the file of a check of views.
fn check(at: &Path, camera: &str, views: &str) -> (Option<i32>, String, Value) {
    let inputs = match camera.starts_with("rig") {
        true => format!("--camera left={views}/left --camera right={views}/right"),
        false => views.to_owned(),
    };
    let args = format!(
        "check {camera} {inputs} --target board.json --board-accuracy 0 -o {views}.json --force"
    );
    let result = output(at, &args);
    let text = String::from_utf8_lossy(&result.stdout).into_owned();
    (result.status.code(), text, json(&at.join(format!("{views}.json"))))
}

#[test]
fn a_check_answers_unchanged_changed_or_cannot_tell() {
    let target = board(8, 9);
    let folder = folder(&target, &detections(&target, 20, 0.7));
    let at = folder.path();
    // The simulated board is exact. With the default accuracy of a printed one, the answer is "cannot tell".
    done(at, &format!("{CALIBRATE} --board-accuracy 0"));
    let tilts = [0.5, 0.6, 0.4, 0.7, 0.5, 0.3];
    let zoomed = Camera { focal_px: camera().focal_px * 1.03, ..camera() };
    write(at, "same", &views(&target, &camera(), &tilts, 5));
    write(at, "zoomed", &views(&target, &zoomed, &tilts, 6));
    write(at, "flat", &views(&target, &camera(), &[0.0], 7));
    for (name, [width, height]) in [("resized", [800, 600]), ("rotated", [1200, 1600])] {
        let views = views(&target, &camera(), &tilts, 8).into_iter();
        let of_size = views.map(|mut found| {
            (found.width, found.height) = (width, height);
            found
        });
        write(at, name, &of_size.collect::<Vec<_>>());
    }
    write(at, "none", &[Detection::new("", [1600, 1200], Vec::new())]);

    let (code, text, found) = check(at, "camera.json", "same");
    assert_eq!((code, &found["answer"]), (Some(0), &"unchanged".into()), "{text}");
    assert!(text.contains("would have been found"), "{text}");
    let focal = &found["tests"][0];
    assert_eq!(focal["quantity"], "focal_length");
    assert!(focal["detectable"].as_f64().unwrap() < 1.0, "{focal}");

    let (code, text, found) = check(at, "camera.json", "zoomed");
    assert_eq!((code, &found["answer"]), (Some(1), &"changed".into()), "{text}");
    assert_eq!(found["changed"], serde_json::json!([{ "quantity": "focal_length" }]), "{text}");
    assert!((found["tests"][0]["change"].as_f64().unwrap() - 3.0).abs() < 0.3, "{text}");

    for (views, quantity) in [("resized", "resolution"), ("rotated", "orientation")] {
        let (code, text, found) = check(at, "camera.json", views);
        assert_eq!(code, Some(1), "{text}");
        assert_eq!(found["changed"], serde_json::json!([{ "quantity": quantity }]), "{text}");
    }

    for (camera, views, kind) in [
        ("camera.json", "flat", "undetermined"),
        ("camera.json", "none", "views"),
        ("camera.yaml", "same", "covariance"),
    ] {
        let (code, text, found) = check(at, camera, views);
        assert_eq!((code, &found["answer"]), (Some(3), &"cannot_tell".into()), "{text}");
        assert_eq!(found["missing"][0]["kind"], kind, "{text}");
        assert!(text.starts_with("cannot tell: "), "{text}");
    }
    // The calibration with the uncertainties is named only if it is there.
    std::fs::copy(at.join("camera.yaml"), at.join("alone.yaml")).unwrap();
    for (camera, named) in [("camera.yaml", "use camera.json"), ("alone.yaml", "use the .json")] {
        let said = output(at, &format!("check {camera} same --target board.json"));
        let [out, err] = [said.stdout, said.stderr].map(|text| String::from_utf8(text).unwrap());
        assert!(out.contains(&format!("no uncertainties: {named}")), "{out}");
        assert_eq!((out + &err).matches("uncertainties").count(), 1, "{err}");
    }
}

#[test]
fn a_check_of_a_rig_finds_a_camera_that_has_moved() {
    let target = board(8, 9);
    let folder = folder(&target, &[]);
    let at = folder.path();
    let right = Pose { translation: DVec3::new(-60.0, 1.0, 2.0), ..Pose::IDENTITY };
    let rotated = DQuat::from_rotation_y(0.01) * right.rotation;
    let moved = Pose { rotation: rotated, ..right };
    let many: Vec<f64> = (0..20).map(|index| 0.1 + 0.03 * f64::from(index)).collect();
    let few = [0.5, 0.6, 0.4, 0.7];
    for (name, tilts, pose, seed) in
        [("rig", &many[..], right, 3), ("same", &few, right, 5), ("moved", &few, moved, 7)]
    {
        write(at, &format!("{name}/left"), &views(&target, &camera(), tilts, seed));
        let of_right = beside(&target, &camera(), &pose, tilts, seed + 1);
        write(at, &format!("{name}/right"), &of_right);
    }
    let cameras = "--camera left=rig/left --camera right=rig/right";
    done(at, &format!("rig {cameras} --target board.json --board-accuracy 0 -o ."));

    let (code, text, found) = check(at, "rig.json", "same");
    assert_eq!((code, &found["answer"]), (Some(0), &"unchanged".into()), "{text}");
    let (code, text, found) = check(at, "rig.json", "moved");
    assert_eq!((code, &found["answer"]), (Some(1), &"changed".into()), "{text}");
    // A small rotation shifts the image as the principal point does.
    let pose = serde_json::json!({ "quantity": "pose", "camera": "right" });
    let named = ["changed", "or"].iter().flat_map(|list| found[list].as_array().unwrap());
    assert!(named.into_iter().any(|one| *one == pose), "{text}");
    // The images of the two cameras are exchanged.
    let target = "--target board.json --board-accuracy 0 -o exchanged.json";
    let of = "--camera left=same/right --camera right=same/left";
    let text =
        String::from_utf8(output(at, &format!("check rig.json {of} {target}")).stdout).unwrap();
    assert!(
        text.starts_with("changed: ")
            && text.contains("with the images of left and right exchanged"),
        "{text}"
    );
    assert_eq!(json(&at.join("exchanged.json"))["exchanged"], serde_json::json!(["left", "right"]));

    refused(at, "check rig.json same/left --target board.json", &["--camera NAME=PATH"]);
    let one = "check rig.json --camera left=same/left --target board.json";
    refused(at, one, &["--camera: no images of right"]);
    let every = "check rig.json --camera left=same/left --camera right=same/right --every 2 --target board.json";
    refused(at, every, &["--every: the inputs are detections"]);
    let wrong = "check rig.json --camera up=same/left --target board.json";
    refused(at, wrong, &["no camera is named up", "left, right"]);
}
