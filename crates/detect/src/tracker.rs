//! Detection in the images of a video.

use super::detector::Detector;
use super::levels::{MIN_LEVEL_SIDE, levels_of};
use super::one_tiling::following::Track;
use super::one_tiling::{Frame, Search};
use deltille_core::detection::Detection;
use deltille_core::raster::{ImageView, Pyramid};

/// Detects targets in successive images of a video, in less than half of the time that single images take.
///
/// The corners are predicted from the last images, and refined there. Some of the tags, or the outline of an untagged
/// board, have to confirm their labels with the evidence that [`Detector`] requires. An image is searched like a single one
/// if that fails, if the model does not fit at every corner, if corners appear beside a board, and from time to time if not
/// all of the targets is visible. [`Grid::tags`](crate::Grid::tags) contains only the tags that were read in the image.
/// While no grid is in view, nine of ten images are not searched for boards that are strongly foreshortened, very small, or
/// have moved edges.
///
/// ```
/// use deltille_core::raster::Gray;
/// use deltille_core::targets::{BoardSpec, Target};
/// use deltille_detect::{Detector, Tracker};
///
/// let board = Target::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
/// let mut tracker = Tracker::new(Detector::new(&board)?);
/// for frame in 0..3 {
///     let image = Gray::<u8>::new(640, 480);
///     let detection = tracker.detect(&image, &format!("frame {frame}"));
///     assert!(detection.grids.is_empty() && !tracker.has_followed());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Tracker {
    detector: Detector,
    /// Tracks of the targets of each tiling; `None` for those without a grid.
    tracks: Vec<Option<Track>>,
    /// Width and height of the last image, px.
    size: [usize; 2],
    has_followed: bool,
    /// Number of images without a grid since the last one that was searched thoroughly.
    idle: usize,
}

/// Number of images without a grid of which one is searched thoroughly.
const THOROUGH_EVERY: usize = 10;

impl Tracker {
    /// Creates a tracker of the targets of a detector.
    pub fn new(detector: Detector) -> Self {
        Self { detector, tracks: Vec::new(), size: [0; 2], has_followed: false, idle: 0 }
    }

