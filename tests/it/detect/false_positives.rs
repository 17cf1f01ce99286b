//! Images without a target: no grids and no tags are reported.

use std::f64::consts::TAU;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

use deltille::artwork::text;
use deltille::detect::{Detector, DetectorConfig};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::{Coverage, Gray, gaussian};
use deltille::targets::{BoardSpec, TagSpec, TargetSpec};
use glam::DVec2;
use kurbo::{Affine, PathEl};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WIDTH: usize = 400;
const HEIGHT: usize = 300;

/// Angles of patterns, degrees: upright, that of a rosette, and one that does not fit the pixels.
const ANGLES_DEG: [f64; 4] = [0.0, 15.0, 37.0, 45.0];

/// One detector for each type of target, by name.
static DETECTORS: LazyLock<Vec<(&str, Detector)>> = LazyLock::new(|| {
    let family = Family::shipped(&TagSpec::default().family).unwrap();
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 10, 11, 20.0));
    let target =
        Printing::build("board", &spec, Some(&family), Some(&PaperSpec::default())).unwrap();
    let config = DetectorConfig::default();
    let grid = |kind, size| Detector::for_grid(kind, size, config.clone());
    vec![
        ("deltille", grid(GridKind::Deltille, None)),
        ("deltille of 10 × 11", grid(GridKind::Deltille, Some((10, 11)))),
        ("checker", grid(GridKind::Checker, None)),
        ("checker of 8 × 11", grid(GridKind::Checker, Some((8, 11)))),
        ("target", Detector::for_target(&target.target, config).unwrap()),
    ]
});

/// Returns the results in an image, one per line, of the detectors whose names `asked` accepts.
fn found(name: &str, image: &Gray<u8>, asked: impl Fn(&str) -> bool) -> Vec<String> {
    let detectors = DETECTORS.iter().filter(|(what, _)| asked(what));
    let lines = detectors.flat_map(|(what, detector)| {
        let grids = detector.detect(image, name).grids;
        grids.into_iter().map(move |grid| {
            let (corners, tags) = (grid.corners.len(), grid.tags.len());
            format!("{name}: {what}: {corners} corners, {tags} tags")
        })
    });
    lines.collect()
}

fn nothing_in(images: impl IntoIterator<Item = (String, Gray<u8>)>) {
    let lines: Vec<String> =
        images.into_iter().flat_map(|(name, image)| found(&name, &image, |_| true)).collect();
    assert!(lines.is_empty(), "{}", lines.join("\n"));
}

/// Renders a photograph whose brightness at every point (px) is `shade` (0 to 1): 0.8 px of blur, 1 % of noise.
fn photograph(shade: impl Fn(f64, f64) -> f64) -> Gray<u8> {
    // The mean over 3 × 3 points represents that over a pixel.
    let third = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
    taken(&Gray::from_fn(WIDTH, HEIGHT, |x, y| {
        let points = third.iter().flat_map(|v| third.iter().map(move |u| (u, v)));
        let sum: f64 = points.map(|(u, v)| shade(x as f64 + u, y as f64 + v)).sum();
        (sum / 9.0) as f32
    }))
}

fn taken(sharp: &Gray<f32>) -> Gray<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut image = gaussian(sharp, 0.8);
    for pixel in image.pixels_mut() {
        let noise: f32 = StandardNormal.sample(&mut rng);
        *pixel = 0.1 + 0.8 * *pixel + 0.01 * noise;
    }
    image.map(|v| (v * 255.0 + 0.5) as u8)
}

/// Returns coordinates rotated by an angle, in units of `pitch_px`.
fn turned(angle_deg: f64, pitch_px: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    [(x * cos + y * sin) / pitch_px, (y * cos - x * sin) / pitch_px]
}

/// Whether patterns are tested at every angle with every pitch, or at each angle with every second pitch.
static IS_EVERY_PAIR: AtomicBool = AtomicBool::new(false);

/// A pattern at all angles and several pitches.
fn everywhere(
    name: &str,
    pitches_px: &[f64],
    pattern: impl Fn([f64; 2]) -> f64,
) -> Vec<(String, Gray<u8>)> {
    let is_every_pair = IS_EVERY_PAIR.load(Ordering::Relaxed);
    let mut images = Vec::new();
    for (i, &pitch) in pitches_px.iter().enumerate() {
        for (j, angle) in ANGLES_DEG.into_iter().enumerate() {
            if is_every_pair || (i + j) % 2 == 0 {
                let image = photograph(|x, y| pattern(turned(angle, pitch, [x, y])));
                images.push((format!("{name}, {pitch} px at {angle}°"), image));
            }
        }
    }
    images
}

