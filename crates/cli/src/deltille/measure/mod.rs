//! Benchmarks and experiments on the library.
//!
//! 1. `bench` measures the run time of the detection stages on this machine.
//! 2. `experiment` runs the simulations of `deltille-lab` and writes their tables and plots.

pub mod bench;
pub mod experiment;
