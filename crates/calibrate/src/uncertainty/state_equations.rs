//! Linear equations of each view for the camera parameters and for changes that a calibration does
//! not model.
//!
//! ```text
//!   rows of a view:    residual = [ camera | candidates | pose ] · unknowns        whitened, weighted by the loss
//!   Gram matrix:       [ camera | candidates | residual ]ᵀ[ … ], the pose of the view eliminated
//! ```
//!
//! The candidates are quantities that may differ between views (focal length, principal point),
//! displacements due to a rolling shutter while the board moves, and stretch and bend of the board.
//! With these matrices any combination of columns is fitted by one Gauss–Newton step (a score
//! test), without another bundle adjustment.

use std::collections::BTreeSet;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};

use super::projection::by_motion;
use crate::input::loss::Loss;
use crate::input::observation::MIN_CORNERS;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;
use deltille_core::camera::Lens;
use deltille_core::statistics::f_p_value;

/// The columns besides those of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Candidate {
    /// Relative change of both focal lengths.
    Focal,
    /// Change of the principal point in x, px.
    CentreX,
    /// Change of the principal point in y, px.
    CentreY,
    /// Displacement of the board along x of the camera while the shutter scans the image, mm.
    ShutterX,
    /// The same along y.
    ShutterY,
    /// The same along z.
    ShutterZ,
    /// Stretch of the board: x longer and y shorter by this fraction.
    Stretch,
    /// Shear of the board by this fraction.
    Shear,
    /// Bend of the board along x, mm at a half diagonal.
    BendX,
    /// Twist of the board.
    Twist,
    /// Bend of the board along y.
    BendY,
}

const CANDIDATES: usize = 11;

impl Candidate {
    /// The intrinsics that may change.
    const CAMERA: [Self; 3] = [Self::Focal, Self::CentreX, Self::CentreY];

    /// Displacements while the shutter scans the image.
    pub(crate) const SHUTTER: [Self; 3] = [Self::ShutterX, Self::ShutterY, Self::ShutterZ];

    /// The deviations of a board from its description.
    pub(crate) const SHEET: [Self; 5] =
        [Self::Stretch, Self::Shear, Self::BendX, Self::Twist, Self::BendY];
}

/// The equations of a view.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ViewEquations {
    /// Index of its frame.
    pub frame: usize,
    /// Gram matrix of the camera's columns, the candidates and the residual.
    gram: DMatrix<f64>,
    /// Number of coordinates minus the number of unknowns of the pose.
    pub freedom: f64,
    /// Size of a whitened coordinate, px.
    px: f64,
    /// RMS derivative of a pixel with respect to the position of the board, px/mm, along x, y and z.
    pub px_per_mm: f64,
    /// Mean squared sine of the angle between the line of sight and the normal of the board.
    pub obliquity: f64,
    /// Mean logarithm of the distance.
    pub log_distance: f64,
}

/// The equations of the views of a camera, in their order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StateEquations {
    pub views: Vec<ViewEquations>,
    /// The parameters of the camera that have columns, by index; equal ones share a column.
    free: Vec<Vec<usize>>,
    /// Whether all corners are those of one panel.
    pub is_of_one_panel: bool,
}

/// A column with a weight for each view.
pub(crate) struct Column {
    index: usize,
    weights: Option<Vec<f64>>,
}

/// A least squares fit of some columns to all views.
pub(crate) struct Fit {
    beta: DVector<f64>,
    inverse: DMatrix<f64>,
    parts: Vec<(DMatrix<f64>, DVector<f64>)>,
    whole: DMatrix<f64>,
    right: DVector<f64>,
    /// The residual sum of squares, and its degrees of freedom.
    pub left: f64,
    pub freedom: f64,
}

/// An unknown with its standard deviation from the scatter between views.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effect {
    pub value: f64,
    pub sd: f64,
    /// Degrees of freedom of the standard deviation.
    pub freedom: f64,
}

/// The p-value of an effect: the probability that noise causes it.
pub(crate) fn significance(effect: Effect) -> f64 {
    match effect.freedom >= 1.0 {
        true => f_p_value((effect.value / effect.sd).powi(2), 1.0, effect.freedom),
        false => 1.0,
    }
}

