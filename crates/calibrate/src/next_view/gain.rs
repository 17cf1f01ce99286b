//! The information of a proposed view: its normal equations with its own pose eliminated, and the projection
//! uncertainty with it.
//!
//! ```text
//!     view:  Σ Jᵀ J / σ²  of (θ, ξ)  =  ⎡ S  Bᵀ ⎤       information on θ:  S − Bᵀ A⁻¹ B
//!                                       ⎣ B  A  ⎦
//!
//!     V = (I₀ + S − Bᵀ A⁻¹ B)⁻¹,     K = −(A₀ + A)⁻¹ (B₀ + B)
//!     mean variance of a coordinate = tr(M V) / 2,   M = mean of (J_θ + J_ξ K)ᵀ (J_θ + J_ξ K) over the image
//! ```
//!
//! θ are the parameters of the camera, and of the board's shape if that is estimated too; ξ is a rotation and
//! translation of the scene, the same for a pose and for the alignment of
//! [`uncertainty`](crate::uncertainty::projection).

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix};

use super::body::{Body, Seen};
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::model::Model;
use crate::problem::shape;
use crate::problem::shape::Shape;
use crate::uncertainty::information::KnownSoFar;
use crate::uncertainty::projection::{by_motion, by_parameters, seen_at, solved};
use deltille_core::camera::{Camera, PROJECTION_PARAMETERS};

/// Number of positions along the longer side of the image at which projections are evaluated.
const POSITIONS: usize = 16;

/// Prior standard deviation of each parameter: it shifts projections by this fraction of the longer image side, RMS.
/// The prior keeps parameters finite that the corners do not determine.
const EXPECTED_PART: f64 = 0.05;

/// Prior standard deviation of the shape of a sheet, as a fraction of its reach: a sheet that is
/// bent more is hardly usable as a board.
const EXPECTED_BEND: f64 = 0.02;

/// The information about a camera from the views so far, and the projection uncertainty with
/// another view.
pub(crate) struct Gain {
    /// The most likely camera, including areas where no corner was seen.
    pub camera: Camera,
    /// Indices of the estimated parameters.
    free: Vec<usize>,
    shape: Option<Shape>,
    /// Information on the unknowns so far.
    known: DMatrix<f64>,
    /// Sums of the corners so far, for the alignment.
    sums: Sums,
    field: Field,
    /// Expected variance of a corner per axis, px².
    variance: f64,
    /// The least and the largest distance of the corners so far from the camera, mm.
    pub distances_mm: [f64; 2],
}

/// The information of one view.
pub(crate) struct ViewGain {
    /// On the unknowns, with the pose of the view eliminated.
    information: DMatrix<f64>,
    sums: Sums,
}

/// Sums over corners, Jᵀ J of parameters and motion.
#[derive(Clone)]
struct Sums {
    /// Unknowns by unknowns, lower triangle.
    own: DMatrix<f64>,
    /// Motion by unknowns.
    across: DMatrix<f64>,
    motion: Matrix6<f64>,
}

/// Means over the positions in an image, at infinity.
struct Field {
    own: DMatrix<f64>,
    turns_across: DMatrix<f64>,
    rotations: Matrix3<f64>,
}

impl Gain {
    /// From the estimate of a single camera; `None` if it lacks the information.
    pub(super) fn of(estimate: &Estimate, body: &Body) -> Option<Self> {
        let mut gain = Self::without_views(estimate)?;
        gain.known += &estimate.known.as_ref()?.information;
        gain.add_views(estimate.cameras.first()?, body);
        Some(gain)
    }

    /// The camera of an estimate with the prior alone, as if it had no views.
    pub(crate) fn without_views(estimate: &Estimate) -> Option<Self> {
        let [found] = estimate.cameras.as_slice() else { return None };
        let known = estimate.known.as_ref()?;
        let free = found.free();
        let shape = estimate.shape.map(|found| found.shape);
        let unknowns = free.len() + shape.map_or(0, |_| shape::COUNT);
        if known.information.nrows() != unknowns || free.is_empty() {
            return None;
        }
        let start = found.model.map(Model::lens);
        let (camera, expected) = believed(&found.camera, start, &free, known);
        let field = Field::of(&camera, &free)?;
        let spread = shape.map_or(1.0, |shape| EXPECTED_BEND * shape.reach_mm);
        let prior = |i: usize| expected.get(i).copied().unwrap_or(spread).powi(-2);
        let prior = DMatrix::from_diagonal(&DVector::from_fn(unknowns, |i, _| prior(i)));
        let variance = known.corner_variance_px2;
        let sums = Sums::zeros(unknowns);
        let distances_mm = [f64::INFINITY, 0.0];
        Some(Self { camera, free, shape, known: prior, sums, field, variance, distances_mm })
    }

