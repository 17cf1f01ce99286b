//! Fits a single corner by Levenberg–Marquardt.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

use super::beside::Beside;
use super::columns::{ALL, Columns, Shown, fill_columns};
use super::corner::{ANGLE, Corner, LN_BLUR, MIN_BLUR_PX, PARAMS, SLOPE, X, Y};
use super::look::Look;
use super::sums::{ends, products, squares};
use super::window::{MAX_PIXELS, Window};
use crate::refine::optics::Optics;
use crate::refine::small_systems::solved;
use deltille_core::damping::Damping;
use deltille_core::detection::Piece;
use deltille_core::raster::ImageView;

/// Columns that are multiplied with each other: parameters, residual, and padding to blocks of four.
const BLOCKED: usize = (PARAMS + 1usize).next_multiple_of(4);

/// Prior standard deviation of the relative slope of the illumination, 1/px: 10 % across 200 px. Light that falls to a
/// tenth across 1600 px has 0.0014, which a window of 21 px can still measure.
pub const SLOPE_PRIOR: f64 = 0.0005;

/// Degrees of freedom of the prior on the slope, Student's distribution. Most light changes little. At the edge of a shadow,
/// it changes 50 times as fast, which a Gaussian prior would not allow.
const SLOPE_FREEDOM: f64 = 10.0;

/// The same if the sensor clipped pixels, nearly a Gaussian distribution: the slope of clipped light is hardly visible.
const CLIPPED_SLOPE_FREEDOM: f64 = 1e9;

/// Largest change of the light at the end of the window in the last step, relative to the light. After a larger change,
/// the prior has another weight.
const MAX_LIGHT_STEP: f64 = 0.01;

/// Maximum number of evaluations of the model; five are usual.
const MAX_EVALUATIONS: usize = 25;

/// Damping of the first step, which starts from a fit to grey values without blur.
const DAMPING: f64 = 1e-3;

/// Minimum damping later on; a smaller one changes no digit of a step.
const MIN_DAMPING: f64 = 1e-6;

/// Damping below which a small step means that the minimum is near, not that the damping shortens steps.
const NEARLY_UNDAMPED: f64 = 0.1;

/// Squared length of a step, in standard deviations of the estimate, below which the fit has converged. The next step
/// would be smaller by orders of magnitude.
const CONVERGED: f64 = 0.25;

/// Alternative limit of the step in position (px), logarithm of the blur, and three times the angles. The remaining
/// error is of the order of its square, σ/50 in photographs.
const FINE: f64 = 0.03;

/// Limit of the step for a rough fit, in px and the logarithm of the blur. The remaining error is of the order of its
/// square.
const ROUGH: f64 = 0.15;

/// Change of black and white, relative to the contrast, within which the piece of a tone curve is kept. Its curvature,
/// at most a third, then changes by the same fraction of itself.
const SAME_LIGHT: f64 = 0.01;

/// The same for a rough fit, whose light another fit refines.
const ROUGHLY_SAME_LIGHT: f64 = 0.1;

/// Distance from the corner at which a rotation moves an edge as much as the position does, px: the end of the smallest
/// window.
const ARM_PX: f64 = 3.0;

/// Minimum assumed noise, relative to the amplitude, so that noiseless images converge too.
const MIN_NOISE: f64 = 2e-5;

/// Maximum distance of a corner from its start, px; the start is the result of the polynomial.
pub(crate) const MAX_WAY_PX: f64 = 1.5;

/// Maximum residual, relative to the amplitude. With a larger residual, the window shows something
/// other than a corner, unless the residuals vary from pixel to pixel like noise.
const MAX_RESIDUAL: f64 = 0.35;

/// Mean squared difference of neighbouring residuals, relative to white noise (von Neumann's
/// ratio), above which residuals are noise. Systematic residuals have a fraction of this ratio.
const MIN_WHITENESS: f64 = 0.7;

/// Maximum standard deviation of a valid position, px.
const MAX_SIGMA_PX: f64 = 1.0;

/// Sensor limits that no pixel reaches.
const UNLIMITED: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// Accuracy of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Accuracy {
    /// A few hundredths of a pixel: a start for another fit.
    Rough,
    /// Limited by the noise.
    Full,
}

