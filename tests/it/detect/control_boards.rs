//! Boards other than the target get no label: other ids, other families, mirrored, random tiles and other spacings, in
//! views that degrade their tags.
//!
//! Ten thousand of them: `cargo test --release --test it detect::control_boards -- --ignored --nocapture`.

use crate::common::view::tilted;
use deltille::camera::Camera;
use deltille::detect::{Detector, DetectorConfig};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::{Gray, gaussian};
use deltille::synth::{Light, Scene, scene_of_sheet};
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EDGE_MM: f64 = 20.0;

/// Families of the target.
const FAMILIES: [&str; 6] = ["delTag25h7", "d16h5", "d25h7", "d36h9", "d36h11", "delTag36h11"];

/// Boards shown instead of the target.
const CONTROLS: [&str; 5] =
    ["other ids", "another family", "mirrored", "random tiles", "another spacing"];

struct Board {
    target: Target,
    scene: Scene,
    centre_mm: DVec3,
    /// Length of a tag bit.
    bit_mm: f64,
}

fn board(family: &Family, first_id: u32, spacing: u32, cols: u32) -> Board {
    let tags =
        TagSpec { family: family.name().to_owned(), first_id, spacing, ..TagSpec::default() };
    let bits_across = f64::from(family.dimension().rows()) + 3.0 * tags.border_bits;
    let plain = BoardSpec::new(GridKind::Deltille, 8, cols, EDGE_MM);
    let spec = TargetSpec::Board(BoardSpec { tags: Some(tags), ..plain });
    let target =
        Printing::build("board", &spec, Some(family), Some(&PaperSpec::default())).unwrap();
    let sheets = target.draw().unwrap().sheets;
    let scene = scene_of_sheet(&target, &sheets[0], 0);
    let centre_mm = target.target.panels[0].middle_mm();
    Board { target: target.target, scene, centre_mm, bit_mm: EDGE_MM / bits_across }
}

/// A family with the same number of bits, and random codes.
fn random_family(like: &Family, rng: &mut ChaCha8Rng) -> Family {
    let mask = like.dimension().mask();
    // With few bits, some random codes are occasionally equal, possibly after a rotation. These
    // codes are not a valid family.
    loop {
        let codes = (0..60).map(|_| rng.random::<u64>() & mask).collect();
        let (rules, construction) = (like.rules().clone(), like.construction().clone());
        let family = Family::new("random", like.dimension(), 1, codes, rules, construction);
        if let Ok(family) = family {
            return family;
        }
    }
}

fn flopped(image: &Gray<f32>) -> Gray<f32> {
    let width = image.width();
    Gray::from_fn(width, image.height(), |x, y| image.at(width - 1 - x, y))
}

/// Labels of control boards, one per line.
fn labelled(boards: u64) -> Vec<String> {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut lines = Vec::new();
    for seed in 0..boards {
        let family = Family::shipped(FAMILIES[seed as usize % FAMILIES.len()]).unwrap();
        let control = CONTROLS[(seed as usize / FAMILIES.len()) % CONTROLS.len()];
        let asked = board(&family, 0, 3, 9);
        let tags = asked.target.panels[0].tags.len() as u32;
        let shown = match control {
            "other ids" => {
                board(&family, tags + rng.random_range(0..family.len() as u32 - 2 * tags), 3, 9)
            }
            "another family" => {
                let others = FAMILIES.iter().filter(|&&name| name != family.name());
                let other = others.clone().nth(rng.random_range(0..FAMILIES.len() - 1)).unwrap();
                board(&Family::shipped(other).unwrap(), 0, 3, 9)
            }
            "random tiles" => board(&random_family(&family, &mut rng), 0, 3, 9),
            "another spacing" => board(&family, 0, if rng.random() { 2 } else { 4 }, 9),
            _ => board(&family, 0, 3, 9),
        };
        let camera = Camera::pinhole(640, 480, 0.5);
        let bit_px: f64 = rng.random_range(1.2..5.0);
        let distance_mm = camera.focal_px.x * shown.bit_mm / bit_px;
        let tilt = rng.random_range(0.0..1.0);
        let pose = tilted(&mut rng, shown.centre_mm, distance_mm, tilt);
        let light = Light::default().noise(rng.random_range(0.002..0.03)).seed(seed);
        let mut image = shown.scene.render(&camera, &pose, &light);
        if control == "mirrored" {
            image = flopped(&image);
        }
        let image = gaussian(&image, rng.random_range(0.1..0.6) * bit_px);
        let exposure = if rng.random_bool(0.2) { 3.0 } else { 1.0 };
        let image = image.map(|v| (exposure * v.clamp(0.0, 1.0) * 255.0 + 0.5).min(255.0) as u8);
        let detector = Detector::for_target(&asked.target, DetectorConfig::default()).unwrap();
        let found = detector.detect(&image, "control");
        let ids = found.grids.iter().flat_map(|g| &g.corners).filter(|c| c.id.is_some()).count();
        if ids > 0 {
            let tags: usize = found.grids.iter().map(|g| g.tags.len()).sum();
            let name = family.name();
            lines.push(format!(
                "{seed}: {control} for {name} at {bit_px:.1} px a bit: {ids} labels by {tags} tags"
            ));
        }
    }
    lines
}

#[test]
fn control_boards_get_no_labels() {
    let lines = labelled(60);
    assert!(lines.is_empty(), "{}", lines.join("\n"));
}

#[test]
#[ignore = "half an hour"]
fn ten_thousand_control_boards_get_no_labels() {
    let lines = labelled(10_000);
    println!("{} of 10,000 control boards are labelled\n{}", lines.len(), lines.join("\n"));
    assert!(lines.is_empty());
}
