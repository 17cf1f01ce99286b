//! The light that reaches each pixel of the sensor.
//!
//! The scene is sampled four to eight times along both axes of a pixel. Each sample is an area of the page (`mips`).
//! Blurring and gathering are one step: a pixel is the integral of the image over its square, convolved with a
//! Gaussian,
//!
//! ```text
//! w(δ) = ½ erf((δ + ½)/√2σ) − ½ erf((δ − ½)/√2σ)
//! ```
//!
//! along each axis. Aliasing stays below a thousandth of full scale.

use glam::DVec2;
use rayon::prelude::*;

use super::view::View;
use crate::photographs::scene::Scene;
use crate::photographs::world::background::TEXELS_PER_MM;
use crate::photographs::world::covers::Covers;
use crate::photographs::world::mips::{Footprint, Mips};
use crate::photographs::world::page::PrintedPage;
use deltille::raster::Gray;

/// Returns the number of samples along a pixel, proportional to the inverse of the blur and limited
/// to 4 … 8. With only four samples per pixel at the usual blur, edges were displaced by 0.002 px.
fn subpixels(blur_px: f64) -> usize {
    ((5.6 / blur_px.max(f64::EPSILON)).round() as usize).clamp(4, 8)
}

/// Radius of the Gaussian kernel, in standard deviations.
const REACH_SIGMAS: f64 = 4.0;

/// Number of samples that share a footprint on the page.
const BLOCK: usize = 16;

/// The scene in front of the camera.
pub(crate) struct Setting<'a> {
    pub page: &'a PrintedPage,
    pub view: &'a View,
    pub covers: &'a Covers,
    pub background: &'a Mips,
    /// Position of the page on the texture of the background, texels.
    pub shift: DVec2,
    /// Texture of the covers.
    pub skin: &'a Mips,
    pub light: &'a Light,
}

/// Uneven illumination.
#[derive(Clone, Debug)]
pub struct Light {
    /// Relative change of the light per pixel.
    pub slope: DVec2,
    /// Light lost in the image corners.
    pub vignetting: f64,
    /// Glare spots reflected by the paper.
    pub spots: Vec<Spot>,
    /// Direction of the camera motion during the exposure.
    pub motion: DVec2,
}

/// A glare spot: a Gaussian with elliptic contours.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Its centre, px.
    pub at: DVec2,
    /// Standard deviations along its two axes, px.
    pub sigma_px: [f64; 2],
    /// Direction of the first axis.
    pub along: DVec2,
    /// Peak brightness, as a fraction of the sensor's full scale.
    pub peak: f64,
}

impl Spot {
    fn light(&self, place: DVec2) -> f64 {
        let off = place - self.at;
        let (u, v) =
            (off.dot(self.along) / self.sigma_px[0], off.dot(self.along.perp()) / self.sigma_px[1]);
        self.peak * (-0.5 * (u * u + v * v)).exp()
    }
}

impl Light {
    /// Returns the light at an image position, relative to the centre.
    pub fn even_part(&self, place: DVec2, size_px: [usize; 2]) -> f64 {
        let half = DVec2::new(size_px[0] as f64, size_px[1] as f64) / 2.0;
        let off = place - half;
        let r2 = off.length_squared() / half.length_squared();
        (1.0 + off.dot(self.slope)).max(0.0) * (1.0 - self.vignetting * r2)
    }

    /// Returns the light that glare adds at a position.
    pub fn glare(&self, place: DVec2) -> f64 {
        self.spots.iter().map(|spot| spot.light(place)).sum()
    }
}

/// Returns the light on every pixel; 1 is the full scale of the sensor.
pub(crate) fn expose(setting: &Setting, scene: &Scene) -> Gray<f32> {
    // Motion brings in light from outside the image.
    let margin =
        (0.5 * scene.motion_px).ceil() as usize + if scene.motion_px > 0.0 { 2 } else { 0 };
    let still = gathered(setting, scene, margin);
    let [width, height] = setting.view.size_px;
    let moved = moved(&still, setting.light.motion * scene.motion_px, margin, [width, height]);
    let light = setting.light;
    Gray::from_fn(width, height, |x, y| {
        let place = DVec2::new(x as f64, y as f64);
        let even = light.even_part(place, [width, height]);
        (f64::from(moved.at(x, y)) * even + light.glare(place)) as f32
    })
}

