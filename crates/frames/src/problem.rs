//! What is wrong with a recording.

use std::io;
use std::path::PathBuf;

use deltille_core::setting::Setting::FrameOptionsTopic;
use deltille_core::words::{counted, cut, quoted};
use deltille_files::limits::Exceeded;
use deltille_files::photograph::ImageError;

/// Error of reading frames.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FramesError {
    /// A photograph cannot be read.
    #[error(transparent)]
    Photograph(#[from] ImageError),
    /// A folder contains no photographs.
    #[error("{}: no PNG, JPEG, TIFF, BMP, PGM, WebP or HEIC file in this folder", path.display())]
    EmptyFolder {
        /// The folder.
        path: PathBuf,
    },
    /// A recording, or an image in it, cannot be read.
    #[error("{}: {problem}", path.display())]
    Recording {
        /// The recording, or the image in it.
        path: PathBuf,
        /// The problem.
        #[source]
        problem: Problem,
    },
    /// A recording ends early, because it is damaged or was not finished. The frames before are valid.
    #[error("{}: incomplete after {}: {problem}", path.display(), counted(*frames, "frame"))]
    Incomplete {
        /// The recording.
        path: PathBuf,
        /// Number of frames before the end.
        frames: usize,
        /// The problem.
        #[source]
        problem: Problem,
    },
}

/// A problem of a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The operating system reports an error.
    #[error("{0}")]
    Io(#[source] io::Error),
    /// The content is damaged, or was not written completely.
    #[error("{0}")]
    Damaged(String),
    /// The content is valid, but not supported.
    #[error("{0}")]
    Unsupported(String),
    /// The content exceeds a limit.
    #[error("{0}")]
    Exceeded(Exceeded),
    /// ffmpeg is not installed.
    #[error(
        "videos need the program ffmpeg: install it (apt install ffmpeg, brew install ffmpeg, winget install ffmpeg)"
    )]
    NoFfmpeg,
    /// The recording has several topics with images.
    #[error("{} topics contain images: choose one with {FrameOptionsTopic} ({})", .0.len(), in_words(.0))]
    Topics(Vec<String>),
    /// The requested topic does not exist or contains no images.
    #[error("{} is not a topic with images ({})", quoted(topic), in_words(topics))]
    NoTopic {
        /// The requested topic.
        topic: String,
        /// The topics with images.
        topics: Vec<String>,
    },
    /// No topic contains images. Lists the topics and their types.
    #[error(
        "no topic contains sensor_msgs/Image or sensor_msgs/CompressedImage ({})",
        in_words(.0)
    )]
    NoImages(Vec<String>),
}

impl Problem {
    /// Whether the frames before the problem are valid.
    pub(crate) fn is_early_end(&self) -> bool {
        matches!(self, Self::Damaged(_))
    }

    /// Returns the problem of a file that ends within a record.
    pub(crate) fn cut_off() -> Self {
        Self::Damaged("the file ends within a record".to_owned())
    }
}

impl From<io::Error> for Problem {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::cut_off(),
            // Decoders of compressed data.
            io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput | io::ErrorKind::Other => {
                Self::Damaged(error.to_string())
            }
            _ => Self::Io(error),
        }
    }
}

impl From<Exceeded> for Problem {
    fn from(exceeded: Exceeded) -> Self {
        Self::Exceeded(exceeded)
    }
}

fn in_words(topics: &[String]) -> String {
    if topics.is_empty() {
        return "there is none".to_owned();
    }
    topics.iter().map(|topic| cut(topic)).collect::<Vec<_>>().join(", ")
}
