//! Rigs of simulated cameras: the estimates match the truth within the stated standard deviations.

use deltille::calibrate::{
    Alternative, Calibration, CalibrationError, CameraViews, Diagnosis, Estimate, LackOfFit, Model,
    Observation, PanelPrior, PanelRef, Sighting, View,
};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::family::Family;
use deltille::targets::{SolidShape, SolidSpec, Target, TargetSpec};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Standard deviation of the simulated corners, px.
const NOISE_PX: f64 = 0.05;

/// Distance of triangulated points from the first camera, mm.
const DISTANCE_MM: f64 = 900.0;

/// Placement errors of the panels, mm and rad.
const PLACED_MM: f64 = 0.1;
const PLACED_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// Cameras around an icosahedron, and their views of it.
struct Simulated {
    stated: Vec<PanelPrior>,
    /// True poses of the panels.
    panels: Vec<Pose>,
    cameras: Vec<Camera>,
    camera_from_rig: Vec<Pose>,
    views: Vec<CameraViews>,
}

fn small_pose(random: &mut ChaCha8Rng, rotation_rad: f64, move_mm: f64) -> Pose {
    let normal = Normal::new(0.0, 1.0).unwrap();
    let mut vector = || DVec3::from_fn(|_| normal.sample(random));
    Pose {
        rotation: DQuat::from_scaled_axis(vector() * rotation_rad),
        translation: vector() * move_mm,
    }
}

trait FromFn {
    fn from_fn(f: impl FnMut(usize) -> f64) -> Self;
}

impl FromFn for DVec3 {
    fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
        DVec3::new(f(0), f(1), f(2))
    }
}

fn simulated(seed: u64, frames: usize) -> Simulated {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let family = Family::shipped("delTag25h7").unwrap();
    let target = Target::build("ico", &spec, Some(&family)).unwrap();
    let stated: Vec<Pose> = target.panels.iter().map(|panel| panel.pose.to_pose()).collect();
    let panels: Vec<Pose> = stated
        .iter()
        .map(|pose| {
            let off = small_pose(&mut random, PLACED_RAD, PLACED_MM);
            Pose {
                rotation: off.rotation * pose.rotation,
                translation: pose.translation + off.translation,
            }
        })
        .collect();
    let stated = stated.iter().map(|&target_from_panel| target_from_panel.into()).collect();
    let cameras: Vec<Camera> = (0..3)
        .map(|_| {
            let lens = BrownConrady {
                radial: [random.random_range(-0.1..0.1), random.random_range(-0.1..0.1), 0.0],
                ..BrownConrady::default()
            };
            let lens = Lens::BrownConrady(lens);
            Camera::centred(2000, 1500, random.random_range(2500.0..3500.0), lens)
        })
        .collect();
    // Cameras a quarter of a metre apart, facing a point 0.9 m in front of the first.
    let camera_from_rig: Vec<Pose> = (0..3)
        .map(|index| {
            let eye = DVec3::new(250.0 * index as f64, 30.0 * index as f64, 0.0);
            match index {
                0 => Pose::IDENTITY,
                _ => Pose::looking_at(eye, DVec3::new(0.0, 0.0, 900.0), DVec3::NEG_Y),
            }
        })
        .collect();
    let rig_from_target: Vec<Pose> = (0..frames)
        .map(|_| Pose {
            rotation: DQuat::from_scaled_axis(DVec3::from_fn(|_| random.random_range(-3.0..3.0))),
            translation: DVec3::new(
                random.random_range(-60.0..60.0),
                random.random_range(-60.0..60.0),
                random.random_range(750.0..1050.0),
            ),
        })
        .collect();
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let views = cameras.iter().zip(&camera_from_rig).enumerate().map(|(index, (camera, place))| {
        let views = rig_from_target.iter().enumerate().filter_map(|(frame, rig)| {
            // Not every camera sees every frame.
            if (frame + index) % 4 == 0 {
                return None;
            }
            let camera_from_target = place.after(rig);
            let sightings = target.panels.iter().enumerate().filter_map(|(p, panel)| {
                let pose = camera_from_target.after(&panels[p]);
                let (normal, at) = (pose.rotation * DVec3::Z, pose.translation);
                if normal.dot(-at.normalize()) < 0.4 {
                    return None;
                }
                let observations = panel.corners.iter().map(|corner| {
                    let panel_mm = corner.panel_mm.extend(0.0);
                    let at = camera.project(pose.apply(panel_mm))?;
                    camera.sees(at, 5.0).then(|| Observation {
                        row: corner.row,
                        col: corner.col,
                        panel_mm,
                        pixel: at.map(|v| v + noise.sample(&mut random)),
                        cov: Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]),
                    })
                });
                let observations: Option<Vec<_>> = observations.collect();
                observations.map(|observations| Sighting {
                    panel: PanelRef::new(p, panel.id),
                    observations,
                })
            });
            let sightings: Vec<Sighting> = sightings.collect();
            let name = format!("{frame:03}");
            (!sightings.is_empty()).then(|| View {
                name: name.clone(),
                image: name,
                size_px: [2000, 1500],
                sightings,
            })
        });
        CameraViews::new(&format!("c{index}"), views.collect(), Model::Radtan)
    });
    let views = views.collect();
    Simulated { stated, panels, cameras, camera_from_rig, views }
}