/// Returns the weights of the samples for a pixel, starting `reach` pixels before its first sample.
fn kernel(sigma_px: f64, reach: usize) -> Vec<f32> {
    let subpixels = subpixels(sigma_px);
    let count = (2 * reach + 1) * subpixels;
    let weight = |k: usize| {
        let delta = (k as f64 + 0.5) / subpixels as f64 - 0.5 - reach as f64;
        if sigma_px == 0.0 {
            return f64::from(u8::from(delta.abs() < 0.5));
        }
        let erf = |d: f64| libm::erf(d / (std::f64::consts::SQRT_2 * sigma_px));
        erf(delta + 0.5) - erf(delta - 0.5)
    };
    let total: f64 = (0..count).map(weight).sum();
    (0..count).map(|k| (weight(k) / total) as f32).collect()
}

/// Returns the blurred image with a margin.
fn gathered(setting: &Setting, scene: &Scene, margin: usize) -> Gray<f32> {
    let reach = (REACH_SIGMAS * scene.blur_px).ceil() as usize;
    let (subpixels, kernel) = (subpixels(scene.blur_px), kernel(scene.blur_px, reach));
    let [width, height] = setting.view.size_px.map(|size| size + 2 * margin);
    let rows = (height + 2 * reach) * subpixels;
    // Each row of samples is gathered along the row at once.
    let mut across: Gray<f32> = Gray::new(width, rows);
    across.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(row, pixels)| {
        let place = |k: usize| (k as f64 + 0.5) / subpixels as f64 - 0.5 - (reach + margin) as f64;
        let samples =
            sample_row(setting, scene, place(row), (width + 2 * reach) * subpixels, &place);
        for (x, pixel) in pixels.iter_mut().enumerate() {
            let from = &samples[x * subpixels..];
            *pixel = kernel.iter().zip(from).map(|(w, v)| w * v).sum();
        }
    });
    let mut out: Gray<f32> = Gray::new(width, height);
    out.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, pixels)| {
        for (k, &w) in kernel.iter().enumerate() {
            for (sum, value) in pixels.iter_mut().zip(across.row(y * subpixels + k)) {
                *sum += w * value;
            }
        }
    });
    out
}

/// Returns a row of samples; `place` maps a sample to its pixel coordinate.
fn sample_row(
    setting: &Setting,
    scene: &Scene,
    y: f64,
    count: usize,
    place: &dyn Fn(usize) -> f64,
) -> Vec<f32> {
    let &Setting { page, view, background, shift, skin, .. } = setting;
    let covers = setting.covers.in_row(y);
    let step = 1.0 / subpixels(scene.blur_px) as f64;
    let (white, black) = (scene.white as f32, (scene.white / scene.contrast) as f32);
    let mut samples = Vec::with_capacity(count);
    let mut areas: Option<(Footprint, Footprint)> = None;
    for k in 0..count {
        let at = DVec2::new(place(k), y);
        if k % BLOCK == 0 {
            let x = place((k + BLOCK / 2).min(count - 1));
            areas = sides(view, DVec2::new(x, y), step).map(|[across, down]| {
                let [right, below] = [across, down].map(|side| side * TEXELS_PER_MM);
                (page.footprint(across, down), background.footprint(right, below))
            });
        }
        if !covers.is_empty()
            && let Some(tone) = covers.tone(at)
        {
            // The skin texture is fixed to the image, not to the page.
            let grain = skin.area(at * 2.0, &skin.footprint(DVec2::X * 0.5, DVec2::Y * 0.5));
            samples.push((tone as f32) * white * grain / 128.0);
            continue;
        }
        let Some((on_page, around)) = &areas else {
            samples.push(0.3 * white);
            continue;
        };
        let seen = view.page_from_px(at);
        let light = match seen.and_then(|place| page.whiteness(place, on_page)) {
            Some(whiteness) => black + (white - black) * whiteness,
            None => {
                let table = if view.curl.is_none() { seen } else { view.table_from_px(at) };
                let texel = table.unwrap_or(DVec2::ZERO) * TEXELS_PER_MM + shift;
                background.area(texel, around) / 255.0 * white
            }
        };
        samples.push(light);
    }
    samples
}