/// A fitted corner and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fitted<const K: usize> {
    /// The corner.
    pub corner: Corner<K>,
    /// Covariance xx, xy, yy of the position, px².
    pub cov: [f64; 3],
    /// Standard deviation of the noise, as a fraction of full scale.
    pub noise: f64,
    /// Mean squared difference of neighbouring residuals, relative to white noise. It is smaller
    /// for systematic residuals.
    pub whiteness: f64,
}

/// Fits corners. A fitter owns its workspace, so each thread needs its own.
#[derive(Clone, Debug)]
pub(crate) struct CornerFitter {
    /// Pixels; full scale is 1.
    pub(super) pixels: Box<[f32; MAX_PIXELS]>,
    /// Derivatives with respect to the parameters, then the residual.
    pub(super) columns: Box<Columns>,
    /// Values at which the sensor clipped pixels of the window, or infinite values if it clipped
    /// none.
    pub(super) limits: [f32; 2],
    /// Standard deviation of the rounding of pixels: without noise, rounding errors are still unknown.
    rounding: f64,
    /// Effect of the borders of tags.
    beside: Box<Beside>,
}

impl Default for CornerFitter {
    fn default() -> Self {
        Self {
            pixels: Box::new([0.0; MAX_PIXELS]),
            columns: Box::new([[0.0; MAX_PIXELS]; ALL]),
            limits: UNLIMITED,
            rounding: 0.0,
            beside: Box::default(),
        }
    }
}

/// The normal equations at one position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normal {
    /// JᵀJ, with ones for missing parameters.
    pub(super) matrix: SMatrix<f64, PARAMS, PARAMS>,
    /// Jᵀr.
    pub(super) gradient: SVector<f64, PARAMS>,
    /// rᵀr.
    pub(super) cost: f64,
}

impl CornerFitter {
    /// Fits the corner near `start`. Returns `None` if the window leaves the image or the fit is not a corner.
    pub(crate) fn fit<const K: usize>(
        &mut self,
        image: ImageView,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
        accuracy: Accuracy,
    ) -> Option<Fitted<K>> {
        let centre = self.load(image, window, start.position)?;
        let start = Corner { position: start.position - centre, ..*start };
        let mut fitted = self.descend(window, &start, optics, accuracy);
        if fitted.is_none() && self.limits != UNLIMITED {
            // Black and white may equal the limits: a rendered page contains only these two values.
            self.limits = UNLIMITED;
            fitted = self.descend(window, &start, optics, accuracy);
        }
        fitted.map(|fitted| {
            let position = fitted.corner.position + centre;
            Fitted { corner: Corner { position, ..fitted.corner }, ..fitted }
        })
    }

