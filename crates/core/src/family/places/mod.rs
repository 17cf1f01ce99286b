//! Place codes: nine cells in every tile, which together with those of some neighbours tell the board, the place on
//! it and how it is turned.
//!
//! Take the field F of q³ = 2²⁴ elements, q = 256, and σ(x) = x^q, an automorphism of order three. An element α of
//! order N = q² + q + 1 has α · σ(α) · σ²(α) = 1. Hence, with ω a third of a turn and β = σ(α),
//!
//! ```text
//!     φ(x + y ω) = αˣ βʸ          is a homomorphism from the triangular lattice, and
//!     φ(ω z)     = σ(φ(z)):       a turn of the lattice is an automorphism of the field.
//! ```
//!
//! The tile at z on board b shows, in cell i, the bit Tr(s δᵢ) + mᵢ, where s = γᵇ φ(z) is its *state*, γ generates
//! the subfield of q elements, and Tr is the trace to GF(2). Neighbouring tiles have the states s φ(z′ − z). So:
//!
//! - What any patch of tiles shows is a word of one linear code, up to the mask m, whose 24 bits are the state of one of
//!   its tiles. Two places differ by another word of that code: the least weight is their least distance.
//! - With δ of a cell equal to σ(δ) of the cell that a turn brings there, the patch on a turned board shows a word
//!   of the same code, with the mask turned. Turns are told by the weights of three cosets.
//! - As seen in a mirror it is a word of another such code. That too is a matter of least weight, in the sum of both codes.
//! - The 2²⁴ − 1 states are the places of q − 1 = 255 boards; each repeats itself after √N = 256.5 edges.
//!
//! That is the geometry of the projective plane over GF(q), whose points are the N places of a board (Singer 1938); codes
//! of windows in periodic arrays are those of MacWilliams and Sloane (1976), on the hexagonal lattice and with its turns. δ and m were
//! chosen at random, as the best of thousands by [`distances`]: no place differs from another one, in any turn, in fewer cells.

mod distances;

use std::sync::LazyLock;

use crate::lattice::{Dimension, TagCells, Vertex};
pub use distances::{PatchCertificate, PlaceDistances, certify_places, distances, patches};

/// Name of the family of place codes.
pub const NAME: &str = "dense9";

/// Cells of a tile.
pub const BITS: u32 = 9;

/// Bits of a state.
const DEGREE: u32 = 24;

/// x²⁴ + x⁷ + x² + x + 1, of which x generates all elements of the field.
const POLYNOMIAL: u32 = 0x100_0087;

/// Elements of the subfield, q.
const SUBFIELD: u32 = 1 << (DEGREE / 3);

/// Places on a board, q² + q + 1.
pub const PLACES: u32 = SUBFIELD * SUBFIELD + SUBFIELD + 1;

/// Boards, q − 1; ids of boards are below.
pub const BOARDS: u32 = SUBFIELD - 1;

/// φ of the step along a row, in powers of x^(q − 1); without a factor in common with [`PLACES`].
const STEP: u64 = 23_360;

/// δ of the first cell of each of the three orbits of cells under a turn, by ascending bit.
const WEIGHTS: [u32; 3] = [7_880_881, 441_456, 1_158_408];

/// m, by bit.
const MASK: u64 = 0b0_0101_0010;

/// α.
const ALPHA: u32 = power(2, (SUBFIELD as u64 - 1) * STEP);

/// γ.
const GAMMA: u32 = power(2, PLACES as u64);

/// The product of two elements of the field.
const fn times(mut a: u32, mut b: u32) -> u32 {
    let mut product = 0;
    while b > 0 {
        if b & 1 == 1 {
            product ^= a;
        }
        b >>= 1;
        a <<= 1;
        if a >> DEGREE & 1 == 1 {
            a ^= POLYNOMIAL;
        }
    }
    product
}

/// A power of an element.
const fn power(mut base: u32, mut exponent: u64) -> u32 {
    let mut product = 1;
    while exponent > 0 {
        if exponent & 1 == 1 {
            product = times(product, base);
        }
        base = times(base, base);
        exponent >>= 1;
    }
    product
}

/// σ.
const fn turned(element: u32) -> u32 {
    power(element, SUBFIELD as u64)
}

/// The trace, a bit.
const fn trace(element: u32) -> u32 {
    let (mut sum, mut conjugate, mut i) = (0, element, 0);
    while i < DEGREE {
        sum ^= conjugate;
        conjugate = times(conjugate, conjugate);
        i += 1;
    }
    sum & 1
}

/// δ by bit.
fn weights(cells: &TagCells) -> [u32; BITS as usize] {
    let mut weights = [0; BITS as usize];
    let mut of_orbits = WEIGHTS.into_iter();
    for bit in 0..weights.len() {
        if weights[bit] == 0 {
            // What a turn brings to a bit comes from `rotation[bit]`: δ(bit) = σ(δ(rotation[bit])).
            let [back, further] = {
                let from = usize::from(cells.rotation()[bit]);
                [from, usize::from(cells.rotation()[from])]
            };
            weights[bit] = of_orbits.next().unwrap_or(1);
            weights[further] = turned(weights[bit]);
            weights[back] = turned(weights[further]);
        }
    }
    weights
}

/// The cells of place codes.
pub(super) fn cells() -> TagCells {
    TagCells::new(Dimension::from_bits(BITS).expect("nine cells make a tag"))
}

/// The id of the tile at a vertex of a board, which stands for its state.
///
/// As β = α^q, that of z = col + row · e^(iπ/3) is α^(col + (q + 1) row).
pub fn id(board: u32, tile: Vertex) -> u32 {
    let along = i64::from(tile.col) + i64::from(SUBFIELD + 1) * i64::from(tile.row);
    board * PLACES + along.rem_euclid(PLACES.into()) as u32
}

/// Whether no place is twice on a board of so many rows and columns of tiles, of which every second row lies half an edge
/// further.
pub fn are_different(rows: u32, cols: u32) -> bool {
    let (rows, cols, places) = (i64::from(rows), i64::from(cols), i64::from(PLACES));
    (0..rows).all(|row| {
        let along = (i64::from(SUBFIELD + 1) * row) % places;
        // Half edges to the tiles of that row that show the same.
        [-along, places - along]
            .into_iter()
            .map(|col| (2 * col + row).abs())
            .all(|off| (row == 0 && off == 0) || off > 2 * (cols - 1) + 1)
    })
}

/// The state that an id stands for.
fn state(id: u32) -> u32 {
    times(power(GAMMA, (id / PLACES).into()), power(ALPHA, (id % PLACES).into()))
}

/// Tr(s δ) is the parity of s and these bits, by cell.
static TRACES: LazyLock<[u32; BITS as usize]> = LazyLock::new(|| {
    let of_weight =
        |weight: u32| (0..DEGREE).fold(0, |bits, i| bits | trace(times(weight, 1 << i)) << i);
    weights(&cells()).map(of_weight)
});

/// The word of a tile, by its id.
pub fn word(id: u32) -> u64 {
    unmasked(state(id)) ^ MASK
}

/// The words of the first board, by their ids.
pub(super) fn first_board() -> Vec<u64> {
    let states = std::iter::successors(Some(1), |&state| Some(times(state, ALPHA)));
    states.take(PLACES as usize).map(|state| unmasked(state) ^ MASK).collect()
}

/// What the cells of a tile in a state show less the mask.
fn unmasked(state: u32) -> u64 {
    let parity = |trace: &u32| u64::from((state & trace).count_ones() & 1);
    TRACES.iter().rev().fold(0, |word, trace| word << 1 | parity(trace))
}
