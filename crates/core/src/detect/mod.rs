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

mod beyond;
mod blurred_corner;
mod buckets;
mod checker_tiles;
mod clearance;
mod cone_fit;
mod corner_model;
mod corner_start;
mod correlation;
mod cubic;
mod curve;
mod detection;
mod detector;
mod edge;
mod effort;
mod foreshortened;
mod grid_light;
mod grow;
mod ink;
mod label;
mod labels;
mod lanes;
mod links;
mod local_map;
mod optics;
mod outline;
mod parts;
mod places;
mod polynomial;
mod proposal;
mod quadric;
mod reach;
mod reason;
mod recognise;
mod rectified;
mod refine;
mod refine_grid;
mod ring;
mod saddles;
mod scene;
mod sectors;
mod small_systems;
mod soft_cells;
mod tag_words;
mod tags;
mod tile_map;
mod tile_shape;
mod tiling;
mod watch;
mod why;

pub use corner_model::SLOPE_PRIOR;
pub use curve::{Tone, ToneEstimate};
pub use detection::{DecodedTag, Detection, Grid, GridCorner};
pub use detector::{Detector, DetectorConfig};
pub use ink::{Ink, InkEstimate};
pub use proposal::{Proposal, Situation, Unsuited};
pub use reach::Reach;
pub use reason::{Reason, ReasonKind};
pub use recognise::{Recognised, Recogniser};
pub use refine::{MAX_WINDOW_PX, RefineStatus, Refined, Refinement, Refiner};
pub use scene::{SceneError, check_distinct};
pub use watch::{Glance, Watch};