    /// Fits like [`Self::fit`] to the loaded pixels, in window coordinates.
    fn descend<const K: usize>(
        &mut self,
        window: &Window,
        start: &Corner<K>,
        optics: &Optics,
        accuracy: Accuracy,
    ) -> Option<Fitted<K>> {
        let start = *start;
        let freedom = (window.count - (ANGLE + K)) as f64;
        let mut corner = start;
        let mut damping = Damping::from(DAMPING).at_least(MIN_DAMPING, 0.0);
        // The piece of the curve is fixed, so that steps account for all that they change. It is renewed after the
        // first step, which finds the light, and after the last.
        let mut toned = start;
        let mut piece = optics.piece(toned.level, toned.amplitude);
        let mut normal = self.normal(window, &corner, optics, piece);
        let mut converged = false;
        for evaluations in 1..MAX_EVALUATIONS {
            let noise = self.noise(normal.cost / freedom, &corner);
            let (mut matrix, mut gradient) = self.with_prior(&normal, &corner, noise);
            if corner.blur_px <= MIN_BLUR_PX && gradient[LN_BLUR] < 0.0 {
                // The blur is at its minimum.
                (0..PARAMS).for_each(|i| (matrix[(i, LN_BLUR)], matrix[(LN_BLUR, i)]) = (0.0, 0.0));
                (matrix[(LN_BLUR, LN_BLUR)], gradient[LN_BLUR]) = (1.0, 0.0);
            }
            let mut damped = matrix;
            for i in 0..PARAMS {
                damped[(i, i)] = damping.grown(damped[(i, i)]);
            }
            let rows = std::array::from_fn::<[f64; PARAMS + 1], PARAMS, _>(|i| {
                std::array::from_fn(|j| if j < PARAMS { damped[(i, j)] } else { gradient[i] })
            });
            let solution = solved(rows)?;
            let step = SVector::from_fn(|i, _| solution[i][PARAMS]);
            let Some(moved) = corner.moved(&step, window.radius) else {
                damping.stiffen();
                continue;
            };
            let is_toned_anew =
                |tolerance| optics.is_toned() && !moved.is_lit_like(&toned, tolerance);
            let (is_last, tolerance) = match accuracy {
                Accuracy::Full => {
                    let small = step.dot(&(matrix * step)) < CONVERGED * noise * noise;
                    let slope_step = DVec2::new(step[SLOPE], step[SLOPE + 1]).length();
                    let is_lit = slope_step * (window.radius as f64) < MAX_LIGHT_STEP;
                    (is_lit && (small || is_within(&step, FINE)), SAME_LIGHT)
                }
                Accuracy::Rough => (is_within(&step, ROUGH), ROUGHLY_SAME_LIGHT),
            };
            if is_last && damping.part() < NEARLY_UNDAMPED {
                converged = true;
                corner = moved;
                if !is_toned_anew(tolerance) {
                    normal.cost = (normal.cost - gradient.dot(&step)).max(0.0);
                    break;
                }
                toned = moved;
                piece = optics.piece(toned.level, toned.amplitude);
                normal = self.normal(window, &corner, optics, piece);
                continue;
            }
            if evaluations == 1 && is_toned_anew(SAME_LIGHT) {
                toned = moved;
                piece = optics.piece(toned.level, toned.amplitude);
            }
            let there = self.normal(window, &moved, optics, piece);
            let prior =
                |c: &Corner<K>| noise * noise * slope_penalty(c.slope, self.slope_freedom());
            if there.cost + prior(&moved) <= normal.cost + prior(&corner) {
                (corner, normal) = (moved, there);
                damping.ease();
            } else {
                damping.stiffen();
            }
        }
        let noise = self.noise(normal.cost / freedom, &corner);
        let matrix = self.with_prior(&normal, &corner, noise).0;
        let rows = std::array::from_fn::<[f64; PARAMS + 2], PARAMS, _>(|i| {
            std::array::from_fn(|j| match j.checked_sub(PARAMS) {
                None => matrix[(i, j)],
                Some(column) => f64::from(i == column),
            })
        });
        let solution = solved(rows)?;
        let cov = |i: usize, j: usize| noise * noise * solution[i][PARAMS + j];
        let way = corner.position.distance(start.position);
        let whiteness = self.whiteness(window);
        let trusted = converged
            && way <= MAX_WAY_PX
            && corner.edges_are_apart()
            && (noise < MAX_RESIDUAL * corner.amplitude.abs() || whiteness > MIN_WHITENESS)
            && cov(X, X) + cov(Y, Y) < MAX_SIGMA_PX * MAX_SIGMA_PX;
        trusted.then_some(Fitted {
            corner,
            cov: std::array::from_fn(|i| {
                let (row, column) = [(X, X), (X, Y), (Y, Y)][i];
                optics.inflation * cov(row, column) + optics.shift[i]
            }),
            noise,
            whiteness,
        })
    }

    /// Loads the pixels around a position. Returns the centre of the window, or `None` outside the image.
    pub(super) fn load(
        &mut self,
        image: ImageView,
        window: &Window,
        position: DVec2,
    ) -> Option<DVec2> {
        let centre = position.round();
        window.read(image, centre, &mut self.pixels)?;
        self.rounding = image.rounding_sd();
        let (low, high) = ends(&self.pixels[..window.count]);
        self.limits = [
            if low <= 0.0 { low } else { UNLIMITED[0] },
            if high >= 1.0 { high } else { UNLIMITED[1] },
        ];
        Some(centre)
    }

    /// Returns whether the sensor clipped the brightest of the loaded pixels.
    pub(crate) fn is_white_clipped(&self) -> bool {
        self.limits[1] != UNLIMITED[1]
    }

