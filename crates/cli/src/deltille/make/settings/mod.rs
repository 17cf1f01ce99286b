//! Settings of the commands that make targets, both as options and as keys of a template.
//!
//! Input: parsed options, and the text of a template. Output: specifications, and the requested mesh and drawing
//! files. The modules, in the order in which a command uses them:
//!
//! 1. `board_settings` and `solid_settings` contain all settings of boards and solids; options replace those of a
//!    template.
//! 2. `template` reads a template file, and writes the settings of a command as one.
//! 3. `logo` reads the logo. `option_checks` parses lengths, and rejects options without effect.
//! 4. `finishing` covers boards that are not plain prints: mirror images, spot colours, laser drawings.
//! 5. `meshes` covers models of the target.

pub mod board_settings;
pub mod finishing;
pub mod logo;
pub mod meshes;
pub mod option_checks;
pub mod solid_settings;
pub mod template;
