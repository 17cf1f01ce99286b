use glam::{DMat2, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::law::{Imaged, LensLaw, Ray};

/// Range of knots along a side: the minimum is one patch of the cubic spline, and the maximum
/// exceeds what any calibration determines.
const KNOTS: std::ops::RangeInclusive<usize> = 4..=40;

/// Range of the field of view that a grid covers, degrees; at 360° the plane is infinite.
const FOV_X_DEG: std::ops::RangeInclusive<u32> = 1..=350;

/// Relative distance from the direction opposite to the axis below which points have no position on the plane.
const BEHIND: f64 = 1e-6;

/// Maximum number of Newton iterations of the inverse; from a start within half a knot spacing, six
/// give full precision.
const ITERATIONS: usize = 50;

/// Number of halvings of a step that increases the residual.
const HALVINGS: usize = 20;

/// Convergence threshold of Newton steps, dimensionless.
const CONVERGED: f64 = 1e-14;

/// Number of directions in the search for a fold, and of steps per knot spacing.
const DIRECTIONS: usize = 64;
const STEPS_A_KNOT: f64 = 4.0;

/// Grid of spline knots over the stereographic plane.
///
/// The grid is centred on the plane with equal distances h along both axes. The spline is
/// determined across a horizontal field of view of `fov_x_deg`. For degree 3 this range ends one
/// knot spacing inside the outermost knots, for degree 2 half a spacing.
///
/// ```text
///     (columns − 3) h = 4 tan(fov_x/4)   degree 3        (columns − 2) h = 4 tan(fov_x/4)   degree 2
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplineGrid {
    /// Degree of the polynomials, 2 or 3.
    pub degree: usize,
    /// Number of knots along x.
    pub columns: usize,
    /// Number of knots along y.
    pub rows: usize,
    /// Field of view along x over which the spline is determined, whole degrees.
    pub fov_x_deg: u32,
}

/// An invalid grid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SplineGridError(String);

/// A lens of arbitrary smooth shape: the stereographic projection with a correction by two tensor-product B-splines.
///
/// ```text
///     θ = ∠(point, axis),  u = 2 tan(θ/2) · (X, Y)/‖(X, Y)‖ = 2 (X, Y)/(‖(X, Y, Z)‖ + Z)
///     (i, j) = u/h + (columns − 1, rows − 1)/2                  in knots
///     (x', y') = u + Σ B(i − a) B(j − b) d_ab                   a: column, b: row
/// ```
///
/// Here B is the uniform B-spline of this degree. So the image of a point depends on the (degree +
/// 1)² knots around it. Beyond the
/// grid the outermost polynomials continue, but points there are invalid. Within the grid, points are valid where
/// orientation is preserved (∂(x', y')/∂u has a positive determinant). Parameters are dx, dy of the knots, row by
/// row.
///
/// Formula, parameter order and grid are those of mrcal's `LENSMODEL_SPLINED_STEREOGRAPHIC`
/// (<https://mrcal.secretsauce.net/lensmodels.html>). fx, fy, cx, cy are redundant with the knots, so a calibration
/// keeps them fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    grid: SplineGrid,
    /// Corrections d_ab, row by row.
    knots: Vec<DVec2>,
}

/// The knots that affect the image of a point, with their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knots {
    /// Column and row of the first knot.
    first: [usize; 2],
    /// Number of columns of the grid.
    columns: usize,
    /// Degree + 1.
    order: usize,
    /// Values of B along columns and rows.
    along: [[f64; MAX_ORDER]; 2],
}

/// Largest number of knots along one axis that affect a point.
const MAX_ORDER: usize = 4;

/// Largest number of parameters that affect the image of a point.
#[doc(hidden)]
pub const MAX_TOUCHED: usize = 2 * MAX_ORDER * MAX_ORDER;

impl Knots {
    /// Returns the indices, row by row, with their weights.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let Self { first: [column, row], columns, order, along } = *self;
        let pairs = (0..order).flat_map(move |b| (0..order).map(move |a| (a, b)));
        pairs.map(move |(a, b)| ((row + b) * columns + column + a, along[0][a] * along[1][b]))
    }

    /// Returns the weight of a knot; zero for distant ones.
    pub fn part(&self, knot: usize) -> f64 {
        let Self { first: [column, row], columns, order, along } = *self;
        let a = (knot % columns).wrapping_sub(column);
        let b = (knot / columns).wrapping_sub(row);
        if a < order && b < order { along[0][a] * along[1][b] } else { 0.0 }
    }
}

