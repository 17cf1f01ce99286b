//! Tests for changed quantities.
//!
//! ```text
//!   T(S) = s_Sᵀ A_SS⁻¹ s_S          for the changes of some quantities S; F with dim S and ν degrees of freedom
//! ```
//!
//! A and s are the information matrix and the score of all changes ([`Equations::information`]), and ν the degrees of
//! freedom of the earlier covariance. T(S) is twice the logarithm of the generalised likelihood ratio.

use nalgebra::{DMatrix, DVector};

use super::answer::{Quantity, QuantityTest, Suspect};
use super::earlier::{Earlier, Unknown};
use super::equations::Equations;
use super::views::Views;
use crate::estimate::coverage::Coverage;
use crate::estimate::values::CameraEstimate;
use crate::problem::bundle::Problem;
use crate::uncertainty::projection::{by_motion, by_parameters, seen_at};
use deltille_core::camera::PROJECTION_PARAMETERS;
use deltille_core::statistics::f_p_value;

/// Probability of the answer `changed` for an unchanged camera, for all tests together.
const FALSE_ALARM: f64 = 1e-3;

/// Level at which a quantity is rejected as the only explanation, in favour of another.
const REJECTED: f64 = 1e-2;

/// Probability with which a change of the reported size is found.
const POWER: f64 = 0.9;

/// Largest useful detectable change, as a displacement relative to the longer side of the image. For the focal length, it
/// counts at the border of the image: 1 % of the focal length.
const USEFUL: f64 = 0.005;

/// A direction counts as determined if its eigenvalue is at least this fraction of the largest one, with all diagonal
/// entries scaled to 1.
const DETERMINED: f64 = 1e-6;

/// The evidence on all quantities.
pub(super) struct Evidence {
    quantities: Vec<(Suspect, Vec<usize>)>,
    matrix: DMatrix<f64>,
    score: DVector<f64>,
    /// The information matrix that any number of views would approach.
    most: DMatrix<f64>,
    /// ν.
    freedom: f64,
}

impl Evidence {
    /// Forms the evidence; `None` if the equations cannot be solved.
    pub(super) fn of(equations: &Equations, earlier: &Earlier) -> Option<Self> {
        let mut directions: Vec<DVector<f64>> = Vec::new();
        let mut quantities = Vec::new();
        let mut push = |of: Suspect, columns: Vec<DVector<f64>>| {
            if !columns.is_empty() {
                let first = directions.len();
                quantities.push((of, (first..first + columns.len()).collect()));
                directions.extend(columns);
            }
        };
        for (camera, known) in earlier.cameras.iter().enumerate() {
            let focal_px = known.camera.focal_px.to_array();
            let mut focal = DVector::zeros(equations.count());
            let (mut centre, mut lens, mut pose) = (Vec::new(), Vec::new(), Vec::new());
            for (column, unknown) in earlier.unknowns.iter().enumerate() {
                let mut unit = DVector::zeros(equations.count());
                unit[column] = 1.0;
                match *unknown {
                    Unknown::Parameter { camera: of, index } if of == camera => match index {
                        0 | 1 => focal[column] = focal_px[index],
                        2 | 3 => centre.push(unit),
                        _ => lens.push(unit),
                    },
                    Unknown::Pose { camera: of } if of == camera => pose.push(unit),
                    _ => {}
                }
            }
            let of = |quantity| Suspect { camera: known.name.clone(), quantity };
            let focal = if focal.amax() > 0.0 { vec![focal] } else { Vec::new() };
            push(of(Quantity::FocalLength), focal);
            push(of(Quantity::PrincipalPoint), centre);
            push(of(Quantity::Distortion), lens);
            push(of(Quantity::Pose), pose);
        }
        let of_sheet = equations.sheet.iter().map(|&column| {
            let mut unit = DVector::zeros(equations.count());
            unit[column] = 1.0;
            unit
        });
        let board = Suspect { camera: String::new(), quantity: Quantity::Board };
        push(board, of_sheet.collect());
        let directions = DMatrix::from_columns(&directions);
        let (matrix, score) = equations.information(&directions)?;
        let most = equations.most_information(&directions);
        Some(Self { quantities, matrix, score, most, freedom: earlier.freedom })
    }

