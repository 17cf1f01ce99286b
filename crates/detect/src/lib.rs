//! Detection: from an image to labelled corners.
//!
//! Input: an image and the targets to detect. Output: a [`Detection`]. The modules run in this
//! order. Each follows section 3 of the paper, with extensions that were verified by measurement:
//!
//! 1. `levels` chooses the number of pyramid levels.
//! 2. `corners` finds single corners and the edges that meet there.
//! 3. `grid` joins corners into grids: lattice coordinates without an origin.
//! 4. `labels` reads tags and locates each grid on the target.
//! 5. `transformed` repeats the search in transformed images if no board was identified.
//! 6. `refine` fits the final positions and their covariances to the raw pixels.
//!
//! [`deltille_core::detection`] defines the result.
//!
//! `one_tiling` runs these stages, with its `refining` for the last one, and `nothing_seen` finds the reason if they end
//! without a grid. `detector` detects targets of both tilings with the settings of `config`, and `tracker` in the images of
//! a video. `recognise` guesses the
//! target if none is given. `scene` checks whether several targets can be distinguished. A module imports only from
//! modules above it in this list.
//!
//! Both tilings share the code: `tiling` contains the differences, and `lanes` the number of SIMD lanes. `timing` measures
//! the stages.

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
mod timing;
mod tracker;
mod transformed;

pub use config::DetectorConfig;
pub use deltille_core::detection::{
    DecodedTag, Detection, FrameStatus, Grid, GridCorner, Ink, InkEstimate, OtherSettings, Reason,
    ReasonKind, Tone, ToneEstimate, Watch,
};
pub use detector::Detector;
pub use recognise::{Recognised, Recogniser};
pub use refine::model::fitter::SLOPE_PRIOR;
pub use refine::refiner::{MAX_WINDOW_PX, RefineStatus, Refined, Refinement, Refiner};
pub use scene::{SceneError, check_distinct};
pub use tracker::Tracker;
