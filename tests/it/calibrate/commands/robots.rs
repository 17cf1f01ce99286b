//! `deltille handeye`: the mountings on a robot, and poses that cannot be used.

use super::{board, camera, done, folder, json, output, refused, seen_whole};
use deltille::camera::{Camera, Pose};
use deltille::export::detection;
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::path::Path;

fn any(random: &mut ChaCha8Rng, turn: f64, step: f64) -> Pose {
    let mut vector = |reach: f64| DVec3::from([0; 3].map(|_| random.random_range(-reach..reach)));
    Pose { rotation: DQuat::from_scaled_axis(vector(turn)), translation: vector(step) }
}

/// A line of a table of poses.
fn line(name: &str, pose: &Pose) -> String {
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation.to_array(), pose.rotation.to_array());
    format!("{name},{x},{y},{z},{qx},{qy},{qz},{qw}\n")
}

const HEADER: &str = "image,x_mm,y_mm,z_mm,qx,qy,qz,qw\n";

fn pose(found: &Value) -> Pose {
    let numbers =
        |field: &str| -> Vec<f64> { serde_json::from_value(found[field].clone()).unwrap() };
    let transform = &found["static_transform"];
    let q: [f64; 4] = serde_json::from_value(transform["rotation_xyzw"].clone()).unwrap();
    let metres: Vec<f64> = serde_json::from_value(transform["translation_m"].clone()).unwrap();
    let translation = DVec3::from_slice(&numbers("translation_mm"));
    assert!((DVec3::from_slice(&metres) * 1000.0).distance(translation) < 1e-3);
    Pose { rotation: DQuat::from_array(q), translation }
}

/// Writes detections and poses (`poses.csv`) of a robot with noise of 0.1° and 0.3 mm; returns X, Z and the exact poses.
fn simulated(at: &Path, is_fixed: bool) -> ([Pose; 2], Vec<Pose>) {
    let (target, mut random) = (board(8, 9), ChaCha8Rng::seed_from_u64(5));
    let (x, z) = (any(&mut random, 2.0, 80.0), any(&mut random, 2.0, 400.0));
    let middle = target.panels[0].middle_mm();
    let facing = DQuat::from_rotation_x(std::f64::consts::PI);
    let (mut table, mut poses) = (HEADER.to_owned(), Vec::new());
    std::fs::create_dir_all(at.join("corners")).unwrap();
    for index in 0..18 {
        let small = any(&mut random, 0.5, 40.0);
        let rotation = small.rotation * facing;
        let translation = small.translation + DVec3::Z * 330.0 - rotation * middle;
        let seen = Pose { rotation, translation };
        let mount_from_ground = x.after(&seen).after(&z.inverse());
        let exact = if is_fixed { mount_from_ground } else { mount_from_ground.inverse() };
        let noise = any(&mut random, 0.003, 0.5);
        let noisy = Pose {
            rotation: noise.rotation * exact.rotation,
            translation: noise.translation + exact.translation,
        };
        let name = format!("{index:02}");
        table += &line(&format!("{name}.png"), &noisy);
        let mut found = seen_whole(&target, &camera(), &seen, &mut random);
        found.image = format!("{name}.png");
        std::fs::write(at.join(format!("corners/{name}.json")), detection::write(&found)).unwrap();
        poses.push(exact);
    }
    std::fs::write(at.join("poses.csv"), table).unwrap();
    ([x, z], poses)
}

const HAND_EYE: &str = "handeye corners --robot poses.csv --target board.json --force";

#[test]
fn camera_and_board_are_located_on_a_robot() {
    let target = board(8, 9);
    for (is_fixed, names, option) in [
        (false, ["flange_from_camera", "base_from_board"], ""),
        (true, ["base_from_camera", "flange_from_board"], " --eye-to-hand"),
    ] {
        let folder = folder(&target, &[]);
        let at = folder.path();
        let (truth, poses) = simulated(at, is_fixed);
        let text = done(at, &format!("{HAND_EYE}{option}"));
        assert!(text.contains("18 views, paired by name of the photograph"), "{text}");
        let found = json(&at.join("handeye.json"));
        for (name, truth) in names.iter().zip(&truth) {
            let [turn, step] = pose(&found[name]).off(truth);
            assert!(turn.length() < 2e-3 && step.length() < 0.7, "{name}: {turn} {step}");
        }
        let noise = &found["robot_noise"];
        let (turn, step) = (&noise["rotation_deg"], &noise["translation_mm"]);
        assert!((0.06..0.14).contains(&turn.as_f64().unwrap()), "{noise}");
        assert!((0.18..0.42).contains(&step.as_f64().unwrap()), "{noise}");

        // Without names, poses are in the order of the photographs; a wrong one is named.
        let mut table = HEADER.trim_start_matches("image,").to_owned();
        for (index, pose) in poses.iter().enumerate() {
            let wrong = Pose { translation: pose.translation + DVec3::X * 30.0, ..*pose };
            let line = line("", if index == 7 { &wrong } else { pose });
            table += line.trim_start_matches(',');
        }
        std::fs::write(at.join("poses.csv"), table).unwrap();
        let text = done(at, &format!("{HAND_EYE}{option} --scale"));
        assert!(text.contains("17 views, paired by order"), "{text}");
        let found = json(&at.join("handeye.json"));
        let used = |index: usize| found["views"][index]["used"].as_bool().unwrap();
        assert!((0..18).all(|index| used(index) == (index != 7)), "{text}");
        let [scale, sd] = ["scale", "scale_sd"].map(|field| found[field].as_f64().unwrap());
        assert!((scale - 1.0).abs() < 4.0 * sd && sd < 1e-3, "{scale} {sd}");
    }
}

