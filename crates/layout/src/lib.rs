//! Layout of targets on paper: the positions of panels, labels, check bars and cutting lines on the sheets of a print.
//!
//! The input is a [`Target`](deltille_core::targets::Target) and a [`PaperSpec`]. The output is a [`Printing`]: the
//! target with its [sheets](SheetLayout), its [finish](Finish) and its [logo](Logo). The modules, in processing order:
//!
//! 1. `paper` describes the paper; `printing` lays out each kind of target on it;
//! 2. `placing` positions panels and check bars on one page, several pages, or the sheets of a solid;
//! 3. `marks` adds what is printed beside a target: labels, tag ids, a logo;
//! 4. `finish` and `finished` control the print: mirroring, spot colours, cutting lines;
//! 5. `sheet` defines the resulting values; `json` reads and writes the target file that contains them;
//! 6. [`artwork`] draws a sheet, in mm;
//! 7. [`synth`] renders a sheet or a target as seen by a camera, with exact ground truth.
//!
//! `planning` proposes a board for a given camera, distance range and paper.

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
pub use marks::{Label, Logo, LogoPlacement, MAX_LOGO_BYTES};
pub use paper::{DEFAULT_MARGIN_MM, Orientation, PaperError, PaperSize, PaperSpec, SolidSheets};
pub use placing::{CHECK_BAR_STROKE_MM, Hinge, edge_numbers, edge_text, tag_range, upright_number};
pub use planning::{Proposal, Reach, Situation, Unsuited};
pub use printing::{Printing, largest_edge_mm, usual_edge_mm, usual_solid_edge_mm};
pub use sheet::{CheckBar, LineKind, Placement, SheetLayout, SheetLine, SheetPage, SheetText};
