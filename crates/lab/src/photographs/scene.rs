//! All that decides how a page is seen and recorded.

use serde::Serialize;

/// A scene, but for what chance decides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// Width and height of the sensor, px.
    pub size_px: [usize; 2],
    /// Size of a tag's bit in the middle of the board, px, before the tilt shortens it.
    pub bit_px: f64,
    /// Angle between the sheet and the sensor, degrees; `None` for any up to [`MOST_TILT_DEG`].
    pub tilt_deg: Option<f64>,
    /// Sag of the bent sheet over the width of the board, as a part of it.
    pub curl: f64,
    /// What lies around the page.
    pub background: Background,
    /// Part of the corners that lies under hands and other things.
    pub covered: f64,

    /// Light that bare paper sends, of what the sensor takes, at an exposure of 1.
    pub white: f64,
    /// Light of paper to light of ink.
    pub contrast: f64,
    /// Relative change of the light from one side of the picture to the other.
    pub gradient: f64,
    /// Light that is lost in the corners of the picture.
    pub vignetting: f64,
    /// Number of glare spots.
    pub glare: u32,
    /// Standard deviation of the blur, px, beside that of the pixels themselves.
    pub blur_px: f64,
    /// Length of a straight move during the exposure, px.
    pub motion_px: f64,

    /// Gain of everything before it is clipped.
    pub exposure: f64,
    /// Standard deviation of the noise at full scale, in linear light; half of the variance is the
    /// light's and grows with it.
    pub noise: f64,
    /// How colours are recorded.
    pub mosaic: Mosaic,
    /// From light to grey values.
    pub tone: Tone,
    /// How much of what a blur of [`SHARPENING_PX`] takes away is added.
    pub sharpening: f64,
    /// Quality of JPEG compression; `None` for none.
    pub jpeg: Option<u8>,
    /// Width to which the picture is enlarged or reduced, px.
    pub width_px: Option<u32>,
}

/// Largest tilt where none is given, degrees.
pub const MOST_TILT_DEG: f64 = 50.0;

/// Standard deviation of the blur that sharpening undoes, px.
pub const SHARPENING_PX: f64 = 1.2;

impl Default for Scene {
    /// A good photograph: all of it at four pixels a bit, and the tone curve that files have.
    fn default() -> Self {
        Self {
            size_px: [960, 720],
            bit_px: 4.0,
            tilt_deg: None,
            curl: 0.0,
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
            tone: Tone::Srgb,
            sharpening: 0.0,
            jpeg: None,
            width_px: None,
        }
    }
}

impl Scene {
    /// Size of a pixel of the file in pixels of the sensor, inverted.
    pub fn scale(&self) -> f64 {
        self.width_px.map_or(1.0, |width| f64::from(width) / self.size_px[0] as f64)
    }
}

/// What lies around the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Background {
    /// A grey table.
    Plain,
    /// Grain of all sizes.
    Texture,
    /// Many things with sharp edges.
    Clutter,
}

/// How colours are recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mosaic {
    /// A grey sensor.
    None,
    /// Bayer's filters, colours interpolated bilinearly.
    Bilinear,
    /// The same, green interpolated along edges and the others as differences to it.
    Edges,
}

/// From linear light, 0 to 1, to grey values, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tone {
    /// As it is.
    Linear,
    /// x^(1/γ).
    Gamma(f64),
    /// IEC 61966-2-1.
    Srgb,
    /// sRGB, then more contrast in the middle: 3g² − 2g³ mixed half and half with g.
    SoftS,
    /// A logistic curve over sRGB, as picture styles have it.
    SteepS,
}

impl Tone {
    /// The grey value of an amount of light.
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
