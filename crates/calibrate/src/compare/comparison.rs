//! Comparison of the projections of two calibrations of one camera.
//!
//! The direction of a pixel in the first camera is projected by the second camera, after the motion that minimises the
//! difference: a shifted principal point and a rotated camera have the same effect in an image. The remaining
//! difference is compared with its expectation from the covariances of both,
//!
//! ```text
//!     d = (I − P) (J_B δθ_B − J_A δθ_A)        P: what the motion explains
//!     |d|² / Σᵢ (λᵢ + ε²)                       λᵢ: variances of d in independent directions
//! ```
//!
//! with d over all positions in the region, and ε the best accuracy of any calibration. The test
//! statistic is the ratio of the two reported numbers. Covariances from few frames are too
//! uncertain in single directions to test each direction.
//!
//! Both calibrations are assumed to use the same board, so the effect of its errors on both does
//! not count as a difference.

use std::collections::BTreeMap;

use glam::{DQuat, DVec2, DVec3};
use nalgebra::{DMatrix, DVector};

use crate::estimate::coverage::Coverage;
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::uncertainty::projection::{
    INFINITY_MM, ObservedCovariance, Source, by_motion, by_parameters, seen_at,
};
use deltille_core::camera::Pose;
use deltille_core::setting::Setting::{CompareBoardsAssumeTarget, RegionImage};
use deltille_core::statistics::{chi_squared_p_value, f_p_value};
use deltille_core::targets::{check_result_of, check_same_board};

/// Number of grid positions along the longer side of the image.
const POSITIONS: usize = 40;

/// Minimum number of corners in a cell and its neighbours for a cell to count as covered, because
/// single corners at the border of an image carry little information.
const AROUND: usize = 5;

/// Maximum number of iterations for the motion, and the change at which it has converged.
const MAX_STEPS: usize = 50;
const SAME_PX: f64 = 1e-9;

/// Minimum standard deviation of a calibration, px: neither lens nor sensor follows its model
/// exactly.
const MIN_SD_PX: f64 = 1e-3;

/// Significance level of the test that the camera has changed.
const SELDOM: f64 = 1e-3;

/// The region of the image in which two cameras are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Region {
    /// The area where both detected corners; the whole image if that area is not known.
    #[default]
    Seen,
    /// The whole image.
    Image,
    /// The rectangle between two pixels.
    Within(DVec2, DVec2),
}

/// The difference between two cameras; by default without any positions.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Distance of the compared points; `None` for points at infinity.
    pub distance_mm: Option<f64>,
    /// Number of grid positions along a row of the image.
    pub columns: usize,
    /// The difference of the second camera from the first, row by row; `None` beyond the field of
    /// view of either lens.
    pub positions: Vec<Option<Difference>>,
    /// The motion from the view of the first camera to that of the second: a rotation, and for points that are not at
    /// infinity a translation.
    pub second_from_first: Pose,
    /// RMS difference per axis in the region, px.
    pub rms_px: f64,
    /// The RMS difference expected from the uncertainties of both; `None` if they are not known.
    pub expected_px: Option<f64>,
    /// Probability that an unchanged camera shows a difference at least this large.
    pub p_value: Option<f64>,
    /// Whether the uncertainty of the first and of the second camera is missing.
    pub lacks_uncertainty: [bool; 2],
}

/// The difference of the second camera at a pixel of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// The pixel of the first camera.
    pub pixel: DVec2,
    /// Offset of the pixel of the second camera, px.
    pub by: DVec2,
    /// Standard deviation per axis of the offset from the uncertainties of both, px.
    pub sd_px: Option<f64>,
    /// Whether the pixel is in the region.
    pub is_compared: bool,
}

/// Why two cameras cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// The images differ in size.
    #[error(
        "the image sizes differ ({} × {} px and {} × {} px): compare two calibrations of one camera at one image size", first[0], first[1], second[0], second[1]
    )]
    Sizes {
        /// Image size of the first camera.
        first: [u32; 2],
        /// Image size of the second camera.
        second: [u32; 2],
    },
    /// The areas covered by both cameras overlap too little.
    #[error(
        "the region is too small, or the calibrations saw too little of the image in common: use {RegionImage}, or a larger region"
    )]
    Nothing,
}

