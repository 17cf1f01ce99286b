//! Coverage of the views of a camera: corners and mean residuals by cell of the image, and the tilt and the distance of each
//! view.
//!
//! ```text
//!     mean of a cell  m = Σ r / n        r: residuals (observed minus predicted) of its n inliers, px
//!     its std. dev.   s = √( Σ |r − m|² / 2(n − 1) / n )              of each coordinate, px
//! ```
//!
//! If residuals are noise, m / s is of the order of 1 in every cell. If the model does not describe the lens, means are larger
//! and neighbouring means have similar directions.

use glam::{DVec2, DVec3};

use deltille_calibrate::{CameraEstimate, ImageCircle, ViewEstimate};
use deltille_core::camera::{Camera, Pose};

/// Number of cells of the maps along the longer side of the image; cells are nearly square.
const CELLS: usize = 16;

/// Statistics of the views of a camera: coverage of the image, mean residuals, tilts and distances.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Survey {
    /// Width and height of the image, px.
    pub size_px: DVec2,
    /// Number of columns and of rows of the maps.
    pub cells: [usize; 2],
    /// Number of corners in each cell, outliers included, row by row from the upper left.
    pub counts: Vec<usize>,
    /// Mean residual of each cell and its standard deviation, px, in the order of `counts`; `None`
    /// in cells with fewer than four inliers.
    pub means_px: Vec<Option<CellMean>>,
    /// Tilt and distance of each view, in the order of the camera's views.
    pub views: Vec<SurveyedView>,
    /// Whether this camera saw only the first panel, so the target is planar for it.
    pub planar: bool,
    /// Image circle of the lens; `None` if it fills the image.
    pub circle: Option<ImageCircle>,
}

/// The mean residual of a cell, without outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CellMean {
    /// Mean, px.
    pub mean_px: DVec2,
    /// Standard deviation of each coordinate of the mean, px.
    pub sd_px: f64,
}

/// Tilt and distance of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SurveyedView {
    /// Angle between the board's normal and the line of sight to the middle of its corners, rad;
    /// `None` for solids.
    pub tilt_rad: Option<f64>,
    /// Direction in the image in which the tilted board is farther away, rad, from right towards down; `None` for solids.
    pub tilt_direction_rad: Option<f64>,
    /// Distance of the origin of the target from the camera, mm.
    pub distance_mm: f64,
}

/// Minimum number of inliers for a mean: with fewer, the standard deviation is unreliable.
const MIN_IN_CELL: usize = 4;

impl Survey {
    /// Computes the statistics of the views of a camera that the calibration used.
    pub fn new(camera: &CameraEstimate) -> Self {
        let size_px = DVec2::new(camera.camera.width.into(), camera.camera.height.into());
        let cells = (size_px / (size_px.max_element() / CELLS as f64)).round().to_array();
        let cells = cells.map(|count| (count as usize).max(1));
        let mut inside: Vec<Vec<DVec2>> = vec![Vec::new(); cells[0] * cells[1]];
        let mut counts = vec![0; inside.len()];
        for corner in camera.corners() {
            let at = |axis: usize| {
                let part = (corner.pixel[axis] + 0.5) / size_px[axis];
                ((part * cells[axis] as f64).max(0.0) as usize).min(cells[axis] - 1)
            };
            let index = at(1) * cells[0] + at(0);
            counts[index] += 1;
            if !corner.outlier {
                inside[index].push(corner.residual);
            }
        }
        let planar = camera.corners().all(|corner| corner.panel.index() == 0);
        let views =
            camera.views.iter().map(|view| surveyed(&camera.camera, view, planar)).collect();
        let means_px = inside.iter().map(|residuals| cell_mean(residuals)).collect();
        let seen: Vec<DVec2> = camera.corners().map(|corner| corner.pixel).collect();
        let circle = ImageCircle::of(&camera.camera, &seen);
        Self { size_px, cells, counts, means_px, views, planar, circle }
    }

    /// Fraction of the cells of the image, or of its image circle, that contain corners.
    pub fn covered(&self) -> f64 {
        let [columns, rows] = self.cells;
        let is_shown = |index: usize| {
            let [column, row] = [index % columns, index / columns].map(|v| v as f64 + 0.5);
            let cells = DVec2::new(columns as f64, rows as f64);
            let place = DVec2::new(column, row) * self.size_px / cells - 0.5;
            self.circle.is_none_or(|circle| circle.radius_of(place) <= circle.radius_px)
        };
        let shown: Vec<usize> = (0..self.counts.len()).filter(|&index| is_shown(index)).collect();
        let covered = shown.iter().filter(|&&index| self.counts[index] > 0).count();
        covered as f64 / shown.len().max(1) as f64
    }

