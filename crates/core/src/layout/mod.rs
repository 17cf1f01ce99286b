//! Targets on paper: where panels, labels, check bars and cutting lines lie on the sheets of a print.
//!
//! In comes a [`Target`](crate::targets::Target) and a [`PaperSpec`]; out goes a [`Printing`]: the target with its
//! [sheets](SheetLayout), its [finish](Finish) and its [logo](Logo), of which `artwork` draws the pages. In the order in
//! which a target meets them:
//!
//! 1. `paper` says what is printed on; `printing` chooses how a kind of target is laid out.
//! 2. `arrangement` places a board, its label and its check bars on a page; `single_panel`, `tag_sheet`, `packed`, `poster`,
//!    `face_sheet` and `net` do so for other targets, several boards a sheet, several sheets a board, and solids.
//! 3. `label`, `tag_ids`, `logo` and `guide` add what is printed beside a target; `finish` mirrors it or adds spot colours.
//! 4. `sheet` has the values that all of them fill; `json` reads and writes them with their target.

mod arrangement;
mod face_sheet;
mod finish;
mod guide;
mod json;
mod label;
mod logo;
mod net;
mod packed;
mod paper;
mod poster;
mod printing;
mod sheet;
mod single_panel;
mod tag_ids;
mod tag_sheet;

pub use arrangement::{CHECK_BAR_STROKE_MM, tag_range};
pub use face_sheet::{edge_numbers, edge_text, upright_number};
pub use finish::Finish;
pub use label::Label;
pub use logo::{Logo, LogoPlacement, MOST_LOGO_BYTES};
pub use net::Hinge;
pub use paper::{DEFAULT_MARGIN_MM, Orientation, PaperError, PaperSize, PaperSpec, SolidSheets};
pub use printing::{Printing, largest_edge_mm, usual_edge_mm};
pub use sheet::{CheckBar, LineKind, Placement, SheetLayout, SheetLine, SheetPage, SheetText};
