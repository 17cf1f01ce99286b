//! The stages in their order.

use std::collections::BTreeMap;
use std::time::Instant;

use super::clearance::TagAreas;
use super::corner_model::CornerFitter;
use super::detection::{Detection, Grid};
use super::grow::grids;
use super::labels::{Labels, report_once};
use super::refine::{Refinement, Refiner};
use super::saddles::SaddleFinder;
use super::tiling::{CHECKER, DELTILLE, kind};
use crate::family::Family;
use crate::lattice::GridKind;
use crate::raster::{AnyGray, Gray, Intensity, Pyramid};
use crate::target::{Target, least_untagged_corners};

/// Levels of the pyramid: the coarsest sees four times the blur that the finest can.
const PYRAMID_LEVELS: usize = 3;

/// A level narrower than this shows no grid.
const MIN_LEVEL_SIDE: usize = 24;

/// The median edge of a grid that no tag vouches for is no shorter than this, px. Blur leaves nothing
/// of smaller tiles but their fundamental wave, and that is the same for squares, dots and threads.
const MIN_UNTAGGED_EDGE_PX: f64 = 7.0;

/// Nor is its blur a larger part of the edge. It leaves less than a tenth of the next wave, and in the
/// wave by itself the model reads a blur of 0.25 of the edge, of three waves 0.155.
const fn max_untagged_blur(kind: GridKind) -> f64 {
    match kind {
        GridKind::Deltille => 0.14,
        GridKind::Checker => 0.2,
    }
}

/// Options of a detector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectorConfig {
    /// Most bits of a tag that may be corrected; `None` for ⌊(h − 1)/2⌋ of its family.
    pub max_bit_errors: Option<u32>,
    /// Whether grids seen as in a mirror get labels too. They are those of the print, and belong to no
    /// camera that looks at it: use them only to find out what was mirrored.
    pub allow_mirrored: bool,
    /// How the positions of corners are refined.
    pub refinement: Refinement,
}

/// Radius of the polynomial that refines, px: the reference detector's.
const POLYNOMIAL_RADIUS: usize = 3;

/// Largest radius of the model that refines, px: beyond, lenses bend edges more than a wider
/// window gains.
const MODEL_RADIUS: usize = 10;

/// Finds grids in images and labels their corners.
///
/// ```
/// use deltille::detect::{Detector, DetectorConfig};
/// use deltille::raster::Gray;
/// use deltille::target::GridKind;
///
/// let detector = Detector::for_grid(GridKind::Deltille, Some((10, 11)), DetectorConfig::default());
/// let detection = detector.detect(&Gray::<u8>::new(640, 480), "black.png");
/// assert!(detection.grids.is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Detector {
    finder: Finder,
    refiner: Refiner,
    /// Where tiles show something else than their colour.
    tag_areas: TagAreas,
    labels: Labels,
}

/// Finds the corners of a tiling.
#[derive(Clone, Debug)]
enum Finder {
    Deltille(SaddleFinder<DELTILLE>),
    Checker(SaddleFinder<CHECKER>),
}

impl Finder {
    fn of(kind: GridKind) -> Self {
        match kind {
            GridKind::Deltille => Self::Deltille(SaddleFinder::new()),
            GridKind::Checker => Self::Checker(SaddleFinder::new()),
        }
    }
}

impl Detector {
    /// A detector of grids whatever they belong to.
    ///
    /// With `size`, the rows and columns of corners of a zigzag board or of a checkerboard, a grid
    /// that shows the whole board is labelled from its lower left corner; all other grids have
    /// relative labels. On a checkerboard that is the corner whose upper right square is dark when
    /// the print is turned so that it is the lower left one. A board whose rows + columns is even
    /// looks the same after half a turn; the lowest such corner in the image is then taken.
    pub fn for_grid(kind: GridKind, size: Option<(u32, u32)>, config: DetectorConfig) -> Self {
        let labels = Labels::of_size(kind, size, &config);
        let refiner = refiner(kind, config);
        Self { finder: Finder::of(kind), refiner, tag_areas: TagAreas::default(), labels }
    }