/// 1 within a stripe along an integer, of a width relative to the pitch.
fn stripe(u: f64, width: f64) -> f64 {
    f64::from((u - u.round()).abs() < width / 2.0)
}

/// Screens with the spot function cos u + cos v, dark where it exceeds a threshold.
fn spots([u, v]: [f64; 2], threshold: f64) -> f64 {
    f64::from((TAU * u).cos() + (TAU * v).cos() < threshold)
}

/// The same with three waves: dots, or triangles with rounded corners.
fn triangular_spots([u, v]: [f64; 2], threshold: f64, phase: f64) -> f64 {
    let waves = [0.0, 1.0, 2.0].map(|k: f64| {
        let (sin, cos) = (k * TAU / 3.0).sin_cos();
        (TAU * (u * cos + v * sin) + phase).cos()
    });
    f64::from(waves.iter().sum::<f64>() < threshold)
}

#[test]
fn halftones_of_dots_that_do_not_meet() {
    for threshold in [-1.0, -0.4, 0.4, 1.0] {
        nothing_in(everywhere(&format!("spots {threshold}"), &[5.0, 9.0, 16.0, 30.0], |p| {
            spots(p, threshold)
        }));
    }
    let round = |[u, v]: [f64; 2]| f64::from((u - u.round()).hypot(v - v.round()) < 0.4);
    nothing_in(everywhere("round dots of 50 %", &[5.0, 9.0, 30.0], round));
    for threshold in [-0.7, 0.8, 1.5] {
        nothing_in(everywhere("dots in triangles", &[9.0, 18.0, 36.0], |p| {
            triangular_spots(p, threshold, 0.0)
        }));
    }
    for threshold in [-0.5, 0.5] {
        nothing_in(everywhere("triangles apart", &[9.0, 18.0, 36.0], |p| {
            triangular_spots(p, threshold, TAU / 4.0)
        }));
    }
}

/// Where a screen reaches 50 %, its dots meet like squares of a checkerboard; this is tested with
/// every target.
#[test]
fn halftones_and_dithers_of_gradients() {
    for (period_px, angle) in [(10.0, 45.0), (14.0, 20.0), (20.0, 70.0)] {
        // From white to black across the image, once or in three bands.
        let images = [1.0, 3.0].map(|bands| {
            let tone = |x: f64| 2.0 * (bands * x / WIDTH as f64).fract() - 1.0;
            photograph(|x, y| spots(turned(angle, period_px, [x, y]), 2.0 * tone(x + 0.3 * y)))
        });
        nothing_in(images.map(|image| (format!("gradient, {period_px} px at {angle}°"), image)));
    }
    // Ordered dithers with a matrix of 4 × 4.
    const MATRIX: [[f64; 4]; 4] = [
        [0.0, 8.0, 2.0, 10.0],
        [12.0, 4.0, 14.0, 6.0],
        [3.0, 11.0, 1.0, 9.0],
        [15.0, 7.0, 13.0, 5.0],
    ];
    for cell_px in [8.0, 10.0, 12.0] {
        let image = photograph(|x, y| {
            let cell = |c: f64| (c / cell_px).floor().max(0.0) as usize % 4;
            let level = (MATRIX[cell(y)][cell(x)] + 0.5) / 16.0;
            f64::from((x + 0.5 * y) / (1.4 * WIDTH as f64) > level)
        });
        nothing_in([(format!("dither of {cell_px} px"), image)]);
    }
}

/// Asserts that nothing is found as any checkerboard, the least specific target.
fn no_checkerboard_in(images: impl IntoIterator<Item = (String, Gray<u8>)>) {
    let asked = |what: &str| what == "checker";
    let lines: Vec<String> =
        images.into_iter().flat_map(|(name, image)| found(&name, &image, asked)).collect();
    assert!(lines.is_empty(), "{}", lines.join("\n"));
}

/// The sum of two oblique waves resembles an oblique, blurred checkerboard, but it lacks the third
/// harmonic.
#[test]
fn two_oblique_waves() {
    let waves = [(0.0, 8.0, 40.0, 14.0), (20.0, 9.0, 75.0, 31.0), (80.0, 24.0, 110.0, 17.0)];
    no_checkerboard_in(waves.map(|(a, pitch_a, b, pitch_b)| {
        let image = photograph(|x, y| {
            let (u, v) = (turned(a, pitch_a, [x, y])[0], turned(b, pitch_b, [x, y])[0]);
            0.5 + ((TAU * u).sin() + (TAU * v).sin()) / 4.0
        });
        (format!("waves of {pitch_a} px at {a}° and {pitch_b} px at {b}°"), image)
    }));
}

