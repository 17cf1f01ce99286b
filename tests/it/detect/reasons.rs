//! An image without labels reports a reason, and a remedy.

use deltille::camera::{Camera, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig, ReasonKind};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::Gray;
use deltille::synth::{Light, Scene, scene_of_sheet};
use deltille::targets::{AprilGridSpec, BoardSpec, CharucoSpec, TagSpec, TargetSpec};
use glam::{DQuat, DVec3};

struct Board {
    detector: Detector,
    scene: Scene,
    centre_mm: DVec3,
    /// Rotation from the frame of the panel, whose z axis points to the viewer, to that of the scene.
    front: DQuat,
}

fn board(grid: GridKind, change: impl Fn(&mut BoardSpec)) -> Board {
    let mut spec = BoardSpec::new(grid, 8, 9, 20.0);
    change(&mut spec);
    made(&TargetSpec::Board(spec))
}

fn made(spec: &TargetSpec) -> Board {
    let family = spec.family().map(|family| Family::shipped(family).unwrap());
    let paper = PaperSpec::default();
    let target = Printing::build("board", spec, family.as_ref(), Some(&paper)).unwrap();
    let detector = Detector::for_target(&target.target, DetectorConfig::default()).unwrap();
    let sheets = target.draw().unwrap().sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let panel = &target.target.panels[0];
    let (centre_mm, front) = (panel.middle_mm(), panel.pose.to_pose().rotation);
    Board { detector, scene, centre_mm, front }
}

impl Board {
    /// Renders a photograph of 800 × 600 px from a distance of `mm`, slightly from the side.
    fn photograph(&self, mm: f64, light: &Light) -> Gray<u8> {
        let eye = self.centre_mm + mm * (self.front * DVec3::new(0.1, -0.2, 0.97));
        let pose = Pose::looking_at(eye, self.centre_mm, self.front * DVec3::Y);
        let image = self.scene.render(&Camera::pinhole(800, 600, 0.9), &pose, light);
        image.map(|v| (v * 255.0 + 0.5) as u8)
    }

    /// Returns the kinds of the reasons for which this board is not found in an image.
    fn not_seen_in(&self, image: &Gray<u8>) -> Vec<ReasonKind> {
        let Detection { grids, reasons, .. } = self.detector.detect(image, "view");
        assert!(grids.iter().all(|grid| grid.panel.is_none()), "it is seen");
        assert!(reasons.iter().all(|reason| !reason.to_string().contains("NaN")), "{reasons:?}");
        reasons.iter().map(|reason| reason.kind).collect()
    }
}

fn light() -> Light {
    Light::default().blur_px(0.7).noise(0.01).seed(5)
}

fn tags(change: impl Fn(&mut TagSpec)) -> Option<TagSpec> {
    let mut tags = TagSpec::default();
    change(&mut tags);
    Some(tags)
}

#[test]
fn bad_light_bad_focus_and_long_distance_are_reported() {
    for kind in [GridKind::Deltille, GridKind::Checker] {
        let board = board(kind, |_| {});
        let why = |mm: f64, light: Light| board.not_seen_in(&board.photograph(mm, &light));
        let dark = light().white(0.008).black(0.002).background(0.004);
        assert_eq!(why(300.0, dark), [ReasonKind::TooDark], "{kind:?}");
        let bright = light().white(9.0).black(2.0).background(3.0);
        assert_eq!(why(300.0, bright), [ReasonKind::Overexposed], "{kind:?}");
        let blurred = light().blur_px(25.0);
        assert_eq!(why(300.0, blurred), [ReasonKind::TooBlurred], "{kind:?}");
        // Tiles of 4.6 and 4.0 px; those of 4.8 px are read on some checkerboards.
        let far_mm = if kind == GridKind::Deltille { 3600.0 } else { 4200.0 };
        assert_eq!(why(far_mm, light()), [ReasonKind::TooSmall], "{kind:?}");
        let nothing = Gray::from_fn(800, 600, |x, y| if x + y < 700 { 40 } else { 220u8 });
        assert_eq!(board.not_seen_in(&nothing), [ReasonKind::NoCorners], "{kind:?}");
    }
}