impl StateEquations {
    /// Forms the equations of the views of a camera at an estimate; `None` if none of its parameters was estimated.
    pub(crate) fn of(
        problem: &Problem,
        whitening: &Whitening,
        loss: Loss,
        camera: usize,
        order: &[usize],
    ) -> Option<Self> {
        let unknowns = &problem.cameras[camera];
        let free = unknowns.groups();
        if free.is_empty() {
            return None;
        }
        // A spline is treated as fixed: all views together determine its knots far better than the
        // differences between two groups of views do.
        let free = if matches!(unknowns.camera.lens, Lens::Spline(_)) { Vec::new() } else { free };
        let of_camera = || problem.blocks.iter().filter(|block| block.camera == camera);
        let panels: BTreeSet<usize> = of_camera().map(|block| block.panel.index()).collect();
        let places =
            || of_camera().flat_map(|block| block.observations.iter()).map(|seen| seen.panel_mm);
        let middle = places().sum::<DVec3>() / places().count().max(1) as f64;
        let reach = places().map(|at| at.distance(middle)).fold(f64::MIN_POSITIVE, f64::max);
        let equations = Equations { problem, whitening, loss, camera, free, middle, reach };
        let seen: BTreeSet<usize> = of_camera().map(|block| block.frame).collect();
        let views = order.iter().copied().filter(|frame| seen.contains(frame));
        let views = views.filter_map(|frame| equations.of_view(frame)).collect();
        Some(Self { views, free: equations.free, is_of_one_panel: panels.len() == 1 })
    }

    /// The equations of some of the views only, by index.
    pub(crate) fn some(&self, is_kept: impl Fn(usize) -> bool) -> Self {
        let views = self.views.iter().enumerate().filter(|&(index, _)| is_kept(index));
        let views = views.map(|(_, view)| view.clone()).collect();
        Self { views, free: self.free.clone(), ..*self }
    }

    /// Number of views.
    pub(crate) fn count(&self) -> usize {
        self.views.len()
    }

    /// Number of unknowns of the camera.
    pub(super) fn parameter_count(&self) -> usize {
        self.free.len()
    }

    /// Whether the first two unknowns of the camera are the focal lengths.
    pub(super) fn is_focal_free(&self) -> bool {
        self.column_of(0).is_some() && self.column_of(1).is_some()
    }

    /// The unknown of each parameter of the camera that has one, in the order of the parameters.
    pub(super) fn unknowns_of_parameters(&self) -> Vec<usize> {
        let groups = self.free.iter().enumerate();
        let mut all: Vec<(usize, usize)> =
            groups.flat_map(|(unknown, of)| of.iter().map(move |&i| (i, unknown))).collect();
        all.sort_unstable();
        all.into_iter().map(|(_, unknown)| unknown).collect()
    }

    /// The unknown of a parameter.
    fn column_of(&self, parameter: usize) -> Option<usize> {
        self.free.iter().position(|of| of.contains(&parameter))
    }

    /// The change of a parameter in a fit whose first columns are those of the camera, px. For a
    /// camera without free parameters, it is the change of the corresponding candidate, whose unit
    /// is `px` pixels.
    pub(crate) fn change_px(
        &self,
        fit: &Fit,
        parameter: usize,
        candidate: Candidate,
        px: f64,
    ) -> f64 {
        if self.free.is_empty() {
            let column = Candidate::CAMERA.iter().position(|&of| of == candidate);
            return column.map_or(0.0, |column| px * fit.beta[column]);
        }
        self.column_of(parameter).map_or(0.0, |column| fit.beta[column])
    }

    /// The columns of the camera.
    pub(crate) fn camera(&self) -> Vec<Column> {
        let own = 0..self.free.len();
        match self.free.len() {
            0 => Candidate::CAMERA.map(|candidate| self.column(candidate)).into(),
            _ => own.map(|index| Column { index, weights: None }).collect(),
        }
    }

