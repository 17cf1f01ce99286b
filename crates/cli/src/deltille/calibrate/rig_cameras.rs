//! The cameras of `deltille rig`: their names, and their detections, photographs or recordings.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};

use super::detection_files;
use super::filming::{self, Film, FilmCamera, Given};
use crate::deltille::files::images::Images;
use crate::values::whole;
use deltille::calibrate::{Intrinsics, Model, Reference};
use deltille::frames::{FrameOptions, Frames, FramesError, Problem, is_recording};
use deltille::limits::Limits;
use deltille::targets::Name;

/// The cameras and their images.
#[derive(clap::Args)]
pub struct CamerasArgs {
    /// A recording of all cameras, an MCAP file or a bag of ROS 1 or 2, with --topic for each camera
    #[arg(value_name = "RECORDING", conflicts_with = "camera")]
    pub recording: Vec<PathBuf>,
    /// Camera and its video, recording, folder of photographs or folder of detections, such as left=left.mp4; repeat for each
    /// camera. The first camera defines the rig's frame. Frames of recordings are combined by their time stamps, photographs and
    /// detections by their file names
    #[arg(long, required_unless_present = "recording", value_name = "NAME=PATH", value_parser = named)]
    pub camera: Vec<(String, PathBuf)>,
    /// Topic of a camera in RECORDING, such as /left/image_raw; repeat for each camera. The camera is named after the part of the
    /// topic that differs, or NAME. With --camera NAME=PATH, the topic in its recording
    #[arg(long, value_name = "[NAME=]TOPIC", value_parser = topic)]
    pub topic: Vec<(Option<String>, String)>,
    /// Use only every N-th set of simultaneous frames of recordings
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=1_000_000u64))]
    pub every: u64,
    /// Maximum number of frames of the rig: those in which the target is still, and which together determine the cameras best
    /// [default: 60 of recordings, all photographs]
    #[arg(long, value_name = "N", value_parser = whole(1..=100_000u32))]
    pub views: Option<u32>,
}

/// A camera, and where its images are.
pub struct Source {
    pub name: String,
    /// The option that names it, for messages.
    pub option: String,
    path: PathBuf,
    topic: Option<String>,
}

/// Parses a camera and a path.
pub fn named(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, path)) if !path.is_empty() => {
            Name::new(name).map(|name| (name.to_string(), path.into()))
        }
        _ => Err("expected a name and a path, such as left=corners/left".to_owned()),
    }
}

/// Parses a topic, with the name of its camera or without.
pub fn topic(text: &str) -> Result<(Option<String>, String), String> {
    match text.split_once('=') {
        _ if text.is_empty() => Err("expected a topic, such as /left/image_raw".to_owned()),
        Some((name, topic)) if !topic.is_empty() => {
            Name::new(name).map(|name| (Some(name.to_string()), topic.to_owned()))
        }
        Some(_) => Err("expected a name and a topic, such as left=/left/image_raw".to_owned()),
        None => Ok((None, text.to_owned())),
    }
}

impl CamerasArgs {
    /// Returns the cameras. A rig has several, unless it is used to measure a target. Of a calibrated rig, `known` are the names
    /// of its cameras; otherwise it is empty.
    pub fn sources(&self, known: &[&str], is_one_enough: bool) -> anyhow::Result<Vec<Source>> {
        let sources = match self.recording.as_slice() {
            [] => self.in_several()?,
            [recording] => self.in_one(recording, known)?,
            [first, second, ..] => {
                let [first, second] = [first, second].map(|path| path.display());
                bail!(
                    "{first} and {second}: name the camera of each, such as --camera left={first} --camera right={second}"
                )
            }
        };
        if sources.len() < 2 && !is_one_enough {
            let option = if self.camera.is_empty() { "--topic" } else { "--camera" };
            bail!(
                "{option}: a rig needs at least two cameras, or one with --refine-target; use `deltille calibrate` for one camera"
            );
        }
        check_places(&sources)?;
        check_names(&sources)?;
        Ok(sources)
    }

