use std::num::NonZeroU8;

/// Tag dimension d: a tag has d rows of cells and d² bits. From 3 (9 bits) to 7 (49 bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dimension(NonZeroU8);

/// A number of bits that no tag has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a tag has 9, 16, 25, 36 or 49 bits, not {0}")]
pub struct DimensionError(pub u32);

impl Dimension {
    /// The dimension of a tag with `bits` = 9, 16, 25, 36 or 49 bits.
    pub fn from_bits(bits: u32) -> Result<Self, DimensionError> {
        let d = bits.isqrt();
        match NonZeroU8::new(d as u8) {
            Some(nonzero) if d * d == bits && (3..=7).contains(&d) => Ok(Self(nonzero)),
            _ => Err(DimensionError(bits)),
        }
    }

    /// All dimensions, smallest first.
    pub fn all() -> impl Iterator<Item = Dimension> {
        (3..=7u8).filter_map(NonZeroU8::new).map(Dimension)
    }

    /// Rows of cells, d.
    pub fn rows(self) -> u32 {
        u32::from(self.0.get())
    }

    /// Bits of a tag, d².
    pub fn bits(self) -> u32 {
        self.rows() * self.rows()
    }

    /// A word with all bits of the tag set.
    pub fn mask(self) -> u64 {
        (1 << self.bits()) - 1
    }
}

/// One small triangle of a tag.
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cell {
    /// Row from the base, 0 to d − 1.
    pub row: u32,
    /// Column of the rhombus that holds the cell, from the left: k = 2·col, or 2·col + 1.
    pub col: u32,
    /// Whether the cell points up.
    pub upright: bool,
}

/// The cells of a tag of one dimension: bit order, rotation by 120°, adjacency, geometry.
#[derive(Clone, Debug)]
pub struct TagCells {
    dimension: Dimension,
    /// Cell of each bit, index = bit.
    cells: Vec<Cell>,
    /// Bit whose cell lands on bit i's cell when the tag is turned 120° counter-clockwise.
    source: Vec<u8>,
    /// Pairs of bits whose cells share an edge.
    neighbours: Vec<[u8; 2]>,
}

impl TagCells {
    /// The cells of a tag of dimension `d`.
    pub fn new(dimension: Dimension) -> Self {
        let d = dimension.rows();
        let cells: Vec<Cell> = {
            let mut by_bit: Vec<_> = (0..d)
                .flat_map(|row| (0..2 * (d - row) - 1).map(move |k| (row, k)))
                .map(|(row, k)| Cell { row, col: k / 2, upright: k % 2 == 0 })
                .map(|cell| (bit_of(d, cell), cell))
                .collect();
            by_bit.sort_by_key(|&(bit, _)| bit);
            by_bit.into_iter().map(|(_, cell)| cell).collect()
        };
        let source = cells.iter().map(|&cell| bit_of(d, turned_clockwise(d, cell)) as u8).collect();
        let neighbours = cells
            .iter()
            .filter(|cell| !cell.upright)
            .flat_map(|&inverted| {
                let Cell { row, col, .. } = inverted;
                // Its own rhombus, the one to the right, and the one above share an edge with it.
                [(row, col), (row, col + 1), (row + 1, col)].map(|(row, col)| {
                    let upright = Cell { row, col, upright: true };
                    [bit_of(d, inverted) as u8, bit_of(d, upright) as u8]
                })
            })
            .collect();
        Self { dimension, cells, source, neighbours }
    }

    /// The dimension.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The cell that carries each bit: index 0 is the least significant bit.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Pairs of bits whose cells share an edge: 3·d·(d−1)/2 of them.
    pub fn neighbours(&self) -> &[[u8; 2]] {
        &self.neighbours
    }

    /// For each bit the bit whose content it receives when the tag turns 120° counter-clockwise.
    pub fn rotation(&self) -> &[u8] {
        &self.source
    }

    /// The word read off the same cells after the tag was turned 120° counter-clockwise.
    pub fn rotate(&self, word: u64) -> u64 {
        self.source
            .iter()
            .enumerate()
            .fold(0, |turned, (to, &from)| turned | ((word >> from & 1) << to))
    }

