//! The net of a solid: its faces in one plane, to be cut out, folded and glued.
//!
//! ```text
//!           ╱:─╮           ╱ ╲ ─  cut        - - :  fold
//!          ╱  : ╲
//!         ╱    : ╲         Every cut edge has a number, printed in the margin of the face on one side
//!        ╱3     :7╲        and on the glue tab of the other. Here, edge 7 has its tab, and edge 3 goes
//!       ╱        : ╲       over the tab of another face. The name of a face is printed along a fold.
//!      ╱- face 0 -:─╯
//!      ╲  face 5  ╱
//!       ╲        ╱         The panel of a face lies in it as on a single sheet: its placement maps
//!        ╲      ╱          the outline of the face to the triangle of the net.
//! ```
//!
//! Faces never overlap, and tabs overlap neither faces nor each other: see [`plane::gap_mm`]. A net that cannot be laid
//! out in one piece, or is larger than the paper, is printed as several pieces of whole faces. These are nested on as
//! few pages as possible, and tabs and numbers connect them. With
//! [`SolidSheets::SeamedNet`](crate::SolidSheets::SeamedNet), a net larger than the paper stays in one piece, over
//! several pages that are joined first.
//!
//! `unfold` lays the faces of a solid in the plane, `tabs` adds glue tabs, `nest` packs pieces on pages, `choice`
//! selects the unfolding to print, `drawing` draws it, and `sheet` makes the sheets. `plane` moves outlines, and
//! `hinge` describes how faces are connected, for an animation of the folding.

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
