//! Rigs with faults, and scenes of several targets, simulated with exact truth: the estimates match the truth, or the
//! fault is named.

use std::fs;

use deltille::calibrate::{
    Calibration, CalibrationError, DegenerateMotion, Diagnosis, Estimate, Model, Observation,
    PanelPrior, PanelRef, Reference, Sighting, View,
};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::export::saved;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use crate::common::command::deltille;

/// Standard deviation of the simulated corners, px.
const NOISE_PX: f64 = 0.07;

const SIZE_PX: [u32; 2] = [1600, 1200];

/// The targets, the cameras, and the views.
#[derive(Clone)]
struct Scene {
    targets: Vec<Target>,
    scene_from_target: Vec<Pose>,
    cameras: Vec<Camera>,
    camera_from_rig: Vec<Pose>,
    /// Poses of the scene on the rig, by frame.
    places: Vec<Pose>,
    /// By camera.
    views: Vec<Vec<View>>,
}

fn board(name: &str, first_id: u32) -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let mut spec = BoardSpec::new(GridKind::Deltille, 8, 11, 20.0);
    spec.tags.as_mut().unwrap().first_id = first_id;
    Target::build(name, &TargetSpec::Board(spec), Some(&family)).unwrap()
}

fn any(random: &mut ChaCha8Rng, reach: f64) -> DVec3 {
    DVec3::from([0; 3].map(|_| random.random_range(-reach..reach)))
}

fn camera(random: &mut ChaCha8Rng) -> Camera {
    let radial = [random.random_range(-0.2..0.0), random.random_range(0.0..0.05), 0.0];
    let lens = Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() });
    let [width, height] = SIZE_PX;
    Camera::centred(width, height, random.random_range(1200.0..1500.0), lens)
}

/// The centroid of a target's corners.
fn middle(target: &Target) -> DVec3 {
    let corners = || target.panels.iter().flat_map(|panel| &panel.corners);
    corners().map(|corner| corner.target_mm).sum::<DVec3>() / corners().count() as f64
}

/// The view of the targets of a scene by a camera.
fn seen(
    scene: &Scene,
    camera: usize,
    rig_from_scene: &Pose,
    name: &str,
    random: &mut ChaCha8Rng,
) -> View {
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let (mut sightings, mut first) = (Vec::new(), 0);
    let lens = &scene.cameras[camera];
    for (target, place) in scene.targets.iter().zip(&scene.scene_from_target) {
        let camera_from_target = scene.camera_from_rig[camera].after(rig_from_scene).after(place);
        for (index, panel) in target.panels.iter().enumerate() {
            let pose = camera_from_target.after(&panel.pose.to_pose());
            let away = pose.apply(panel.corners[0].panel_mm.extend(0.0));
            if (pose.rotation * DVec3::Z).dot(-away.normalize()) < 0.3 {
                continue;
            }
            let corners = panel.corners.iter().filter_map(|corner| {
                let panel_mm = corner.panel_mm.extend(0.0);
                let at = lens.project(pose.apply(panel_mm)).filter(|&at| lens.sees(at, 5.0))?;
                let pixel = at.map(|v| v + noise.sample(random));
                let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
                Some(Observation { row: corner.row, col: corner.col, panel_mm, pixel, cov })
            });
            let observations: Vec<Observation> = corners.collect();
            if observations.len() >= 12 {
                let panel = PanelRef::new(first + index, panel.id);
                sightings.push(Sighting { panel, observations });
            }
        }
        first += target.panels.len();
    }
    View { name: name.to_owned(), image: format!("{name}.png"), size_px: SIZE_PX, sightings }
}

impl Scene {
    /// The views of all cameras, with the rig at these poses.
    fn photographed(
        mut self,
        places: &[Pose],
        shown: &[std::ops::Range<usize>],
        random: &mut ChaCha8Rng,
    ) -> Self {
        let views = (0..self.cameras.len()).map(|camera| {
            let views = places[shown[camera].clone()].iter().enumerate();
            let views = views
                .map(|(frame, place)| seen(&self, camera, place, &format!("{frame:03}"), random));
            views.filter(|view| !view.sightings.is_empty()).collect()
        });
        self.views = views.collect();
        self.places = places.to_vec();
        self
    }

    fn calibration(&self) -> Calibration {
        let panels = |target: &Target| -> Vec<PanelPrior> {
            target.panels.iter().map(|panel| (&panel.pose).into()).collect()
        };
        let blank = match self.targets.as_slice() {
            [only] => Calibration::new(panels(only)),
            all => Calibration::of_targets(all.iter().map(|t| (t.name.to_string(), panels(t)))),
        };
        let views = self.views.iter().enumerate();
        views.fold(blank, |calibration, (index, views)| {
            calibration.camera(&format!("c{index}"), views.clone(), Model::Radtan)
        })
    }