/// Dots that do not meet, so small that blur joins them.
#[test]
fn fine_halftones() {
    for threshold in [-0.4, 0.4] {
        no_checkerboard_in([10.1, 10.4, 10.8].into_iter().flat_map(|pitch| {
            [5.0, 22.0, 45.0].map(|angle| {
                let image = photograph(|x, y| spots(turned(angle, pitch, [x, y]), threshold));
                (format!("spots {threshold}, {pitch} px at {angle}°"), image)
            })
        }));
    }
}

/// Some of them alternate like squares of a board.
#[test]
fn fields_of_random_cells() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for cell_px in [8.0, 10.0, 14.0, 20.0] {
        for angle in [0.0, 15.0, 37.0, 60.0, 80.0] {
            let cells = Gray::from_fn(100, 100, |_, _| u8::from(rng.random::<bool>()));
            let image = photograph(|x, y| {
                let [u, v] = turned(angle, cell_px, [x, y]);
                let cell = |c: f64| (c.floor() + 50.0) as usize % 100;
                f64::from(cells.at(cell(u), cell(v)))
            });
            no_checkerboard_in([(format!("cells of {cell_px} px at {angle}°"), image)]);
        }
    }
}

/// Where dots of one screen lie between those of another, they look like squares.
#[test]
fn slightly_rotated_screens() {
    for (pitch, turn, ratio) in
        [(12.0, 6.0, 0.93), (16.0, 9.0, 1.05), (22.0, 3.0, 1.08), (26.0, 14.0, 0.95)]
    {
        for (first, second) in [(0.4, -0.3), (-0.4, 0.7), (0.8, 0.3), (0.1, 0.2)] {
            let image = photograph(|x, y| {
                spots(turned(10.0, pitch, [x, y]), first)
                    * spots(turned(10.0 + turn, ratio * pitch, [x, y]), second)
            });
            let name = format!("screens of {pitch} px, {turn}° apart, {first} and {second}");
            no_checkerboard_in([(name, image)]);
        }
    }
}

/// Ordered dithers with a matrix of 8 × 8: from one tone to the next, a few more cells change their colour.
#[test]
fn fine_dithers() {
    let level = |x: usize, y: usize| {
        let bits = |k: usize| 2 * ((x >> k ^ y >> k) & 1) + (y >> k & 1);
        (16 * bits(0) + 4 * bits(1) + bits(2)) as f64 / 64.0
    };
    for cell_px in [8.0, 10.0, 12.0] {
        for (across, down) in [(1.0, 0.4), (0.3, 1.0), (3.0, 1.0), (0.4, 0.0)] {
            let image = photograph(|x, y| {
                let cell = |c: f64| (c / cell_px).floor().max(0.0) as usize % 8;
                let tone = 0.2 + (across * x + down * y) / (WIDTH as f64);
                f64::from(tone % 1.0 > level(cell(x), cell(y)))
            });
            let name = format!("dither of {cell_px} px, {across} and {down}");
            no_checkerboard_in([(name, image)]);
        }
    }
}

/// At 50 %, cos u + cos v is exactly a checkerboard, three waves are a deltille grid, and blur joins round dots with
/// small gaps. Without a size, they cannot be distinguished from a part of a board. With a size they can, because they
/// do not end.
#[test]
fn halftones_of_dots_that_meet_are_not_boards_of_a_known_size() {
    let known = |what: &str| what.contains("of") || what == "target";
    for pitch in [12.0, 16.0, 20.0] {
        for angle in ANGLES_DEG {
            let place = |x: f64, y: f64| turned(angle, pitch, [x, y]);
            let round = |[u, v]: [f64; 2]| f64::from((u - u.round()).hypot(v - v.round()) < 0.4);
            let images = [
                photograph(|x, y| spots(place(x, y), 0.0)),
                photograph(|x, y| triangular_spots(place(x, y), 0.0, TAU / 4.0)),
                photograph(|x, y| round(place(x, y))),
            ];
            let name = format!("{pitch} px at {angle}°");
            let lines: Vec<String> =
                images.iter().flat_map(|image| found(&name, image, known)).collect();
            assert!(lines.is_empty(), "{}", lines.join("\n"));
        }
    }
}