    /// Returns the cameras of a calibrated rig with these names; each of them needs images.
    pub fn of_calibrated(&self, names: &[&str]) -> anyhow::Result<Vec<Source>> {
        let sources = self.sources(names, true)?;
        let option = if self.camera.is_empty() { "--topic" } else { "--camera" };
        check_named(option, sources.iter().map(|source| source.name.as_str()), names)?;
        match names.iter().find(|name| !sources.iter().any(|of| of.name == **name)) {
            Some(missing) => {
                bail!("{option}: no images of {missing}; give those of all cameras of the rig")
            }
            None => Ok(sources),
        }
    }

    /// The cameras of one recording.
    fn in_one(&self, recording: &Path, known: &[&str]) -> anyhow::Result<Vec<Source>> {
        if self.topic.is_empty() {
            let show = recording.display();
            return match Frames::open(recording, &FrameOptions::default()) {
                Err(FramesError::Recording { problem: Problem::Topics(topics), .. }) => {
                    bail!("{show}: {}", several(&topics, "that of each camera with --topic"))
                }
                Ok(_) => bail!(
                    "{show}: the images of one camera only; pass those of each camera with --camera NAME=PATH"
                ),
                Err(error) => Err(error.into()),
            };
        }
        let topics: Vec<&str> = self.topic.iter().map(|(_, topic)| topic.as_str()).collect();
        let names = differing(&topics);
        let source = |((name, topic), differing): (&(Option<String>, String), String)| {
            let name = match name {
                Some(name) => name.clone(),
                None => named_by_topic(topic, &differing, known)?,
            };
            let (path, option) = (recording.to_owned(), format!("--topic {topic}"));
            Ok(Source { name, option, path, topic: Some(topic.clone()) })
        };
        self.topic.iter().zip(names).map(source).collect()
    }

    /// The cameras in files or folders of their own.
    fn in_several(&self) -> anyhow::Result<Vec<Source>> {
        for (index, (name, topic)) in self.topic.iter().enumerate() {
            let Some(name) = name else {
                bail!(
                    "--topic {topic}: name its camera, such as --topic {}={topic}",
                    self.camera[0].0
                )
            };
            let is_it = |(other, _): &(Option<String>, String)| other.as_ref() == Some(name);
            ensure!(!self.topic[..index].iter().any(is_it), "--topic: {name} is given twice");
            ensure!(
                self.camera.iter().any(|(camera, _)| camera == name),
                "--topic: no --camera is named {name}"
            );
        }
        let source = |(name, path): &(String, PathBuf)| {
            let topic = self.topic.iter().find(|(of, _)| of.as_ref() == Some(name));
            Source {
                name: name.clone(),
                option: format!("--camera {name}"),
                path: path.clone(),
                topic: topic.map(|(_, topic)| topic.clone()),
            }
        };
        Ok(self.camera.iter().map(source).collect())
    }

    /// Reads the detections of each camera, or detects the target in its images. Of recordings, it selects the frames to
    /// calibrate cameras with these intrinsics.
    pub fn read(
        &self,
        sources: &[Source],
        reference: &Reference,
        intrinsics: &[Intrinsics],
        limits: &Limits,
    ) -> anyhow::Result<Vec<Given>> {
        let paths: Vec<PathBuf> = sources.iter().map(|source| source.path.clone()).collect();
        if !filming::are_images(&paths)? {
            let (topic, views) = (!self.topic.is_empty(), self.views.is_some());
            filming::check_none([
                ("--topic", topic),
                ("--every", self.every > 1),
                ("--views", views),
            ])?;
            return detections(sources, limits);
        }
        let cameras = sources.iter().zip(intrinsics);
        let cameras = cameras.map(|(source, intrinsics)| {
            let camera = source.camera(intrinsics, limits);
            camera.with_context(|| source.option.clone())
        });
        let cameras = cameras.collect::<anyhow::Result<_>>()?;
        let film = Film { cameras, every: self.every, views: self.views, limits };
        let detections = film.see(reference)?;
        let given = detections.into_iter().zip(&paths);
        Ok(given.map(|(detections, path)| Given::of_images(detections, path)).collect())
    }
}

