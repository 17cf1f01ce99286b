//! Exact distances between the words of patches of tiles, over all positions.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{BITS, DEGREE, MASK, POSITIONS, cells, id, state, times, unmasked};
use crate::lattice::{Cell, GridKind, Vertex};

/// Minimum number of cells in which a patch of tiles differs from other patches, at any position on
/// any board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct PositionDistances {
    /// Distance from patches with the same rotation, at another position.
    pub places: u32,
    /// Distance from patches with another rotation, at any position.
    pub turned: u32,
    /// Distance from mirrored patches, at any position and in any rotation.
    pub mirrored: u32,
}

impl PositionDistances {
    /// Returns the smallest of the three.
    pub fn least(self) -> u32 {
        self.places.min(self.turned).min(self.mirrored)
    }
}

/// Proven distances of all patches of a size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PatchCertificate {
    /// Number of tiles of a patch.
    pub tiles: usize,
    /// Number of shapes checked: all connected ones with this number of tiles, or the
    /// parallelograms and zigzags of
    /// three by four tiles.
    pub forms: usize,
    /// Minimum over all shapes.
    pub least: PositionDistances,
    /// Claimed minimum distance of patches that are not mirrored, in any rotation.
    pub claimed: u32,
}

impl PatchCertificate {
    /// Returns whether the claim holds.
    pub fn is_valid(&self) -> bool {
        self.least.places.min(self.least.turned) >= self.claimed
    }
}

/// Computes the distances of patches of three, four and five tiles, and of three by four.
pub fn certify_positions() -> Vec<PatchCertificate> {
    let connected = [(3, 1), (4, 2), (5, 4)].map(|(tiles, claimed)| (patches(tiles), claimed));
    let sizes = connected.into_iter().chain([(three_by_four(), 26)]);
    let certify = |(forms, claimed): (Vec<Vec<Vertex>>, u32)| {
        let found = forms.iter().filter_map(|patch| distances(patch));
        let least = found.reduce(|a, b| PositionDistances {
            places: a.places.min(b.places),
            turned: a.turned.min(b.turned),
            mirrored: a.mirrored.min(b.mirrored),
        })?;
        let tiles = forms.first().map_or(0, Vec::len);
        Some(PatchCertificate { tiles, forms: forms.len(), least, claimed })
    };
    sizes.filter_map(certify).collect()
}

/// Returns three rows of four tiles and four of three: sheared to the right, upright, and sheared to the left.
fn three_by_four() -> Vec<Vec<Vertex>> {
    let sheared = [|_: i32| 0, |row: i32| -(row + 1) / 2, |row: i32| -row];
    let sizes = [(3, 4), (4, 3)];
    let forms = sizes.iter().flat_map(|&(rows, cols)| sheared.map(|shift| (rows, cols, shift)));
    let patch = |(rows, cols, shift): (i32, i32, fn(i32) -> i32)| {
        let of_row = move |row| (0..cols).map(move |col| Vertex::new(row, col + shift(row)));
        (0..rows).flat_map(of_row).collect()
    };
    forms.map(patch).collect()
}

/// Maximum number of tiles of a patch, whose cells are the bits of a word.
const MAX_TILES: usize = (u128::BITS / BITS) as usize;

/// Computes the number of cells in which a patch of up to 14 tiles differs from any other of the
/// same shape; `None` for more tiles.
///
/// The result covers all pairs of positions on all boards, by minimum weights of linear codes
/// (Brouwer and Zimmermann).
pub fn distances(tiles: &[Vertex]) -> Option<PositionDistances> {
    let [seen, in_mirror] = [false, true].map(|mirrored| Seen::new(tiles, mirrored));
    if tiles.len() > MAX_TILES {
        return None;
    }
    let pairs = |a: &Seen, b: &Seen, all: bool| -> u32 {
        let generators: Vec<u128> =
            a.generators.iter().chain(if all { &b.generators[..] } else { &[] }).copied().collect();
        let masks = a.masks.iter().enumerate();
        let offsets = masks.flat_map(|(turn, mask)| {
            let others = b.masks.iter().enumerate();
            let others = others.filter(move |&(other, _)| all || other > turn);
            others.map(move |(_, other)| mask ^ other)
        });
        offsets.map(|offset| least_weight(&generators, offset)).min().unwrap_or(0)
    };
    Some(PositionDistances {
        places: least_weight(&seen.generators, 0),
        turned: pairs(&seen, &seen, false),
        mirrored: pairs(&seen, &in_mirror, true),
    })
}

/// Words of patches of one shape without their masks: words of a linear code.
struct Seen {
    /// Contribution of each bit of a state.
    generators: Vec<u128>,
    /// Mask in each rotation.
    masks: [u128; 3],
}

