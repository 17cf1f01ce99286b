//! Rigs in which something is not as it should be, and scenes of several targets: simulated with exact truth, what is
//! found is what was put in, or the culprit is named.

use deltille::calibrate::{
    Calibration, CalibrationError, Estimate, Model, Observation, PanelPlace, PanelRef, Sighting,
    TooPlain, View,
};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Deviation of the simulated corners, px.
const NOISE_PX: f64 = 0.07;

const SIZE_PX: [u32; 2] = [1600, 1200];

/// What is photographed, by what, and what was seen.
#[derive(Clone)]
struct Scene {
    targets: Vec<Target>,
    scene_from_target: Vec<Pose>,
    cameras: Vec<Camera>,
    camera_from_rig: Vec<Pose>,
    /// By camera.
    views: Vec<Vec<View>>,
}

fn board(name: &str, first_id: u32) -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let mut spec = BoardSpec::new(GridKind::Deltille, 8, 11, 20.0);
    spec.tags.as_mut().unwrap().first_id = first_id;
    Target::build(name, &TargetSpec::Board(spec), Some(&family), None).unwrap()
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

/// The middle of a target's corners.
fn middle(target: &Target) -> DVec3 {
    let corners = || target.panels.iter().flat_map(|panel| &panel.corners);
    corners().map(|corner| corner.target_mm).sum::<DVec3>() / corners().count() as f64
}

/// What a camera sees of the targets of a scene.
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
    /// The views of all cameras with the rig at these places.
    fn photographed(mut self, places: &[Pose], random: &mut ChaCha8Rng) -> Self {
        let views = (0..self.cameras.len()).map(|camera| {
            let views = places.iter().enumerate();
            let views = views
                .map(|(frame, place)| seen(&self, camera, place, &format!("{frame:03}"), random));
            views.filter(|view| !view.sightings.is_empty()).collect()
        });
        self.views = views.collect();
        self
    }

    fn calibration(&self) -> Calibration {
        let panels = |target: &Target| -> Vec<PanelPlace> {
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

    /// Errors of everything that was found, in stated deviations.
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

/// Whether errors are as their deviations have it: normally distributed ones are beyond three of them in 0.3 %.
fn is_within(errors: &[f64]) -> bool {
    let beyond = errors.iter().filter(|error| error.abs() > 3.0).count();
    let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
    beyond as f64 <= 0.02 * errors.len() as f64 && worst < 4.5
}

/// Two cameras back to back, each before a board of its own; the rig turns by so much about its axes.
fn back_to_back(frames: usize, reach_rad: DVec3, seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let behind = Pose {
        rotation: DQuat::from_scaled_axis(any(&mut random, 0.1)) * DQuat::from_rotation_y(3.1),
        translation: any(&mut random, 80.0),
    };
    let targets = vec![board("front", 0), board("back", 100)];
    // The boards as the rig has them where it is not turned.
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
        views: Vec::new(),
    };
    let places = (0..frames).map(|_| {
        let turn = reach_rad * any(&mut random, 1.0);
        let step =
            Pose { rotation: DQuat::from_scaled_axis(turn), translation: any(&mut random, 50.0) };
        step.after(&front)
    });
    let places: Vec<Pose> = places.collect();
    scene.photographed(&places, &mut random)
}

const ALL_WAYS: DVec3 = DVec3::splat(0.4);

#[test]
fn cameras_back_to_back_are_found_by_boards_of_their_own() {
    for seed in 0..3 {
        let scene = back_to_back(30, ALL_WAYS, seed);
        let found = scene.solve().unwrap();
        let errors = scene.errors(&found);
        assert!(is_within(&errors), "seed {seed}: {errors:.1?}");
        assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.1, "seed {seed}: {}", found.rms_px);
    }
}

#[test]
fn motion_that_leaves_cameras_open_is_named() {
    for (reach, expected) in
        [(DVec3::new(0.0, 0.4, 0.0), TooPlain::OneAxis), (DVec3::ZERO, TooPlain::NoTurn)]
    {
        let mut scene = back_to_back(30, reach, 3);
        // Cameras by themselves need boards that are tilted.
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