fn calibration(views: &[CameraViews], panels: &[PanelPrior], refine: bool) -> Calibration {
    let blank = Calibration::new(panels.iter().copied()).refine_panels(refine);
    views.iter().cloned().fold(blank, Calibration::with)
}

impl Simulated {
    fn solve(&self, refine: bool) -> Estimate {
        calibration(&self.views, &self.stated, refine).solve().unwrap()
    }
}

/// Errors of all estimates in stated standard deviations. The target frame is that of the fixed panel, so panels are
/// compared relative to it.
fn normalised_errors(truth: &Simulated, found: &Estimate) -> Vec<f64> {
    let mut errors = Vec::new();
    for (index, camera) in found.cameras.iter().enumerate() {
        let true_values = truth.cameras[index].parameters();
        for (parameter, value) in camera.parameters.iter().zip(true_values) {
            errors.extend(parameter.sd.map(|sd| (parameter.value - value) / sd));
        }
        if let Some(sd) = camera.pose_sd {
            errors.extend(pose_errors(&camera.camera_from_rig, &truth.camera_from_rig[index], sd));
        }
    }
    let held = found.panels.iter().position(|panel| panel.covariance.is_none()).unwrap();
    // The true poses of the panels in a frame in which the fixed panel is at its stated pose.
    let frame = truth.stated[held].target_from_panel.after(&truth.panels[held].inverse());
    for (panel, truth) in found.panels.iter().zip(&truth.panels) {
        if let Some(covariance) = panel.covariance {
            let sd = std::array::from_fn(|i| covariance[i][i].sqrt());
            errors.extend(pose_errors(&panel.target_from_panel, &frame.after(truth), sd));
        }
    }
    errors
}

fn pose_errors(found: &Pose, truth: &Pose, sd: [f64; 6]) -> [f64; 6] {
    let [turn, moved] = found.off(truth);
    let off = [turn.x, turn.y, turn.z, moved.x, moved.y, moved.z];
    std::array::from_fn(|i| off[i] / sd[i])
}

/// Errors of triangulated distances in stated standard deviations: of the points that the first of two cameras sees at its
/// image centre.
fn depth_errors(truth: &Simulated, found: &Estimate) -> Vec<f64> {
    let mut errors = Vec::new();
    for [first, second] in [[0, 1], [0, 2], [1, 2]] {
        let stated = found.depth_uncertainty([first, second], DISTANCE_MM).unwrap();
        let rig_from_first = truth.camera_from_rig[first].inverse();
        let centre = truth.cameras[first].centre_px;
        let point = truth.cameras[first].unproject(centre).unwrap().direction * DISTANCE_MM;
        let point = rig_from_first.apply(point);
        let [one, other] = [first, second].map(|index| {
            let seen = truth.cameras[index].project(truth.camera_from_rig[index].apply(point));
            let camera = &found.cameras[index];
            let rig_from_camera = camera.camera_from_rig.inverse();
            let direction = camera.camera.unproject(seen.unwrap()).unwrap().direction;
            (rig_from_camera.translation, rig_from_camera.rotation * direction)
        });
        // The place on the first ray that is nearest to the second.
        let across = one.1.cross(other.1);
        let distance = (other.0 - one.0).cross(other.1).dot(across) / across.length_squared();
        errors.push((distance - DISTANCE_MM) / stated.sd_mm);
    }
    errors
}

/// Fraction of the errors within 3σ; 0.9973 for a normal distribution.
fn honest(seeds: std::ops::Range<u64>, frames: usize) -> f64 {
    let (mut errors, mut depth) = (Vec::new(), Vec::new());
    for seed in seeds {
        let truth = simulated(seed, frames);
        let found = truth.solve(true);
        assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.1, "rms {}", found.rms_px);
        errors.extend(normalised_errors(&truth, &found));
        depth.extend(depth_errors(&truth, &found));
    }
    let mean = depth.iter().map(|error| error * error).sum::<f64>() / depth.len() as f64;
    println!("triangulated distances: e²/σ² {mean:.2} in {}", depth.len());
    errors.extend(depth);
    errors.iter().filter(|error| error.abs() < 3.0).count() as f64 / errors.len() as f64
}

#[test]
fn errors_of_a_rig_and_its_target_match_their_sd() {
    let part = honest(0..2, 30);
    assert!(part >= 0.98, "{part}");
}

