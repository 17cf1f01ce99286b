//! Calibrations of simulated views with many kinds of outliers: these are found and named, and the estimated camera is
//! as accurate as without them.

use std::f64::consts::PI;

use deltille::calibrate::{
    Calibration, CalibrationError, CameraViews, Diagnosis, Estimate, Finding, LackOfFit, Model,
    Observation, OutlierPattern, PanelPrior, PanelRef, Sighting, View,
};
use deltille::camera::{Camera, Lens, Pose};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec2, DVec3};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Standard deviation of the simulated corners, px.
const NOISE_PX: f64 = 0.05;

const SIZE_PX: [u32; 2] = [1600, 1200];

fn board() -> Target {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = BoardSpec::new(GridKind::Deltille, 8, 11, 20.0);
    Target::build("board", &TargetSpec::Board(spec), Some(&family)).unwrap()
}

fn icosahedron() -> Target {
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    Target::build("ico", &spec, Some(&family)).unwrap()
}

fn camera(model: Model) -> Camera {
    let (focal, values): (f64, &[f64]) = match model {
        Model::Radtan => (1300.0, &[-0.17, 0.02, 5e-4, 2e-4]),
        _ => (330.0, &[-0.02, 0.002, -1e-4, 1e-5]),
    };
    let mut all = model.lens().parameters();
    all[..values.len()].copy_from_slice(values);
    let lens = model.lens().with_parameters(&all);
    let [width, height] = SIZE_PX;
    Camera { centre_px: DVec2::new(804.0, 606.0), ..Camera::centred(width, height, focal, lens) }
}

/// Poses of the target in front of a camera, randomly rotated and tilted.
fn places(camera: &Camera, target: &Target, count: usize, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let corners: Vec<DVec3> =
        target.panels.iter().flat_map(|p| &p.corners).map(|c| c.target_mm).collect();
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let size = corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max);
    let is_fisheye = !matches!(camera.lens, Lens::BrownConrady(_));
    let reach = if is_fisheye { 1.2 } else { 0.3 };
    let distance = size * camera.focal_px.x / if is_fisheye { 250.0 } else { 400.0 };
    let mut found = Vec::new();
    while found.len() < count {
        let mut any = |reach: f64| rng.random_range(-reach..reach);
        let turned = match target.panels.len() {
            1 => {
                let tilt = DQuat::from_scaled_axis(DVec3::new(any(0.7), any(0.7), 0.0));
                tilt * DQuat::from_rotation_z(any(3.0)) * DQuat::from_rotation_x(PI)
            }
            _ => DQuat::from_scaled_axis(DVec3::new(any(3.0), any(3.0), any(3.0))),
        };
        let towards = DQuat::from_scaled_axis(DVec3::new(any(reach), any(reach), 0.0));
        let centre = towards * DVec3::Z * distance * (1.4 + any(0.4));
        let rotation = towards * turned;
        found.push(Pose { rotation, translation: centre - rotation * middle });
    }
    found
}

/// The view of a target by a camera, with its panels at the poses `panels`.
fn seen(
    camera: &Camera,
    target: &Target,
    panels: &[Pose],
    place: &Pose,
    name: &str,
    rng: &mut ChaCha8Rng,
) -> View {
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let mut sightings = Vec::new();
    for (index, panel) in target.panels.iter().enumerate() {
        let pose = place.after(&panels[index]);
        let away = pose.apply(panel.corners[0].panel_mm.extend(0.0));
        if target.panels.len() > 1 && (pose.rotation * DVec3::Z).dot(-away.normalize()) < 0.3 {
            continue;
        }
        let corners = panel.corners.iter().filter_map(|corner| {
            let panel_mm = corner.panel_mm.extend(0.0);
            let at = camera.project(pose.apply(panel_mm)).filter(|&at| camera.sees(at, 5.0))?;
            let pixel = at.map(|v| v + noise.sample(rng));
            let cov = Some([NOISE_PX * NOISE_PX, 0.0, NOISE_PX * NOISE_PX]);
            Some(Observation { row: corner.row, col: corner.col, panel_mm, pixel, cov })
        });
        let observations: Vec<Observation> = corners.collect();
        if observations.len() >= 12 {
            let panel = PanelRef::new(index, panel.id);
            sightings.push(Sighting { panel, observations });
        }
    }
    View { name: name.to_owned(), image: format!("{name}.png"), size_px: SIZE_PX, sightings }
}