    /// Returns the pixels around a position, with a full scale of 1; `None` if one lies outside the
    /// image.
    pub(crate) fn pixels(
        &mut self,
        image: ImageView,
        window: &Window,
        position: DVec2,
    ) -> Option<&[f32]> {
        self.load(image, window, position)?;
        Some(&self.pixels[..window.count])
    }

    /// Returns the noise of the loaded pixels, given the mean square of the residuals.
    pub(super) fn noise<const K: usize>(&self, mean_square: f64, corner: &Corner<K>) -> f64 {
        mean_square.sqrt().max(self.rounding).max(MIN_NOISE * corner.amplitude.abs())
    }

    /// Returns von Neumann's ratio of the residuals along the rows: 1 for white noise.
    fn whiteness(&self, window: &Window) -> f64 {
        let mut rest = &self.columns[PARAMS][..window.count];
        let (mut sum, mut of_steps, mut steps) = (0.0, 0.0, 0);
        for &(_, length) in &window.runs {
            let (run, after) = rest.split_at(length);
            let [square, of_step] = squares(run).map(f64::from);
            sum += square;
            of_steps += of_step;
            steps += length - 1;
            rest = after;
        }
        of_steps / (2 * steps) as f64 / (sum / window.count as f64)
    }

    /// Returns the normal equations of the pixels at a corner in window coordinates.
    pub(super) fn normal<const K: usize>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: &Optics,
        piece: Piece,
    ) -> Normal {
        self.fill::<K, false>(window, corner, optics, piece);
        let products = products::<BLOCKED>(&mut self.columns, window.count);
        let mut normal = Normal {
            matrix: SMatrix::identity(),
            gradient: SVector::zeros(),
            cost: products[PARAMS][PARAMS],
        };
        for (i, row) in products.iter().enumerate().take(ANGLE + K) {
            normal.gradient[i] = row[PARAMS];
            for (j, &product) in row.iter().enumerate().take(ANGLE + K).skip(i) {
                normal.matrix[(i, j)] = product;
                normal.matrix[(j, i)] = product;
            }
        }
        normal
    }

    /// Returns the degrees of freedom of the prior on the slopes of the loaded pixels.
    fn slope_freedom(&self) -> f64 {
        if self.limits == UNLIMITED { SLOPE_FREEDOM } else { CLIPPED_SLOPE_FREEDOM }
    }

    /// Returns the weight of a slope in the normal equations, given the noise of the pixels: half the derivative of
    /// [`slope_penalty`], divided by the slope.
    pub(super) fn slope_weight(&self, slope: DVec2, noise: f64) -> f64 {
        let relative = (slope / SLOPE_PRIOR).length_squared();
        (noise / SLOPE_PRIOR).powi(2) / (1.0 + relative / self.slope_freedom())
    }

    /// Returns the normal equations with the prior on the slopes.
    pub(super) fn with_prior<const K: usize>(
        &self,
        normal: &Normal,
        corner: &Corner<K>,
        noise: f64,
    ) -> (SMatrix<f64, PARAMS, PARAMS>, SVector<f64, PARAMS>) {
        let weight = self.slope_weight(corner.slope, noise);
        let (mut matrix, mut gradient) = (normal.matrix, normal.gradient);
        for (i, slope) in corner.slope.to_array().iter().enumerate() {
            matrix[(SLOPE + i, SLOPE + i)] += weight;
            gradient[SLOPE + i] -= weight * slope;
        }
        (matrix, gradient)
    }

    /// Calls [`fill_columns`] for a corner in window coordinates.
    pub(super) fn fill<const K: usize, const JOINT: bool>(
        &mut self,
        window: &Window,
        corner: &Corner<K>,
        optics: &Optics,
        piece: Piece,
    ) {
        // Light on the print that increases by a fraction g per pixel, blurred by s, displaces the pattern by s²g.
        let displacement = corner.blur_px.powi(2) * corner.slope;
        let corner = &Corner { position: corner.position - displacement, ..*corner };
        let look = Look::of(corner, optics, piece, self.limits);
        self.beside.fill(window, corner, optics);
        let shown = Shown { pixels: &self.pixels, beside: &self.beside };
        fill_columns::<K, JOINT>(&mut self.columns, shown, window, corner, &look);
    }
}

