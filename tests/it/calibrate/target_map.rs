//! Self-measured targets: offsets of corners match the truth within their standard deviations, perfect boards have
//! none, and a measured target serves other calibrations.

use deltille::calibrate::{
    Calibration, CornerOffset, Estimate, Messages, Model, Observation, OutlierPattern, PanelPrior,
    PanelRef, Reference, Sighting, TargetMap, UntaggedGrid, View,
};
use deltille::camera::{Camera, Pose};
use deltille::export::calibration::{self, Print, Residuals};
use deltille::export::saved;
use deltille::lattice::GridKind;
use deltille::targets::Target;
use glam::{DQuat, DVec2, DVec3};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const NOISE_PX: f64 = 0.02;
const SIDE: i32 = 9;
const BOARD: UntaggedGrid =
    UntaggedGrid { kind: GridKind::Checker, edge_mm: 20.0, size: Some([SIDE as u32, SIDE as u32]) };

/// A print and its mount: random errors of corners, and a bent sheet.
struct Sheet {
    random_mm: f64,
    bent_mm: f64,
}

impl Sheet {
    /// Offsets of the corners, panel by panel.
    fn offsets(&self, panels: usize, seed: u64) -> Vec<Vec<DVec3>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, self.random_mm).unwrap();
        let corner = |i: i32, random: &mut ChaCha8Rng| {
            let [u, v] = [i % SIDE, i / SIDE].map(|k| f64::from(2 * k) / f64::from(SIDE - 1) - 1.0);
            let [x, y, z] = [0; 3].map(|_| normal.sample(random));
            DVec3::new(x, y, 0.3 * z + self.bent_mm * (u * u - 0.5 * v + 0.3 * u * v * v))
        };
        let panel = |_| (0..SIDE * SIDE).map(|i| corner(i, &mut random)).collect();
        (0..panels).map(panel).collect()
    }
}

fn plan(i: i32) -> DVec3 {
    DVec3::new(20.0 * f64::from(i % SIDE), 20.0 * f64::from(i / SIDE), 0.0)
}

fn camera() -> Camera {
    Camera::pinhole(1600, 1200, 1.0)
}

/// Views of panels with displaced corners.
fn views(
    panels: &[Pose],
    offsets: &[Vec<DVec3>],
    camera_from_rig: &Pose,
    count: usize,
    seed: u64,
) -> Vec<View> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noisy = ChaCha8Rng::seed_from_u64(seed ^ camera_from_rig.translation.x.to_bits() ^ 99);
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let camera = camera();
    let view = |index: usize| {
        let tilt = DVec3::from([0; 3].map(|_| random.random_range(-0.7..0.7)));
        let rotation = DQuat::from_scaled_axis(tilt) * DQuat::from_rotation_x(std::f64::consts::PI);
        let at = DVec3::new(
            random.random_range(-70.0..70.0),
            random.random_range(-50.0..50.0),
            random.random_range(300.0..420.0),
        );
        let pose = Pose { rotation, translation: at - rotation * DVec3::new(80.0, 80.0, 0.0) };
        let pose = camera_from_rig.after(&pose);
        let sightings = panels.iter().zip(offsets).enumerate().map(|(p, (panel, offsets))| {
            let camera_from_panel = pose.after(panel);
            let seen = offsets.iter().zip(0..).filter_map(|(offset, i)| {
                let seen = camera.project(camera_from_panel.apply(plan(i) + *offset))?;
                let off = DVec2::from([0; 2].map(|_| noise.sample(&mut noisy)));
                let pixel = seen + off;
                let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
                Some(Observation { row: i / SIDE, col: i % SIDE, panel_mm: plan(i), pixel, cov })
            });
            Sighting { panel: PanelRef::new(p, p as u32), observations: seen.collect() }
        });
        let name = index.to_string();
        View { image: name.clone(), name, size_px: [1600, 1200], sightings: sightings.collect() }
    };
    (0..count).map(view).collect()
}

fn of(views: Vec<View>) -> Calibration {
    Calibration::new([Pose::IDENTITY]).camera("", views, Model::Radtan)
}