    /// The information of a view of these points, each with its position in the camera frame, mm, and the variance of its
    /// corner per axis, px². `None` if they do not determine the pose.
    pub(crate) fn of_corners(
        &self,
        corners: impl Iterator<Item = (DVec3, f64)>,
    ) -> Option<ViewGain> {
        let mut sums = Sums::zeros(self.unknowns());
        let mut row = DMatrix::zeros(2, self.unknowns());
        for (point, variance) in corners {
            let Some(at) = self.camera.project_with_derivatives(point) else { continue };
            row.columns_mut(0, self.free.len()).copy_from(&by_parameters(&at, &self.free));
            sums.add(&row, &by_motion(&at, point), self.variance / variance, true);
        }
        self.of_view(sums)
    }

    /// Eliminates the pose of a view.
    fn of_view(&self, sums: Sums) -> Option<ViewGain> {
        let through = solved(&sums.motion, &sums.across)?;
        let information = (&sums.own - sums.across.tr_mul(&through)) / self.variance;
        Some(ViewGain { information, sums })
    }

    /// The projection uncertainty with another view, px.
    pub(crate) fn px_with(&self, view: &ViewGain) -> Option<f64> {
        let mut aligned = self.sums.clone();
        aligned.motion += view.sums.motion;
        aligned.across += &view.sums.across;
        self.px(&(&self.known + &view.information), &aligned)
    }

    /// Adds a view.
    pub(crate) fn add(&mut self, view: &ViewGain) {
        self.known += &view.information;
        self.sums.motion += view.sums.motion;
        self.sums.across += &view.sums.across;
    }

    /// Sums over the used corners.
    /// Adds the information of the views so far, and the distances of their corners.
    fn add_views(&mut self, found: &CameraEstimate, body: &Body) {
        let mut sums = self.sums.clone();
        let mut row = DMatrix::zeros(2, self.unknowns());
        for view in &found.views {
            for corner in view.corners.iter().filter(|corner| !corner.outlier) {
                let Some(panel) = body.panels.iter().find(|of| of.panel == corner.panel) else {
                    continue;
                };
                let place = (corner.row, corner.col);
                let index = panel.corners.binary_search_by_key(&place, |of| (of.row, of.col));
                let Ok(index) = index else { continue };
                let point = view.pose.apply(panel.corners[index].target_mm);
                let [least, most] = self.distances_mm;
                self.distances_mm = [least.min(point.length()), most.max(point.length())];
                let Some(at) = self.camera.project_with_derivatives(point) else { continue };
                row.columns_mut(0, self.free.len()).copy_from(&by_parameters(&at, &self.free));
                sums.add(&row, &by_motion(&at, point), 1.0, false);
            }
        }
        self.sums = sums;
    }

    fn unknowns(&self) -> usize {
        self.known.nrows()
    }

    /// The projection uncertainty at infinity over the image, px: RMS per axis.
    pub(crate) fn now_px(&self) -> Option<f64> {
        self.px(&self.known, &self.sums)
    }

    /// The projection uncertainty after one more view of these corners; `None` if they do not
    /// determine its pose.
    pub(super) fn with_px(&self, body: &Body, seen: &[Seen], turn: &DMat3) -> Option<f64> {
        let count = self.free.len();
        let mut sums = Sums::zeros(self.unknowns());
        let mut row = DMatrix::zeros(2, self.unknowns());
        for Seen { panel, corner, point, at, weight } in seen {
            row.columns_mut(0, count).copy_from(&by_parameters(at, &self.free));
            if let Some(shape) = &self.shape {
                let turn = *turn * body.rotations[*panel];
                let place = body.panels[*panel].corners[*corner].panel_mm;
                for (k, bend) in shape.directions(place).into_iter().enumerate() {
                    let bend = turn * bend;
                    for i in 0..2 {
                        row[(i, count + k)] = bend.dot(at.by_point[i].into());
                    }
                }
            }
            sums.add(&row, &by_motion(at, *point), *weight, true);
        }
        self.px_with(&self.of_view(sums)?)
    }

    fn px(&self, information: &DMatrix<f64>, sums: &Sums) -> Option<f64> {
        let count = self.free.len();
        let covariance = inverse(information)?;
        let across = sums.across.columns(0, count).into_owned();
        let rotations = -solved(&sums.motion, &across)?.rows(0, 3).into_owned();
        let Field { own, turns_across, rotations: of_turns } = &self.field;
        let crossed = turns_across.tr_mul(&rotations);
        let m =
            own + &crossed + crossed.transpose() + rotations.transpose() * of_turns * &rotations;
        let of_camera = covariance.view((0, 0), (count, count));
        let sum: f64 = m.iter().zip(of_camera.iter()).map(|(m, v)| m * v).sum();
        (sum >= 0.0).then(|| (0.5 * sum).sqrt())
    }
}

