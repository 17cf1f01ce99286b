//! From detections to calibrated cameras.
//!
//! ```text
//!   detections ─ view ─→ views ─ start ─→ problem ─ minimise ─→ solution
//!     target ──┘          (first focal length, poses)   (bundle adjustment)
//! ```
//!
//! A pixel is predicted through a chain of frames,
//!
//! ```text
//!   pixel = camera( camera_from_rig · rig_from_target(frame) · target_from_panel · corner )
//! ```
//!
//! and each link may be unknown. One camera with one target is a rig of one camera that is the rig
//! frame, and panels that stay where the target's file has them. That fixes the *gauge*: camera 0
//! is the rig, and the target frame is that of its file; every pose is relative to these.
//!
//! A small change of a pose is (ω, τ): the rotation turns by exp(ω), seen from the frame that the
//! pose leads to, and the translation grows by τ. Standard deviations of poses are those of ω (rad)
//! and τ (mm).

mod consensus;
mod error;
mod excluded;
mod finding;
mod grid;
mod gross;
mod image_circle;
mod lens_end;
mod loss;
mod minimise;
mod misfit;
mod model;
mod normal;
mod panel;
mod pose;
mod problem;
mod remedy;
mod rig;
mod settle;
mod shape;
mod solution;
mod solve;
mod start;
mod stranger;
mod sufficient;
mod view;
mod weights;
mod wrong;

pub use error::CalibrationError;
pub use excluded::Excluded;
pub use finding::{Finding, Moved, Shared};
pub use grid::UntaggedGrid;
pub use image_circle::ImageCircle;
pub use lens_end::LensEnd;
pub use loss::Loss;
pub use misfit::Misfit;
pub use model::{Model, ModelError};
pub use panel::PanelRef;
pub use pose::estimate_pose;
pub use problem::{Block, CameraUnknowns, Observation, PanelUnknowns, Prior, Problem};
pub use remedy::{Instead, Remedy, remedy, remedy_of_given};
pub use rig::{
    PanelPlace, RigCamera, RigFrame, RigOptions, RigSolution, RigViews, calibrate_rig,
    wrong_cameras,
};
pub use shape::{BoardShape, COUNT as SHAPE_COEFFICIENTS, Shape};
pub use solution::{Corner, Parameter, Solution, ViewSolution};
pub use solve::{Options, calibrate, calibrate_with_shape, poses};
pub use sufficient::sufficient;
pub use view::{Reference, Shown, Sighting, View, views};
pub use weights::Weights;
