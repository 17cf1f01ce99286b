//! Grids are found at any magnification, and under any cover.

use std::f64::consts::TAU;

use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::lattice::GridKind;
use deltille::raster::{Gray, gaussian};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WIDTH: usize = 400;
const HEIGHT: usize = 300;
const EDGE_PX: f64 = 26.0;

/// Renders a photograph of a tiling in a frame, rotated by 0.1 rad, under 1 px of blur and 1 % of noise. `cover`
/// returns the brightness of a covering object.
fn photograph(kind: GridKind, cover: impl Fn(f64, f64) -> Option<f32>) -> Gray<f32> {
    let (sin, cos) = 0.1f64.sin_cos();
    let sharp = Gray::from_fn(3 * WIDTH, 3 * HEIGHT, |x, y| {
        let (x, y) = ((x as f64 - 1.0) / 3.0, (y as f64 - 1.0) / 3.0);
        if let Some(shade) = cover(x, y) {
            return shade;
        }
        let (u, v) = (x - WIDTH as f64 / 2.0, y - HEIGHT as f64 / 2.0);
        let (u, v) = (u * cos + v * sin, v * cos - u * sin);
        if u.abs() > 165.0 || v.abs() > 115.0 {
            return 0.8;
        }
        let dark = match kind {
            GridKind::Checker => {
                ((u / EDGE_PX).floor() + (v / EDGE_PX).floor()).rem_euclid(2.0) < 1.0
            }
            GridKind::Deltille => {
                let wave = |angle: f64| {
                    let along = u * angle.cos() + v * angle.sin();
                    (TAU * along / (EDGE_PX * 0.75f64.sqrt() * 2.0) * 1.0).sin()
                };
                [0.0, 1.0, 2.0].map(|k| wave(k * TAU / 3.0)).iter().product::<f64>() > 0.0
            }
        };
        if dark { 0.1 } else { 0.8 }
    });
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let blurred = gaussian(&sharp, 3.0);
    Gray::from_fn(WIDTH, HEIGHT, |x, y| {
        let noise: f32 = StandardNormal.sample(&mut rng);
        blurred.at(3 * x + 1, 3 * y + 1) + 0.01 * noise
    })
}

/// Returns the image enlarged by `scale` with bilinear interpolation, as 8 bits.
fn enlarged(image: &Gray<f32>, scale: usize) -> Gray<u8> {
    let to = |v: usize| (v as f64 + 0.5) / scale as f64 - 0.5;
    Gray::from_fn(scale * image.width(), scale * image.height(), |x, y| {
        (image.bilinear(to(x), to(y)) * 255.0 + 0.5) as u8
    })
}

fn detected(kind: GridKind, image: &Gray<u8>) -> Detection {
    Detector::for_grid(kind, None, DetectorConfig::default()).detect(image, "picture")
}

#[test]
fn an_enlarged_image_shows_the_same_corners() {
    for kind in [GridKind::Deltille, GridKind::Checker] {
        let picture = photograph(kind, |_, _| None);
        let plain = detected(kind, &enlarged(&picture, 1));
        assert_eq!(plain.grids.len(), 1, "{kind:?}");
        let corners = &plain.grids[0].corners;
        assert!(corners.len() > 70, "{kind:?}: {}", corners.len());
        for scale in [3, 7] {
            let large = detected(kind, &enlarged(&picture, scale));
            assert_eq!(large.grids.len(), 1, "{kind:?} × {scale}");
            let found = &large.grids[0].corners;
            assert_eq!(found.len(), corners.len(), "{kind:?} × {scale}");
            for corner in corners {
                let there = |v: f64| (v + 0.5) * scale as f64 - 0.5;
                let off =
                    found.iter().map(|c| (c.x - there(corner.x)).hypot(c.y - there(corner.y)));
                let off_px = off.fold(f64::INFINITY, f64::min) / scale as f64;
                assert!(off_px < 0.15, "{kind:?} × {scale}: {off_px}");
            }
        }
    }
}

#[test]
fn parts_beside_a_cover_form_one_grid_without_corners_under_it() {
    // A cross of two bars, more than a tile wide.
    let bars =
        |x: f64, y: f64| (x + 0.4 * y - 250.0).abs() < 17.0 || (y - 0.3 * x - 80.0).abs() < 15.0;
    for kind in [GridKind::Deltille, GridKind::Checker] {
        let whole = detected(kind, &enlarged(&photograph(kind, |_, _| None), 1));
        let covered = photograph(kind, |x, y| bars(x, y).then_some(0.4));
        let found = detected(kind, &enlarged(&covered, 1));
        assert_eq!(found.grids.len(), 1, "{kind:?}");
        let corners = &found.grids[0].corners;
        assert!(corners.iter().all(|c| !bars(c.x, c.y)), "{kind:?}");
        // Whether a circle of 7 px around a corner is uncovered.
        let free = |x: f64, y: f64| {
            let circle = (0..12).map(|k| (f64::from(k) * TAU / 12.0).sin_cos());
            !circle.into_iter().any(|(s, c)| bars(x + 7.0 * c, y + 7.0 * s))
        };
        let visible: Vec<_> = whole.grids[0].corners.iter().filter(|c| free(c.x, c.y)).collect();
        let seen =
            visible.iter().filter(|v| corners.iter().any(|c| (c.x - v.x).hypot(c.y - v.y) < 0.5));
        let (seen, all) = (seen.count(), visible.len());
        assert!(10 * seen >= 9 * all, "{kind:?}: {seen} of {all}");
    }
}
