//! The unfolded solid: its faces in one plane, to be cut out, folded and glued.
//!
//! ```text
//!        ╱╲    ╱╲╲            ───  cut           every edge that is cut has one number, printed
//!       ╱  ╲  ╱  ╲╲           - -  fold          in the face on one side and on the glue tab of
//!      ╱- - ╲╱- - ╲╲                             the other; faces have theirs along a fold
//!      ╲    ╱╲    ╱╲
//!       ╲  ╱  ╲  ╱  ╲         the panels of the faces lie as on single sheets, each a
//!        ╲╱- - ╲╱- - ╲        [`Placement`](super::Placement) that takes its outline to its
//!       ══╲    ╱╲    ╱        triangle of the net
//!           ╲  ╱  ╲  ╱
//! ```
//!
//! Faces never overlap, and tabs overlap neither faces nor each other: see [`plane::gap_mm`]. A
//! solid whose faces cannot be laid out in one piece is printed in several, each on a sheet of its
//! own; tabs and numbers then lead from one to the other.

mod plane;
mod sheet;
mod tabs;
mod tiling;
mod unfold;

pub(super) use sheet::sheets;