/// The fault of the views.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrong {
    Nothing,
    /// This fraction of all corners is at random positions in the image.
    Anywhere(f64),
    /// This fraction of all corners is displaced in the same way.
    Off(f64, DVec2),
    /// This fraction of all corners has the label of the neighbour in the row.
    OneTile(f64),
    /// The labels of a view are permuted.
    Permuted,
    /// A view is mirrored.
    Mirrored,
    /// A corner of three views is at 1e300.
    Endless,
    /// Panel 7 is displaced by this distance, mm.
    Displaced(f64),
    /// Panels 7 and 12 are exchanged.
    Exchanged,
    /// The labels of a panel in one view are permuted.
    PanelPermuted,
    /// Every panel is displaced by this distance, mm.
    AllDisplaced(f64),
    /// A view was taken with a focal length longer by this factor.
    Zoomed(f64),
}

/// Views of a target by a camera, with a fault.
fn views(model: Model, target: &Target, wrong: Wrong, seed: u64) -> Vec<View> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let camera = camera(model);
    let mut panels: Vec<Pose> = target.panels.iter().map(|panel| panel.pose.to_pose()).collect();
    match wrong {
        Wrong::Displaced(mm) => {
            let mut any = || rng.random_range(-1.0..1.0);
            let by = DVec3::new(any(), any(), any()).normalize() * mm;
            panels[7].translation += by;
        }
        Wrong::Exchanged => panels.swap(7, 12),
        Wrong::AllDisplaced(mm) => {
            let mut any = || rng.random_range(-1.0..1.0);
            for panel in &mut panels {
                panel.translation += DVec3::new(any(), any(), any()).normalize() * mm;
            }
        }
        _ => {}
    }
    let places = places(&camera, target, 25, &mut rng);
    let camera_of = |view: usize| match wrong {
        Wrong::Zoomed(by) if view == 3 => {
            Camera { focal_px: by * camera.focal_px, ..camera.clone() }
        }
        _ => camera.clone(),
    };
    let mut views: Vec<View> = places
        .iter()
        .enumerate()
        .map(|(i, place)| seen(&camera_of(i), target, &panels, place, &format!("{i:02}"), &mut rng))
        .collect();
    views.retain(|view| !view.sightings.is_empty());
    let mut some = ChaCha8Rng::seed_from_u64(seed ^ 0xBAD);
    match wrong {
        Wrong::Permuted => {
            let seen = &mut views[3].sightings[0].observations;
            let mut pixels: Vec<_> = seen.iter().map(|seen| seen.pixel).collect();
            pixels.shuffle(&mut some);
            seen.iter_mut().zip(pixels).for_each(|(seen, pixel)| seen.pixel = pixel);
        }
        Wrong::PanelPermuted => {
            let view = views.iter_mut().find(|view| view.sightings.len() > 3).unwrap();
            let seen = &mut view.sightings[1].observations;
            let mut pixels: Vec<_> = seen.iter().map(|seen| seen.pixel).collect();
            pixels.shuffle(&mut some);
            seen.iter_mut().zip(pixels).for_each(|(seen, pixel)| seen.pixel = pixel);
        }
        Wrong::Mirrored => {
            for sighting in &mut views[3].sightings {
                sighting.observations.iter_mut().for_each(|s| s.pixel.x = 1599.0 - s.pixel.x);
            }
        }
        Wrong::Endless => {
            for view in [2, 5, 11] {
                views[view].sightings[0].observations[9].pixel.y = 1e300;
            }
        }
        _ => {}
    }
    for sighting in views.iter_mut().flat_map(|view| &mut view.sightings) {
        let all = sighting.observations.clone();
        for seen in &mut sighting.observations {
            match wrong {
                Wrong::Anywhere(part) if some.random_bool(part) => {
                    let size = DVec2::from(SIZE_PX.map(f64::from));
                    seen.pixel = size.map(|side| some.random_range(0.0..side));
                }
                Wrong::Off(part, by) if some.random_bool(part) => {
                    seen.pixel += by;
                }
                Wrong::OneTile(part) if some.random_bool(part) => {
                    let next = all.iter().find(|o| (o.row, o.col) == (seen.row, seen.col + 1));
                    seen.pixel = next.map_or(seen.pixel, |next| next.pixel);
                }
                _ => {}
            }
        }
    }
    views
}

