use std::num::NonZeroU8;
use std::ops::RangeInclusive;

use glam::DVec2;

use super::GridKind;

/// Tag dimension d: a tag has d rows of cells and d² bits. d is 3 (9 bits) to 8 (64 bits, the size of a machine
/// word).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dimension(NonZeroU8);

/// Range of the number of rows.
const DIMENSIONS: RangeInclusive<u8> = 3..=8;

/// An invalid number of tag bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a tag has 9, 16, 25, 36, 49 or 64 bits, not {0}")]
pub struct DimensionError(pub u32);

impl Dimension {
    /// Returns the dimension of a tag with `bits` = 9, 16, 25, 36, 49 or 64 bits.
    ///
    /// # Errors
    /// Returns an error for any other number of bits.
    pub fn from_bits(bits: u32) -> Result<Self, DimensionError> {
        let d = bits.isqrt();
        match NonZeroU8::new(d as u8) {
            Some(nonzero) if d * d == bits && DIMENSIONS.contains(&nonzero.get()) => {
                Ok(Self(nonzero))
            }
            _ => Err(DimensionError(bits)),
        }
    }

    /// Returns all dimensions, smallest first.
    pub fn all() -> impl Iterator<Item = Dimension> {
        DIMENSIONS.filter_map(NonZeroU8::new).map(Dimension)
    }

    /// Returns the number of rows of cells, d.
    pub fn rows(self) -> u32 {
        u32::from(self.0.get())
    }

    /// Returns the number of bits of a tag, d².
    pub fn bits(self) -> u32 {
        self.rows() * self.rows()
    }

    /// Returns a word with all bits of the tag set.
    pub fn mask(self) -> u64 {
        u64::MAX >> (u64::BITS - self.bits())
    }
}

/// One small triangle or square of a tag.
///
/// ```text
///               ╱╲
///              ╱24╲                 d = 5: the number in a cell is its bit; rows count from the
///             ╱────╲                base, r = 0, to the apex; in a row the cells k = 0, 1, 2, …
///            ╱23╲22╱╲               are upright, inverted, upright, …
///           ╱────╲╱21╲
///          ╱  20 … 16 ╲             cell k of row r carries bit d² − 1 − (d−1−r)² − k:
///         ╱────────────╲            the apex is the most significant bit,
///        ╱   15 … 9     ╲           the bottom-right cell is bit 0
///       ╱────────────────╲
///      ╱ 8 7 6 5 4 3 2 1 0╲
///    A ────────────────────  B
/// ```
///
/// A square tag is an AprilTag: its cells are read like a page, row by row from the upper left; the first one is the
/// most significant bit.
///
/// ```text
///      C ───────────────
///      │ 15  14  13  12 │       d = 4: rows count from the base here too, so that cell k of row r
///      │ 11  10   9   8 │       carries bit r·d + d − 1 − k
///      │  7   6   5   4 │
///      │  3   2   1   0 │
///      A ─────────────── B
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cell {
    /// Row from the base, 0 to d − 1.
    pub row: u32,
    /// Column from the left. For a triangle it is the column of the enclosing rhombus: k = 2·col or 2·col + 1.
    pub col: u32,
    /// Whether the cell points up, as all squares do.
    pub upright: bool,
}

/// The cells of a tag of one kind and dimension: bit order, rotation, adjacency, geometry.
#[derive(Clone, Debug)]
pub struct TagCells {
    kind: GridKind,
    dimension: Dimension,
    /// Cell of each bit, index = bit.
    cells: Vec<Cell>,
    /// For bit i, the bit whose cell moves to bit i's cell when the tag is rotated counterclockwise.
    source: Vec<u8>,
    /// Pairs of bits whose cells share an edge.
    neighbours: Vec<[u8; 2]>,
}

impl TagCells {
    /// Creates the cells of a triangular tag, a DelTag, of dimension `d`.
    pub fn new(dimension: Dimension) -> Self {
        Self::of(GridKind::Deltille, dimension)
    }

