//! The varied quantities, one at a time.

use super::scene::{Background, Mosaic, Scene, Tone};

/// The varied quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Standard deviation of the blur, px.
    Blur,
    /// Length of a straight motion during the exposure, px.
    Motion,
    /// Noise, % of full scale.
    Noise,
    /// Quality of JPEG compression.
    Jpeg,
    /// Tone curve.
    Tone,
    /// Gain of the exposure.
    Exposure,
    /// Ratio of the light from paper to that from ink.
    Contrast,
    /// Angle between sheet and sensor, degrees.
    Tilt,
    /// Size of a tag's bit, px.
    Distance,
    /// Fraction of the corners that is covered, %.
    Covers,
    /// Number of glare spots.
    Glare,
    /// Sag of the bent sheet, % of the board's width.
    Curl,
    /// Growth of dark areas on every side, % of an edge.
    EdgeShift,
    /// Width to which the image is resized, px.
    Scale,
    /// Demosaicing method.
    Mosaic,
    /// Gain of the exposure behind colour filters.
    ColourExposure,
    /// Width relative to the sensor to which the colour image is resized.
    Resampling,
    /// Processing between the sensor and the file.
    Processing,
    /// Sharpening, as a multiple of the detail that a blur removes.
    Sharpening,
    /// Change of illumination from one side of the image to the other.
    Light,
    /// Surroundings of the page.
    Background,
}

/// One level of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Its value or name, in tables and file names.
    pub name: String,
    /// The default scene with this one change.
    pub scene: Scene,
}

impl Axis {
    /// All axes, in the order of the report.
    pub const ALL: [Self; 21] = [
        Self::Blur,
        Self::Motion,
        Self::Noise,
        Self::Jpeg,
        Self::Tone,
        Self::Exposure,
        Self::Contrast,
        Self::Tilt,
        Self::Distance,
        Self::Covers,
        Self::Glare,
        Self::Curl,
        Self::EdgeShift,
        Self::Scale,
        Self::Mosaic,
        Self::ColourExposure,
        Self::Resampling,
        Self::Processing,
        Self::Sharpening,
        Self::Light,
        Self::Background,
    ];