/// Waves have the symmetry of boards but no edges: their brightness is that of a board blurred by at least a fifth of a
/// tile.
#[test]
fn smooth_waves() {
    let pitches = [12.0, 16.0, 24.0, 40.0, 70.0];
    nothing_in(everywhere("two waves", &pitches, |[u, v]| {
        (2.0 + (TAU * u).cos() + (TAU * v).cos()) / 4.0
    }));
    nothing_in(everywhere("three waves", &pitches, |p| {
        let waves = [0.0, 120.0, 240.0].map(|a| (TAU * turned(a, 1.0, p)[0]).sin());
        0.5 + waves.iter().sum::<f64>() / 5.2
    }));
}

#[test]
fn stripes_bricks_fences_and_fabrics() {
    let pitches = [8.0, 14.0, 24.0, 48.0];
    nothing_in(everywhere("stripes", &pitches, |[u, _]| stripe(u, 0.5)));
    nothing_in(everywhere("crossed stripes", &pitches, |[u, v]| stripe(u, 0.5) * stripe(v, 0.5)));
    nothing_in(everywhere("gingham", &pitches, |[u, v]| (stripe(u, 0.5) + stripe(v, 0.5)) / 2.0));
    nothing_in(everywhere("chain link", &pitches, |[u, v]| {
        let (u, v) = (u + 0.06 * (TAU * v).sin(), v + 0.06 * (TAU * u).sin());
        stripe(u, 0.12).max(stripe(v, 0.12))
    }));
    nothing_in(everywhere("lines in triangles", &pitches, |p| {
        [0.0, 60.0, 120.0]
            .map(|a| stripe(turned(a, 1.0, p)[0], 0.15))
            .into_iter()
            .sum::<f64>()
            .min(1.0)
    }));
    nothing_in(everywhere("brick", &[16.0, 32.0], |[u, v]| {
        let u = u / 2.0 + 0.5 * (v - 0.5).round().rem_euclid(2.0);
        1.0 - 0.7 * stripe(u, 0.06).max(stripe(v, 0.12))
    }));
    // Threads over and under each other, each bright along its middle.
    nothing_in(everywhere("plain weave", &pitches, |[u, v]| {
        let over = (u.round() + v.round()).rem_euclid(2.0) < 1.0;
        let across = if over { u - u.round() } else { v - v.round() };
        (TAU / 2.0 * across).cos()
    }));
    nothing_in(everywhere("twill", &pitches, |[u, v]| {
        f64::from((u.floor() + v.floor()).rem_euclid(4.0) < 2.0)
    }));
    nothing_in(everywhere("basket weave", &[24.0, 48.0], |[u, v]| {
        let along = (u.floor() + v.floor()).rem_euclid(2.0) < 1.0;
        stripe(3.0 * if along { u } else { v }, 0.4)
    }));
    nothing_in(everywhere("honeycomb", &pitches, |p| {
        let waves = [0.0, 60.0, 120.0].map(|a| (TAU * turned(a, 1.0, p)[0]).cos());
        f64::from(waves.iter().sum::<f64>() > -0.9)
    }));
}

#[test]
#[ignore = "every pattern at every angle with every pitch"]
fn patterns_at_every_angle_with_every_pitch() {
    IS_EVERY_PAIR.store(true, Ordering::Relaxed);
    halftones_of_dots_that_do_not_meet();
    smooth_waves();
    stripes_bricks_fences_and_fabrics();
}

#[test]
fn gratings_and_screens_over_each_other() {
    for (a, b) in [(0.0, 4.0), (10.0, 40.0), (0.0, 60.0), (15.0, 75.0)] {
        for pitch in [7.0, 13.0, 25.0] {
            let name = format!("gratings, {pitch} px at {a}° and {b}°");
            let gratings = photograph(|x, y| {
                let [u, _] = turned(a, pitch, [x, y]);
                let [v, _] = turned(b, 1.07 * pitch, [x, y]);
                stripe(u, 0.5) * stripe(v, 0.5)
            });
            let screens = photograph(|x, y| {
                let first = spots(turned(a, pitch, [x, y]), -0.4);
                first * spots(turned(b, pitch, [x, y]), 0.4)
            });
            nothing_in([gratings, screens].map(|image| (name.clone(), image)));
        }
    }
}

