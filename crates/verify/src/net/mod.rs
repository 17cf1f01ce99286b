//! The net of a solid, folded.
//!
//! Comes in: the corners that were seen on each sheet. Goes out: what does not fold into the solid.
//!
//! 1. `printed_net` has each face with the pose that its detected corners have on the paper, folds and numbers.
//! 2. `fold` turns one face after the other about their common edges: they must come to lie where the target states.
//! 3. `seams` compares the two sides of every edge.
//! 4. `folded` runs these. `motion` has the poses on the paper and in space.
//!
//! ```text
//!    page            R_child = turn(edge, dihedral angle) · R_parent       solid
//!   ╱╲──╱╲                                                                   ╱│╲
//!  ╱1 ╲╱2 ╲   ──▶   face 1 is laid where it is stated to be; face 2 turns   ╱1│2╲
//!  ────────         about their edge by the angle between the two faces     ‾‾‾‾‾
//! ```
//!
//! Only the fold lines and the numbers of edges are taken from the layout, and the ink of both is
//! compared separately; the places of faces follow from their corners. A face that comes to lie in
//! the place of another, or rotated in its own, is named as such.

mod fold;
pub(super) mod folded;
pub(super) mod motion;
pub(super) mod printed_net;
mod seams;
