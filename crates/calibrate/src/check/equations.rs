//! Linear equations of new views for changes of the camera and errors of the board.
//!
//! ```text
//!   r = J u + ε,   u = (δθ, b, a)      r: residuals with the earlier parameters; the poses are eliminated
//!   δθ ~ N(0, V)                        errors of the earlier calibration
//!   b ~ N(0, α²), a ~ N(0, 1)           errors of single corners and of the sheets of the board
//!   ε ~ N(0, s²)                        errors of the corners in the images, whitened
//! ```
//!
//! They are formed at the minimum of a calibration with a loose prior, so that large changes are close to linear.

use nalgebra::{DMatrix, DVector};

use crate::adjust::reweighting::{Kept, Settled, settle};
use crate::equations::block::Local;
use crate::equations::frame::OfFrame;
use crate::equations::minimise::{Until, minimise};
use crate::estimate::values::CameraEstimate;
use crate::input::calibration::Calibration;
use crate::problem::bundle::Problem;
use crate::problem::camera_prior::CameraPrior;
use crate::problem::corner_map::CornerMap;
use crate::problem::unknowns::{CameraUnknowns, TargetUnknowns};
use crate::problem::whitening::Whitening;
use crate::start::pose::{blocks, estimate_pose, fixed};
use crate::uncertainty::board_errors::{SHEET, accuracy, sheets};
use deltille_core::statistics::median;

/// Standard deviations of the loose prior, in those of the calibration: wide enough that the views determine most of a
/// change, and narrow enough that they do not drive parameters far where they hardly determine them.
const LOOSE: f64 = 5.0;

/// Factor of the covariances of the errors of the board in the calibration and in the new views. If both show the same
/// board, these errors are correlated. Twice both covariances is a bound for every correlation.
pub(super) const SAME_BOARD: f64 = 2.0;

/// Minimum assumed standard deviation of a corner of the board, mm, so that its inverse is finite.
const MIN_ACCURACY_MM: f64 = 1e-6;

/// The range of s² that is searched, and the number of bisections.
const VARIANCES: [f64; 2] = [1e-3, 1e3];
const HALVINGS: usize = 14;

/// The equations of all new views.
pub(super) struct Equations {
    /// JᵀJ.
    gram: DMatrix<f64>,
    /// Jᵀr.
    right: DVector<f64>,
    /// The inverse covariance of u.
    prior: DMatrix<f64>,
    /// s² times the excess of the earlier calibration's scatter over noise.
    variance: f64,
    /// The indices of the estimated parameters of the camera; δθ has their order.
    pub free: Vec<usize>,
    /// The columns of the sheet of each panel except its scale, which the distance absorbs; the unit is an RMS
    /// displacement of this over √3.
    pub sheet: Vec<usize>,
    /// The assumed standard deviation of a corner of the board, √2 α, mm.
    pub board_mm: f64,
    /// The minimum.
    pub problem: Problem,
    pub rms_px: f64,
}

/// The earlier calibration.
pub(super) struct Earlier<'a> {
    pub camera: &'a CameraEstimate,
    /// V.
    pub covariance: &'a DMatrix<f64>,
    /// Ratio of its observed variances without errors of the board to those from noise, at least 1.
    pub excess: f64,
    /// Its common standard deviation, px.
    pub common_px: Option<f64>,
}

impl Equations {
    /// Forms the equations for the views of the only camera of a calibration; `None` if no view can be used.
    pub(super) fn of(views: &Calibration, earlier: &Earlier) -> Option<Self> {
        let camera = earlier.camera;
        let free = camera.free();
        let loose = CameraPrior::new(&camera.camera, &(earlier.covariance * LOOSE * LOOSE))?;
        let tight = CameraPrior::new(&camera.camera, earlier.covariance)?;
        let problem = start(views, camera, &free, loose)?;
        let left_out = vec![false; problem.blocks.len()];
        let kept = Kept { problem, left_out, some_stand_out: false, factor: None };
        let Settled { minimum, whitening, .. } = settle(kept, views.weights, views.loss).ok()?;
        let (whitening, floor) = at_least(&minimum.problem, whitening, earlier.common_px);
        // The equations assume that the poses are at their optimum for these weights.
        let minimum = minimise(minimum.problem, &whitening, views.loss, Until::Fine)?;
        let (layout, mut problem) = (minimum.layout, minimum.problem);
        let map = CornerMap::flat(&problem.blocks);
        let board_mm = accuracy(&map, views.board_accuracy_mm).unwrap_or(0.0);
        let board_mm = (SAME_BOARD.sqrt() * board_mm).max(MIN_ACCURACY_MM);
        let (n, corners) = (layout.shared, 3 * map.len());
        let sheets = sheets(&map, &SHEET) * board_mm;
        problem.map = Some(map);
        let mut whole = DMatrix::zeros(n + corners, n + corners);
        let (mut pull, mut squares) = (DVector::zeros(n + corners), 0.0);
        for frame in 0..problem.frames.len() {
            let of_frame = problem.blocks.iter().zip(&whitening.blocks);
            let of_frame = of_frame.filter(|(block, _)| block.frame == frame);
            let locals = of_frame.map(|(block, weights)| {
                let sigma = whitening.sigma;
                Local::of(&problem, &layout, block, weights, views.loss, sigma)
            });
            let locals = locals.collect::<Option<Vec<Local>>>()?;
            squares += locals.iter().map(|local| local.cost).sum::<f64>();
            let frame = OfFrame::of(locals, n)?;
            frame.add_to(&mut whole);
            pull += frame.right(n + corners);
        }
        // Residuals with the earlier parameters.
        let mut off = DVector::zeros(n + corners);
        off.rows_mut(0, n).copy_from(&tight.off(&problem.cameras[0].camera, &free));
        let moved = &whole * &off;
        squares += 2.0 * off.dot(&pull) + off.dot(&moved);
        pull += moved;
        // The columns of the sheets.
        let count = sheets.ncols();
        let mut by_all = DMatrix::zeros(n + corners, n + corners + count);
        by_all.fill_with_identity();
        by_all.view_mut((n, n + corners), (corners, count)).copy_from(&sheets);
        let gram = by_all.tr_mul(&(whole * &by_all));
        let right = by_all.tr_mul(&pull);
        let mut prior = DMatrix::identity(n + corners + count, n + corners + count);
        prior.view_mut((0, 0), (n, n)).copy_from(tight.information());
        (n..n + corners).for_each(|i| prior[(i, i)] = board_mm.powi(-2));
        let is_sheet = |column: &usize| !(column - n - corners).is_multiple_of(SHEET.len());
        let sheet = (n + corners..n + corners + count).filter(is_sheet).collect();
        let freedom = 2.0 * problem.count() as f64 - 6.0 * problem.frames.len() as f64 - n as f64;
        let (residual, all): (f64, f64) = problem
            .blocks
            .iter()
            .flat_map(|block| problem.residuals(block))
            .flatten()
            .fold((0.0, 0.0), |(sum, count), off| (sum + off.length_squared(), count + 2.0));
        let mut equations = Self {
            gram,
            right,
            prior,
            variance: 1.0,
            free,
            sheet,
            board_mm,
            problem,
            rms_px: (residual / all.max(1.0)).sqrt(),
        };
        let own = equations.variance_of(squares, freedom)?;
        equations.variance = own.max(floor) * earlier.excess;
        Some(equations)
    }

