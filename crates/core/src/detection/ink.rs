//! Ink spread (dot gain) of a print: the growth of its dark areas.
//!
//! Ink spread belongs to the print, not to the image. It displaces corners on the paper as tone curves displace them
//! in the image. Line crossings and tilt separate the two effects.

use serde::{Deserialize, Serialize};

use crate::quantity;
use crate::statistics::median;
use crate::words::places;

/// Ink spread of the print, known or to be estimated: the growth of dark areas on every side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Ink {
    /// Estimated from the corners of each image.
    #[default]
    Auto,
    /// Known growth on every side, µm; negative where dark areas have shrunk.
    Um(f64),
}

/// Largest accepted ink spread, µm. A larger one fills the space between the bits of tags.
const MAX_UM: f64 = 1000.0;

impl std::str::FromStr for Ink {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("none", _) => Ok(Self::Um(0.0)),
            (_, Ok(um)) if (-MAX_UM..=MAX_UM).contains(&um) => Ok(Self::Um(um)),
            _ => Err(format!("expected auto, none, or µm from -{MAX_UM} to {MAX_UM}")),
        }
    }
}

/// The estimated ink spread of a print: the growth of dark areas on every side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct InkEstimate {
    /// Spread in edge lengths of a tile; negative where dark areas have shrunk.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub edges: f64,
    /// Standard deviation of the spread, in edge lengths of a tile.
    #[serde(alias = "edges_deviation", deserialize_with = "quantity::deviation::de")]
    pub edges_sd: f64,
    /// Spread in µm on the print, if the target is known.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::figure::de"
    )]
    pub um: Option<f64>,
    /// Standard deviation of the spread in µm.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        alias = "um_deviation",
        deserialize_with = "quantity::deviation::de"
    )]
    pub um_sd: Option<f64>,
    /// Whether the spread differs significantly from zero. Only then was it used to locate corners.
    pub used: bool,
    /// Number of images it was estimated from.
    #[serde(alias = "pictures")]
    pub images: u32,
}

/// χ² with one degree of freedom that noise exceeds once in a thousand cases.
const CHI2: f64 = 10.8;

/// Ratios for a normal distribution: standard deviation to median absolute deviation, and standard deviation of the
/// median to that of the mean.
const SD_OVER_MEDIAN_DEVIATION: f64 = 1.4826;
const MEDIAN_SD_OVER_MEAN_SD: f64 = 1.2533;

/// Lower limit for the standard deviation of one image, in edge lengths.
const MIN_DEVIATION: f64 = 1e-9;

impl InkEstimate {
    /// Creates the estimate of one image, in edge lengths of a tile, with its standard deviation.
    pub fn new(edges: f64, edges_sd: f64, used: bool) -> Self {
        Self { edges, edges_sd, um: None, um_sd: None, used, images: 1 }
    }

    /// Combines estimates from images of one print by their weighted median, so that an image of something else has
    /// no influence. Returns `None` if there are no estimates. The standard deviation follows from
    /// those of the images, or
    /// from their scatter if that is larger.
    pub fn of_all(pictures: &[Self]) -> Option<Self> {
        // Estimates that already combine all images are equal; they count once.
        let mut pictures = pictures.to_vec();
        pictures.sort_by(|a, b| a.edges.total_cmp(&b.edges));
        pictures.dedup_by(|a, b| a.images > 1 && *a == *b);
        let weight = |p: &Self| p.edges_sd.max(MIN_DEVIATION).powi(-2);
        let total: f64 = pictures.iter().map(weight).sum();
        let mut below = 0.0;
        let middle = *pictures.iter().find(|picture| {
            below += weight(picture);
            below >= 0.5 * total
        })?;
        let count = pictures.iter().map(|picture| picture.images).fold(0, u32::saturating_add);
        if pictures.len() == 1 {
            return Some(middle);
        }
        let off = |p: &Self| (p.edges - middle.edges).abs() * weight(p).sqrt();
        let scatter = SD_OVER_MEDIAN_DEVIATION * median(pictures.iter().map(off).collect())?;
        let deviation = MEDIAN_SD_OVER_MEAN_SD * scatter.max(1.0) / total.sqrt();
        let um = |edges: f64| {
            let um = middle.um.map(|um| um / middle.edges * edges);
            um.filter(|um| um.is_finite())
        };
        Some(Self {
            edges_sd: deviation,
            um_sd: um(deviation),
            used: middle.edges.powi(2) > CHI2 * deviation.powi(2),
            images: count,
            ..middle
        })
    }

    /// Adds the spread in µm for a print whose tiles have edges of `edge_mm`.
    pub fn on_print(self, edge_mm: f64) -> Self {
        let um = |edges: f64| Some(1e3 * edge_mm * edges);
        Self { um: um(self.edges), um_sd: um(self.edges_sd), ..self }
    }
}

impl std::fmt::Display for InkEstimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let grown = if self.edges < 0.0 { "shrunk" } else { "grown" };
        let (by, deviation, unit) = match self.um.zip(self.um_sd) {
            Some((um, deviation)) => (um.abs(), deviation, "µm"),
            None => (100.0 * self.edges.abs(), 100.0 * self.edges_sd, "% of an edge"),
        };
        let places = places(deviation);
        write!(
            f,
            "dark areas have {grown} by {by:.places$} ± {deviation:.places$} {unit} on every side"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(edges: f64, deviation: f64) -> InkEstimate {
        let (um, um_sd) = (None, None);
        let ink = InkEstimate { edges, edges_sd: deviation, um, um_sd, used: true, images: 1 };
        ink.on_print(20.0)
    }

    #[test]
    fn combined_estimate_ignores_an_outlier() {
        let pictures = [0.0031, 0.0029, 0.0030, 0.0032, 0.0028, 0.0300].map(|e| seen(e, 1e-4));
        let all = InkEstimate::of_all(&pictures).unwrap();
        assert!((all.edges - 0.0030).abs() < 1.5e-4 && all.images == 6 && all.used, "{all:?}");
        assert!((0.3e-4..2e-4).contains(&all.edges_sd), "{all:?}");
        assert_eq!(InkEstimate::of_all(&[all, all, all]), Some(all));
        assert_eq!(InkEstimate::of_all(&[]), None);
        let noise = InkEstimate::of_all(&[seen(1e-4, 1e-4), seen(-2e-4, 1e-4)]).unwrap();
        assert!(!noise.used);
    }

    #[test]
    fn display_states_growth_or_shrinkage() {
        let text = seen(-0.00305, 2e-5).to_string();
        assert_eq!(text, "dark areas have shrunk by 61.00 ± 0.40 µm on every side");
        let edges = InkEstimate { um: None, ..seen(0.00305, 2e-6) }.to_string();
        assert_eq!(edges, "dark areas have grown by 0.30500 ± 0.00020 % of an edge on every side");
        assert!(
            "none".parse::<Ink>() == Ok(Ink::Um(0.0)) && "-20".parse::<Ink>() == Ok(Ink::Um(-20.0))
        );
        assert!("nan".parse::<Ink>().is_err() && "5000".parse::<Ink>().is_err());
    }
}
