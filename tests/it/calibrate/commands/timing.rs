//! `deltille timing`: the clocks of a rig, and recordings that cannot be used.

use super::{board, camera, done, folder, json, output, refused, seen_whole};
use deltille::camera::Pose;
use deltille::export::detection;
use deltille::targets::Target;
use glam::{DQuat, DVec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::Path;

const OFFSET_S: f64 = 0.011;

fn right() -> Pose {
    Pose { translation: DVec3::new(-60.0, 1.0, 2.0), ..Pose::IDENTITY }
}

/// The pose of a board that a hand waves.
fn waved(target: &Target, seconds: f64) -> Pose {
    let wave = |hertz: f64| (std::f64::consts::TAU * hertz * seconds).sin();
    let tilt = DVec3::new(0.4 * wave(0.4), 0.4 * wave(0.3), 0.2 * wave(0.2));
    let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
    let centre = DVec3::new(40.0 * wave(0.35), 30.0 * wave(0.45), 350.0 + 30.0 * wave(0.25));
    Pose { rotation, translation: centre - rotation * target.panels[0].middle_mm() }
}

/// Writes detections of both cameras at this rate (Hz); the right camera takes its images later.
fn write(at: &Path, target: &Target, name: &str, frames: usize, [rate, offset_s]: [f64; 2]) {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for (side, camera_from_rig, late) in
        [("left", Pose::IDENTITY, 0.0), ("right", right(), offset_s)]
    {
        let folder = at.join(name).join(side);
        std::fs::create_dir_all(&folder).unwrap();
        for index in 0..frames {
            let stamp = index as f64 / rate;
            let pose = camera_from_rig.after(&waved(target, stamp + late));
            let mut found = seen_whole(target, &camera(), &pose, &mut random);
            found.image = format!("{index:03}.png");
            found.time_ns = Some((1e9 * stamp) as i64);
            let text = detection::write(&found);
            std::fs::write(folder.join(format!("{index:03}.json")), text).unwrap();
        }
    }
}

#[test]
fn the_offset_of_a_camera_is_measured() {
    let target = board(8, 9);
    let folder = folder(&target, &[]);
    let at = folder.path();
    write(at, &target, "rest", 40, [5.0, 0.0]);
    write(at, &target, "waved", 240, [30.0, OFFSET_S]);
    let of = |name: &str| format!("--camera left={name}/left --camera right={name}/right");
    let exact = "--target board.json --board-accuracy 0 -o .";
    done(at, &format!("rig {} {exact}", of("rest")));
    let timing = "timing rig.json --target board.json";
    let text = done(at, &format!("{timing} {} -o timing.json", of("waved")));
    assert!(text.contains("right: no significant rolling shutter"), "{text}");
    let found = json(&at.join("timing.json"));
    let offset = &found["cameras"][1]["offset_s"];
    let [value, sd] = ["value", "sd"].map(|key| offset[key].as_f64().unwrap());
    assert!((value - OFFSET_S).abs() < 4.0 * sd && sd < 2e-4, "{text}");

    refused(at, &format!("{timing} --camera left=waved/left"), &["no images of right"]);
    let exchanged = "--camera left=waved/right --camera right=waved/left";
    refused(at, &format!("{timing} {exchanged}"), &["that each recording is that of its camera"]);
    write(at, &target, "short", 12, [30.0, OFFSET_S]);
    refused(at, &format!("{timing} {}", of("short")), &["only 12 frames of left have neighbours"]);
    refused(at, &format!("{timing} absent.mp4"), &["absent.mp4: No such file"]);

    for index in 0..240 {
        let path = at.join(format!("waved/right/{index:03}.json"));
        let mut found = json(&path);
        found["time_ns"] = (-found["time_ns"].as_i64().unwrap()).into();
        std::fs::write(path, found.to_string()).unwrap();
    }
    let disordered = output(at, &format!("{timing} {}", of("waved")));
    let said = String::from_utf8(disordered.stderr).unwrap();
    assert!(said.contains("right: time stamps are not in the order"), "{said}");
}

/// A rig that is calibrated from a moving target only, and recordings that do not suffice.
#[test]
fn views_are_compensated_for_the_clocks_of_a_rig() {
    let target = board(8, 9);
    let folder = folder(&target, &[]);
    let at = folder.path();
    write(at, &target, "waved", 240, [30.0, OFFSET_S]);
    let of_rig = "--camera left=waved/left --camera right=waved/right";
    let options = "--target board.json --board-accuracy 0 --model radtan --estimate-timing";
    let text = done(at, &format!("rig {of_rig} {options} -o ."));
    assert!(text.contains("right: no significant rolling shutter"), "{text}");
    let offset = &json(&at.join("rig-timing.json"))["cameras"][1]["offset_s"];
    let [value, sd] = ["value", "sd"].map(|key| offset[key].as_f64().unwrap());
    assert!((value - OFFSET_S).abs() < 4.0 * sd && sd < 2e-4, "{text}");
    // The board moves by up to 3 mm in the offset.
    let found = &json(&at.join("rig.json"))["cameras"][1];
    let at_mm = found["camera_from_rig"]["translation_mm"].as_array().unwrap();
    for (found_mm, truth_mm) in at_mm.iter().zip(right().translation.to_array()) {
        assert!((found_mm.as_f64().unwrap() - truth_mm).abs() < 0.1, "{found}");
    }

    let of_one = format!("calibrate waved/left {options}");
    refused(at, &format!("{of_one} --every 2"), &["--estimate-timing: ", "omit --every 2"]);
    image::GrayImage::new(64, 48).save(at.join("photo.png")).unwrap();
    let of_photograph = format!("calibrate photo.png {options}");
    refused(at, &of_photograph, &["--estimate-timing: photo.png: photographs have no time stamps"]);
    write(at, &target, "short", 12, [30.0, OFFSET_S]);
    let of_short = format!("calibrate short/left {options}");
    refused(at, &of_short, &["--estimate-timing: only 12 frames of camera have neighbours"]);
}
