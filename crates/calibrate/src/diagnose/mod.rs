//! What is to be said about an estimate.
//!
//! Comes in: an estimate, and the calibration to try alternatives with. Goes out: diagnoses, and sentences.
//!
//! 1. `one_state` asks whether views show one camera in one state, and the board as described.
//! 2. `model_selection` tries what explains a lack of fit, and which smaller model suffices.
//! 3. `diagnosis` says what is wrong, what it comes from, and what helps.
//! 4. `words` says it in sentences.

pub(crate) mod diagnosis;
pub(crate) mod model_selection;
pub(crate) mod one_state;
pub(crate) mod words;
