//! The stages in their order.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::clearance::TagAreas;
use super::corner_model::CornerFitter;
use super::detection::{DecodedTag, Detection, Grid, GridCorner};
use super::grow::{SaddleGrid, grids};
use super::label::{Labelled, TagLabeller};
use super::outline::{fit_outline, fit_rectangle};
use super::refine::{Refinement, Refiner};
use super::saddles::SaddleFinder;
use super::tiling::{CHECKER, DELTILLE, kind};
use crate::family::Family;
use crate::lattice::{GridKind, Vertex};
use crate::raster::{AnyGray, Gray, Intensity, Pyramid};
use crate::target::{Target, least_untagged_corners, zigzag_vertices};

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

/// How corners get absolute labels.
#[derive(Clone, Debug)]
enum Labels {
    /// They do not.
    None,
    /// By the outline of a board that is seen whole.
    Outline(BTreeSet<Vertex>),
    /// By the rows and columns of a checkerboard that is seen whole.
    Rectangle((u32, u32)),
    /// By the tags of a target, or by the outlines of its untagged panels.
    Target { tags: Option<TagLabeller>, panels: Vec<TargetPanel> },
}

/// What the detector must know of a panel.
#[derive(Clone, Debug)]
struct TargetPanel {
    id: u32,
    kind: GridKind,
    /// Rows and columns.
    size: (u32, u32),
    inverted: bool,
    tagged: bool,
    corner_ids: BTreeMap<Vertex, u32>,
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
        let labels = match (size, kind) {
            (Some((rows, cols)), GridKind::Deltille) => {
                Labels::Outline(zigzag_vertices(rows, cols).collect())
            }
            (Some(size), GridKind::Checker) => Labels::Rectangle(size),
            (None, _) => Labels::None,
        };
        let refiner = refiner(kind, config);
        Self { finder: Finder::of(kind), refiner, tag_areas: TagAreas::default(), labels }
    }

    /// A detector of a target, whose panels are of one kind; `family` is the family that the target
    /// names.
    ///
    /// An untagged panel is labelled where it is seen whole and nothing else of the target looks so;
    /// see [`Self::for_grid`] for which corner of a checkerboard is the first then.
    pub fn for_target(target: &Target, family: Option<&Family>, config: DetectorConfig) -> Self {
        let tags = family.and_then(|family| {
            let max_errors = config.max_bit_errors.unwrap_or(family.correctable());
            TagLabeller::new(target, family, max_errors)
        });
        let panels = target.panels.iter().map(|panel| TargetPanel {
            id: panel.id,
            kind: panel.kind,
            size: (panel.matrix[1], panel.matrix[0]),
            inverted: panel.inverted,
            tagged: !panel.tags.is_empty(),
            corner_ids: panel.corners.iter().map(|c| (Vertex::new(c.row, c.col), c.id)).collect(),
        });
        let labels = Labels::Target { tags, panels: panels.collect() };
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
            found.iter().flat_map(|grid| self.labelled_grids(image, grid)).collect();
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

    fn labelled_grids<T: Intensity>(&self, image: &Gray<T>, grid: &SaddleGrid) -> Vec<Grid> {
        match &self.labels {
            Labels::None => vec![unlabelled(grid)],
            Labels::Outline(outline) => match fit_outline(grid, outline, false) {
                Some(map) => {
                    vec![relabelled(grid, |v| Some((map.apply(v), None)), None, Vec::new())]
                }
                None => vec![unlabelled(grid)],
            },
            Labels::Rectangle(size) => match fit_rectangle(grid, *size, false) {
                Some(map) => {
                    vec![relabelled(grid, |v| Some((map.apply(v), None)), None, Vec::new())]
                }
                None => vec![unlabelled(grid)],
            },
            Labels::Target { tags, panels } => {
                let by_tags = tags.as_ref().map_or_else(Vec::new, |tags| tags.label(image, grid));
                if by_tags.is_empty() {
                    let by_outline = on_untagged_panel(grid, panels);
                    return vec![by_outline.unwrap_or_else(|| unlabelled(grid))];
                }
                // What hangs on to labelled panels without being part of one is not reported.
                by_tags.iter().map(|l| on_panel(grid, &panels[l.panel], l)).collect()
            }
        }
    }
}

