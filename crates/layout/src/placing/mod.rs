//! Positions of panels on pages.
//!
//! The functions take the panels of a target and the paper, and return sheets with placements, check bars, lines and
//! texts. The modules:
//!
//! 1. `arrangement`: one board with its label and check bars on the smallest page that fits; the other modules build on
//!    it; `margin_marks`: the check bars; `sheet_label`: the label;
//! 2. `single_panel`: ChArUco boards, AprilGrids and circles; `tag_sheet`: single tags in rows;
//! 3. `packed`: several boards on a sheet; `poster`: one board or net over several pages;
//! 4. `face_sheet`: one sheet per face of a solid; `net`: the faces of a solid in one piece, to be folded;
//! 5. `guide`: a separate page with instructions.

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
