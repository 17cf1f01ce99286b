//! No input causes a panic, and all results are finite.

use std::path::Path;

use deltille::camera::Camera;
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::{detection, dsc, solid_mesh};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::photograph;
use deltille::raster::{Gray, ImageView};
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TagSpec, Target, TargetSpec};
use deltille::verify::Document;
use proptest::prelude::*;

fn board() -> (Printing, Family) {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 5, 6, 20.0));
    let target = Printing::build("board", &spec, Some(&family), Some(&PaperSpec::default()));
    (target.unwrap(), family)
}

fn finite(found: &Detection) -> bool {
    found.grids.iter().flat_map(|grid| &grid.corners).all(|corner| {
        let cov = corner.cov.unwrap_or_default();
        corner.x.is_finite() && corner.y.is_finite() && cov.iter().all(|c| c.is_finite())
    })
}

fn detectors() -> [Detector; 3] {
    let (target, _family) = board();
    [
        Detector::for_grid(GridKind::Deltille, Some((5, 6)), DetectorConfig::default()),
        Detector::for_target(&target.target, DetectorConfig::default()).unwrap(),
        Detector::for_grid(GridKind::Checker, None, DetectorConfig::default()),
    ]
}

fn nothing_in<'a>(image: impl Into<ImageView<'a>>) {
    let image = image.into();
    for detector in detectors() {
        assert!(detector.detect(image, "").grids.is_empty());
    }
}

#[test]
fn images_of_any_shape_without_a_target_show_none() {
    for (width, height) in [(0, 0), (1, 1), (16, 16), (3, 4000), (4000, 3), (640, 480)] {
        for level in [0, 128, 255] {
            nothing_in(&Gray::from_fn(width, height, |_, _| level as u8));
            nothing_in(&Gray::from_fn(width, height, |_, _| 257 * level as u16));
        }
    }
}

/// Seconds, and half a gigabyte: `cargo test --release -- --ignored`.
#[test]
#[ignore = "an image of a hundred megapixels"]
fn a_hundred_megapixels_are_searched() {
    let noise = |x: usize, y: usize| ((x * 31 + y * 17) ^ ((x * y) >> 3)) as u8 & 63;
    let image = Gray::from_fn(12_000, 8_400, noise);
    let found = detectors()[1].detect(&image, "");
    assert!(found.grids.iter().all(|grid| grid.panel.is_none()));
}

/// One valid file of each kind that is read.
fn files() -> Vec<String> {
    let (target, family) = board();
    let octahedron = SolidSpec::new(SolidShape::Octahedron);
    let solid = Target::build("o", &TargetSpec::Solid(octahedron), Some(&family)).unwrap();
    let image = Gray::from_fn(64, 48, |x, y| (x * y % 251) as u8);
    vec![
        target.to_json(),
        solid.to_json(),
        dsc::write(&target.target, dsc::Dialect::Fork).unwrap(),
        Family::shipped("d16h5").unwrap().to_json(),
        detection::write(&detectors()[0].detect(&image, "noise.png")),
        "width: 640\nheight: 480\nfocal_px: [500, 500]\ncentre_px: [320, 240]\nmodel: pinhole\n"
            .to_owned(),
    ]
}

/// Runs every reader of text on a text; none may panic. Returns the number of readers that accept it.
fn read_all(text: &str) -> usize {
    let read = [
        Printing::from_json(text).is_ok(),
        dsc::read(text, "x").is_ok(),
        Family::from_json(text).is_ok(),
        detection::read(text).is_ok(),
        Camera::from_yaml(text).is_ok(),
    ];
    read.into_iter().filter(|&read| read).count()
}

#[test]
fn each_file_is_accepted_by_one_reader() {
    for file in files() {
        assert_eq!(read_all(&file), 1, "{file}");
    }
}

/// Files of `tests/corpus`, whose names state their kind and fault: no reader needs more memory or time than for a valid file,
/// and none panics.
#[test]
fn faulty_files_of_the_corpus_are_refused_or_read() {
    let mut files = 0;
    for entry in
        std::fs::read_dir(Path::new(crate::common::REPOSITORY).join("tests/corpus")).unwrap()
    {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        read_all(&String::from_utf8_lossy(&bytes));
        drop(solid_mesh::read(&bytes));
        if let Ok(image) = photograph::read(&path) {
            detectors().iter().for_each(|detector| drop(detector.detect(&image, "")));
        }
        if let Ok(document) = Document::open(&path) {
            (0..document.pages().min(1)).for_each(|page| drop(document.render(page, 1.0)));
        }
        files += 1;
    }
    assert!(files > 30, "{files} files");
}

/// Brackets nested deeper than any reader allows.
#[test]
fn deep_nesting_is_refused() {
    for open in ["[", "{\"a\":", "{a: ", "- "] {
        assert_eq!(read_all(&open.repeat(10_000)), 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn pixels_of_any_kind_give_finite_corners(
        seed: u64, width in 16..90usize, height in 16..90usize, levels in 2..65_536u32,
    ) {
        let random = |x: usize, y: usize| {
            let mixed = (seed ^ (x as u64) << 32 ^ y as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            ((mixed >> 40) % u64::from(levels)) as u16
        };
        let scale = (65_535 / (levels - 1)) as u16;
        // Single pixels and blocks of 5 × 5, which have corners of many kinds.
        let images = [
            Gray::from_fn(width, height, |x, y| random(x, y).saturating_mul(scale)),
            Gray::from_fn(width, height, |x, y| random(x / 5, y / 5).saturating_mul(scale)),
        ];
        for image in images {
            for detector in detectors() {
                prop_assert!(finite(&detector.detect(&image, "")));
            }
        }
    }

    /// Files with changed, lost or repeated bytes.
    #[test]
    fn damaged_files_are_refused_or_read(
        pick in 0..6usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..4u8, any::<u8>()), 1..6),
    ) {
        static FILES: std::sync::OnceLock<Vec<String>> = std::sync::OnceLock::new();
        let mut bytes = FILES.get_or_init(files)[pick].clone().into_bytes();
        for (at, kind, byte) in damage {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.truncate(at),
                2 => drop(bytes.drain(at..(at + usize::from(byte)).min(bytes.len()))),
                // Digits and signs in place of numbers find more faults than random bytes.
                _ => bytes[at] = b"0123456789-e.,\"[]{}:"[usize::from(byte) % 20],
            }
        }
        read_all(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn damaged_images_are_refused_or_read(
        at in any::<prop::sample::Index>(), byte: u8, cut in any::<prop::sample::Index>(),
        format in 0..6usize,
    ) {
        let formats = [
            image::ImageFormat::Png,
            image::ImageFormat::Jpeg,
            image::ImageFormat::Tiff,
            image::ImageFormat::Bmp,
            image::ImageFormat::Pnm,
            image::ImageFormat::WebP,
        ];
        let picture = image::GrayImage::from_fn(40, 30, |x, y| image::Luma([(x * y) as u8]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, formats[format]).unwrap();
        let mut bytes = bytes.into_inner();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        bytes.truncate(cut.index(2 * bytes.len()) + 1);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        if let Ok(image) = photograph::read(file.path()) {
            detectors().iter().for_each(|detector| drop(detector.detect(&image, "")));
        }
    }
}
