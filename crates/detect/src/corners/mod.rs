//! From pixels to corners, one by one.
//!
//! Comes in: the pyramid of an image. Goes out: corners with the edges that meet there ([`saddles::Saddle`]), not yet joined.
//!
//! 1. `ring` measures how dark and bright alternate around each pixel, three times, or twice on checkerboards; `candidates`
//!    are where that is greatest.
//! 2. `polynomial` fits a cubic surface (`cubic`) or a quadric (`quadric`) by fixed kernels (`cone_fit`) and moves to the point
//!    where all second derivatives, or the gradient, vanish; J < 0, or it is not a corner.
//! 3. `sectors` reads the six or four half-edges with their colours.
//! 4. `saddles` runs these over all levels of the pyramid and merges what is found twice (`buckets`).

pub(crate) mod buckets;
pub(crate) mod candidates;
pub(crate) mod cone_fit;
pub(crate) mod cubic;
pub(crate) mod polynomial;
pub(crate) mod quadric;
pub(crate) mod ring;
pub(crate) mod saddles;
pub(crate) mod sectors;