impl Seen {
    fn new(tiles: &[Vertex], mirrored: bool) -> Self {
        let cells = cells();
        let swap = |Vertex { row, col }: Vertex| Vertex::new(col, row);
        let in_mirror = |word: u64| {
            let at = |cell: &Cell| Cell { row: cell.col, col: cell.row, upright: cell.upright };
            let bits = cells.cells().iter().enumerate();
            bits.fold(0, |seen, (bit, cell)| {
                let from = cells.cells().iter().position(|other| *other == at(cell));
                seen | (word >> from.unwrap_or(bit) & 1) << bit
            })
        };
        let look = |word: u64| if mirrored { in_mirror(word) } else { word };
        let join = |word: &dyn Fn(Vertex) -> u64| {
            let tiles = tiles.iter().enumerate();
            tiles.fold(0, |patch, (i, &tile)| {
                patch | u128::from(look(word(tile))) << (BITS * i as u32)
            })
        };
        let generators = (0..DEGREE).map(|bit| {
            join(&|tile| {
                let tile = if mirrored { swap(tile) } else { tile };
                unmasked(times(1 << bit, state(id(0, tile) % POSITIONS)))
            })
        });
        let mut masks = [MASK; 3];
        for turn in 1..3 {
            masks[turn] = cells.rotate(masks[turn - 1]);
        }
        Self { generators: generators.collect(), masks: masks.map(|mask| join(&|_| mask)) }
    }
}

/// Returns the minimum weight of the sums of `offset` and nonzero words of the generated code.
///
/// Consider a systematic form on an information set, which has as many positions as the code has dimensions. A word
/// that is the sum of t rows has weight t there. So after all sums of up to t rows are checked on
/// several disjoint sets, any other word has weight t + 1 or more on each set.
fn least_weight(generators: &[u128], offset: u128) -> u32 {
    let mut forms: Vec<(Vec<u128>, u128, usize)> = Vec::new();
    let mut used = 0;
    loop {
        let (rows, offset, fresh) = systematic(generators, offset, used);
        let found = fresh.count_ones() as usize;
        if found == 0 {
            break;
        }
        used |= fresh;
        let missing = rows.len() - found;
        forms.push((rows, offset, missing));
    }
    let mut least = u32::MAX;
    let dimensions = forms.first().map_or(0, |(rows, ..)| rows.len());
    for count in usize::from(offset == 0)..=dimensions {
        let seen = forms.iter().map(|(rows, offset, _)| least_sum(rows, count, *offset)).min();
        least = least.min(seen.unwrap_or(u32::MAX));
        let others: usize =
            forms.iter().map(|(.., missing)| (count + 1).saturating_sub(*missing)).sum();
        if least as usize <= others {
            break;
        }
    }
    least
}

/// Returns a basis in which each pivot occurs in one row only, the offset without pivots, and the
/// new pivots. Pivots lie outside `used` where possible; only pivots outside `used` are returned.
fn systematic(generators: &[u128], mut offset: u128, used: u128) -> (Vec<u128>, u128, u128) {
    let mut rows = generators.to_vec();
    let (mut rank, mut fresh) = (0, 0);
    for positions in [!used, used] {
        for bit in (0..u128::BITS).map(|bit| 1 << bit).filter(|bit| positions & bit != 0) {
            let Some(row) = (rank..rows.len()).find(|&row| rows[row] & bit != 0) else { continue };
            rows.swap(rank, row);
            let pivot = rows[rank];
            for other in rows.iter_mut().chain([&mut offset]) {
                if *other & bit != 0 && *other != pivot {
                    *other ^= pivot;
                }
            }
            if positions == !used {
                fresh |= bit;
            }
            rank += 1;
        }
    }
    rows.truncate(rank);
    (rows, offset, fresh)
}

/// Returns the minimum weight of the sums of `offset` and `count` of the rows.
fn least_sum(rows: &[u128], count: usize, offset: u128) -> u32 {
    fn below(rows: &[u128], count: usize, sum: u128) -> u32 {
        match count {
            0 => sum.count_ones(),
            1 => rows.iter().map(|row| (sum ^ row).count_ones()).min().unwrap_or(u32::MAX),
            _ => {
                let firsts =
                    (0..rows.len()).map(|i| below(&rows[i + 1..], count - 1, sum ^ rows[i]));
                firsts.min().unwrap_or(u32::MAX)
            }
        }
    }
    if count < 2 {
        return below(rows, count, offset);
    }
    let firsts = (0..rows.len()).into_par_iter();
    let least = firsts.map(|i| below(&rows[i + 1..], count - 1, offset ^ rows[i])).min();
    least.unwrap_or(u32::MAX)
}

