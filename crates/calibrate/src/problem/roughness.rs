//! The smoothness prior of the knots of a spline lens, which determines them where there are no
//! corners.
//!
//! The prior expects a spline equivalent to some lens of a parametric family. It penalises the
//! second differences of the deviation d from that spline, along both axes and mixed (a discrete
//! thin plate):
//!
//! ```text
//!     |D d|² = Σ (d₋ − 2 d + d₊)²  along rows and columns  +  2 Σ (d − d→ − d↓ + d↘)²
//!     d = knots − expected − T k,    k: what makes |D d|² least
//! ```
//!
//! T contains the derivatives of the expected knots with respect to the parameters of the family.
//! With R = DᵀD and T made orthonormal, TᵀRT = 1, the penalty is dᵀ (R − RT TᵀR) d after
//! elimination of k. Each difference is normal with one standard deviation s, which is estimated by
//! maximising the marginal likelihood (empirical Bayes, MacKay 1992): with r the rank of that
//! matrix and V the covariance of the knots, γ = r − tr((R − RT TᵀR) V)/s² is the number of
//! differences that the corners determine better than the prior, and s² = |D d|²/γ. Functions that
//! are linear in the plane have no penalty. They have three coefficients for each coordinate, which
//! any corners determine.

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use deltille_core::camera::{Camera, Lens, PROJECTION_PARAMETERS, Spline, SplineGrid};

/// Initial standard deviation of a second difference, in knot distances: a tenth exceeds the
/// deviation of any lens from its parametric model, so the corners dominate.
const FIRST_PART: f64 = 0.1;

/// Minimum standard deviation of a second difference, in knot distances: a ten-thousandth of a
/// pixel for knots a hundred pixels apart.
const MIN_PART: f64 = 1e-6;

/// Exponent of the over-relaxation of the update of s, because plain fixed-point steps are small
/// and all have the same direction.
const FARTHER: f64 = 1.5;

/// A direction of the family counts as independent if this fraction of its squared length is
/// orthogonal to those before.
const ITS_OWN: f64 = 1e-6;

/// The smoothness prior of the knots of one spline.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Roughness {
    grid: SplineGrid,
    /// The expected knots, row by row.
    expected: Vec<DVec2>,
    /// R T: for each direction the components dx and dy of each knot.
    family: Vec<[Vec<f64>; 2]>,
    /// The standard deviation s; like the knots it has no unit.
    size: f64,
}

/// Knots of a second difference, and the factor of each.
type Difference = [(usize, f64); 4];

impl Roughness {
    /// A prior around a spline and all splines that differ from it by the `directions` of a family,
    /// each with one vector for each knot.
    pub(crate) fn around(spline: &Spline, directions: &[Vec<DVec2>]) -> Self {
        let grid = spline.grid();
        let mut family: Vec<[Vec<f64>; 2]> = Vec::new();
        for direction in directions {
            let of_axis = |axis: usize| direction.iter().map(|knot| knot[axis]).collect();
            let own: [Vec<f64>; 2] = [0, 1].map(of_axis);
            let mut pull = [0, 1].map(|axis| curved(&grid, &own[axis]));
            // t − Σ t' (t'ᵀ R t) of those t' before, in the metric R; all that is kept are R t.
            let whole = dot(&own, &pull);
            let mut left = whole;
            for other in &family {
                let along = dot(&own, other);
                left -= along * along;
                for (pull, other) in pull.iter_mut().flatten().zip(other.iter().flatten()) {
                    *pull -= along * other;
                }
            }
            if left > ITS_OWN * whole {
                pull.iter_mut().flatten().for_each(|value| *value /= left.sqrt());
                family.push(pull);
            }
        }
        let size = FIRST_PART * grid.distance();
        Self { grid, expected: spline.knots().to_vec(), family, size }
    }

    /// A prior around the spline of a camera that has free parameters; `None` for other cameras.
    pub(crate) fn of(camera: &Camera, free: &[bool]) -> Option<Self> {
        match &camera.lens {
            Lens::Spline(spline) if free.contains(&true) => Some(Self::around(spline, &[])),
            _ => None,
        }
    }

    /// The rank r of the prior: all coordinates of knots, without the linear functions and the
    /// directions of the family.
    pub(crate) fn rank(&self) -> usize {
        2 * (self.grid.count() - 3) - self.family.len()
    }