    fn solve(&self) -> Result<Estimate, CalibrationError> {
        self.calibration().solve()
    }

    /// Errors of all estimates, in stated standard deviations.
    fn errors(&self, found: &Estimate) -> Vec<f64> {
        let mut errors = Vec::new();
        let index = |name: &str| name[1..].parse::<usize>().unwrap();
        let rig = self.camera_from_rig[index(&found.cameras[0].name)].inverse();
        for camera in &found.cameras {
            let index = index(&camera.name);
            let values = self.cameras[index].parameters();
            for (parameter, value) in camera.parameters.iter().zip(values) {
                errors.extend(parameter.sd.map(|sd| (parameter.value - value) / sd));
            }
            let truth = self.camera_from_rig[index].after(&rig);
            errors.extend(off(&camera.camera_from_rig, &truth, camera.pose_sd));
        }
        let scene = self.scene_from_target[0].inverse();
        for (target, truth) in found.targets.iter().zip(&self.scene_from_target) {
            errors.extend(off(&target.scene_from_target, &scene.after(truth), target.pose_sd));
        }
        errors
    }
}

fn off(found: &Pose, truth: &Pose, sd: Option<[f64; 6]>) -> Vec<f64> {
    let [turn, moved] = found.off(truth);
    let off = turn.to_array().into_iter().chain(moved.to_array());
    sd.map_or(Vec::new(), |sd| off.zip(sd).map(|(off, sd)| off / sd).collect())
}

/// Whether errors match their standard deviations: 0.3 % of a normal distribution are beyond 3σ.
fn is_within(errors: &[f64]) -> bool {
    let beyond = errors.iter().filter(|error| error.abs() > 3.0).count();
    let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
    beyond as f64 <= 0.02 * errors.len() as f64 && worst < 4.5
}

/// Two cameras back to back, each with a board of its own in front; the rig rotates about its axes by up to
/// `reach_rad`.
fn back_to_back(frames: usize, reach_rad: DVec3, seed: u64) -> Scene {
    back_to_back_late(frames, reach_rad, 0, seed)
}

/// The same with images of the second camera that lag by `late` frames.
fn back_to_back_late(frames: usize, reach_rad: DVec3, late: usize, seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let behind = Pose {
        rotation: DQuat::from_scaled_axis(any(&mut random, 0.1)) * DQuat::from_rotation_y(3.1),
        translation: any(&mut random, 80.0),
    };
    let targets = vec![board("front", 0), board("back", 100)];
    // The boards as seen by the unrotated rig.
    let facing = |target: &Target, random: &mut ChaCha8Rng| {
        let rotation = DQuat::from_scaled_axis(any(random, 0.3))
            * DQuat::from_rotation_x(std::f64::consts::PI);
        let at = DVec3::new(0.0, 0.0, 420.0) + any(random, 20.0);
        Pose { rotation, translation: at - rotation * middle(target) }
    };
    let front = facing(&targets[0], &mut random);
    let back = behind.inverse().after(&facing(&targets[1], &mut random));
    let scene = Scene {
        scene_from_target: vec![Pose::IDENTITY, front.inverse().after(&back)],
        targets,
        cameras: (0..2).map(|_| camera(&mut random)).collect(),
        camera_from_rig: vec![Pose::IDENTITY, behind],
        places: Vec::new(),
        views: Vec::new(),
    };
    let places = (0..frames + late).map(|_| {
        let turn = reach_rad * any(&mut random, 1.0);
        let step =
            Pose { rotation: DQuat::from_scaled_axis(turn), translation: any(&mut random, 50.0) };
        step.after(&front)
    });
    let places: Vec<Pose> = places.collect();
    scene.photographed(&places, &[late, 0].map(|first| first..first + frames), &mut random)
}

const ALL_WAYS: DVec3 = DVec3::splat(0.4);

#[test]
fn cameras_back_to_back_are_calibrated_with_boards_of_their_own() {
    for seed in 0..3 {
        let scene = back_to_back(30, ALL_WAYS, seed);
        let found = scene.solve().unwrap();
        let errors = scene.errors(&found);
        assert!(is_within(&errors), "seed {seed}: {errors:.1?}");
        assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.1, "seed {seed}: {}", found.rms_px);
    }
}

