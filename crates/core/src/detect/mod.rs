//! From pixels to labelled corners.
//!
//! The stages, each in its file, each from the paper (§3) with what measurements added:
//!
//! 1. `ring` finds candidates: pixels around which dark and bright alternate three times, or twice
//!    on checkerboards.
//! 2. `cubic` fits cubic surfaces and walks to the umbilic point; J < 0 or it is no corner.
//!    `quadric` does so for the saddles of checkerboards.
//! 3. `sectors` reads the six or four half-edges with their colours.
//! 4. `links` joins corners along clean edges (`edge`).
//! 5. `grow` starts from four corners, grows tile by tile and fills the gaps, where tiles are narrow
//!    in the frame of their neighbours (`rectified`). `parts` joins what a cover separates, by where
//!    the map of a grid (`local_map`) goes on. Both look as often as a picture is worth (`effort`).
//! 6. `tags` reads the tiles, `label` lets all tags together decide panel, rows and columns; `labels`
//!    gives them to the grids.
//!    `beyond` refuses checkerboards without tags whose pattern goes on where they end, `tile_shape` those
//!    whose tiles are no squares (`checker_tiles`).
//! 7. `refine` gives the last word on positions: `cubic` or `quadric`, then `corner_model`, in windows
//!    that `refine_grid` chooses by blur (`clearance`) and by what else they show.
//! 8. `recognise` guesses which target it is, where none is given.
//!
//! Beside them `reach` says from where a target can be used, `proposal` which board suits a camera, and `watch` which
//! pictures of a stream are worth keeping.
//!
//! Both tilings go the same way; `tiling` says where they differ.

mod config;
mod corners;
mod detection;
mod detector;
mod grid;
mod labels;
mod lanes;
mod levels;
mod planning;
mod recognise;
mod refine;
mod scene;
mod tiling;

pub use config::DetectorConfig;
pub use detection::ink::{Ink, InkEstimate};
pub use detection::reason::{Reason, ReasonKind};
pub use detection::tone::{Tone, ToneEstimate};
pub use detection::values::{DecodedTag, Detection, Grid, GridCorner};
pub use detector::Detector;
pub use planning::proposal::{Proposal, Situation, Unsuited};
pub use planning::reach::Reach;
pub use planning::watch::{Glance, Watch};
pub use recognise::{Recognised, Recogniser};
pub use refine::corner_model::SLOPE_PRIOR;
pub use refine::refiner::{MAX_WINDOW_PX, RefineStatus, Refined, Refinement, Refiner};
pub use scene::{SceneError, check_distinct};
