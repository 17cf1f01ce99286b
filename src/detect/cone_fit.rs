//! Least-squares polynomials around a position, as one linear map of the pixels there.
//!
//! All positions share one window, so the coefficients are fixed kernels (the rows of (AᵀA)⁻¹Aᵀ,
//! paper §3.1). The image is smoothed with a cone before the fit; both maps are linear and are
//! kept as their product, so a fit over offsets within r + 1 reads (4r + 1)² pixels.

use nalgebra::DMatrix;

use crate::raster::{Gray, Intensity};

/// Powers (i, j) of a monomial uⁱvʲ.
pub type Powers = (i32, i32);

/// Kernels of the first N coefficients of a polynomial.
#[derive(Clone, Debug)]
pub struct ConeFit<const N: usize> {
    radius: usize,
    /// Side of the window of pixels that is read: 4r + 1.
    side: usize,
    /// One kernel of side² weights for each coefficient.
    kernels: [Vec<f32>; N],
}

impl<const N: usize> ConeFit<N> {
    /// A fit of all `monomials`, over offsets within `radius` + 1 px after smoothing with a cone
    /// of that radius; the coefficients of the first N are kept.
    pub fn new(radius: usize, monomials: &[Powers]) -> Self {
        let r = radius as isize;
        let cone = |u: isize, v: isize| (radius as f64 + 1.0 - (u as f64).hypot(v as f64)).max(0.0);
        let offsets = |r: isize| (-r..=r).flat_map(move |v| (-r..=r).map(move |u| (u, v)));
        let points: Vec<_> = offsets(r).filter(|&(u, v)| cone(u, v) > 0.0).collect();
        let design = DMatrix::from_fn(points.len(), monomials.len(), |i, j| {
            let (u, v) = (points[i].0 as f64, points[i].1 as f64);
            u.powi(monomials[j].0) * v.powi(monomials[j].1)
        });
        let fit = design.pseudo_inverse(1e-12).expect("a non-negative tolerance");
        let volume: f64 = offsets(r).map(|(u, v)| cone(u, v)).sum();
        let side = 4 * radius + 1;
        let kernels = std::array::from_fn(|k| {
            let mut kernel = vec![0.0f64; side * side];
            for (i, &(u, v)) in points.iter().enumerate() {
                for (du, dv) in offsets(r) {
                    let x = (u + du + 2 * r) as usize;
                    let y = (v + dv + 2 * r) as usize;
                    kernel[y * side + x] += fit[(k, i)] * cone(du, dv) / volume;
                }
            }
            kernel.into_iter().map(|w| w as f32).collect()
        });
        Self { radius, side, kernels }
    }

    /// The radius of the fit, px.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// The coefficients around a position; `None` where the window leaves the image.
    pub fn coefficients<T: Intensity>(
        &self,
        image: &Gray<T>,
        [x, y]: [f64; 2],
    ) -> Option<[f64; N]> {
        let reach = (2 * self.radius) as f64;
        let fits = x >= reach
            && y >= reach
            && x + reach + 1.0 < image.width() as f64
            && y + reach + 1.0 < image.height() as f64;
        if !fits {
            return None;
        }
        let (left, top) = (x as usize - 2 * self.radius, y as usize - 2 * self.radius);
        let window = self.window(image, left, top, [x.fract() as f32, y.fract() as f32]);
        Some(std::array::from_fn(|k| f64::from(dot(&self.kernels[k], &window))))
    }

    /// Bilinear samples of the window whose first pixel is (left, top), shifted by a fraction.
    fn window<T: Intensity>(
        &self,
        image: &Gray<T>,
        left: usize,
        top: usize,
        [fx, fy]: [f32; 2],
    ) -> Vec<f32> {
        // Taking the centre's level away first keeps single precision exact enough at 16 bits.
        let level = image.at(left + self.side / 2, top + self.side / 2).to_f32();
        let blend_row = |y: usize, out: &mut Vec<f32>| {
            let row = &image.row(y)[left..=left + self.side];
            out.clear();
            out.extend(row.windows(2).map(|pair| {
                let (a, b) = (pair[0].to_f32() - level, pair[1].to_f32() - level);
                a + fx * (b - a)
            }));
        };
        let mut window = Vec::with_capacity(self.side * self.side);
        let (mut upper, mut lower) = (Vec::with_capacity(self.side), Vec::with_capacity(self.side));
        blend_row(top, &mut upper);
        for y in top..top + self.side {
            blend_row(y + 1, &mut lower);
            window.extend(upper.iter().zip(&lower).map(|(u, l)| u + fy * (l - u)));
            std::mem::swap(&mut upper, &mut lower);
        }
        window
    }
}

/// Dot product with eight running sums, which the compiler keeps in vector registers.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f32 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    let mut sums = [0.0f32; 8];
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    tail + sums.iter().sum::<f32>()
}
