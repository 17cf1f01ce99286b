//! Run time of detection.

use super::{RUNS, Row, SpeedError, fastest, images, timed};
use crate::photographs::{Kind, Subject};
use deltille::detect::{Detector, DetectorConfig, Tracker};
use deltille::family::Family;
use deltille::raster::Gray;
use deltille::targets::Target;

/// Sizes of a tag's bit in photographs, px.
const BITS_PX: [f64; 2] = [4.0, 2.0];

/// Detection of boards, with and without tags.
pub(super) fn boards(seed: u64) -> Result<Vec<Row>, SpeedError> {
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let subject = subject(kind)?;
        let known = detector(kind)?;
        for bit_px in BITS_PX {
            let images = images::boards(&subject, bit_px, seed);
            let what = format!("{}, {bit_px} px a bit", kind.name());
            rows.push(detection(what.clone(), &images, &known));
            if !kind.tagged {
                let any = Detector::for_grid(kind.grid, None, DetectorConfig::default());
                rows.push(detection(format!("{what}, size unknown"), &images, &any));
            }
        }
    }
    Ok(rows)
}

/// Detection in a video, one by one and followed.
pub(super) fn video(seed: u64) -> Result<Vec<Row>, SpeedError> {
    let kind = Kind::ALL[0];
    let frames = images::video(&subject(kind)?, seed);
    let detector = detector(kind)?;
    let single = detection("video, frame by frame", &frames, &detector);
    let mut tracker = Tracker::new(detector);
    let (mut ms, mut followed) = (Vec::new(), 0);
    for frame in &frames {
        let (time, _) = timed(|| tracker.detect(frame, ""));
        if tracker.has_followed() {
            followed += 1;
            ms.push(time);
        }
    }
    let result = format!("{followed} of {} frames followed", frames.len());
    Ok(vec![single, Row::new("video, followed", &ms, result)])
}

/// Search for boards that are not there, in photographs of boards of the other tiling and in patterns.
pub(super) fn absent(seed: u64) -> Result<Vec<Row>, SpeedError> {
    let patterns = images::patterns(seed);
    let kinds = Kind::ALL.into_iter().filter(|kind| kind.tagged);
    let boards: Result<Vec<(Kind, [images::Set; 2])>, SpeedError> =
        kinds.map(|kind| Ok((kind, images::surroundings(&subject(kind)?, seed)))).collect();
    let boards = boards?;
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let detector = detector(kind)?;
        let others = boards.iter().filter(|(other, _)| other.grid != kind.grid);
        let others = others.flat_map(|(other, sets)| {
            sets.iter().map(move |set| (format!("{}, {}", other.name(), set.name), set))
        });
        let patterns = patterns.iter().map(|set| (set.name.clone(), set));
        for (shown, set) in others.chain(patterns) {
            rows.push(detection(
                format!("{} absent: {shown}", kind.name()),
                &set.images,
                &detector,
            ));
        }
    }
    Ok(rows)
}

fn detection(what: impl Into<String>, images: &[Gray<u8>], detector: &Detector) -> Row {
    let (mut ms, mut corners) = (Vec::new(), 0);
    for image in images {
        let (time, found) = fastest(RUNS, || detector.detect(image, ""));
        ms.push(time);
        corners += found.grids.iter().map(|grid| grid.corners.len()).sum::<usize>();
    }
    Row::new(what, &ms, format!("{corners} corners"))
}

fn subject(kind: Kind) -> Result<Subject, SpeedError> {
    let family = kind.spec().tags.and_then(|tags| Family::shipped(&tags.family).ok());
    Ok(Subject::of_kind(kind, family.as_ref())?)
}

fn detector(kind: Kind) -> Result<Detector, SpeedError> {
    let target = Target::new(kind.name(), kind.spec())?;
    Detector::new(&target).map_err(|error| SpeedError::Wrong(error.to_string()))
}
