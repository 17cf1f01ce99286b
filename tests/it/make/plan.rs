//! `deltille plan`: boards that are proposed, and whether they are seen from where it says.

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detector, DetectorConfig, Reach, Situation};
use deltille::experiment::photographs::background::Studio;
use deltille::experiment::photographs::page::PrintedPage;
use deltille::experiment::photographs::photograph::take;
use deltille::experiment::photographs::scene::Scene;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{BoardSpec, PaperSpec, TagSpec, Target, TargetSpec};
use glam::DVec3;

#[test]
fn boards_are_proposed_and_made() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "--size 1920x1080 --fov 62 --distance 50cm..3m",
        "--size 640x480 --distance 0.3..1m --checker",
        "--size 4000x3000 --fov 80 --distance 0.5..2m --tilt 60 --family d36h11 --paper A2",
        "--size 1280x960 --distance 20cm..60cm --untagged",
        "--size 1920x1080 --distance 1..5m --checker --family t36h11",
        "--size 1920x1080 --fov 62 --distance 50cm..2m --dense",
    ] {
        let output = page.run(at, &format!("deltille plan {arguments}"));
        let said = String::from_utf8(output.stdout).unwrap();
        let command = said.lines().find_map(|line| line.strip_prefix("deltille ")).unwrap();
        deltille(at, &format!("{command} --no-verify")).success();
    }
    for arguments in [
        "--size 640x480 --fov 20 --distance 1m..300m",
        "--size 640x480 --distance 5..20m --paper A4",
        "--size 640 --distance 1..2m",
        "--size 640x480 --distance 2..1m",
        "--size 640x480 --distance 1",
        "--distance 1..2m",
        "--size 640x480 --distance 1..2m --family aprilTag36h11",
        "--size 640x480 --distance 1..2m --family nobody",
        "--size 640x480 --distance 1..2m --dense --checker",
    ] {
        page.refused(at, &format!("deltille plan {arguments}"));
    }
    page.is("plan");
}

/// A tenth nearer than it says boards are labelled, a tenth farther at most half of them: views by the synthesiser, blurred as
/// sharp pictures are.
#[test]
fn boards_are_labelled_as_far_as_is_said() {
    let family = Family::shipped("delTag25h7").unwrap();
    let tags = || Some((TagSpec::default(), &family));
    for (kind, tags) in
        [(GridKind::Deltille, tags()), (GridKind::Deltille, None), (GridKind::Checker, None)]
    {
        let situation = Situation {
            focal_px: 700.0,
            size_px: [800, 600],
            distances_mm: [400.0, 1500.0],
            tilt_rad: 0.785,
        };
        let family = tags.as_ref().map(|(_, family)| *family);
        let board = situation.board(kind, tags, &PaperSpec::default()).unwrap().spec;
        let target = Target::build("plan", &TargetSpec::Board(board), family, None).unwrap();
        let reach = Reach::of(&target, family);
        for tilt_deg in [0.0f64, 30.0, 45.0, 60.0] {
            let limit = reach.labelled_to_mm(situation.focal_px, tilt_deg.to_radians());
            let [near, far] =
                [0.9, 1.1].map(|part| labelled(&target, family, tilt_deg, part * limit));
            let what = format!("{kind:?}, {} tags, {tilt_deg}°, {limit:.0} mm", reach.tags);
            let least = if reach.tags > 0 { 6 } else { 5 };
            assert!(near >= least, "{what}: a tenth nearer {near} of 6 are labelled");
            assert!(reach.tags == 0 || far <= 3, "{what}: a tenth farther {far} of 6");
        }
    }
}

/// The same of patches of boards with place codes: three by four tiles, which are a board by themselves here.
#[test]
fn patches_of_dense_boards_are_labelled_as_far_as_is_said() {
    let family = Family::shipped("dense9").unwrap();
    let situation = Situation {
        focal_px: 700.0,
        size_px: [800, 600],
        distances_mm: [200.0, 600.0],
        tilt_rad: 0.785,
    };
    let tags = Some((TagSpec::dense(), &family));
    let plan = situation.board(GridKind::Deltille, tags, &PaperSpec::default()).unwrap();
    let spec = BoardSpec { rows: 4, cols: 5, board_id: 77, ..plan.spec.clone() };
    let patch = Target::build("patch", &TargetSpec::Board(spec), Some(&family), None).unwrap();
    for tilt_deg in [0.0f64, 45.0, 60.0] {
        let limit = plan.patches_to_mm(situation.focal_px, tilt_deg.to_radians()).unwrap();
        let [near, far] =
            [0.9, 1.1].map(|part| labelled(&patch, Some(&family), tilt_deg, part * limit));
        assert!(near >= 5 && far <= 4, "{tilt_deg}°, {limit:.0} mm: {near} nearer, {far} farther");
    }
}

/// Prints how many of photographs of printed patches are labelled, by the size of a cell in px and the tilt, for
/// docs/measurements.md: `cargo test --release --test it -- --ignored --nocapture photographs_of_patches`.
#[test]
#[ignore = "minutes; prints a table"]
fn photographs_of_patches() {
    const VIEWS: u64 = 20;
    let family = Family::shipped("dense9").unwrap();
    let spec =
        BoardSpec { board_id: 77, tags: Some(TagSpec::dense()), ..BoardSpec::deltille(4, 5, 20.0) };
    let paper = PaperSpec::default();
    let patch =
        Target::build("patch", &TargetSpec::Board(spec), Some(&family), Some(&paper)).unwrap();
    let page = PrintedPage::new(&patch, Some(&family)).unwrap();
    let (studio, detector) =
        (Studio::new(1), Detector::for_target(&patch, Some(&family), DetectorConfig::default()));
    for tilt_deg in [0.0, 45.0, 60.0] {
        for bit_px in [1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.2] {
            // Tilted cells keep their area.
            let across_px = bit_px / f64::to_radians(tilt_deg).cos().sqrt();
            let scene = Scene { bit_px: across_px, tilt_deg: Some(tilt_deg), ..Scene::default() };
            let is_labelled = |view: &u64| {
                let found = detector.detect(&take(&page, &studio, &scene, *view).image, "view");
                found.grids.iter().any(|grid| grid.corners.iter().any(|corner| corner.id.is_some()))
            };
            let labelled = (0..VIEWS).filter(is_labelled).count();
            println!("{tilt_deg}°, {bit_px} px a cell: {labelled} of {VIEWS}");
        }
    }
}

/// How many of six views from a distance, tilted to six sides, are labelled.
fn labelled(target: &Target, family: Option<&Family>, tilt_deg: f64, distance: f64) -> usize {
    let detector = Detector::for_target(target, family, DetectorConfig::default());
    let scene = scene_of_target(target, family).unwrap();
    let middle = target.panels[0].middle_mm();
    let tilt = tilt_deg.to_radians();
    let views = (0..6u64).filter(|&view| {
        let way = view as f64 * 1.05 + 0.2;
        let aside = DVec3::new(tilt.sin() * way.cos(), tilt.sin() * way.sin(), tilt.cos());
        let pose = Pose::looking_at(middle + distance * aside, middle, DVec3::new(0.1, 1.0, 0.0));
        let light = Light::default().blur_px(0.7).noise(0.005).seed(view);
        let lens = Lens::BrownConrady(BrownConrady::default());
        let image = scene.render(&Camera::centred(800, 600, 700.0, lens), &pose, &light);
        let found = detector.detect(&image.map(|grey| (255.0 * grey + 0.5) as u8), "view");
        found.grids.iter().any(|grid| grid.corners.iter().any(|corner| corner.id.is_some()))
    });
    views.count()
}
