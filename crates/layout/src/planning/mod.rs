//! Planning of a target for a camera: `reach` computes the distances at which a target can be used, and `proposal` the
//! board for a given camera, distance range and paper.

mod proposal;
mod reach;

pub use proposal::{Proposal, Situation, Unsuited};
pub use reach::Reach;
