//! Boards without tags that look the same after a rotation, seen by the cameras of a rig.

use deltille::calibrate::{
    Calibration, CameraViews, Diagnosis, Estimate, Intrinsics, LabelRotation, Model, Observation,
    PanelRef, Reference, Sighting, View,
};
use deltille::camera::{Camera, Pose};
use deltille::lattice::{LatticeMap, Vertex};
use deltille::targets::{BoardSpec, Target};
use glam::{DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::command::deltille;
use crate::common::data;

const NOISE_PX: f64 = 0.1;

fn checkerboard(rows: u32, cols: u32) -> Target {
    let spec = BoardSpec { tags: None, ..BoardSpec::checkerboard(rows, cols, 30.0) };
    Target::new("board", spec).unwrap()
}

/// Cameras at intervals of 120 mm, each rolled about its optical axis.
fn placed(rolls_rad: &[f64]) -> Vec<Pose> {
    let place = |(index, roll): (usize, &f64)| Pose {
        rotation: DQuat::from_rotation_z(*roll),
        translation: DQuat::from_rotation_z(*roll) * DVec3::new(-120.0 * index as f64, 0.0, 0.0),
    };
    rolls_rad.iter().enumerate().map(place).collect()
}

/// Nearly upright board poses, tilted up to 35°, and rolled in the image by up to `roll_rad`.
fn moved(frames: usize, tilt_rad: f64, roll_rad: f64, random: &mut ChaCha8Rng) -> Vec<Pose> {
    let pose = |_| {
        let axis = random.random_range(0.0..2.0 * PI);
        let tilt = DQuat::from_axis_angle(
            DVec3::new(axis.cos(), axis.sin(), 0.0),
            random.random_range(0.3..1.0) * tilt_rad,
        );
        let roll = DQuat::from_rotation_z(random.random_range(-1.0..1.0) * roll_rad);
        // Rows of the print run up, y of the image down.
        let upright = DQuat::from_rotation_x(PI);
        let rotation = tilt * roll * upright;
        let middle = rotation * DVec3::new(75.0, 45.0, 0.0);
        let at = DVec3::new(
            random.random_range(0.0..120.0),
            random.random_range(-60.0..60.0),
            random.random_range(450.0..650.0),
        );
        Pose { rotation, translation: at - middle }
    };
    (0..frames).map(pose).collect()
}

/// Views labelled as by the detector: row 0, column 0 is the lowest corner in the image.
fn views(
    target: &Target,
    camera_from_rig: &Pose,
    rig_from_target: &[Pose],
    random: &mut ChaCha8Rng,
) -> Vec<View> {
    let panel = &target.panels[0];
    let none = LatticeMap::new(panel.kind, 0, Vertex::new(0, 0));
    let maps: Vec<LatticeMap> = [none].into_iter().chain(panel.label_symmetries()).collect();
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let camera = Camera::pinhole(1280, 960, 1.0);
    let mut view = |(frame, rig_from_target): (usize, &Pose)| {
        let pose = camera_from_rig.after(rig_from_target);
        let pixel = |corner: &deltille::targets::Corner| {
            camera.project(pose.apply(corner.target_mm)).unwrap()
        };
        let origin_y = |map: &LatticeMap| {
            let is_origin = |corner: &&deltille::targets::Corner| {
                map.apply(Vertex::new(corner.row, corner.col)) == Vertex::new(0, 0)
            };
            pixel(panel.corners.iter().find(is_origin).unwrap()).y
        };
        let map = maps.iter().max_by(|a, b| origin_y(a).total_cmp(&origin_y(b))).unwrap();
        let observations = panel.corners.iter().map(|corner| {
            let Vertex { row, col } = map.apply(Vertex::new(corner.row, corner.col));
            let labelled = panel.corner_at(Vertex::new(row, col)).unwrap();
            let off = DVec2::new(noise.sample(random), noise.sample(random));
            let (panel_mm, pixel) = (labelled.panel_mm.extend(0.0), pixel(corner) + off);
            Observation { row, col, panel_mm, pixel, cov: None }
        });
        let sighting =
            Sighting { panel: PanelRef::new(0, 0), observations: observations.collect() };
        let name = format!("{frame:03}");
        View { image: name.clone(), name, size_px: [1280, 960], sightings: vec![sighting] }
    };
    rig_from_target.iter().enumerate().map(&mut view).collect()
}

struct Rig {
    found: Estimate,
    said: Vec<Option<LabelRotation>>,
    truth: Vec<Pose>,
}

impl Rig {
    fn of(
        target: &Target,
        rolls_rad: &[f64],
        boards: &[Pose],
        intrinsics: impl Into<Intrinsics>,
        seed: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (truth, intrinsics) = (placed(rolls_rad), intrinsics.into());
        let reference = Reference::Target(target);
        let mut rig = Calibration::of(&reference, reference.panels());
        for (index, place) in truth.iter().enumerate() {
            let views = views(target, place, boards, &mut random);
            rig = rig.with(CameraViews::new(&format!("c{index}"), views, intrinsics.clone()));
        }
        let found = rig.solve().unwrap();
        let said = found.cameras.iter().map(|camera| camera.label_rotation).collect();
        Self { found, said, truth }
    }

    /// Distance of the cameras from their true positions, mm.
    fn off_mm(&self) -> f64 {
        let cameras = self.found.cameras.iter().zip(&self.truth);
        let off = cameras.map(|(camera, truth)| {
            let at = |pose: &Pose| pose.inverse().translation;
            // The first camera is the rig frame.
            let truth = truth.after(&self.truth[0].inverse());
            at(&camera.camera_from_rig).distance(at(&truth))
        });
        off.fold(0.0, f64::max)
    }
}

#[test]
fn the_pose_of_an_upside_down_camera_is_right() {
    for seed in 0..2 {
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed);
        let boards = moved(16, 0.6, 0.4, &mut random);
        let rig = Rig::of(&checkerboard(4, 6), &[0.0, PI], &boards, Model::Radtan, seed);
        assert!(rig.off_mm() < 8.0, "{} mm", rig.off_mm());
        assert_eq!(rig.found.frames.len(), boards.len());
        let rotation = rig.said[1].unwrap();
        assert_eq!((rotation.degrees, rotation.frames, rotation.of), (180, 16, 16));
        assert!(rotation.is_confirmed);
        assert!(rig.found.diagnose().iter().any(|s| matches!(s, Diagnosis::LabelsRotated { .. })));
    }
}

