//! Which view of a target to take next.
//!
//! Comes in: a target and the estimate so far. Goes out: a pose with its outline, figures and a sentence.
//!
//! 1. `body` is what a detector finds of a target at a pose, `place` how the target is held.
//! 2. `gain` is what a view would tell.
//! 3. `guide` proposes the view after which projections are known best.
//! 4. `words` says it; `holding` tells when somebody holds the target there.

pub(crate) mod body;
pub(crate) mod gain;
pub(crate) mod guide;
pub(crate) mod holding;
pub(crate) mod place;
#[cfg(test)]
mod tests;
pub(crate) mod words;
