//! Tagged boards under degradations of photographs: small tags, covers, light, motion, compression.
//!
//! Rates over many seeds: `cargo test --release --test it detect::hard -- --ignored --nocapture`.

use std::collections::BTreeMap;

use crate::common::view::tilted;
use deltille::camera::{Camera, Pose};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::family::Family;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::Gray;
use deltille::synth::{Light, Scene, Surface, Truth, scene_of_sheet};
use deltille::targets::{BoardSpec, TagSpec, Target, TargetSpec};
use glam::{DQuat, DVec2, DVec3};
use image::ImageFormat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const EDGE_MM: f64 = 20.0;

struct Board {
    target: Target,
    scene: Scene,
    centre_mm: DVec3,
    detector: Detector,
    /// Length of a tag bit.
    bit_mm: f64,
}

impl Board {
    /// A board of 6 × 7 corners with the default tags.
    fn new(inverted: bool) -> Self {
        let tags = TagSpec::default();
        let family = Family::shipped(&tags.family).unwrap();
        let bits_across = f64::from(family.dimension().rows()) + 3.0 * tags.border_bits;
        let plain = BoardSpec::new(deltille::lattice::GridKind::Deltille, 6, 7, EDGE_MM);
        let spec = TargetSpec::Board(BoardSpec { inverted, ..plain });
        let target =
            Printing::build("board", &spec, Some(&family), Some(&PaperSpec::default())).unwrap();
        let sheets = target.draw().unwrap().sheets;
        let scene = scene_of_sheet(&target, &sheets[0], 0);
        let centre_mm = target.target.panels[0].middle_mm();
        let detector = Detector::for_target(&target.target, DetectorConfig::default()).unwrap();
        Self { target: target.target, scene, centre_mm, detector, bit_mm: EDGE_MM / bits_across }
    }

    /// Returns a view with `bit_px` pixels per tag bit in the centre, before the tilt shortens it.
    fn view(&self, rng: &mut ChaCha8Rng, bit_px: f64, tilt_rad: f64) -> (Camera, Pose) {
        let camera = Camera::pinhole(640, 480, 0.5);
        let distance_mm = camera.focal_px.x * self.bit_mm / bit_px;
        (camera, tilted(rng, self.centre_mm, distance_mm, tilt_rad))
    }

    /// Returns the result for a view degraded by `spoil`.
    fn seen(
        &self,
        (camera, pose): (Camera, Pose),
        light: &Light,
        spoil: impl Fn(Gray<f32>) -> Gray<u8>,
    ) -> Seen {
        let truth = self.scene.truth(&camera, &pose, 14.0);
        let everything = self.scene.truth(&camera, &pose, 0.0);
        let image = spoil(self.scene.render(&camera, &pose, light));
        Seen::new(&self.detector.detect(&image, "view"), &truth, &everything)
    }
}

fn eight_bits(image: Gray<f32>) -> Gray<u8> {
    image.map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Detected and expected corners of a board.
#[derive(Debug, Default)]
struct Seen {
    /// Corners with the right label, and those expected.
    corners: [usize; 2],
    /// Corners with a wrong label.
    wrong: usize,
    tags: usize,
    /// Largest distance of a corner from the truth, px.
    worst_px: f64,
}

impl Seen {
    fn new(found: &Detection, truth: &Truth, everything: &Truth) -> Self {
        let places: BTreeMap<u32, _> =
            everything.corners.iter().map(|c| (c.id, [c.x, c.y])).collect();
        let mut seen = Self { corners: [0, truth.corners.len()], ..Self::default() };
        for corner in found.grids.iter().flat_map(|grid| &grid.corners) {
            let Some(id) = corner.id else { continue };
            let place = places.get(&id);
            match place.map(|[x, y]| (corner.x - x).hypot(corner.y - y)) {
                Some(off_px) if off_px < 2.0 => {
                    seen.corners[0] += 1;
                    seen.worst_px = seen.worst_px.max(off_px);
                }
                _ => seen.wrong += 1,
            }
        }
        seen.tags = found.grids.iter().map(|grid| grid.tags.len()).sum();
        seen
    }

    /// Returns whether all corners are found with their labels.
    fn whole(&self) -> bool {
        self.wrong == 0 && self.corners[0] >= self.corners[1]
    }
}

/// Returns the number of views in which tags decode and all corners are labelled, and the fraction of printed tags
/// read.
fn small_tags(views: u64, bit_px: f64) -> (u64, f64) {
    let board = Board::new(false);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut whole, mut tags) = (0, 0);
    for seed in 0..views {
        let view = board.view(&mut rng, bit_px, 45f64.to_radians());
        let light = Light::default().blur_px(0.7).noise(0.02).seed(seed);
        let seen = board.seen(view, &light, eight_bits);
        assert_eq!(seen.wrong, 0, "view {seed}: {seen:?}");
        whole += u64::from(seen.whole());
        tags += seen.tags;
    }
    let printed = board.target.panels[0].tags.len() as f64 * views as f64;
    (whole, tags as f64 / printed)
}

