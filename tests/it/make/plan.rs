//! `deltille plan`: proposed boards, and whether they are detected at the stated distances.

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::camera::{BrownConrady, Camera, Lens, Pose};
use deltille::detect::{Detector, DetectorConfig};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::layout::{Reach, Situation};
use deltille::synth::{Light, scene_of_target};
use deltille::targets::{BoardSpec, TagSpec, Target};
use deltille_lab::photographs::photograph::take;
use deltille_lab::photographs::scene::Scene;
use deltille_lab::photographs::world::background::Studio;
use deltille_lab::photographs::world::page::PrintedPage;
use glam::DVec3;

#[test]
fn proposed_boards_can_be_generated() {
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
        deltille(at, &format!("{command} --no-verify --force")).success();
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

/// Plans boards with tags and of known size, and returns how many of six views are labelled at each of these fractions of
/// the stated distance.
fn labelled_at<const N: usize>(fractions: [f64; N]) -> Vec<(String, bool, [usize; N])> {
    let family = Family::shipped("delTag25h7").unwrap();
    let tags = || Some((TagSpec::default(), &family));
    let mut found = Vec::new();
    for (kind, tags) in
        [(GridKind::Deltille, tags()), (GridKind::Deltille, None), (GridKind::Checker, None)]
    {
        let situation = Situation {
            focal_px: 700.0,
            size_px: [800, 600],
            distances_mm: [400.0, 1500.0],
            tilt_rad: 0.785,
        };
        let board = situation.board(kind, tags, &PaperSpec::default()).unwrap().spec;
        let target = Target::new("plan", board).unwrap();
        let reach = Reach::of(&target).unwrap();
        for tilt_deg in [0.0f64, 30.0, 45.0, 60.0] {
            let limit = reach.labelled_to_mm(situation.focal_px, tilt_deg.to_radians());
            let counts = fractions.map(|fraction| labelled(&target, tilt_deg, fraction * limit));
            let what = format!("{kind:?}, {} tags, {tilt_deg}°, {limit:.0} mm", reach.tags);
            found.push((what, reach.tags > 0, counts));
        }
    }
    found
}

/// A tenth closer than stated, boards are labelled; a fifth farther away, at most half of them are. The views are
/// synthetic and blurred like sharp photographs.
#[test]
fn boards_are_labelled_up_to_the_stated_distance() {
    for (what, has_tags, [near, far]) in labelled_at([0.9, 1.2]) {
        assert!(near >= if has_tags { 6 } else { 5 }, "{what}: a tenth nearer {near} of 6");
        assert!(!has_tags || far <= 3, "{what}: a fifth farther {far} of 6");
    }
}

/// Prints how many of six views are labelled, by fraction of the stated distance and tilt, for docs/benchmarks.md:
/// `cargo test --release --test it -- --ignored --nocapture photographs_of_boards`.
#[test]
#[ignore = "prints a table"]
fn photographs_of_boards() {
    for (what, _, counts) in labelled_at([0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6]) {
        println!("{what}: {counts:?} of 6");
    }
}

/// Images of a printed board of position codes in which about twelve whole tiles are visible and nothing else.
struct Windows {
    page: PrintedPage,
    studio: Studio,
    detector: Detector,
}

impl Windows {
    const VIEWS: u64 = 24;

    /// Side of the image, in tile edges: a square of (4.3 − 1)² edges contains the middles of twelve tiles.
    const SIDE_EDGES: f64 = 4.3;

    fn new() -> Self {
        let spec = BoardSpec { tags: Some(TagSpec::dense()), ..BoardSpec::deltille(12, 12, 20.0) };
        let board = Printing::new("board", spec).unwrap();
        let detector = Detector::for_target(&board.target, DetectorConfig::default()).unwrap();
        Self { page: PrintedPage::new(&board).unwrap(), studio: Studio::new(1), detector }
    }

    /// Counts the images that are labelled, with cells of `bit_px` px in the area that the tilt leaves them.
    fn labelled(&self, bit_px: f64, tilt_deg: f64) -> usize {
        let upright_px = bit_px / tilt_deg.to_radians().cos().sqrt();
        let edge_px = self.page.edge_mm / self.page.bit_mm * bit_px;
        let side = (Self::SIDE_EDGES * edge_px + 8.0) as usize;
        let scene = Scene {
            bit_px: upright_px,
            tilt_deg: Some(tilt_deg),
            size_px: [side; 2],
            ..Scene::default()
        };
        let is_labelled = |view: &u64| {
            let picture = take(&self.page, &self.studio, &scene, *view).image;
            let found = self.detector.detect(&picture, "view");
            found.grids.iter().any(|grid| grid.corners.iter().any(|corner| corner.id.is_some()))
        };
        (0..Self::VIEWS).filter(is_labelled).count()
    }
}

/// The same for patches of boards with position codes: a tenth closer than stated, at least half of them are labelled; a
/// third farther away, at most half.
#[test]
fn patches_of_dense_boards_are_labelled_up_to_the_stated_distance() {
    let family = Family::shipped("dense9").unwrap();
    let situation = Situation {
        focal_px: 700.0,
        size_px: [800, 600],
        distances_mm: [200.0, 600.0],
        tilt_rad: 0.785,
    };
    let tags = Some((TagSpec::dense(), &family));
    let plan = situation.board(GridKind::Deltille, tags, &PaperSpec::default()).unwrap();
    let windows = Windows::new();
    for tilt_deg in [0.0f64, 45.0, 60.0] {
        let limit_mm = plan.patches_to_mm(situation.focal_px, tilt_deg.to_radians()).unwrap();
        let shortened = tilt_deg.to_radians().cos().sqrt();
        let bit_px = situation.focal_px * plan.reach.detail_mm * shortened / limit_mm;
        let most = windows.labelled(3.0, tilt_deg);
        let [near, far] = [0.9, 1.33].map(|part| windows.labelled(bit_px / part, tilt_deg));
        let what = format!(
            "{tilt_deg}°: {most} of large cells, {near} a tenth nearer, {far} a third farther"
        );
        assert!(2 * near >= most && 2 * far <= most, "{what}");
    }
}

/// Prints how many patches are labelled, by cell size and tilt, for docs/benchmarks.md: `cargo test --release
/// --test it -- --ignored --nocapture photographs_of_patches`.
#[test]
#[ignore = "prints a table"]
fn photographs_of_patches() {
    let windows = Windows::new();
    for tilt_deg in [0.0, 45.0, 60.0] {
        for bit_px in [0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2.0, 3.0] {
            let labelled = windows.labelled(bit_px, tilt_deg);
            println!("{tilt_deg}°, {bit_px} px a cell: {labelled} of {}", Windows::VIEWS);
        }
    }
}

/// Counts how many of six views at a distance, tilted in six directions, are labelled.
fn labelled(target: &Target, tilt_deg: f64, distance: f64) -> usize {
    let detector = Detector::for_target(target, DetectorConfig::default()).unwrap();
    let scene = scene_of_target(target).unwrap();
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
