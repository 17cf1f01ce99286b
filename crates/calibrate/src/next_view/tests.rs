use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec2, DVec3};

use crate::{
    Calibration, Guide, Guided, HoldStatus, HoldTracker, Model, NextView, Observation, PanelRef,
    ProposedCorner, Reference, Sighting, Source, UncertaintyMap, View,
};
use deltille_core::camera::{BrownConrady, Camera, Lens, Pose};
use deltille_core::lattice::GridKind;
use deltille_core::targets::{BoardSpec, SolidShape, SolidSpec, Target, TargetSpec};

fn board() -> Target {
    Target::new("board", BoardSpec::deltille(8, 10, 20.0)).unwrap()
}

fn truth() -> Camera {
    let lens = BrownConrady { radial: [-0.15, 0.04, 0.0], ..BrownConrady::default() };
    Camera::centred(1280, 960, 1150.0, Lens::BrownConrady(lens))
}

/// A view of the proposed corners with the board moved about its centre; the corners have a fixed error of about 0.05
/// px.
fn held(target: &Target, next: &NextView, moved: Pose, index: usize) -> View {
    let camera = truth();
    let pose = moved.after(&next.camera_from_target);
    let mut sightings: Vec<Sighting> = Vec::new();
    let mut state = index as u64 * 7919 + 1;
    let mut noise = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 0.17
    };
    for (panel, of) in target.panels.iter().enumerate() {
        let mut observations = Vec::new();
        let proposed = next.corners.iter().filter(|corner| corner.panel.index() == panel);
        for corner in proposed {
            let place = of.corners.iter().find(|c| (c.row, c.col) == (corner.row, corner.col));
            let place = place.unwrap();
            let pixel = camera.project(pose.apply(place.target_mm)).unwrap();
            let pixel = pixel + DVec2::new(noise(), noise());
            let panel_mm = place.panel_mm.extend(0.0);
            let cov = Some([0.0025, 0.0, 0.0025]);
            observations.push(Observation {
                row: corner.row,
                col: corner.col,
                panel_mm,
                pixel,
                cov,
            });
        }
        if !observations.is_empty() {
            sightings.push(Sighting { panel: PanelRef::new(panel, of.id), observations });
        }
    }
    let name = index.to_string();
    View { name, image: String::new(), size_px: [1280, 960], sightings }
}

/// The error of a person: a few degrees and a hundredth of the distance, different each time.
fn hand(next: &NextView, index: usize) -> Pose {
    let turn = DVec3::new(0.05, -0.03, 0.04) * if index.is_multiple_of(2) { 1.0 } else { -1.0 };
    let rotation = DQuat::from_scaled_axis(turn);
    let middle = next.camera_from_target.translation;
    Pose { rotation, translation: middle - rotation * middle + 0.01 * next.distance_mm }
}

fn guided(count: usize, with: impl Fn(Guide) -> Guide) -> (Vec<View>, Vec<NextView>, Guided) {
    let target = board();
    let guide = with(Guide::new(&target, [1280, 960], Model::Radtan).unwrap());
    let reference = Reference::Target(&target);
    let (mut views, mut proposed) = (Vec::new(), vec![guide.next(0, None)]);
    loop {
        let next = proposed.last().unwrap();
        views.push(held(&target, next, hand(next, views.len()), views.len()));
        let after = guide.after(&reference, &views);
        if views.len() == count {
            return (views, proposed, after);
        }
        proposed.push(after.next);
    }
}

#[test]
fn a_view_reduces_the_uncertainty_as_predicted() {
    let (_, proposed, last) = guided(9, |guide| guide);
    assert!(proposed[..3].iter().all(|next| next.expected_px.is_none()), "no camera yet");
    let ends = proposed[4..].iter().zip(proposed[5..].iter().chain([&last.next]));
    for (view, after) in ends {
        let (expected, came) = (view.expected_px.unwrap(), after.now_px.unwrap());
        assert!(expected < view.now_px.unwrap(), "a proposed view adds information");
        assert!((came / expected - 1.0).abs() < 0.25, "expected {expected}, came {came}");
    }
}

#[test]
fn the_uncertainty_equals_that_of_the_map() {
    let (_, _, last) = guided(8, |guide| guide);
    let estimate = last.estimate.unwrap();
    let map: UncertaintyMap =
        estimate.cameras[0].uncertainty_map(None, Source::Noise).expect("a map");
    let place = |index: usize| {
        let at = DVec2::new((index % map.columns) as f64, (index / map.columns) as f64) + 0.5;
        let parts = DVec2::new(map.columns as f64, map.rows as f64);
        let pixel = at * DVec2::new(1280.0, 960.0) / parts - 0.5;
        let [[xx, _], [_, yy]] =
            estimate.cameras[0].projection_covariance(pixel, None, Source::Noise).unwrap();
        0.5 * (xx + yy)
    };
    let count = map.columns * map.rows;
    let over_image = ((0..count).map(place).sum::<f64>() / count as f64).sqrt();
    let now = last.next.now_px.unwrap();
    // Here, all corners have equal weight in the alignment; in the estimate, they are weighted by
    // covariance.
    assert!((now / over_image - 1.0).abs() < 0.05, "{now} {over_image}");
}