/// The truth without the part that poses and distances absorb, for each panel separately or for all
/// together.
fn without_gauge(truth: &[DVec3], map: &TargetMap, panels: &[Pose], by_panel: bool) -> Vec<DVec3> {
    let corners = map.corners();
    let [plane, out] = map.expected_mm;
    let prior = [plane, plane, out];
    let groups = if by_panel { panels.len() } else { 1 };
    let mut modes: Vec<Vec<f64>> = Vec::new();
    let mut add = |field: &dyn Fn(usize, DVec3) -> DVec3| {
        let mode = corners.iter().flat_map(|corner| {
            let panel = panels[corner.panel.index()];
            let moved = field(corner.panel.index(), panel.apply(corner.panel_mm));
            (panel.rotation.conjugate() * moved).to_array()
        });
        modes.push(mode.enumerate().map(|(i, v)| v / prior[i % 3]).collect());
    };
    for group in 0..groups {
        for axis in DVec3::AXES {
            let of = |panel: usize| if !by_panel || panel == group { axis } else { DVec3::ZERO };
            add(&|panel, _| of(panel));
            add(&|panel, at| of(panel).cross(at));
        }
    }
    add(&|_, at| at);
    let modes = DMatrix::from_fn(3 * corners.len(), modes.len(), |i, j| modes[j][i]);
    let truth = DVector::from_iterator(
        3 * truth.len(),
        truth.iter().flat_map(|mm| mm.to_array()).enumerate().map(|(i, mm)| mm / prior[i % 3]),
    );
    let along = (modes.tr_mul(&modes)).cholesky().unwrap().solve(&modes.tr_mul(&truth));
    let left = truth - modes * along;
    left.as_slice().chunks(3).map(|v| DVec3::new(v[0], v[1], v[2]) * DVec3::from(prior)).collect()
}

/// Number of corners of a map within 3σ of the truth per axis, and the mean squared normalised error.
fn compared(map: &TargetMap, truth: &[DVec3]) -> (usize, f64) {
    let (mut within, mut squares) = (0, 0.0);
    for (corner, truth) in map.corners().iter().zip(truth) {
        let off = corner.offset_mm - *truth;
        let sd: [f64; 3] = std::array::from_fn(|k| corner.covariance_mm2[k][k].sqrt());
        let off: [f64; 3] = std::array::from_fn(|k| off[k] / sd[k]);
        within += usize::from(off.iter().all(|off| off.abs() < 3.0));
        squares += off.iter().map(|off| off * off).sum::<f64>() / 3.0;
    }
    (within, squares / map.corners().len() as f64)
}

fn check(found: &Estimate, truth: &[Vec<DVec3>], panels: &[Pose], by_panel: bool) -> [usize; 2] {
    let map = found.map.as_ref().unwrap();
    let truth = without_gauge(&truth.concat(), map, panels, by_panel);
    let (within, chi2) = compared(map, &truth);
    assert!((0.8..1.25).contains(&chi2), "e² {chi2}");
    [within, map.corners().len()]
}

/// 99 % of all corners of ten boards are within 3σ on all three axes, as expected.
#[test]
fn offsets_match_their_sd() {
    let mut counts = [0; 2];
    for seed in 0..10 {
        let offsets = Sheet { random_mm: 0.08, bent_mm: 0.1 }.offsets(1, seed);
        let views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 20, 1000 + seed);
        let found = of(views).measure_target(true).solve().unwrap();
        assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.1, "rms {} px", found.rms_px);
        let of_board = check(&found, &offsets, &[Pose::IDENTITY], false);
        counts = [0, 1].map(|i| counts[i] + of_board[i]);
        let truth = camera().parameters().into_iter().chain([0.0; 4]);
        for (parameter, truth) in found.cameras[0].parameters.iter().zip(truth) {
            let (name, value) = (&parameter.name, parameter.value);
            let Some(sd) = parameter.sd else { continue };
            assert!((value - truth).abs() < 4.0 * sd, "{name} {value} ± {sd}, not {truth}");
        }
    }
    assert!(counts[0] as f64 >= 0.985 * counts[1] as f64, "{counts:?}");
}