    /// s² from the residuals, with all changes that the loose prior permits.
    fn variance_of(&self, squares: f64, freedom: f64) -> Option<f64> {
        if freedom < 1.0 {
            return None;
        }
        let mut loose = self.prior.clone();
        let n = self.free.len();
        loose.view_mut((0, 0), (n, n)).scale_mut(LOOSE.powi(-2));
        self.sheet.iter().for_each(|&i| loose[(i, i)] *= LOOSE.powi(-2));
        let [mut low, mut high] = VARIANCES.map(f64::ln);
        for _ in 0..HALVINGS {
            let variance = (0.5 * (low + high)).exp();
            let left = (&self.gram + &loose * variance).cholesky()?.solve(&self.right);
            let is_too_small = squares - left.dot(&self.right) > variance * freedom;
            *(if is_too_small { &mut low } else { &mut high }) = variance.ln();
        }
        Some(high.exp())
    }

    /// The information matrix D'J'C⁻¹JD and the score D'J'C⁻¹r of some directions D of u, where C is the covariance of
    /// the residuals of an unchanged camera.
    pub(super) fn information(&self, by: &DMatrix<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let along = &self.gram * by;
        let factor = (&self.gram + &self.prior * self.variance).cholesky()?;
        let solved = factor.solve(&along);
        let matrix = (by.tr_mul(&along) - along.tr_mul(&solved)) / self.variance;
        let score = (by.tr_mul(&self.right) - solved.tr_mul(&self.right)) / self.variance;
        Some(((&matrix + matrix.transpose()) * 0.5, score))
    }

    /// Number of columns.
    pub(super) fn count(&self) -> usize {
        self.right.len()
    }
}

/// The problem with the poses of the views, for the earlier camera.
fn start(
    views: &Calibration,
    camera: &CameraEstimate,
    free: &[usize],
    prior: CameraPrior,
) -> Option<Problem> {
    let panels = views.panel_poses();
    let parameters = camera.camera.parameters().len();
    let is_free = (0..parameters).map(|index| free.contains(&index)).collect();
    let unknowns = CameraUnknowns::alone(camera.camera.clone(), is_free);
    let mut problem = Problem {
        cameras: vec![CameraUnknowns { prior: Some(prior), ..unknowns }],
        targets: vec![TargetUnknowns::SCENE],
        panels: fixed(&panels),
        ..Problem::default()
    };
    for view in views.cameras.iter().flat_map(|camera| &camera.views) {
        let Some(pose) = estimate_pose(&camera.camera, &panels, &view.sightings) else { continue };
        problem.frames.push(pose);
        let of_view: Vec<_> = blocks(&view.sightings, problem.frames.len() - 1).collect();
        let is_imaged = |block| problem.residuals(block).all(|off| off.is_some());
        match of_view.iter().all(is_imaged) {
            true => problem.blocks.extend(of_view),
            false => drop(problem.frames.pop()),
        }
    }
    (!problem.frames.is_empty()).then_some(problem)
}

/// The whitening with a common standard deviation of at least the earlier one, and the smallest plausible s².
fn at_least(problem: &Problem, whitening: Whitening, earlier_px: Option<f64>) -> (Whitening, f64) {
    let Some((own, earlier)) = whitening.common_px.zip(earlier_px) else { return (whitening, 0.0) };
    let of_corners = problem.blocks.iter().flat_map(|block| block.observations.iter());
    let variances = of_corners.filter_map(|seen| seen.cov).map(|[xx, _, yy]| 0.5 * (xx + yy));
    let typical = median(variances.collect()).unwrap_or(0.0);
    let floor = (typical + earlier * earlier) / (typical + own * own);
    if own >= earlier {
        return (whitening, floor);
    }
    (Whitening { common_px: Some(earlier), ..whitening }.of(problem), 1.0)
}