#[test]
fn proposed_corners_are_found_and_poses_match_their_description() {
    let (_, proposed, _) = guided(8, |guide| guide);
    let target = board();
    for next in &proposed {
        assert!(next.corners.len() * 2 >= target.panels[0].corners.len(), "{next}");
        let middle = next.camera_from_target.apply(target.panels[0].middle_mm());
        assert!((middle.length() - next.distance_mm).abs() < 1e-6);
        let normal = next.camera_from_target.rotation * DVec3::Z;
        let tilt = (-normal.dot(middle.normalize())).acos();
        assert!((tilt - next.tilt_rad).abs() < 1e-6, "{tilt} {}", next.tilt_rad);
        let pixel = next.camera.project(middle).unwrap();
        assert!(((pixel + 0.5) / DVec2::new(1280.0, 960.0)).distance(next.at) < 1e-6);
        for corner in &next.corners {
            let place = target.panels[0].corners.iter();
            let place = place.clone().find(|c| (c.row, c.col) == (corner.row, corner.col)).unwrap();
            let at = next.camera.project(next.camera_from_target.apply(place.target_mm)).unwrap();
            assert!(at.distance(corner.pixel) < 1e-9);
            assert!(corner.pixel.min_element() > 0.0 && corner.pixel.x < 1279.0);
        }
        // The side described as farther away is farther away.
        if next.tilt_rad > 0.2 {
            let depth = |corner: &ProposedCorner| {
                let places = &target.panels[0].corners;
                let place = places.iter().find(|c| (c.row, c.col) == (corner.row, corner.col));
                next.camera_from_target.apply(place.unwrap().target_mm).length()
            };
            let away = DVec2::from_angle(next.tilt_direction_rad);
            let along = |c: &&ProposedCorner| away.dot(c.pixel);
            let far = next.corners.iter().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
            let near = next.corners.iter().min_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
            assert!(depth(far) > depth(near), "{next}");
        }
    }
}

#[test]
fn refused_views_are_not_proposed_again() {
    let (_, _, last) = guided(6, |guide| guide);
    let estimate = last.estimate.unwrap();
    let guide = Guide::new(&board(), [1280, 960], Model::Radtan).unwrap();
    let mut refused = vec![last.next];
    for _ in 0..4 {
        let next = guide.clone().avoiding(&refused).next(6, Some(&estimate));
        let is_known = |before: &NextView| {
            let turn = next.camera_from_target.off(&before.camera_from_target)[0].length();
            turn < 0.2
                && next.at.distance(before.at) < 0.1
                && next.distance_mm == before.distance_mm
        };
        assert!(!refused.iter().any(is_known), "{next}");
        assert!(next.expected_px.unwrap() >= refused[0].expected_px.unwrap());
        refused.push(next);
    }
    let first = guide.next(0, None);
    assert!(guide.avoiding([&first]).next(0, None).tilt_rad > 0.5, "the first set goes on");
}

#[test]
fn proposals_stay_within_the_distances() {
    let (_, proposed, _) = guided(8, |guide| guide.within_mm(Some(280.0), Some(420.0)));
    for next in &proposed {
        assert!((280.0..=420.0).contains(&next.distance_mm), "{next}");
    }
}

#[test]
fn it_ends_when_a_view_gains_little_or_the_limit_is_reached() {
    let (_, _, few) = guided(5, |guide| guide);
    assert!(!few.next.is_enough(None), "{:?}", few.next.gain());
    let (_, _, many) = guided(26, |guide| guide);
    assert!(many.next.is_enough(None), "{:?}", many.next.gain());
    let now = many.next.now_px.unwrap();
    assert!(many.next.is_enough(Some(1.01 * now)) && !many.next.is_enough(Some(0.99 * now)));
    assert!(now < few.next.now_px.unwrap());
}

#[test]
fn an_unknown_board_shape_enters_the_choice_of_views() {
    let (views, ..) = guided(10, |guide| guide);
    let target = board();
    let panels = || Reference::Target(&target).panels();
    let solve = |shape: bool| {
        let calibration = Calibration::new(panels()).board_shape(shape);
        calibration.camera("camera", views.clone(), Model::Radtan).solve().unwrap()
    };
    let guide = Guide::new(&target, [1280, 960], Model::Radtan).unwrap();
    let [flat, bent] = [false, true].map(|shape| guide.next(10, Some(&solve(shape))));
    let (flat, bent) = (flat.now_px.unwrap(), bent.now_px.unwrap());
    assert!(bent > 1.02 * flat, "an unknown shape increases the uncertainty: {flat} {bent}");
}