/// Four views do not determine the shape of a bent sheet: the attraction to the plan is included in the uncertainty.
#[test]
fn uncertainties_of_four_views_are_right() {
    let (mut of_camera, mut of_corners) = (0.0, 0.0);
    for seed in 0..8 {
        let offsets = Sheet { random_mm: 0.03, bent_mm: 0.1 }.offsets(1, 50 + seed);
        let views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 4, 5000 + seed);
        let found = of(views).measure_target(true).solve().unwrap();
        let (value, truth) = (found.cameras[0].camera.focal_px, camera().focal_px);
        let sd = found.cameras[0].observed_sd()[0].expect("four views show it");
        of_camera += ((value.x - truth.x) / sd).powi(2) / 8.0;
        let map = found.map.as_ref().unwrap();
        let truth = without_gauge(&offsets.concat(), map, &[Pose::IDENTITY], false);
        of_corners += compared(map, &truth).1 / 8.0;
    }
    assert!(of_camera.sqrt() < 1.5, "{}", of_camera.sqrt());
    assert!(of_corners.sqrt() < 1.5, "{}", of_corners.sqrt());
}

/// The findings about corners of the map, as kind, row, column and whether the observations are held out.
fn named(found: &Estimate) -> Vec<(&'static str, i32, i32, bool)> {
    let findings = found.findings.iter().filter_map(|finding| match finding.pattern {
        OutlierPattern::Corner { row, col, is_held_out, .. } => {
            Some((if finding.is_excluded { "left" } else { "seen" }, row, col, is_held_out))
        }
        OutlierPattern::Offset { row, col, .. } => Some(("offset", row, col, false)),
        _ => None,
    });
    findings.collect()
}

/// A corner that lies elsewhere in a third of the views is measured from the others, and named; so is a corner that the
/// print displaces by far more than others. On ordinary boards, none is named.
#[test]
fn wrong_corners_are_named() {
    let measured = |wrong: bool, displaced: bool| {
        let mut offsets = Sheet { random_mm: 0.05, bent_mm: 0.0 }.offsets(1, 3);
        if displaced {
            offsets[0][20] += DVec3::new(0.6, 0.0, 0.0);
        }
        let mut views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 12, 7000);
        for view in views.iter_mut().skip(2).step_by(3).filter(|_| wrong) {
            view.sightings[0].observations[40].pixel += DVec2::new(1.0, 0.5);
        }
        of(views).measure_target(true).solve().unwrap()
    };
    assert_eq!(named(&measured(false, false)), []);
    let found = measured(true, true);
    assert_eq!(named(&found), [("seen", 4, 4, true), ("offset", 2, 2, false)]);
    let words = Messages::new(&found, None);
    let said: Vec<String> = found.findings.iter().map(|finding| words.finding(finding)).collect();
    assert!(
        said[0].starts_with("corner in row 4, column 4: 4 of 4 observations in held-out views"),
        "{said:?}"
    );
    assert!(said[1].starts_with("corner in row 2, column 2: displaced by 0."), "{said:?}");
    let right = measured(false, true);
    let at = |of: &Estimate| of.map.as_ref().unwrap().offset_mm(PanelRef::ONLY, 4, 4);
    assert!(at(&found).distance(at(&right)) < 0.02, "{} {}", at(&found), at(&right));
}

/// A corner at a different position in most views is not measured.
#[test]
fn a_corner_that_rests_on_outliers_is_not_measured() {
    let offsets = Sheet { random_mm: 0.05, bent_mm: 0.0 }.offsets(1, 3);
    let mut views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 12, 7000);
    for (index, view) in views.iter_mut().enumerate().take(8) {
        let (sin, cos) = (2.4 * index as f64).sin_cos();
        view.sightings[0].observations[40].pixel += (1.0 + index as f64) * DVec2::new(sin, cos);
    }
    let found = of(views).measure_target(true).solve().unwrap();
    assert_eq!(named(&found), [("left", 40 / SIDE, 40 % SIDE, false)]);
    let map = found.map.unwrap();
    assert_eq!((map.not_measured.len(), map.corners().len()), (1, (SIDE * SIDE - 1) as usize));
    assert_eq!(map.offset_mm(PanelRef::ONLY, 40 / SIDE, 40 % SIDE), DVec3::ZERO);
}

/// Number of perfect boards that show a significant offset.
fn alarms(boards: u64) -> usize {
    let is_alarm = |seed: &u64| {
        let offsets = Sheet { random_mm: 0.0, bent_mm: 0.0 }.offsets(1, *seed);
        let views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 12, 2000 + *seed);
        let found = of(views).measure_target(true).solve().unwrap();
        found.map.unwrap().significant().count() > 0
    };
    (0..boards).filter(is_alarm).count()
}

#[test]
fn a_perfect_board_has_no_significant_offsets() {
    assert_eq!(alarms(12), 0);
}

