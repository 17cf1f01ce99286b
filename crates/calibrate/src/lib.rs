//! Calibration of cameras and multi-camera rigs from detections of targets.
//!
//! Input: named detections, a target, and prior knowledge of the cameras. Output: an [`Estimate`]
//! with uncertainties, and a [`Diagnosis`] in words for each problem. The modules, in the order in
//! which they process the data:
//!
//! 1. `input` checks detections against the target and collects them with the settings in a [`Calibration`].
//! 2. `problem` defines the unknowns, observations and residuals of a bundle adjustment, with their weights and priors.
//! 3. `equations` forms the normal equations, eliminates the poses of frames, and iterates to the minimum.
//! 4. `start` computes initial cameras and poses without a first guess.
//! 5. `adjust` excludes outliers, reweights, and adds unknowns such as the shape of a board.
//! 6. `uncertainty` computes covariances: from noise, from the scatter between frames, and from errors of the board.
//! 7. `estimate` assembles the result from all of these.
//! 8. `diagnose` reports the problems of an estimate, their causes and remedies.
//!
//! 9. `check` tests whether a calibrated camera still agrees with a few new views.
//! 10. `hand_eye` locates a camera and a board on a robot.
//! 11. `timing` estimates rolling shutters and the clocks of a rig from a moving target.
//! 12. `accept` measures known lengths, with their uncertainties, against a limit.
//!
//! `adjusted` runs 4 to 7 on all views. `solve` wraps it and holds out frames; `automatic` selects
//! a model with `solve`; `located` computes the pose of a target. `compare` and `next_view` read
//! estimates; `selection` selects frames of a recording by the gain of `next_view`; `moving` compensates frames for the timing
//! of their cameras. Every module may import `model` (lens models), `matrix` (in results), `error`
//! (failures), `excluded` (excluded views and the reasons) and `cancel`; otherwise a module imports
//! only from modules above it in this list.
//!
//! A pixel is predicted through a chain of frames,
//!
//! ```text
//!   pixel = camera( camera_from_rig · rig_from_scene(frame) · scene_from_target · target_from_panel · corner )
//! ```
//!
//! and each link may be unknown. One camera with one target is a rig of one camera, which defines the rig frame, with
//! the panels fixed where the target file places them. That fixes the *gauge*: camera 0 defines the
//! rig frame, the target frame is that of its file, and the frame of the first target is the scene
//! frame. Every pose is relative to these.
//!
//! A small change of a pose is (ω, τ): exp(ω) multiplies the rotation from the left, in the frame that the pose maps
//! to, and τ is added to the translation. Standard deviations of poses are those of ω (rad) and τ (mm).

mod accept;
mod adjust;
mod adjusted;
mod automatic;
mod cancel;
mod check;
mod compare;
mod diagnose;
mod equations;
mod error;
mod estimate;
mod excluded;
mod hand_eye;
mod input;
mod located;
mod matrix;
mod model;
mod moving;
mod next_view;
mod problem;
mod selection;
mod solve;
mod start;
mod timing;
mod uncertainty;

pub use accept::acceptance::{Acceptance, Budget, Conformity, LengthError, Probing};
pub use accept::request::{
    AcceptanceRequest, CornerLabel, KnownLength, Limit, RequestError, Temperature,
};
pub use accept::run::AcceptanceError;
pub use adjust::finding::{Finding, Moved, OutlierPattern};
pub use adjust::lack_of_fit::LackOfFit;
pub use automatic::Candidate;
pub use check::answer::{Answer, Check, Missing, Quantity, QuantityTest, Shown, Suspect};
pub use compare::comparison::{
    CameraMotion, Comparison, ComparisonError, Difference, Region, compare_boards,
};
pub use compare::verdict::Verdict;
pub use diagnose::diagnosis::Diagnosis;
pub use diagnose::messages::Messages;
pub use diagnose::model_selection::{Alternative, Remedy};
pub use diagnose::one_state::{BoardStretch, CameraChange, ChangedIntrinsic, RollingShutter};
pub use error::{CalibrationError, ConstraintError, DegenerateMotion};
pub use estimate::coverage::Coverage;
pub use estimate::depth::DepthUncertainty;
pub use estimate::image_circle::ImageCircle;
pub use estimate::joint_covariance::{JointCovariance, JointUnknown};
pub use estimate::lens_limit::LensLimit;
pub use estimate::pose_uncertainty::{PoseSd, PoseUncertainty};
pub use estimate::target_map::{CornerOffset, MIN_VIEWS_TO_MEASURE, TargetMap};
pub use estimate::uncertainty_map::{UncertaintyMap, ViewUncertainty};
pub use estimate::values::{
    CameraEstimate, Corner, Estimate, FrameEstimate, Parameter, TargetEstimate, ViewEstimate,
};
pub use excluded::{Excluded, Reason};
pub use hand_eye::contradictions::Contradiction;
pub use hand_eye::error::HandEyeError;
pub use hand_eye::estimate::{HandEye, HandEyeView};
pub use hand_eye::misreading::Misreading;
pub use hand_eye::pairing::PairedBy;
pub use hand_eye::request::HandEyeRequest;
pub use input::calibration::{Calibration, CameraViews};
pub use input::constraint::Constraint;
pub use input::grid::UntaggedGrid;
pub use input::intrinsics::Intrinsics;
pub use input::loss::Loss;
pub use input::observation::Observation;
pub use input::observation::{Sighting, View};
pub use input::panel::PanelPrior;
pub use input::panel::PanelRef;
pub use input::photographs::{Differing, MixedPhotographs};
pub use input::reference::Reference;
pub use input::robot::{Mounting, RobotNoise, RobotPose, RobotPoses, RobotRotation};
pub use input::views::{Named, ViewSet, views};
pub use input::weights::Weights;
pub use matrix::Matrix;
pub use model::{Model, ModelError};
pub use moving::CompensationError;
pub use next_view::guide::{Guide, Guided, NextView, ProposedCorner};
pub use next_view::holding::{HoldStatus, HoldTracker};
pub use problem::shape::{BoardShape, COUNT as SHAPE_COEFFICIENTS, Shape};
pub use selection::keyframes::{Keyframe, Keyframes};
pub use start::symmetry::LabelRotation;
pub use timing::run::timing;
pub use timing::values::{CameraTiming, Measured, TimedCamera, Timing, TimingError};
pub use uncertainty::projection::{ObservedCovariance, ProjectionUncertainty, Source};
