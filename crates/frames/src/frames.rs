//! The frames of a path.

use std::path::{Path, PathBuf};

use deltille_core::setting::Setting::FrameOptionsTopic;
use deltille_files::limits::Limits;

#[cfg(feature = "video")]
use crate::content::Content;
use crate::content::Recorded;
use crate::folder;
use crate::frame::Frame;
use crate::problem::{FramesError, Problem};
#[cfg(feature = "video")]
use crate::video::VideoFrame;

/// Which frames are read.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct FrameOptions {
    /// The topic of a recording; needed if several contain images.
    pub topic: Option<String>,
    /// Every n-th frame of a recording is read; 0 and 1 for all.
    pub every: u64,
    /// Number of the first frame of a recording that is read.
    pub start: u64,
    /// Number of the frame of a recording before which reading stops; `None` for all.
    pub stop: Option<u64>,
    /// Limits of each image, and of each part of a recording.
    pub limits: Limits,
}

impl FrameOptions {
    /// Sets the topic.
    #[must_use]
    pub fn topic(self, topic: impl Into<String>) -> Self {
        Self { topic: Some(topic.into()), ..self }
    }
}

/// An iterator over the frames of a photograph, folder, video or recording.
///
/// The last item of a recording that is damaged or was not finished is [`FramesError::Incomplete`].
pub struct Frames(Kind);

enum Kind {
    Photographs(std::vec::IntoIter<PathBuf>),
    Recording(Recording),
}

/// The frames of a recording.
type Stream = Box<dyn Iterator<Item = Result<Recorded, Problem>> + Send>;

struct Recording {
    path: PathBuf,
    /// The frames; `None` after the end.
    stream: Option<Stream>,
    /// Number of frames so far.
    count: u64,
    every: u64,
    start: u64,
    stop: Option<u64>,
}

impl Frames {
    /// Opens a path: a photograph; a folder of photographs, sorted by name; a video; MCAP; a bag of ROS 1 or 2.
    /// Recordings are recognised by their extension.
    ///
    /// # Errors
    /// Returns an error if the recording or folder cannot be read, or if the topic is not known.
    pub fn open(path: impl AsRef<Path>, options: &FrameOptions) -> Result<Self, FramesError> {
        let path = path.as_ref();
        let failed = |problem| FramesError::Recording { path: path.to_owned(), problem };
        if folder::is_recording(path) {
            let stream = Some(open(path, options).map_err(failed)?);
            let &FrameOptions { every, start, stop, .. } = options;
            let (path, every) = (path.to_owned(), every.max(1));
            let recording = Recording { path, stream, count: 0, every, start, stop };
            return Ok(Self(Kind::Recording(recording)));
        }
        if !path.is_dir() {
            return Ok(Self(Kind::Photographs(vec![path.to_owned()].into_iter())));
        }
        let photographs = folder::photographs_in(path).map_err(|error| failed(error.into()))?;
        if photographs.is_empty() {
            return Err(FramesError::EmptyFolder { path: path.to_owned() });
        }
        Ok(Self(Kind::Photographs(photographs.into_iter())))
    }
}

impl Iterator for Frames {
    type Item = Result<Frame, FramesError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.0 {
            Kind::Photographs(paths) => paths.next().map(|path| Ok(Frame::photograph(path))),
            Kind::Recording(recording) => recording.next(),
        }
    }
}

impl Recording {
    fn next(&mut self) -> Option<Result<Frame, FramesError>> {
        loop {
            let number = self.count;
            if self.stop.is_some_and(|stop| number >= stop) {
                self.stream = None;
            }
            let next = self.stream.as_mut()?.next();
            match next {
                Some(Ok(recorded)) => {
                    self.count += 1;
                    if number >= self.start && number.is_multiple_of(self.every) {
                        return Some(Ok(Frame::recorded(self.path_of(number), recorded)));
                    }
                }
                Some(Err(problem)) => {
                    self.stream = None;
                    let path = self.path.clone();
                    return Some(Err(match problem.is_early_end() && number > 0 {
                        true => FramesError::Incomplete { path, frames: number as usize, problem },
                        false => FramesError::Recording { path, problem },
                    }));
                }
                None => {
                    self.stream = None;
                    let problem = Problem::Unsupported("contains no images".to_owned());
                    let path = self.path.clone();
                    return (number == 0).then_some(Err(FramesError::Recording { path, problem }));
                }
            }
        }
    }

    fn path_of(&self, number: u64) -> PathBuf {
        let stem = if self.path.is_dir() { self.path.file_name() } else { self.path.file_stem() };
        let stem = stem.unwrap_or("frame".as_ref()).to_string_lossy();
        self.path.with_file_name(format!("{stem}-{number:06}"))
    }
}

#[allow(unused_variables, reason = "depends on the features")]
fn open(path: &Path, options: &FrameOptions) -> Result<Stream, Problem> {
    if folder::is_video(path) && options.topic.is_some() {
        return Err(Problem::Unsupported(format!(
            "a video has no topics; omit {FrameOptionsTopic}"
        )));
    }
    if path.metadata().is_ok_and(|about| about.is_file() && about.len() == 0) {
        return Err(empty());
    }
    match folder::extension(path).as_str() {
        #[cfg(any(feature = "mcap", feature = "rosbag1"))]
        "mcap" | "bag" | "active" | "db3" => {
            crate::bag::open(path, options.topic.as_deref(), &options.limits)
        }
        #[cfg(feature = "rosbag2")]
        _ if path.is_dir() => {
            crate::bag::open_folder(path, options.topic.as_deref(), &options.limits)
        }
        #[cfg(feature = "video")]
        "y4m" => y4m(path, &options.limits),
        #[cfg(feature = "video")]
        _ => {
            let video = crate::video::Video::open(path, true, &options.limits)?;
            Ok(Box::new(video.map(|frame| {
                let VideoFrame { time_ns, part, image } = frame?;
                Ok(Recorded { time_ns, part, content: Content::Gray(image) })
            })))
        }
        #[allow(unreachable_patterns, reason = "depends on the features")]
        _ => Err(Problem::Unsupported("this program was built without its format".to_owned())),
    }
}

/// The problem of a recording without a single byte.
fn empty() -> Problem {
    Problem::Damaged("an empty file (0 bytes)".to_owned())
}

#[cfg(feature = "video")]
fn y4m(path: &Path, limits: &Limits) -> Result<Stream, Problem> {
    let file = std::fs::File::open(path).map_err(Problem::Io)?;
    let bytes = file.metadata().map_or(0, |about| about.len());
    let Some(mut video) = crate::y4m::Y4m::open(std::io::BufReader::new(file), limits)? else {
        return Err(empty());
    };
    let count = video.frames_in(bytes).max(1);
    let mut number = 0;
    Ok(Box::new(std::iter::from_fn(move || {
        let frame = video.next_frame().transpose()?;
        let time_ns = video.time_ns(number);
        number += 1;
        let part = Some((number as f64 / count as f64).min(1.0));
        Some(frame.map(|image| Recorded { time_ns, part, content: Content::Gray(image) }))
    })))
}
