//! Diagnoses of an estimate.
//!
//! Input: an estimate, and its calibration, which is used to test alternatives. Output: diagnoses
//! and their sentences.
//!
//! 1. `one_state` tests whether the camera had the same state in all views, and whether the board
//!    matches its description.
//! 2. `model_selection` tries alternatives that may explain a lack of fit, and smaller models that may suffice.
//! 3. `constraints` tests constraints on parameters.
//! 4. `diagnosis` collects the problems, their causes and remedies.
//! 5. `messages` formats them as sentences.

mod constraints;
pub(crate) mod diagnosis;
pub(crate) mod messages;
pub(crate) mod model_selection;
pub(crate) mod one_state;