/// A rolled board has different labels in some frames only, also for cameras on their side and, on
/// square boards, for rotations by 90°.
#[test]
fn labels_that_change_between_frames_are_unified() {
    for (rows, cols, rolls) in [
        (4, 6, &[0.0, FRAC_PI_2][..]),
        (4, 6, &[0.3, PI, -FRAC_PI_2]),
        (5, 5, &[0.0, FRAC_PI_2]),
        (6, 6, &[0.0, FRAC_PI_2, 2.5]),
    ] {
        let mut random = ChaCha8Rng::seed_from_u64(u64::from(rows));
        let boards = moved(20, 0.6, PI, &mut random);
        let rig = Rig::of(&checkerboard(rows, cols), rolls, &boards, Model::Radtan, 7);
        assert!(rig.off_mm() < 8.0, "{rows} × {cols}: {} mm", rig.off_mm());
        assert_eq!(rig.found.frames.len(), boards.len());
        let some = rig.said.iter().flatten().filter(|said| said.frames > 0 && said.is_confirmed);
        assert!(some.count() > 0, "{:?}", rig.said);
    }
}

/// In few frames, a lag follows from the rotations between frames, which labels of other frames seem to change.
#[test]
fn labels_that_change_between_few_frames_are_no_lag() {
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(200 + seed);
        let boards = moved(6, 0.6, PI, &mut random);
        let rig = Rig::of(&checkerboard(4, 6), &[0.0, 2.0], &boards, Model::Radtan, seed);
        let lags: Vec<i32> = rig.found.cameras.iter().map(|camera| camera.delay).collect();
        assert_eq!(lags, [0, 0], "seed {seed}");
        assert!(rig.off_mm() < 8.0, "seed {seed}: {} mm", rig.off_mm());
    }
}

#[test]
fn consistent_labels_are_not_rotated() {
    for (rows, cols, rolls) in [(4, 6, [0.0, 0.2]), (4, 7, [0.0, PI]), (5, 7, [0.1, -0.1])] {
        let mut random = ChaCha8Rng::seed_from_u64(u64::from(rows + cols));
        let boards = moved(12, 0.6, 0.2, &mut random);
        let rig = Rig::of(&checkerboard(rows, cols), &rolls, &boards, Model::Radtan, 1);
        assert!(rig.off_mm() < 8.0, "{} mm", rig.off_mm());
        assert_eq!(rig.said, [None, None], "{rows} × {cols}");
    }
}

/// A board that never moved fits both labellings.
#[test]
fn undecidable_labels_are_reported() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let boards = vec![moved(1, 0.6, 0.1, &mut random)[0]; 6];
    let camera = Camera::pinhole(1280, 960, 1.0);
    let rig = Rig::of(&checkerboard(4, 6), &[0.0, 0.1], &boards, camera, 1);
    let said = rig.said[1].unwrap();
    assert_eq!((said.frames, said.is_confirmed), (0, false));
    assert!(rig.off_mm() < 8.0);
}

/// A stereo pair whose right camera is upside down; the baseline is 120.3 mm.
#[test]
#[cfg_attr(not(has_data), ignore = "no detections: set DELTILLE_DATA to their folder")]
fn a_real_pair_with_one_camera_upside_down_has_its_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let of = data("others/rig_even").canonicalize().unwrap();
    let cameras = format!("--camera left={0}/left --camera right={0}/right", of.display());
    for target in [
        format!("--target {}/board.json", of.display()),
        "--grid checker --rows 4 --cols 6 --edge 30mm".to_owned(),
    ] {
        let result =
            deltille(folder.path(), &format!("rig {cameras} {target} --model radtan")).success();
        let stderr = String::from_utf8_lossy(&result.get_output().stderr).into_owned();
        assert!(stderr.contains("the board has no tags"), "{stderr}");
        let rig = std::fs::read_to_string(folder.path().join("rig.json")).unwrap();
        let rig: serde_json::Value = serde_json::from_str(&rig).unwrap();
        let at = &rig["cameras"][1]["camera_from_rig"]["translation_mm"];
        let at: Vec<f64> = serde_json::from_value(at.clone()).unwrap();
        let baseline = DVec3::from_slice(&at).length();
        assert!((baseline - 120.3).abs() < 1.0, "{baseline}");
        assert_eq!(rig["diagnoses"][0]["kind"], "labels_rotated", "{}", rig["diagnoses"]);
    }
}