    /// A candidate, the same in all views.
    pub(crate) fn column(&self, candidate: Candidate) -> Column {
        Column { index: self.free.len() + candidate as usize, weights: None }
    }

    /// A candidate times a weight for each view.
    pub(crate) fn weighted(&self, candidate: Candidate, weights: Vec<f64>) -> Column {
        Column { weights: Some(weights), ..self.column(candidate) }
    }

    /// Fits some columns; `None` if they are not distinguishable.
    pub(crate) fn fit(&self, columns: &[Column]) -> Option<Fit> {
        self.fit_with_each(columns, &[])
    }

    /// Fits some columns, and candidates that have a separate value in every view.
    pub(crate) fn fit_with_each(&self, columns: &[Column], each: &[Candidate]) -> Option<Fit> {
        let m = columns.len();
        let mut parts = Vec::with_capacity(self.views.len());
        let (mut whole, mut right) = (DMatrix::zeros(m, m), DVector::zeros(m));
        let (mut left, mut freedom) = (0.0, -(m as f64));
        for (index, view) in self.views.iter().enumerate() {
            let gram = eliminated(self.chosen(index, columns, each), each.len())?;
            let own = gram.view((0, 0), (m, m)).into_owned();
            let pull = DVector::from_fn(m, |i, _| gram[(i, m)]);
            whole += &own;
            right += &pull;
            left += gram[(m, m)];
            freedom += view.freedom - each.len() as f64;
            parts.push((own, pull));
        }
        let inverse = inverted(&whole)?;
        let beta = &inverse * &right;
        let left = left - beta.dot(&right);
        Some(Fit { beta, inverse, parts, whole, right, left, freedom })
    }

    /// For each view k, the effect of a candidate on the views from k on, beside columns without weights, with the
    /// standard deviation from noise and the most degrees of freedom that [`Fit::effect`] finds; `None` if it is not
    /// distinguishable from the columns.
    pub(crate) fn changes_from_noise(
        &self,
        columns: &[Column],
        candidate: Candidate,
    ) -> Vec<Option<Effect>> {
        let m = columns.len();
        let chosen = || columns.iter().map(|column| Column { index: column.index, weights: None });
        let columns: Vec<Column> = chosen().chain([self.column(candidate)]).collect();
        // Of the columns, the candidate and the residual.
        let all = (0..self.count()).map(|view| self.chosen(view, &columns, &[]));
        let all = all.fold(DMatrix::zeros(m + 2, m + 2), |sum, gram| sum + gram);
        let freedom = self.views.iter().map(|view| view.freedom).sum::<f64>() - (m + 1) as f64;
        let mut after = all.clone();
        let from = |view: usize| {
            if view > 0 {
                after -= self.chosen(view - 1, &columns, &[]);
            }
            let mut whole = all.view((0, 0), (m + 1, m + 1)).into_owned();
            let mut right = all.view((0, m + 1), (m + 1, 1)).column(0).into_owned();
            for i in 0..=m {
                (whole[(i, m)], whole[(m, i)]) = (after[(i, m)], after[(m, i)]);
            }
            right[m] = after[(m, m + 1)];
            let inverse = inverted(&whole)?;
            let beta = &inverse * &right;
            let left = (all[(m + 1, m + 1)] - beta.dot(&right)).max(0.0);
            let variance = inverse[(m, m)] * left / freedom.max(1.0);
            let (value, sd) = (beta[m], variance.sqrt());
            let freedom = 2.0 * self.count() as f64;
            sd.is_finite().then_some(Effect { value, sd, freedom })
        };
        (0..self.count()).map(from).collect()
    }

    /// For each view of a fit by [`Self::fit_with_each`], the values of the candidates and the
    /// reduction of the view's sum of squares.
    pub(crate) fn each(
        &self,
        columns: &[Column],
        fit: &Fit,
        each: &[Candidate],
    ) -> Option<Vec<(Vec<f64>, f64)>> {
        let (m, n) = (columns.len(), each.len());
        let of_view = |index: usize| {
            let gram = self.chosen(index, columns, each);
            let own = gram.view((m + 1, m + 1), (n, n)).into_owned();
            let pull = gram.view((m + 1, m), (n, 1)) - gram.view((m + 1, 0), (n, m)) * &fit.beta;
            let values = inverted(&own)? * &pull;
            let squares = values.dot(&pull);
            Some((values.iter().copied().collect(), squares))
        };
        (0..self.views.len()).map(of_view).collect()
    }

