//! Simulations and protocols that measure the library, for `deltille experiment`.
//!
//! 1. `corners`: precision of single corners (Fig. 6 of the paper), compared with their `bound` and plotted by `plot`;
//! 2. `photographs`: complete images of printed pages, rendered independently of [`deltille::synth`];
//! 3. `table2`, `rig`: Table 2 and §4.4 of the paper;
//! 4. `states`, `guide`: reliability of the checks for changed cameras, and benefit of guided views;
//! 5. `speed`: run times, for `deltille bench`.

mod bound;
pub mod corners;
pub mod guide;
pub mod photographs;
pub mod plot;
pub mod rig;
pub mod speed;
pub mod states;
pub mod table2;