impl SplineGrid {
    /// Creates a grid.
    ///
    /// # Errors
    /// Returns an error if a number is out of its range.
    pub fn new(
        degree: usize,
        [columns, rows]: [usize; 2],
        fov_x_deg: u32,
    ) -> Result<Self, SplineGridError> {
        let problem = match () {
            () if !(2..=3).contains(&degree) => format!("degree {degree} is not 2 or 3"),
            () if ![columns, rows].iter().all(|knots| KNOTS.contains(knots)) => {
                let (least, most) = (KNOTS.start(), KNOTS.end());
                format!("{columns} × {rows} knots: each side must have {least} to {most}")
            }
            () if !FOV_X_DEG.contains(&fov_x_deg) => {
                let (least, most) = (FOV_X_DEG.start(), FOV_X_DEG.end());
                format!("a field of view of {fov_x_deg}° is not between {least}° and {most}°")
            }
            () => return Ok(Self { degree, columns, rows, fov_x_deg }),
        };
        Err(SplineGridError(problem))
    }

    /// Checks a grid read from a file.
    ///
    /// # Errors
    /// Returns an error if a number is out of its range.
    pub fn checked(self) -> Result<Self, SplineGridError> {
        Self::new(self.degree, [self.columns, self.rows], self.fov_x_deg)
    }

    /// Returns a grid that is determined over |u| up to `reach`. Its knots are at most `distance`
    /// apart, unless there would be too many.
    pub fn dense(degree: usize, distance: f64, reach: DVec2) -> Self {
        let (least, most) = (*KNOTS.start() as f64, *KNOTS.end() as f64);
        let knots = (2.0 * reach / distance).ceil() + degree as f64;
        let knots = knots.to_array().map(|knots| knots.clamp(least, most) as usize);
        Self::over(degree, knots, reach)
    }

    /// Returns the narrowest grid that is determined over |u| up to `reach`.
    pub fn over(degree: usize, [columns, rows]: [usize; 2], reach: DVec2) -> Self {
        let intervals = |knots: usize| (knots - degree) as f64;
        let h = (2.0 * reach.x / intervals(columns)).max(2.0 * reach.y / intervals(rows));
        let fov_x = 4.0 * (h * intervals(columns) / 4.0).atan();
        let (least, most) = (f64::from(*FOV_X_DEG.start()), f64::from(*FOV_X_DEG.end()));
        let fov_x_deg = fov_x.to_degrees().ceil().clamp(least, most) as u32;
        Self { degree, columns, rows, fov_x_deg }
    }

    /// Returns the number of knots.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// Returns the distance h of neighbouring knots on the plane.
    pub fn distance(&self) -> f64 {
        4.0 * (f64::from(self.fov_x_deg).to_radians() / 4.0).tan()
            / (self.columns - self.degree) as f64
    }

    /// Returns the largest |u| along both axes where the spline is determined.
    pub fn reach(&self) -> DVec2 {
        let intervals = [self.columns, self.rows].map(|knots| (knots - self.degree) as f64);
        DVec2::from(intervals) * self.distance() / 2.0
    }

    /// Returns the knots at a point u, and the derivatives of their weights along u, 1/h.
    fn at(&self, u: DVec2) -> (Knots, [[f64; MAX_ORDER]; 2]) {
        let middle = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64) / 2.0;
        let place = (u / self.distance() + middle).to_array();
        let of = |axis: usize| basis(self.degree, place[axis], [self.columns, self.rows][axis]);
        let [x, y] = [of(0), of(1)];
        let (first, along) = ([x.first, y.first], [x.value, y.value]);
        let knots = Knots { first, columns: self.columns, order: self.degree + 1, along };
        (knots, [x.slope, y.slope])
    }
}

/// The nonzero B-splines at a point.
struct Basis {
    /// Index of the first one.
    first: usize,
    value: [f64; MAX_ORDER],
    /// Derivatives with respect to the coordinate.
    slope: [f64; MAX_ORDER],
}