/// Bits of 2 px in the direction of strongest foreshortening: 2.83 px before a tilt of 45°.
#[test]
fn tags_of_two_pixels_a_bit_decode_at_45_degrees() {
    let (whole, tags) = small_tags(10, 2.0 / 45f64.to_radians().cos());
    assert!(whole == 10 && tags > 0.95, "{whole} of 10 views, {tags} of all tags");
}

#[test]
#[ignore = "rates for docs/benchmarks.md"]
fn rates_of_small_tags() {
    for bit_px in [2.0, 2.0 / 45f64.to_radians().cos(), 3.5] {
        let (whole, tags) = small_tags(100, bit_px);
        println!(
            "{bit_px:.2} px a bit before the tilt: {whole} of 100 views, {tags:.3} of the tags"
        );
    }
}

/// 60 % of the board is under a sheet of paper.
#[test]
fn covered_boards_keep_absolute_labels() {
    let mut board = Board::new(false);
    let placed: Vec<DVec3> = board.target.panels[0].corners.iter().map(|c| c.target_mm).collect();
    let low = placed.iter().fold(DVec3::INFINITY, |a, &b| a.min(b));
    let high = placed.iter().fold(DVec3::NEG_INFINITY, |a, &b| a.max(b));
    let (left, right) = (low.x - 200.0, low.x + 0.6 * (high.x - low.x));
    board.scene.surfaces.push(Surface {
        panel: 1,
        target_from_surface: Pose {
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.0, 0.0, 0.5),
        },
        paper_mm: vec![
            DVec2::new(left, low.y - 200.0),
            DVec2::new(right, low.y - 200.0),
            DVec2::new(right, high.y + 200.0),
            DVec2::new(left, high.y + 200.0),
        ],
        black_mm: Vec::new(),
        corners: Vec::new(),
    });
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for seed in 0..8 {
        let view = board.view(&mut rng, 5.0, 0.5);
        let seen = board.seen(view, &Light::default().seed(seed), eight_bits);
        // The edge of the sheet may degrade the corners beside it.
        assert!(seen.wrong == 0 && seen.tags >= 1, "view {seed}: {seen:?}");
        assert!(seen.corners[0] * 10 >= seen.corners[1] * 7, "view {seed}: {seen:?}");
    }
}

/// Asserts that every corner is found with the right label, through a degradation of the image.
fn whole_through(inverted: bool, light: &Light, spoil: impl Fn(Gray<f32>) -> Gray<u8>) {
    let board = Board::new(inverted);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for seed in 0..8 {
        let view = board.view(&mut rng, 4.0, 0.6);
        let seen = board.seen(view, &light.seed(seed), &spoil);
        assert!(seen.whole() && seen.tags >= 1, "view {seed}: {seen:?}");
    }
}

#[test]
fn light_of_ten_to_one_across_the_image() {
    // 1 ± 0.82 of the mean: 10 : 1.
    whole_through(false, &Light::default().gradient(DVec2::X * 1.636).white(0.5), eight_bits);
}

#[test]
fn vignetting() {
    whole_through(false, &Light::default(), |image| {
        let (width, height) = (image.width() as f32, image.height() as f32);
        let half = 0.5 * width.hypot(height);
        let dimmed = Gray::from_fn(image.width(), image.height(), |x, y| {
            // cos⁴ of a wide lens: a quarter in the corners.
            let r = (x as f32 - 0.5 * width).hypot(y as f32 - 0.5 * height) / half;
            image.at(x, y) / (1.0 + r * r).powi(2)
        });
        eight_bits(dimmed)
    });
}

#[test]
fn inverted_boards() {
    whole_through(true, &Light::default(), eight_bits);
}

#[test]
fn motion_of_three_pixels() {
    whole_through(false, &Light::default(), |image| {
        // The mean along 3 px of a slanted line.
        let moved = Gray::from_fn(image.width(), image.height(), |x, y| {
            let at = |t: f64| image.bilinear(x as f64 + 0.8 * t, y as f64 + 0.6 * t);
            (-6..=6).map(|i| at(0.25 * f64::from(i))).sum::<f32>() / 13.0
        });
        eight_bits(moved)
    });
}

#[test]
fn jpeg_of_quality_50() {
    whole_through(false, &Light::default(), |image| {
        let pixels = eight_bits(image);
        let (width, height) = (pixels.width(), pixels.height());
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 50)
            .encode(pixels.pixels(), width as u32, height as u32, image::ExtendedColorType::L8)
            .unwrap();
        let read = image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg).unwrap();
        Gray::from_vec(width, height, read.into_luma8().into_raw()).unwrap()
    });
}
