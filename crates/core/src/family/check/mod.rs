//! Checks of a family.
//!
//! The input is a family; the results are proofs and figures. `certificate` proves the claims of its file, with
//! `hidden` (distances with covered cells). `statistics` counts distances, `confusion` and `reading` predict
//! misreadings, `natural` false positives in natural images; `frontier` compares rules with sizes. [`bounds`] and
//! `invariant_bounds` limit the number of codes.

pub mod bounds;
pub(in crate::family) mod certificate;
pub(in crate::family) mod confusion;
pub(in crate::family) mod frontier;
pub(in crate::family) mod hidden;
pub(in crate::family) mod invariant_bounds;
pub(in crate::family) mod natural;
pub(in crate::family) mod reading;
pub(in crate::family) mod statistics;

pub use certificate::{Certificate, certify, certify_codes};
pub use confusion::Confusion;
pub use frontier::{RuleChoice, best_rule, rule_choices};
pub use hidden::{HiddenCells, Robust};
pub use invariant_bounds::invariant_bound;
pub use natural::{
    ACCEPTED_FALSE_POSITIVES, NATURAL_FACTOR, NaturalWords, TRIANGLES_PER_MEGAPIXEL,
    corrected_within,
};
pub use reading::Reading;
pub use statistics::{ball, distance_histogram, false_positive_rates};
