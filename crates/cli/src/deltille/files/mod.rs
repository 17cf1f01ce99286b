//! What commands read and write, whatever they do.
//!
//! Comes in: paths and patterns as arguments name them. Goes out: what is in these files, and files that are written all
//! or none.
//!
//! 1. `limits` are the options for how much of a file is read.
//! 2. `images` finds the photographs that arguments name; `images_at_once` works on as many as memory takes.
//! 3. `target_file` and `camera_file` read targets and cameras, with what is to be said of them.
//! 4. `detection_tables` writes and reads the detections of a run as tables in a folder.
//! 5. `written` puts the files of a command on disk, after all of them are known to be allowed there.

pub mod camera_file;
pub mod detection_tables;
pub mod images;
pub mod images_at_once;
pub mod limits;
pub mod target_file;
pub mod written;
