//! Tone curves: the grey values that a camera assigns to light.
//!
//! A curve is stored as its inverse, the light q(y) of a grey value y. The inverse is smooth near black, where the
//! curve itself is steep. The slope of an unknown curve is modelled by powers of the distances from
//! black and white. The model covers gammas (p₁ = γ − 1), sRGB and s-curves (p₁ and p₃),
//!
//! ```text
//!     ln q'(y) = p₁ ln(y + δ) + p₂ t + p₃ ln(1 − y + δ) + const,      t = (y − middle)/half
//! ```
//!
//! so that q rises for all values of p; p = 0 is a linear camera. A corner covers the
//! part of the curve between its own black and white. With both axes scaled so that these are −1
//! and 1, this part is
//!
//! ```text
//!     T(S) = S + (1 − S²)·(κ₀ + κ₁ S + … + κ₅ S⁵)
//! ```
//!
//! The polynomial T interpolates the curve at eight points. Between 5 % and 100 % of the light, it
//! is within 0.3 % of gamma 2.6.
//! The constant κ₀ displaces corners, see `docs/formulation.md`, “Measured corners”.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::quantity;

/// The tone curve of a camera, known or to be estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Tone {
    /// Estimated from the corners of each image.
    #[default]
    Auto,
    /// Grey values are linear in light.
    Linear,
    /// The curve of sRGB (IEC 61966-2-1).
    Srgb,
    /// Grey = light^(1/γ).
    Gamma(f64),
}

/// Range of gammas of real cameras. Beyond it the ends of the curve are too steep for the resolution of grey values.
const GAMMAS: std::ops::RangeInclusive<f64> = 0.3..=4.0;

impl Tone {
    /// Returns the grey value of a light, both relative to full scale; linear if the curve is unknown.
    pub fn grey(self, light: f64) -> f64 {
        match self {
            Self::Auto | Self::Linear => light,
            Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
            Self::Srgb => 1.055 * light.powf(1.0 / 2.4) - 0.055,
            Self::Gamma(gamma) => light.max(0.0).powf(1.0 / gamma),
        }
    }
}

impl std::str::FromStr for Tone {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "linear" => Ok(Self::Linear),
            "srgb" => Ok(Self::Srgb),
            _ => match text.parse() {
                Ok(gamma) if GAMMAS.contains(&gamma) => Ok(Self::Gamma(gamma)),
                _ => Err("expected auto, linear, srgb or a gamma from 0.3 to 4".to_owned()),
            },
        }
    }
}

/// The tone curve estimated in an image, between the median black and white of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ToneEstimate {
    /// Median black of the corners, relative to full scale.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub black: f64,
    /// Median white of the corners, relative to full scale.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub white: f64,
    /// Curvature κ₀ between black and white: grey = middle + half·(S + (1 − S²)(κ₀ + κ₁ S + …)); 0 is linear,
    /// positive values brighten.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub kappa: f64,
    /// Standard deviation of κ₀.
    #[serde(alias = "kappa_deviation", deserialize_with = "quantity::deviation::de")]
    pub kappa_sd: f64,
    /// The next coefficient of the curve, κ₁.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub kappa_odd: f64,
    /// Whether the curve differs significantly from a line. Only then was it used to locate corners.
    pub used: bool,
}

impl ToneEstimate {
    /// Creates a curve between black and white, relative to full scale, from its curvature κ₀ and the standard
    /// deviation of κ₀. It is marked as not used, and κ₁ is 0.
    pub fn new([black, white]: [f64; 2], kappa: f64, kappa_sd: f64) -> Self {
        Self { black, white, kappa, kappa_sd, kappa_odd: 0.0, used: false }
    }
}

/// Number of parameters of an unknown curve.
pub const TONE_PARAMS: usize = 3;

/// Number of terms of a corner's part of a curve.
pub const TERMS: usize = 6;

/// Grid of tabulated grey values; it extends beyond full scale for corners with clipped white.
const LOWEST: f64 = -0.5;
const STEP: f64 = 1.0 / 64.0;
const NODES: usize = 193;

/// Number of slope samples: at the nodes and half-way between them.
const SLOPE_SAMPLES: usize = 2 * NODES - 1;

/// Logarithms of the distances of the slope samples from black and white.
static TO_ENDS: LazyLock<Vec<[f64; 2]>> =
    LazyLock::new(|| (0..SLOPE_SAMPLES).map(|i| to_ends(sample_grey(i))).collect());

/// Distance δ from black and white below which the slope of an estimated curve is constant. Few
/// grey values are closer. The corresponding distance of sRGB is twice as large.
const END: f64 = 0.03;

/// Toe of a power curve, relative to full scale, half that of sRGB. Below it the curve is a line.
const TOE: f64 = 0.02;

/// Reach of an estimated curve, in half ranges of the grey values it was estimated from. The slope is constant beyond
/// it.
const REACH: f64 = 1.25;

