//! From detections to calibrated cameras.
//!
//! ```text
//!   detections ─ view ─→ views ─ Calibration ─ start ─→ problem ─ gross errors ─ reweighting ─→ Estimate
//!     target ──┘          (what is known)  (first cameras, poses)    (bundle adjustment)           │
//!                                                                        diagnoses, in words  ←────┘
//! ```
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

mod agreement;
mod automatic;
mod board_errors;
mod calibration;
mod comparison;
mod consensus;
mod corner_map;
mod coverage;
mod diagnosis;
mod error;
mod estimate;
mod excluded;
mod finding;
mod grid;
mod gross_errors;
mod halves;
mod image_circle;
mod lack_of_fit;
mod lens_end;
mod local_share;
mod located;
mod loss;
mod minimise;
mod model;
mod model_selection;
mod next_view;
mod normal;
mod one_state;
mod panel;
mod panels;
mod pose;
mod problem;
mod reweighting;
mod roughness;
mod shape;
mod solve;
mod start;
mod state_equations;
mod stop;
mod target_map;
mod uncertainty;
mod verdict;
mod view;
mod view_consistency;
mod weights;
mod words;

pub use automatic::Candidate;
pub use calibration::{Calibration, CameraViews, Intrinsics, PanelPlace};
pub use comparison::{
    CameraMotion, Comparison, ComparisonError, Difference, Region, compare_boards,
};
pub use coverage::Coverage;
pub use diagnosis::Diagnosis;
pub use error::{CalibrationError, TooPlain};
pub use estimate::{
    CameraEstimate, Corner, Estimate, FrameEstimate, Parameter, TargetEstimate, ViewEstimate,
};
pub use excluded::{Excluded, Reason};
pub use finding::{Finding, Moved, Shared};
pub use grid::UntaggedGrid;
pub use image_circle::ImageCircle;
pub use lack_of_fit::LackOfFit;
pub use lens_end::LensEnd;
pub use loss::Loss;
pub use model::{Model, ModelError};
pub use model_selection::{Instead, Remedy};
pub use next_view::{Guide, Guided, Held, Holding, NextView, ProposedCorner};
pub use one_state::{BoardStretch, CameraChange, ChangedIntrinsic, RollingShutter};
pub use panel::PanelRef;
pub use problem::Observation;
pub use shape::{BoardShape, COUNT as SHAPE_COEFFICIENTS, Shape};
pub use start::LabelRotation;
pub use target_map::{CornerOffset, LEAST_TO_MEASURE, TargetMap};
pub use uncertainty::{ObservedCovariance, ProjectionUncertainty, Source, UncertaintyMap};
pub use verdict::Verdict;
pub use view::{Reference, Shown, Sighting, View, views};
pub use weights::Weights;
pub use words::Words;
