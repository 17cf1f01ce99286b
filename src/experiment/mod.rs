//! Simulations that measure the library itself.

mod bound;
pub mod corners;
pub mod plot;
