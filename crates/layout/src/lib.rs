//! Targets on paper: where panels, labels, check bars and cutting lines lie on the sheets of a print.
//!
//! In comes a [`Target`](deltille_core::targets::Target) and a [`PaperSpec`]; out goes a [`Printing`]: the target with its
//! [sheets](SheetLayout), its [finish](Finish) and its [logo](Logo). In the order in
//! which a target meets them:
//!
//! 1. `paper`: what is printed on; `printing`: how a kind of target is laid out on it;
//! 2. `placing`: where panels and check bars lie on one page, several pages, or the sheets of a solid;
//! 3. `marks`: what is printed beside a target: labels, ids of tags, a logo;
//! 4. `finish`, and `finished` prints: how all of it is printed: mirrored, in spot colours, with lines to cut along;
//! 5. `sheet`: the values that these fill; `json`: the target file that holds them;
//! 6. [`artwork`]: what is drawn of a sheet, in mm;
//! 7. [`synth`]: a sheet or a target seen by a camera, as an image with exact ground truth.
//!
//! `planning` proposes the board that suits a camera and its distances, on some paper.

pub mod artwork;
mod finish;
mod finished;
mod json;
mod marks;
mod paper;
mod placing;
mod planning;
mod printing;
mod sheet;
pub mod synth;

pub use finish::Finish;
pub use marks::{Label, Logo, LogoPlacement, MOST_LOGO_BYTES};
pub use paper::{DEFAULT_MARGIN_MM, Orientation, PaperError, PaperSize, PaperSpec, SolidSheets};
pub use placing::{CHECK_BAR_STROKE_MM, Hinge, edge_numbers, edge_text, tag_range, upright_number};
pub use planning::{Proposal, Reach, Situation, Unsuited};
pub use printing::{Printing, largest_edge_mm, usual_edge_mm};
pub use sheet::{CheckBar, LineKind, Placement, SheetLayout, SheetLine, SheetPage, SheetText};