fn of_target(target: &Target) -> Calibration {
    Calibration::new(target.panels.iter().map(|panel| &panel.pose))
}

fn solve(
    model: Model,
    target: &Target,
    wrong: Wrong,
    seed: u64,
) -> Result<Estimate, CalibrationError> {
    of_target(target).camera("", views(model, target, wrong, seed), model).solve()
}

/// Error of the focal length in standard deviations, and its standard deviation, px.
fn focal(found: &Estimate, model: Model) -> (f64, f64) {
    let (truth, fx) = (camera(model).focal_px.x, &found.cameras[0].parameters[0]);
    let sd = fx.sd.unwrap();
    ((fx.value - truth) / sd, sd)
}

/// Number of correct corners called outliers, and number of missed outliers.
fn confused(found: &Estimate, model: Model, target: &Target, seed: u64) -> (usize, usize) {
    let clean = views(model, target, Wrong::Nothing, seed);
    let (mut innocent, mut missed) = (0, 0);
    for view in &found.cameras[0].views {
        let clean = clean.iter().find(|clean| clean.name == view.name).unwrap();
        let clean =
            clean.sightings.iter().flat_map(|s| s.observations.iter().map(move |o| (s.panel, o)));
        for (corner, (panel, clean)) in view.corners.iter().zip(clean) {
            assert_eq!((corner.panel, corner.row, corner.col), (panel, clean.row, clean.col));
            let is_wrong = corner.pixel.distance(clean.pixel) > 10.0 * NOISE_PX;
            innocent += usize::from(corner.outlier && !is_wrong);
            missed += usize::from(!corner.outlier && is_wrong);
        }
    }
    (innocent, missed)
}

const RADTAN: Model = Model::Radtan;
const FISHEYE: Model = Model::KannalaBrandt(4);

/// All faults of a target of one panel, and of several.
const OF_BOARDS: [Wrong; 10] = [
    Wrong::Nothing,
    Wrong::Anywhere(0.2),
    Wrong::Anywhere(0.4),
    Wrong::Off(0.4, DVec2::new(3.0, 0.0)),
    Wrong::Off(0.4, DVec2::new(5.0, 3.0)),
    Wrong::OneTile(0.4),
    Wrong::Permuted,
    Wrong::Mirrored,
    Wrong::Endless,
    Wrong::Zoomed(1.05),
];
const OF_SOLIDS: [Wrong; 4] =
    [Wrong::Displaced(0.6), Wrong::Displaced(1.5), Wrong::Exchanged, Wrong::PanelPermuted];

/// Checks the findings and excluded views for a fault.
fn check_named(found: &Estimate, target: &Target, wrong: Wrong, case: &str) {
    let shared: Vec<&OutlierPattern> =
        found.findings.iter().map(|finding| &finding.pattern).collect();
    let is_solid = target.panels.len() > 1;
    match wrong {
        Wrong::Nothing => {
            assert!(shared.is_empty() && found.excluded.is_empty(), "{case}: {shared:?}");
            assert!(found.outlier_count() <= 1, "{case}: {}", found.outlier_count());
        }
        Wrong::Permuted | Wrong::Mirrored | Wrong::Zoomed(_) if !is_solid => {
            let out: Vec<&str> = found.excluded.iter().map(|out| out.view.as_str()).collect();
            assert_eq!(out, ["03"], "{case}");
        }
        Wrong::Endless => {
            let of_views: Vec<&str> = shared
                .iter()
                .map(|pattern| match pattern {
                    OutlierPattern::OutsideImage { view, .. } => view.as_str(),
                    other => panic!("{case}: {other:?}"),
                })
                .collect();
            assert_eq!(of_views, ["02", "05", "11"], "{case}");
        }
        Wrong::Displaced(mm) => {
            let [
                Finding {
                    pattern: OutlierPattern::Panel { panel, moved: Some(moved) },
                    outliers,
                    corners,
                    is_excluded: true,
                    ..
                },
            ] = found.findings.as_slice()
            else {
                panic!("{case}: {shared:?}")
            };
            assert_eq!(panel.index(), 7, "{case}");
            assert!((moved.by_mm - mm).abs() < 0.05, "{case}: {moved:?}");
            assert!(2 * outliers > *corners, "{case}: {outliers} of {corners}");
            let innocent = found.corners();
            let innocent =
                innocent.filter(|corner| corner.outlier && corner.panel != *panel).count();
            assert!(innocent <= 1, "{case}: {innocent} innocent corners");
        }
        Wrong::Exchanged => {
            let named = panels_named(found);
            assert!(
                !named.is_empty() && named.iter().all(|p| [7, 12].contains(p)),
                "{case}: {named:?}"
            );
        }
        Wrong::PanelPermuted => {
            assert!(
                matches!(shared[..], [OutlierPattern::PanelInView { .. }]),
                "{case}: {shared:?}"
            );
        }
        _ => {}
    }
}

