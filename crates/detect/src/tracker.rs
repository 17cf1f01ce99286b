//! Detection in the images of a video.

use super::detector::Detector;
use super::levels::{MIN_LEVEL_SIDE, levels_of};
use super::one_tiling::Frame;
use super::one_tiling::following::Track;
use deltille_core::detection::Detection;
use deltille_core::raster::{ImageView, Pyramid};

/// Detects targets in successive images of a video, several times as fast as in single images.
///
/// The corners are predicted from the last images, and refined there. Some of the tags, or the outline of an untagged
/// board, have to confirm their labels with the evidence that [`Detector`] requires. If that fails, if more of a target
/// comes into view, and from time to time if not all of it is visible, the image is searched like a single one. Corners agree
/// with those of [`Detector`] within a fraction of their standard deviations. [`Grid::tags`](crate::Grid::tags) contains
/// only the tags that were read again.
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
}

impl Tracker {
    /// Creates a tracker of the targets of a detector.
    pub fn new(detector: Detector) -> Self {
        Self { detector, tracks: Vec::new(), size: [0; 2], has_followed: false }
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
        let (mut found, tracks) =
            followed.unwrap_or_else(|| self.detector.search(frame, &self.tracks, name));
        self.tracks = tracks;
        timing.add_to(&mut found.timing_ms);
        found
    }
}