    /// Returns the name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blur => "blur",
            Self::Motion => "motion",
            Self::Noise => "noise",
            Self::Jpeg => "jpeg",
            Self::Tone => "tone",
            Self::Exposure => "exposure",
            Self::Contrast => "contrast",
            Self::Tilt => "tilt",
            Self::Distance => "distance",
            Self::Covers => "covers",
            Self::Glare => "glare",
            Self::Curl => "curl",
            Self::EdgeShift => "edge-shift",
            Self::Scale => "scale",
            Self::Mosaic => "mosaic",
            Self::ColourExposure => "colour-exposure",
            Self::Resampling => "resampling",
            Self::Processing => "processing",
            Self::Sharpening => "sharpening",
            Self::Light => "light",
            Self::Background => "background",
        }
    }

    /// Returns the label of its levels in plots.
    pub fn label(self) -> &'static str {
        match self {
            Self::Blur => "blur, px",
            Self::Motion => "motion, px",
            Self::Noise => "noise, % of full scale",
            Self::Jpeg => "JPEG quality",
            Self::Tone => "tone curve",
            Self::Exposure => "exposure gain",
            Self::Contrast => "contrast ratio",
            Self::Tilt => "tilt, °",
            Self::Distance => "size of a bit, px",
            Self::Covers => "covered, %",
            Self::Glare => "glare spots",
            Self::Curl => "sag of the sheet, % of the board width",
            Self::EdgeShift => "growth of dark areas, % of an edge",
            Self::Scale => "image width after resizing, px",
            Self::Mosaic => "mosaic",
            Self::ColourExposure => "exposure gain, colour",
            Self::Resampling => "width relative to the sensor, colour",
            Self::Processing => "processing",
            Self::Sharpening => "sharpening factor",
            Self::Light => "illumination change across the image, ± %",
            Self::Background => "background",
        }
    }

    /// Returns the levels.
    pub fn levels(self) -> Vec<Level> {
        let numbers = |values: &[f64], set: fn(&mut Scene, f64)| {
            values
                .iter()
                .map(|&value| {
                    let mut scene = Scene::default();
                    set(&mut scene, value);
                    Level { name: format!("{value}"), scene }
                })
                .collect()
        };
        let named = |scenes: Vec<(&str, Scene)>| {
            scenes.into_iter().map(|(name, scene)| Level { name: name.to_owned(), scene }).collect()
        };
        let scene = Scene::default;
        match self {
            Self::Blur => numbers(&[0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0], |s, v| s.blur_px = v),
            Self::Motion => numbers(&[0.0, 1.5, 3.0, 5.0, 7.0, 10.0, 15.0], |s, v| s.motion_px = v),
            Self::Noise => {
                numbers(&[0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0], |s, v| s.noise = v / 100.0)
            }
            Self::Jpeg => {
                numbers(&[95.0, 92.0, 85.0, 75.0, 50.0, 35.0, 20.0], |s, v| s.jpeg = Some(v as u8))
            }
            Self::Tone => named(vec![
                ("linear", Scene { tone: Tone::Linear, ..scene() }),
                ("1.4", Scene { tone: Tone::Gamma(1.4), ..scene() }),
                ("1.8", Scene { tone: Tone::Gamma(1.8), ..scene() }),
                ("2.2", Scene { tone: Tone::Gamma(2.2), ..scene() }),
                ("2.6", Scene { tone: Tone::Gamma(2.6), ..scene() }),
                ("sRGB", Scene { tone: Tone::Srgb, ..scene() }),
                ("soft s", Scene { tone: Tone::SoftS, ..scene() }),
                ("steep s", Scene { tone: Tone::SteepS, ..scene() }),
            ]),
            Self::Exposure => {
                numbers(&[0.02, 0.05, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0], |s, v| s.exposure = v)
            }
            Self::Contrast => {
                numbers(&[1.1, 1.2, 1.5, 2.0, 4.0, 16.0, 50.0], |s, v| s.contrast = v)
            }
            Self::Tilt => {
                numbers(&[0.0, 15.0, 30.0, 45.0, 55.0, 65.0, 70.0, 75.0, 80.0], |s, v| {
                    s.tilt_deg = Some(v);
                })
            }
            Self::Distance => {
                numbers(&[8.0, 6.0, 4.0, 3.0, 2.0, 1.5, 1.25, 1.0], |s, v| s.bit_px = v)
            }
            Self::Covers => {
                numbers(&[0.0, 10.0, 20.0, 40.0, 60.0, 75.0], |s, v| s.covered = v / 100.0)
            }
            Self::Glare => numbers(&[0.0, 1.0, 2.0, 3.0, 5.0], |s, v| s.glare = v as u32),
            Self::Curl => numbers(&[0.0, 1.0, 2.0, 4.0, 8.0, 12.0], |s, v| s.curl = v / 100.0),
            Self::EdgeShift => {
                numbers(&[-15.0, -10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 12.0], |s, v| {
                    s.edge_shift = v / 100.0;
                })
            }
            Self::Scale => {
                numbers(&[600.0, 960.0, 1600.0, 2400.0, 4000.0, 6000.0, 8000.0, 12000.0], |s, v| {
                    s.width_px = Some(v as u32)
                })
            }
            Self::Mosaic => named(vec![
                ("none", scene()),
                ("bilinear", Scene { mosaic: Mosaic::Bilinear, ..scene() }),
                ("edges", Scene { mosaic: Mosaic::Edges, ..scene() }),
            ]),
            Self::ColourExposure => numbers(&[1.0, 2.0, 3.0, 5.0, 8.0], |s, v| {
                *s = Scene { mosaic: Mosaic::Edges, exposure: v, ..Scene::default() };
            }),
            Self::Resampling => numbers(&[1.0, 0.75, 0.5], |s, v| {
                let width_px = Some((v * s.size_px[0] as f64).round() as u32);
                // A bit has three pixels at half the width.
                *s = Scene { mosaic: Mosaic::Edges, bit_px: 6.0, width_px, ..Scene::default() };
            }),
            Self::Processing => named(vec![
                ("none", scene()),
                ("mosaic", Scene { mosaic: Mosaic::Edges, ..scene() }),
                ("phone", Scene::phone()),
            ]),
            Self::Sharpening => numbers(&[0.0, 0.3, 0.6, 1.0, 1.5, 2.5], |s, v| s.sharpening = v),
            Self::Light => {
                numbers(&[0.0, 15.0, 30.0, 60.0, 80.0], |s, v| s.gradient = 2.0 * v / 100.0)
            }
            Self::Background => named(vec![
                ("plain", Scene { background: Background::Plain, ..scene() }),
                ("texture", scene()),
                ("clutter", Scene { background: Background::Clutter, ..scene() }),
            ]),
        }
    }
}

impl std::str::FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|axis| axis.name() == text);
        found.ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|axis| axis.name()).collect();
            format!("unknown axis `{text}` (known: {})", names.join(", "))
        })
    }
}