#[test]
#[ignore = "200 boards"]
fn one_in_a_hundred_perfect_boards_has_significant_offsets() {
    assert!(alarms(200) <= 2);
}

/// Two panels of a target with unknown poses, seen by two cameras.
#[test]
fn a_rig_measures_several_panels() {
    let up = |x: f64, angle: f64| Pose {
        rotation: DQuat::from_rotation_y(angle),
        translation: DVec3::new(x, 0.0, 0.0),
    };
    let planned = [up(-90.0, 0.2), up(90.0, -0.2)];
    let made = [planned[0], Pose { translation: DVec3::new(90.4, 0.3, -0.2), ..planned[1] }];
    let offsets = Sheet { random_mm: 0.08, bent_mm: 0.1 }.offsets(2, 5);
    let right =
        Pose::looking_at(DVec3::new(60.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 350.0), DVec3::NEG_Y);
    let of_camera = |pose: &Pose| views(&made, &offsets, pose, 30, 3000);
    let rig = Calibration::new(planned.map(PanelPrior::from))
        .camera("left", of_camera(&Pose::IDENTITY), Model::Radtan)
        .camera("right", of_camera(&right), Model::Radtan)
        .refine_panels(true)
        .measure_target(true);
    let found = rig.solve().unwrap();
    assert!((found.rms_px / NOISE_PX - 1.0).abs() < 0.1, "rms {} px", found.rms_px);
    let [within, all] = check(&found, &offsets, &made, true);
    assert!(within as f64 >= 0.97 * all as f64, "{within} of {all}");
}

/// A map measured with some views reduces the residuals of others to noise, and both files restore it.
#[test]
fn a_measured_target_reduces_the_residuals_of_other_views() {
    let offsets = Sheet { random_mm: 0.08, bent_mm: 0.1 }.offsets(1, 7);
    let some = |seed: u64| views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 20, seed);
    let found = of(some(1)).measure_target(true).hold_out(Some(4)).solve().unwrap();
    let map = found.map.as_ref().unwrap();
    let held_out = found.held_out.as_ref().unwrap();
    assert!((held_out.rms_px / NOISE_PX - 1.0).abs() < 0.15, "{}", held_out.rms_px);
    let text = calibration::write(&found, &[], Print::default(), Residuals::Listed, &[]).unwrap();
    let read = saved::read(&text, &Reference::Grid(BOARD)).unwrap();
    assert_eq!(read.map.as_ref(), Some(map));

    let board = BOARD.target("board").unwrap().unwrap();
    let measured = map.on(&board);
    assert_eq!((measured.name.to_string(), measured.is_measured()), ("board".to_owned(), true));
    let measured = Target::from_json(&measured.to_json()).unwrap();
    let of_target = |map: &CornerOffset| {
        let corners = &measured.panels[0].corners;
        let corner = corners.iter().find(|c| (c.row, c.col) == (map.row, map.col)).unwrap();
        corner.offset_mm()
    };
    let same = map.corners().iter().all(|c| (of_target(c) - c.offset_mm).length() < 1e-9);
    assert!(same);
    let mut others = some(2);
    for sighting in others.iter_mut().flat_map(|view| &mut view.sightings) {
        sighting.correct(map);
    }
    let with_map = of(others).solve().unwrap();
    assert!((with_map.rms_px / NOISE_PX - 1.0).abs() < 0.15, "{}", with_map.rms_px);
    assert!(of(some(2)).solve().unwrap().rms_px > 3.0 * NOISE_PX);
}

/// A corner at a different position in every view is not measured; all others are.
#[test]
fn a_corner_that_is_wrong_everywhere_is_not_measured() {
    let offsets = Sheet { random_mm: 0.08, bent_mm: 0.1 }.offsets(1, 8);
    let mut views = views(&[Pose::IDENTITY], &offsets, &Pose::IDENTITY, 15, 8);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    for view in &mut views {
        let wrong = &mut view.sightings[0].observations[40];
        wrong.pixel +=
            DVec2::new(random.random_range(20.0..60.0), random.random_range(-60.0..60.0));
    }
    let found = of(views).measure_target(true).solve().unwrap();
    let map = found.map.as_ref().unwrap();
    assert_eq!((map.corners().len(), found.outlier_count()), (80, 15));
    assert!((found.inlier_rms_px() / NOISE_PX - 1.0).abs() < 0.1, "{}", found.inlier_rms_px());
}
