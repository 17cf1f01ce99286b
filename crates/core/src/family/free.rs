//! Cells of a tag that no code uses, so that there may be a hole for a screw or a camera.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::lattice::{Dimension, TagCells};

/// The choice of free cells. They are printed black, are not read, and do not count in distances. A rotation of the
/// tag maps them onto themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum FreeCells {
    /// The central cells: one cell for 16, 25, 49 and 64 cells; the six around the central vertex for 9 and 36.
    Centre,
}

impl FreeCells {
    /// Returns the name in options and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Centre => "centre",
        }
    }

    /// Returns the bits of these cells.
    pub fn mask(self, dimension: Dimension) -> u64 {
        match self {
            Self::Centre => {
                let (cells, middle) = (TagCells::new(dimension), DVec2::splat(1.0 / 3.0));
                let is_there = |at: DVec2| at.abs_diff_eq(middle, 1e-9);
                let is_free = |&bit: &u32| {
                    is_there(cells.centre(bit, 0.0))
                        || cells.corners(bit, 0.0).into_iter().any(is_there)
                };
                (0..dimension.bits()).filter(is_free).fold(0, |mask, bit| mask | 1 << bit)
            }
        }
    }

    /// Returns the radius of the largest circle around the centre of the tag that contains only these cells,
    /// bit-widths.
    pub fn radius_bits(self, dimension: Dimension) -> f64 {
        match self {
            // One triangle, or a hexagon of six.
            Self::Centre if self.mask(dimension).count_ones() == 1 => 0.75f64.sqrt() / 3.0,
            Self::Centre => 0.75f64.sqrt(),
        }
    }
}

impl std::str::FromStr for FreeCells {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "centre" => Ok(Self::Centre),
            _ => Err("only the cells of the `centre` can be free".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_cells_are_central_and_invariant() {
        for dimension in Dimension::all() {
            let (cells, mask) = (TagCells::new(dimension), FreeCells::Centre.mask(dimension));
            assert_eq!(mask.count_ones(), if dimension.bits() % 3 == 0 { 6 } else { 1 });
            assert_eq!(cells.rotate(mask), mask);
        }
    }
}
