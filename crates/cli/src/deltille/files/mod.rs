//! Input and output files of all commands.
//!
//! Input: paths and patterns from the arguments. Output: the contents of these files, and files
//! that are written completely or not at all.
//!
//! 1. `limits` contains the options that limit how much of a file is read.
//! 2. `images` finds the input photographs. `images_at_once` processes as many in parallel as memory allows.
//! 3. `target_file` and `camera_file` read targets and cameras, and print warnings about them.
//! 4. `detection_tables` writes and reads the detections of a run as tables in a folder.
//! 5. `written` writes the output files of a command, after checking that all of them may be written.

pub mod camera_file;
pub mod detection_tables;
pub mod images;
pub mod images_at_once;
pub mod limits;
pub mod target_file;
pub mod written;
