//! Time to calibrate a camera from corners, and to calibrate a rig while refining its target.

use std::f64::consts::PI;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use deltille::calibrate::{
    Calibration, CameraViews, Model, Observation, PanelPrior, PanelRef, Sighting, View,
};
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Maximum error of a corner coordinate, px.
const NOISE_PX: f64 = 0.1;

/// Returns the observations of a panel by a camera.
fn sighting(
    camera: &Camera,
    camera_from_panel: &Pose,
    panel: usize,
    corners: &[(i32, i32, DVec3)],
    random: &mut ChaCha8Rng,
) -> Option<Sighting> {
    let mut observations = Vec::with_capacity(corners.len());
    for &(row, col, panel_mm) in corners {
        let at = camera.project(camera_from_panel.apply(panel_mm))?;
        let pixel = at.map(|v| v + random.random_range(-NOISE_PX..NOISE_PX));
        let cov = Some([0.003, 0.0, 0.003]);
        observations.push(Observation { row, col, panel_mm, pixel, cov });
    }
    Some(Sighting { panel: PanelRef::new(panel, panel as u32), observations })
}

fn view(name: usize, camera: &Camera, sightings: Vec<Sighting>) -> View {
    let name = format!("{name:03}");
    View { image: name.clone(), name, size_px: [camera.width, camera.height], sightings }
}

fn lens() -> Lens {
    let radial = [-0.17, 0.02, 0.0];
    Lens::BrownConrady(BrownConrady { radial, ..BrownConrady::default() })
}

/// Returns 109 views of a board of 10 × 11 corners, as in Table 2 of the paper.
fn board() -> (Vec<View>, Vec<Pose>) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let camera = Camera::centred(1600, 1200, 625.0, lens());
    let corners = (0..10).flat_map(|row| (0..11).map(move |col| (row, col)));
    let corners = corners.map(|(row, col)| {
        (row, col, DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0))
    });
    let corners: Vec<_> = corners.collect();
    let views = (0..109).map(|name| {
        let tilt = DVec3::new(random.random_range(-0.6..0.6), random.random_range(-0.6..0.6), 0.0);
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(PI);
        let centre = DVec3::new(
            random.random_range(-150.0..150.0),
            random.random_range(-90.0..90.0),
            random.random_range(250.0..400.0),
        );
        let pose = Pose { rotation, translation: centre - rotation * DVec3::new(100.0, 90.0, 0.0) };
        let seen = sighting(&camera, &pose, 0, &corners, &mut random);
        view(name, &camera, seen.into_iter().collect())
    });
    (views.collect(), vec![Pose::IDENTITY])
}

/// Returns the views of four cameras in 150 frames, and a solid of twenty triangular faces with 36 corners each. Each
/// camera sees eight faces.
fn rig() -> (Vec<CameraViews>, Vec<PanelPrior>) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let corners = (0..8).flat_map(|row| (0..8 - row).map(move |col| (row, col)));
    let corners = corners.map(|(row, col)| {
        let (x, y) = (f64::from(col) + f64::from(row) / 2.0, f64::from(row) * 0.75f64.sqrt());
        (row, col, 10.0 * (DVec3::new(x, y, 0.0) - DVec3::new(3.5, 2.0, 0.0)))
    });
    let corners: Vec<_> = corners.collect();
    // Twenty directions, distributed evenly over the sphere along a spiral.
    let panels = (0..20).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 20.0;
        let turn = f64::from(i) * PI * (3.0 - 5f64.sqrt());
        let across = (1.0 - z * z).sqrt();
        let normal = DVec3::new(across * turn.cos(), across * turn.sin(), z);
        let rotation = DQuat::from_rotation_arc(DVec3::Z, normal);
        Pose { rotation, translation: 113.0 * normal }
    });
    let panels: Vec<Pose> = panels.collect();
    let cameras = (0..4).map(|index| {
        let eye = DVec3::new(250.0 * f64::from(index % 2), 250.0 * f64::from(index / 2), 0.0);
        let centre = DVec3::new(0.0, 0.0, 800.0);
        let place = match index {
            0 => Pose::IDENTITY,
            _ => Pose::looking_at(eye, centre, DVec3::NEG_Y),
        };
        (Camera::centred(4000, 3000, 6000.0, lens()), place)
    });
    let cameras: Vec<(Camera, Pose)> = cameras.collect();
    let frames = (0..150).map(|_| {
        let turn = DVec3::new(
            random.random_range(-3.0..3.0),
            random.random_range(-3.0..3.0),
            random.random_range(-3.0..3.0),
        );
        let translation = DVec3::new(
            random.random_range(-30.0..30.0),
            random.random_range(-30.0..30.0),
            random.random_range(750.0..850.0),
        );
        Pose { rotation: DQuat::from_scaled_axis(turn), translation }
    });
    let frames: Vec<Pose> = frames.collect();
    let of_camera = |(index, (camera, place)): (usize, &(Camera, Pose))| {
        let views = frames.iter().enumerate().map(|(name, rig_from_target)| {
            let camera_from_target = place.after(rig_from_target);
            let mut poses: Vec<(usize, Pose)> =
                panels.iter().map(|panel| camera_from_target.after(panel)).enumerate().collect();
            let facing = |pose: &Pose| (pose.rotation * DVec3::Z).dot(pose.translation.normalize());
            poses.sort_by(|a, b| facing(&a.1).total_cmp(&facing(&b.1)));
            let seen = poses[..8].iter();
            let seen =
                seen.filter_map(|(p, pose)| sighting(camera, pose, *p, &corners, &mut random));
            view(name, camera, seen.collect())
        });
        CameraViews::new(&format!("c{index}"), views.collect(), Model::Radtan)
    };
    let views = cameras.iter().enumerate().map(of_camera).collect();
    let stated = |&pose: &Pose| {
        let off = DQuat::from_rotation_y(0.002);
        let target_from_panel = Pose {
            rotation: pose.rotation * off,
            translation: pose.translation + DVec3::new(0.1, -0.1, 0.05),
        };
        target_from_panel.into()
    };
    (views, panels.iter().map(stated).collect())
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("calibrate");
    group.sample_size(10);
    let (views, panels) = board();
    for model in [Model::Radtan, Model::Rational] {
        let calibration = Calibration::new(panels.iter().copied()).camera("", views.clone(), model);
        group.bench_function(format!("109 views of 110 corners, {model}"), |bencher| {
            bencher.iter(|| black_box(calibration.solve()))
        });
    }
    let (views, panels) = rig();
    let blank = Calibration::new(panels).refine_panels(true);
    let calibration = views.into_iter().fold(blank, Calibration::with);
    group.bench_function("rig of 4 × 150 views of 8 faces of 36 corners", |bencher| {
        bencher.iter(|| black_box(calibration.solve()))
    });
    group.finish();
}

criterion_group!(calibration, benches);
criterion_main!(calibration);
