//! Hidden cells of a tag, and the distance of codes in the visible ones.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::family::Family;
use crate::family::kernels::nearer;
use crate::lattice::{Cell, Dimension, GridKind, TagCells};

/// The hidden cells, at any position on the tag.
///
/// ```text
///            ╱╲                ╱╲                ╱╲
///           ╱██╲              ╱  ╲              ╱  ╲
///          ╱────╲            ╱────╲            ╱────╲
///         ╱██╲██╱╲          ╱  ╲  ╱╲          ╱██╲██╱╲
///        ╱────╲╱──╲        ╱────╲╱──╲        ╱────╲╱──╲
///       ╱  ╲  ╱╲  ╱╲      ╱██╲██╱╲██╱╲      ╱  ╲██╱╲  ╱╲
///      ╱────╲╱──╲╱──╲    ╱────╲╱──╲╱──╲    ╱────╲╱──╲╱──╲
///           apex              edge               tile
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum HiddenCells {
    /// The four cells at a corner.
    Apex,
    /// The 2d − 1 cells along an edge.
    Edge,
    /// The four cells of a triangle with two cells per edge, upright or inverted.
    Tile,
}

impl HiddenCells {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Apex, Self::Edge, Self::Tile];

    /// Returns the name in options and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Apex => "apex",
            Self::Edge => "edge",
            Self::Tile => "tile",
        }
    }

    /// Returns the number of cells hidden at a time.
    pub fn count(self, dimension: Dimension) -> u32 {
        match self {
            Self::Apex | Self::Tile => 4,
            Self::Edge => 2 * dimension.rows() - 1,
        }
    }

    /// Returns the bits of the hidden cells for each possible position; a rotation of the tag permutes the positions.
    pub fn masks(self, dimension: Dimension) -> Vec<u64> {
        let (cells, d) = (TagCells::new(dimension), dimension.rows());
        let of = |chosen: &dyn Fn(&Cell) -> bool| {
            let bits = (0..).zip(cells.cells()).filter(|(_, cell)| chosen(cell));
            bits.fold(0, |mask, (bit, _)| mask | 1u64 << bit)
        };
        let turned = |mask: u64| vec![mask, cells.rotate(mask), cells.rotate(cells.rotate(mask))];
        match self {
            Self::Apex => turned(of(&|cell| cell.row + 2 >= d)),
            Self::Edge => turned(of(&|cell| cell.row == 0)),
            Self::Tile => {
                let places = (0..d).flat_map(|row| (0..d).map(move |col| (row, col)));
                // An inverted cell and its three upright neighbours, or vice versa.
                let around = |(row, col): (u32, u32)| {
                    let at = |cell: &Cell, row: u32, col: u32| (cell.row, cell.col) == (row, col);
                    let upright = of(&|cell| match cell.upright {
                        true => {
                            at(cell, row, col) || at(cell, row, col + 1) || at(cell, row + 1, col)
                        }
                        false => at(cell, row, col),
                    });
                    let inverted = of(&|cell| match cell.upright {
                        true => at(cell, row, col),
                        false => {
                            at(cell, row, col)
                                || at(cell, row, col.wrapping_sub(1))
                                || at(cell, row.wrapping_sub(1), col)
                        }
                    });
                    [upright, inverted]
                };
                places.flat_map(around).filter(|mask| mask.count_ones() == 4).collect()
            }
        }
    }
}

/// A guarantee: with these cells hidden, codes in any rotation still differ in at least `distance` visible cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robust {
    /// The cells that are hidden.
    pub to: HiddenCells,
    /// Minimum distance in the visible cells.
    pub distance: u32,
}

impl Robust {
    /// Default remaining distance: one misread cell is corrected.
    pub const DISTANCE: u32 = 3;
}

impl std::fmt::Display for Robust {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={}", self.to.name(), self.distance)
    }
}

