//! What commands that make targets are told: options, the same as keys of a template.
//!
//! Comes in: parsed options, and the text of a template. Goes out: specs, and the files of meshes and drawings that are
//! asked for. A command meets the files in this order:
//!
//! 1. `board_settings` and `solid_settings` are all that boards and solids are told; options replace what a template says.
//! 2. `template` reads that file, and writes the settings of this command for another.
//! 3. `logo` reads the logo; `option_checks` takes lengths from options and refuses those that say nothing.
//! 4. `finishing` is for boards that are no plain prints: mirror images, spot colours, drawings for a laser.
//! 5. `meshes` are models of the target.

pub mod board_settings;
pub mod finishing;
pub mod logo;
pub mod meshes;
pub mod option_checks;
pub mod solid_settings;
pub mod template;
