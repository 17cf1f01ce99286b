//! Labels grids: from readings of tags to panels, rows and columns, by the evidence of the whole board.
//!
//! A *placement* is a hypothesis of how a grid lies on a panel: a motion of the lattice, seen directly or mirrored. It
//! predicts a code in every tile with a tag. Let l be half the log-odds that a cell is white, and s = ±1 the cells of
//! the predicted code. The log-likelihood ratio of a tile is
//!
//! ```text
//!     Λ = Σ ( l s − ln( p e^l + (1 − p) e^−l ) )
//! ```
//!
//! where p is the frequency of white in this cell over the codes of the target and its family. Over codes drawn with
//! these frequencies, e^Λ has the mean 1 for any tile, and so has the product over tiles. By Markov's inequality,
//! random content gives a placement more evidence than E with a probability below e^−E (the value is an *e-value*).
//! This needs no model of the image, and cells with little information still contribute.
//!
//! Tiles without tags are predicted to be plain. A tile may be hidden. It then shows random cells, so e^Λ is replaced
//! by h + (1 − h) e^Λ. A tile that clearly shows a code, or is clearly plain, is not hidden. A
//! placement must explain the tiles better than each of two alternative boards:
//!
//! - one with tags in the same tiles, but other codes, of the target or not;
//! - one whose tiles are arbitrary: plain or any code, with any fraction of plain tiles.
//!
//! The first tests the codes alone, so that no pattern of plain tiles labels a board whose tags are not read. The
//! second counts tags where none are predicted, plain tiles where tags are predicted, and tiles beyond the end of the
//! panel. Comparison with the better of the two, with its best codes, only reduces the evidence.
//!
//! If a single tag supports a placement, this tag must also be distinguished from natural images.
//! Let P be the probabilities of words w in these ([`deltille_core::family::NaturalWords`]). Then
//!
//! ```text
//!     Λ = Σ l s − ln Σ P(w) exp Σ l s(w)
//! ```
//!
//! has to reach the same threshold. Codes that the rules of the shipped families admit are rarer in natural images than
//! among random codes, so this test matters for families with simpler codes.
//!
//! The evidence is a sum over tiles, so many tags that agree outweigh one that does not. However, a
//! print never has a tag in another position, and never continues beyond its panel. If a clear
//! code, or corners beyond the panel, contradict a placement, the whole grid stays without labels.
//!
//! Limitations: codes are assumed to be drawn from their family; other lattices on the same board
//! are not considered. The faces of a solid may lie in one grid, so tiles beyond a panel do not
//! count there. Instead, all placements in a grid together must explain its codes better than a
//! board that has the same codes elsewhere.
//!
//! 1. `labeller` describes the target; `motion` maps lattices to each other.
//! 2. `sight` compares the tiles of a grid with all words.
//! 3. `likelihood` weighs a placement against its `alternatives`.
//! 4. `contradiction` rejects impossible placements; `decide` selects from the rest.

pub(crate) mod alternatives;
pub(crate) mod contradiction;
pub(crate) mod decide;
pub(crate) mod labeller;
pub(crate) mod likelihood;
pub(crate) mod motion;
pub(crate) mod sight;
#[cfg(test)]
mod tests;