#[test]
fn insufficient_motion_is_named() {
    for (reach, expected) in [
        (DVec3::new(0.0, 0.4, 0.0), DegenerateMotion::OneAxis),
        (DVec3::ZERO, DegenerateMotion::NoRotation),
    ] {
        let mut scene = back_to_back(30, reach, 3);
        // Single cameras need tilted boards.
        let calibration = scene.views.iter().zip(&scene.cameras).enumerate().fold(
            Calibration::of_targets(scene.targets.iter().map(|t| {
                (t.name.to_string(), t.panels.iter().map(|p| (&p.pose).into()).collect())
            })),
            |calibration, (index, (views, camera))| {
                calibration.camera(&format!("c{index}"), views.clone(), camera.clone())
            },
        );
        scene.views.clear();
        let error = calibration.solve().unwrap_err();
        let CalibrationError::PlainMotion { camera, target, why } = &error else {
            panic!("{error}")
        };
        assert_eq!((camera.as_str(), target.as_str(), *why), ("c1", "back", expected), "{error}");
    }
}

fn icosahedron() -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec =
        TargetSpec::Solid(SolidSpec { edge_mm: 200.0, ..SolidSpec::new(SolidShape::Icosahedron) });
    Target::build("ico", &spec, Some(&family)).unwrap()
}

/// Cameras around an icosahedron that moves and rotates little between frames, as in a continuous motion.
fn around(cameras: usize, frames: usize, seed: u64) -> Scene {
    around_late(cameras, frames, &vec![0; cameras], seed)
}

/// The same with cameras whose images lag by these frames.
fn around_late(cameras: usize, frames: usize, late: &[i32], seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let target = icosahedron();
    let camera_from_world = (0..cameras).map(|index| {
        let angle = index as f64 / cameras as f64 * std::f64::consts::TAU;
        let eye =
            DVec3::new(700.0 * angle.cos(), 700.0 * angle.sin(), 0.0) + any(&mut random, 60.0);
        Pose::looking_at(eye, any(&mut random, 30.0), DVec3::Z)
    });
    let camera_from_world: Vec<Pose> = camera_from_world.collect();
    let rig_from_world = camera_from_world[0];
    let centre = middle(&target);
    let scene = Scene {
        scene_from_target: vec![Pose::IDENTITY],
        targets: vec![target],
        cameras: (0..cameras).map(|_| camera(&mut random)).collect(),
        camera_from_rig: camera_from_world
            .iter()
            .map(|pose| pose.after(&rig_from_world.inverse()))
            .collect(),
        places: Vec::new(),
        views: Vec::new(),
    };
    let mut turn = DQuat::from_scaled_axis(any(&mut random, 3.0));
    let most = late.iter().map(|late| late.unsigned_abs()).max().unwrap_or(0) as usize;
    let places: Vec<Pose> = (0..frames + 2 * most)
        .map(|_| {
            turn = DQuat::from_scaled_axis(any(&mut random, 0.3)) * turn;
            let world_from_target =
                Pose { rotation: turn, translation: any(&mut random, 60.0) - turn * centre };
            rig_from_world.after(&world_from_target)
        })
        .collect();
    let shown = late.iter().map(|&late| {
        let first = most.saturating_add_signed(-late as isize);
        first..first + frames
    });
    scene.photographed(&places, &shown.collect::<Vec<_>>(), &mut random)
}

/// This fraction of the faces has the ids of others.
fn with_wrong_faces(mut scene: Scene, part: f64, seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed + 1000);
    let panels = &scene.targets[0].panels;
    for view in scene.views.iter_mut().flatten() {
        for sighting in &mut view.sightings {
            if random.random_bool(part) {
                let other = random.random_range(0..panels.len());
                sighting.panel = PanelRef::new(other, panels[other].id);
            }
        }
    }
    scene
}

/// Solves scenes of many seeds and compares the errors with their standard deviations. Errors within a scene are
/// correlated: an error of the first camera shifts all others, so the test is over all seeds.
fn check(seeds: std::ops::Range<u64>, scene: impl Fn(u64) -> Scene, also: impl Fn(&Estimate)) {
    let mut all = Vec::new();
    for seed in seeds {
        let scene = scene(seed);
        let found = scene.solve().unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let errors = scene.errors(&found);
        let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
        assert!(worst < 4.5, "seed {seed}: {errors:.1?}");
        also(&found);
        all.extend(errors);
    }
    let variance = all.iter().map(|error| error * error).sum::<f64>() / all.len() as f64;
    // Errors within a scene are correlated, so their squares scatter more than χ² does.
    let scatter = 2.0 * (2.0 / all.len() as f64).sqrt();
    assert!((variance - 1.0).abs() < 3.0 * scatter, "{variance} of {} errors", all.len());
    let beyond = all.iter().filter(|error| error.abs() > 3.0).count() as f64 / all.len() as f64;
    assert!(beyond < 0.01 || all.len() < 1000, "{beyond}");
    println!("{} errors: {variance:.2} squared, {beyond:.4} beyond three", all.len());
}

const LATE: [i32; 8] = [0, 0, 0, 1, 0, 0, 0, 0];

