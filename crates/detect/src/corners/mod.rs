//! Corners: from pixels to single corners.
//!
//! Input: the pyramid of an image. Output: corners with the edges that meet there ([`saddles::Saddle`]), not yet
//! joined.
//!
//! 1. `ring` measures how clearly dark and bright alternate around each pixel: three times, or
//!    twice on checkerboards. `candidates` are the maxima of this measure.
//! 2. `polynomial` fits a cubic surface (`cubic`) or a quadric (`quadric`) by fixed kernels (`cone_fit`). It moves to
//!    the point where all second derivatives, or the gradient, vanish. Unless J < 0, it is not a corner.
//! 3. `sectors` reads the six or four half-edges with their colours.
//! 4. `saddles` runs these over all levels of the pyramid and merges duplicates (`buckets`).

pub(crate) mod buckets;
pub(crate) mod candidates;
pub(crate) mod cone_fit;
pub(crate) mod cubic;
pub(crate) mod polynomial;
pub(crate) mod quadric;
pub(crate) mod ring;
pub(crate) mod saddles;
pub(crate) mod sectors;