#[test]
fn poses_that_cannot_be_used_are_refused() {
    let folder = folder(&board(8, 9), &[]);
    let at = folder.path();
    let (_, poses) = simulated(at, false);
    let table = std::fs::read_to_string(at.join("poses.csv")).unwrap();
    let said = |table: &str, words: &str| {
        std::fs::write(at.join("poses.csv"), table).unwrap();
        refused(at, HAND_EYE, &[words]);
    };
    let header = |header: &str| table.replacen(HEADER.trim_end(), header, 1);
    said(&header("image,x,y,z,qx,qy,qz,qw"), "--robot: poses.csv: line 1: column x has no unit");
    let order = "w was at the wrong end of the quaternions";
    said(&header("image,x_mm,y_mm,z_mm,qw,qx,qy,qz"), order);
    said(&header("image,x_m,y_m,z_m,qx,qy,qz,qw"), "the translations were in millimetres");
    let mut inverse = HEADER.to_owned();
    for (index, pose) in poses.iter().enumerate() {
        inverse += &line(&format!("{index:02}"), &pose.inverse());
    }
    said(&inverse, "the robot's poses look inverted");
    done(at, &format!("{HAND_EYE} --inverse-poses"));
    std::fs::write(at.join("poses.csv"), &table).unwrap();
    refused(
        at,
        &format!("{HAND_EYE} --inverse-poses"),
        &["change --inverse-poses if they are base_from_flange"],
    );
    let same: String = (0..18).map(|index| line(&format!("{index:02}"), &poses[0])).collect();
    said(&(HEADER.to_owned() + &same), "each photograph has a pose of its own");
    let few: Vec<&str> = table.lines().take(3).collect();
    said(&few.join("\n"), "only 2 photographs have a pose of the robot");
    said(&table.replace(".png", "-a.png"), "the poses are for 00-a.png, 01-a.png");
}

#[test]
fn another_camera_is_named() {
    let folder = folder(&board(8, 9), &[]);
    let at = folder.path();
    simulated(at, false);
    let run = |name: &str, camera: Camera| {
        std::fs::write(at.join(name), camera.to_yaml()).unwrap();
        output(at, &format!("{HAND_EYE} --camera {name}"))
    };
    let right = run("right.yaml", camera());
    let said = String::from_utf8(right.stderr).unwrap();
    assert!(right.status.success() && !said.contains("warning"), "{said}");
    assert_eq!(json(&at.join("handeye.json"))["findings"], serde_json::json!([]));
    let other = run("other.yaml", Camera { focal_px: camera().focal_px * 1.01, ..camera() });
    let said = String::from_utf8(other.stderr).unwrap();
    assert!(said.contains("warning: estimating the intrinsics lowers the residuals"), "{said}");
    assert_eq!(json(&at.join("handeye.json"))["findings"][0]["kind"], "remedy");
}

#[test]
fn a_scale_and_a_noise_that_the_photographs_contradict_are_named() {
    let folder = folder(&board(8, 9), &[]);
    let at = folder.path();
    let (_, poses) = simulated(at, false);
    let kinds = |options: &str| {
        done(at, &format!("{HAND_EYE} {options}"));
        let findings = json(&at.join("handeye.json"))["findings"].clone();
        let kinds =
            findings.as_array().unwrap().iter().map(|of| of["kind"].as_str().unwrap().to_owned());
        kinds.collect::<Vec<_>>()
    };
    assert!(kinds("").is_empty());
    assert!(kinds("--robot-noise 0.1deg,0.3mm").is_empty());
    assert_eq!(kinds("--robot-noise 1deg,0.3mm"), ["robot_noise"]);
    let mut table = HEADER.to_owned();
    for (index, pose) in poses.iter().enumerate() {
        let scaled = Pose { translation: pose.translation * 1.02, ..*pose };
        table += &line(&format!("{index:02}"), &scaled);
    }
    std::fs::write(at.join("poses.csv"), table).unwrap();
    assert_eq!(kinds(""), ["scale"]);
    assert!(kinds("--scale").is_empty());
    let mut table = HEADER.to_owned();
    for (index, pose) in poses.iter().enumerate() {
        let scaled = Pose { translation: pose.translation / 3.0, ..*pose };
        table += &line(&format!("{index:02}"), &scaled);
    }
    std::fs::write(at.join("poses.csv"), table).unwrap();
    refused(at, HAND_EYE, &["only if they are multiplied by 3.0"]);
}
