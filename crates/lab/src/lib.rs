//! Simulations and protocols that measure the library itself, for `deltille experiment`.
//!
//! 1. `corners`: precision of single corners (Fig. 6 of the paper), against their `bound`, drawn by `plot`;
//! 2. `photographs`: whole pictures of printed pages, on a path that shares nothing with [`deltille::synth`];
//! 3. `table2`, `rig`: Table 2 and §4.4 of the paper;
//! 4. `states`, `guide`: whether a camera in one state is called so, and what chosen views are worth.

mod bound;
pub mod corners;
pub mod guide;
pub mod photographs;
pub mod plot;
pub mod rig;
pub mod states;
pub mod table2;
