//! Surroundings of the page and texture of the covers: seeded, periodic textures.

use std::sync::OnceLock;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::mips::{Beyond, Mips};
use crate::photographs::scene::Background;
use deltille::raster::Gray;

/// Side of a texture, texels; a power of two.
const SIDE: usize = 1024;

/// Number of texels per millimetre.
pub(crate) const TEXELS_PER_MM: f64 = 3.0;

/// Number of objects in a cluttered texture.
const THINGS: usize = 400;

/// First random stream for textures; photographs use lower ones.
const STREAM: u64 = 1 << 63;

/// All textures of a run, created on first use.
pub struct Studio {
    pub(crate) seed: u64,
    backgrounds: [OnceLock<Mips>; 3],
    skin: OnceLock<Mips>,
}

impl Studio {
    /// Creates the studio for a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed, backgrounds: Default::default(), skin: OnceLock::new() }
    }

    /// Returns the surroundings of the page: reflected light, 0 to 255.
    pub(crate) fn background(&self, kind: Background) -> &Mips {
        self.backgrounds[kind as usize].get_or_init(|| {
            let mut rng = self.rng(1 + kind as u64);
            let tone: f64 = rng.random_range(0.3..0.5);
            let image = match kind {
                Background::Plain => Gray::from_fn(SIDE, SIDE, |_, _| (tone * 255.0) as u8),
                Background::Texture => grain(tone, 0.12, &mut rng),
                Background::Clutter => clutter(grain(tone, 0.05, &mut rng), &mut rng),
            };
            Mips::new(image, Beyond::Again)
        })
    }

    /// Returns a grain texture with mean 128.
    pub(crate) fn skin(&self) -> &Mips {
        self.skin.get_or_init(|| Mips::new(grain(0.5, 0.06, &mut self.rng(0)), Beyond::Again))
    }

    fn rng(&self, texture: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(STREAM + texture);
        rng
    }
}

/// Returns noise at all scales from 256 texels down, with decreasing amplitude.
fn grain(mean: f64, contrast: f64, rng: &mut ChaCha8Rng) -> Gray<u8> {
    const LARGEST: usize = 256;
    const WEAKER: f64 = 0.72;
    let mut sum = vec![0.0f64; SIDE * SIDE];
    let (mut step, mut weight) = (LARGEST, 1.0);
    while step >= 1 {
        let nodes = SIDE / step;
        let values: Vec<f64> = (0..nodes * nodes).map(|_| rng.random_range(-1.0..1.0)).collect();
        let part = |i: usize| (i / step, (i / step + 1) % nodes, (i % step) as f64 / step as f64);
        for y in 0..SIDE {
            let (y0, y1, fy) = part(y);
            for x in 0..SIDE {
                let (x0, x1, fx) = part(x);
                let mix = |row: usize| {
                    values[row * nodes + x0] * (1.0 - fx) + values[row * nodes + x1] * fx
                };
                sum[y * SIDE + x] += weight * (mix(y0) * (1.0 - fy) + mix(y1) * fy);
            }
        }
        step /= 2;
        weight *= WEAKER;
    }
    Gray::from_fn(SIDE, SIDE, |x, y| {
        ((mean + contrast * sum[y * SIDE + x]) * 255.0).clamp(0.0, 255.0) as u8
    })
}

/// Adds randomly rotated rectangles of all sizes to an image.
fn clutter(mut image: Gray<u8>, rng: &mut ChaCha8Rng) -> Gray<u8> {
    for _ in 0..THINGS {
        let [x, y] = [0; 2].map(|_: i32| rng.random_range(0.0..SIDE as f64));
        let half = [0; 2].map(|_: i32| 4.0 * 25f64.powf(rng.random_range(0.0..1.0)));
        let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let grey: u8 = rng.random_range(5..235);
        let reach = half[0].hypot(half[1]).ceil() as i64;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (u, v) = (dx as f64, dy as f64);
                if (cos * u + sin * v).abs() < half[0] && (cos * v - sin * u).abs() < half[1] {
                    let at = |i: f64, d: i64| (i as i64 + d).rem_euclid(SIDE as i64) as usize;
                    image.row_mut(at(y, dy))[at(x, dx)] = grey;
                }
            }
        }
    }
    image
}