    /// Distance of the outermost corner from the image centre, as a fraction of half the diagonal; or
    /// from the centre of the image circle, as a fraction of its radius.
    pub fn reach(&self, camera: &CameraEstimate) -> f64 {
        let size = self.size_px;
        let whole =
            ImageCircle { centre_px: size / 2.0 - 0.5, radius_px: size.x.hypot(size.y) / 2.0 };
        let circle = self.circle.unwrap_or(whole);
        let radii = camera.corners().map(|corner| circle.radius_of(corner.pixel));
        radii.fold(0.0, f64::max) / circle.radius_px
    }

    /// RMS of the mean residuals of cells in units of their standard deviations: 1 if residuals are
    /// random, more if the model has lack of fit. `None` if no cell has a mean.
    pub fn pattern(&self) -> Option<f64> {
        let seen: Vec<f64> = self
            .means_px
            .iter()
            .flatten()
            .map(|cell| (cell.mean_px / cell.sd_px).length_squared() / 2.0)
            .collect();
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        (!seen.is_empty()).then_some(mean.sqrt())
    }
}

/// Mean of the residuals of a cell, px, with its standard deviation; `None` if there are too few, or if all are equal.
fn cell_mean(residuals: &[DVec2]) -> Option<CellMean> {
    if residuals.len() < MIN_IN_CELL {
        return None;
    }
    let n = residuals.len() as f64;
    let mean_px = residuals.iter().sum::<DVec2>() / n;
    let squares = residuals.iter().map(|r| r.distance_squared(mean_px));
    let variance = squares.sum::<f64>() / (2.0 * (n - 1.0));
    let sd_px = (variance / n).sqrt();
    (sd_px > 0.0).then_some(CellMean { mean_px, sd_px })
}

/// Tilt and distance of a view. The tilt is `None` if the target is not planar, or if the lens has no ray for the mean
/// position of the corners.
fn surveyed(camera: &Camera, view: &ViewEstimate, planar: bool) -> SurveyedView {
    let count = view.corners.len().max(1) as f64;
    let middle = view.corners.iter().map(|corner| corner.pixel).sum::<DVec2>() / count;
    let lean = lean(camera, &view.pose, middle).filter(|_| planar);
    SurveyedView {
        tilt_rad: lean.map(|[tilt, _]| tilt),
        tilt_direction_rad: lean.map(|[_, away]| away),
        distance_mm: view.pose.translation.length(),
    }
}

/// The angle between the normal of a board and the line of sight to an image position, and the direction in the image in
/// which the board is farther away, rad; `None` if the lens has no ray there.
fn lean(camera: &Camera, pose: &Pose, place: DVec2) -> Option<[f64; 2]> {
    let normal = pose.rotation * DVec3::Z;
    let ray = camera.unproject(place)?;
    let (sight, distance) = (ray.direction, pose.translation.length());
    // The normal of a board that faces the camera is opposite to the line of sight. The board leans to its far side.
    let leant = normal.reject_from_normalized(sight);
    let at = |direction: DVec3| camera.project(ray.origin + distance * direction);
    let step = at(sight + STEP * leant)? - at(sight)?;
    Some([normal.angle_between(-sight), step.to_angle()])
}

/// Step across the line of sight, as a fraction of the distance; short relative to the curvature of any lens.
const STEP: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use deltille_calibrate::{Guide, Model};
    use deltille_core::targets::{BoardSpec, Target};

    use super::*;

    #[test]
    fn boards_lean_as_the_guide_requested() {
        let board = Target::new("desk", BoardSpec::deltille(9, 12, 20.0)).unwrap();
        for model in [Model::Radtan5, Model::KannalaBrandt(4)] {
            let guide = Guide::new(&board, [1280, 720], model).unwrap();
            for taken in 0..9 {
                let next = guide.next(taken, None);
                let place = next.at * DVec2::new(1280.0, 720.0) - 0.5;
                let [tilt, away] = lean(&next.camera, &next.camera_from_target, place).unwrap();
                assert!((tilt - next.tilt_rad).abs() < 1e-6, "{tilt} {}", next.tilt_rad);
                if next.tilt_rad > 0.0 {
                    let off = DVec2::from_angle(away)
                        .angle_to(DVec2::from_angle(next.tilt_direction_rad));
                    assert!(off.abs() < 0.02, "{away} {}", next.tilt_direction_rad);
                }
            }
        }
    }
}
