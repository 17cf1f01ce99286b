//! Simulations and protocols that measure the library itself.

mod bound;
pub mod corners;
pub mod plot;
pub mod table2;
