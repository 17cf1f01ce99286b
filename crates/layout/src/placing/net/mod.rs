//! The unfolded solid: its faces in one plane, to be cut out, folded and glued.
//!
//! ```text
//!           ╱:─╮           ╱ ╲ ─  cut        - - :  fold
//!          ╱  : ╲
//!         ╱    : ╲         Every edge that is cut has a number, printed in the margin of the face
//!        ╱3     :7╲        on one side and on the glue tab of the other: here edge 7 has its tab,
//!       ╱        : ╲       and edge 3 goes over the tab of another face. Faces have their names
//!      ╱- face 0 -:─╯      along a fold.
//!      ╲  face 5  ╱
//!       ╲        ╱         The panel of a face lies in it as on a single sheet: its placement takes
//!        ╲      ╱          the face's outline to the triangle of the net.
//! ```
//!
//! Faces never overlap, and tabs overlap neither faces nor each other: see [`plane::gap_mm`]. A
//! solid whose faces cannot be laid out in one piece, or whose net is larger than the paper, is printed
//! in several pieces of whole faces, nested on as few pages as will do; tabs and numbers then lead from
//! one to the other. With [`SolidSheets::SeamedNet`](crate::SolidSheets::SeamedNet) a net that is larger
//! than the paper stays in one piece, over several pages that are joined first.
//!
//! `unfold` lays the faces of a solid in the plane, `tabs` adds what is glued, `nest` packs pieces on pages, `choice` says which
//! unfolding is printed, `drawing` what is drawn of it, and `sheet` makes the sheets; `plane` moves outlines, `hinge` says how faces hang together, for a picture of the folding.

mod choice;
mod drawing;
mod hinge;
mod nest;
pub(crate) mod plane;
mod sheet;
mod tabs;
mod unfold;

pub use hinge::Hinge;
pub(crate) use sheet::sheets;
pub(crate) use unfold::Sides;
