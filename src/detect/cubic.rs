//! The paper's corner: the umbilic point of a cubic surface fitted to the image.
//!
//! Over offsets Δ = (u, v) around a position the image is fitted by (Eq. 1)
//!
//! ```text
//!     f(u,v) = c1 u³ + c2 u²v + c3 uv² + c4 v³ + c5 u² + c6 uv + c7 v² + c8 u + c9 v + c10
//! ```
//!
//! All positions share one window, so the coefficients are one linear map of the window's pixels.
//! The image is smoothed with a cone before the fit; both maps are linear and are kept as their
//! product. A corner is where all second derivatives vanish (Eq. 3), and a star-shaped umbilic
//! when J < 0 (Eq. 5), which depends on the cubic terms alone.

use nalgebra::{DMatrix, Matrix3x2, Vector3};

use crate::raster::{Gray, Intensity};

/// Number of coefficients kept: c1 … c7; slopes and level do not move the corner.
const KEPT: usize = 7;

/// A step shorter than this ends the iteration, px.
const CONVERGED_PX: f64 = 0.001;

/// The cubic and quadratic coefficients c1 … c7 of a fitted surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicSurface {
    /// c1 … c7 of Eq. 1.
    pub c: [f64; KEPT],
}

impl CubicSurface {
    /// J of Eq. 5; negative on star-shaped umbilics.
    pub fn star_discriminant(&self) -> f64 {
        let [c1, c2, c3, c4, ..] = self.c;
        3.0 * (c1 * c3 + c2 * c4) - (c2 * c2 + c3 * c3)
    }

    /// The offset at which all second derivatives vanish, in the least-squares sense (Eq. 3).
    pub fn umbilic_point(&self) -> Option<[f64; 2]> {
        let [c1, c2, c3, c4, c5, c6, c7] = self.c;
        let a = Matrix3x2::new(6.0 * c1, 2.0 * c2, 2.0 * c2, 2.0 * c3, 2.0 * c3, 6.0 * c4);
        let b = -Vector3::new(2.0 * c5, c6, 2.0 * c7);
        let normal = a.transpose() * a;
        let point = normal.try_inverse()? * (a.transpose() * b);
        (point.x.is_finite() && point.y.is_finite()).then_some([point.x, point.y])
    }

    /// The cubic form in direction `angle`: positive where the image is bright.
    pub fn form(&self, angle: f64) -> f64 {
        let [c1, c2, c3, c4, ..] = self.c;
        let (v, u) = angle.sin_cos();
        c1 * u * u * u + c2 * u * u * v + c3 * u * v * v + c4 * v * v * v
    }
}

/// Fits cubic surfaces in one fixed window.
#[derive(Clone, Debug)]
pub struct CubicFit {
    radius: usize,
    /// Side of the window of pixels that is read: 4r + 1.
    side: usize,
    /// One kernel of side² weights for each of c1 … c7.
    kernels: [Vec<f32>; KEPT],
}

/// A corner found by iterating the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Umbilic {
    /// Position, px.
    pub position: [f64; 2],
    /// The last surface, centred one (short) step before `position`.
    pub surface: CubicSurface,
}

impl CubicFit {
    /// A fit over offsets within `radius` + 1 px, after smoothing with a cone of that radius.
    pub fn new(radius: usize) -> Self {
        let r = radius as isize;
        let cone = |u: isize, v: isize| (radius as f64 + 1.0 - (u as f64).hypot(v as f64)).max(0.0);
        let offsets = |r: isize| (-r..=r).flat_map(move |v| (-r..=r).map(move |u| (u, v)));
        let points: Vec<_> = offsets(r).filter(|&(u, v)| cone(u, v) > 0.0).collect();
        let monomials = DMatrix::from_fn(points.len(), 10, |i, j| {
            let (u, v) = (points[i].0 as f64, points[i].1 as f64);
            let powers: [(i32, i32); 10] =
                [(3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)];
            u.powi(powers[j].0) * v.powi(powers[j].1)
        });
        let fit = monomials.pseudo_inverse(1e-12).expect("a non-negative tolerance");
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

    /// The surface around `position`; `None` where the window leaves the image.
    pub fn surface<T: Intensity>(&self, image: &Gray<T>, [x, y]: [f64; 2]) -> Option<CubicSurface> {
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
        Some(CubicSurface { c: std::array::from_fn(|k| f64::from(dot(&self.kernels[k], &window))) })
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

    /// Iterates from `start`, at most `iterations` times. `None` when the surface is no
    /// star-shaped umbilic, a step or the whole way exceeds the radius, or the window leaves the
    /// image.
    pub fn refine<T: Intensity>(
        &self,
        image: &Gray<T>,
        start: [f64; 2],
        iterations: usize,
    ) -> Option<Umbilic> {
        let radius = self.radius as f64;
        let mut position = start;
        let mut surface = self.surface(image, position)?;
        for iteration in 1.. {
            if surface.star_discriminant() >= 0.0 {
                return None;
            }
            let [dx, dy] = surface.umbilic_point()?;
            position = [position[0] + dx, position[1] + dy];
            let step = dx.hypot(dy);
            let way = (position[0] - start[0]).hypot(position[1] - start[1]);
            if step > radius || way > radius {
                return None;
            }
            if step < CONVERGED_PX || iteration >= iterations {
                break;
            }
            surface = self.surface(image, position)?;
        }
        Some(Umbilic { position, surface })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// x³ − 3xy² about (cx, cy), plus slopes and a level that must not matter.
    fn monkey_saddle(cx: f64, cy: f64) -> Gray<f32> {
        Gray::from_fn(64, 64, |x, y| {
            let (u, v) = (x as f64 - cx, y as f64 - cy);
            (0.001 * (u * u * u - 3.0 * u * v * v) + 0.02 * u - 0.01 * v + 7.0) as f32
        })
    }

    #[test]
    fn a_monkey_saddle_is_found_exactly_in_two_steps() {
        for radius in [2, 3, 5] {
            let fit = CubicFit::new(radius);
            let found = fit.refine(&monkey_saddle(31.4, 29.8), [31.0, 31.0], 2).unwrap();
            let error = (found.position[0] - 31.4).hypot(found.position[1] - 29.8);
            assert!(error < 2e-3, "radius {radius}: {error}");
            assert!(found.surface.star_discriminant() < 0.0);
        }
    }

    #[test]
    fn quadrics_planes_and_borders_are_refused() {
        let fit = CubicFit::new(3);
        let saddle = Gray::from_fn(64, 64, |x, y| (x as f32 - 30.0) * (y as f32 - 30.0));
        let found = fit.refine(&saddle, [30.0, 30.0], 5);
        assert!(found.is_none_or(|u| u.surface.star_discriminant().abs() < 1e-6));
        assert!(fit.refine(&Gray::<u8>::new(64, 64), [30.0, 30.0], 5).is_none());
        assert!(fit.refine(&monkey_saddle(3.0, 3.0), [3.0, 3.0], 5).is_none());
    }

    #[test]
    fn the_form_is_bright_where_the_image_is() {
        let fit = CubicFit::new(3);
        let surface = fit.surface(&monkey_saddle(32.0, 32.0), [32.0, 32.0]).unwrap();
        assert!(surface.form(0.0) > 0.0 && surface.form(std::f64::consts::PI) < 0.0);
    }
}