/// Errors of the focal length in standard deviations, and standard deviations relative to those of clean views, for
/// every seed.
fn table(
    model: Model,
    target: &Target,
    faults: &[Wrong],
    seeds: std::ops::Range<u64>,
) -> Vec<(Wrong, Vec<f64>, Vec<f64>)> {
    let clean: Vec<f64> = seeds
        .clone()
        .map(|seed| focal(&solve(model, target, Wrong::Nothing, seed).unwrap(), model).1)
        .collect();
    let of_fault = |&wrong: &Wrong| {
        let (mut errors, mut ratios) = (Vec::new(), Vec::new());
        for (seed, clean) in seeds.clone().zip(&clean) {
            let case = format!("{model}, {}, {wrong:?}, seed {seed}", target.name);
            let found = solve(model, target, wrong, seed).unwrap_or_else(|e| panic!("{case}: {e}"));
            check_named(&found, target, wrong, &case);
            let (error, sd) = focal(&found, model);
            errors.push(error);
            ratios.push(sd / clean);
            if matches!(wrong, Wrong::Anywhere(_)) {
                let (innocent, missed) = confused(&found, model, target, seed);
                assert!(innocent <= 2 && missed <= 2, "{case}: {innocent} {missed}");
            }
        }
        (wrong, errors, ratios)
    };
    faults.iter().map(of_fault).collect()
}

fn check(rows: &[(Wrong, Vec<f64>, Vec<f64>)], most_sigma: f64) {
    for (wrong, errors, ratios) in rows {
        let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
        assert!(worst < most_sigma, "{wrong:?}: {errors:?}");
        // In the worst case half of the corners remain, and fewer in some views.
        let most = match wrong {
            Wrong::Anywhere(part) if *part < 0.3 => 1.3,
            // One seed of twenty ends between the two groups, with a large standard deviation.
            Wrong::Off(..) if ratios.len() > 2 => 30.0,
            _ => 1.8,
        };
        assert!(ratios.iter().all(|ratio| *ratio < most), "{wrong:?}: {ratios:?}");
    }
}

#[test]
fn outliers_are_named_and_do_no_harm() {
    for model in [RADTAN, FISHEYE] {
        check(&table(model, &board(), &OF_BOARDS, 0..2), 3.0);
        check(&table(model, &icosahedron(), &OF_SOLIDS, 0..2), 3.0);
    }
    check(&table(RADTAN, &icosahedron(), &OF_BOARDS, 0..1), 3.0);
}

/// One of 20 seeds may be off by more than 3σ; 1 of 370 is expected from noise.
#[test]
#[ignore = "20 seeds of each fault: minutes"]
fn outliers_over_twenty_seeds() {
    let (board, solid) = (board(), icosahedron());
    let all: Vec<Wrong> = OF_BOARDS.iter().chain(&OF_SOLIDS).copied().collect();
    for (model, target, faults) in [
        (RADTAN, &board, &OF_BOARDS[..]),
        (FISHEYE, &board, &OF_BOARDS[..]),
        (RADTAN, &solid, &all[..]),
    ] {
        let rows = table(model, target, faults, 0..20);
        for (wrong, errors, ratios) in &rows {
            let n = errors.len() as f64;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
            let within = errors.iter().filter(|e| e.abs() <= 3.0).count();
            let ratio = ratios.iter().sum::<f64>() / n;
            let worst = ratios.iter().copied().fold(0.0, f64::max);
            println!(
                "| {model}, {} | {wrong:?} | {rms:.2} | {within} of {n} | {ratio:.2}, at most {worst:.2} |",
                target.name
            );
        }
        check(&rows, 4.0);
    }
}