#[test]
fn noise_white_and_smooth_and_spots_of_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for smooth_px in [0.0, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0] {
        let white = Gray::from_fn(WIDTH, HEIGHT, |_, _| StandardNormal.sample(&mut rng));
        let noise: Gray<f32> = gaussian(&white, smooth_px);
        let power = noise.pixels().iter().map(|v| v * v).sum::<f32>() / (WIDTH * HEIGHT) as f32;
        for contrast in [0.02, 0.1, 0.3] {
            let image = noise
                .map(|v| (127.5 * (1.0 + contrast * v / power.sqrt())).clamp(0.0, 255.0) as u8);
            nothing_in([(format!("noise of {contrast}, smooth to {smooth_px} px"), image)]);
        }
        let spots = taken(&noise.map(|v| f32::from(v > 0.0)));
        nothing_in([(format!("spots of noise, smooth to {smooth_px} px"), spots)]);
    }
}

#[test]
fn pages_of_text() {
    let words = "The quick brown fox jumps over the lazy dog, and WAXES XYLOPHONES in 1234567890 \
                 MAZES; #%&@+=*<> (A) [M] KWNVXZ 88888 xxxx vvvv wwww zzzz ";
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for size_px in [9.0, 14.0, 24.0, 60.0] {
        for angle in [0.0, 0.3] {
            let mut ink = Coverage::new(WIDTH, HEIGHT);
            for line in 0..2 + (1.4 * HEIGHT as f64 / size_px) as usize {
                let start = rng.random_range(0..words.len());
                let text = words[start..].to_owned() + &words.repeat(2);
                let (path, _) = text::outline(&text, size_px).unwrap();
                let down = Affine::translate((0.0, 1.2 * size_px * line as f64 - 200.0));
                let place = Affine::rotate(angle) * down * Affine::FLIP_Y;
                add(&mut ink, &(place * path));
            }
            let image = ink.finish().map(|v| 1.0 - v.abs().min(1.0));
            nothing_in([(format!("text of {size_px} px at {angle}"), taken(&image))]);
        }
    }
}

/// Adds the polygons of a path; holes have the opposite orientation.
fn add(ink: &mut Coverage, path: &kurbo::BezPath) {
    let mut polygon = Vec::new();
    kurbo::flatten(path, 0.05, |element| match element {
        PathEl::MoveTo(p) => polygon = vec![DVec2::new(p.x, p.y)],
        PathEl::LineTo(p) => polygon.push(DVec2::new(p.x, p.y)),
        PathEl::ClosePath => ink.add(&polygon, 1.0),
        _ => {}
    });
}

/// Squares and triangles that meet as on a board, in pieces too small to be identified.
#[test]
fn pieces_of_boards_too_small_to_identify() {
    for pitch in [15.0, 30.0] {
        for angle in ANGLES_DEG {
            // 2 × 4 corners in pieces of 3 × 5 squares.
            let squares = photograph(|x, y| {
                let [u, v] = turned(angle, pitch, [x, y]);
                let (u, v) = (u.rem_euclid(8.0), v.rem_euclid(6.0));
                let white = u >= 5.0 || v >= 3.0 || (u.floor() + v.floor()) % 2.0 == 1.0;
                f64::from(white)
            });
            // Three corners, in a triangle of six tiles a side without its tips.
            let triangles = photograph(|x, y| {
                let [u, v] = turned(angle, pitch, [x, y]);
                let v = v / 0.75f64.sqrt();
                let (u, v) = ((u - v / 2.0).rem_euclid(6.0), v.rem_euclid(6.0));
                let dark = u + v < 4.0 && u.fract() + v.fract() < 1.0;
                f64::from(!dark)
            });
            let name = format!("{pitch} px at {angle}°");
            nothing_in([
                (format!("squares, {name}"), squares),
                (format!("triangles, {name}"), triangles),
            ]);
        }
    }
}

#[test]
fn boards_of_the_other_kind() {
    for pitch in [12.0, 25.0, 50.0] {
        for angle in ANGLES_DEG {
            let name = format!("{pitch} px at {angle}°");
            let checker = photograph(|x, y| {
                let [u, v] = turned(angle, pitch, [x, y]);
                (u.floor() + v.floor()).rem_euclid(2.0)
            });
            let deltille =
                photograph(|x, y| triangular_spots(turned(angle, pitch, [x, y]), 0.0, TAU / 4.0));
            let mut lines = found(&name, &checker, |what| !what.contains("checker"));
            lines.extend(found(&name, &deltille, |what| what.contains("checker")));
            assert!(lines.is_empty(), "{}", lines.join("\n"));
        }
    }
}