/// Reads the detections of each camera.
fn detections(sources: &[Source], limits: &Limits) -> anyhow::Result<Vec<Given>> {
    let given = sources.iter().map(|source| {
        let given = detection_files::given(std::slice::from_ref(&source.path), limits);
        given.with_context(|| source.option.clone())
    });
    given.collect()
}

/// Returns the topic of a single camera, which has no name.
pub fn topic_of_one(given: &[(Option<String>, String)]) -> anyhow::Result<Option<String>> {
    match given {
        [] => Ok(None),
        [(None, topic)] => Ok(Some(topic.clone())),
        _ => bail!("--topic: one camera has one topic, without a name"),
    }
}

/// Follows the target through all images of each camera, or reads its detections. Nothing is selected.
pub fn follow(
    sources: &[Source],
    reference: &Reference,
    limits: &Limits,
) -> anyhow::Result<Vec<Given>> {
    let paths: Vec<PathBuf> = sources.iter().map(|source| source.path.clone()).collect();
    for Source { option, path, .. } in sources {
        ensure!(path.exists(), "{option}: {}: no such file or folder", path.display());
    }
    if !filming::are_images(&paths)? {
        return detections(sources, limits);
    }
    if let Some(source) = sources.iter().find(|source| !is_recording(&source.path)) {
        bail!(
            "{}: {}: photographs have no time stamps; give a video or a recording",
            source.option,
            source.path.display()
        );
    }
    // Only a selection of frames depends on the intrinsics.
    let intrinsics = Intrinsics::Unknown(Model::Radtan);
    let cameras = sources
        .iter()
        .map(|source| source.camera(&intrinsics, limits).with_context(|| source.option.clone()));
    let cameras = cameras.collect::<anyhow::Result<_>>()?;
    let found = Film { cameras, every: 1, views: None, limits }.follow(reference)?;
    let given = found.into_iter().zip(&paths);
    Ok(given.map(|(detections, path)| Given::of_images(detections, path)).collect())
}

impl Source {
    /// The images of a single camera.
    pub fn alone(path: PathBuf, topic: Option<String>) -> Self {
        Self { name: String::new(), option: "RECORDING".to_owned(), path, topic }
    }

    /// Lists the images of the camera. Opens a recording, so that a wrong topic is reported before the first frame is read.
    fn camera<'a>(
        &'a self,
        intrinsics: &'a Intrinsics,
        limits: &Limits,
    ) -> anyhow::Result<FilmCamera<'a>> {
        let mut options = FrameOptions::default();
        (options.topic, options.limits) = (self.topic.clone(), *limits);
        if is_recording(&self.path) {
            check_topic(&self.path, &options)?;
        }
        let images = Images::of(std::slice::from_ref(&self.path))?;
        Ok(FilmCamera { name: &self.name, images, options, intrinsics })
    }
}

/// Opens a recording, to report a wrong topic.
fn check_topic(path: &Path, options: &FrameOptions) -> anyhow::Result<()> {
    match Frames::open(path, options) {
        Ok(_) => Ok(()),
        Err(FramesError::Recording { problem: Problem::Topics(topics), .. }) => {
            bail!("{}: {}", path.display(), several(&topics, "one with --topic NAME=TOPIC"))
        }
        Err(error) => Err(error.into()),
    }
}

/// Asks for a choice of topics.
fn several(topics: &[String], choice: &str) -> String {
    format!("{} topics contain images: choose {choice} ({})", topics.len(), topics.join(", "))
}

/// Returns the parts in which topics differ, without the common first and last parts: left and right of `/left/image_raw` and
/// `/right/image_raw`.
fn differing(topics: &[&str]) -> Vec<String> {
    let parts = |topic: &&str| {
        let parts = topic.split('/').filter(|part| !part.is_empty());
        parts.map(str::to_owned).collect::<Vec<_>>()
    };
    let all: Vec<Vec<String>> = topics.iter().map(parts).collect();
    let shortest = all.iter().map(Vec::len).min().unwrap_or(0);
    let is_common = |part: &dyn Fn(&[String]) -> Option<String>| {
        all.iter().map(|parts| part(parts)).collect::<BTreeSet<_>>().len() == 1
    };
    let first = (0..shortest).take_while(|&i| is_common(&|parts| parts.get(i).cloned())).count();
    let last = (0..shortest)
        .take_while(|&i| is_common(&|parts| parts.iter().nth_back(i).cloned()))
        .count();
    let rest = |parts: &Vec<String>| match parts.get(first..parts.len().saturating_sub(last)) {
        Some(rest) if !rest.is_empty() => rest.join("-"),
        _ => parts.join("-"),
    };
    all.iter().map(rest).collect()
}

