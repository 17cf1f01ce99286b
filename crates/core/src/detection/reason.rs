//! Why an image, or a grid in it, has no labels: as data, and as a sentence.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::quantity;
use crate::setting::Setting::CharucoLegacy;
use crate::words::counted;

/// Why an image, or a grid in it, has no labels. Its display form is a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Reason {
    /// The kind of reason.
    pub kind: ReasonKind,
    /// Index of the grid concerned; `None` for the whole image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<usize>,
    /// Measured values, by names with units, for example `bit_px`.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "quantity::figure::de"
    )]
    pub figures: BTreeMap<String, f64>,
    /// Settings of the target with which its tags would fit, if the tags that were read contradict the target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fits: Option<OtherSettings>,
}

/// The settings in which a board that fits the tags in an image differs from the target; `None` for settings that are
/// the same.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct OtherSettings {
    /// Whether a ChArUco board has the pattern of OpenCV before version 4.6.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub legacy: Option<bool>,
    /// Numbers of columns and rows: of corners, of the squares of a ChArUco board, or of the tags of an AprilGrid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Id of the first tag.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_id: Option<u32>,
    /// Distance between tags in rows and columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<u32>,
    /// Name of the family or dictionary of the tags.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
}

impl fmt::Display for OtherSettings {
    /// Lists the settings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let legacy = self.legacy.map(|legacy| match legacy {
            true => format!("OpenCV's legacy pattern (add {CharucoLegacy})"),
            false => format!("OpenCV's current pattern (omit {CharucoLegacy})"),
        });
        let size = self.size.map(|[columns, rows]| {
            format!("width and height swapped ({columns} columns, {rows} rows)")
        });
        let first_id = self.first_id.map(|id| format!("first id {id}"));
        let spacing = self.spacing.map(|spacing| format!("a tag spacing of {spacing}"));
        let family = self.family.as_ref().map(|family| format!("tags of {family}"));
        let all = [legacy, size, first_id, spacing, family].into_iter().flatten();
        f.write_str(&all.collect::<Vec<_>>().join(" and "))
    }
}

/// The kinds of reasons, each with the names of its [`figures`](Reason::figures).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReasonKind {
    /// The image contains no candidate corners, and the cause is unknown: `corners`.
    NoCorners,
    /// The brightest pixels are dark: `brightest`, a fraction of full scale.
    TooDark,
    /// Most of the image is saturated: `saturated`, a fraction of its pixels.
    Overexposed,
    /// Edges are too wide for corner detection: `blur_px`.
    TooBlurred,
    /// Corners were found, but no grid that is distinguishable from noise: `corners`.
    NoGrid,
    /// Tiles are too small for a certain grid: `edge_px`, `needed_edge_px`.
    TooSmall,
    /// The corners belong to the other tiling: `corners`, and the number of `edges` that cross in each.
    OtherTiling,
    /// Tag cells are too small or too blurred to be read: `bit_px`, `blur_px`, `needed_bit_px`. If
    /// the last is missing, the contrast of the cells is too low for the noise.
    UnreadableTags,
    /// No complete tile that could carry a tag is visible: `corners`.
    NoTiles,
    /// Tiles were read and contain no code: `tiles`.
    NoTags,
    /// Clear codes of the family, but with ids that the target does not have: `tags`, `id` of one of them.
    OtherIds,
    /// Tags of the target, but surrounding tiles that contradict it: `agreeing`, `disagreeing` tiles.
    OtherLayout,
    /// Clear cells that are not a code of the family: `tiles`.
    OtherFamily,
    /// The grid is mirrored: `corners`.
    Mirrored,
    /// The grid fits the target in more than one position: `corners`.
    Ambiguous,
    /// The grid is larger than the board whose outline would label it, or smaller, and more than one placement may fit:
    /// `corners`, `expected`.
    NotWhole,
    /// The grid is larger than any board, so it was not searched for one: `corners`, and the
    /// maximum as `expected`.
    TooManyCorners,
    /// Like [`NotWhole`](Self::NotWhole), but the grid ends at the border of the image: `corners`, and `expected` for
    /// boards without tags.
    CutByBorder,
    /// Corners of a panel that also appears elsewhere in the image; they were left out: `corners`.
    SeenTwice,
    /// The image contains too many grids to process in reasonable time.
    TooManyGrids,
}

impl ReasonKind {
    /// Returns whether tags were read that do not fit the target.
    #[doc(hidden)]
    pub fn is_of_tags_read(self) -> bool {
        matches!(self, Self::OtherIds | Self::OtherLayout | Self::OtherFamily)
    }
}

impl Reason {
    /// Creates a reason with measured values.
    #[doc(hidden)]
    pub fn new<const N: usize>(kind: ReasonKind, figures: [(&str, f64); N]) -> Self {
        Self::of(kind, figures)
    }

