//! Labelling of grids: from readings of tags to panels, rows and columns, by the evidence of the
//! whole board.
//!
//! A *placement* is a hypothesis of how a grid lies on a panel: a motion of the lattice, seen
//! directly or in a mirror. It predicts a code in every tile with a tag. With l half the log-odds
//! that a cell is white, and s = ±1 the cells of the predicted code, the log-likelihood ratio of a
//! tile is
//!
//! ```text
//!     Λ = Σ ( l s − ln( p e^l + (1 − p) e^−l ) )
//! ```
//!
//! where p is the frequency of white in this cell over the codes of the target and its family. Over
//! codes drawn with these frequencies, e^Λ has the mean 1 whatever the tile shows, and so has the
//! product over tiles; hence by Markov's inequality a placement exceeds the evidence E by chance
//! with a probability below e^−E (the value is an *e-value*). This needs no model of the picture,
//! and cells with little information still contribute.
//!
//! Tiles without tags are predicted to be plain. A tile may be hidden, and then shows cells as
//! drawn, so that e^Λ is replaced by h + (1 − h) e^Λ; a tile that clearly is a code, or plain, is
//! not hidden. A placement must explain the tiles better than each of two boards that are not the
//! target:
//!
//! - one with tags in the same tiles, but other codes, of the target or not;
//! - one whose tiles are plain, or show any code, as they like, whatever part of them is plain.
//!
//! The first tests the codes alone, so that no pattern of plain tiles labels a board whose tags are
//! not read; the second counts tags where none are predicted, plain tiles where tags are, and tiles
//! beyond the end of the panel. Comparison with the better of the two, with its best codes, only
//! reduces the evidence.
//!
//! Where a single tag speaks for a placement, it must also be distinguished from what natural pictures show: with the probabilities P
//! of words w in these ([`deltille_core::family::NaturalWords`]),
//!
//! ```text
//!     Λ = Σ l s − ln Σ P(w) exp Σ l s(w)
//! ```
//!
//! has to be as great. Codes that the rules of the shipped families admit are rarer there than among codes that are drawn, so
//! this decides where a family has simpler codes.
//!
//! Evidence weighs tiles, so many tags that agree outweigh one that does not. A print has no tag in another place and does not
//! continue beyond its panel, though: where a clear code, or corners beyond the panel, contradict a placement, nothing of the
//! grid is labelled.
//!
//! Limits: codes are assumed to be drawn from their family; other lattices on the same board are
//! not considered. The faces of a solid may lie in one grid, so that tiles beyond a panel do not
//! count there; but all placements in a grid together must explain its codes better than a board
//! does that has the same codes elsewhere.
//!
//! 1. `labeller` knows the target; `motion` takes lattices to each other.
//! 2. `sight` compares what the tiles of a grid show with all words.
//! 3. `likelihood` weighs a placement against its `alternatives`.
//! 4. `contradiction` refuses what no print shows; `decide` takes the placements that are left.

pub(crate) mod alternatives;
pub(crate) mod contradiction;
pub(crate) mod decide;
pub(crate) mod labeller;
pub(crate) mod likelihood;
pub(crate) mod motion;
pub(crate) mod sight;
#[cfg(test)]
mod tests;