    /// The differences dx and dy of the knots from the expected ones.
    fn off(&self, camera: &Camera) -> [Vec<f64>; 2] {
        let Lens::Spline(spline) = &camera.lens else { return [Vec::new(), Vec::new()] };
        let off = || spline.knots().iter().zip(&self.expected).map(|(knot, at)| *knot - *at);
        [off().map(|off| off.x).collect(), off().map(|off| off.y).collect()]
    }

    /// Adds the prior to normal equations whose unit of cost is a residual of `sigma`; returns its
    /// cost. `parameters` lists the index of each unknown parameter of the camera and its column.
    pub(crate) fn add(
        &self,
        camera: &Camera,
        parameters: &[(usize, usize)],
        sigma: f64,
        matrix: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
    ) -> f64 {
        let weight = (sigma / self.size).powi(2);
        let columns = self.columns(parameters);
        let mut cost = 0.0;
        for (axis, off) in self.off(camera).iter().enumerate() {
            for difference in differences(&self.grid) {
                let value: f64 = difference.iter().map(|&(knot, part)| part * off[knot]).sum();
                cost += weight * value * value;
                let open = difference
                    .iter()
                    .filter_map(|&(knot, part)| Some((columns[2 * knot + axis]?, part)));
                for (i, part_i) in open.clone() {
                    right[i] -= weight * part_i * value;
                    for (j, part_j) in open.clone() {
                        matrix[(i, j)] += weight * part_i * part_j;
                    }
                }
            }
        }
        let off = self.off(camera);
        for direction in &self.family {
            let value = dot(direction, &off);
            cost -= weight * value * value;
            let open = self.open(direction, &columns);
            for &(i, part_i) in &open {
                right[i] += weight * part_i * value;
                open.iter().for_each(|&(j, part_j)| matrix[(i, j)] -= weight * part_i * part_j);
            }
        }
        cost
    }

    /// The prior with the standard deviation s that fits the knots; `covariance` is that of all
    /// columns for residuals of variance 1, `sigma` and `parameters` are as in [`Self::add`].
    pub(crate) fn fitted(
        &self,
        camera: &Camera,
        parameters: &[(usize, usize)],
        sigma: f64,
        covariance: &DMatrix<f64>,
    ) -> Self {
        let columns = self.columns(parameters);
        let (mut squares, mut open) = (0.0, 0.0);
        for (axis, off) in self.off(camera).iter().enumerate() {
            for difference in differences(&self.grid) {
                squares +=
                    difference.iter().map(|&(knot, part)| part * off[knot]).sum::<f64>().powi(2);
                let found = difference
                    .iter()
                    .filter_map(|&(knot, part)| Some((columns[2 * knot + axis]?, part)));
                for (i, part_i) in found.clone() {
                    open += found
                        .clone()
                        .map(|(j, part)| part_i * part * covariance[(i, j)])
                        .sum::<f64>();
                }
            }
        }
        let off = self.off(camera);
        for direction in &self.family {
            squares -= dot(direction, &off).powi(2);
            let found = self.open(direction, &columns);
            for &(i, part_i) in &found {
                open -=
                    found.iter().map(|&(j, part)| part_i * part * covariance[(i, j)]).sum::<f64>();
            }
        }
        let determined = self.rank() as f64 - open * (sigma / self.size).powi(2);
        let size = (squares.max(0.0) / determined.max(1.0)).sqrt();
        let size = self.size * (size / self.size).powf(FARTHER);
        Self { size: size.max(MIN_PART * self.grid.distance()), ..self.clone() }
    }

    /// Relative change of s from this prior to another.
    pub(crate) fn change(&self, other: &Self) -> f64 {
        (other.size / self.size - 1.0).abs()
    }

    /// The columns of the unknown knots in a direction, with their components.
    fn open(&self, direction: &[Vec<f64>; 2], columns: &[Option<usize>]) -> Vec<(usize, f64)> {
        let knots = (0..self.grid.count()).flat_map(|knot| [(knot, 0), (knot, 1)]);
        let parts = knots
            .filter_map(|(knot, axis)| Some((columns[2 * knot + axis]?, direction[axis][knot])));
        parts.collect()
    }

    /// The column of each parameter of the lens; `None` if it is known.
    fn columns(&self, parameters: &[(usize, usize)]) -> Vec<Option<usize>> {
        let mut columns = vec![None; 2 * self.grid.count()];
        for &(parameter, column) in parameters {
            if let Some(of_lens) = parameter.checked_sub(PROJECTION_PARAMETERS.len()) {
                columns[of_lens] = Some(column);
            }
        }
        columns
    }
}

