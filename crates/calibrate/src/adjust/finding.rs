//! Findings: what outliers have in common, such as a panel, a view, or a region of the image.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::input::panel::PanelRef;
use crate::problem::bundle::Problem;

/// Outliers that have something in common.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// The common element.
    pub pattern: OutlierPattern,
    /// Number of outliers among its corners.
    pub outliers: usize,
    /// Number of all its corners.
    pub corners: usize,
    /// Whether all of them were excluded from the calibration.
    pub is_excluded: bool,
}

/// The element that outliers have in common.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum OutlierPattern {
    /// They lie far outside their image.
    OutsideImage {
        /// Index of the camera.
        camera: usize,
        /// Name of the view.
        view: String,
    },
    /// A panel of the target, in all views.
    Panel {
        /// The panel.
        panel: PanelRef,
        /// Its displacement, if that explains the outliers.
        moved: Option<Moved>,
    },
    /// A panel in one image.
    PanelInView {
        /// The panel.
        panel: PanelRef,
        /// Index of the camera.
        camera: usize,
        /// Name of the view.
        view: String,
        /// Median residual of its corners, px.
        off_px: f64,
    },
    /// An image.
    View {
        /// Index of the camera.
        camera: usize,
        /// Name of the view.
        view: String,
    },
    /// A region of the image, in several views.
    Region {
        /// Index of the camera.
        camera: usize,
        /// Its upper left corner, px.
        from_px: DVec2,
        /// Its lower right corner, px.
        to_px: DVec2,
    },
    /// A corner of a measured target.
    Corner {
        /// The panel.
        panel: PanelRef,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// RMS residual per axis of all its observations, px.
        rms_px: f64,
        /// Whether these are observations in held-out views.
        is_held_out: bool,
    },
    /// The measured offset of a corner, among those of all corners.
    Offset {
        /// The panel.
        panel: PanelRef,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Its length, mm.
        offset_mm: f64,
    },
    /// A camera of a rig.
    Camera {
        /// Index of the camera.
        camera: usize,
    },
}

/// The displacement of a panel from its stated pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Moved {
    /// Distance of its centre from the stated position, mm.
    pub by_mm: f64,
    /// Angle between its orientation and the stated one, rad.
    pub rotation_rad: f64,
}

/// Minimum number of outliers for a finding; fewer may coincide randomly.
const MIN_OUTLIERS: usize = 6;

/// Minimum fraction of outliers among the corners of a finding.
const MOST: f64 = 0.5;

/// Maximum fraction of outliers among the other corners, relative to that fraction.
const ELSEWHERE: f64 = 0.5;

/// Minimum excess of outliers, in standard deviations of the count. Noise exceeds it less than once
/// in a million groups.
const SIGNIFICANT: f64 = 5.0;

/// Number of cells along the longer side of the image in which outliers are counted.
const CELLS: f64 = 8.0;

/// Minimum number of views with outliers in a region of the image.
const MIN_VIEWS: usize = 3;

/// Index of a camera, and a cell of its image.
type Cell = (usize, [i32; 2]);

/// Numbers of outliers and of corners.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Count {
    pub outliers: usize,
    pub corners: usize,
}

impl Count {
    pub(crate) fn add(&mut self, outlier: bool) {
        self.corners += 1;
        self.outliers += usize::from(outlier);
    }

    /// The sum of both.
    pub(crate) fn with(self, other: Self) -> Self {
        let (outliers, corners) = (self.outliers + other.outliers, self.corners + other.corners);
        Self { outliers, corners }
    }

    pub(crate) fn share(self) -> f64 {
        self.outliers as f64 / self.corners.max(1) as f64
    }

    /// Whether most of these corners are outliers, but few of the other corners in `all` are.
    pub(super) fn stands_out(self, all: Count) -> bool {
        let others =
            Count { outliers: all.outliers - self.outliers, corners: all.corners - self.corners };
        self.exceeds(others)
            && self.share() >= MOST
            && others.corners > 0
            && others.share() <= ELSEWHERE * self.share()
    }

