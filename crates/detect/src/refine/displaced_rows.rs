//! Covariances for displaced rows and columns of pixels.
//!
//! Resampling, and demosaicing with compression, give each row (and column) of pixels its own error: its light is that of
//! a row displaced by δ. Along an edge that runs along the rows, this error is the same for all pixels, so that it moves
//! the corner, and is hardly visible in its residuals. Across other edges, it averages out.
//!
//! The residuals limit its size. Let a be the derivatives of a row's brightness with respect to y, P = aᵀ(1 − H)b for the
//! rows a, b of a corner with the hat matrix H, and σ², τ² the variances of white noise and of δ. Then the residuals r
//! have
//!
//! ```text
//!     E Σ (aᵀr)² = σ² Σ Pₐₐ + τ² Σ Σ Pₐᵦ²
//! ```
//!
//! Pooled over the corners of an image, this determines τ². With the influence c of the pixels on y, its variance is
//! τ² Σ (cᵀa)². This is an upper limit, because other errors of the model have the same effect on the residuals, although
//! they move no corner. If an image is sharp, δ may also come from pixels that are no full squares, for example if every
//! second row is missing; this is limited by the effect of the shape of pixels. The scatter of corners about a smooth grid
//! is another limit, because it contains the errors of the print. The smaller one is added to the covariances.

use std::collections::BTreeMap;

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use super::correlation::Influence;
use super::model::look::PixelBox;
use super::optics::Optics;
use crate::grid::map::local_map::Shape;
use crate::grid::map::plane_map::PlaneMap;
use crate::grid::map::spacing::Spacing;
use deltille_core::detection::{Grid, GridCorner};
use deltille_core::lattice::Vertex;
use deltille_core::statistics::median;

/// Excess of the sum above which rows may be displaced, in standard deviations of white noise.
const MIN_EVIDENCE: f64 = 4.0;

/// Weights of the third difference, and the sum of their squares.
const DIFFERENCE: [f64; 4] = [1.0, -3.0, 3.0, -1.0];
const DIFFERENCE_SQUARE: f64 = 20.0;

/// Minimum number of differences that determine a scatter: to within a third.
const MIN_DIFFERENCES: usize = 6;

/// Part of the squares that counts, and their mean in units of the variance: the largest ones may be of wrong corners.
const COUNTED: f64 = 0.95;
const MEAN_COUNTED: f64 = 0.76;

/// The rows or columns of pixels around a corner.
struct Lines {
    /// aᵀr of each line, in standard deviations of the noise.
    residuals: DVector<f64>,
    /// P.
    products: DMatrix<f64>,
    /// Σ (cᵀa)².
    spread: f64,
    /// Variance of the noise.
    variance: f64,
}

impl Lines {
    /// Returns the lines along one axis: columns (0) or rows (1).
    fn of(corner: &Influence, axis: usize) -> Self {
        let mut lines: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
        for (i, place) in corner.places.iter().enumerate() {
            lines.entry(place[axis]).or_default().push(i);
        }
        let slopes = &corner.slopes[axis];
        let along = |values: &[f32]| {
            let product = |&i: &usize| f64::from(slopes[i] * values[i]);
            let sums = lines.values().map(|line| line.iter().map(product).sum());
            DVector::from_iterator(lines.len(), sums)
        };
        let mut products = DMatrix::from_diagonal(&along(slopes));
        for q in &corner.hat {
            let q = along(q);
            products -= &q * q.transpose();
        }
        Self {
            residuals: along(&corner.residuals) / corner.noise,
            products,
            spread: along(&corner.on_position[axis]).norm_squared(),
            variance: corner.noise.powi(2),
        }
    }
}

/// Returns upper limits of the variances of x and y from displaced columns and rows, px², beyond those from noise with
/// this inflation: means over corners.
pub(crate) fn limits(corners: &[Influence], inflation: f64) -> [f64; 2] {
    [0, 1].map(|axis| {
        let (mut excess, mut of_noise, mut gain, mut spread) = (0.0, 0.0, 0.0, 0.0);
        for corner in corners {
            let lines = Lines::of(corner, axis);
            let square = lines.products.norm_squared();
            excess += lines.residuals.norm_squared() / inflation - lines.products.trace();
            of_noise += 2.0 * square;
            gain += square / lines.variance / inflation;
            spread += lines.spread / corners.len() as f64;
        }
        if excess > MIN_EVIDENCE * of_noise.sqrt() { excess / gain * spread } else { 0.0 }
    })
}

