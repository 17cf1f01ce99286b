//! The shape of a board's sheet: found where it is bent, and called chance where it is not.

use deltille::calibrate::{
    BoardShape, Instead, Loss, Misfit, Model, Observation, Options, PanelRef, Sighting, View,
    Weights, calibrate, calibrate_with_shape, remedy,
};
use deltille::camera::{Camera, Pose};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE_PX: f64 = 0.05;
const OPTIONS: Options =
    Options { model: Model::Radtan, loss: Loss::Huber, weights: Weights::Covariance };

/// Views of a board of 9 × 9 corners, 20 mm apart, whose corners are moved by `offset` of the place
/// from its middle in parts of its half diagonal.
fn views(offset: impl Fn(f64, f64) -> DVec3, seed: u64) -> Vec<View> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let camera = Camera::pinhole(1600, 1200, 1.0);
    let reach = 80.0 * 2f64.sqrt();
    let view = |index: usize| {
        let tilt = DVec3::from([0; 3].map(|_| random.random_range(-0.7..0.7)));
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let at = DVec3::new(
            random.random_range(-70.0..70.0),
            random.random_range(-50.0..50.0),
            random.random_range(280.0..420.0),
        );
        let pose = Pose { rotation, translation: at - rotation * DVec3::new(80.0, 80.0, 0.0) };
        let corners = (0..81).map(|i| {
            let (row, col) = (i / 9, i % 9);
            let panel_mm = DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0);
            let [u, v] = [panel_mm.x, panel_mm.y].map(|mm| (mm - 80.0) / reach);
            let [x, y] = camera.project(pose.apply(panel_mm + offset(u, v))).unwrap();
            let pixel = [x + noise.sample(&mut random), y + noise.sample(&mut random)];
            let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
            Observation { row, col, panel_mm, pixel, cov }
        });
        let sightings = vec![Sighting { panel: PanelRef::ONLY, observations: corners.collect() }];
        let name = index.to_string();
        View { image: name.clone(), name, size_px: [1600, 1200], sightings }
    };
    (0..20).map(view).collect()
}

#[test]
fn a_bent_and_stretched_sheet_is_found() {
    let truth = [1.0, 0.3, -0.6, 0.2, 0.0, -0.1, 0.0, 0.08, -0.05];
    let offset = |u: f64, v: f64| {
        let [b1, b2, b3, b4, _, b6, _, a1, a2] = truth;
        let z = b1 * u * u + b2 * u * v + b3 * v * v + b4 * u.powi(3) + b6 * u * v * v;
        DVec3::new(a1 * u + a2 * v, a2 * u - a1 * v, z)
    };
    let views = views(offset, 1);
    let flat = calibrate(&views, &[Pose::IDENTITY], OPTIONS).unwrap();
    let found = calibrate_with_shape(&views, &[Pose::IDENTITY], OPTIONS).unwrap();
    let [Misfit::Target { panel: PanelRef::ONLY, rms_mm, .. }] = flat.misfits[..] else {
        panic!("{:?}", flat.misfits)
    };
    assert!((0.05..0.5).contains(&rms_mm), "{rms_mm}");
    assert_eq!(found.misfits, []);
    let remedy = |solution| remedy(&views, &[Pose::IDENTITY], OPTIONS, solution);
    assert_eq!(remedy(&flat).unwrap().instead, Instead::Shape);
    assert_eq!(remedy(&found), None);
    assert!(flat.rms_px > 2.0 * found.rms_px, "{} {}", flat.rms_px, found.rms_px);
    assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.05, "{}", found.rms_px);
    let BoardShape { shape, sd_mm, .. } = found.shape.unwrap();
    assert!(found.shape.unwrap().is_significant());
    for ((found, truth), sd) in shape.coefficients_mm.iter().zip(truth).zip(sd_mm) {
        assert!((found - truth).abs() < 4.0 * sd && sd < 0.05, "{found} ± {sd}, not {truth}");
    }
    // The camera has as many parameters as without.
    assert_eq!(found.covariance.shape(), flat.covariance.shape());
}

#[test]
fn a_flat_sheet_is_called_flat() {
    let significant = (0..10).filter(|&seed| {
        let views = views(|_, _| DVec3::ZERO, 100 + seed);
        let found = calibrate_with_shape(&views, &[Pose::IDENTITY], OPTIONS).unwrap();
        found.shape.unwrap().is_significant()
    });
    assert_eq!(significant.count(), 0);
    let views = views(|_, _| DVec3::ZERO, 1);
    assert!(calibrate_with_shape(&views, &[Pose::IDENTITY; 2], OPTIONS).is_err());
}