/// Three cameras around an icosahedron, each with its own views of the same frames.
fn rig(wrong: Wrong, frames: usize, seed: u64) -> (Vec<CameraViews>, Vec<PanelPrior>) {
    let target = icosahedron();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let camera = camera(RADTAN);
    let stated: Vec<Pose> = target.panels.iter().map(|panel| panel.pose.to_pose()).collect();
    let mut panels = stated.clone();
    if let Wrong::Displaced(mm) = wrong {
        panels[7].translation.x += mm;
    }
    let places = places(&camera, &target, frames, &mut rng);
    let views = [0.0, 0.25, -0.25].into_iter().enumerate().map(|(index, turn)| {
        let turn = DQuat::from_rotation_y(turn);
        let views = places.iter().enumerate().map(|(i, place)| {
            // Around a point in front of the first camera.
            let middle = DVec3::new(0.0, 0.0, places[0].translation.z);
            let place = Pose {
                rotation: turn * place.rotation,
                translation: turn * (place.translation - middle) + middle,
            };
            seen(&camera, &target, &panels, &place, &format!("{i:02}"), &mut rng)
        });
        let views = views.filter(|view| !view.sightings.is_empty()).collect();
        CameraViews::new(&format!("c{index}"), views, RADTAN)
    });
    let views = views.collect();
    (views, stated.into_iter().map(PanelPrior::from).collect())
}

fn solve_rig(views: &[CameraViews], panels: &[PanelPrior]) -> Result<Estimate, CalibrationError> {
    views.iter().cloned().fold(Calibration::new(panels.iter().copied()), Calibration::with).solve()
}

#[test]
fn faults_of_a_rig_are_named() {
    let (views, panels) = rig(Wrong::Displaced(0.6), 20, 5);
    let found = solve_rig(&views, &panels).unwrap();
    let [Finding { pattern: OutlierPattern::Panel { panel, moved: Some(moved) }, .. }] =
        found.findings[..]
    else {
        panic!("{:?}", found.findings)
    };
    assert_eq!(panel.index(), 7);
    assert!((moved.by_mm - 0.6).abs() < 0.02, "{moved:?}");
    assert!(found.inlier_rms_px() < 1.1 * NOISE_PX && found.excluded.is_empty());
    // The images of one camera have the names of other frames, without a constant lag.
    let (mut confused, _) = rig(Wrong::Nothing, 20, 5);
    let names: Vec<String> = confused[1].views.iter().map(|view| view.name.clone()).collect();
    confused[1].views.iter_mut().zip(names.iter().rev()).for_each(|(view, name)| {
        view.name.clone_from(name);
    });
    let error = solve_rig(&confused, &panels).unwrap_err();
    assert!(
        matches!(&error, CalibrationError::NotRigid { camera, .. } if camera == "c1"),
        "{error}"
    );
}

/// A camera that is rotated after half of the frames: these are excluded, and no panel is blamed.
#[test]
fn panels_are_not_blamed_for_a_moved_camera() {
    for seed in 0..4 {
        let (mut views, panels) = rig(Wrong::Nothing, 20, seed);
        let late = views[1].views.iter_mut().filter(|view| view.name.as_str() >= "10");
        for seen in late.flat_map(|view| &mut view.sightings).flat_map(|s| &mut s.observations) {
            seen.pixel.x += 15.0;
        }
        let found = solve_rig(&views, &panels).unwrap();
        assert!(found.findings.is_empty(), "seed {seed}: {:?}", found.findings);
        assert!(found.frames.len() >= 10, "seed {seed}: {}", found.frames.len());
    }
}

/// The panels that the findings name; there must be no other findings.
fn panels_named(found: &Estimate) -> Vec<usize> {
    let panels = found.findings.iter().map(|finding| match &finding.pattern {
        OutlierPattern::Panel { panel, .. } => panel.index(),
        other => panic!("{other:?}"),
    });
    panels.collect()
}

