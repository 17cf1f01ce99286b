//! Why a picture, or a grid in it, has no labels: as data, and as a sentence.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::quantity;
use crate::words::counted;

/// Why a picture, or a grid in it, has no labels. It is displayed as a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Reason {
    /// The kind of reason.
    pub kind: ReasonKind,
    /// Index of the grid that it is about; `None` for the whole picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<usize>,
    /// What was measured, by names with units, such as `bit_px`.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "quantity::figure::de"
    )]
    pub figures: BTreeMap<String, f64>,
}

/// The kinds of reasons, each with the names of its [`figures`](Reason::figures).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReasonKind {
    /// Nothing in the picture looks like a corner, and nothing tells why: `corners`.
    NoCorners,
    /// The brightest pixels are dark: `brightest`, a part of full scale.
    TooDark,
    /// Most of the picture is saturated: `saturated`, a part of its pixels.
    Overexposed,
    /// Edges are wider than corners could be found with: `blur_px`.
    TooBlurred,
    /// Corners are there, but in no grid that could be told from chance: `corners`.
    NoGrid,
    /// Tiles are too small to be sure of them: `edge_px`, `needed_edge_px`.
    TooSmall,
    /// The corners are those of the other tiling: `corners`.
    OtherTiling,
    /// Cells of tags are too small or too blurred to be read: `bit_px`, `blur_px`, `needed_bit_px`; without the
    /// last they do not stand out of the noise.
    UnreadableTags,
    /// No tile is seen whole that could carry a tag: `corners`.
    NoTiles,
    /// Tiles were read, and show no code: `tiles`.
    NoTags,
    /// Clear codes of the family, but of ids that the target does not have: `tags`, `id`, one of them.
    OtherIds,
    /// Tags of the target, but tiles around them that are not as on the target: `agreeing`, `disagreeing` tiles.
    OtherLayout,
    /// Clear cells that are no code of the family: `tiles`.
    OtherFamily,
    /// The grid is seen as in a mirror: `corners`.
    Mirrored,
    /// The grid could lie in more than one way: `corners`.
    Ambiguous,
    /// The grid is less, or more, than the whole board whose outline would label it: `corners`, `expected`.
    NotWhole,
    /// The grid is larger than any board, and no certain one is looked for: `corners`, `expected` at most.
    TooManyCorners,
    /// The same as [`NotWhole`](Self::NotWhole), and it ends at the border of the picture: `corners`, and `expected`
    /// where there are no tags.
    CutByBorder,
    /// Corners of a panel that is seen elsewhere in the picture too, and are left out: `corners`.
    SeenTwice,
    /// The picture holds more grids than are worth the time.
    TooManyGrids,
}

impl ReasonKind {
    /// Whether tags were read, and belong elsewhere.
    #[doc(hidden)]
    pub fn is_of_tags_read(self) -> bool {
        matches!(self, Self::OtherIds | Self::OtherLayout | Self::OtherFamily)
    }
}

impl Reason {
    /// A reason with what was measured.
    #[doc(hidden)]
    pub fn new<const N: usize>(kind: ReasonKind, figures: [(&str, f64); N]) -> Self {
        Self::of(kind, figures)
    }