impl std::str::FromStr for Robust {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, distance) = match text.split_once('=') {
            Some((name, distance)) => (name, distance.parse().ok()),
            None => (text, Some(Self::DISTANCE)),
        };
        let to = HiddenCells::ALL.into_iter().find(|cells| cells.name() == name);
        to.zip(distance).map(|(to, distance)| Self { to, distance }).ok_or_else(|| {
            "expected apex, edge or tile, optionally with a distance (example: edge=5)".to_owned()
        })
    }
}

impl Family {
    /// Returns the minimum distance of two codes, in any rotation, with these cells hidden at any position. Compares
    /// all pairs. Returns `None` for square tags and position codes.
    ///
    /// ```
    /// use deltille_core::family::{Family, HiddenCells};
    ///
    /// let family = Family::shipped("d25h9")?;
    /// let left = HiddenCells::ALL.map(|cells| family.distance_without(cells));
    /// assert_eq!(left, [Some(5), Some(3), Some(5)]);
    /// # Ok::<(), deltille_core::family::FamilyError>(())
    /// ```
    pub fn distance_without(&self, hidden: HiddenCells) -> Option<u32> {
        let known = self.kind() == GridKind::Deltille && !self.is_position_family();
        known.then(|| least_seen(&self.cells(), self.codes(), hidden))
    }
}

/// Returns the minimum distance of two words, codes in any rotation, in the visible cells.
pub(in crate::family) fn least_seen(cells: &TagCells, codes: &[u64], hidden: HiddenCells) -> u32 {
    let (masks, count) = (hidden.masks(cells.dimension()), hidden.count(cells.dimension()));
    let rotations = |&code: &u64| [code, cells.rotate(code), cells.rotate(cells.rotate(code))];
    let turned: Vec<u64> = codes.iter().flat_map(rotations).collect();
    let least = AtomicU32::new(cells.dimension().bits() - count);
    codes.par_iter().enumerate().for_each(|(i, &code)| {
        // One of its own rotations suffices, as hidden cells may be anywhere.
        let others = &turned[..3 * i];
        let reach = least.load(Ordering::Relaxed) + count;
        let near = nearer(code, others, reach).into_iter().map(|at| others[at as usize]);
        for other in near.chain([turned[3 * i + 1]]) {
            let left = masks.iter().map(|mask| ((code ^ other) & !mask).count_ones()).min();
            least.fetch_min(left.unwrap_or(0), Ordering::Relaxed);
        }
    });
    least.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_cells_cover_all_positions_and_rotations() {
        for dimension in Dimension::all() {
            let (cells, d) = (TagCells::new(dimension), dimension.rows());
            let tiles = d * (d - 1) / 2 + (d - 3) * (d - 2) / 2;
            for (hidden, places) in HiddenCells::ALL.into_iter().zip([3, 3, tiles]) {
                let masks = hidden.masks(dimension);
                assert_eq!(masks.len() as u32, places, "{hidden:?} of {d}");
                for &mask in &masks {
                    assert_eq!(mask.count_ones(), hidden.count(dimension));
                    assert!(masks.contains(&cells.rotate(mask)));
                }
            }
            let tiles = HiddenCells::Tile.masks(dimension);
            assert!(HiddenCells::Apex.masks(dimension).iter().all(|apex| tiles.contains(apex)));
        }
    }

    #[test]
    fn remaining_distances_match_all_pairs() {
        let family = Family::shipped("delTag16h5").unwrap();
        let cells = family.cells();
        let words: Vec<u64> = family
            .codes()
            .iter()
            .flat_map(|&code| [code, cells.rotate(code), cells.rotate(cells.rotate(code))])
            .collect();
        for hidden in HiddenCells::ALL {
            let of = |mask: u64| {
                let pairs = words.iter().enumerate().flat_map(|(i, a)| {
                    words[..i].iter().map(move |b| ((a ^ b) & !mask).count_ones())
                });
                pairs.min()
            };
            let least = hidden.masks(family.dimension()).into_iter().filter_map(of).min();
            assert_eq!(family.distance_without(hidden), least, "{hidden:?}");
        }
    }
}
