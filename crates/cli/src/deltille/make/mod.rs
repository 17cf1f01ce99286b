//! Targets: from what is asked for to files that are compared with their description.
//!
//! Comes in: options, or the template of an earlier command. Goes out: the description of a target, what to print, cut or
//! model, and what the comparison says. A command meets the files in this order:
//!
//! 1. `plan` proposes the board that suits a camera.
//! 2. `board`, `solid`, and for other detectors `charuco`, `aprilgrid` and `circles` are the commands that make a target.
//! 3. `settings` is their settings; `single_panel` the settings of paper of boards for other detectors, and the
//!    files of their pages.
//! 4. `delivery` writes the files, tells of them and has them compared.
//! 5. `verify` compares, at the end of the others or as a command of its own.

pub mod aprilgrid;
pub mod board;
pub mod charuco;
pub mod circles;
mod delivery;
pub mod plan;
mod settings;
mod single_panel;
pub mod solid;
pub mod verify;

pub use settings::board_settings::BoardSettings;
