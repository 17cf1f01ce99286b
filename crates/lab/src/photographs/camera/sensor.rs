//! From light to the grey values of a file: exposure, noise, mosaic, noise reduction, tone, sharpening, quantization to eight bits,
//! compression, resizing.

use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{ExtendedColorType, GrayImage, ImageFormat};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::mosaic::{RESPONSE, colour, interpolated};
use crate::photographs::scene::{Mosaic, SHARPENING_PX, Scene};
use deltille::raster::{Gray, gaussian};

/// Rec. 601 luma weights, as in JPEG.
const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// Returns the content of the file.
pub(crate) fn record(light: &Gray<f32>, scene: &Scene, rng: &mut ChaCha8Rng) -> Gray<u8> {
    let grey = developed(light, scene, rng);
    let sharp = sharpened(grey, scene.sharpening);
    let file = sharp.map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
    let file = match scene.jpeg {
        Some(quality) => compressed(&file, quality),
        None => file,
    };
    match scene.width_px {
        Some(width) => resized(file, width),
        None => file,
    }
}

/// Returns the grey values after the tone curve.
fn developed(light: &Gray<f32>, scene: &Scene, rng: &mut ChaCha8Rng) -> Gray<f32> {
    let exposed = light.map(|v| v * scene.exposure as f32);
    let noise = scene.noise as f32;
    let mut noisy = |value: f32, x: usize, y: usize| {
        let filter = if scene.mosaic == Mosaic::None { 1.0 } else { RESPONSE[colour(x, y)] };
        let passed = value * filter;
        let normal: f32 = StandardNormal.sample(rng);
        let sd = noise * (0.5 + 0.5 * passed.clamp(0.0, 1.0)).sqrt();
        // Gains of the colour channels; each channel is clipped at full scale.
        ((passed + sd * normal) / filter).clamp(0.0, 1.0)
    };
    let raw = Gray::from_fn(light.width(), light.height(), |x, y| noisy(exposed.at(x, y), x, y));
    if scene.mosaic == Mosaic::None {
        return denoised(raw, scene).map(|v| scene.tone.grey(v));
    }
    let colours = interpolated(&raw, scene.mosaic).map(|colour| denoised(colour, scene));
    Gray::from_fn(raw.width(), raw.height(), |x, y| {
        colours.iter().zip(LUMA).map(|(c, weight)| weight * scene.tone.grey(c.at(x, y))).sum()
    })
}

/// Averages neighbours of similar brightness (a bilateral filter of 5 × 5 pixels).
fn denoised(light: Gray<f32>, scene: &Scene) -> Gray<f32> {
    /// Standard deviation of the weights in space, px.
    const SPACE_PX: f32 = 1.0;
    let range = (scene.denoising * scene.noise) as f32;
    if range == 0.0 {
        return light;
    }
    let (width, height) = (light.width(), light.height());
    let near = |i: usize, size: usize| i.saturating_sub(2)..(i + 3).min(size);
    let square = |a: usize, b: usize| (a.abs_diff(b) as f32 / SPACE_PX).powi(2);
    Gray::from_fn(width, height, |x, y| {
        let here = light.at(x, y);
        let (mut sum, mut weights) = (0.0, 0.0);
        for v in near(y, height) {
            for u in near(x, width) {
                let there = light.at(u, v);
                let off = square(u, x) + square(v, y) + ((there - here) / range).powi(2);
                let weight = (-off / 2.0).exp();
                sum += weight * there;
                weights += weight;
            }
        }
        sum / weights
    })
}

/// Adds the detail that a blur removes.
fn sharpened(grey: Gray<f32>, amount: f64) -> Gray<f32> {
    if amount == 0.0 {
        return grey;
    }
    let soft = gaussian(&grey, SHARPENING_PX);
    Gray::from_fn(grey.width(), grey.height(), |x, y| {
        let v = grey.at(x, y);
        v + amount as f32 * (v - soft.at(x, y))
    })
}

