//! The next view of a target to take.
//!
//! Input: a target and the estimate so far. Output: a pose with its outline, numbers and a
//! sentence.
//!
//! 1. `body` predicts the corners of a target that a detector finds at a pose; `place` describes
//!    the pose.
//! 2. `gain` computes the information that a view adds.
//! 3. `guide` proposes the view that reduces the projection uncertainty most.
//! 4. `words` formats it as a sentence; `holding` detects when a person holds the target there.

pub(crate) mod body;
pub(crate) mod gain;
pub(crate) mod guide;
pub(crate) mod holding;
pub(crate) mod place;
#[cfg(test)]
mod tests;
pub(crate) mod words;