impl Sums {
    fn zeros(unknowns: usize) -> Self {
        let own = DMatrix::zeros(unknowns, unknowns);
        Self { own, across: DMatrix::zeros(6, unknowns), motion: Matrix6::zeros() }
    }

    /// Adds a corner by its derivatives.
    fn add(
        &mut self,
        by_unknowns: &DMatrix<f64>,
        by_motion: &SMatrix<f64, 2, 6>,
        weight: f64,
        with_own: bool,
    ) {
        let n = by_unknowns.ncols();
        for j in 0..n {
            let [x, y] = [0, 1].map(|i| weight * by_unknowns[(i, j)]);
            if x == 0.0 && y == 0.0 {
                continue;
            }
            if with_own {
                for i in 0..n {
                    self.own[(i, j)] += x * by_unknowns[(0, i)] + y * by_unknowns[(1, i)];
                }
            }
            for i in 0..6 {
                self.across[(i, j)] += x * by_motion[(0, i)] + y * by_motion[(1, i)];
            }
        }
        self.motion += by_motion.transpose() * by_motion * weight;
    }
}

impl Field {
    fn of(camera: &Camera, free: &[usize]) -> Option<Self> {
        let mut count = 0.0;
        let mut field = Self {
            own: DMatrix::zeros(free.len(), free.len()),
            turns_across: DMatrix::zeros(3, free.len()),
            rotations: Matrix3::zeros(),
        };
        for pixel in places(camera) {
            let Some(point) = seen_at(camera, pixel, None) else { continue };
            let Some(at) = camera.project_with_derivatives(point) else { continue };
            let (by_unknowns, motion) = (by_parameters(&at, free), by_motion(&at, point));
            let rotations = motion.fixed_columns::<3>(0).into_owned();
            field.own += by_unknowns.transpose() * &by_unknowns;
            field.turns_across += rotations.transpose() * &by_unknowns;
            field.rotations += rotations.transpose() * rotations;
            count += 1.0;
        }
        (count > 0.0).then(|| {
            field.own /= count;
            field.turns_across /= count;
            field.rotations /= count;
            field
        })
    }
}

/// Grid of positions over an image, px.
fn places(camera: &Camera) -> impl Iterator<Item = DVec2> + use<> {
    let size = DVec2::new(camera.width.into(), camera.height.into());
    let parts = (size * POSITIONS as f64 / size.max_element()).round().max(DVec2::ONE);
    let (columns, rows) = (parts.x as usize, parts.y as usize);
    (0..columns * rows).map(move |place| {
        let at = DVec2::new((place % columns) as f64, (place / columns) as f64) + 0.5;
        at * size / parts - 0.5
    })
}

/// The most likely camera under the prior of a lens, and the prior standard deviation of each
/// parameter. A polynomial is unconstrained where no corner was seen. The prior resets undetermined
/// directions to the initial lens of the model and does not change determined ones.
fn believed(
    camera: &Camera,
    start: Option<deltille_core::camera::Lens>,
    free: &[usize],
    known: &KnownSoFar,
) -> (Camera, Vec<f64>) {
    let values = camera.parameters();
    let before =
        start.map_or(values.clone(), |lens| Camera { lens, ..camera.clone() }.parameters());
    let at_start = camera.with_parameters(&before);
    let reach = EXPECTED_PART * f64::from(camera.width.max(camera.height));
    let mut squares = vec![0.0; free.len()];
    let mut count: f64 = 0.0;
    for pixel in places(&at_start) {
        let Some(point) = seen_at(&at_start, pixel, None) else { continue };
        let Some(at) = at_start.project_with_derivatives(point) else { continue };
        count += 1.0;
        for (square, &index) in squares.iter_mut().zip(free) {
            let [x, y] = at.by_parameter(index);
            *square += x * x + y * y;
        }
    }
    let expected = squares.iter().map(|square| reach / (square / count.max(1.0)).sqrt().max(1e-12));
    let expected: Vec<f64> = expected.collect();
    let n = free.len();
    let own = known.information.view((0, 0), (n, n));
    let mut whole = own.into_owned();
    (0..n).for_each(|i| whole[(i, i)] += expected[i].powi(-2));
    let off = DVector::from_fn(n, |i, _| {
        let is_lens = free[i] >= PROJECTION_PARAMETERS.len();
        if is_lens { (before[free[i]] - values[free[i]]) * expected[i].powi(-2) } else { 0.0 }
    });
    let Some(inverse) = inverse(&whole) else { return (camera.clone(), expected) };
    let step = inverse * off;
    let mut values = values;
    free.iter().enumerate().for_each(|(i, &index)| values[index] += step[i]);
    (camera.with_parameters(&values), expected)
}

/// The inverse of a positive matrix whose unknowns have different units.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
