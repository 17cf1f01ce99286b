//! The folder of a bag of ROS 2: `metadata.yaml` and the files that it names.

use std::path::{Path, PathBuf};

use deltille_core::words::quoted;
use deltille_files::limits::read_short_text;
use serde::Deserialize;

use crate::folder::files_in;
use crate::problem::Problem;

/// Maximum size of the metadata, bytes: a topic takes up to two kilobytes.
const METADATA_BYTES: usize = 1_000_000;

/// The files of a bag.
pub(crate) struct Parts {
    /// In the order of recording.
    pub(crate) files: Vec<PathBuf>,
    /// Whether each message is compressed with Zstandard.
    pub(crate) is_compressed: bool,
}

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_mode: String,
    #[serde(default)]
    compression_format: String,
}

/// Lists the files of a bag. Without metadata, which is written last, these are all files.
pub(super) fn parts(folder: &Path) -> Result<Parts, Problem> {
    let path = folder.join("metadata.yaml");
    if !path.exists() {
        let mut files = files_in(folder, &["db3", "mcap"]).map_err(Problem::Io)?;
        // name_10 is after name_9.
        files.sort_by_key(|file| file.as_os_str().len());
        return Ok(Parts { files, is_compressed: false });
    }
    let damaged = |what: &dyn std::fmt::Display| {
        Problem::Damaged(format!("metadata.yaml: {}", what.to_string().replace('\n', " ")))
    };
    let text = read_short_text(&path, METADATA_BYTES).map_err(|error| damaged(&error))?;
    let metadata: Metadata = serde_yaml_ng::from_str(&text).map_err(|error| damaged(&error))?;
    let information = metadata.rosbag2_bagfile_information;
    let is_compressed = information.compression_mode.eq_ignore_ascii_case("message");
    if is_compressed && information.compression_format != "zstd" {
        let format = quoted(&information.compression_format);
        return Err(Problem::Unsupported(format!("compression {format}")));
    }
    // Early versions write paths relative to the parent folder.
    let name = |path: &String| Path::new(path).file_name().map(|name| folder.join(name));
    let files: Vec<PathBuf> = information.relative_file_paths.iter().filter_map(name).collect();
    Ok(Parts { files, is_compressed })
}
