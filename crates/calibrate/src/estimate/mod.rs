//! The result of a calibration.
//!
//! Input: the settled adjustment. Output: a [`values::Estimate`].
//!
//! 1. `values` are cameras, targets, frames, views and corners with residuals.
//! 2. `target_map` (measured corners), `coverage` (areas with corners), and `lens_limit` and
//!    `image_circle` (extent of the lens) are parts of it.
//! 3. `uncertainty_map` is the projection uncertainty of a camera over its image. `on_rig` lists the unknowns of all cameras, on
//!    which `depth` (distances that two cameras measure) and `pose_uncertainty` (poses of a target) depend.
//! 4. `assemble` builds the estimate.
//! 5. `joint_covariance` is the covariance of all unknowns together; `listed` names them.
//! 6. `corner_check` finds the corners of a measured target that their observations contradict.

pub(crate) mod assemble;
pub(crate) mod corner_check;
pub(crate) mod coverage;
pub(crate) mod depth;
pub(crate) mod image_circle;
pub(crate) mod joint_covariance;
pub(crate) mod lens_limit;
pub(crate) mod listed;
pub(crate) mod on_rig;
pub(crate) mod pose_uncertainty;
pub(crate) mod target_map;
pub(crate) mod uncertainty_map;
pub(crate) mod values;
