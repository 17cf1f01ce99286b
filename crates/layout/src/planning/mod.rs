//! Which target suits a camera: `reach` is the distance from which a target can be used, and `proposal` the board that suits a
//! camera, its distances and the paper.

mod proposal;
mod reach;

pub use proposal::{Proposal, Situation, Unsuited};
pub use reach::Reach;