    /// The statistic of some directions and its degrees of freedom.
    fn statistic(&self, of: &[usize]) -> (f64, f64) {
        if of.is_empty() {
            return (0.0, 0.0);
        }
        let (matrix, score) = self.part(of);
        let scale =
            DVector::from_fn(of.len(), |i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
        let scaled =
            DMatrix::from_fn(of.len(), of.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let eigen = scaled.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&score.component_mul(&scale));
        let limit = DETERMINED * eigen.eigenvalues.max();
        let parts = along.iter().zip(eigen.eigenvalues.iter()).filter(|(_, value)| **value > limit);
        parts.fold((0.0, 0.0), |(sum, rank), (along, value)| {
            (sum + along * along / value, rank + 1.0)
        })
    }

    fn part(&self, of: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let matrix = DMatrix::from_fn(of.len(), of.len(), |i, j| self.matrix[(of[i], of[j])]);
        (matrix, DVector::from_fn(of.len(), |i, _| self.score[of[i]]))
    }

    /// The directions of some quantities together.
    fn directions(&self, of: &[Suspect]) -> Vec<usize> {
        let chosen = self.quantities.iter().filter(|(own, _)| of.contains(own));
        chosen.flat_map(|(_, columns)| columns.iter().copied()).collect()
    }

    fn all(&self) -> Vec<Suspect> {
        self.quantities.iter().map(|(of, _)| of.clone()).collect()
    }

    /// The p-value of the change of some quantities, if some others have changed.
    fn p_value_beside(&self, of: &[Suspect], others: &[Suspect]) -> f64 {
        let both = [of, others].concat();
        let (all, all_freedom) = self.statistic(&self.directions(&both));
        let (less, less_freedom) = self.statistic(&self.directions(others));
        let more = all_freedom - less_freedom;
        match more >= 1.0 {
            true => f_p_value((all - less) / more, more, self.freedom),
            false => 1.0,
        }
    }

    /// The p-value of all quantities together.
    pub(super) fn p_value(&self) -> f64 {
        self.p_value_beside(&self.all(), &[])
    }

    /// The level of the test of each quantity (Bonferroni).
    fn level(&self) -> f64 {
        FALSE_ALARM / self.quantities.len() as f64
    }

    /// What has changed, and what explains the views as well.
    pub(super) fn changed(&self) -> (Vec<Suspect>, Vec<Suspect>) {
        let alone = |of: &Suspect| self.p_value_beside(std::slice::from_ref(of), &[]);
        let is_any = self.all().iter().map(alone).fold(1.0, f64::min) < self.level();
        if !is_any {
            return (Vec::new(), Vec::new());
        }
        let mut changed: Vec<Suspect> = Vec::new();
        let mut left = self.all();
        loop {
            let beside = |of: &Suspect| self.p_value_beside(std::slice::from_ref(of), &changed);
            let statistic = |of: &Suspect| {
                let with = [&changed[..], std::slice::from_ref(of)].concat();
                self.statistic(&self.directions(&with)).0
            };
            let order = |one: &Suspect, other: &Suspect| {
                // Tiny probabilities are equal; then the statistics decide.
                let of = |of| beside(of).max(f64::MIN_POSITIVE);
                of(one).total_cmp(&of(other)).then(statistic(other).total_cmp(&statistic(one)))
            };
            let Some(best) = left.iter().min_by(|one, other| order(one, other)).cloned() else {
                break;
            };
            left.retain(|of| *of != best);
            changed.push(best);
            if self.p_value_beside(&left, &changed) >= FALSE_ALARM {
                break;
            }
        }
        let explains = |of: &Suspect| {
            changed.len() == 1
                && alone(of) < REJECTED
                && self.p_value_beside(&changed, std::slice::from_ref(of)) >= REJECTED
        };
        let or = left.iter().filter(|of| explains(of)).cloned().collect();
        (changed, or)
    }

    /// The tests of single quantities.
    pub(super) fn tests(
        &self,
        equations: &Equations,
        earlier: &Earlier,
        views: &Views,
    ) -> Vec<QuantityTest> {
        let test = |(of, columns): &(Suspect, Vec<usize>)| {
            let (matrix, score) = self.part(columns);
            let n = columns.len();
            let camera = earlier.cameras.iter().position(|camera| camera.name == of.camera);
            let known = &earlier.cameras[camera.unwrap_or(0)];
            let side_px = f64::from(known.camera.width.max(known.camera.height));
            // The squared size of a change is its product with this matrix.
            let (size, limit) = match of.quantity {
                Quantity::FocalLength => (DMatrix::from_element(1, 1, 1e4), Some(200.0 * USEFUL)),
                Quantity::Distortion => (displacement(known)?, Some(USEFUL * side_px)),
                Quantity::Pose => (by_pose(&views.problem, camera?), Some(USEFUL * side_px)),
                Quantity::Board => {
                    (DMatrix::identity(n, n) * (equations.board_mm.powi(2) / 3.0), None)
                }
                _ => (DMatrix::identity(n, n), Some(USEFUL * side_px)),
            };
            let change = solved(&matrix, &score)?;
            let sign = if n == 1 { change[0].signum() } else { 1.0 };
            let length = change.dot(&(&size * &change)).max(0.0).sqrt();
            let visible = detectable(self.statistic(columns).1, self.freedom, self.level());
            let most = DMatrix::from_fn(n, n, |i, j| self.most[(columns[i], columns[j])]);
            Some(QuantityTest {
                of: of.clone(),
                change: sign * length,
                p_value: self.p_value_beside(std::slice::from_ref(of), &[]),
                detectable: (visible * largest(&matrix, &size)).sqrt(),
                attainable: (visible * largest(&most, &size)).sqrt(),
                limit,
            })
        };
        self.quantities.iter().filter_map(test).collect()
    }
}

/// A⁻¹ b, with a tiny ridge for parameters that are hardly distinguishable.
fn solved(matrix: &DMatrix<f64>, score: &DVector<f64>) -> Option<DVector<f64>> {
    Some(ridged(matrix).cholesky()?.solve(score))
}

fn ridged(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut ridged = matrix.clone();
    for i in 0..matrix.nrows() {
        ridged[(i, i)] = ridged[(i, i)] * (1.0 + DETERMINED) + f64::MIN_POSITIVE;
    }
    ridged
}

/// The largest δᵀ`size`δ of a change with δᵀAδ = 1; infinite if A has no inverse.
fn largest(matrix: &DMatrix<f64>, size: &DMatrix<f64>) -> f64 {
    let Some(factor) = ridged(matrix).cholesky() else { return f64::INFINITY };
    let Some(half) = factor.l().solve_lower_triangular(size) else { return f64::INFINITY };
    let Some(whole) = factor.l().solve_lower_triangular(&half.transpose()) else {
        return f64::INFINITY;
    };
    ((&whole + whole.transpose()) * 0.5).symmetric_eigenvalues().max()
}

/// The mean square of the displacement of points at infinity by a change of the lens, over the calibrated part of the
/// image and after the motion of the scene that best compensates it.
fn displacement(camera: &CameraEstimate) -> Option<DMatrix<f64>> {
    let alignment = camera.projection.as_ref()?.alignment.inner();
    let free = camera.free();
    let lens: Vec<usize> =
        (0..free.len()).filter(|&i| free[i] >= PROJECTION_PARAMETERS.len()).collect();
    let coverage = Coverage::of(camera);
    let derivatives = coverage.places(camera.size_px()).filter_map(|(pixel, _)| {
        let point = seen_at(&camera.camera, pixel, None)?;
        let at = camera.camera.project_with_derivatives(point)?;
        let rows = by_parameters(&at, &free) + by_motion(&at, point) * alignment;
        Some(DMatrix::from_fn(2, lens.len(), |i, j| rows[(i, lens[j])]))
    });
    mean_square(lens.len(), derivatives)
}

/// The mean square of the displacement of the detected corners by a change of the pose of a camera.
fn by_pose(problem: &Problem, camera: usize) -> DMatrix<f64> {
    let lens = &problem.cameras[camera].camera;
    let from_rig = problem.cameras[camera].camera_from_rig.translation;
    let blocks = problem.blocks.iter().filter(|block| block.camera == camera);
    let derivatives = blocks.flat_map(|block| problem.camera_points(block)).filter_map(|point| {
        let at = lens.project_with_derivatives(point)?;
        // The rotation of `camera_from_rig` turns the vector from the camera's position on the rig.
        let mut rows = by_motion(&at, point - from_rig);
        rows.fixed_columns_mut::<3>(3).copy_from(&by_motion(&at, point).fixed_columns::<3>(3));
        Some(DMatrix::from_fn(2, 6, |i, j| rows[(i, j)]))
    });
    mean_square(6, derivatives).unwrap_or_else(|| DMatrix::zeros(6, 6))
}

/// The mean of DᵀD over derivatives D of displacements; `None` without any.
fn mean_square(n: usize, derivatives: impl Iterator<Item = DMatrix<f64>>) -> Option<DMatrix<f64>> {
    let (mut sum, mut count) = (DMatrix::zeros(n, n), 0.0);
    for rows in derivatives {
        sum += rows.tr_mul(&rows);
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// The noncentrality of a change that a test with these degrees of freedom finds with probability [`POWER`]. The
/// noncentral F distribution is approximated by a central one with the same two moments of its numerator (Patnaik 1949).
fn detectable(freedom: f64, below: f64, level: f64) -> f64 {
    let critical = bisected(1e6, |ratio| f_p_value(ratio, freedom, below) > level);
    bisected(1e6, |noncentral| {
        let mean = freedom + noncentral;
        let own = mean * mean / (freedom + 2.0 * noncentral);
        f_p_value(critical * freedom / mean, own, below) < POWER
    })
}

/// The value up to which a monotonic condition is true.
fn bisected(most: f64, is_below: impl Fn(f64) -> bool) -> f64 {
    let [mut low, mut high] = [1e-6_f64.ln(), f64::ln(most)];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is_below(middle.exp()) { &mut low } else { &mut high }) = middle;
    }
    high.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noncentralities from the series of the noncentral χ² distribution.
    #[test]
    fn noncentralities_match_the_noncentral_distribution() {
        for (freedom, expected) in [(1.0, 25.006), (2.0, 28.104), (4.0, 32.267), (5.0, 33.917)] {
            let found = detectable(freedom, 1e6, 2e-4);
            assert!((found / expected - 1.0_f64).abs() < 0.03, "{freedom}: {found}");
        }
    }
}