/// The statistic over fifty seeds, for a release build: some minutes.
#[test]
#[ignore = "takes minutes; run with --release -- --ignored"]
fn errors_of_fifty_rigs_match_their_sd() {
    let part = honest(0..50, 40);
    println!("within three standard deviations: {:.4}", part);
    assert!(part >= 0.99, "{part}");
}

/// A calibrated target helps the next calibration, which has few views of it.
#[test]
fn a_refined_target_is_a_prior_of_the_next_calibration() {
    let truth = simulated(11, 40);
    let first = truth.solve(true);
    let few = |views: &CameraViews| {
        let mut views = views.clone();
        views.views.truncate(8);
        views
    };
    let few: Vec<CameraViews> = truth.views.iter().map(few).collect();
    let alone = calibration(&few, &truth.stated, true).solve().unwrap();
    let with = calibration(&few, &first.panels, true).solve().unwrap();
    let deviation = |found: &Estimate| {
        let of = |panel: &PanelPrior| panel.covariance.map(|c| c[3][3] + c[4][4] + c[5][5]);
        let all: Vec<f64> = found.panels.iter().filter_map(of).collect();
        (all.iter().sum::<f64>() / all.len() as f64).sqrt()
    };
    let within = normalised_errors(&truth, &alone);
    let [first, alone, with] = [&first, &alone, &with].map(deviation);
    assert!(with < 1.05 * first && with < 0.7 * alone, "{first} {alone} {with}");
    assert!(within.iter().filter(|e| e.abs() < 3.0).count() as f64 > 0.97 * within.len() as f64);
}

#[test]
fn placement_errors_show_unless_the_target_is_refined() {
    let truth = simulated(7, 30);
    let stated = truth.solve(false);
    let refined = truth.solve(true);
    assert!(stated.rms_px > 2.0 * refined.rms_px, "{} {}", stated.rms_px, refined.rms_px);
    let first = stated.lack_of_fit.first();
    assert!(matches!(first, Some(LackOfFit::Target { .. })), "{:?}", stated.lack_of_fit);
    assert_eq!(refined.lack_of_fit, []);
    assert!(stated.panels.iter().all(|panel| panel.covariance.is_none()));
    let kept = refined.panels.iter().filter(|panel| panel.covariance.is_none()).count();
    assert_eq!(kept, 1);
}

#[test]
fn a_wrong_given_camera_is_named() {
    let mut truth = simulated(5, 20);
    for (views, camera) in truth.views.iter_mut().zip(&truth.cameras) {
        views.intrinsics = camera.clone().into();
    }
    let said = |truth: &Simulated| {
        let calibration = calibration(&truth.views, &truth.really(), false);
        calibration.explain(&calibration.solve().unwrap())
    };
    assert_eq!(said(&truth), []);
    // Refocused since: everything fits worse.
    let mut refocused = truth.cameras[1].clone();
    refocused.focal_px *= 1.01;
    truth.views[1].intrinsics = refocused.into();
    let said = said(&truth);
    let is_named = |said: &Diagnosis| {
        let Diagnosis::Remedied { camera, remedy } = said else { return false };
        (*camera, remedy.alternative) == (1, Alternative::Camera)
    };
    assert!(!said.is_empty() && said.iter().all(is_named), "{said:?}");
    // A different camera: nothing fits.
    truth.views[1].intrinsics = truth.cameras[2].clone().into();
    let error = calibration(&truth.views, &truth.really(), false).solve().unwrap_err();
    assert!(
        matches!(&error, CalibrationError::WrongCameras { cameras, .. } if cameras == "c1"),
        "{error}"
    );
}

impl Simulated {
    fn really(&self) -> Vec<PanelPrior> {
        self.panels.iter().map(|&target_from_panel| target_from_panel.into()).collect()
    }
}

#[test]
fn images_of_another_time_are_excluded_and_cameras_without_common_frames_refused() {
    let mut truth = simulated(3, 30);
    // One image of camera 1 has the name of another frame.
    let views = &mut truth.views[1].views;
    let (a, b) = (views[3].name.clone(), views[7].name.clone());
    (views[3].name, views[7].name) = (b.clone(), a.clone());
    let found = truth.solve(true);
    let out: Vec<&str> = found.excluded.iter().map(|out| out.view.as_str()).collect();
    assert!(out.contains(&a.as_str()) && out.contains(&b.as_str()), "{out:?}");
    assert!(found.rms_px < 1.2 * NOISE_PX, "{}", found.rms_px);

    for view in &mut truth.views[2].views {
        view.name = format!("late-{}", view.name);
    }
    let error = calibration(&truth.views, &truth.stated, true).solve().unwrap_err();
    assert!(matches!(error, CalibrationError::Apart { .. }), "{error}");
    assert!(error.to_string().starts_with("c2: no frame shows the target"), "{error}");
}