/// Panels that look wrong because of two exchanged ones are included again.
#[test]
fn only_exchanged_panels_are_named() {
    for seed in 0..6 {
        let views = views(FISHEYE, &icosahedron(), Wrong::Exchanged, seed);
        let found = solve(FISHEYE, &icosahedron(), Wrong::Exchanged, seed).unwrap();
        let shown =
            |view: &View, panel: &usize| view.sightings.iter().any(|s| s.panel.index() == *panel);
        let mut exchanged = vec![7, 12];
        exchanged.retain(|panel| views.iter().any(|view| shown(view, panel)));
        assert_eq!(panels_named(&found), exchanged, "seed {seed}");
        for out in &found.excluded {
            let view = views.iter().find(|view| view.name == out.view).unwrap();
            let others = view.sightings.iter().filter(|s| !exchanged.contains(&s.panel.index()));
            assert_eq!(others.count(), 0, "seed {seed}: {out:?}");
        }
    }
}

/// Slightly displaced panels do not suggest another lens model.
#[test]
fn displaced_panels_are_not_attributed_to_the_lens() {
    let target = icosahedron();
    for seed in 0..2 {
        let views = views(RADTAN, &target, Wrong::AllDisplaced(0.5), seed);
        let calibration = of_target(&target).camera("", views, RADTAN);
        let said = calibration.explain(&calibration.solve().unwrap());
        let is_of_panels =
            |said: &Diagnosis| matches!(said, Diagnosis::LackOfFit(LackOfFit::Target { .. }));
        let is_of_lens = |said: &Diagnosis| {
            matches!(
                said,
                Diagnosis::LackOfFit(LackOfFit::Lens { .. }) | Diagnosis::Remedied { .. }
            )
        };
        assert!(said.iter().any(is_of_panels), "seed {seed}: {said:?}");
        assert!(!said.iter().any(is_of_lens), "seed {seed}: {said:?}");
    }
}

/// An image taken at another zoom is the only one excluded, and the camera is as accurate as without it.
#[test]
fn a_view_of_another_zoom_is_excluded() {
    for (model, target) in [(RADTAN, board()), (RADTAN, icosahedron()), (FISHEYE, board())] {
        for seed in 0..4 {
            let case = format!("{model}, {}, seed {seed}", target.name);
            let found = solve(model, &target, Wrong::Zoomed(1.05), seed).unwrap();
            let out: Vec<&str> = found.excluded.iter().map(|out| out.view.as_str()).collect();
            assert_eq!(out, ["03"], "{case}");
            assert!(focal(&found, model).0.abs() < 3.5, "{case}: {:?}", focal(&found, model));
        }
    }
}

#[test]
fn a_pose_tolerates_two_fifths_of_wrong_corners() {
    for (wrong, model) in
        [(Wrong::Anywhere(0.4), RADTAN), (Wrong::Off(0.3, DVec2::new(3.0, 0.0)), FISHEYE)]
    {
        let (target, camera) = (board(), camera(model));
        let all = views(model, &target, wrong, 3);
        let clean = views(model, &target, Wrong::Nothing, 3);
        let find = |views: &[View]| {
            of_target(&target).camera("", views.to_vec(), camera.clone()).solve().unwrap()
        };
        for (view, clean) in all.iter().zip(&clean) {
            let of_view = |view: &View| find(std::slice::from_ref(view)).frames[0].clone();
            let (found, truth) = (of_view(view), of_view(clean));
            let [turned, moved] = found.rig_from_target.off(&truth.rig_from_target);
            let sd = |range: std::ops::Range<usize>| {
                found.pose_sd[range].iter().map(|sd| sd * sd).sum::<f64>().sqrt()
            };
            let name = &view.name;
            assert!(turned.length() < 5.0 * sd(0..3), "{wrong:?} {name}: {turned}");
            assert!(moved.length() < 5.0 * sd(3..6), "{wrong:?} {name}: {moved}");
        }
    }
}

/// With the wrong lens model views disagree, but none of them is blamed.
#[test]
fn no_view_is_excluded_for_a_lens_that_does_not_fit() {
    for seed in 0..6 {
        let views = views(FISHEYE, &board(), Wrong::Nothing, seed);
        let found = of_target(&board()).camera("", views, Model::Eucm).solve().unwrap();
        assert!(found.inlier_rms_px() > 1.1 * NOISE_PX, "seed {seed}: {}", found.inlier_rms_px());
        assert!(found.excluded.is_empty(), "seed {seed}: {:?}", found.excluded);
    }
}