/// Returns a step to the right and a step down, as vectors on the page, mm.
fn sides(view: &View, px: DVec2, step: f64) -> Option<[DVec2; 2]> {
    let locate = |at| view.page_from_px(at).or_else(|| view.table_from_px(at));
    let (here, right, below) =
        (locate(px)?, locate(px + DVec2::X * step)?, locate(px + DVec2::Y * step)?);
    Some([right - here, below - here])
}

/// Averages an image along a straight motion, and cuts off its margin.
///
/// The image is already band-limited, so the cubic of Catmull–Rom interpolates it. The mean of all shifts is then a
/// single kernel with few entries.
fn moved(image: &Gray<f32>, along: DVec2, margin: usize, [width, height]: [usize; 2]) -> Gray<f32> {
    let length = along.length();
    if length == 0.0 {
        return Gray::from_fn(width, height, |x, y| image.at(x + margin, y + margin));
    }
    /// Number of shifts per pixel of motion.
    const SHIFTS: f64 = 8.0;
    let shifts = (length * SHIFTS).ceil() as usize;
    let side = 2 * margin + 1;
    let mut kernel = vec![0.0; side * side];
    for shift in 0..shifts {
        let t = (shift as f64 + 0.5) / shifts as f64 - 0.5;
        let [u, v] = (along * t).to_array();
        for (j, line) in kernel.chunks_exact_mut(side).enumerate() {
            let wy = catmull_rom(j as f64 - margin as f64 - v);
            for (i, weight) in line.iter_mut().enumerate() {
                *weight += wy * catmull_rom(i as f64 - margin as f64 - u) / shifts as f64;
            }
        }
    }
    let taps: Vec<(usize, usize, f32)> = (0..side * side)
        .filter(|&k| kernel[k] != 0.0)
        .map(|k| (k % side, k / side, kernel[k] as f32))
        .collect();
    let mut out: Gray<f32> = Gray::new(width, height);
    out.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, pixels)| {
        for &(i, j, weight) in &taps {
            for (sum, value) in pixels.iter_mut().zip(&image.row(y + j)[i..]) {
                *sum += weight * value;
            }
        }
    });
    out
}

fn catmull_rom(x: f64) -> f64 {
    let x = x.abs();
    match x {
        _ if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
        _ if x < 2.0 => ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_have_the_requested_width() {
        for sigma_px in [0.0, 0.5, 2.0] {
            let reach = (REACH_SIGMAS * sigma_px).ceil() as usize;
            let (subpixels, kernel) = (subpixels(sigma_px), kernel(sigma_px, reach));
            let place = |k: usize| (k as f64 + 0.5) / subpixels as f64 - 0.5 - reach as f64;
            let variance: f64 =
                kernel.iter().enumerate().map(|(k, &w)| f64::from(w) * place(k).powi(2)).sum();
            // The box of the pixel has a variance of 1/12; sampling reduces it slightly.
            let box_variance = (1.0 - 1.0 / (subpixels * subpixels) as f64) / 12.0;
            let expected = sigma_px * sigma_px + box_variance;
            assert!(
                (variance - expected).abs() < 0.01 * (1.0 + expected),
                "{sigma_px}: {variance}"
            );
        }
    }

    #[test]
    fn motion_spreads_a_point_along_its_line() {
        let mut point: Gray<f32> = Gray::new(41, 41);
        point.row_mut(20)[20] = 1.0;
        let along = DVec2::new(6.0, 8.0);
        let line = moved(&point, along, 7, [27, 27]);
        let moment = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            (0..27 * 27)
                .map(|k| {
                    let (x, y) = ((k % 27) as f64 - 13.0, (k / 27) as f64 - 13.0);
                    f64::from(line.at(k % 27, k / 27)) * f(x, y)
                })
                .sum()
        };
        assert!((moment(&|_, _| 1.0) - 1.0).abs() < 1e-3);
        assert!(moment(&|x, _| x).abs() < 1e-3 && moment(&|_, y| y).abs() < 1e-3);
        // A uniform density over ±5 px: 100/12 along the line, almost zero across it.
        assert!((moment(&|x, y| (0.6 * x + 0.8 * y).powi(2)) - 100.0 / 12.0).abs() < 0.2);
        assert!(moment(&|x, y| (0.8 * x - 0.6 * y).powi(2)).abs() < 0.2);
    }
}
