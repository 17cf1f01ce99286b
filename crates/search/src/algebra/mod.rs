//! Where invariant codes come from: constructions, unions of their cosets, and how they are arranged on a tag.
//!
//! Values that a family file records, and what proves them, are in [`deltille_core::family::algebra`].
//!
//! 1. [`residue`]: extended quadratic-residue codes (extended cyclic codes), which have a symmetry of order three;
//! 2. [`bch`]: extended BCH codes of length 64, which have one, too, and fix one position;
//! 3. [`quasicyclic`]: random invariant linear codes with a further quasi-cyclic symmetry;
//! 4. [`coset_graph`]: unions of cosets of an invariant linear code, found by `clique` search over syndromes;
//! 5. [`arrange`]: the assignment of code cycles to tag cycles, by simulated annealing; it decides how many words satisfy the
//!    rules on complexity.

pub mod arrange;
pub mod bch;
mod clique;
pub mod coset_graph;
pub mod quasicyclic;
pub mod residue;
