//! Position codes: nine cells in every tile. Together with those of some neighbours, they identify the board, the
//! position on it and its rotation.
//!
//! Take the field F of q³ = 2²⁴ elements, q = 256, and σ(x) = x^q, an automorphism of order three. An element α of
//! order N = q² + q + 1 has α · σ(α) · σ²(α) = 1. Hence, with ω a rotation by 120° and β = σ(α),
//!
//! ```text
//!     φ(x + y ω) = αˣ βʸ          is a homomorphism from the triangular lattice, and
//!     φ(ω z)     = σ(φ(z)):       a rotation of the lattice is an automorphism of the field.
//! ```
//!
//! The tile at z on board b shows, in cell i, the bit Tr(s δᵢ) + mᵢ. Here s = γᵇ φ(z) is its *state*, γ generates the
//! subfield of q elements, and Tr is the trace to GF(2). Neighbouring tiles have the states s φ(z′ − z). So:
//!
//! - The word of any patch of tiles is a word of one linear code, up to the mask m; its 24 information bits are the
//!   state of one of its tiles. Two positions differ by another word of that code, so the minimum
//!   weight is their
//!   minimum distance.
//! - If δ of a cell equals σ(δ) of the cell that a rotation moves there, the patch on a rotated board gives a word of
//!   the same code, with the mask rotated. The weights of three cosets distinguish the rotations.
//! - A mirrored patch gives a word of another code of this kind. Its distance is again a minimum
//!   weight, in the sum of both
//!   codes.
//! - The 2²⁴ − 1 states are the positions on q − 1 = 255 boards; each board repeats after √N =
//!   256.5 edges.
//!
//! This is the geometry of the projective plane over GF(q), whose points are the N positions on a
//! board (Singer 1938).
//! MacWilliams and Sloane (1976) describe codes of windows in periodic arrays. Here they are
//! applied to the hexagonal lattice with its rotations. δ and m are the best of thousands of random
//! choices, compared by [`distances`]: their minimum distance over all positions and rotations is
//! the largest found.

mod distances;

use std::sync::LazyLock;

use crate::lattice::{Dimension, TagCells, Vertex};
pub use distances::{PatchCertificate, PositionDistances, certify_positions, distances, patches};

/// Name of the family of position codes.
pub const NAME: &str = "dense9";

/// Number of cells of a tile.
pub const BITS: u32 = 9;

/// Number of bits of a state.
const DEGREE: u32 = 24;

/// Polynomial x²⁴ + x⁷ + x² + x + 1, for which x generates all elements of the field.
const POLYNOMIAL: u32 = 0x100_0087;

/// Number of elements of the subfield, q.
const SUBFIELD: u32 = 1 << (DEGREE / 3);

/// Number of positions on a board, q² + q + 1.
pub const POSITIONS: u32 = SUBFIELD * SUBFIELD + SUBFIELD + 1;

/// Number of boards, q − 1; board ids are smaller.
pub const BOARDS: u32 = SUBFIELD - 1;

/// φ of the step along a row, in powers of x^(q − 1); coprime with [`POSITIONS`].
const STEP: u64 = 23_360;

/// δ of the first cell of each of the three orbits of cells under a rotation, by increasing bit.
const WEIGHTS: [u32; 3] = [7_880_881, 441_456, 1_158_408];

/// Mask m, by bit.
const MASK: u64 = 0b0_0101_0010;

/// Element α.
const ALPHA: u32 = power(2, (SUBFIELD as u64 - 1) * STEP);

/// Element γ.
const GAMMA: u32 = power(2, POSITIONS as u64);

/// Returns the product of two elements of the field.
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

/// Returns a power of an element.
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

/// Applies σ.
const fn turned(element: u32) -> u32 {
    power(element, SUBFIELD as u64)
}

/// Returns the trace, a bit.
const fn trace(element: u32) -> u32 {
    let (mut sum, mut conjugate, mut i) = (0, element, 0);
    while i < DEGREE {
        sum ^= conjugate;
        conjugate = times(conjugate, conjugate);
        i += 1;
    }
    sum & 1
}

/// Returns δ by bit.
fn weights(cells: &TagCells) -> [u32; BITS as usize] {
    let mut weights = [0; BITS as usize];
    let mut of_orbits = WEIGHTS.into_iter();
    for bit in 0..weights.len() {
        if weights[bit] == 0 {
            // A rotation moves the content of `rotation[bit]` to a bit: δ(bit) = σ(δ(rotation[bit])).
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

/// Returns the cells of position codes.
pub(super) fn cells() -> TagCells {
    TagCells::new(Dimension::from_bits(BITS).expect("nine cells make a tag"))
}

/// Returns the id of the tile at a vertex of a board, which represents its state.
///
/// Since β = α^q, the state of z = col + row · e^(iπ/3) is α^(col + (q + 1) row).
pub fn id(board: u32, tile: Vertex) -> u32 {
    let along = i64::from(tile.col) + i64::from(SUBFIELD + 1) * i64::from(tile.row);
    board * POSITIONS + along.rem_euclid(POSITIONS.into()) as u32
}

/// Returns whether all positions are distinct on a board with these numbers of rows and columns of
/// tiles. Every second
/// row is shifted by half an edge.
pub fn are_different(rows: u32, cols: u32) -> bool {
    let (rows, cols, places) = (i64::from(rows), i64::from(cols), i64::from(POSITIONS));
    (0..rows).all(|row| {
        let along = (i64::from(SUBFIELD + 1) * row) % places;
        // Distances in half edges to the tiles of that row with the same code.
        [-along, places - along]
            .into_iter()
            .map(|col| (2 * col + row).abs())
            .all(|off| (row == 0 && off == 0) || off > 2 * (cols - 1) + 1)
    })
}

/// Returns the state that an id represents.
fn state(id: u32) -> u32 {
    times(power(GAMMA, (id / POSITIONS).into()), power(ALPHA, (id % POSITIONS).into()))
}

/// Bits by cell: Tr(s δ) is the parity of s and these bits.
static TRACES: LazyLock<[u32; BITS as usize]> = LazyLock::new(|| {
    let of_weight =
        |weight: u32| (0..DEGREE).fold(0, |bits, i| bits | trace(times(weight, 1 << i)) << i);
    weights(&cells()).map(of_weight)
});

/// Returns the word of a tile by its id.
pub fn word(id: u32) -> u64 {
    unmasked(state(id)) ^ MASK
}

/// Returns the words of the first board by their ids.
pub(super) fn first_board() -> Vec<u64> {
    let states = std::iter::successors(Some(1), |&state| Some(times(state, ALPHA)));
    states.take(POSITIONS as usize).map(|state| unmasked(state) ^ MASK).collect()
}

/// Returns the word of a tile in a state, without the mask.
fn unmasked(state: u32) -> u64 {
    let parity = |trace: &u32| u64::from((state & trace).count_ones() & 1);
    TRACES.iter().rev().fold(0, |word, trace| word << 1 | parity(trace))
}
