//! Estimation of the shape of a board's sheet, which is significant only for a bent sheet.

use deltille::calibrate::{
    Alternative, BoardShape, Calibration, CalibrationError, Diagnosis, Estimate, LackOfFit, Model,
    Observation, PanelRef, Reference, Remedy, Sighting, UntaggedGrid, View,
};
use deltille::camera::{Camera, Pose};
use deltille::export::calibration::{self, Print, Residuals};
use deltille::export::{rig, saved};
use deltille::lattice::GridKind;
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE_PX: f64 = 0.05;

fn of(views: &[View]) -> Calibration {
    Calibration::new([Pose::IDENTITY]).camera("", views.to_vec(), Model::Radtan)
}

/// Views of a board of 9 × 9 corners, 20 mm apart, from a camera with this pose on its rig. `offset` moves each corner
/// as a function of its position from the centre in units of half the diagonal.
fn views_of(camera_from_rig: &Pose, offset: impl Fn(f64, f64) -> DVec3, seed: u64) -> Vec<View> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noisy = ChaCha8Rng::seed_from_u64(seed ^ camera_from_rig.translation.x.to_bits());
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
        let pose = camera_from_rig.after(&pose);
        let corners = (0..81).map(|i| {
            let (row, col) = (i / 9, i % 9);
            let panel_mm = DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0);
            let [u, v] = [panel_mm.x, panel_mm.y].map(|mm| (mm - 80.0) / reach);
            let at = camera.project(pose.apply(panel_mm + offset(u, v))).unwrap();
            let pixel = at.map(|v| v + noise.sample(&mut noisy));
            let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
            Observation { row, col, panel_mm, pixel, cov }
        });
        let sightings = vec![Sighting { panel: PanelRef::ONLY, observations: corners.collect() }];
        let name = index.to_string();
        View { image: name.clone(), name, size_px: [1600, 1200], sightings }
    };
    (0..20).map(view).collect()
}

fn views(offset: impl Fn(f64, f64) -> DVec3, seed: u64) -> Vec<View> {
    views_of(&Pose::IDENTITY, offset, seed)
}

/// The shape of a sheet.
const BENT: [f64; 9] = [1.0, 0.3, -0.6, 0.2, 0.0, -0.1, 0.0, 0.08, -0.05];

fn bent(u: f64, v: f64) -> DVec3 {
    let [b1, b2, b3, b4, _, b6, _, a1, a2] = BENT;
    let z = b1 * u * u + b2 * u * v + b3 * v * v + b4 * u.powi(3) + b6 * u * v * v;
    DVec3::new(a1 * u + a2 * v, a2 * u - a1 * v, z)
}

fn check_shape(found: &Estimate) {
    let BoardShape { shape, sd_mm, .. } = found.shape.unwrap();
    assert!(found.shape.unwrap().is_significant());
    for ((found, truth), sd) in shape.coefficients_mm.iter().zip(BENT).zip(sd_mm) {
        assert!((found - truth).abs() < 4.0 * sd && sd < 0.05, "{found} ± {sd}, not {truth}");
    }
}