#[test]
fn a_solid_shows_several_faces_and_untagged_boards_are_whole() {
    let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
    let family = spec_family(&spec);
    let solid = Target::build("solid", &spec, family.as_ref()).unwrap();
    let next = Guide::new(&solid, [1280, 960], Model::Radtan).unwrap().next(0, None);
    let panels: std::collections::BTreeSet<PanelRef> =
        next.corners.iter().map(|c| c.panel).collect();
    assert!(panels.len() > 3 && panels.len() < 11, "{}", panels.len());

    let plain = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Checker, 6, 9, 25.0) };
    let plain = Target::new("plain", plain).unwrap();
    let guide = Guide::new(&plain, [1280, 960], Model::Radtan).unwrap();
    let reference = Reference::Target(&plain);
    let (mut views, mut next) = (Vec::new(), guide.next(0, None));
    for index in 0..6 {
        assert_eq!(next.corners.len(), 54, "{next}");
        views.push(held(&plain, &next, hand(&next, index), index));
        next = guide.after(&reference, &views).next;
    }
    assert!(next.now_px.is_some());
}

fn spec_family(spec: &TargetSpec) -> Option<deltille_core::family::Family> {
    match spec {
        TargetSpec::Solid(_) => {
            spec.family().and_then(|name| deltille_core::family::Family::shipped(name).ok())
        }
        _ => None,
    }
}

#[test]
fn the_sentence_states_position_and_tilt() {
    let mut next = Guide::new(&board(), [1280, 960], Model::Radtan).unwrap().next(0, None);
    let said = next.to_string();
    assert!(said.starts_with("hold the board in the middle of the image, about "), "{said}");
    assert!(said.ends_with("facing the camera"), "{said}");
    next.at = DVec2::new(0.9, 0.1);
    next.tilt_rad = 0.7;
    next.tilt_direction_rad = PI;
    next.roll_rad = FRAC_PI_2;
    next.distance_mm = 612.0;
    assert_eq!(
        next.to_string(),
        "hold the board in the upper right corner of the image, about 60 cm away, with its left side tilted away by 40°, \
         rotated counterclockwise by 90°"
    );
    next.at = DVec2::new(0.5, 0.9);
    next.roll_rad = PI;
    next.distance_mm = 2345.0;
    assert_eq!(
        next.to_string(),
        "hold the board at the lower edge of the image, about 2.3 m away, with its left side tilted away by 40°, upside down"
    );
}

#[test]
fn an_image_is_taken_when_the_board_is_in_place_still_and_sharp() {
    let target = board();
    let guide = Guide::new(&target, [1280, 960], truth()).unwrap();
    let next = guide.next(1, None);
    let panels = || [Pose::IDENTITY];
    let shifted = |mm: f64| Pose { translation: DVec3::new(mm, 0.0, 0.0), ..Pose::IDENTITY };
    let view = |moved: Pose| held(&target, &next, moved, 1);
    let there = view(shifted(0.0));
    let mut holding = HoldTracker::new(&next, panels());
    assert_eq!(holding.observe(0.0, None, None), HoldStatus::Unseen);
    assert!(matches!(
        holding.observe(0.1, Some(&view(shifted(150.0))), None),
        HoldStatus::Elsewhere { .. }
    ));
    // A motion of 8 mm in a tenth of a second is 2 px of smear at 30 frames per second.
    assert!(matches!(
        holding.observe(0.2, Some(&view(shifted(8.0))), None),
        HoldStatus::Moving { .. }
    ));
    assert!(
        matches!(holding.observe(0.3, Some(&there), None), HoldStatus::Moving { smear_px } if smear_px > 1.0)
    );
    assert_eq!(holding.observe(0.4, Some(&there), None), HoldStatus::Steady { part: 0.0 });
    assert!(
        matches!(holding.observe(0.6, Some(&there), None), HoldStatus::Steady { part } if part > 0.4)
    );
    assert_eq!(holding.observe(0.81, Some(&there), None), HoldStatus::Taken);
    // A blurred image restarts the holding time.
    assert_eq!(holding.observe(0.9, Some(&there), Some(5.0)), HoldStatus::Blurred);
    assert_eq!(holding.observe(1.0, Some(&there), Some(1.0)), HoldStatus::Steady { part: 0.0 });
    let mut smeared = there.clone();
    for seen in &mut smeared.sightings[0].observations {
        seen.cov = Some([0.09, 0.0, 0.01]);
    }
    assert_eq!(holding.observe(1.1, Some(&smeared), None), HoldStatus::Blurred);
    // A board facing the camera differs from one tilted by 40°.
    let middle = next.camera_from_target.apply(target.panels[0].middle_mm());
    let back = DQuat::from_axis_angle(
        DVec3::Y,
        if next.tilt_direction_rad.cos() > 0.0 { 0.6 } else { -0.6 },
    );
    let facing = Pose { rotation: back, translation: middle - back * middle };
    let held = holding.observe(1.2, Some(&view(facing)), None);
    assert!(matches!(held, HoldStatus::Turned { off_rad } if off_rad > 0.4), "{held:?}");
    // After a pause the motion is not known.
    assert!(matches!(holding.observe(9.0, Some(&there), None), HoldStatus::Moving { .. }));
}