/// Upper limit of the sum of lights divided by their difference, which scales slopes of the light.
const MAX_RATIO: f64 = 20.0;

/// Light as a function of the grey value, tabulated with its slope.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    light: Vec<f64>,
    slope: Vec<f64>,
}

/// The part of a curve between a corner's black and white.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Piece {
    /// Coefficients κ₀ … κ₅.
    pub terms: [f32; TERMS],
    /// Mean of the light of black and white, divided by half their difference.
    pub ratio: f32,
}

/// Returns the grey value of a slope sample.
fn sample_grey(i: usize) -> f64 {
    LOWEST + 0.5 * STEP * i as f64
}

/// Returns the logarithms of a grey value's distances from black and white.
fn to_ends(y: f64) -> [f64; 2] {
    [y, 1.0 - y].map(|d| (d.max(0.0) + END).ln())
}

impl Curve {
    /// Returns the curve of a known tone; `None` if it is linear or unknown.
    pub fn of(tone: Tone) -> Option<Self> {
        match tone {
            Tone::Auto | Tone::Linear => None,
            Tone::Srgb => Some(Self::with_slope(|y| {
                if y <= 0.04045 {
                    1.0 / 12.92
                } else {
                    2.4 / 1.055 * ((y + 0.055) / 1.055).powf(1.4)
                }
            })),
            Tone::Gamma(gamma) => Some(Self::with_slope(|y| gamma * y.max(TOE).powf(gamma - 1.0))),
        }
    }

    /// Creates the curve with these parameters, estimated from grey values between `low` and `high`.
    pub fn estimated(params: [f64; TONE_PARAMS], [low, high]: [f64; 2]) -> Self {
        let (middle, half) = ((low + high) / 2.0, ((high - low) / 2.0).max(1e-6));
        let [p1, p2, p3] = params;
        let ln_slope = |y: f64, [to_black, to_white]: [f64; 2]| {
            p1 * to_black + p2 * (y - middle) / half + p3 * to_white
        };
        let at = |y: f64| ln_slope(y, to_ends(y));
        let (from, to) = (middle - REACH * half, middle + REACH * half);
        let at_middle = at(middle);
        let [slope_from, slope_to] = [from, to].map(|y| (at(y) - at_middle).exp());
        let slopes = TO_ENDS.iter().enumerate().map(|(i, &to_ends)| {
            let y = sample_grey(i);
            if y < from {
                slope_from
            } else if y > to {
                slope_to
            } else {
                (ln_slope(y, to_ends) - at_middle).exp()
            }
        });
        Self::with_slopes(&slopes.collect::<Vec<f64>>())
    }

    fn with_slope(slope: impl Fn(f64) -> f64) -> Self {
        Self::with_slopes(&(0..SLOPE_SAMPLES).map(|i| slope(sample_grey(i))).collect::<Vec<f64>>())
    }

    /// Creates the curve with these slopes of the light at the nodes and half-way between them.
    fn with_slopes(slopes: &[f64]) -> Self {
        let mut light = Vec::with_capacity(NODES);
        let mut sum = 0.0;
        light.push(sum);
        for three in slopes.windows(3).step_by(2) {
            // Simpson's rule.
            sum += STEP / 6.0 * (three[0] + 4.0 * three[1] + three[2]);
            light.push(sum);
        }
        let zero = light[(-LOWEST / STEP) as usize];
        light.iter_mut().for_each(|q| *q -= zero);
        Self { light, slope: slopes.iter().copied().step_by(2).collect() }
    }

    /// Returns the light of a grey value.
    fn light(&self, grey: f64) -> f64 {
        let place = (grey - LOWEST) / STEP;
        let i = (place.max(0.0) as usize).min(NODES - 2);
        let t = place - i as f64;
        if !(0.0..=1.0).contains(&t) {
            let end = if t < 0.0 { 0 } else { NODES - 1 };
            return self.light[end] + (place - end as f64) * STEP * self.slope[end];
        }
        // Cubic Hermite interpolation.
        let [q0, q1] = [self.light[i], self.light[i + 1]];
        let [d0, d1] = [self.slope[i] * STEP, self.slope[i + 1] * STEP];
        let rise = q1 - q0;
        q0 + t * (d0 + t * ((3.0 * rise - 2.0 * d0 - d1) + t * (d0 + d1 - 2.0 * rise)))
    }

    /// Returns the grey value of a light.
    fn grey(&self, light: f64) -> f64 {
        let i = self.light.partition_point(|&q| q < light).clamp(1, NODES - 1) - 1;
        let [q0, q1] = [self.light[i], self.light[i + 1]];
        let first = LOWEST + STEP * i as f64;
        let mut grey = first + STEP * ((light - q0) / (q1 - q0).max(f64::MIN_POSITIVE));
        let slope = self.slope[i].max(self.slope[i + 1]).max(1e-9);
        for _ in 0..2 {
            grey += (light - self.light(grey)) / slope;
        }
        grey
    }