/// Reads a file back, and compares all its contents.
fn check_read_back(found: &Estimate, text: &str) {
    let board = UntaggedGrid { kind: GridKind::Checker, edge_mm: 20.0, size: None };
    let read = saved::read(text, &Reference::Grid(board)).unwrap();
    check_same(found, &read);
    check_same(found.held_out.as_ref().unwrap(), read.held_out.as_ref().unwrap());
    assert_eq!(
        (read.shape, read.sigma, read.common_px),
        (found.shape, found.sigma, found.common_px)
    );
    for (found, read) in found.cameras.iter().zip(&read.cameras) {
        assert_eq!((found.model, &found.ill_conditioned), (read.model, &read.ill_conditioned));
        let (found_of, read_of) = (&found.covariance, &read.covariance);
        let entries = (0..found_of.rows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let largest = (0..found_of.rows()).map(|i| found_of[(i, i)]).fold(0.0, f64::max);
        let apart = entries.map(|at| (found_of[at] - read_of[at]).abs()).fold(0.0, f64::max);
        assert!(apart <= 1e-12 * largest, "{apart}");
        assert_eq!(found.pose_sd, read.pose_sd);
    }
}

fn check_same(found: &Estimate, read: &Estimate) {
    assert!((found.rms_px - read.rms_px).abs() < 1e-12);
    assert_eq!((found.cameras.len(), found.frames.len()), (read.cameras.len(), read.frames.len()));
    let is_same = |a: &Pose, b: &Pose| {
        let [turn, step] = a.off(b);
        turn.length() < 1e-12 && step.length() < 1e-9
    };
    for (found, read) in found.frames.iter().zip(&read.frames) {
        assert_eq!((&found.name, found.pose_sd), (&read.name, read.pose_sd));
        assert!(is_same(&found.rig_from_target, &read.rig_from_target));
    }
    for (found, read) in found.cameras.iter().zip(&read.cameras) {
        assert_eq!(found.camera, read.camera);
        assert!(is_same(&found.camera_from_rig, &read.camera_from_rig));
        assert_eq!(found.views.len(), read.views.len());
        for (found, read) in found.views.iter().zip(&read.views) {
            assert_eq!((&found.corners, found.frame), (&read.corners, read.frame));
            assert!(is_same(&found.pose, &read.pose));
        }
    }
}

/// Two cameras determine the shape more precisely than one, and the shape fits held-out frames
/// equally well.
#[test]
fn a_rig_estimates_the_shape_of_a_sheet() {
    let eye = DVec3::new(60.0, 0.0, 0.0);
    let right = Pose::looking_at(eye, DVec3::new(0.0, 0.0, 350.0), DVec3::NEG_Y);
    let of_right = views_of(&right, bent, 1);
    let alone = of(&views(bent, 1)).board_shape(true).hold_out(Some(4)).solve().unwrap();
    check_read_back(
        &alone,
        &calibration::write(&alone, &[], Print::default(), Residuals::Listed, &[]).unwrap(),
    );
    let both = of(&views(bent, 1)).camera("right", of_right, Model::Radtan);
    let found = both.clone().board_shape(true).hold_out(Some(5)).solve().unwrap();
    check_shape(&found);
    let sds = |found: &Estimate| found.shape.unwrap().sd_mm;
    assert!(sds(&found).iter().zip(sds(&alone)).all(|(rig, alone)| *rig < alone));
    let held_out = found.held_out.as_ref().unwrap();
    assert_eq!((found.frames.len(), held_out.frames.len()), (16, 4));
    for rms_px in [found.rms_px, held_out.rms_px] {
        assert!((rms_px / NOISE_PX - 1.0).abs() < 0.05, "{rms_px}");
    }
    let [turn, step] = found.cameras[1].camera_from_rig.off(&right);
    assert!(turn.length() < 1e-3 && step.length() < 0.5, "{turn} {step}");
    let text = rig::write(&found, &[], "radtan", Print::default(), Residuals::Listed, &[]);
    check_read_back(&found, &text);
    // Without the shape, the diagnosis blames the board.
    let flat = both.solve().unwrap();
    let said = both.explain(&flat);
    let is_of_shape = |said: &Diagnosis| matches!(said, Diagnosis::Remedied { remedy, .. } if remedy.alternative == Alternative::Shape);
    assert!(said.len() == 1 && said.iter().all(is_of_shape), "{said:?}");
}

#[test]
fn a_bent_and_stretched_sheet_is_estimated() {
    let views = views(bent, 1);
    let (plain, with_shape) = (of(&views), of(&views).board_shape(true));
    let (flat, found) = (plain.solve().unwrap(), with_shape.solve().unwrap());
    let [LackOfFit::Target { panel: PanelRef::ONLY, rms_mm, .. }] = flat.lack_of_fit[..] else {
        panic!("{:?}", flat.lack_of_fit)
    };
    assert!((0.05..0.5).contains(&rms_mm), "{rms_mm}");
    assert_eq!(found.lack_of_fit, []);
    let said = plain.explain(&flat);
    let [Diagnosis::Remedied { remedy: Remedy { alternative: Alternative::Shape, .. }, .. }] =
        said[..]
    else {
        panic!("{said:?}")
    };
    assert_eq!(with_shape.explain(&found), []);
    assert!(flat.rms_px > 2.0 * found.rms_px, "{} {}", flat.rms_px, found.rms_px);
    assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.05, "{}", found.rms_px);
    check_shape(&found);
    // The number of camera parameters does not change.
    assert_eq!(found.cameras[0].covariance.rows(), flat.cameras[0].covariance.rows());
}

#[test]
fn the_shape_of_a_flat_sheet_is_not_significant() {
    let significant = (0..10).filter(|&seed| {
        let views = views(|_, _| DVec3::ZERO, 100 + seed);
        let found = of(&views).board_shape(true).solve().unwrap();
        found.shape.unwrap().is_significant()
    });
    assert_eq!(significant.count(), 0);
    let views = views(|_, _| DVec3::ZERO, 1);
    let of_two = Calibration::new([Pose::IDENTITY; 2]);
    let of_two = of_two.camera("", views, Model::Radtan).board_shape(true);
    assert!(matches!(of_two.solve(), Err(CalibrationError::ShapeOfMany { panels: 2 })));
}
