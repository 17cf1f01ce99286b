//! Images in MCAP files and in the bags of ROS 1 and 2.
//!
//! Input: the path of a file or bag, and a topic. Output: an iterator of time stamps and images.
//!
//! 1. `fields` reads numbers and texts from bytes.
//! 2. `message` reads `sensor_msgs/Image` and `sensor_msgs/CompressedImage`.
//! 3. `topic` chooses the topic.
//! 4. `source` reads files, and decompresses parts of them.
//! 5. `mcap`, `ros1` and `sqlite` read the messages of a file; `folder` lists the files of a bag.

mod fields;
#[cfg(feature = "rosbag2")]
mod folder;
#[cfg(feature = "mcap")]
mod mcap;
mod message;
#[cfg(feature = "rosbag1")]
mod ros1;
mod source;
#[cfg(feature = "rosbag2")]
mod sqlite;
mod topic;

use std::path::Path;

use deltille_files::limits::Limits;

use self::message::Message;
use self::topic::{Topic, choose};
use crate::content::Recorded;
use crate::problem::Problem;

/// The images of a topic.
type Images = Box<dyn Iterator<Item = Result<Recorded, Problem>> + Send>;

/// Messages of a topic in a file.
type Messages = Box<dyn Iterator<Item = Result<Message, Problem>> + Send>;

/// Opens a file.
pub(crate) fn open(path: &Path, wanted: Option<&str>, limits: &Limits) -> Result<Images, Problem> {
    let topic = choose(topics(path, limits)?, wanted)?;
    let messages = messages(path, &topic, limits)?;
    Ok(images(messages, topic, *limits))
}

/// Opens the folder of a bag.
#[cfg(feature = "rosbag2")]
pub(crate) fn open_folder(
    path: &Path,
    wanted: Option<&str>,
    limits: &Limits,
) -> Result<Images, Problem> {
    let folder::Parts { files, is_compressed } = folder::parts(path)?;
    let mut all = Vec::new();
    for file in &files {
        match topics(file, limits) {
            // The last file may not be finished.
            Err(Problem::Damaged(_)) if !all.is_empty() => {}
            topics => all.extend(topics?),
        }
    }
    let (topic, limits) = (choose(all, wanted)?, *limits);
    let of_topic = topic.clone();
    let bytes = |file: &std::path::PathBuf| std::fs::metadata(file).map_or(0, |about| about.len());
    let all: u64 = files.iter().map(bytes).sum();
    let mut before = 0;
    let messages = files.into_iter().flat_map(move |file| {
        let (start, own) = (before, bytes(&file));
        before += own;
        let messages = messages(&file, &of_topic, &limits)
            .unwrap_or_else(|problem| Box::new(std::iter::once(Err(problem))));
        messages.map(move |message| {
            let part = |part| (start as f64 + part * own as f64) / all.max(1) as f64;
            message.map(|message| Message { part: part(message.part), ..message })
        })
    });
    let messages = messages.map(move |message| match message {
        Ok(message) if is_compressed => {
            let data = source::decompressed("zstd", &message.data, None, &limits)?;
            Ok(Message { data, ..message })
        }
        message => message,
    });
    Ok(images(Box::new(messages), topic, limits))
}

/// Reads the images of messages.
fn images(messages: Messages, topic: Topic, limits: Limits) -> Images {
    Box::new(messages.map(move |message| {
        let Message { time_ns, part, data } = message?;
        let (stamp, content) = message::image(data, topic.kind(), topic.dialect, &limits)?;
        Ok(Recorded { time_ns: stamp.or(time_ns), part: Some(part), content })
    }))
}

/// Returns the topics of a file.
fn topics(path: &Path, limits: &Limits) -> Result<Vec<Topic>, Problem> {
    match crate::folder::extension(path).as_str() {
        #[cfg(feature = "mcap")]
        "mcap" => mcap::topics(path, limits),
        #[cfg(feature = "rosbag1")]
        "bag" | "active" => ros1::topics(path, limits),
        #[cfg(feature = "rosbag2")]
        "db3" => sqlite::topics(path, limits),
        _ => Err(not_supported(path)),
    }
}

/// Returns the messages of a topic in a file.
fn messages(path: &Path, topic: &Topic, limits: &Limits) -> Result<Messages, Problem> {
    Ok(match crate::folder::extension(path).as_str() {
        #[cfg(feature = "mcap")]
        "mcap" => Box::new(mcap::Messages::open(path, topic, limits)?),
        #[cfg(feature = "rosbag1")]
        "bag" | "active" => Box::new(ros1::Messages::open(path, topic, limits)?),
        #[cfg(feature = "rosbag2")]
        "db3" => Box::new(sqlite::Messages::open(path, topic, limits)?),
        _ => return Err(not_supported(path)),
    })
}

fn not_supported(path: &Path) -> Problem {
    let name = path.file_name().unwrap_or_default().display();
    Problem::Unsupported(match crate::folder::extension(path).as_str() {
        "zstd" => format!("{name} is compressed as a whole: decompress it with `zstd -d` first"),
        _ => format!("the storage of {name} is not supported"),
    })
}
