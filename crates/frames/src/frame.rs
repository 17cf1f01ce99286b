//! A frame with its name and time stamp.

use std::path::{Path, PathBuf};

use deltille_files::limits::Limits;
use deltille_files::photograph::Photograph;
use image::DynamicImage;

use crate::content::{Content, Recorded};
use crate::problem::FramesError;

/// A photograph, or a frame of a recording.
pub struct Frame {
    path: PathBuf,
    time_ns: Option<i64>,
    /// Fraction of the recording up to this frame.
    part: Option<f64>,
    content: Content,
}

impl Frame {
    pub(crate) fn recorded(path: PathBuf, recorded: Recorded) -> Self {
        let Recorded { time_ns, part, content } = recorded;
        Self { path, time_ns, part, content }
    }

    /// A photograph in a file. The file is opened by [`read`](Self::read).
    pub fn photograph(path: PathBuf) -> Self {
        Self { path: path.clone(), time_ns: None, part: None, content: Content::File(path) }
    }

    /// Returns the path of a photograph. A frame of a recording has the path of the recording, with its stem and the
    /// number of the frame instead of the file name: `data/run-000012` of `data/run.mcap`.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the file name of a photograph, or the stem of a recording and the number of the frame.
    pub fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the name without the extension of a file.
    pub fn stem(&self) -> String {
        let stem = match self.content {
            Content::File(_) => self.path.file_stem(),
            #[allow(unreachable_patterns, reason = "without features, all frames are files")]
            _ => self.path.file_name(),
        };
        stem.unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the time stamp, ns: of the message's header, else of its recording, since 1970 or the start of a robot's
    /// clock; in a video, since its start. Photographs have none.
    pub fn time_ns(&self) -> Option<i64> {
        self.time_ns
    }

    /// Returns the fraction of the recording up to this frame, of its duration or of its bytes, if it is known.
    pub fn part(&self) -> Option<f64> {
        self.part
    }

    /// Returns the number of pixels, if it is known without decoding.
    pub fn pixels(&self, limits: &Limits) -> Option<u64> {
        self.content.pixels(limits)
    }

    /// Decodes the image with its colours, if it is a photograph other than HEIC; frames of recordings are grey.
    ///
    /// # Errors
    /// Returns an error if the image cannot be read or exceeds the limits.
    pub fn read_colours(self, limits: &Limits) -> Result<DynamicImage, FramesError> {
        self.content.read_colours(&self.path, limits)
    }

    /// Decodes the image. A damaged JPEG is refused unless `accept_damaged` is set.
    ///
    /// # Errors
    /// Returns an error if the image cannot be read or exceeds the limits.
    pub fn read(self, limits: &Limits, accept_damaged: bool) -> Result<Photograph, FramesError> {
        self.content.read(&self.path, limits, accept_damaged)
    }
}
