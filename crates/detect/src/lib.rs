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
//!
//! The result is [`deltille_core::detection`].
//!
//! `one_tiling` runs these stages, `nothing_seen` says why they end without a grid. `detector` looks for targets of both
//! tilings with the settings of `config`, `recognise` guesses the target where none is given, `scene`
//! tells whether several targets can be distinguished. A module imports from chapters above it in this list, never in a circle.
//!
//! Both tilings go the same way; `tiling` says where they differ, and `lanes` how many numbers a processor works on at once.

mod config;
mod corners;
mod detector;
mod grid;
mod labels;
mod lanes;
mod levels;
mod nothing_seen;
mod one_tiling;
mod recognise;
mod refine;
mod scene;
mod tiling;

pub use config::DetectorConfig;
pub use deltille_core::detection::{
    DecodedTag, Detection, Glance, Grid, GridCorner, Ink, InkEstimate, Reason, ReasonKind, Tone,
    ToneEstimate, Watch,
};
pub use detector::Detector;
pub use recognise::{Recognised, Recogniser};
pub use refine::model::fitter::SLOPE_PRIOR;
pub use refine::refiner::{MAX_WINDOW_PX, RefineStatus, Refined, Refinement, Refiner};
pub use scene::{SceneError, check_distinct};
