//! The library measured.
//!
//! 1. `bench` times the stages of detection on this machine.
//! 2. `experiment` runs the simulations of `deltille-lab` and writes their tables and plots.

pub mod bench;
pub mod experiment;