#[test]
fn another_board_is_reported() {
    let wanted = board(GridKind::Deltille, |_| {});
    let why = |other: Board| wanted.not_seen_in(&other.photograph(400.0, &light()));
    assert_eq!(why(board(GridKind::Checker, |_| {})), [ReasonKind::OtherTiling]);
    assert_eq!(why(board(GridKind::Deltille, |spec| spec.tags = None)), [ReasonKind::NoTags]);
    let other_ids = |spec: &mut BoardSpec| spec.tags = tags(|tags| tags.first_id = 300);
    assert_eq!(why(board(GridKind::Deltille, other_ids)), [ReasonKind::OtherIds]);
    let other_family = |spec: &mut BoardSpec| spec.tags = tags(|t| t.family = "d36h9".to_owned());
    assert_eq!(why(board(GridKind::Deltille, other_family)), [ReasonKind::OtherFamily]);
    let seen = wanted.photograph(400.0, &light());
    let mirrored = Gray::from_fn(seen.width(), seen.height(), |x, y| seen.at(799 - x, y));
    assert_eq!(wanted.not_seen_in(&mirrored), [ReasonKind::Mirrored]);
}

/// The board in an image and the target have the same tags, but different settings: the reason names them.
#[test]
fn settings_with_which_the_tags_fit_are_named() {
    let charuco = |change: &dyn Fn(&mut CharucoSpec)| {
        let mut spec = CharucoSpec::new([7, 6], 22.0, "DICT_5X5_100");
        change(&mut spec);
        TargetSpec::Charuco(spec)
    };
    let board = |change: &dyn Fn(&mut BoardSpec)| {
        let mut spec = BoardSpec::new(GridKind::Deltille, 8, 9, 20.0);
        change(&mut spec);
        TargetSpec::Board(spec)
    };
    let april = |tags, first_id| {
        TargetSpec::AprilGrid(AprilGridSpec { first_id, ..AprilGridSpec::new(tags, 30.0) })
    };
    for (shown, wanted, named) in [
        (charuco(&|of| of.legacy = true), charuco(&|_| {}), "OpenCV's legacy pattern (add "),
        (charuco(&|_| {}), charuco(&|of| of.legacy = true), "OpenCV's current pattern (omit "),
        (
            charuco(&|of| of.squares = [6, 7]),
            charuco(&|_| {}),
            "width and height swapped (6 columns, 7 rows);",
        ),
        (charuco(&|of| of.first_id = 40), charuco(&|_| {}), "with first id 40;"),
        (
            charuco(&|of| of.dictionary = "DICT_APRILTAG_25h9".to_owned()),
            charuco(&|_| {}),
            "with tags of DICT_APRILTAG_25h9;",
        ),
        (
            board(&|of| (of.rows, of.cols) = (9, 8)),
            board(&|_| {}),
            "width and height swapped (8 columns, 9 rows);",
        ),
        (board(&|of| of.tags = tags(|t| t.first_id = 300)), board(&|_| {}), "with first id 300;"),
        (board(&|of| of.tags = tags(|t| t.spacing = 2)), board(&|_| {}), "a tag spacing of 2;"),
        (
            board(&|of| of.tags = tags(|t| t.family = "delTag25h9".to_owned())),
            board(&|of| of.tags = tags(|t| t.family = "d25h9".to_owned())),
            "with tags of delTag25h9;",
        ),
        (april([3, 4], 0), april([4, 3], 0), "width and height swapped (3 columns, 4 rows);"),
        (april([4, 3], 24), april([4, 3], 0), "with first id 24;"),
    ] {
        let image = made(&shown).photograph(400.0, &light());
        let detection = made(&wanted).detector.detect(&image, "view");
        assert!(detection.grids.iter().all(|grid| grid.panel.is_none()), "{named}");
        let said: Vec<String> = detection.reasons.iter().map(ToString::to_string).collect();
        assert!(said.iter().any(|said| said.contains(named)), "{named} {:?}", detection.reasons);
    }
}

/// Blur that leaves corners, but too little of the tags. The reason is never "no tag is seen".
#[test]
fn unreadable_tags_are_not_reported_as_missing() {
    let board = board(GridKind::Deltille, |_| {});
    let mut unread = 0;
    for mm in [2000.0, 2100.0, 2200.0, 2300.0] {
        for blur_px in [0.7, 1.0, 1.3, 1.6, 2.0] {
            let image = board.photograph(mm, &light().blur_px(blur_px));
            let Detection { grids, reasons, .. } = board.detector.detect(&image, "view");
            if grids.is_empty() || grids.iter().any(|grid| grid.panel.is_some()) {
                continue;
            }
            let kinds: Vec<ReasonKind> = reasons.iter().map(|reason| reason.kind).collect();
            assert_eq!(kinds, [ReasonKind::UnreadableTags], "{mm} mm, {blur_px} px: {reasons:?}");
            unread += 1;
        }
    }
    assert!(unread > 2, "{unread}");
}