impl Default for Comparison {
    fn default() -> Self {
        Self {
            distance_mm: None,
            columns: 0,
            positions: Vec::new(),
            second_from_first: Pose::IDENTITY,
            rms_px: 0.0,
            expected_px: None,
            p_value: None,
            lacks_uncertainty: [false; 2],
        }
    }
}

/// Prepares two calibrations for comparison. Calibrations with the same board share its errors, so
/// these do not count. Calibrations with different boards share no errors. `what` names the two in
/// messages; `assume_target` compares them regardless of their boards.
///
/// # Errors
/// Returns an error if their boards have the same tags at different sizes, because at most one of
/// the sizes is right.
pub fn compare_boards(
    what: [&str; 2],
    [first, second]: [&mut Estimate; 2],
    assume_target: bool,
) -> Result<(), String> {
    let boards = [first.calibrated_with.as_slice(), second.calibrated_with.as_slice()];
    if !assume_target {
        check_same_board(what, boards).map_err(|problem| {
            format!(
                "{problem}; calibrate both with the right description, or set {CompareBoardsAssumeTarget} to compare \
                 them anyway"
            )
        })?;
    }
    if check_result_of(boards[0], boards[1]).is_err() {
        let cameras = first.cameras.iter_mut().chain(&mut second.cameras);
        let known = cameras.filter_map(|camera| camera.projection.as_mut());
        known.filter_map(|known| known.observed.as_mut()).for_each(|known| known.of_board = None);
    }
    Ok(())
}

impl Comparison {
    /// Compares two cameras with points at a distance, or at infinity.
    ///
    /// # Errors
    /// Returns an error if the images differ in size, or no part of them is compared.
    pub fn of(
        first: &CameraEstimate,
        second: &CameraEstimate,
        distance_mm: Option<f64>,
        region: Region,
    ) -> Result<Self, ComparisonError> {
        let size = |of: &CameraEstimate| [of.camera.width, of.camera.height];
        if size(first) != size(second) {
            return Err(ComparisonError::Sizes { first: size(first), second: size(second) });
        }
        let grid = Grid::new(size(first));
        let compared = grid.compared(first, second, region);
        let positions: Vec<Option<Place>> = (0..grid.columns * grid.rows)
            .map(|index| {
                let pixel = grid.pixel(index);
                let point = seen_at(&first.camera, pixel, distance_mm)?;
                let is_compared = compared(index);
                second.camera.project(point).map(|_| Place { pixel, point, is_compared })
            })
            .collect();
        let used: Vec<&Place> =
            positions.iter().flatten().filter(|place| place.is_compared).collect();
        if used.len() < MIN_POSITIONS {
            return Err(ComparisonError::Nothing);
        }
        let motion = aligned(second, &used, distance_mm);
        let known = Known::of(first, second, &used, &motion, distance_mm);
        let differences = positions.iter().map(|place| {
            let Place { pixel, point, is_compared } = *place.as_ref()?;
            let by = second.camera.project(motion.apply(point))? - pixel;
            let sd_px = known.as_ref().and_then(|known| known.sd_px(first, second, &motion, point));
            Some(Difference { pixel, by, sd_px, is_compared })
        });
        let differences: Vec<Option<Difference>> = differences.collect();
        let inside = || differences.iter().flatten().filter(|place| place.is_compared);
        let squares: f64 = inside().map(|place| place.by.length_squared()).sum();
        let second_from_first = match distance_mm {
            Some(_) => motion,
            None => Pose { translation: DVec3::ZERO, ..motion },
        };
        Ok(Self {
            distance_mm,
            columns: grid.columns,
            rms_px: (squares / (2.0 * inside().count() as f64)).sqrt(),
            expected_px: known.as_ref().map(|known| known.expected_px),
            p_value: known.as_ref().map(|known| known.p_value),
            positions: differences,
            second_from_first,
            lacks_uncertainty: [first, second].map(|of| half_of(of).is_none()),
        })
    }

    /// The compared positions.
    pub fn compared(&self) -> impl Iterator<Item = &Difference> {
        self.positions.iter().flatten().filter(|place| place.is_compared)
    }

    /// The largest difference at a compared position, px.
    pub fn largest_px(&self) -> f64 {
        self.compared().map(|place| place.by.length()).fold(0.0, f64::max)
    }