    /// The same of any number of figures.
    #[doc(hidden)]
    pub fn of<'a>(kind: ReasonKind, figures: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let owned = |(name, figure): (&str, f64)| (name.to_owned(), figure);
        Self { kind, grid: None, figures: figures.into_iter().map(owned).collect() }
    }

    fn figure(&self, name: &str) -> f64 {
        self.figures.get(name).copied().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Reason {
    /// A sentence without its full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let figure = |name| self.figure(name);
        let count = |name, thing| counted(figure(name) as usize, thing);
        match self.kind {
            ReasonKind::NoCorners => write!(f, "nothing in the picture looks like a corner"),
            ReasonKind::TooDark => write!(
                f,
                "too dark: the brightest pixels are at {:.1} % of full scale; expose longer",
                100.0 * figure("brightest")
            ),
            ReasonKind::Overexposed => write!(
                f,
                "overexposed: {:.0} % of the picture is saturated; expose shorter",
                100.0 * figure("saturated")
            ),
            ReasonKind::TooBlurred => write!(
                f,
                "too blurred: the sharpest edges are {:.1} px wide; focus, or hold still",
                figure("blur_px")
            ),
            ReasonKind::NoGrid => {
                write!(f, "{}, but no grid of them", count("corners", "corner"))
            }
            ReasonKind::TooSmall => write!(
                f,
                "tiles of {:.1} px are too small; go nearer, until they have {:.0} px",
                figure("edge_px"),
                figure("needed_edge_px")
            ),
            ReasonKind::OtherTiling => {
                write!(f, "{} of the other tiling", count("corners", "corner"))
            }
            ReasonKind::UnreadableTags if !self.figures.contains_key("needed_bit_px") => write!(
                f,
                "a tag's cells have {:.1} px under a blur of {:.1} px, and do not stand out of the noise; more light \
                 or contrast would help",
                figure("bit_px"),
                figure("blur_px")
            ),
            ReasonKind::UnreadableTags => write!(
                f,
                "a tag's cells have {:.1} px under a blur of {:.1} px; they could be read from {:.1} px on, \
                 nearer or sharper",
                figure("bit_px"),
                figure("blur_px"),
                figure("needed_bit_px")
            ),
            ReasonKind::NoTiles => {
                write!(
                    f,
                    "among {} no tile that could carry a tag is whole",
                    count("corners", "corner")
                )
            }
            ReasonKind::NoTags => {
                write!(f, "no tag is seen in {} that could carry one", count("tiles", "tile"))
            }
            ReasonKind::OtherIds => write!(
                f,
                "{} whose id the target does not have, such as {}: is it another target?",
                count("tags", "tag"),
                figure("id")
            ),
            ReasonKind::OtherLayout => write!(
                f,
                "tags of the target, but tiles around them are not those of the target, {} of {}: is it another target?",
                figure("disagreeing"),
                figure("agreeing") + figure("disagreeing")
            ),
            ReasonKind::OtherFamily => write!(
                f,
                "in {} read without doubt there is no tag of the target's family",
                count("tiles", "tile")
            ),
            ReasonKind::Mirrored => write!(
                f,
                "a grid of {} is seen as in a mirror; flip the picture, or allow mirrored labels",
                count("corners", "corner")
            ),
            ReasonKind::Ambiguous => {
                write!(f, "a grid of {} could lie in more than one way", count("corners", "corner"))
            }
            ReasonKind::NotWhole if figure("corners") == figure("expected") => write!(
                f,
                "a grid of {} has other rows and columns than the board: are they exchanged?",
                count("corners", "corner")
            ),
            ReasonKind::NotWhole => write!(
                f,
                "a grid of {} is not the whole board of {}",
                count("corners", "corner"),
                figure("expected")
            ),
            ReasonKind::TooManyCorners => write!(
                f,
                "a grid of {} is larger than any board, which has at most {}",
                count("corners", "corner"),
                figure("expected")
            ),
            ReasonKind::CutByBorder => write!(
                f,
                "a grid of {} is cut by the border of the picture",
                count("corners", "corner")
            ),
            ReasonKind::SeenTwice => write!(
                f,
                "{} left out: they show what is seen elsewhere in the picture too; is there a second copy of the target?",
                count("corners", "corner")
            ),
            ReasonKind::TooManyGrids => {
                write!(f, "the picture holds more grids, or corners, than are worth the time")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_come_back_from_json() {
        let figures = [("bit_px", 1.0), ("blur_px", 3.5), ("needed_bit_px", 2.5)];
        let reason = Reason::new(ReasonKind::UnreadableTags, figures);
        let text = serde_json::to_string(&reason).unwrap();
        assert!(text.contains(r#""kind":"unreadable_tags""#), "{text}");
        assert_eq!(serde_json::from_str::<Reason>(&text).unwrap(), reason);
        assert!(reason.to_string().contains("1.0 px under a blur of 3.5 px"));
    }
}
