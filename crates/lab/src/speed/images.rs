//! Images of 1600 × 1200 px: photographs with and without boards, patterns, and frames of a video.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::photographs::Subject;
use crate::photographs::photograph::take;
use crate::photographs::scene::{Background, Scene};
use crate::photographs::world::background::Studio;
use deltille::raster::Gray;

/// Width and height, px.
const SIZE: [usize; 2] = [1600, 1200];

/// Number of photographs of a kind.
const PHOTOGRAPHS: u64 = 3;

/// Motion of a video, px per frame.
const MOTION_PX: [usize; 2] = [8, 5];

/// Number of frames of a video.
const FRAMES: usize = 40;

/// Images of one kind.
pub(super) struct Set {
    pub(super) name: String,
    pub(super) images: Vec<Gray<u8>>,
}

/// Returns photographs of a board.
pub(super) fn boards(subject: &Subject, bit_px: f64, seed: u64) -> Vec<Gray<u8>> {
    let scene = Scene { size_px: SIZE, bit_px, ..Scene::default() };
    photographs(subject, &scene, seed)
}

/// Returns photographs of a board in each kind of surroundings.
pub(super) fn surroundings(subject: &Subject, seed: u64) -> [Set; 2] {
    let of = |background| {
        photographs(subject, &Scene { size_px: SIZE, background, ..Scene::default() }, seed)
    };
    let sets = [("texture", Background::Texture), ("objects", Background::Clutter)];
    sets.map(|(name, background)| Set { name: name.to_owned(), images: of(background) })
}

fn photographs(subject: &Subject, scene: &Scene, seed: u64) -> Vec<Gray<u8>> {
    let studio = Studio::new(seed);
    (0..PHOTOGRAPHS)
        .into_par_iter()
        .map(|view| take(&subject.page, &studio, scene, view).image)
        .collect()
}

/// Returns frames of a board that moves.
pub(super) fn video(subject: &Subject, seed: u64) -> Vec<Gray<u8>> {
    let size_px = [0, 1].map(|i| SIZE[i] + FRAMES * MOTION_PX[i]);
    let scene = Scene { size_px, ..Scene::default() };
    let whole = take(&subject.page, &Studio::new(seed), &scene, 0).image;
    let frame = |n: usize| {
        let [left, top] = MOTION_PX.map(|step| n * step);
        Gray::from_fn(SIZE[0], SIZE[1], |x, y| whole.at(left + x, top + y))
    };
    (0..FRAMES).map(frame).collect()
}

/// Returns noise, and patterns that fill the image.
pub(super) fn patterns(seed: u64) -> Vec<Set> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Gray::from_fn(SIZE[0], SIZE[1], |_, _| random.random_range(0..=255));
    let of = |name: &str, image| Set { name: name.to_owned(), images: vec![image] };
    let squares = Gray::from_fn(SIZE[0], SIZE[1], |x, y| grey((x / 8 + y / 8) % 2 == 0));
    vec![
        of("noise", noise),
        of("triangles of 26 px", triangles(26.0)),
        of("triangles of 12 px", triangles(12.0)),
        of("squares of 8 px", squares),
    ]
}

/// Draws triangles with edges of this length, px, each pixel as the mean of nine points.
fn triangles(edge: f64) -> Gray<u8> {
    let height = edge * 0.75f64.sqrt();
    let is_dark = |x: f64, y: f64| {
        // Rows, and both families of slanted lines.
        let [row, up, down] =
            [y / height, x / edge + y / height / 2.0, x / edge - y / height / 2.0];
        let [row, up, down] = [row, up, down].map(|line| line.floor() as i64);
        (row + up + down).rem_euclid(2) == 0
    };
    Gray::from_fn(SIZE[0], SIZE[1], |x, y| {
        let points =
            (0..9).map(|i| [x as f64 + f64::from(i % 3) / 3.0, y as f64 + f64::from(i / 3) / 3.0]);
        let dark = points.filter(|&[x, y]| is_dark(x, y)).count();
        (230 - 20 * dark) as u8
    })
}

fn grey(is_dark: bool) -> u8 {
    if is_dark { 50 } else { 230 }
}