fn compressed(image: &Gray<u8>, quality: u8) -> Gray<u8> {
    let (width, height) = (image.width(), image.height());
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(image.pixels(), width as u32, height as u32, ExtendedColorType::L8)
        .expect("a grey image is compressed in memory");
    let read = image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg);
    let pixels = read.expect("the compressed image is readable").into_luma8().into_raw();
    Gray::from_vec(width, height, pixels).expect("compression preserves the size")
}

/// Resizes an image to the given width, with the cubic of Catmull–Rom; when shrinking, each pixel is a weighted mean.
fn resized(image: Gray<u8>, width: u32) -> Gray<u8> {
    if width as usize == image.width() {
        return image;
    }
    let height = (u64::from(width) * image.height() as u64 / image.width() as u64) as u32;
    let pixels = image.pixels().to_vec();
    let image = GrayImage::from_raw(image.width() as u32, image.height() as u32, pixels);
    let image = image.expect("the buffer has the size of the image");
    let image = image::imageops::resize(&image, width, height, FilterType::CatmullRom);
    Gray::from_vec(width as usize, height as usize, image.into_raw())
        .expect("the resized image has the requested size")
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::photographs::scene::Tone;

    fn plain() -> Scene {
        Scene { noise: 0.0, tone: Tone::Linear, ..Scene::default() }
    }

    fn recorded(light: &Gray<f32>, scene: &Scene) -> Gray<u8> {
        record(light, scene, &mut ChaCha8Rng::seed_from_u64(1))
    }

    #[test]
    fn exposure_is_a_gain_that_clips() {
        let light = Gray::from_fn(4, 1, |x, _| 0.1 + 0.2 * x as f32);
        let twice = recorded(&light, &Scene { exposure: 2.0, ..plain() });
        assert_eq!(twice.pixels(), [51, 153, 255, 255]);
    }

    #[test]
    fn noise_has_the_requested_standard_deviation() {
        let light: Gray<f32> = Gray::from_fn(200, 200, |_, _| 0.5);
        for (mosaic, least, most) in [(Mosaic::None, 0.016, 0.019), (Mosaic::Bilinear, 0.008, 0.02)]
        {
            let grey = recorded(&light, &Scene { noise: 0.02, mosaic, ..plain() });
            let values: Vec<f64> = grey.pixels().iter().map(|&v| f64::from(v) / 255.0).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let variance =
                values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
            let sd = variance.sqrt();
            assert!(sd > least && sd < most, "{mosaic:?}: {sd}");
        }
    }

    #[test]
    fn denoising_keeps_edges_and_averages_noise() {
        let edge = Gray::from_fn(64, 64, |x, _| if x < 32 { 0.2 } else { 0.6f32 });
        let noisy = Scene { noise: 0.02, tone: Tone::Linear, ..Scene::default() };
        let spread = |scene: &Scene| {
            let grey = recorded(&edge, scene);
            let off = |x: usize, y: usize| {
                (f64::from(grey.at(x, y)) - if x < 32 { 51.0 } else { 153.0 }).powi(2)
            };
            (0..64).flat_map(|y| (0..64).map(move |x| off(x, y))).sum::<f64>().sqrt()
        };
        assert!(spread(&Scene { denoising: 3.0, ..noisy.clone() }) < 0.6 * spread(&noisy));
    }

    #[test]
    fn sharpening_leaves_a_halo_and_compression_changes_little() {
        let edge = Gray::from_fn(32, 32, |x, _| if x < 16 { 0.2 } else { 0.6f32 });
        let sharp = recorded(&edge, &Scene { sharpening: 1.0, ..plain() });
        assert!(sharp.at(16, 16) > 160 && sharp.at(15, 16) < 45 && sharp.at(2, 16) == 51);
        let small = recorded(&edge, &Scene { jpeg: Some(90), ..plain() });
        assert!(
            small
                .pixels()
                .iter()
                .zip(recorded(&edge, &plain()).pixels())
                .all(|(a, b)| a.abs_diff(*b) < 16)
        );
    }

    #[test]
    fn images_have_the_requested_width() {
        let light = Gray::from_fn(40, 30, |x, _| x as f32 / 40.0);
        let large = recorded(&light, &Scene { width_px: Some(120), ..plain() });
        assert_eq!((large.width(), large.height()), (120, 90));
    }
}