    /// Centre of a bit's cell in tile coordinates (u along A→B, v along A→C, both 0..1), for a
    /// border of `border` bit-widths measured along the edge.
    pub fn centre(&self, bit: u32, border: f64) -> [f64; 2] {
        let [a, b, c] = self.corners(bit, border);
        [(a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0]
    }

    /// The three corners of a bit's cell in tile coordinates, counter-clockwise on the print.
    pub fn corners(&self, bit: u32, border: f64) -> [[f64; 2]; 3] {
        let width = f64::from(self.dimension.rows()) + 3.0 * border;
        let Cell { row, col, upright } = self.cells[bit as usize];
        let (u, v) = (border + f64::from(col), border + f64::from(row));
        let corners = if upright {
            [[u, v], [u + 1.0, v], [u, v + 1.0]]
        } else {
            [[u + 1.0, v + 1.0], [u, v + 1.0], [u + 1.0, v]]
        };
        corners.map(|[u, v]| [u / width, v / width])
    }
}

/// Bit carried by a cell: d² − 1 − (d−1−r)² − k.
fn bit_of(d: u32, cell: Cell) -> u32 {
    let k = 2 * cell.col + u32::from(!cell.upright);
    let above = d - 1 - cell.row;
    d * d - 1 - above * above - k
}

/// The cell that a counter-clockwise turn by 120° (A→B→C→A) moves onto `cell`.
///
/// In barycentric cell coordinates (towards B, C, A) = (col, row, rest) the turn sends
/// (b, c, a) to (a, b, c), so the cell at (col, row, rest) came from (row, rest, col).
fn turned_clockwise(d: u32, cell: Cell) -> Cell {
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

    #[test]
    fn bits_run_from_the_apex_to_the_bottom_right() {
        for tag in all() {
            let d = tag.dimension().rows();
            let last = tag.cells().len() - 1;
            assert_eq!(tag.cells()[last], Cell { row: d - 1, col: 0, upright: true });
            assert_eq!(tag.cells()[0], Cell { row: 0, col: d - 1, upright: true });
        }
    }

    #[test]
    fn three_turns_are_none_and_only_a_central_cell_stays() {
        for tag in all() {
            let fixed =
                tag.rotation().iter().enumerate().filter(|&(i, &s)| i == s as usize).count();
            assert_eq!(fixed as u32, u32::from(tag.dimension().bits() % 3 == 1));
            for word in [1, 0b1011, 0x5a5a_5a5a_5a5a & tag.dimension().mask()] {
                assert_eq!(tag.rotate(tag.rotate(tag.rotate(word))), word);
            }
        }
    }

    /// The turn as a motion of the plane: A→B→C→A sends (u, v) to (1−u−v, u).
    #[test]
    fn rotation_agrees_with_geometry() {
        for tag in all() {
            for (to, &from) in tag.rotation().iter().enumerate() {
                let [u, v] = tag.centre(u32::from(from), 1.5);
                let [x, y] = tag.centre(to as u32, 1.5);
                assert!((x - (1.0 - u - v)).abs() < 1e-12 && (y - u).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn adjacency_counts_match_the_published_rule() {
        let counts: Vec<usize> = all().map(|tag| tag.neighbours().len()).collect();
        assert_eq!(counts, [9, 18, 30, 45, 63]);
    }

    #[test]
    fn centres_match_the_published_formula() {
        let tag = TagCells::new(Dimension::from_bits(25).unwrap());
        for (bit, cell) in tag.cells().iter().enumerate() {
            let third = if cell.upright { 1.0 / 3.0 } else { 2.0 / 3.0 };
            let [u, v] = tag.centre(bit as u32, 2.0);
            assert!((u - (2.0 + f64::from(cell.col) + third) / 11.0).abs() < 1e-12);
            assert!((v - (2.0 + f64::from(cell.row) + third) / 11.0).abs() < 1e-12);
        }
    }

    #[test]
    fn other_bit_counts_are_refused() {
        assert_eq!(Dimension::from_bits(24).unwrap_err(), DimensionError(24));
        assert!(Dimension::from_bits(4).is_err() && Dimension::from_bits(64).is_err());
    }
}