impl Labels {
    /// Whether a grid that no tag vouches for has more corners than anything that is looked for: a
    /// halftone, a fabric or a tiled floor is as regular as a board, but seldom as small.
    fn exceeded_by(&self, grid: &Grid) -> bool {
        let most = match self {
            Self::None => usize::MAX,
            Self::Outline(outline) => outline.len(),
            Self::Rectangle((rows, cols)) => *rows as usize * *cols as usize,
            Self::Target { panels, .. } => {
                panels.iter().map(|panel| panel.corner_ids.len()).max().unwrap_or(0)
            }
        };
        grid.corners.len() > most
    }
}

/// Leaves out of grids of one panel what a larger one, which comes before, has already: beside a tag of
/// few pixels corners may be found twice, a pixel apart.
fn report_once(grids: &mut Vec<Grid>) {
    let (mut corners, mut tags) = (BTreeSet::new(), BTreeSet::new());
    grids.retain_mut(|grid| {
        if let Some(panel) = grid.panel {
            grid.corners.retain(|corner| corners.insert((panel, corner.row, corner.col)));
            grid.tags.retain(|tag| tags.insert((panel, tag.row, tag.col)));
        }
        !grid.corners.is_empty()
    });
}

fn refiner(kind: GridKind, config: DetectorConfig) -> Refiner {
    Refiner::with_radii(kind, config.refinement, POLYNOMIAL_RADIUS, MODEL_RADIUS)
}

fn unlabelled(grid: &SaddleGrid) -> Grid {
    relabelled(grid, |v| Some((v, None)), None, Vec::new())
}

fn on_panel(grid: &SaddleGrid, panel: &TargetPanel, labelled: &Labelled) -> Grid {
    let label = |v: Vertex| {
        let vertex = *labelled.vertices.get(&v)?;
        Some((vertex, panel.corner_ids.get(&vertex).copied()))
    };
    relabelled(grid, label, Some(panel.id), labelled.tags.clone())
}

/// The grid on the one untagged panel whose outline it fills.
fn on_untagged_panel(grid: &SaddleGrid, panels: &[TargetPanel]) -> Option<Grid> {
    let mut fitting = panels.iter().filter(|panel| !panel.tagged).filter_map(|panel| {
        let map = match panel.kind {
            GridKind::Deltille => {
                let outline = panel.corner_ids.keys().copied().collect();
                fit_outline(grid, &outline, panel.inverted)
            }
            GridKind::Checker => fit_rectangle(grid, panel.size, panel.inverted),
        };
        Some((panel, map?))
    });
    let (panel, map) = fitting.next()?;
    if fitting.next().is_some() {
        return None;
    }
    let label = |v| {
        let vertex = map.apply(v);
        Some((vertex, panel.corner_ids.get(&vertex).copied()))
    };
    Some(relabelled(grid, label, Some(panel.id), Vec::new()))
}

/// A grid with new labels, ordered by them; corners without a label are left out.
fn relabelled(
    grid: &SaddleGrid,
    label: impl Fn(Vertex) -> Option<(Vertex, Option<u32>)>,
    panel: Option<u32>,
    tags: Vec<DecodedTag>,
) -> Grid {
    let mut corners: Vec<GridCorner> = grid
        .iter()
        .filter_map(|(&vertex, placed)| {
            let (Vertex { row, col }, id) = label(vertex)?;
            let [x, y] = placed.position;
            Some(GridCorner { row, col, id, x, y, cov: None })
        })
        .collect();
    corners.sort_by_key(|corner| (corner.row, corner.col));
    Grid { kind: GridKind::Deltille, panel, corners, tags }
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