fn dot(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
}

/// R times one coordinate of all knots.
fn curved(grid: &SplineGrid, knots: &[f64]) -> Vec<f64> {
    let mut curved = vec![0.0; knots.len()];
    for difference in differences(grid) {
        let value: f64 = difference.iter().map(|&(knot, part)| part * knots[knot]).sum();
        difference.iter().for_each(|&(knot, part)| curved[knot] += part * value);
    }
    curved
}

/// All second differences of a grid of knots.
pub(crate) fn differences(grid: &SplineGrid) -> impl Iterator<Item = Difference> {
    let (columns, rows) = (grid.columns, grid.rows);
    let at = move |row: usize, column: usize| row * columns + column;
    let all = (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column)));
    all.flat_map(move |(row, column)| {
        let here = at(row, column);
        let straight =
            |before: usize, after: usize| [(before, 1.0), (here, -2.0), (after, 1.0), (here, 0.0)];
        let has = |beside: usize, count: usize| beside >= 1 && beside + 1 < count;
        let along = has(column, columns).then(|| straight(here - 1, here + 1));
        let down = has(row, rows).then(|| straight(here - columns, here + columns));
        let root = std::f64::consts::SQRT_2;
        let is_inner = column + 1 < columns && row + 1 < rows;
        let across = is_inner.then(|| {
            let below = here + columns;
            [(here, root), (here + 1, -root), (below, -root), (below + 1, root)]
        });
        [along, down, across].into_iter().flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planes cost nothing, and R has no other null directions.
    #[test]
    fn only_planes_cost_nothing() {
        let grid = SplineGrid::new(3, [6, 5], 90).unwrap();
        let mut penalty = DMatrix::<f64>::zeros(30, 30);
        for difference in differences(&grid) {
            for (i, a) in difference {
                for (j, b) in difference {
                    penalty[(i, j)] += a * b;
                }
            }
        }
        let values = penalty.symmetric_eigenvalues();
        assert_eq!(values.iter().filter(|value| value.abs() < 1e-9).count(), 3, "{values}");
        assert!(values.iter().all(|&value| value > -1e-9));
        let plane = DVector::from_fn(30, |i, _| 1.0 + 0.3 * (i % 6) as f64 - 2.0 * (i / 6) as f64);
        assert!((&penalty * plane).amax() < 1e-9);
    }

    /// The family costs nothing, and the equations equal the differences of the cost.
    #[test]
    fn the_family_costs_nothing_and_equations_match_the_cost() {
        let grid = SplineGrid::new(3, [6, 5], 90).unwrap();
        let count = grid.count();
        let any = |seed: f64| -> Vec<DVec2> {
            (0..count).map(|i| DVec2::from_angle(seed * (1 + i * i) as f64)).collect()
        };
        let family = [any(0.3), any(1.1)];
        let spline = Spline::new(grid);
        let roughness = Roughness::around(&spline, &family);
        let camera = |knots: Vec<DVec2>| {
            Camera::centred(640, 480, 500.0, Lens::Spline(spline.clone().with_knots(knots)))
        };
        let parameters: Vec<(usize, usize)> = (0..2 * count).map(|i| (i + 4, i)).collect();
        let equations = |knots: Vec<DVec2>| {
            let mut matrix = DMatrix::zeros(2 * count, 2 * count);
            let mut right = DVector::zeros(2 * count);
            let cost = roughness.add(&camera(knots), &parameters, 0.7, &mut matrix, &mut right);
            (cost, matrix, right)
        };
        let of_family =
            family[0].iter().zip(&family[1]).map(|(a, b)| 0.3 * *a - 2.0 * *b).collect();
        let knots = any(2.3);
        let (cost, matrix, right) = equations(knots.clone());
        assert!(equations(of_family).0.abs() < 1e-9 * cost);
        // The cost is quadratic, so the equations give it exactly: x'Mx, and the gradient is −Mx.
        let x = DVector::from_iterator(2 * count, knots.iter().flat_map(|knot| knot.to_array()));
        assert!((cost - x.dot(&(&matrix * &x))).abs() < 1e-9 * cost);
        assert!((&matrix * &x + right).amax() < 1e-9 * cost);
        let values = matrix.symmetric_eigenvalues();
        let zero = values.iter().filter(|value| value.abs() < 1e-9 * values.max()).count();
        assert_eq!(2 * count - zero, roughness.rank());
    }
}
