//! Photographs in a folder, and files that are recordings.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Extensions of photographs in a folder; files named directly may have any extension.
const PHOTOGRAPHS: [&str; 14] = [
    "png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm", "ppm", "pnm", "pbm", "webp", "heic", "heif",
    "hif",
];

/// Extensions of videos.
const VIDEOS: [&str; 7] = ["y4m", "mp4", "m4v", "mov", "mkv", "avi", "webm"];

/// Extensions of recordings of robots; a recorder of ROS 1 that was killed leaves `.bag.active`.
const BAGS: [&str; 4] = ["mcap", "bag", "active", "db3"];

/// Extensions of photographs that are not read: raw formats of cameras, and others.
const OTHERS: [&str; 14] = [
    "avif", "jxl", "gif", "jp2", "dng", "cr2", "cr3", "nef", "arw", "raf", "rw2", "orf", "pef",
    "srw",
];

/// Returns the extension in lower case.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Whether a file is a HEIC photograph.
pub fn is_heic(path: &Path) -> bool {
    ["heic", "heif", "hif"].contains(&extension(path).as_str())
}

/// Whether a path has the extension of a photograph.
pub fn is_photograph(path: &Path) -> bool {
    PHOTOGRAPHS.contains(&extension(path).as_str())
}

/// Whether a file is a video.
pub(crate) fn is_video(path: &Path) -> bool {
    VIDEOS.contains(&extension(path).as_str()) && !path.is_dir()
}

/// Whether a path is a video, a recording of a robot, or the folder of one.
pub fn is_recording(path: &Path) -> bool {
    let extension = extension(path);
    let is_known = [VIDEOS.as_slice(), &BAGS].concat().contains(&extension.as_str());
    if path.is_dir() { is_bag_folder(path) } else { is_known }
}

/// Whether a path is a recording with topics: of a robot, or the folder of one.
pub fn is_bag(path: &Path) -> bool {
    is_recording(path) && !is_video(path)
}

/// Whether a folder is a bag of ROS 2, finished or not.
fn is_bag_folder(folder: &Path) -> bool {
    let mut head = Vec::new();
    let metadata = File::open(folder.join("metadata.yaml"));
    if let Ok(metadata) = metadata {
        let _ = metadata.take(64).read_to_end(&mut head);
    }
    if head.starts_with(b"rosbag2_bagfile_information") {
        return true;
    }
    // The metadata is written last.
    let with = |known: &[&str]| files_in(folder, known).is_ok_and(|files| !files.is_empty());
    with(&["db3", "mcap"]) && !with(&PHOTOGRAPHS)
}

/// Returns the photographs directly inside a folder, sorted by name; may be empty.
///
/// # Errors
/// Returns an error if the folder cannot be read.
pub fn photographs_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut images = files_in(folder, &PHOTOGRAPHS)?;
    // Overlays drawn by an earlier run are not photographs.
    images.retain(|path| !path.to_string_lossy().ends_with(".overlay.jpg"));
    Ok(images)
}

/// Returns the files in a folder that show something but are not among its photographs: recordings, and photographs in
/// formats that are not read.
///
/// # Errors
/// Returns an error if the folder cannot be read.
pub fn unread_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    files_in(folder, &[VIDEOS.as_slice(), &BAGS, &OTHERS].concat())
}

/// Returns the files with one of these extensions directly inside a folder, sorted by name.
pub(crate) fn files_in(folder: &Path, extensions: &[&str]) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if extensions.contains(&extension(&path).as_str()) && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
