//! What is known of a family.
//!
//! In comes a family, out go proofs and figures. `certificate` proves what its file claims, with `hidden` (distances where
//! cells are covered); `statistics` counts distances, `confusion` and `reading` say what becomes of tags that are seen badly,
//! `natural` how often pictures of the world look like one; `frontier` weighs rules against sizes. [`bounds`] and
//! `invariant_bounds` say how many codes there can be at most.

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