/// Degree 3, with t from the previous knot, 0 to 1:
///
/// ```text
///     (1 − t)³/6,  (3t³ − 6t² + 4)/6,  (−3t³ + 3t² + 3t + 1)/6,  t³/6
/// ```
///
/// Degree 2, with t from the nearest knot, −½ to ½:
///
/// ```text
///     (½ − t)²/2,  ¾ − t²,  (½ + t)²/2
/// ```
fn basis(degree: usize, place: f64, count: usize) -> Basis {
    let nearest = |offset: f64, most: usize| (place + offset).floor().clamp(1.0, most as f64);
    if degree == 3 {
        let knot = nearest(0.0, count - 3);
        let t = place - knot;
        let s = 1.0 - t;
        let value = [
            s * s * s / 6.0,
            (t * t * (3.0 * t - 6.0) + 4.0) / 6.0,
            (t * (t * (3.0 - 3.0 * t) + 3.0) + 1.0) / 6.0,
            t * t * t / 6.0,
        ];
        let slope = [-s * s / 2.0, t * (1.5 * t - 2.0), t * (1.0 - 1.5 * t) + 0.5, t * t / 2.0];
        Basis { first: knot as usize - 1, value, slope }
    } else {
        let knot = nearest(0.5, count - 2);
        let t = place - knot;
        let (low, high) = (0.5 - t, 0.5 + t);
        Basis {
            first: knot as usize - 1,
            value: [low * low / 2.0, 0.75 - t * t, high * high / 2.0, 0.0],
            slope: [-low, -2.0 * t, high, 0.0],
        }
    }
}

/// Maps a direction to the point u; `None` close to the opposite of the axis.
fn flattened(point: DVec3) -> Option<DVec2> {
    let (length, sum) = (point.length(), point.length() + point.z);
    (sum > BEHIND * length).then(|| 2.0 * point.truncate() / sum)
}

/// Maps a point u to its direction.
#[doc(hidden)]
pub fn direction(u: DVec2) -> DVec3 {
    let q = u.length_squared();
    (4.0 * u).extend(4.0 - q) / (4.0 + q)
}

impl Spline {
    /// Creates the stereographic lens with a grid.
    pub fn new(grid: SplineGrid) -> Self {
        Self { grid, knots: vec![DVec2::ZERO; grid.count()] }
    }

    /// Returns the lens with new knots, row by row; their number stays the same.
    #[must_use]
    pub fn with_knots(self, knots: Vec<DVec2>) -> Self {
        debug_assert_eq!(knots.len(), self.grid.count());
        Self { knots, ..self }
    }

    /// Returns the grid.
    pub fn grid(&self) -> SplineGrid {
        self.grid
    }

    /// Returns the corrections d_ab, row by row.
    pub fn knots(&self) -> &[DVec2] {
        &self.knots
    }

    /// Returns the knots at a point u.
    #[doc(hidden)]
    pub fn knots_at(&self, u: DVec2) -> Knots {
        self.grid.at(u).0
    }

    /// Returns the knots that affect the image of a point.
    pub(super) fn knots_of(&self, point: DVec3) -> Option<Knots> {
        Some(self.knots_at(flattened(point)?))
    }

    /// Returns (x', y') and ∂(x', y')/∂u, by columns.
    fn bent(&self, u: DVec2) -> (DVec2, DMat2) {
        let (Knots { first: [column, row], columns, order, along }, slopes) = self.grid.at(u);
        let (mut at, mut by) = (DVec2::ZERO, [DVec2::ZERO; 2]);
        for b in 0..order {
            let start = (row + b) * columns + column;
            let (mut sum, mut slope) = (DVec2::ZERO, DVec2::ZERO);
            for (a, &knot) in self.knots[start..start + order].iter().enumerate() {
                sum += along[0][a] * knot;
                slope += slopes[0][a] * knot;
            }
            at += along[1][b] * sum;
            by[0] += along[1][b] * slope;
            by[1] += slopes[1][b] * sum;
        }
        let [x, y] = by.map(|by| by / self.grid.distance());
        (u + at, DMat2::from_cols(DVec2::X + x, DVec2::Y + y))
    }

    /// Returns whether the spline is determined at a point and preserves orientation there.
    fn is_valid(&self, u: DVec2) -> bool {
        let is_within = u.abs().cmple(self.grid.reach() * (1.0 + 1e-12)).all();
        is_within && self.bent(u).1.determinant() > 0.0
    }

