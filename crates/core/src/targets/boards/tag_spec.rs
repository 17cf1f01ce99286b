//! The specification of tags in a board or on the faces of a solid.

use serde::{Deserialize, Serialize};

use crate::family::positions;
use crate::lattice::{GridKind, Vertex};
use crate::quantity;
use crate::setting::Setting::{self, TagBorderBits, TagFirstId, TagHoleMm, TagSpacing, TagTagsIn};
use crate::targets::{TagPlacement, TagsIn, TargetError};

/// Maximum number of rows or columns of a board: more than the largest paper fits at the finest printed edge, and few
/// enough to avoid overflow.
pub const MAX_ROWS: u32 = 500;

/// Smallest hole in a tag, mm: for a thin pin.
const MIN_HOLE_MM: f64 = 0.5;

/// Fewest tiles of a board of position codes: three by four identify their position even if some are hidden.
pub(super) const MIN_DENSE_TILES: u32 = 12;

/// Least border of a square tag, bit-widths: that of an AprilTag.
const MIN_SQUARE_BORDER_BITS: f64 = 1.0;

/// Range of a tag's border, bit-widths. The border separates the code from the white around the tile. With half a bit
/// the detector misses some corners of a clean print; with 0.6 bits or more it finds all.
pub const BORDER_BITS: std::ops::RangeInclusive<f64> = 0.6..=10.0;

/// The tags of a board and their positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSpec {
    /// Family name, or path of a family file. With [`positions`] every tile has a tag, whose id follows from the board
    /// id and the position.
    pub family: String,
    /// Id of the first tag; the others follow by row, then column, board after board. It is 0 for position codes.
    pub first_id: u32,
    /// Distance between tags in rows and columns.
    pub spacing: u32,
    /// Width of the border, bit-widths, 0.6 to 10.
    pub border_bits: f64,
    /// The squares of a checkerboard that carry tags.
    #[serde(default, skip_serializing_if = "TagsIn::is_black")]
    pub tags_in: TagsIn,
    /// Diameter of a hole in the centre of each tag, mm, for a screw or a camera. It is bare paper on a print and a
    /// cut for a laser. The family must leave these cells free.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub hole_mm: Option<f64>,
}

impl Default for TagSpec {
    /// Returns delTag25h7 from id 0, with a tag in every third row and column and a border of 1.5 bits. A tag then
    /// has six plain tiles around each of its corners. The border is that of published targets.
    fn default() -> Self {
        let family = "delTag25h7".to_owned();
        Self {
            family,
            first_id: 0,
            spacing: 3,
            border_bits: 1.5,
            tags_in: TagsIn::Black,
            hole_mm: None,
        }
    }
}

impl TagSpec {
    /// Returns a position code in every tile of a deltille grid, with the usual border. At 2 px per
    /// cell or more, the codes do not reduce the precision of corners.
    pub fn dense() -> Self {
        Self { family: positions::NAME.to_owned(), spacing: 1, ..Self::default() }
    }

    /// Returns the usual tags of a tiling: the default ones, or those of the named family.
    pub fn usual(grid: GridKind, family: Option<&str>, tags_in: TagsIn) -> Self {
        let usual = match grid {
            GridKind::Checker => Self::for_squares(tags_in),
            GridKind::Deltille if family == Some(positions::NAME) => Self::dense(),
            GridKind::Deltille => Self::default(),
        };
        let family = family.map_or(usual.family, str::to_owned);
        Self { family, ..usual }
    }

    /// Returns whether every tile has a position code.
    pub fn is_dense(&self) -> bool {
        self.family == positions::NAME
    }

    /// Returns the tags in the given tiles of panel `panel`, with ids starting at `first` for
    /// ordinary families.
    pub(crate) fn placements(&self, panel: u32, first: u32, tiles: &[Vertex]) -> Vec<TagPlacement> {
        let tiles = tiles.iter().zip(0..);
        let of_tile = |(tile, i): (&Vertex, u32)| TagPlacement {
            id: match self.is_dense() {
                true => positions::id(panel, *tile),
                // No family is large enough for ids to overflow, but a spec may ask for it.
                false => first.saturating_add(i),
            },
            row: tile.row,
            col: tile.col,
        };
        tiles.map(of_tile).collect()
    }