    /// The Gram matrix of a view for some columns, the residual, and candidates.
    fn chosen(&self, view: usize, columns: &[Column], each: &[Candidate]) -> DMatrix<f64> {
        let gram = &self.views[view].gram;
        let residual = gram.nrows() - 1;
        let of_columns =
            columns.iter().map(|c| (c.index, c.weights.as_ref().map_or(1.0, |w| w[view])));
        let of_each = each.iter().map(|&of| (self.free.len() + of as usize, 1.0));
        let chosen: Vec<(usize, f64)> =
            of_columns.chain([(residual, 1.0)]).chain(of_each).collect();
        DMatrix::from_fn(chosen.len(), chosen.len(), |i, j| {
            chosen[i].1 * chosen[j].1 * gram[(chosen[i].0, chosen[j].0)]
        })
    }

    /// Size of a whitened coordinate, px.
    pub(crate) fn px(&self) -> f64 {
        let squares: f64 = self.views.iter().map(|view| view.px * view.px).sum();
        (squares / self.views.len().max(1) as f64).sqrt()
    }
}

impl Fit {
    /// The unknowns.
    pub(crate) fn values(&self) -> &DVector<f64> {
        &self.beta
    }

    /// The variance of an unknown from noise.
    pub(super) fn noise_variance(&self, index: usize) -> f64 {
        self.inverse[(index, index)] * self.variance()
    }

    /// Variance of a whitened coordinate.
    pub(crate) fn variance(&self) -> f64 {
        self.left / self.freedom.max(1.0)
    }

    /// An unknown with its standard deviation. The variance is the mean of that of the delete-one jackknife over views
    /// and of that from noise scaled by the excess scatter of views in all directions, but at least that from noise.
    ///
    /// The degrees of freedom of the jackknife follow from Satterthwaite's formula for the
    /// contributions of views, minus `taken`. The mean has twice as many, because all directions
    /// together determine the other variance.
    pub(crate) fn effect(&self, index: usize, taken: f64) -> Option<Effect> {
        let count = self.parts.len() as f64;
        let (mut without, mut shares) = (Vec::with_capacity(self.parts.len()), Vec::new());
        let along = self.inverse.column(index).into_owned();
        for (own, pull) in &self.parts {
            let inverse = inverted(&(&self.whole - own))?;
            without.push((inverse.row(index) * (&self.right - pull))[(0, 0)]);
            shares.push(along.dot(&(own * &along)));
        }
        let mean = without.iter().sum::<f64>() / count;
        let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
        let of_views = (count - 1.0) / count * squares;
        let of_noise = self.noise_variance(index);
        let both = (0.5 * (of_views + self.scatter() * of_noise)).max(of_noise);
        let (sum, squares) = shares.iter().fold((0.0, 0.0), |(a, b), s| (a + s, b + s * s));
        let freedom = 2.0 * (sum * sum / squares - taken);
        let (value, sd) = (self.beta[index], both.sqrt());
        (sd > 0.0 && sd.is_finite()).then_some(Effect { value, sd, freedom })
    }

    /// The ratio of the squared gradients of views to their expectation from noise: about 1 with noise alone.
    fn scatter(&self) -> f64 {
        let (mut squares, mut freedom) = (0.0, -(self.beta.len() as f64));
        for (own, pull) in &self.parts {
            let pull = pull - own * &self.beta;
            let n = own.nrows();
            let scale = DVector::from_fn(n, |i, _| match own[(i, i)] > 0.0 {
                true => own[(i, i)].sqrt().recip(),
                false => 0.0,
            });
            let eigen =
                DMatrix::from_fn(n, n, |i, j| own[(i, j)] * scale[i] * scale[j]).symmetric_eigen();
            let along = eigen.eigenvectors.tr_mul(&pull.component_mul(&scale));
            let known =
                eigen.eigenvalues.iter().zip(along.iter()).filter(|(value, _)| **value > OPEN);
            for (value, along) in known {
                squares += along * along / value;
                freedom += 1.0;
            }
        }
        squares / freedom.max(1.0) / self.variance()
    }
}