    /// Returns the start of the inverse: the midpoint between knots whose image is closest.
    fn nearest(&self, at: DVec2) -> Option<DVec2> {
        let (h, reach) = (self.grid.distance(), self.grid.reach());
        let [columns, rows] = [self.grid.columns, self.grid.rows].map(|n| n - self.grid.degree);
        let places = (0..rows).flat_map(|b| (0..columns).map(move |a| (a, b)));
        let places = places.map(|(a, b)| (DVec2::new(a as f64, b as f64) + 0.5) * h - reach);
        let imaged = places.filter_map(|u| {
            let (image, by) = self.bent(u);
            (by.determinant() > 0.0).then(|| (image.distance_squared(at), u))
        });
        imaged.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, u)| u)
    }
}

impl LensLaw for Spline {
    fn names(&self) -> Vec<String> {
        let columns = self.grid.columns;
        let knots = (0..self.knots.len()).map(|knot| (knot / columns, knot % columns));
        knots.flat_map(|(row, col)| ["dx", "dy"].map(|d| format!("{d}_{row}_{col}"))).collect()
    }

    fn parameters(&self) -> Vec<f64> {
        self.knots.iter().flat_map(|knot| knot.to_array()).collect()
    }

    fn set_parameters(&mut self, values: &[f64]) {
        for (knot, value) in self.knots.iter_mut().zip(values.chunks_exact(2)) {
            *knot = DVec2::from_slice(value);
        }
    }

    /// [`Spline::knots_of`] provides the derivatives with respect to the parameters.
    fn image(&self, point: DVec3, _: &mut [[f64; 2]]) -> Option<Imaged> {
        let u = flattened(point)?;
        let (at, by_u) = self.bent(u);
        // u = 2 (X, Y)/s with s = ‖P‖ + Z.
        let length = point.length();
        let sum = length + point.z;
        let sum_by = point / length + DVec3::Z;
        let u_by = [0, 1].map(|axis| (2.0 * DVec3::AXES[axis] - u[axis] * sum_by) / sum);
        let rows = by_u.transpose();
        let by_point =
            [rows.x_axis, rows.y_axis].map(|by| (by.x * u_by[0] + by.y * u_by[1]).to_array());
        Some(Imaged { at, by_point })
    }

    fn covers(&self, point: DVec3) -> bool {
        flattened(point).is_some_and(|u| self.is_valid(u))
    }

    /// Uses Newton's method from the closest midpoint between knots; halves steps until the residual decreases.
    fn ray(&self, at: DVec2) -> Option<Ray> {
        let mut u = self.nearest(at)?;
        for _ in 0..ITERATIONS {
            let (image, by) = self.bent(u);
            let off = at - image;
            let step = by.inverse() * off;
            if !step.is_finite() {
                return None;
            }
            let nearer = |part: f64| {
                let next = u + part * step;
                (self.bent(next).0.distance_squared(at) < off.length_squared()).then_some(next)
            };
            let mut parts = (0..HALVINGS).map(|halving| 0.5f64.powi(halving as i32));
            let Some(next) = parts.find_map(nearer) else { break };
            let moved = next.distance(u);
            u = next;
            if moved <= CONVERGED * (1.0 + u.length()) {
                break;
            }
        }
        let is_found = self.bent(u).0.distance(at) <= 1e-9 * (1.0 + at.length());
        (is_found && self.is_valid(u)).then(|| direction(u)).and_then(Ray::central)
    }

    /// Returns the smallest radius at which the spline folds, over all directions in which it is determined.
    fn monotonic_radius(&self) -> Option<f64> {
        let (reach, step) = (self.grid.reach(), self.grid.distance() / STEPS_A_KNOT);
        let fold = |direction: usize| {
            let along =
                DVec2::from_angle(direction as f64 / DIRECTIONS as f64 * std::f64::consts::TAU);
            let places = (0..).map(|i| step * f64::from(i) * along);
            let mut within = places.take_while(|u| u.abs().cmple(reach).all());
            let folded = within.find(|&u| self.bent(u).1.determinant() <= 0.0)?;
            Some(self.bent(folded).0.length())
        };
        (0..DIRECTIONS).filter_map(fold).min_by(f64::total_cmp)
    }
}