    /// Checks that position codes exist for panels with these ids, with the given numbers of rows and columns of tiles.
    /// `ids` and `size` are the settings that determine them.
    pub(crate) fn check_places(
        &self,
        ids: Setting,
        panels: std::ops::Range<u32>,
        size: Setting,
        [rows, cols]: [u32; 2],
    ) -> Result<(), TargetError> {
        let last = positions::BOARDS - 1;
        if panels.end > positions::BOARDS {
            let problem = format!(
                "boards {} to {} are needed, but the last id of {} is {last}: lower the id, or make fewer boards",
                panels.start,
                panels.end - 1,
                positions::NAME
            );
            return Err(TargetError::invalid(ids, problem));
        }
        if !positions::are_different(rows, cols) {
            let problem = format!(
                "{rows} rows of {cols} tiles are too many for {}, whose codes repeat after 256 edges: \
                 make the board smaller",
                positions::NAME
            );
            return Err(TargetError::invalid(size, problem));
        }
        let fixed = [
            (TagSpacing, self.spacing, 1, "every tile has a position code"),
            (TagFirstId, self.first_id, 0, "the ids of position codes follow from the board id"),
        ];
        match fixed.into_iter().find(|(_, value, only, _)| value != only) {
            Some((setting, value, only, why)) => {
                let problem = format!("must be {only}, not {value}, because {why}; omit it");
                Err(TargetError::invalid(setting, problem))
            }
            None => Ok(()),
        }
    }

    /// Returns tags for a checkerboard: aprilTag36h11 in every second row and column, so that each corner touches at
    /// most one tag.
    ///
    /// In black squares the border has two bits. With one, cells are so close to the corners that these are located
    /// half as precisely (docs/benchmarks.md). In white squares it has one bit, as all readers of AprilTags expect.
    pub fn for_squares(tags_in: TagsIn) -> Self {
        Self {
            family: "aprilTag36h11".to_owned(),
            spacing: 2,
            border_bits: match tags_in {
                TagsIn::Black => 2.0,
                TagsIn::White => MIN_SQUARE_BORDER_BITS,
            },
            tags_in,
            ..Self::default()
        }
    }
}

impl TagSpec {
    /// Checks each number on its own, for tags in tiles of a kind.
    pub(crate) fn check(&self, grid: GridKind) -> Result<(), TargetError> {
        if grid == GridKind::Deltille && self.tags_in == TagsIn::White {
            let problem = "deltille boards can only have tags in black tiles";
            return Err(TargetError::invalid(TagTagsIn, problem));
        }
        let least = MIN_SQUARE_BORDER_BITS;
        if grid == GridKind::Checker && self.border_bits < least {
            let problem = format!(
                "{} is too narrow: a square tag needs a border of at least {least} bit-width",
                self.border_bits
            );
            return Err(TargetError::invalid(TagBorderBits, problem));
        }
        if !(1..=MAX_ROWS).contains(&self.spacing) {
            let problem = format!("{} is not between 1 and {MAX_ROWS}", self.spacing);
            return Err(TargetError::invalid(TagSpacing, problem));
        }
        if !BORDER_BITS.contains(&self.border_bits) {
            let problem = format!("{} is not between 0.6 and 10 bit-widths", self.border_bits);
            return Err(TargetError::invalid(TagBorderBits, problem));
        }
        let refused = |problem: &str| Err(TargetError::invalid(TagHoleMm, problem));
        match self.hole_mm {
            Some(_) if grid == GridKind::Checker => {
                refused("square tags have no free cells for a hole: use a deltille board or solid")
            }
            Some(mm) if mm.is_nan() || mm < MIN_HOLE_MM => {
                refused(&format!("{mm} mm is less than the minimum of {MIN_HOLE_MM} mm"))
            }
            _ => Ok(()),
        }
    }
}