/// Returns whether a step is shorter than `limit`, in position (px), in the logarithm of the blur, and in the
/// displacement by rotation at [`ARM_PX`].
fn is_within(step: &SVector<f64, PARAMS>, limit: f64) -> bool {
    step[X].hypot(step[Y]) < limit
        && step[LN_BLUR].abs() < limit
        && step.iter().skip(ANGLE).all(|turn| turn.abs() < limit / ARM_PX)
}

/// Returns −2 ln of the prior density of a slope, up to a constant.
fn slope_penalty(slope: DVec2, freedom: f64) -> f64 {
    let relative = (slope / SLOPE_PRIOR).length_squared();
    freedom * (relative / freedom).ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::model::window::Border;
    use deltille_core::raster::Gray;

    /// A corner off the centre of its window, in uneven light, with curved edges.
    fn corner<const K: usize>(amplitude: f64) -> Corner<K> {
        Corner {
            position: DVec2::new(0.3, -0.2),
            blur_px: 1.1,
            amplitude,
            level: 0.5,
            slope: DVec2::new(0.0004, -0.0002),
            angles: std::array::from_fn(|k| 0.4 + 1.1 * k as f64),
            bends: std::array::from_fn(|k| 0.004 * k as f64 - 0.003),
            across_px: std::array::from_fn(|k| 20.0 + k as f64),
        }
    }

    /// A plain image, and one with uneven blur, a halo and ink.
    fn optics() -> [Optics; 2] {
        let mut all = Optics::default();
        (all.astigmatism, all.halo, all.ink) = ([0.2, -0.15], [0.3, 2.5], 0.4);
        [Optics::default(), all]
    }

    /// Returns the pixels of a window as the model predicts them for a corner.
    fn shown<const K: usize>(window: &Window, corner: &Corner<K>, optics: &Optics) -> Vec<f32> {
        let mut fitter = CornerFitter::default();
        let piece = optics.piece(corner.level, corner.amplitude);
        fitter.fill::<K, false>(window, corner, optics, piece);
        fitter.columns[PARAMS][..window.count].iter().map(|residual| -residual).collect()
    }

    /// The borders of tags in two tiles that meet diagonally at [`corner`], 4 px from its edges.
    fn borders() -> [Border; 2] {
        let [along, beside] = [0.4, 1.5].map(DVec2::from_angle);
        [1.0, -1.0].map(|side| {
            [[4.0, 4.0], [16.0, 4.0], [16.0, 16.0], [4.0, 16.0]]
                .map(|[a, b]| side * (a * along + b * beside))
        })
    }

    #[test]
    fn derivatives_match_difference_quotients() {
        fn check<const K: usize>(corner: &Corner<K>, optics: &Optics, borders: &[Border]) {
            let window = Window::new(8).with_borders(borders);
            let mut fitter = CornerFitter::default();
            let piece = optics.piece(corner.level, corner.amplitude);
            fitter.fill::<K, false>(&window, corner, optics, piece);
            for parameter in 0..ANGLE + K {
                let size = if (SLOPE..ANGLE).contains(&parameter) { 1e-3 } else { 4e-3 };
                let [after, before] = [size, -size].map(|by| {
                    let mut step = SVector::zeros();
                    step[parameter] = by;
                    shown(&window, &corner.moved(&step, window.radius).unwrap(), optics)
                });
                let column = &fitter.columns[parameter][..window.count];
                let scale = column.iter().fold(0.0f32, |most, by| most.max(by.abs()));
                for ((by, after), before) in column.iter().zip(after).zip(before) {
                    let quotient = (after - before) / (2.0 * size as f32);
                    let off = (by - quotient).abs() / scale;
                    // The triangle that ink leaves between three edges uses difference quotients itself.
                    let most = if optics.ink == 0.0 { 1e-3 } else { 2e-2 };
                    assert!(off < most, "{K} edges, parameter {parameter}: {by} {quotient}");
                }
            }
        }
        for (optics, amplitude) in optics().iter().zip([0.35, -0.35]) {
            check::<2>(&corner(amplitude), optics, &[]);
            check::<2>(&corner(amplitude), optics, &borders());
            check::<3>(&corner(amplitude), optics, &[]);
        }
    }

    /// From a start near the corner, the fit to a rendered model finds every parameter and leaves
    /// no residual.
    #[test]
    fn a_corner_is_recovered_from_its_own_image() {
        fn check<const K: usize>(truth: &Corner<K>, optics: &Optics, borders: &[Border]) {
            const MIDDLE: usize = 12;
            let window = Window::new(9).with_borders(borders);
            let whole = Window::new(MIDDLE).with_borders(borders);
            let pixels = shown(&whole, truth, optics);
            let side = 2 * MIDDLE + 1;
            let picture = Gray::from_fn(side, side, |x, y| pixels[y * side + x]);
            let position = truth.position + MIDDLE as f64;
            let start = Corner {
                position: position + DVec2::new(-0.4, 0.3),
                blur_px: 0.8 * truth.blur_px,
                amplitude: 0.8 * truth.amplitude,
                slope: DVec2::ZERO,
                angles: truth.angles.map(|angle| angle + 0.05),
                ..*truth
            };
            let mut fitter = CornerFitter::default();
            let found = fitter.fit((&picture).into(), &window, &start, optics, Accuracy::Full);
            let found = found.expect("a corner");
            // The blur of borders has no derivative, so the fit ends close to its minimum.
            let most = if borders.is_empty() { 1e-3 } else { 5e-3 };
            assert!(found.noise < most * truth.amplitude.abs(), "{K} edges: {found:?}");
            let found = found.corner;
            let off = found.position - position;
            assert!(off.length() < 1e-3, "{K} edges: {off:?}");
            let pairs = [
                (found.blur_px, truth.blur_px),
                (found.amplitude, truth.amplitude),
                (found.level, truth.level),
            ];
            let angles = found.angles.into_iter().zip(truth.angles);
            for (found, truth) in pairs.into_iter().chain(angles) {
                assert!((found - truth).abs() < 3e-3, "{K} edges: {found} {truth}");
            }
        }
        for (optics, amplitude) in optics().iter().zip([0.35, -0.35]) {
            check::<2>(&corner(amplitude), optics, &[]);
            check::<2>(&corner(amplitude), optics, &borders());
            check::<3>(&corner(amplitude), optics, &[]);
        }
    }

    /// Brightness of an edge at a distance under a box of 1 px and a Gaussian of this standard deviation, −1 to 1.
    fn boxed(distance: f64, sigma: f64) -> f64 {
        let integral = |h: f64| {
            let bell = (-0.5 * (h / sigma).powi(2)).exp();
            let erf = libm::erf(h / sigma * std::f64::consts::FRAC_1_SQRT_2);
            h * erf + (2.0 / std::f64::consts::PI).sqrt() * sigma * bell
        };
        integral(distance + 0.5) - integral(distance - 0.5)
    }

    /// Edges along rows and columns show the box of a pixel most.
    #[test]
    fn sharp_edges_along_rows_and_columns_do_not_depend_on_their_place_in_the_pixel() {
        const MIDDLE: f64 = 12.0;
        for (sigma, most) in [(0.01, 0.02), (0.15, 0.004), (0.3, 0.002), (0.5, 0.001)] {
            for (i, j) in (0..=8).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                let [dx, dy] = [i, j].map(|step| f64::from(step) / 16.0);
                let edge = |at: usize, from: f64| boxed(at as f64 - MIDDLE - from, sigma);
                let grey = |x, y| (0.5 + 0.35 * edge(x, dx) * edge(y, dy)) as f32;
                let picture = Gray::from_fn(25, 25, grey);
                let start = Corner {
                    position: DVec2::splat(MIDDLE),
                    blur_px: 0.6,
                    slope: DVec2::ZERO,
                    angles: [0.02, 0.02 + std::f64::consts::FRAC_PI_2],
                    bends: [0.0; 2],
                    ..corner(-0.3)
                };
                let mut fitter = CornerFitter::default();
                let (window, optics) = (Window::new(6), Optics::default());
                let image = (&picture).into();
                let found = fitter.fit(image, &window, &start, &optics, Accuracy::Full);
                let off = found.expect("a corner").corner.position - (DVec2::new(dx, dy) + MIDDLE);
                assert!(off.length() < most, "{sigma} px, {dx} {dy}: {off}");
            }
        }
    }
}
