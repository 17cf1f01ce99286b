//! Lenses that no parametric model fits, calibrated as splines.

use deltille::calibrate::{
    Calibration, CameraEstimate, Comparison, Estimate, Model, PanelRef, Region, Source, View,
};
use deltille::camera::{Camera, Lens, Pose, Spline, SplineGrid};
use deltille::export::{calibration, saved};
use glam::DVec2;

use super::models::{camera, of, simulated, solved};

/// Standard deviation of the simulated corners, px.
const NOISE_PX: f64 = 0.05;

/// A fisheye with non-radial waves of a pixel, as a spline on a grid that no calibration uses.
fn wavy(seed: u64) -> Camera {
    let grid = SplineGrid::new(3, [27, 21], 250).unwrap();
    let phase = seed as f64;
    let (columns, rows, h) = (grid.columns, grid.rows, grid.distance());
    let knots = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let bend = |(row, column): (usize, usize)| {
        let place = DVec2::new(column as f64, row as f64);
        let middle = DVec2::new((columns - 1) as f64, (rows - 1) as f64) / 2.0;
        let u = (place - middle) * h;
        let tangent = u.length() / 2.0;
        let theta = 2.0 * tangent.atan();
        let part = if tangent > 0.0 { theta / (2.0 * tangent) } else { 1.0 };
        let wave =
            DVec2::new((2.3 * u.y + phase).sin(), (1.9 * u.x - 0.7 * u.y + 2.0 * phase).cos());
        u * (part - 1.0) + 0.004 * wave
    };
    let lens = Lens::Spline(Spline::new(grid).with_knots(knots.map(bend).collect()));
    let mut camera = Camera::centred(1600, 1200, 297.0, lens);
    camera.centre_px = DVec2::new(804.0, 606.0);
    camera
}

/// The error of a camera, and the error expected from its uncertainties, px.
fn off(found: &CameraEstimate, truth: &Camera) -> [f64; 2] {
    let mut truth = CameraEstimate::given("", truth.clone());
    truth.views = found.views.clone();
    // Practically exact.
    truth.parameters[0].sd = Some(1e-9);
    truth.covariance = deltille::calibrate::Matrix::from_fn(1, 1, |_, _| 1e-18);
    let compared = Comparison::of(found, &truth, None, Region::Seen).unwrap();
    [compared.rms_px, compared.expected_px.unwrap()]
}

#[test]
fn a_spline_fits_an_arbitrary_lens_within_its_uncertainty() {
    let truth = wavy(0);
    let (views, _) = simulated(&truth, 150, 0.8, 0);
    let fisheye = solved(&views, Model::KannalaBrandt(6));
    assert!(fisheye.rms_px > 4.0 * NOISE_PX, "{}", fisheye.rms_px);
    let found = of(&views, Model::SPLINE).hold_out(Some(5)).solve().unwrap();
    let held_out = found.held_out.as_ref().unwrap().rms_px;
    assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.05, "{} px", found.rms_px);
    assert!(held_out < 1.15 * NOISE_PX, "{held_out} px");
    assert!(found.excluded.is_empty() && found.outlier_count() == 0);
    let camera = &found.cameras[0];
    assert!(camera.ill_conditioned.is_empty() && camera.lens_limit().is_none());
    let [off, expected] = off(camera, &truth);
    assert!((0.6..1.5).contains(&(off / expected)), "{off} px, {expected} px expected");
}

/// For a polynomial lens the spline has nothing to correct, and its uncertainty is hardly larger.
#[test]
fn a_spline_is_no_freer_than_the_lens_requires() {
    let truth = camera(Model::KannalaBrandt(4));
    let (views, _) = simulated(&truth, 60, 0.8, 3);
    let sd = |model: Model| {
        let found = solved(&views, model);
        found.cameras[0].projection_sd_px(None, Source::Noise).unwrap()
    };
    let (spline, fisheye) = (sd(Model::SPLINE), sd(Model::KannalaBrandt(4)));
    assert!(spline < 2.0 * fisheye, "{spline} px, {fisheye} px of the polynomial");
}

#[test]
fn a_spline_is_selected_if_no_other_model_fits() {
    let (views, _) = simulated(&wavy(5), 90, 0.7, 5);
    let (model, tried) = of(&views, Model::Radtan).choose_model(0, &Model::CANDIDATES).unwrap();
    assert_eq!(model, Model::SPLINE, "{tried:?}");
    // With few corners it is not even tried.
    let (_, tried) = of(&views[..20], Model::Radtan).choose_model(0, &Model::CANDIDATES).unwrap();
    assert!(tried.iter().all(|candidate| candidate.model != Model::SPLINE));
}

