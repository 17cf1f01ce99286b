//! The stillest frame of each position of a target in a recording of one camera or of several.
//!
//! ```text
//!   position      ______          ______         a stretch ends when the corners have moved by the spacing
//!           _____/      \________/
//!   kept      ×  ×  ×     ×    ×    ×            of each stretch, the frame in which they move least
//! ```

use std::cmp::Ordering;
use std::collections::BTreeMap;

use glam::DVec2;

use crate::input::observation::MIN_CORNERS;
use deltille_core::detection::Detection;
use deltille_core::statistics::median;

/// Displacement of the corners that begins a new stretch, as a fraction of the image width: views that are more similar
/// hardly add information.
const SPACING: f64 = 0.02;

/// Largest number of frames that are kept. At this number, the spacing is doubled; a calibration with so many views takes
/// about a second.
const MAX_KEPT: usize = 300;

/// A frame of a recording that shows the target, of one camera or of several at the same time.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Keyframe {
    /// Name of the frame.
    pub name: String,
    /// The detection of each camera; `None` if it has no image of this time.
    pub detections: Vec<Option<Detection>>,
    /// Median displacement of the corners from one frame of the recording to the next, px: the larger one of those before
    /// and after this frame, in the camera in which it is largest. Infinite if neither of these shows the target.
    pub motion_px: f64,
}

impl Keyframe {
    /// Photographs of a target at rest, one of each camera.
    pub fn at_rest(name: impl Into<String>, detections: Vec<Option<Detection>>) -> Self {
        Self { name: name.into(), detections, motion_px: 0.0 }
    }

    /// The number of cameras that see the target.
    pub(crate) fn cameras(&self) -> usize {
        self.detections.iter().flatten().filter(|found| !found.grids.is_empty()).count()
    }

    /// Whether it is the better view of a position: more cameras see the target, or it moves less.
    fn is_better_than(&self, other: &Self) -> bool {
        match self.cameras().cmp(&other.cameras()) {
            Ordering::Equal => self.motion_px < other.motion_px,
            order => order == Ordering::Greater,
        }
    }

    /// The width of the widest image, px.
    fn width(&self) -> f64 {
        let widths = self.detections.iter().flatten().map(|found| f64::from(found.width));
        widths.fold(0.0, f64::max)
    }
}

/// Selects the stillest frame of each position of a target, in bounded memory.
///
/// ```
/// use deltille_calibrate::Keyframes;
/// use deltille_core::detection::Detection;
///
/// let mut keyframes = Keyframes::default();
/// for name in ["000", "001"] {
///     keyframes.add(name, vec![Some(Detection::new(name, [640, 480], Vec::new()))]);
/// }
/// assert!(keyframes.finish().is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Keyframes {
    /// Number of frames of the recording per frame added.
    every: f64,
    spacing: f64,
    kept: Vec<Keyframe>,
    /// Corners of the first frame of the last stretch.
    anchor: Positions,
    /// The last frame, whose motion is not yet complete.
    last: Option<(Keyframe, Positions)>,
}

/// Positions of the corners in each camera by panel, row and column, px.
type Positions = Vec<BTreeMap<(Option<u32>, i32, i32), DVec2>>;

impl Default for Keyframes {
    fn default() -> Self {
        Self::of_every(1)
    }
}

impl Keyframes {
    /// Expects every n-th frame of a recording.
    pub fn of_every(n: u64) -> Self {
        let (kept, anchor) = (Vec::new(), Positions::new());
        Self { every: n.max(1) as f64, spacing: SPACING, kept, anchor, last: None }
    }

    /// Adds the next frame of the recording, with the detection of each camera that has an image.
    pub fn add(&mut self, name: impl Into<String>, detections: Vec<Option<Detection>>) {
        let positions: Positions = detections.iter().map(positions).collect();
        let before = self.last.take();
        let moved = before.as_ref().and_then(|(_, others)| moved(&positions, others));
        let moved = moved.map(|px| px / self.every);
        if let Some((mut frame, others)) = before {
            frame.motion_px = larger(frame.motion_px, moved);
            self.keep(frame, others);
        }
        if positions.iter().any(|of_camera| of_camera.len() >= MIN_CORNERS) {
            let motion_px = moved.unwrap_or(f64::INFINITY);
            let name = name.into();
            self.last = Some((Keyframe { name, detections, motion_px }, positions));
        }
    }

    /// Returns the frames in the order of the recording.
    pub fn finish(mut self) -> Vec<Keyframe> {
        if let Some((frame, positions)) = self.last.take() {
            self.keep(frame, positions);
        }
        self.kept
    }

    /// Adds a frame whose motion is known, or replaces a worse one in the same stretch.
    fn keep(&mut self, frame: Keyframe, positions: Positions) {
        let spacing_px = self.spacing * frame.width();
        let is_new = moved(&positions, &self.anchor).is_none_or(|px| px > spacing_px);
        match self.kept.last_mut().filter(|_| !is_new) {
            Some(kept) if frame.is_better_than(kept) => *kept = frame,
            Some(_) => {}
            None => {
                self.kept.push(frame);
                self.anchor = positions;
            }
        }
        if self.kept.len() > MAX_KEPT {
            self.kept = pairwise_best(std::mem::take(&mut self.kept));
            self.spacing *= 2.0;
        }
    }
}