    /// Detects the targets in the next image. `name` is copied to the result.
    pub fn detect<'a>(&mut self, image: impl Into<ImageView<'a>>, name: &str) -> Detection {
        self.detect_view(image.into(), name)
    }

    /// Returns whether the grids of the last image were followed from the image before it, not searched for.
    pub fn has_followed(&self) -> bool {
        self.has_followed
    }

    /// Forgets the images so far. The next one is searched.
    pub fn reset(&mut self) {
        self.tracks.clear();
        self.idle = 0;
    }

    fn detect_view(&mut self, image: ImageView, name: &str) -> Detection {
        let size = [image.width(), image.height()];
        if size != std::mem::replace(&mut self.size, size) {
            self.reset();
        }
        let mut timing = self.detector.timing();
        let pyramid = Pyramid::new(image, levels_of(image), MIN_LEVEL_SIDE);
        timing.lap("pyramid");
        let frame = Frame { image, pyramid: &pyramid };
        let followed = self.detector.follow(frame, &self.tracks, name);
        self.has_followed = followed.is_some();
        let how = if self.idle == 0 { Search::Thorough } else { Search::Quick };
        let search = || self.detector.search(frame, how, &self.tracks, name);
        let (mut found, tracks) = followed.unwrap_or_else(search);
        self.idle = if found.grids.is_empty() { (self.idle + 1) % THOROUGH_EVERY } else { 0 };
        self.tracks = tracks;
        timing.add_to(&mut found.timing_ms);
        found
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::DVec3;

    use super::*;
    use deltille_core::camera::{Camera, Pose};
    use deltille_core::detection::GridCorner;
    use deltille_core::raster::Gray;
    use deltille_core::targets::BoardSpec;
    use deltille_layout::Printing;
    use deltille_layout::synth::{Light, scene_of_sheet};

    const SIZE: [u32; 2] = [800, 600];

    /// Renders a board from a camera that moves by these mm.
    fn video(board: &Printing, ways: &[DVec3]) -> Vec<Gray<u8>> {
        let sheets = board.draw().unwrap().sheets;
        let scene = scene_of_sheet(board, &sheets[0], 0);
        let camera = Camera::pinhole(SIZE[0], SIZE[1], 1.0);
        let shown = |(i, way): (usize, &DVec3)| {
            let middle = DVec3::new(90.0 + way.x, 70.0 + way.y, 0.0);
            let from = middle + DVec3::new(20.0 + way.z, -50.0, 330.0);
            let pose = Pose::looking_at(from, middle, DVec3::Y);
            let light = Light::default().noise(0.008).seed(i as u64);
            scene.render(&camera, &pose, &light).map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
        };
        ways.iter().enumerate().map(shown).collect()
    }

    fn tracker(board: &Printing) -> Tracker {
        Tracker::new(Detector::new(&board.target).unwrap())
    }

    fn corners(found: &Detection) -> BTreeMap<(Option<u32>, i32, i32), GridCorner> {
        let of_grids = found.grids.iter().flat_map(|grid| {
            grid.corners.iter().map(|corner| ((grid.panel, corner.row, corner.col), *corner))
        });
        of_grids.collect()
    }

    /// Follows the board while it moves smoothly, also after a jump by the distance of two corners or a sudden tilt, and finds
    /// what detection finds.
    #[test]
    fn corners_are_those_of_single_images() {
        let edge_mm = 20.0;
        let smooth = |i: f64| DVec3::new(30.0 * (i / 4.0).sin(), 20.0 * (i / 3.0).cos(), 0.0);
        let mut ways: Vec<DVec3> = (0..8).map(|i| smooth(i.into())).collect();
        ways.extend((8..12).map(|i| smooth(i.into()) + DVec3::new(edge_mm, 0.0, 0.0)));
        ways.extend(
            (12..16).map(|i| smooth(11.0) + DVec3::new(edge_mm, 0.0, f64::from(i % 2 * 60))),
        );
        for spec in [BoardSpec::deltille(7, 8, edge_mm), BoardSpec::checkerboard(7, 8, edge_mm)] {
            let board = Printing::new("board", spec).unwrap();
            let (mut tracker, images) = (tracker(&board), video(&board, &ways));
            let mut followed = Vec::new();
            for (i, image) in images.iter().enumerate() {
                let (found, alone) =
                    (tracker.detect(image, ""), tracker.detector.detect(image, ""));
                let (found, alone) = (corners(&found), corners(&alone));
                assert!(alone.len() > 40 && found.keys().eq(alone.keys()), "{i}");
                for (corner, other) in found.values().zip(alone.values()) {
                    let [xx, _, yy] = other.cov.unwrap();
                    let off_px = corner.position().distance(other.position());
                    assert!(off_px < 1.5 * (xx + yy).sqrt(), "{i}: {corner:?} {other:?}");
                }
                followed.push(tracker.has_followed());
            }
            assert!(!followed[0] && !followed[8], "{followed:?}");
            assert!(followed.iter().filter(|followed| **followed).count() >= 8, "{followed:?}");
        }
    }

    /// A board that disappears is not followed, and found again.
    #[test]
    fn a_board_that_is_gone_is_not_followed() {
        let board = Printing::new("board", BoardSpec::deltille(7, 8, 20.0)).unwrap();
        let (mut tracker, images) = (tracker(&board), video(&board, &[DVec3::ZERO; 4]));
        let empty = Gray::from_fn(SIZE[0] as usize, SIZE[1] as usize, |x, y| (x * 7 + y * 3) as u8);
        for (image, grids) in [(&images[0], 1), (&images[1], 1), (&empty, 0), (&images[2], 1)] {
            assert_eq!(tracker.detect(image, "").grids.len(), grids);
        }
        assert!(!tracker.has_followed());
        tracker.detect(&images[3], "");
        assert!(tracker.has_followed());
        tracker.reset();
        tracker.detect(&images[3], "");
        assert!(!tracker.has_followed());
    }

    /// A larger board in the place of another is not labelled, because corners appear beyond the border.
    #[test]
    fn a_larger_board_is_not_followed() {
        for shape in [BoardSpec::deltille, BoardSpec::checkerboard] {
            let board = |cols| {
                let spec = BoardSpec { tags: None, ..shape(7, cols, 20.0) };
                Printing::new("board", spec).unwrap()
            };
            let (small, large) = (board(8), board(9));
            // Both are printed in the middle of the page, so their corners are half an edge apart.
            for half_mm in [-10.0, 0.0, 10.0] {
                let mut tracker = tracker(&small);
                for image in video(&small, &[DVec3::ZERO; 3]) {
                    assert_eq!(tracker.detect(&image, "").grids.len(), 1);
                }
                assert!(tracker.has_followed());
                for image in video(&large, &[DVec3::new(half_mm, 0.0, 0.0); 3]) {
                    let found = tracker.detect(&image, "");
                    assert!(!tracker.has_followed());
                    assert!(found.grids.iter().all(|grid| grid.panel.is_none()));
                }
            }
        }
    }
}