/// Minimum information of a view about a direction, relative to the information about its
/// coordinates, at which the view determines the direction.
const OPEN: f64 = 1e-6;

struct Equations<'a> {
    problem: &'a Problem,
    whitening: &'a Whitening,
    loss: Loss,
    camera: usize,
    free: Vec<Vec<usize>>,
    middle: DVec3,
    reach: f64,
}

impl Equations<'_> {
    fn of_view(&self, frame: usize) -> Option<ViewEquations> {
        let Self { problem, whitening, loss, camera, ref free, middle, reach } = *self;
        let unknowns = &problem.cameras[camera];
        let lens = &unknowns.camera;
        let height = f64::from(lens.height);
        let (p, n) = (free.len(), free.len() + CANDIDATES + 7);
        let mut gram = DMatrix::zeros(n, n);
        let (mut count, mut px, mut white, mut moves) = (0, 0.0, 0.0, 0.0);
        let (mut obliquity, mut log_distance) = (0.0, 0.0);
        let blocks = problem.blocks.iter().zip(&whitening.blocks);
        let blocks = blocks.filter(|(block, _)| block.camera == camera && block.frame == frame);
        for (block, weights) in blocks {
            let panel = problem.scene_from_panel(block.panel);
            let rotation =
                unknowns.camera_from_rig.rotation * problem.frames[frame].rotation * panel.rotation;
            let panel_from_camera = DMat3::from_quat(rotation.conjugate());
            let seen = block.observations.iter().zip(weights).zip(problem.camera_points(block));
            for ((seen, &w), point) in seen {
                let Some(at) = lens.project_with_derivatives(point) else { continue };
                let residual = seen.pixel - at.pixel;
                if whitening.is_outlier(w, residual) {
                    continue;
                }
                let whitened = Whitening::apply(w, residual);
                let (_, weight) = loss.of(whitened.length_squared(), whitening.sigma);
                // The central row of the image is read at the nominal time of the view.
                let ramp = (seen.pixel.y + 0.5) / height - 0.5;
                let by_point = at.by_point.map(DVec3::from);
                let by_place = by_point.map(|by| panel_from_camera * by);
                let uv = (seen.panel_mm - middle) / reach;
                let off = at.pixel - lens.centre_px;
                let motion = by_motion(&at, point);
                let mut rows = [DVector::zeros(n), DVector::zeros(n)];
                for (i, row) in rows.iter_mut().enumerate() {
                    for (column, parameters) in free.iter().enumerate() {
                        row[column] = parameters.iter().map(|&of| at.by_parameter(of)[i]).sum();
                    }
                    let sheet = by_sheet(uv, by_place[i], reach);
                    let candidates = by_candidates(i, off[i], ramp * by_point[i], sheet);
                    candidates.iter().enumerate().for_each(|(k, value)| row[p + k] = *value);
                    row[p + CANDIDATES] = residual[i];
                    (0..6).for_each(|k| row[p + CANDIDATES + 1 + k] = motion[(i, k)]);
                    moves += by_point[i].truncate().length_squared();
                }
                let [a, b, c] = w.map(|v| v * weight.sqrt());
                let [x, y] = rows;
                let second = b * &x + c * &y;
                let first = a * x;
                gram.ger(1.0, &first, &first, 1.0);
                gram.ger(1.0, &second, &second, 1.0);
                let normal = rotation * DVec3::Z;
                obliquity += 1.0 - normal.dot(point.normalize()).powi(2);
                log_distance += point.length().ln();
                count += 1;
                px += residual.length_squared();
                white += whitened.length_squared();
            }
        }
        if count < MIN_CORNERS {
            return None;
        }
        let gram = eliminated(gram, 6)?;
        Some(ViewEquations {
            frame,
            gram,
            freedom: (2 * count - 6) as f64,
            px: if white > 0.0 { (px / white).sqrt() } else { 0.0 },
            px_per_mm: (moves / (4 * count) as f64).sqrt(),
            obliquity: obliquity / f64::from(count as u32),
            log_distance: log_distance / f64::from(count as u32),
        })
    }
}