/// Returns the better one of each two successive frames.
fn pairwise_best(frames: Vec<Keyframe>) -> Vec<Keyframe> {
    let mut best: Vec<Keyframe> = Vec::new();
    for (index, frame) in frames.into_iter().enumerate() {
        match best.last_mut().filter(|_| index % 2 == 1) {
            Some(other) if frame.is_better_than(other) => *other = frame,
            Some(_) => {}
            None => best.push(frame),
        }
    }
    best
}

/// The larger of two displacements; either may be unknown.
fn larger(before_px: f64, after_px: Option<f64>) -> f64 {
    match after_px {
        Some(after_px) if before_px.is_finite() => before_px.max(after_px),
        Some(after_px) => after_px,
        None => before_px,
    }
}

fn positions(detection: &Option<Detection>) -> BTreeMap<(Option<u32>, i32, i32), DVec2> {
    let grids = detection.iter().flat_map(|found| &found.grids);
    let corners = grids.flat_map(|grid| {
        let key = |row, col| (grid.panel, row, col);
        grid.corners.iter().map(move |corner| (key(corner.row, corner.col), corner.position()))
    });
    corners.collect()
}

/// The median displacement of common corners, px, in the camera in which it is largest; `None` if there are none.
fn moved(one: &Positions, other: &Positions) -> Option<f64> {
    let of_camera = one.iter().zip(other).filter_map(|(one, other)| {
        median(one.iter().filter_map(|(key, at)| Some(at.distance(*other.get(key)?))).collect())
    });
    of_camera.max_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::detection::{Grid, GridCorner};
    use deltille_core::lattice::GridKind;

    /// A board shifted to the right in an image 1000 px wide.
    fn frame(name: usize, x: f64) -> Detection {
        let corner = |row: i32| GridCorner {
            row,
            col: 0,
            id: Some(row as u32),
            x,
            y: 20.0 * f64::from(row),
            cov: None,
        };
        let corners = (0..12).map(corner).collect();
        let grid = Grid {
            kind: GridKind::Deltille,
            target: None,
            panel: Some(0),
            mirrored: false,
            corners,
            tags: Vec::new(),
        };
        Detection::new(name.to_string(), [1000, 800], vec![grid])
    }

    fn kept(xs: impl IntoIterator<Item = Option<f64>>) -> Vec<(usize, f64)> {
        let mut keyframes = Keyframes::default();
        for (index, x) in xs.into_iter().enumerate() {
            let empty = || Detection::new(index.to_string(), [1000, 800], Vec::new());
            keyframes.add(index.to_string(), vec![Some(x.map_or_else(empty, |x| frame(index, x)))]);
        }
        let kept = keyframes.finish().into_iter();
        kept.map(|kept| (kept.name.parse().unwrap(), kept.motion_px)).collect()
    }

    #[test]
    fn the_stillest_frame_of_each_position_is_kept() {
        let xs = [0.0, 8.0, 9.0, 9.5, 15.0, 60.0, 61.0, 61.5, 100.0].map(Some);
        assert_eq!(kept(xs), [(2, 1.0), (6, 1.0), (8, 38.5)]);
        // Frames without the target separate motions.
        assert_eq!(kept([Some(0.0), None, Some(50.0), Some(52.0)]), [(0, f64::INFINITY), (2, 2.0)]);
    }

    /// Of a rig, a frame that both cameras see is kept, though the target moves more in it.
    #[test]
    fn frames_of_several_cameras_are_preferred() {
        let mut keyframes = Keyframes::default();
        for (index, (left, right)) in
            [(0.0, false), (0.5, false), (4.5, true), (8.5, true)].into_iter().enumerate()
        {
            let right = right.then(|| frame(index, 300.0 - 1.5 * left));
            keyframes.add(index.to_string(), vec![Some(frame(index, left)), right]);
        }
        let kept = keyframes.finish();
        let [only] = kept.as_slice() else { panic!("{kept:?}") };
        // The right camera sees the target move by 6 px.
        assert_eq!((only.name.as_str(), only.motion_px), ("2", 6.0));
    }

    /// Long recordings are thinned evenly.
    #[test]
    fn memory_is_bounded() {
        let count = 10 * MAX_KEPT;
        let kept = kept((0..count).map(|i| Some(25.0 * i as f64)));
        assert!((MAX_KEPT / 4..=MAX_KEPT).contains(&kept.len()), "{}", kept.len());
        let gaps = kept.windows(2).map(|pair| pair[1].0 - pair[0].0);
        assert!(gaps.clone().max().unwrap() <= 4 * gaps.min().unwrap(), "{kept:?}");
    }
}