    /// Whether the cameras differ by more than their uncertainties explain; `None` if these are not known.
    pub fn is_significant(&self) -> Option<bool> {
        self.p_value.map(|p_value| p_value < SELDOM)
    }
}

/// The motion of a camera of a rig relative to another camera.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraMotion {
    /// The reference camera.
    pub from: String,
    /// The moved camera.
    pub to: String,
    /// Rotation about its axes, rad.
    pub rotation_rad: DVec3,
    /// Translation along its axes, mm.
    pub translation_mm: DVec3,
    /// Probability of a motion at least this large if nothing has moved; `None` if standard
    /// deviations are not known.
    pub p_value: Option<f64>,
}

impl CameraMotion {
    /// Returns the motions of the cameras of a rig. They are relative to the first camera that
    /// defines the rig frame in both calibrations, or to the first camera if there is none. `pairs`
    /// are the same cameras in both.
    pub fn of_rig(pairs: &[(&CameraEstimate, &CameraEstimate)]) -> Vec<Self> {
        let is_rig = |(a, b): &&(&CameraEstimate, &CameraEstimate)| {
            [a, b].iter().all(|camera| camera.pose_sd.is_none())
        };
        let Some(&(first, second)) = pairs.iter().find(is_rig).or(pairs.first()) else {
            return Vec::new();
        };
        let is_frame = is_rig(&&(first, second));
        let others = pairs.iter().filter(|(camera, _)| camera.name != first.name);
        let motion = |&(a, b): &(&CameraEstimate, &CameraEstimate)| {
            let before = a.camera_from_rig.after(&first.camera_from_rig.inverse());
            let after = b.camera_from_rig.after(&second.camera_from_rig.inverse());
            let [rotation_rad, translation_mm] = after.off(&before);
            let deviations = |of: &CameraEstimate| of.observed_pose_sd.or(of.pose_sd);
            let known = deviations(a).zip(deviations(b)).filter(|_| is_frame);
            let off = rotation_rad.to_array().into_iter().chain(translation_mm.to_array());
            let p_value = known.map(|(a, b)| {
                // Bonferroni bound for the largest of six, for any correlation.
                let largest = off.zip(a.iter().zip(b)).map(|(off, (a, b))| off.abs() / a.hypot(b));
                let largest = largest.fold(0.0, f64::max);
                (6.0 * libm::erfc(largest / std::f64::consts::SQRT_2)).min(1.0)
            });
            let (from, to) = (first.name.clone(), a.name.clone());
            Self { from, to, rotation_rad, translation_mm, p_value }
        };
        others.map(motion).collect()
    }

    /// Whether the camera moved by more than the standard deviations explain; `None` if these are not known.
    pub fn is_significant(&self) -> Option<bool> {
        self.p_value.map(|p_value| p_value < SELDOM)
    }
}

/// Minimum number of compared positions: a motion has six unknowns.
const MIN_POSITIONS: usize = 6;

/// A position in the image, and the point that the first camera sees there.
struct Place {
    pixel: DVec2,
    point: DVec3,
    is_compared: bool,
}

/// A grid of positions over an image.
struct Grid {
    size: DVec2,
    columns: usize,
    rows: usize,
}

impl Grid {
    fn new(size: [u32; 2]) -> Self {
        let size = DVec2::from(size.map(f64::from));
        let parts = (size * POSITIONS as f64 / size.max_element()).round().max(DVec2::ONE);
        Self { size, columns: parts.x as usize, rows: parts.y as usize }
    }

    fn parts(&self) -> DVec2 {
        DVec2::new(self.columns as f64, self.rows as f64)
    }

    /// The centre of a cell.
    fn pixel(&self, index: usize) -> DVec2 {
        let at = DVec2::new((index % self.columns) as f64, (index / self.columns) as f64) + 0.5;
        at * self.size / self.parts() - 0.5
    }

    /// Column and row of the cell of a pixel.
    fn place(&self, pixel: DVec2) -> [i64; 2] {
        let at = (pixel + 0.5) / self.size * self.parts();
        [at.x.floor() as i64, at.y.floor() as i64]
    }