/// Returns all connected patches of the given number of tiles that are not shifted or rotated copies; tiles touch in
/// a corner.
pub fn patches(tiles: usize) -> Vec<Vec<Vertex>> {
    let moved = |mut patch: Vec<Vertex>| {
        patch.sort_unstable();
        let first = patch[0];
        patch.into_iter().map(|tile| tile - first).collect::<Vec<_>>()
    };
    // A rotation by 120° maps (row, col) to (col, −row − col).
    let turned = |patch: &Vec<Vertex>| {
        moved(patch.iter().map(|tile| Vertex::new(tile.col, -tile.row - tile.col)).collect())
    };
    let one_of = |patch: Vec<Vertex>| {
        let (second, third) = (turned(&patch), turned(&turned(&patch)));
        patch.min(second).min(third)
    };
    let beside = |patch: &Vec<Vertex>| {
        let around = patch.iter().flat_map(|&tile| {
            GridKind::Deltille.steps().iter().map(move |&step| tile + step).collect::<Vec<_>>()
        });
        let around: BTreeSet<Vertex> = around.filter(|tile| !patch.contains(tile)).collect();
        let grown = around.into_iter().map(|tile| [&patch[..], &[tile]].concat());
        grown.map(moved).map(one_of).collect::<Vec<_>>()
    };
    let mut all: BTreeSet<Vec<Vertex>> = [vec![Vertex::new(0, 0)]].into();
    for _ in 1..tiles {
        all = all.iter().flat_map(beside).collect();
    }
    all.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::super::word;
    use super::*;
    use crate::lattice::Tile;

    fn rhombus(rows: i32, cols: i32) -> Vec<Vertex> {
        (0..rows).flat_map(|row| (0..cols).map(move |col| Vertex::new(row, col))).collect()
    }

    /// Compares with the weights of all words, one by one.
    #[test]
    fn least_weights_match_enumeration() {
        for tiles in [rhombus(1, 2), rhombus(1, 3)] {
            let seen = Seen::new(&tiles, false);
            let generators = &seen.generators[..12];
            for offset in [0, seen.masks[0] ^ seen.masks[1]] {
                let word = |of: u32| {
                    let rows = generators.iter().enumerate().filter(|(i, _)| of >> i & 1 == 1);
                    rows.fold(offset, |sum, (_, row)| sum ^ row)
                };
                let weights = (0..1u32 << 12).map(|of| word(of).count_ones());
                let least = weights.filter(|&weight| offset != 0 || weight > 0).min().unwrap();
                assert_eq!(least_weight(generators, offset), least);
            }
        }
    }

    /// By counting, two tiles cannot suffice, as they have eighteen cells.
    #[test]
    fn three_tiles_identify_place_and_rotation() {
        assert_eq!(patches(3).len(), 5);
        for patch in patches(3) {
            let seen = Seen::new(&patch, false);
            assert!(least_weight(&seen.generators, 0) > 0, "{patch:?}");
            assert!(least_weight(&seen.generators, seen.masks[0] ^ seen.masks[1]) > 0, "{patch:?}");
        }
    }

    #[test]
    fn patches_are_as_far_apart_as_claimed() {
        for certificate in certify_positions() {
            assert!(certificate.is_valid(), "{certificate:?}");
        }
        assert_eq!(distances(&rhombus(3, 5)), None);
    }

    #[test]
    fn rotated_lattices_give_words_of_the_same_code() {
        let patch = rhombus(3, 4);
        let cells = cells();
        // A rotation by 120° maps the tile at (row, col) to that at (col, −row − col − 1). It is
        // one column further left because a different vertex becomes its lower left one.
        let turned: Vec<Vertex> =
            patch.iter().map(|tile| Vertex::new(tile.col, -tile.row - tile.col - 1)).collect();
        let shown = patch.iter().zip(&turned).map(|(&from, &to)| {
            let word = word(id(3, from + Vertex::new(40, 20)));
            (to, cells.rotate(word ^ MASK))
        });
        let at: Vec<Vertex> = turned.clone();
        let seen = Seen::new(&at, false);
        let patch_word = shown
            .enumerate()
            .fold(0u128, |sum, (i, (_, word))| sum | u128::from(word) << (BITS * i as u32));
        assert_eq!(least_weight(&seen.generators, patch_word), 0);
    }

    #[test]
    fn tiles_match_the_lattice() {
        // Patches grow by tiles that share a vertex with one of theirs.
        let around = GridKind::Deltille.steps().iter().map(|&step| Tile::upright(step));
        let middle: BTreeSet<Vertex> = Tile::upright(Vertex::new(0, 0)).vertices().collect();
        for tile in around {
            assert!(tile.vertices().any(|vertex| middle.contains(&vertex)));
        }
    }
}
