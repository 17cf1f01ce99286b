//! Least-squares polynomials around a position, as one linear map of the pixels there.
//!
//! All positions share one window, so the coefficients are fixed kernels (the rows of (AᵀA)⁻¹Aᵀ, paper §3.1). The image
//! is smoothed with a cone before the fit. Both maps are linear and are stored as their product, so a fit over offsets
//! within r + 1 reads (4r + 1)² pixels.

use glam::DVec2;
use multiversion::multiversion;
use nalgebra::DMatrix;

use crate::lanes;
use crate::lanes::LANES;
use deltille_core::raster::{ImageView, Intensity, View, of_any};

/// Powers (i, j) of a monomial uⁱvʲ.
pub(crate) type Powers = (i32, i32);

/// Number of lanes processed at a time. Kernel rows are padded to whole vectors.
const HALF: usize = LANES / 2;

/// Kernels of the first N coefficients of a polynomial.
#[derive(Clone, Debug)]
pub(crate) struct ConeFit<const N: usize> {
    radius: usize,
    /// Side of the window of pixels that is read: 4r + 1.
    side: usize,
    /// Weights of each coefficient for each row of the window, in groups of lanes.
    kernels: Vec<[[f32; LANES]; N]>,
}

/// Singular value below which a design matrix is rank-deficient. It lies above rounding errors and
/// below all actual singular values, so no design matrix is rank-deficient.
const RANK: f64 = 1e-12;

impl<const N: usize> ConeFit<N> {
    /// Creates a fit of all `monomials`, over offsets within `radius` + 1 px, after smoothing with a cone of that
    /// radius. Keeps the coefficients of the first N.
    pub(crate) fn new(radius: usize, monomials: &[Powers]) -> Self {
        let r = radius as isize;
        let cone = |u: isize, v: isize| (radius as f64 + 1.0 - (u as f64).hypot(v as f64)).max(0.0);
        let offsets = |r: isize| (-r..=r).flat_map(move |v| (-r..=r).map(move |u| (u, v)));
        let points: Vec<_> = offsets(r).filter(|&(u, v)| cone(u, v) > 0.0).collect();
        let design = DMatrix::from_fn(points.len(), monomials.len(), |i, j| {
            let (u, v) = (points[i].0 as f64, points[i].1 as f64);
            u.powi(monomials[j].0) * v.powi(monomials[j].1)
        });
        let fit = design.pseudo_inverse(RANK).expect("a non-negative tolerance");
        let volume: f64 = offsets(r).map(|(u, v)| cone(u, v)).sum();
        let side = 4 * radius + 1;
        let groups = side.div_ceil(LANES);
        let mut sums = vec![[[0.0f64; LANES]; N]; side * groups];
        for (i, &(u, v)) in points.iter().enumerate() {
            for (du, dv) in offsets(r) {
                let x = (u + du + 2 * r) as usize;
                let y = (v + dv + 2 * r) as usize;
                for (k, kernel) in sums[y * groups + x / LANES].iter_mut().enumerate() {
                    kernel[x % LANES] += fit[(k, i)] * cone(du, dv) / volume;
                }
            }
        }
        let kernels = sums.into_iter().map(|row| row.map(|k| k.map(|w| w as f32))).collect();
        Self { radius, side, kernels }
    }

    /// Returns the radius of the fit, px.
    pub(crate) fn radius(&self) -> usize {
        self.radius
    }

    /// Returns the coefficients around a position; `None` if the window leaves the image.
    pub(crate) fn coefficients(&self, image: ImageView, DVec2 { x, y }: DVec2) -> Option<[f64; N]> {
        let reach = (2 * self.radius) as f64;
        let fits = x >= reach
            && y >= reach
            && x + reach + 1.0 < image.width() as f64
            && y + reach + 1.0 < image.height() as f64;
        if !fits {
            return None;
        }
        let corner = [x as usize - 2 * self.radius, y as usize - 2 * self.radius];
        let fraction = [x.fract() as f32, y.fract() as f32];
        let (kernels, side) = (&self.kernels, self.side);
        let products = of_any!(image, view => products(kernels, side, view, corner, fraction));
        Some(products.map(f64::from))
    }
}

/// Returns the products of the kernels with bilinear samples of a window of `side` pixels. Its first pixel is (left,
/// top), shifted by a fraction.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn products<const N: usize, T: Intensity>(
    kernels: &[[[f32; LANES]; N]],
    side: usize,
    image: View<T>,
    [left, top]: [usize; 2],
    [fx, fy]: [f32; 2],
) -> [f32; N] {
    // Subtracting the level of the centre first keeps single precision accurate enough at 16 bits.
    let level = image.at(left + side / 2, top + side / 2).to_f32();
    let mut sums = [[0.0f32; LANES]; N];
    for half in 0..2 {
        let first = half * HALF;
        let part = half_sums(kernels, side, first, image, [left + first, top], [fx, fy], level);
        for k in 0..N {
            sums[k][first..first + HALF].copy_from_slice(&part[k]);
        }
    }
    sums.each_ref().map(lanes::sum)
}

/// Returns the sums of half of the lanes, starting at `first`; `level` is subtracted from each
/// sample. Half of the lanes fit into registers.
#[inline(always)]
fn half_sums<const N: usize, T: Intensity>(
    kernels: &[[[f32; LANES]; N]],
    side: usize,
    first: usize,
    image: View<T>,
    [left, top]: [usize; 2],
    [fx, fy]: [f32; 2],
    level: f32,
) -> [[f32; HALF]; N] {
    let groups = side.div_ceil(LANES);
    let mut sums = [[0.0f32; HALF]; N];
    for group in 0..groups {
        if group * LANES + first >= side {
            // No weights.
            break;
        }
        let column = left + group * LANES;
        let mut upper = blended(image.row(top), column, fx, level);
        for (i, kernels) in kernels.iter().skip(group).step_by(groups).enumerate() {
            let lower = blended(image.row(top + i + 1), column, fx, level);
            let mut samples = [0.0; HALF];
            for j in 0..HALF {
                samples[j] = upper[j] + fy * (lower[j] - upper[j]);
            }
            for k in 0..N {
                for j in 0..HALF {
                    sums[k][j] += kernels[k][first + j] * samples[j];
                }
            }
            upper = lower;
        }
    }
    sums
}

/// Returns interpolated samples of a row, starting at a column, minus a level. Beyond the end of
/// the row, where kernels have no weight, the values are arbitrary.
#[inline(always)]
fn blended<T: Intensity>(row: &[T], column: usize, fx: f32, level: f32) -> [f32; HALF] {
    let mut padded = [T::default(); HALF + 1];
    let rest = &row[column..];
    let pixels = match rest.first_chunk() {
        Some(pixels) => pixels,
        None => {
            padded[..rest.len()].copy_from_slice(rest);
            &padded
        }
    };
    // Plain loops: a closure passed to the standard library would not be compiled for the target.
    let mut samples = [0.0; HALF];
    for i in 0..HALF {
        let (a, b) = (pixels[i].to_f32() - level, pixels[i + 1].to_f32() - level);
        samples[i] = a + fx * (b - a);
    }
    samples
}