    /// Returns the part of the curve for a corner with this level and amplitude, both grey values.
    pub fn piece(&self, level: f64, amplitude: f64) -> Piece {
        let [dark, bright] = [level - amplitude, level + amplitude].map(|y| self.light(y));
        let (middle, half) = ((bright + dark) / 2.0, (bright - dark) / 2.0);
        if half.abs() < 1e-9 {
            return Piece::line(level, amplitude);
        }
        let excess = CHEBYSHEV.map(|s| {
            let grey = (self.grey(middle + half * s) - level) / amplitude;
            (grey - s) / (1.0 - s * s)
        });
        let ratio = (middle / half).clamp(-MAX_RATIO, MAX_RATIO) as f32;
        Piece { terms: interpolated(excess).map(|k| k as f32), ratio }
    }
}

impl Piece {
    /// Creates the part of a linear curve.
    pub fn line(level: f64, amplitude: f64) -> Self {
        let ratio = (level / amplitude).clamp(-MAX_RATIO, MAX_RATIO);
        Self { terms: [0.0; TERMS], ratio: if ratio.is_finite() { ratio as f32 } else { 0.0 } }
    }

    /// Returns T(S) and its derivative.
    #[inline(always)]
    pub fn at(&self, s: f32) -> (f32, f32) {
        let (mut sum, mut slope) = (0.0, 0.0);
        for &term in self.terms.iter().rev() {
            slope = slope * s + sum;
            sum = sum * s + term;
        }
        let rest = 1.0 - s * s;
        (s + rest * sum, 1.0 - 2.0 * s * sum + rest * slope)
    }

    /// Returns (T(S) − S)/(1 − S²).
    #[inline(always)]
    pub fn bulge(&self, s: f32) -> f32 {
        self.terms.iter().rev().fold(0.0, |sum, term| sum * s + term)
    }
}

/// Chebyshev nodes between −1 and 1: cos(kπ/7).
const CHEBYSHEV: [f64; TERMS] = [
    0.900_968_867_902_419_1,
    0.623_489_801_858_733_5,
    0.222_520_933_956_314_4,
    -0.222_520_933_956_314_4,
    -0.623_489_801_858_733_5,
    -0.900_968_867_902_419_1,
];

/// Computes the coefficients of the polynomial with these values at [`CHEBYSHEV`], by Newton's divided differences.
fn interpolated(values: [f64; TERMS]) -> [f64; TERMS] {
    let mut divided = values;
    for order in 1..TERMS {
        for i in (order..TERMS).rev() {
            divided[i] = (divided[i] - divided[i - 1]) / (CHEBYSHEV[i] - CHEBYSHEV[i - order]);
        }
    }
    let mut terms = [0.0; TERMS];
    for i in (0..TERMS).rev() {
        // terms ← terms·(S − Sᵢ) + dᵢ
        for j in (1..TERMS).rev() {
            terms[j] = terms[j - 1] - CHEBYSHEV[i] * terms[j];
        }
        terms[0] = divided[i] - CHEBYSHEV[i] * terms[0];
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the piece of a tone curve between black and white at a corner with the curve.
    #[test]
    fn pieces_follow_their_curves() {
        for tone in [Tone::Gamma(1.6), Tone::Gamma(2.6), Tone::Srgb] {
            let curve = |light| tone.grey(light);
            let known = Curve::of(tone).unwrap();
            let [black, white] = [0.05, 0.6];
            let (level, amplitude) =
                ((curve(white) + curve(black)) / 2.0, (curve(white) - curve(black)) / 2.0);
            let piece = known.piece(level, amplitude);
            for i in -100..=100 {
                let s = f64::from(i) / 100.0;
                let light = (white + black) / 2.0 + (white - black) / 2.0 * s;
                let (t, _) = piece.at(s as f32);
                let grey = level + amplitude * f64::from(t);
                assert!((grey - curve(light)).abs() < 2e-3, "{tone:?} at {s}: {grey}");
            }
            let (up, down) = (piece.at(0.31).0, piece.at(0.29).0);
            assert!((piece.at(0.3).1 - (up - down) / 0.02).abs() < 1e-3);
            assert!((f64::from(piece.ratio) - (white + black) / (white - black)).abs() < 0.02);
        }
    }

    #[test]
    fn zero_parameters_give_a_line() {
        let piece = Curve::estimated([0.0; 3], [0.1, 0.8]).piece(0.4, -0.3);
        assert!(piece.terms.iter().all(|k| k.abs() < 1e-6));
        assert!((piece.ratio + 4.0 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn tones_parse_from_text() {
        assert_eq!("2.2".parse(), Ok(Tone::Gamma(2.2)));
        assert_eq!("srgb".parse(), Ok(Tone::Srgb));
        assert!("7".parse::<Tone>().is_err() && "log".parse::<Tone>().is_err());
    }
}
