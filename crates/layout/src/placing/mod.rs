//! Where panels lie on pages.
//!
//! In come the panels of a target and the paper, out go sheets with placements, check bars, lines and texts. In the order of
//! what a sheet takes:
//!
//! 1. `arrangement`: one board with its label and check bars on the smallest page that takes it, which the others use;
//!    `margin_marks` are these bars, `sheet_label` is the label;
//! 2. `single_panel`: boards of other detectors; `tag_sheet`: single tags in rows;
//! 3. `packed`: several boards on a sheet; `poster`: one board or net over several pages;
//! 4. `face_sheet`: a sheet for each face of a solid; `net`: the faces of a solid in one piece, to be folded;
//! 5. `guide`: a page of its own that says what to do with the others.

pub(crate) mod arrangement;
pub(crate) mod face_sheet;
pub(crate) mod guide;
pub(crate) mod margin_marks;
pub(crate) mod net;
pub(crate) mod packed;
pub(crate) mod poster;
pub(crate) mod sheet_label;
pub(crate) mod single_panel;
pub(crate) mod tag_sheet;

pub use face_sheet::{edge_numbers, edge_text, upright_number};
pub use margin_marks::CHECK_BAR_STROKE_MM;
pub use net::Hinge;
pub use sheet_label::tag_range;
