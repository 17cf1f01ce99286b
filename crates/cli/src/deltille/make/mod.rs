//! Targets: from options to verified files.
//!
//! Input: options, or the template of an earlier command. Output: a target description, files to print, cut or model,
//! and the result of their verification. The modules, in the order in which a command uses them:
//!
//! 1. `plan` proposes a board that suits a camera.
//! 2. `board`, `solid`, and for other detectors `charuco`, `aprilgrid` and `circles`, are the commands that make a
//!    target.
//! 3. `settings` contains their settings. `single_panel` contains the paper options of boards for other detectors,
//!    and their page files.
//! 4. `delivery` writes, reports and verifies the files.
//! 5. `verify` verifies files, at the end of the other commands or as a command of its own.

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
