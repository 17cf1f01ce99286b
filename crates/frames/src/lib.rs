//! Frames of photographs, videos and robot recordings, one at a time.
//!
//! Input: a path. Output: [`Frames`], an iterator of [`Frame`]s with a name, a time stamp and an image that is decoded on
//! demand. At most one frame, or one compressed chunk of a recording, is in memory.
//!
//! | module | purpose |
//! |---|---|
//! | [`problem`] | what is wrong with a recording |
//! | `pixels` | pixels of a `sensor_msgs/Image` as grey values |
//! | `y4m`, `video` | uncompressed video, and all others through ffmpeg |
//! | `heic` | HEIC photographs through ffmpeg |
//! | `content`, `frame` | a frame before and after decoding |
//! | `bag` | messages of MCAP and of the bags of ROS 1 and 2 |
//! | `folder` | photographs in a folder |
//! | `frames` | all of these behind one iterator |
//! | `simultaneous` | frames of several cameras that were taken at the same time |
//!
//! ```no_run
//! use deltille_files::limits::Limits;
//! use deltille_frames::{FrameOptions, Frames};
//!
//! let options = FrameOptions::default().topic("/left/image_raw");
//! for frame in Frames::open("run.mcap", &options)? {
//!     let frame = frame?;
//!     let (name, time_ns) = (frame.name(), frame.time_ns());
//!     let photograph = frame.read(&Limits::default(), false)?;
//!     println!("{name} at {time_ns:?} ns: {} px wide", photograph.image.width());
//! }
//! # Ok::<(), deltille_frames::FramesError>(())
//! ```

#[cfg(any(feature = "mcap", feature = "rosbag1"))]
mod bag;
mod content;
mod folder;
mod frame;
mod frames;
#[cfg(feature = "video")]
mod heic;
#[cfg(any(feature = "mcap", feature = "rosbag1"))]
mod pixels;
pub mod problem;
mod simultaneous;
#[cfg(feature = "video")]
mod video;
#[cfg(feature = "video")]
mod y4m;

pub use folder::{is_bag, is_heic, is_photograph, is_recording, photographs_in, unread_in};
pub use frame::Frame;
pub use frames::{FrameOptions, Frames};
pub use problem::{FramesError, Problem};
pub use simultaneous::{FrameSets, interval_ns};
