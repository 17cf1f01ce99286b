//! The stillest frame of each position of a target in a recording.
//!
//! ```text
//!   position      ______          ______         a stretch ends when the corners have moved by the spacing
//!           _____/      \________/
//!   kept      ×  ×  ×     ×    ×    ×            of each stretch, the frame in which they move least
//! ```

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

/// A frame of a recording that shows the target.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Keyframe {
    /// Name of the frame.
    pub name: String,
    /// The detection.
    pub detection: Detection,
    /// Median displacement of the corners from one frame of the recording to the next, px: the larger one of those before
    /// and after this frame. Infinite if neither of these shows the target.
    pub motion_px: f64,
}

impl Keyframe {
    /// A photograph of a target at rest.
    pub fn alone(name: impl Into<String>, detection: Detection) -> Self {
        Self { name: name.into(), detection, motion_px: 0.0 }
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
///     keyframes.add(name, Detection::new(name, [640, 480], Vec::new()));
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

/// Positions of corners by panel, row and column, px.
type Positions = BTreeMap<(Option<u32>, i32, i32), DVec2>;

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

    /// Adds the next frame of the recording.
    pub fn add(&mut self, name: impl Into<String>, detection: Detection) {
        let positions = positions(&detection);
        let before = self.last.take();
        let moved = before.as_ref().and_then(|(_, others)| moved(&positions, others));
        let moved = moved.map(|px| px / self.every);
        if let Some((mut frame, others)) = before {
            frame.motion_px = larger(frame.motion_px, moved);
            self.keep(frame, others);
        }
        if positions.len() >= MIN_CORNERS {
            let motion_px = moved.unwrap_or(f64::INFINITY);
            let name = name.into();
            self.last = Some((Keyframe { name, detection, motion_px }, positions));
        }
    }

    /// Returns the frames in the order of the recording.
    pub fn finish(mut self) -> Vec<Keyframe> {
        if let Some((frame, positions)) = self.last.take() {
            self.keep(frame, positions);
        }
        self.kept
    }

    /// Adds a frame whose motion is known, or replaces one with more motion in the same stretch.
    fn keep(&mut self, frame: Keyframe, positions: Positions) {
        let spacing_px = self.spacing * f64::from(frame.detection.width);
        let is_new = moved(&positions, &self.anchor).is_none_or(|px| px > spacing_px);
        match self.kept.last_mut().filter(|_| !is_new) {
            Some(kept) if frame.motion_px < kept.motion_px => *kept = frame,
            Some(_) => {}
            None => {
                self.kept.push(frame);
                self.anchor = positions;
            }
        }
        if self.kept.len() > MAX_KEPT {
            self.kept = pairwise_stillest(std::mem::take(&mut self.kept));
            self.spacing *= 2.0;
        }
    }
}

/// Of each two successive frames, returns the one with less motion.
fn pairwise_stillest(frames: Vec<Keyframe>) -> Vec<Keyframe> {
    let mut stillest: Vec<Keyframe> = Vec::new();
    for (index, frame) in frames.into_iter().enumerate() {
        match stillest.last_mut().filter(|_| index % 2 == 1) {
            Some(other) if frame.motion_px < other.motion_px => *other = frame,
            Some(_) => {}
            None => stillest.push(frame),
        }
    }
    stillest
}

/// The larger of two displacements; either may be unknown.
fn larger(before_px: f64, after_px: Option<f64>) -> f64 {
    match after_px {
        Some(after_px) if before_px.is_finite() => before_px.max(after_px),
        Some(after_px) => after_px,
        None => before_px,
    }
}

fn positions(detection: &Detection) -> Positions {
    let corners = detection.grids.iter().flat_map(|grid| {
        let key = |row, col| (grid.panel, row, col);
        grid.corners.iter().map(move |corner| (key(corner.row, corner.col), corner.position()))
    });
    corners.collect()
}

/// The median displacement of common corners, px; `None` if there are none.
fn moved(one: &Positions, other: &Positions) -> Option<f64> {
    median(one.iter().filter_map(|(key, at)| Some(at.distance(*other.get(key)?))).collect())
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
            keyframes.add(index.to_string(), x.map_or_else(empty, |x| frame(index, x)));
        }
        let kept = keyframes.finish().into_iter();
        kept.map(|kept| (kept.detection.image.parse().unwrap(), kept.motion_px)).collect()
    }

    #[test]
    fn the_stillest_frame_of_each_position_is_kept() {
        let xs = [0.0, 8.0, 9.0, 9.5, 15.0, 60.0, 61.0, 61.5, 100.0].map(Some);
        assert_eq!(kept(xs), [(2, 1.0), (6, 1.0), (8, 38.5)]);
        // Frames without the target separate motions.
        assert_eq!(kept([Some(0.0), None, Some(50.0), Some(52.0)]), [(0, f64::INFINITY), (2, 2.0)]);
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