/// Adds the scatter of the corners about a smooth grid with this blur, px, to the variances of x and y, up to their limits.
pub(crate) fn widen(grid: &mut Grid, optics: &Optics, blur_px: f64) {
    let spread = optics.spread(grid.kind.steps().len() / 2);
    let limits = [0, 1].map(|axis| {
        let normal = [[1.0, 0.0], [0.0, 1.0]][axis];
        let across_px = blur_px * spread.product(normal, normal).sqrt();
        let limit = optics.displaced[axis].max(PixelBox::displacement_px(across_px).powi(2));
        let variances = grid.corners.iter().filter_map(|corner| Some(corner.cov?[2 * axis]));
        // Less would hardly change the standard deviations.
        if median(variances.collect()).is_some_and(|usual| limit > usual) { limit } else { 0.0 }
    });
    if limits == [0.0; 2] {
        return;
    }
    let placed = |corner: &GridCorner| (Vertex::new(corner.row, corner.col), corner.position());
    let corners: Vec<(Vertex, DVec2)> = grid.corners.iter().map(placed).collect();
    let places: BTreeMap<Vertex, DVec2> = corners.iter().copied().collect();
    let spacing = Spacing::of(grid.kind, places.keys().copied(), |v| places.get(&v).copied());
    let Some(plane) = PlaneMap::of(&corners, Shape::usual(spacing)) else { return };
    let off_plane = |corner: &GridCorner| {
        let (vertex, place) = placed(corner);
        Some((vertex, (place - plane.place(vertex), corner.cov?)))
    };
    let off_plane = grid.corners.iter().filter_map(off_plane).collect();
    // Lines of unequal spacing are equally spaced in pairs. If the spacing is nearly a period of the errors, these change
    // little from one line to the next.
    let strides = if spacing == Spacing::EQUAL { &[1, 2][..] } else { &[2] };
    let steps = grid.kind.steps();
    let steps = steps[..steps.len() / 2].iter().flat_map(|step| {
        strides.iter().map(move |stride| Vertex::new(stride * step.row, stride * step.col))
    });
    let scatter = |axis: usize| {
        let along = steps.clone().map(|step| excess_scatter(&off_plane, step, axis));
        along.flatten().fold(0.0, f64::max).min(limits[axis])
    };
    let added = [0, 1].map(scatter);
    for cov in grid.corners.iter_mut().filter_map(|corner| corner.cov.as_mut()) {
        (cov[0], cov[2]) = (cov[0] + added[0], cov[2] + added[1]);
    }
}

/// Returns the variance of positions along x (0) or y (1) beyond that of their covariances, px²: from the scatter of the
/// third differences along a step of the lattice. `None` if there are too few. All corners of a line may have the same
/// error, because one row of pixels shows them.
fn excess_scatter(
    off_plane: &BTreeMap<Vertex, (DVec2, [f64; 3])>,
    step: Vertex,
    axis: usize,
) -> Option<f64> {
    let difference = |first: Vertex| {
        let (mut at, mut sum, mut variance) = (first, 0.0, 0.0);
        for weight in DIFFERENCE {
            let (off, cov) = off_plane.get(&at)?;
            sum += weight * off[axis];
            variance += weight * weight * cov[2 * axis];
            at = at + step;
        }
        Some((sum, variance))
    };
    let (differences, variances): (Vec<f64>, Vec<f64>) =
        off_plane.keys().filter_map(|&first| difference(first)).unzip();
    if differences.len() < MIN_DIFFERENCES {
        return None;
    }
    // Distortion has nearly the same third difference everywhere.
    let usual = median(differences.clone())?;
    let mut squares: Vec<f64> = differences.iter().map(|d| (d - usual).powi(2)).collect();
    squares.sort_by(f64::total_cmp);
    let counted = (COUNTED * squares.len() as f64) as usize;
    let scatter = squares[..counted].iter().sum::<f64>() / counted as f64 / MEAN_COUNTED;
    Some((scatter - median(variances)?).max(0.0) / DIFFERENCE_SQUARE)
}
