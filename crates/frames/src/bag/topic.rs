//! The topics of a recording, and the one that is read.

use super::message::{Dialect, Kind};
use crate::problem::Problem;

/// A topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Topic {
    pub(crate) name: String,
    /// The type of its messages, such as `sensor_msgs/msg/Image`.
    pub(crate) type_name: String,
    pub(crate) dialect: Dialect,
}

impl Topic {
    /// Returns the type of the messages. [`choose`] returns only topics with images.
    pub(crate) fn kind(&self) -> Kind {
        if self.type_name.ends_with("CompressedImage") {
            Kind::CompressedImage
        } else {
            Kind::Image
        }
    }

    fn has_images(&self) -> bool {
        let name = self.type_name.strip_prefix("sensor_msgs/").unwrap_or_default();
        matches!(name.strip_prefix("msg/").unwrap_or(name), "Image" | "CompressedImage")
    }
}

/// Returns the requested topic, or the only one with images.
pub(crate) fn choose(mut topics: Vec<Topic>, wanted: Option<&str>) -> Result<Topic, Problem> {
    topics.sort_by(|a, b| a.name.cmp(&b.name));
    topics.dedup();
    let (mut images, others): (Vec<_>, Vec<_>) = topics.into_iter().partition(Topic::has_images);
    if images.is_empty() {
        let others = others.into_iter().map(|topic| format!("{}: {}", topic.name, topic.type_name));
        return Err(Problem::NoImages(others.collect()));
    }
    let names = |topics: Vec<Topic>| topics.into_iter().map(|topic| topic.name).collect();
    match wanted {
        Some(wanted) => match images.iter().position(|topic| topic.name == wanted) {
            Some(index) => Ok(images.swap_remove(index)),
            None => Err(Problem::NoTopic { topic: wanted.to_owned(), topics: names(images) }),
        },
        None if images.len() == 1 => Ok(images.remove(0)),
        None => Err(Problem::Topics(names(images))),
    }
}