    /// Whether the fraction of outliers is significantly larger than that among the others.
    pub(super) fn exceeds(self, others: Count) -> bool {
        let (count, chance) = (self.corners as f64, others.share());
        let more = count * (self.share() - chance);
        self.outliers >= MIN_OUTLIERS
            && more > SIGNIFICANT * (count * chance * (1.0 - chance)).sqrt()
    }
}

/// Finds what the outliers among the used corners of a problem have in common; `names` gives the names of frames.
pub(super) fn shared_outliers(
    problem: &Problem,
    outliers: &[Vec<bool>],
    left_out: &[bool],
    names: impl Fn(usize) -> String,
) -> Vec<Finding> {
    let mut all = Count::default();
    let mut cameras: BTreeMap<usize, Count> = BTreeMap::new();
    let mut views: BTreeMap<(usize, usize), Count> = BTreeMap::new();
    let mut cells: BTreeMap<Cell, (Count, BTreeSet<usize>)> = BTreeMap::new();
    let taking_part = problem.blocks.iter().zip(outliers).zip(left_out);
    for ((block, outliers), _) in taking_part.filter(|(_, left_out)| !**left_out) {
        let camera = &problem.cameras[block.camera].camera;
        let cell_px = f64::from(camera.width.max(camera.height)) / CELLS;
        let corners = block.observations.iter().zip(problem.residuals(block));
        for ((corner, off), &outlier) in corners.zip(outliers) {
            all.add(outlier);
            cameras.entry(block.camera).or_default().add(outlier);
            views.entry((block.camera, block.frame)).or_default().add(outlier);
            // Uses the predicted position, because wrong detected positions may be anywhere.
            let Some(off) = off else { continue };
            let cell = ((corner.pixel - off) / cell_px).floor().as_ivec2().to_array();
            let (count, of_views) = cells.entry((block.camera, cell)).or_default();
            count.add(outlier);
            if outlier {
                of_views.insert(block.frame);
            }
        }
    }
    let finding = |pattern: OutlierPattern, count: Count| Finding {
        pattern,
        outliers: count.outliers,
        corners: count.corners,
        is_excluded: false,
    };
    cameras.retain(|_, count| count.stands_out(all));
    let mut found: Vec<Finding> = cameras
        .iter()
        .map(|(&camera, &count)| finding(OutlierPattern::Camera { camera }, count))
        .collect();
    for (&(camera, frame), &count) in views.iter().filter(|(_, count)| count.stands_out(all)) {
        if !cameras.contains_key(&camera) {
            found.push(finding(OutlierPattern::View { camera, view: names(frame) }, count));
        }
    }
    // Merge the conspicuous cells of a camera into one rectangle.
    let mut regions: BTreeMap<usize, (Count, [i32; 2], [i32; 2])> = BTreeMap::new();
    for (&(camera, cell), (count, of_views)) in &cells {
        let is_of_image = of_views.len() >= MIN_VIEWS && !cameras.contains_key(&camera);
        if is_of_image && count.stands_out(all) {
            let (sum, from, to) = regions.entry(camera).or_insert((Count::default(), cell, cell));
            sum.outliers += count.outliers;
            sum.corners += count.corners;
            *from = [0, 1].map(|i| from[i].min(cell[i]));
            *to = [0, 1].map(|i| to[i].max(cell[i]));
        }
    }
    for (camera, (count, from, to)) in regions {
        let Some(unknowns) = problem.cameras.get(camera) else { continue };
        let (width, height) = (unknowns.camera.width, unknowns.camera.height);
        let cell_px = f64::from(width.max(height)) / CELLS;
        let size = DVec2::new(width.into(), height.into());
        let from_px = DVec2::from(from.map(|cell| f64::from(cell.max(0)))) * cell_px;
        let to_px = (DVec2::from(to.map(|cell| f64::from(cell + 1))) * cell_px).min(size);
        found.push(finding(OutlierPattern::Region { camera, from_px, to_px }, count));
    }
    found
}