/// Names the camera of a topic: one of the `known` cameras that is a part of the topic, or without known cameras, the part that
/// differs from other topics.
fn named_by_topic(topic: &str, differing: &str, known: &[&str]) -> anyhow::Result<String> {
    if known.is_empty() || known.contains(&differing) {
        let name = Name::new(differing).map_err(|why| {
            anyhow!("--topic {topic}: {why}; name the camera with --topic NAME={topic}")
        })?;
        return Ok(name.to_string());
    }
    let named: Vec<&&str> =
        known.iter().filter(|camera| topic.split('/').any(|part| part == **camera)).collect();
    match named.as_slice() {
        [camera] => Ok(camera.to_string()),
        _ => bail!(
            "--topic {topic}: its camera is not clear; name the camera with --topic NAME={topic} (cameras: {})",
            known.join(", ")
        ),
    }
}

/// Rejects camera names that are not valid or not distinct file names.
fn check_names(sources: &[Source]) -> anyhow::Result<()> {
    for (index, Source { name, option, .. }) in sources.iter().enumerate() {
        let is_same = |other: &str| other.to_lowercase() == name.to_lowercase();
        let is_taken = ["rig", "camchain"].iter().any(|own| is_same(own));
        if is_taken || name.contains(['/', '\\']) || name.starts_with('.') {
            bail!("{option}: {name} is not a valid file name");
        }
        match sources[..index].iter().find(|other| is_same(&other.name)) {
            Some(other) if other.option == *option => bail!("{option}: given twice"),
            Some(other) if other.name == *name => {
                bail!("{option}: this is {name}, like {}; name one of them", other.option)
            }
            Some(Source { name: other, .. }) => bail!(
                "{option}: {other} and {name} differ only in case, so their files would collide on some systems"
            ),
            None => {}
        }
    }
    Ok(())
}

/// Rejects images that are given for two cameras.
fn check_places(sources: &[Source]) -> anyhow::Result<()> {
    let mut places: Vec<(PathBuf, &Source)> = Vec::new();
    for source in sources {
        // Missing files are reported when they are read.
        let Ok(place) = source.path.canonicalize() else { continue };
        let is_same =
            |(there, other): &&(PathBuf, &Source)| *there == place && other.topic == source.topic;
        if let Some((_, other)) = places.iter().find(is_same) {
            let what = match &source.topic {
                Some(topic) => format!("topic, {topic}"),
                None => format!("images, {}", source.path.display()),
            };
            if other.name == source.name {
                bail!("{}: given twice", source.option);
            }
            bail!("{}: {} and {} have the same {what}", source.option, other.name, source.name);
        }
        places.push((place, source));
    }
    Ok(())
}

/// Rejects names of unknown cameras, and duplicates.
pub fn check_named<'a>(
    option: &str,
    given: impl IntoIterator<Item = &'a str>,
    cameras: &[&str],
) -> anyhow::Result<()> {
    let mut names = BTreeSet::new();
    for name in given {
        if !names.insert(name) {
            bail!("{option}: {name} is given twice");
        }
        if !cameras.contains(&name) {
            bail!("{option}: no camera is named {name} (cameras: {})", cameras.join(", "));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::differing;

    #[test]
    fn cameras_are_named_after_the_part_of_their_topics_that_differs() {
        assert_eq!(differing(&["/left/image_raw", "/right/image_raw"]), ["left", "right"]);
        let mixed = ["/rig/left/image_raw/compressed", "/rig/right/image_raw"];
        assert_eq!(differing(&mixed), ["left-image_raw-compressed", "right-image_raw"]);
        assert_eq!(differing(&["/camera", "/camera/compressed"]), ["camera", "compressed"]);
    }
}
