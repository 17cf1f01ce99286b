//! The corner of the paper: the umbilic point of a cubic surface fitted to the image.
//!
//! The surface over offsets Δ = (u, v) around a position is (Eq. 1)
//!
//! ```text
//!     f(u,v) = c1 u³ + c2 u²v + c3 uv² + c4 v³ + c5 u² + c6 uv + c7 v² + c8 u + c9 v + c10
//! ```
//!
//! (see [`super::cone_fit`]). A corner is a point where all second derivatives vanish (Eq. 3). It is a star-shaped
//! umbilic if J < 0 (Eq. 5), which depends only on the cubic terms.

use glam::DVec2;
use nalgebra::{Matrix3x2, Vector3};

use super::cone_fit::{ConeFit, Powers};
use deltille_core::raster::ImageView;

/// Number of coefficients kept: c1 … c7. Slopes and level do not move the corner.
const KEPT: usize = 7;

/// Step length below which the iteration has converged, px.
const CONVERGED_PX: f64 = 0.001;

/// The cubic and quadratic coefficients c1 … c7 of a fitted surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CubicSurface {
    /// c1 … c7 of Eq. 1.
    pub c: [f64; KEPT],
}

impl CubicSurface {
    /// Returns J of Eq. 5; negative on star-shaped umbilics.
    pub(crate) fn star_discriminant(&self) -> f64 {
        let [c1, c2, c3, c4, ..] = self.c;
        3.0 * (c1 * c3 + c2 * c4) - (c2 * c2 + c3 * c3)
    }

    /// Returns the offset at which all second derivatives vanish, in the least-squares sense (Eq. 3).
    pub(crate) fn umbilic_point(&self) -> Option<DVec2> {
        let [c1, c2, c3, c4, c5, c6, c7] = self.c;
        let a = Matrix3x2::new(6.0 * c1, 2.0 * c2, 2.0 * c2, 2.0 * c3, 2.0 * c3, 6.0 * c4);
        let b = -Vector3::new(2.0 * c5, c6, 2.0 * c7);
        let normal = a.transpose() * a;
        let point = normal.try_inverse()? * (a.transpose() * b);
        let point = DVec2::new(point.x, point.y);
        point.is_finite().then_some(point)
    }

    /// Returns the cubic terms c1 … c4.
    pub(crate) fn form(&self) -> [f64; 4] {
        let [c1, c2, c3, c4, ..] = self.c;
        [c1, c2, c3, c4]
    }
}

/// Monomials of Eq. 1 in the order of its coefficients.
const MONOMIALS: [Powers; 10] =
    [(3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)];

/// Fits cubic surfaces in one fixed window.
#[derive(Clone, Debug)]
pub(crate) struct CubicFit {
    fit: ConeFit<KEPT>,
}

/// A corner found by iterating the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Umbilic {
    /// Position, px.
    pub position: DVec2,
    /// The last surface, centred one (short) step before `position`.
    pub surface: CubicSurface,
}

impl CubicFit {
    /// Creates a fit over offsets within `radius` + 1 px, after smoothing with a cone of that radius.
    pub(crate) fn new(radius: usize) -> Self {
        Self { fit: ConeFit::new(radius, &MONOMIALS) }
    }

    /// Returns the surface around `position`; `None` if the window leaves the image.
    pub(crate) fn surface(&self, image: ImageView, position: DVec2) -> Option<CubicSurface> {
        Some(CubicSurface { c: self.fit.coefficients(image, position)? })
    }

    /// Iterates from `start`, at most `iterations` times. Returns `None` if the surface is not a star-shaped umbilic,
    /// if a step or the total displacement exceeds the radius, or if the window leaves the image.
    pub(crate) fn refine(
        &self,
        image: ImageView,
        start: DVec2,
        iterations: usize,
    ) -> Option<Umbilic> {
        self.walk(image, start, iterations, CONVERGED_PX)
    }

    /// Iterates like [`Self::refine`], until a step is shorter than `converged_px`.
    pub(crate) fn walk(
        &self,
        image: ImageView,
        start: DVec2,
        iterations: usize,
        converged_px: f64,
    ) -> Option<Umbilic> {
        let radius = self.fit.radius() as f64;
        let mut position = start;
        let mut surface = self.surface(image, position)?;
        for iteration in 1.. {
            if surface.star_discriminant() >= 0.0 {
                return None;
            }
            let step = surface.umbilic_point()?;
            position += step;
            let (way2, step2) = (position.distance_squared(start), step.length_squared());
            if step2.max(way2) > radius * radius {
                return None;
            }
            if step2 < converged_px * converged_px || iteration >= iterations {
                break;
            }
            surface = self.surface(image, position)?;
        }
        Some(Umbilic { position, surface })
    }

    /// Returns the step from `start` to the umbilic point of the surface there; `None` if it is not star-shaped.
    pub(crate) fn step(&self, image: ImageView, start: DVec2) -> Option<DVec2> {
        let surface = self.surface(image, start)?;
        (surface.star_discriminant() < 0.0).then(|| surface.umbilic_point()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::raster::Gray;

    /// x³ − 3xy² about (cx, cy), plus slopes and a level that must have no effect.
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
            let found =
                fit.refine((&monkey_saddle(31.4, 29.8)).into(), DVec2::splat(31.0), 2).unwrap();
            let error = found.position.distance(DVec2::new(31.4, 29.8));
            assert!(error < 2e-3, "radius {radius}: {error}");
            assert!(found.surface.star_discriminant() < 0.0);
        }
    }

    #[test]
    fn quadrics_planes_and_borders_are_rejected() {
        let fit = CubicFit::new(3);
        let saddle = Gray::from_fn(64, 64, |x, y| (x as f32 - 30.0) * (y as f32 - 30.0));
        let found = fit.refine((&saddle).into(), DVec2::splat(30.0), 5);
        assert!(found.is_none_or(|u| u.surface.star_discriminant().abs() < 1e-6));
        assert!(fit.refine((&Gray::<u8>::new(64, 64)).into(), DVec2::splat(30.0), 5).is_none());
        assert!(fit.refine((&monkey_saddle(3.0, 3.0)).into(), DVec2::splat(3.0), 5).is_none());
    }
}