    /// Creates a reason with any number of measured values.
    #[doc(hidden)]
    pub fn of<'a>(kind: ReasonKind, figures: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let owned = |(name, figure): (&str, f64)| (name.to_owned(), figure);
        let figures = figures.into_iter().map(owned).collect();
        Self { kind, grid: None, figures, fits: None }
    }

    fn figure(&self, name: &str) -> f64 {
        self.figures.get(name).copied().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Reason {
    /// Writes a sentence without its full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.fits {
            Some(settings) => write!(
                f,
                "the tags fit a board with {settings}; it is another board, or the target file is wrong"
            ),
            None => f.write_str(&self.sentence()),
        }
    }
}

impl Reason {
    /// The sentence of the kind of reason, with its figures.
    fn sentence(&self) -> String {
        let figure = |name| self.figure(name);
        let count = |name, thing| counted(figure(name) as usize, thing);
        let (corners, tiles) = (count("corners", "corner"), count("tiles", "tile"));
        let (tags, expected) = (count("tags", "tag"), figure("expected"));
        match self.kind {
            ReasonKind::NoCorners => "no corners found in the image".to_owned(),
            ReasonKind::TooDark => format!(
                "too dark: the brightest pixels are at {:.1} % of full scale; use a longer exposure",
                100.0 * figure("brightest")
            ),
            ReasonKind::Overexposed => format!(
                "overexposed: {:.0} % of the image is saturated; use a shorter exposure",
                100.0 * figure("saturated")
            ),
            ReasonKind::TooBlurred => format!(
                "too blurred: the sharpest edges are {:.1} px wide; focus, or hold the camera still",
                figure("blur_px")
            ),
            ReasonKind::NoGrid => format!(
                "found {corners}, but no grid: the target is covered, too small, blurred by motion, or not in the image"
            ),
            ReasonKind::TooSmall => format!(
                "tiles are too small ({:.1} px); move closer until their edges are {:.0} px long",
                figure("edge_px"),
                figure("needed_edge_px")
            ),
            ReasonKind::OtherTiling => {
                // Detections of earlier versions do not state the edges.
                let [found, expected] = match figure("edges") {
                    3.0 => ["triangles", "squares"],
                    _ => ["squares", "triangles"],
                };
                format!(
                    "found {corners} of {found} where {expected} are expected: check the kind of the target"
                )
            }
            ReasonKind::UnreadableTags => self.unreadable_tags(),
            ReasonKind::NoTiles => format!(
                "found {corners}, but no complete tile that could carry a tag; show more of the board"
            ),
            ReasonKind::NoTags => format!("no tag found in {tiles} that could carry one"),
            ReasonKind::OtherIds => format!(
                "{tags} not on the target, for example id {}; is this another target?",
                figure("id")
            ),
            ReasonKind::OtherLayout => format!(
                "tags fit the target, but {} of {} surrounding tiles contradict it; is this another target?",
                figure("disagreeing"),
                figure("agreeing") + figure("disagreeing")
            ),
            ReasonKind::OtherFamily => format!(
                "none of {tiles} decoded reliably shows a tag of the target's family; is the family correct?"
            ),
            ReasonKind::Mirrored => {
                format!("a grid of {corners} is mirrored; flip the image, or allow mirrored labels")
            }
            ReasonKind::Ambiguous => {
                format!("a grid of {corners} fits the target in more than one position")
            }
            ReasonKind::NotWhole if figure("corners") == expected => format!(
                "a grid of {corners} has different numbers of rows and columns than the board; are they swapped?"
            ),
            ReasonKind::NotWhole => {
                format!("a grid of {corners} is not the complete board of {expected}")
            }
            ReasonKind::TooManyCorners => format!(
                "a grid of {corners} is larger than any board; boards have at most {expected}"
            ),
            ReasonKind::CutByBorder => {
                format!("a grid of {corners} is cut off by the image border")
            }
            ReasonKind::SeenTwice => format!(
                "{corners} excluded, because the same panel appears elsewhere in the image; is there a second copy of the target?"
            ),
            ReasonKind::TooManyGrids => {
                "the image contains too many grids or corners to process".to_owned()
            }
        }
    }

    fn unreadable_tags(&self) -> String {
        let [bit_px, blur_px] = ["bit_px", "blur_px"].map(|name| self.figure(name));
        let advice = match self.figures.get("needed_bit_px") {
            Some(px) => format!("; reading them needs {px:.1} px: move closer or focus better"),
            None => ", and their contrast is too low for the noise; use more light or contrast"
                .to_owned(),
        };
        format!("tag cells are {bit_px:.1} px wide with a blur of {blur_px:.1} px{advice}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_survive_json() {
        let figures = [("bit_px", 1.0), ("blur_px", 3.5), ("needed_bit_px", 2.5)];
        let reason = Reason::new(ReasonKind::UnreadableTags, figures);
        let text = serde_json::to_string(&reason).unwrap();
        assert!(text.contains(r#""kind":"unreadable_tags""#), "{text}");
        assert_eq!(serde_json::from_str::<Reason>(&text).unwrap(), reason);
        assert!(reason.to_string().contains("1.0 px wide with a blur of 3.5 px"));
    }
}
