//! From pixels to labelled corners.
//!
//! Comes in: an image, and what is looked for. Goes out: a [`Detection`]. Data meets the chapters in this order, each from
//! the paper (§3) with what measurements added:
//!
//! 1. `levels` chooses the levels of the image's pyramid.
//! 2. `corners` finds corners one by one, with the edges that meet there.
//! 3. `grid` joins them: lattice coordinates without origin.
//! 4. `labels` reads tags and decides where on the target a grid lies.
//! 5. `refine` fits the final positions and their covariances to the raw pixels.
//! 6. `detection` is the result as values.
//!
//! `detector` runs these stages with the settings of `config`, `recognise` guesses the target where none is given, `scene`
//! tells whether several targets can be distinguished, and `planning` says what a camera will be able to see. A module imports
//! from chapters above it in this list, or from `detection`, never in a circle.
//!
//! Both tilings go the same way; `tiling` says where they differ, and `lanes` how many numbers a processor works on at once.

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