    /// Creates the cells of a tag that fills a tile of `kind`.
    pub fn of(kind: GridKind, dimension: Dimension) -> Self {
        let d = dimension.rows();
        let cells: Vec<Cell> = {
            let in_row = move |row: u32| match kind {
                GridKind::Deltille => 2 * (d - row) - 1,
                GridKind::Checker => d,
            };
            let cell = move |row: u32, k: u32| match kind {
                GridKind::Deltille => Cell { row, col: k / 2, upright: k.is_multiple_of(2) },
                GridKind::Checker => Cell { row, col: k, upright: true },
            };
            let mut by_bit: Vec<_> = (0..d)
                .flat_map(|row| (0..in_row(row)).map(move |k| cell(row, k)))
                .map(|cell| (bit_of(kind, d, cell), cell))
                .collect();
            by_bit.sort_by_key(|&(bit, _)| bit);
            by_bit.into_iter().map(|(_, cell)| cell).collect()
        };
        let source = cells.iter().map(|&cell| bit_of(kind, d, source_of(kind, d, cell)) as u8);
        let source = source.collect();
        let neighbours = cells.iter().flat_map(|&cell| {
            let Cell { row, col, upright } = cell;
            let beside: &[(u32, u32)] = match kind {
                // The other cell of the same rhombus, the one to the right, and the one above share an edge with it.
                GridKind::Deltille if !upright => &[(row, col), (row, col + 1), (row + 1, col)],
                GridKind::Deltille => &[],
                GridKind::Checker => &[(row, col + 1), (row + 1, col)],
            };
            let inside = beside.iter().filter(|&&(row, col)| row < d && col < d);
            let pairs = inside.map(|&(row, col)| {
                let other = Cell { row, col, upright: true };
                [cell, other].map(|cell| bit_of(kind, d, cell) as u8)
            });
            pairs.collect::<Vec<_>>()
        });
        let neighbours = neighbours.collect();
        Self { kind, dimension, cells, source, neighbours }
    }

    /// Returns the tiling whose tiles the tag fills.
    pub fn kind(&self) -> GridKind {
        self.kind
    }

    /// Returns the dimension d of the tag.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Returns the cell that carries each bit: index 0 is the least significant bit.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns the pairs of bits whose cells share an edge: 3·d·(d−1)/2 pairs, or 2·d·(d−1) in a square tag.
    pub fn neighbours(&self) -> &[[u8; 2]] {
        &self.neighbours
    }

    /// Returns, for each bit, the bit whose content it receives when the tag rotates counterclockwise by 120° or 90°.
    pub fn rotation(&self) -> &[u8] {
        &self.source
    }

    /// Returns the word read from the same cells after the tag was rotated counterclockwise by 120° or 90°.
    pub fn rotate(&self, word: u64) -> u64 {
        self.source
            .iter()
            .enumerate()
            .fold(0, |turned, (to, &from)| turned | ((word >> from & 1) << to))
    }

    /// Returns, for each bit, the bit whose cell moves to its position in a mirror image with rows and columns
    /// exchanged.
    pub fn mirror(&self) -> Vec<u8> {
        let of = |cell: &Cell| {
            let mirrored = Cell { row: cell.col, col: cell.row, upright: cell.upright };
            bit_of(self.kind, self.dimension.rows(), mirrored) as u8
        };
        self.cells.iter().map(of).collect()
    }

    /// Returns the length of the tile's edge in bit-widths, for cells that start `inset` bit-widths from each side,
    /// measured along the edge. The inset is the border of the tag and the margin around it.
    pub fn width(&self, inset: f64) -> f64 {
        f64::from(self.dimension.rows()) + self.kind.insets() * inset
    }

    /// Returns the centre of a bit's cell in tile coordinates (u along A→B, v along A→C, both 0..1).
    pub fn centre(&self, bit: u32, inset: f64) -> DVec2 {
        let corners = self.corners(bit, inset);
        corners.iter().sum::<DVec2>() / corners.len() as f64
    }

    /// Returns the corners of a bit's cell in tile coordinates, counterclockwise on the print.
    pub fn corners(&self, bit: u32, inset: f64) -> Vec<DVec2> {
        let width = self.width(inset);
        let Cell { row, col, upright } = self.cells[bit as usize];
        let (u, v) = (inset + f64::from(col), inset + f64::from(row));
        let corners: &[[f64; 2]] = match (self.kind, upright) {
            (GridKind::Checker, _) => &[[u, v], [u + 1.0, v], [u + 1.0, v + 1.0], [u, v + 1.0]],
            (GridKind::Deltille, true) => &[[u, v], [u + 1.0, v], [u, v + 1.0]],
            (GridKind::Deltille, false) => &[[u + 1.0, v + 1.0], [u, v + 1.0], [u + 1.0, v]],
        };
        corners.iter().map(|&corner| DVec2::from(corner) / width).collect()
    }
}

/// Returns the bit of a cell: d² − 1 − (d−1−r)² − k, or r·d + d − 1 − k in a square tag.
fn bit_of(kind: GridKind, d: u32, cell: Cell) -> u32 {
    if kind == GridKind::Checker {
        return cell.row * d + d - 1 - cell.col;
    }
    let k = 2 * cell.col + u32::from(!cell.upright);
    let above = d - 1 - cell.row;
    d * d - 1 - above * above - k
}

