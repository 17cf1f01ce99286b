//! Frames of several cameras that were taken at the same time.
//!
//! ```text
//!   left    |      |      |             |
//!   right    |      |      |     |      |
//!           set    set    set  alone   set       time →
//! ```
//!
//! A set contains the earliest frame that is left, and the next frame of each other camera if it was taken within the tolerance
//! after it. If the tolerance is less than half of the interval between frames, no frame has two possible partners.

use std::iter::Peekable;

use deltille_core::statistics::median;

use crate::frame::Frame;

/// Number of frames from which the interval is estimated: a few seconds, in which some frames may be missing.
const SAMPLE: usize = 100;

/// Returns the median interval between the first frames of a camera, ns; `None` if fewer than two have different time stamps.
/// The frames are not decoded.
pub fn interval_ns<E>(frames: impl Iterator<Item = Result<Frame, E>>) -> Option<i64> {
    let times = frames.take(SAMPLE).filter_map(|frame| frame.ok()?.time_ns());
    let times: Vec<i64> = times.collect();
    let steps = times.windows(2).map(|pair| (pair[1] - pair[0]).abs() as f64);
    median(steps.filter(|step| *step > 0.0).collect()).map(|ns| ns as i64)
}

/// An iterator over sets of frames, in the order of their times: one frame of each camera, or `None`.
///
/// A frame without a time stamp, and an error of a camera, are alone in their set.
///
/// ```no_run
/// use deltille_frames::{FrameOptions, Frames, FrameSets, interval_ns};
///
/// let open = |topic| Frames::open("run.mcap", &FrameOptions::default().topic(topic));
/// let interval_ns = interval_ns(open("/left/image_raw")?).unwrap_or(0);
/// let cameras = vec![open("/left/image_raw")?, open("/right/image_raw")?];
/// for set in FrameSets::new(cameras, interval_ns / 2) {
///     let seen = set.iter().flatten().filter(|frame| frame.is_ok()).count();
///     println!("{seen} images at the same time");
/// }
/// # Ok::<(), deltille_frames::FramesError>(())
/// ```
pub struct FrameSets<I: Iterator> {
    cameras: Vec<Peekable<I>>,
    tolerance_ns: i64,
}

impl<I: Iterator<Item = Result<Frame, E>>, E> FrameSets<I> {
    /// Combines the frames of cameras. Times within a set differ by at most the tolerance, ns.
    pub fn new(cameras: impl IntoIterator<Item = I>, tolerance_ns: i64) -> Self {
        let cameras = cameras.into_iter().map(Iterator::peekable).collect();
        Self { cameras, tolerance_ns }
    }
}

impl<I: Iterator<Item = Result<Frame, E>>, E> Iterator for FrameSets<I> {
    type Item = Vec<Option<I::Item>>;

    fn next(&mut self) -> Option<Self::Item> {
        // Without a time stamp, it is the next.
        let time = |next: &I::Item| next.as_ref().ok().and_then(Frame::time_ns);
        let heads =
            self.cameras.iter_mut().map(|camera| camera.peek().map(time)).collect::<Vec<_>>();
        let first = heads.iter().flatten().min().copied()?;
        let mut is_alone = false;
        let set = self.cameras.iter_mut().zip(heads).map(|(camera, head)| {
            let head = head?;
            let is_in = match (first, head) {
                (Some(first), Some(time)) => time.saturating_sub(first) <= self.tolerance_ns,
                (None, None) => !std::mem::replace(&mut is_alone, true),
                _ => false,
            };
            if is_in { camera.next() } else { None }
        });
        Some(set.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::content::{Content, Recorded};
    use crate::problem::FramesError;
    use deltille_core::raster::{AnyGray, Gray};

    fn frames(times: &[i64]) -> std::vec::IntoIter<Result<Frame, FramesError>> {
        let frame = |&time: &i64| {
            let content = Content::Gray(AnyGray::U8(Gray::from_vec(1, 1, vec![0]).unwrap()));
            let recorded = Recorded { time_ns: Some(time), part: None, content };
            Ok(Frame::recorded(time.to_string().into(), recorded))
        };
        times.iter().map(frame).collect::<Vec<_>>().into_iter()
    }

    #[test]
    fn frames_of_the_same_time_are_together() {
        let (left, right) = ([0, 33, 66, 133], [2, 35, 64, 99, 132, 166]);
        assert_eq!(interval_ns(frames(&left)), Some(33));
        let times = |set: Vec<Option<Result<Frame, FramesError>>>| {
            let time = |frame: Option<Result<Frame, _>>| frame?.ok()?.time_ns();
            set.into_iter().map(time).collect::<Vec<_>>()
        };
        let sets = FrameSets::new([frames(&left), frames(&right)], 16);
        let sets: Vec<Vec<Option<i64>>> = sets.map(times).collect();
        let some = |left, right| vec![Some(left), Some(right)];
        assert_eq!(
            sets,
            [
                some(0, 2),
                some(33, 35),
                some(66, 64),
                vec![None, Some(99)],
                some(133, 132),
                vec![None, Some(166)]
            ]
        );
    }
}