    /// Returns a predicate that is true for the cells that are compared.
    fn compared<'a>(
        &'a self,
        first: &CameraEstimate,
        second: &CameraEstimate,
        region: Region,
    ) -> impl Fn(usize) -> bool + 'a {
        let counts = |of: &CameraEstimate| {
            let mut counts: BTreeMap<[i64; 2], usize> = BTreeMap::new();
            for (pixel, count) in Coverage::of(of).places(of.size_px()) {
                let [x, y] = self.place(pixel);
                let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
                around.for_each(|place| *counts.entry(place).or_default() += count as usize);
            }
            counts
        };
        let seen = [counts(first), counts(second)];
        move |index| match region {
            Region::Image => true,
            Region::Within(low, high) => {
                let pixel = self.pixel(index);
                pixel.cmpge(low).all() && pixel.cmple(high).all()
            }
            Region::Seen => {
                let place = self.place(self.pixel(index));
                let has_enough = |counts: &BTreeMap<_, usize>| {
                    counts.is_empty() || counts.get(&place).is_some_and(|&count| count >= AROUND)
                };
                seen.iter().all(has_enough)
            }
        }
    }
}

/// The motion that minimises the distance between the projections of points by the second camera
/// and their pixels in the first.
fn aligned(second: &CameraEstimate, positions: &[&Place], distance_mm: Option<f64>) -> Pose {
    let unknowns = unknowns(distance_mm);
    let mut motion = Pose::IDENTITY;
    for _ in 0..MAX_STEPS {
        let mut matrix = DMatrix::zeros(unknowns, unknowns);
        let mut right = DVector::zeros(unknowns);
        for place in positions {
            let point = motion.apply(place.point);
            let Some(at) = second.camera.project_with_derivatives(point) else { continue };
            let rows = by_motion(&at, point).columns(0, unknowns).into_owned();
            let off = place.pixel - at.pixel;
            matrix += rows.tr_mul(&rows);
            right += rows.tr_mul(&nalgebra::Vector2::new(off.x, off.y));
        }
        let Some(inverse) = pseudo_inverse(&matrix) else { break };
        let step = inverse * right;
        let part = |first: usize| match first < unknowns {
            true => DVec3::new(step[first], step[first + 1], step[first + 2]),
            false => DVec3::ZERO,
        };
        let turn = DQuat::from_scaled_axis(part(0));
        motion = Pose { rotation: turn, translation: part(3) }.after(&motion);
        motion.rotation = motion.rotation.normalize();
        let moved = part(3).length() / distance_mm.unwrap_or(INFINITY_MM);
        if (part(0).length() + moved) * second.camera.focal_px.max_element() < SAME_PX {
            break;
        }
    }
    motion
}

/// Number of unknowns: a rotation, and a translation for points that are not at infinity.
fn unknowns(distance_mm: Option<f64>) -> usize {
    if distance_mm.is_some() { 6 } else { 3 }
}

/// The pseudo-inverse of a matrix: zero in the directions that it does not determine.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.pseudo_inverse(SINGULAR).ok()?;
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// Singular values below this are rounding errors, for a matrix with unit diagonal.
const SINGULAR: f64 = 1e-12;

/// The difference expected from the uncertainties of two cameras.
struct Known {
    expected_px: f64,
    p_value: f64,
    /// Square roots of the covariances of both cameras' parameters.
    halves: [DMatrix<f64>; 2],
    /// The motion that belongs to each of their columns.
    motions: DMatrix<f64>,
    unknowns: usize,
}

impl Known {
    /// Computes it; `None` if the uncertainty of a camera is not known.
    fn of(
        first: &CameraEstimate,
        second: &CameraEstimate,
        positions: &[&Place],
        motion: &Pose,
        distance_mm: Option<f64>,
    ) -> Option<Self> {
        let halves = [half_of(first)?, half_of(second)?];
        let unknowns = unknowns(distance_mm);
        let count = halves.iter().map(DMatrix::ncols).sum();
        let mut known = Self {
            expected_px: 0.0,
            p_value: 1.0,
            halves,
            motions: DMatrix::zeros(unknowns, count),
            unknowns,
        };
        let rows = positions.iter().filter_map(|place| {
            let of_motion = known.by_motion(second, motion, place.point)?;
            let changes = known.changes(first, second, motion, place.point)?;
            let by = second.camera.project(motion.apply(place.point))? - place.pixel;
            Some((of_motion, changes, by))
        });
        let rows: Vec<_> = rows.collect();
        let (mut matrix, mut right) =
            (DMatrix::zeros(unknowns, unknowns), DMatrix::zeros(unknowns, count));
        for (of_motion, changes, _) in &rows {
            matrix += of_motion.tr_mul(of_motion);
            right += of_motion.tr_mul(changes);
        }
        known.motions = -pseudo_inverse(&matrix)? * right;
        // The differences over all positions are G x, where x has variance 1.
        let (mut gram, mut square) = (DMatrix::zeros(count, count), 0.0);
        for (of_motion, changes, by) in &rows {
            let changes = changes + of_motion * &known.motions;
            gram += changes.tr_mul(&changes);
            square += by.length_squared();
        }
        let coordinates = 2.0 * rows.len() as f64;
        known.expected_px = (gram.trace() / coordinates).sqrt();
        let mean = gram.trace() + coordinates * MIN_SD_PX.powi(2);
        let freedom = [first, second].map(CameraEstimate::observed_freedom);
        known.p_value = chance_of(square, mean, gram.norm_squared(), freedom);
        Some(known)
    }

