//! What came of the experiment.
//!
//! Comes in: photographs with their truth, and what the detector found. Goes out: tables and a plot.
//!
//! 1. `score` compares what was found in a photograph with its truth.
//! 2. `table` makes rows of the scores of each level, as text, CSV and JSON.
//! 3. `plot` draws these rows.

pub mod plot;
pub mod score;
pub mod table;