/// Returns the cell that a counterclockwise rotation moves onto `cell`.
///
/// In barycentric cell coordinates (towards B, C, A) = (col, row, rest), a rotation by 120° maps
/// (b, c, a) to (a, b, c). So the cell at (col, row, rest) came from (row, rest, col). A rotation
/// by 90° maps column c, row r to column d
/// − 1 − r, row c.
fn source_of(kind: GridKind, d: u32, cell: Cell) -> Cell {
    if kind == GridKind::Checker {
        return Cell { row: d - 1 - cell.col, col: cell.row, upright: true };
    }
    let side = if cell.upright { d - 1 } else { d - 2 };
    let rest = side - cell.row - cell.col;
    Cell { col: cell.row, row: rest, upright: cell.upright }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = TagCells> {
        Dimension::all().map(TagCells::new)
    }

    fn squares() -> impl Iterator<Item = TagCells> {
        Dimension::all().map(|dimension| TagCells::of(GridKind::Checker, dimension))
    }

    /// The 90° rotation as a motion of the plane: A→B→D→C maps (u, v) to (1−v, u).
    #[test]
    fn four_rotations_of_a_square_tag_are_the_identity() {
        for tag in squares() {
            for (to, &from) in tag.rotation().iter().enumerate() {
                let DVec2 { x: u, y: v } = tag.centre(u32::from(from), 1.5);
                let turned = DVec2::new(1.0 - v, u);
                assert!(tag.centre(to as u32, 1.5).abs_diff_eq(turned, 1e-12));
            }
            let word = 0x1234_5678_9abc_def1 & tag.dimension().mask();
            let turned = (0..4).fold(word, |word, _| tag.rotate(word));
            assert_eq!(turned, word);
            let d = tag.dimension().rows() as usize;
            assert_eq!(tag.neighbours().len(), 2 * d * (d - 1));
            assert_eq!(tag.cells()[d * d - 1], Cell { row: d as u32 - 1, col: 0, upright: true });
        }
    }

    #[test]
    fn bits_run_from_the_apex_to_the_bottom_right() {
        for tag in all() {
            let d = tag.dimension().rows();
            assert_eq!(tag.dimension().mask().count_ones(), d * d);
            let last = tag.cells().len() - 1;
            assert_eq!(tag.cells()[last], Cell { row: d - 1, col: 0, upright: true });
            assert_eq!(tag.cells()[0], Cell { row: 0, col: d - 1, upright: true });
        }
    }

    #[test]
    fn three_rotations_are_the_identity_and_fix_only_a_central_cell() {
        for tag in all() {
            let fixed =
                tag.rotation().iter().enumerate().filter(|&(i, &s)| i == s as usize).count();
            assert_eq!(fixed as u32, u32::from(tag.dimension().bits() % 3 == 1));
            for word in [1, 0b1011, 0x5a5a_5a5a_5a5a & tag.dimension().mask()] {
                assert_eq!(tag.rotate(tag.rotate(tag.rotate(word))), word);
            }
        }
    }

    /// The 120° rotation as a motion of the plane: A→B→C→A maps (u, v) to (1−u−v, u).
    #[test]
    fn rotation_agrees_with_geometry() {
        for tag in all() {
            for (to, &from) in tag.rotation().iter().enumerate() {
                let DVec2 { x: u, y: v } = tag.centre(u32::from(from), 1.5);
                let turned = DVec2::new(1.0 - u - v, u);
                assert!(tag.centre(to as u32, 1.5).abs_diff_eq(turned, 1e-12));
            }
        }
    }

    /// Two reflections are the identity, and a reflection inverts rotations.
    #[test]
    fn reflections_and_rotations_are_the_symmetries_of_a_tag() {
        for tag in all().chain(squares()) {
            let (mirror, turn) = (tag.mirror(), tag.rotation().to_vec());
            let then = |first: &[u8], next: &[u8]| -> Vec<u8> {
                next.iter().map(|&from| first[usize::from(from)]).collect()
            };
            let stays: Vec<u8> = (0..tag.dimension().bits() as u8).collect();
            assert_eq!(then(&mirror, &mirror), stays);
            let turned = then(&then(&then(&mirror, &turn), &mirror), &turn);
            assert_eq!(turned, stays, "{:?}", tag.kind());
        }
    }

    #[test]
    fn adjacency_counts_match_the_published_rule() {
        let counts: Vec<usize> = all().map(|tag| tag.neighbours().len()).collect();
        assert_eq!(counts, [9, 18, 30, 45, 63, 84]);
    }

    #[test]
    fn centres_match_the_published_formula() {
        let tag = TagCells::new(Dimension::from_bits(25).unwrap());
        for (bit, cell) in tag.cells().iter().enumerate() {
            let third = if cell.upright { 1.0 / 3.0 } else { 2.0 / 3.0 };
            let cell = DVec2::new(cell.col.into(), cell.row.into());
            let formula = (2.0 + cell + third) / 11.0;
            assert!(tag.centre(bit as u32, 2.0).abs_diff_eq(formula, 1e-12));
        }
    }

    #[test]
    fn other_bit_counts_are_rejected() {
        assert_eq!(Dimension::from_bits(24).unwrap_err(), DimensionError(24));
        assert!(Dimension::from_bits(4).is_err() && Dimension::from_bits(81).is_err());
    }
}
