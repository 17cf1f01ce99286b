//! Sources of invariant codes: constructions, unions of their cosets, and their arrangement on a tag.
//!
//! [`deltille_core::family::algebra`] contains the values that a family file records, and their proofs.
//!
//! 1. [`residue`]: extended quadratic-residue codes (extended cyclic codes), which have a symmetry of order three;
//! 2. [`bch`]: extended BCH codes of length 64, which also have such a symmetry and fix one position;
//! 3. [`quasicyclic`]: random invariant linear codes with a further quasi-cyclic symmetry;
//! 4. [`coset_graph`]: unions of cosets of an invariant linear code, found by `clique` search over syndromes;
//! 5. [`arrange`]: the assignment of code cycles to tag cycles, by simulated annealing; it determines how many words
//!    satisfy the rules on complexity.

pub mod arrange;
pub mod bch;
mod clique;
pub mod coset_graph;
pub mod quasicyclic;
pub mod residue;