    /// A detector of a target, whose panels are of one kind; `family` is the family that the target
    /// names.
    ///
    /// An untagged panel is labelled where it is seen whole and nothing else of the target looks so;
    /// see [`Self::for_grid`] for which corner of a checkerboard is the first then.
    pub fn for_target(target: &Target, family: Option<&Family>, config: DetectorConfig) -> Self {
        let labels = Labels::of_target(target, family, &config);
        let tag_areas = family.map(|family| TagAreas::of(target, family)).unwrap_or_default();
        let kind = target.panels.first().map_or(GridKind::Deltille, |panel| panel.kind);
        Self { finder: Finder::of(kind), refiner: refiner(kind, config), tag_areas, labels }
    }

    /// Finds grids in one image; `name` is only noted in the result.
    pub fn detect<T: Intensity>(&self, image: &Gray<T>, name: &str) -> Detection {
        match &self.finder {
            Finder::Deltille(finder) => self.detect_with(finder, image, name),
            Finder::Checker(finder) => self.detect_with(finder, image, name),
        }
    }

    fn detect_with<const N: usize, T: Intensity>(
        &self,
        finder: &SaddleFinder<N>,
        image: &Gray<T>,
        name: &str,
    ) -> Detection {
        let mut timing = Timing::start();
        let pyramid = Pyramid::new(image, PYRAMID_LEVELS, MIN_LEVEL_SIDE);
        timing.lap("pyramid");
        let saddles = finder.find(&pyramid);
        timing.lap("saddles");
        let found = grids(finder, &pyramid, &saddles);
        timing.lap("grids");
        let mut grids: Vec<Grid> =
            found.iter().flat_map(|grid| self.labels.label(image, grid)).collect();
        grids.iter_mut().for_each(|grid| grid.kind = kind::<N>());
        let least = least_untagged_corners(kind::<N>()) as usize;
        grids.retain(|grid| {
            let plausible = grid.corners.len() >= least && !self.labels.exceeded_by(grid);
            !grid.tags.is_empty()
                || plausible && grid.edge_px().unwrap_or(0.0) >= MIN_UNTAGGED_EDGE_PX
        });
        report_once(&mut grids);
        // Labelled grids by panel, then the others; a stable sort keeps the largest first.
        grids.sort_by_key(|grid| grid.panel.unwrap_or(u32::MAX));
        timing.lap("labels");
        let mut fitter = CornerFitter::default();
        grids.retain_mut(|grid| {
            let edge_px = grid.edge_px().unwrap_or(0.0);
            let images = (image, &pyramid);
            let blur_px = self.refiner.refine_grid(&mut fitter, images, grid, &self.tag_areas);
            let is_wave =
                blur_px.is_some_and(|blur_px| blur_px > max_untagged_blur(kind::<N>()) * edge_px);
            !grid.tags.is_empty() || grid.corners.len() >= least && !is_wave
        });
        timing.lap("refine");
        Detection {
            image: name.to_owned(),
            width: image.width() as u32,
            height: image.height() as u32,
            grids,
            timing_ms: timing.laps,
        }
    }

    /// [`Self::detect`] for an image of either depth.
    pub fn detect_any(&self, image: &AnyGray, name: &str) -> Detection {
        match image {
            AnyGray::U8(image) => self.detect(image, name),
            AnyGray::U16(image) => self.detect(image, name),
        }
    }
}

fn refiner(kind: GridKind, config: DetectorConfig) -> Refiner {
    Refiner::with_radii(kind, config.refinement, POLYNOMIAL_RADIUS, MODEL_RADIUS)
}

/// Stopwatch of the stages.
struct Timing {
    last: Instant,
    laps: BTreeMap<String, f64>,
}

impl Timing {
    fn start() -> Self {
        Self { last: Instant::now(), laps: BTreeMap::new() }
    }

    fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        self.laps.insert(stage.to_owned(), (now - self.last).as_secs_f64() * 1e3);
        self.last = now;
    }
}
