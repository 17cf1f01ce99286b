//! Results of the experiment.
//!
//! The input is photographs with ground truth and detections. The output is tables and a plot.
//!
//! 1. `score` compares the detections of a photograph with its ground truth.
//! 2. `table` summarizes the scores of each level as text, CSV and JSON.
//! 3. `plot` plots these rows.

pub mod plot;
pub mod score;
pub mod table;
