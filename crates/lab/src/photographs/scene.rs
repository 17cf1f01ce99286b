//! Parameters that determine how a page is seen and recorded.

use serde::Serialize;

/// A scene without its random parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// Width and height of the sensor, px.
    pub size_px: [usize; 2],
    /// Size of a tag's bit in the middle of the board, px, before foreshortening by tilt.
    pub bit_px: f64,
    /// Angle between the sheet and the sensor, degrees; `None` for a random one up to [`MAX_TILT_DEG`].
    pub tilt_deg: Option<f64>,
    /// Sag of the bent sheet over the width of the board, as a fraction of that width.
    pub curl: f64,
    /// Growth of dark areas on every side, as a fraction of an edge.
    pub edge_shift: f64,
    /// Surroundings of the page.
    pub background: Background,
    /// Fraction of the corners that lies under hands and other objects.
    pub covered: f64,

    /// Light from bare paper as a fraction of full scale, at an exposure of 1.
    pub white: f64,
    /// Ratio of the light from paper to that from ink.
    pub contrast: f64,
    /// Relative change of illumination from one side of the image to the other.
    pub gradient: f64,
    /// Light lost in the image corners.
    pub vignetting: f64,
    /// Number of glare spots.
    pub glare: u32,
    /// Standard deviation of the blur, px, in addition to that of the pixels.
    pub blur_px: f64,
    /// Length of a straight motion during the exposure, px.
    pub motion_px: f64,

    /// Gain applied before clipping.
    pub exposure: f64,
    /// Standard deviation of the noise at full scale, in linear light. Half of the variance is proportional to the
    /// light.
    pub noise: f64,
    /// Recording of colours.
    pub mosaic: Mosaic,
    /// Noise reduction: standard deviation of the brightness differences that are averaged, as a multiple of the noise;
    /// 0 for none.
    pub denoising: f64,
    /// Tone curve from light to grey values.
    pub tone: Tone,
    /// Sharpening: multiple of the detail removed by a blur of [`SHARPENING_PX`] that is added.
    pub sharpening: f64,
    /// Quality of JPEG compression; `None` for none.
    pub jpeg: Option<u8>,
    /// Width to which the image is resized, px.
    pub width_px: Option<u32>,
}

/// Largest tilt if none is given, degrees.
pub const MAX_TILT_DEG: f64 = 50.0;

/// Standard deviation of the blur that sharpening undoes, px.
pub const SHARPENING_PX: f64 = 1.2;

impl Default for Scene {
    /// A good photograph: evenly sharp, four pixels per bit, with the tone curve of common files.
    fn default() -> Self {
        Self {
            size_px: [960, 720],
            bit_px: 4.0,
            tilt_deg: None,
            curl: 0.0,
            edge_shift: 0.0,
            background: Background::Texture,
            covered: 0.0,
            white: 0.7,
            contrast: 16.0,
            gradient: 0.15,
            vignetting: 0.15,
            glare: 0,
            blur_px: 0.7,
            motion_px: 0.0,
            exposure: 1.0,
            noise: 0.005,
            mosaic: Mosaic::None,
            denoising: 0.0,
            tone: Tone::Srgb,
            sharpening: 0.0,
            jpeg: None,
            width_px: None,
        }
    }
}

impl Scene {
    /// Returns the processing of an ordinary telephone: mosaic, noise reduction, contrast, sharpening and compression.
    pub fn phone() -> Self {
        Self {
            mosaic: Mosaic::Edges,
            denoising: 3.0,
            tone: Tone::SoftS,
            sharpening: 0.6,
            jpeg: Some(92),
            ..Self::default()
        }
    }

    /// Returns the number of file pixels per sensor pixel.
    pub fn scale(&self) -> f64 {
        self.width_px.map_or(1.0, |width| f64::from(width) / self.size_px[0] as f64)
    }
}

/// Surroundings of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Background {
    /// A grey table.
    Plain,
    /// Texture at all scales.
    Texture,
    /// Many objects with sharp edges.
    Clutter,
}

/// Recording of colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mosaic {
    /// A grey sensor.
    None,
    /// Bayer filters, colours interpolated bilinearly.
    Bilinear,
    /// Bayer filters, green interpolated along edges and the other colours as differences to green.
    Edges,
}

/// Tone curve from linear light, 0 to 1, to grey values, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tone {
    /// Linear.
    Linear,
    /// x^(1/γ).
    Gamma(f64),
    /// IEC 61966-2-1.
    Srgb,
    /// sRGB with more contrast in the mid-tones: 3g² − 2g³ averaged with g.
    SoftS,
    /// A logistic curve applied to sRGB, as in picture styles of cameras.
    SteepS,
}

impl Tone {
    /// Returns the grey value for an amount of light.
    pub fn grey(self, light: f32) -> f32 {
        let light = light.clamp(0.0, 1.0);
        match self {
            Self::Linear => light,
            Self::Gamma(gamma) => light.powf(1.0 / gamma as f32),
            Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
            Self::SoftS => {
                let grey = Self::Srgb.grey(light);
                0.5 * grey + 0.5 * grey * grey * (3.0 - 2.0 * grey)
            }
            Self::SteepS => {
                const STEEPNESS: f32 = 6.0;
                let logistic = |grey: f32| 1.0 / (1.0 + (-STEEPNESS * (grey - 0.5)).exp());
                let (low, high) = (logistic(0.0), logistic(1.0));
                (logistic(Self::Srgb.grey(light)) - low) / (high - low)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_curves_rise_from_black_to_white() {
        for tone in [Tone::Linear, Tone::Gamma(2.2), Tone::Srgb, Tone::SoftS, Tone::SteepS] {
            let grey: Vec<f32> = (0..=100u8).map(|i| tone.grey(f32::from(i) / 100.0)).collect();
            assert!(grey[0].abs() < 1e-6 && (grey[100] - 1.0).abs() < 1e-6, "{tone:?}");
            assert!(grey.is_sorted_by(|a, b| a < b), "{tone:?}");
        }
        assert!((Tone::Srgb.grey(0.214_04) - 0.5).abs() < 1e-4);
    }
}
