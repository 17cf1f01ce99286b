//! The net of a solid, folded.
//!
//! Input: the corners detected on each sheet. Output: deviations of the folded net from the solid.
//!
//! 1. `printed_net` contains each face with the pose of its detected corners on the paper, folds and numbers.
//! 2. `fold` rotates one face after the other about the common edges; they must end at their stated positions.
//! 3. `seams` compares the two sides of every edge.
//! 4. `folded` runs these steps. `motion` contains poses on the paper and in space.
//!
//! ```text
//!    page            R_child = rotation(edge, dihedral angle) · R_parent       solid
//!   ╱╲──╱╲                                                                       ╱│╲
//!  ╱1 ╲╱2 ╲   ──▶   face 1 is placed at its stated position; face 2 rotates     ╱1│2╲
//!  ────────         about their edge by the angle between the two faces         ‾‾‾‾‾
//! ```
//!
//! Only the fold lines and the edge numbers are taken from the layout, and the ink of both is compared separately;
//! the positions of faces follow from their corners. A finding names a face that ends at the position of another, or
//! rotated at its own.

mod fold;
pub(super) mod folded;
pub(super) mod motion;
pub(super) mod printed_net;
mod seams;