    fn by_motion(
        &self,
        second: &CameraEstimate,
        motion: &Pose,
        point: DVec3,
    ) -> Option<DMatrix<f64>> {
        let point = motion.apply(point);
        let at = second.camera.project_with_derivatives(point)?;
        let rows = by_motion(&at, point);
        Some(DMatrix::from_fn(2, self.unknowns, |i, j| rows[(i, j)]))
    }

    /// Derivatives of the difference at a point with respect to the columns of both covariance roots.
    fn changes(
        &self,
        first: &CameraEstimate,
        second: &CameraEstimate,
        motion: &Pose,
        point: DVec3,
    ) -> Option<DMatrix<f64>> {
        let of_first = first.camera.project_with_derivatives(point)?;
        let of_second = second.camera.project_with_derivatives(motion.apply(point))?;
        let of_first = -by_parameters(&of_first, &first.free()) * &self.halves[0];
        let of_second = by_parameters(&of_second, &second.free()) * &self.halves[1];
        let columns = of_first.column_iter().chain(of_second.column_iter());
        let columns: Vec<_> = columns.map(|column| column.into_owned()).collect();
        Some(DMatrix::from_fn(2, columns.len(), |i, j| columns[j][i]))
    }

    /// Standard deviation per axis of the difference at a point.
    fn sd_px(
        &self,
        first: &CameraEstimate,
        second: &CameraEstimate,
        motion: &Pose,
        point: DVec3,
    ) -> Option<f64> {
        let changes = self.changes(first, second, motion, point)?
            + self.by_motion(second, motion, point)? * &self.motions;
        Some((changes.norm_squared() / 2.0).sqrt())
    }
}

/// The probability of a sum of squares of at least `found`, if `mean` is expected and the squared variances sum to
/// `spread`: from the χ² distribution of equal mean and variance (Satterthwaite 1946), or from the F distribution if
/// the covariances have limited degrees of freedom.
fn chance_of(found: f64, mean: f64, spread: f64, known: [Option<f64>; 2]) -> f64 {
    if mean <= 0.0 || spread <= 0.0 {
        return 1.0;
    }
    let freedom = (mean * mean / spread).round().max(1.0);
    match known.into_iter().flatten().reduce(f64::min) {
        Some(known) => f_p_value(found / mean, freedom, known),
        None => chi_squared_p_value(found * freedom / mean, freedom as usize),
    }
}

impl CameraEstimate {
    fn observed_freedom(&self) -> Option<f64> {
        Some(self.projection.as_ref()?.observed.as_ref()?.freedom)
    }
}

/// A square root of the covariance of a camera's parameters: the observed covariance without errors
/// of the board, or the covariance from noise if there is none.
fn half_of(camera: &CameraEstimate) -> Option<DMatrix<f64>> {
    let observed = camera.projection.as_ref().and_then(|known| known.observed.as_ref());
    let observed = observed.map(ObservedCovariance::without_board);
    let covariance = observed.or_else(|| camera.covariance_from(Source::Noise).cloned())?;
    let n = covariance.rows();
    let sd = DVector::from_fn(n, |i, _| covariance[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / sd[i] / sd[j]);
    let eigen = scaled.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    Some(DMatrix::from_diagonal(&sd) * eigen.eigenvectors * DMatrix::from_diagonal(&roots))
}
