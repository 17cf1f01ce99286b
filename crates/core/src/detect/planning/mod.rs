//! What a detector will be able to see: `reach` is the distance from which a target can be used, `proposal` the board that suits
//! a camera, and `watch` chooses the images of a stream that are worth keeping.

pub(in crate::detect) mod proposal;
pub(in crate::detect) mod reach;
pub(in crate::detect) mod watch;