fn one_is_late(found: &Estimate) {
    let delays: Vec<i32> = found.cameras.iter().map(|camera| camera.delay).collect();
    assert_eq!(delays, LATE);
    let said = found.diagnose();
    assert!(said.contains(&Diagnosis::DelayedCamera { camera: 3, frames: 1 }), "{said:?}");
}

#[test]
fn a_camera_that_lags_is_named_and_corrected() {
    check(0..2, |seed| around_late(8, 30, &LATE, seed), one_is_late);
    // The first lags, one leads.
    let delays = [3, 0, 0, -2];
    let found = around_late(4, 30, &delays, 5).solve().unwrap();
    assert_eq!(found.cameras.iter().map(|camera| camera.delay).collect::<Vec<_>>(), delays);
}

#[test]
fn held_out_frames_are_corrected_for_lag_too() {
    let scene = around_late(4, 30, &[0, 0, 1, 0], 1);
    let found = scene.calibration().hold_out(Some(5)).solve().unwrap();
    let test = found.held_out.unwrap();
    assert_eq!((found.cameras[2].delay, test.cameras[2].delay), (1, 1));
    assert!((test.inlier_rms_px() / NOISE_PX - 1.0).abs() < 0.1, "{}", test.inlier_rms_px());
}

#[test]
fn a_lagging_camera_with_its_own_target_is_corrected() {
    let found = back_to_back_late(40, ALL_WAYS, 2, 1).solve().unwrap();
    assert_eq!((found.cameras[0].delay, found.cameras[1].delay), (0, 2));
}

#[test]
fn faces_with_wrong_ids_are_excluded() {
    for part in [0.02, 0.1] {
        check(
            0..2,
            |seed| with_wrong_faces(around(3, 30, seed), part, seed),
            |found| {
                let is_named = |said: &Diagnosis| matches!(said, Diagnosis::CommonOutliers(_));
                assert!(found.diagnose().iter().any(is_named));
            },
        );
    }
}

#[test]
#[ignore = "minutes"]
fn scenes_of_twenty_seeds() {
    check(
        0..20,
        |seed| around(8, 30, seed),
        |found| {
            assert!(found.cameras.iter().all(|camera| camera.delay == 0));
        },
    );
    check(0..20, |seed| around_late(8, 30, &LATE, seed), one_is_late);
    for part in [0.02, 0.05, 0.1] {
        check(0..20, |seed| with_wrong_faces(around(3, 30, seed), part, seed), |_| ());
    }
    check(0..20, |seed| back_to_back(30, ALL_WAYS, seed), |_| ());
    check(
        0..20,
        |seed| back_to_back_late(40, ALL_WAYS, 1, seed),
        |found| {
            assert_eq!(found.cameras[1].delay, 1);
        },
    );
}

/// Images of the two cameras, through the programs.
#[test]
fn programs_calibrate_cameras_back_to_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = back_to_back(14, ALL_WAYS, 11);
    // Each camera sees its own target.
    for (index, (target, camera)) in scene.targets.iter().zip(&scene.cameras).enumerate() {
        fs::write(folder.join(format!("{}.json", target.name)), target.to_json()).unwrap();
        fs::write(folder.join(format!("c{index}.yaml")), camera.to_yaml()).unwrap();
        fs::create_dir(folder.join(format!("c{index}"))).unwrap();
        let camera_from_target = |place: &Pose| {
            scene.camera_from_rig[index].after(place).after(&scene.scene_from_target[index])
        };
        for (frame, place) in scene.places.iter().enumerate() {
            let pose = camera_from_target(place);
            let turn = pose.rotation.to_scaled_axis();
            let [turn, at] = [turn, pose.translation].map(|v| format!("{},{},{}", v.x, v.y, v.z));
            let (name, camera) = (&target.name, format!("c{index}"));
            let of_frame = format!("--pose={turn},{at} -o {camera}/{frame:02}.png");
            deltille(folder, &format!("render {name}.json --camera {camera}.yaml {of_frame}"))
                .success();
        }
    }
    let targets = "--target front.json --target back.json";
    for camera in ["c0", "c1"] {
        deltille(folder, &format!("detect {camera}/*.png {targets} -o seen/{camera}")).success();
    }
    let cameras = "--camera c0=seen/c0 --camera c1=seen/c1";
    let result = deltille(folder, &format!("rig {cameras} {targets} -o found")).success();
    let stdout = String::from_utf8(result.get_output().stdout.clone()).unwrap();
    assert!(stdout.contains("target back: at ("), "{stdout}");
    let rig = fs::read_to_string(folder.join("found/rig.json")).unwrap();
    let found = saved::read(&rig, &Reference::Scene(&scene.targets)).unwrap();
    let errors = scene.errors(&found);
    assert!(errors.len() > 20 && errors.iter().all(|e| e.abs() < 4.5), "{errors:.1?}");
}