/// With a measured target; with a bent board and on a rig below.
#[test]
fn a_spline_combines_with_a_measured_target() {
    let (views, _) = simulated(&wavy(2), 36, 0.8, 2);
    let measured = of(&views, Model::SPLINE).measure_target(true).solve().unwrap();
    is_noise(&measured);
    let [plane, out] = measured.map.as_ref().unwrap().rms_mm();
    assert!(plane < 0.01 && out < 0.02, "{plane} and {out} mm of a perfect board");
}

/// The other degree with an explicit grid, and a rig.
#[test]
#[ignore = "a thousand knots at once: a minute"]
fn large_splines_and_rigs_of_splines() {
    let truth = wavy(2);
    let (views, poses) = simulated(&truth, 60, 0.8, 2);
    let quadratic = "spline-2-28x28".parse::<Model>().unwrap();
    is_noise(&of(&views, quadratic).solve().unwrap());
    is_noise(&of(&views, Model::SPLINE).board_shape(true).solve().unwrap());
    // Two cameras side by side, the second a little farther left.
    let beside = Pose { translation: glam::DVec3::new(15.0, 0.0, 0.0), ..Pose::IDENTITY };
    let second: Vec<View> = seen(&wavy(3), &poses, &beside);
    let rig = Calibration::new([Pose::IDENTITY])
        .camera("left", views.clone(), Model::SPLINE)
        .camera("right", second, Model::SPLINE)
        .solve()
        .unwrap();
    is_noise(&rig);
    for (camera, truth) in rig.cameras.iter().zip([truth, wavy(3)]) {
        let [off, expected] = off(camera, &truth);
        assert!(off < 2.0 * expected, "{off} px, {expected} px expected");
    }
}

/// Whether only noise remains. The smoothness prior of a spline leaves a part of the waves, here up to a tenth of the
/// noise.
#[track_caller]
fn is_noise(found: &Estimate) {
    let rms = found.inlier_rms_px() / NOISE_PX;
    assert!(
        (0.85..1.15).contains(&rms),
        "{rms}, {} outliers, {:?}",
        found.outlier_count(),
        found.excluded
    );
}

/// Views of the board by a camera at another pose.
fn seen(camera: &Camera, poses: &[Pose], beside: &Pose) -> Vec<View> {
    use rand::SeedableRng;
    use rand_distr::Distribution;
    let normal = rand_distr::Normal::new(0.0, NOISE_PX).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(99);
    let view = |(index, pose): (usize, &Pose)| {
        let pose = beside.after(pose);
        let places = (0..8).flat_map(|row| (0..11).map(move |col| (row, col)));
        let observations = places.filter_map(|(row, col)| {
            let panel_mm = glam::DVec3::new(20.0 * f64::from(col), 20.0 * f64::from(row), 0.0);
            let pixel = camera.project(pose.apply(panel_mm)).filter(|&at| camera.sees(at, 5.0))?;
            let pixel = pixel.map(|v| v + normal.sample(&mut rng));
            let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
            Some(deltille::calibrate::Observation { row, col, panel_mm, pixel, cov })
        });
        let observations = observations.collect();
        let sightings = vec![deltille::calibrate::Sighting { panel: PanelRef::ONLY, observations }];
        let (name, image) = (index.to_string(), format!("{index}.png"));
        View { name, image, size_px: [camera.width, camera.height], sightings }
    };
    poses.iter().enumerate().map(view).collect()
}

#[test]
fn a_spline_is_written_and_read_back() {
    let (views, _) = simulated(&wavy(1), 25, 0.8, 1);
    let found = of(&views, "spline-3-10x8".parse::<Model>().unwrap()).solve().unwrap();
    let camera = &found.cameras[0];
    assert_eq!(Camera::from_yaml(&camera.camera.to_yaml()).unwrap(), camera.camera);
    let residuals = calibration::Residuals::Omitted;
    let text =
        calibration::write(&found, &[], calibration::Print::default(), residuals, &[]).unwrap();
    let read = &saved::read_without_target(&text).unwrap().cameras[0];
    assert_eq!((&read.camera, read.model), (&camera.camera, camera.model));
    let pixel = DVec2::new(500.0, 400.0);
    let [a, b] = [camera, read].map(|camera| {
        camera.projection_covariance(pixel, None, Source::Observed).unwrap()[0][0].sqrt()
    });
    assert!((a / b - 1.0).abs() < 1e-6, "{a}, {b}");
}