/// Derivatives of a coordinate with respect to stretch, shear and bend of the sheet, in the order of
/// [`Candidate::SHEET`]. `by_place` is the derivative with respect to the corner's position; `uv`
/// is its position relative to the centre of the sheet, in units of `reach`, mm.
fn by_sheet(uv: DVec3, by_place: DVec3, reach: f64) -> [f64; 5] {
    [
        reach * (uv.x * by_place.x - uv.y * by_place.y),
        reach * (uv.y * by_place.x + uv.x * by_place.y),
        uv.x * uv.x * by_place.z,
        uv.x * uv.y * by_place.z,
        uv.y * uv.y * by_place.z,
    ]
}

/// Derivatives of coordinate `i` of a pixel with respect to all candidates. `off` is its offset from the principal
/// point, `shutter` the derivatives with respect to a shift of the point while rows are read.
fn by_candidates(i: usize, off: f64, shutter: DVec3, sheet: [f64; 5]) -> [f64; CANDIDATES] {
    let axis = |of: usize| f64::from(u8::from(of == i));
    let [stretch, shear, bend_x, twist, bend_y] = sheet;
    [off, axis(0), axis(1), shutter.x, shutter.y, shutter.z, stretch, shear, bend_x, twist, bend_y]
}

/// A Gram matrix after elimination of its last unknowns (Schur complement).
fn eliminated(gram: DMatrix<f64>, last: usize) -> Option<DMatrix<f64>> {
    let n = gram.nrows() - last;
    if last == 0 {
        return Some(gram);
    }
    let own = gram.view((n, n), (last, last)).into_owned();
    let across = gram.view((n, 0), (last, n)).into_owned();
    let through = inverted(&own)? * &across;
    Some(gram.view((0, 0), (n, n)) - across.tr_mul(&through))
}

/// The inverse of a symmetric matrix whose unknowns have different units.
fn inverted(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        matrix[(i, j)] * scale[i] * scale[j] + if i == j { SINGULAR } else { 0.0 }
    });
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// Term added to a diagonal of 1, so that directions with less information remain unchanged.
const SINGULAR: f64 = 1e-11;

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Views of random rows for two camera parameters.
    fn equations(views: usize) -> StateEquations {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let n = 2 + CANDIDATES + 1;
        let view = |frame: usize| {
            let rows = DMatrix::from_fn(30, n, |_, _| random.random_range(-1.0..1.0));
            ViewEquations {
                frame,
                gram: rows.tr_mul(&rows),
                freedom: 24.0,
                px: 1.0,
                px_per_mm: 1.0,
                obliquity: 0.0,
                log_distance: 0.0,
            }
        };
        let views = (0..views).map(view).collect();
        StateEquations { views, free: vec![vec![0], vec![1]], is_of_one_panel: true }
    }

    /// Sums over the views before and after a change give the same as a fit of it, and its standard deviation from the
    /// scatter of views is not smaller.
    #[test]
    fn changes_from_noise_equal_those_of_fits() {
        let equations = equations(12);
        let candidate = Candidate::CentreX;
        let found = equations.changes_from_noise(&equations.camera(), candidate);
        for (first, found) in found.into_iter().enumerate().skip(1) {
            let after = (0..12).map(|view| f64::from(u8::from(view >= first))).collect();
            let mut columns = equations.camera();
            columns.push(equations.weighted(candidate, after));
            let fit = equations.fit(&columns).unwrap();
            let (found, whole) = (found.unwrap(), fit.effect(2, 2.0).unwrap());
            assert!((found.value - whole.value).abs() < 1e-9 * found.sd, "change at {first}");
            let sd = fit.noise_variance(2).sqrt();
            assert!((found.sd - sd).abs() < 1e-9 * sd, "change at {first}");
            assert!(whole.sd >= sd && whole.freedom < found.freedom, "change at {first}");
        }
    }
}
