//! Simulations and protocols that measure the library itself.

mod bound;
pub mod corners;
pub mod guide;
pub mod photographs;
pub mod plot;
pub mod rig;
pub mod states;
pub mod table2;
