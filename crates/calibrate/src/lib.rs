//! From detections to calibrated cameras.
//!
//! Comes in: detections with their names, a target, and what is known of the cameras. Goes out: an [`Estimate`] with
//! uncertainties, and each [`Diagnosis`] of it in words. Data meets the chapters in this order:
//!
//! 1. `input` compares detections with the target, and holds what is known and what is asked for: a [`Calibration`].
//! 2. `problem` has the unknowns, observations and residuals of a bundle adjustment, their weights and their priors.
//! 3. `equations` forms the normal equations, eliminates the poses of frames, and walks to the minimum.
//! 4. `start` finds the first cameras and poses, without any guess.
//! 5. `adjust` excludes gross errors, reweights, and adds unknowns such as the shape of a board.
//! 6. `uncertainty` has the covariances: from noise, from the scatter between frames, from errors of the board.
//! 7. `estimate` is the result as values, assembled from all of these.
//! 8. `diagnose` says what is wrong with an estimate, what that comes from, and what helps.
//!
//! `adjusted` runs 4 to 7 on all views. `solve` is around it and holds frames out, `automatic` chooses a model by `solve`,
//! `located` asks where a target is. `compare` and `next_view` read estimates. Everything may import `model` (of lenses), `matrix` (in results),
//! `error` (why there is no estimate), `excluded` (views that took no part, and why) and `cancel`; otherwise a module imports from chapters above it in this list, never in a circle.
//!
//! A pixel is predicted through a chain of frames,
//!
//! ```text
//!   pixel = camera( camera_from_rig · rig_from_scene(frame) · scene_from_target · target_from_panel · corner )
//! ```
//!
//! and each link may be unknown. One camera with one target is a rig of one camera that is the rig
//! frame, and panels that stay where the target's file has them. That fixes the *gauge*: camera 0
//! is the rig, the target frame is that of its file, and that of the first target is the scene; every pose is
//! relative to these.
//!
//! A small change of a pose is (ω, τ): the rotation turns by exp(ω), seen from the frame that the
//! pose leads to, and the translation grows by τ. Standard deviations of poses are those of ω (rad)
//! and τ (mm).

mod adjust;
mod adjusted;
mod automatic;
mod cancel;
mod compare;
mod diagnose;
mod equations;
mod error;
mod estimate;
mod excluded;
mod input;
mod located;
mod matrix;
mod model;
mod next_view;
mod problem;
mod solve;
mod start;
mod uncertainty;

pub use adjust::finding::{Finding, Moved, Shared};
pub use adjust::lack_of_fit::LackOfFit;
pub use automatic::Candidate;
pub use compare::comparison::{
    CameraMotion, Comparison, ComparisonError, Difference, Region, compare_boards,
};
pub use compare::verdict::Verdict;
pub use diagnose::diagnosis::Diagnosis;
pub use diagnose::model_selection::{Instead, Remedy};
pub use diagnose::one_state::{BoardStretch, CameraChange, ChangedIntrinsic, RollingShutter};
pub use diagnose::words::Words;
pub use error::{CalibrationError, TooPlain};
pub use estimate::coverage::Coverage;
pub use estimate::image_circle::ImageCircle;
pub use estimate::lens_end::LensEnd;
pub use estimate::target_map::{CornerOffset, LEAST_TO_MEASURE, TargetMap};
pub use estimate::uncertainty_map::UncertaintyMap;
pub use estimate::values::{
    CameraEstimate, Corner, Estimate, FrameEstimate, Parameter, TargetEstimate, ViewEstimate,
};
pub use excluded::{Excluded, Reason};
pub use input::calibration::{Calibration, CameraViews, Intrinsics};
pub use input::grid::UntaggedGrid;
pub use input::loss::Loss;
pub use input::observation::Observation;
pub use input::observation::{Sighting, View};
pub use input::panel::PanelPlace;
pub use input::panel::PanelRef;
pub use input::reference::Reference;
pub use input::views::{Named, Shown, views};
pub use input::weights::Weights;
pub use matrix::Matrix;
pub use model::{Model, ModelError};
pub use next_view::guide::{Guide, Guided, NextView, ProposedCorner};
pub use next_view::holding::{Held, Holding};
pub use problem::shape::{BoardShape, COUNT as SHAPE_COEFFICIENTS, Shape};
pub use start::symmetry::LabelRotation;
pub use uncertainty::projection::{ObservedCovariance, ProjectionUncertainty, Source};
