//! The checkerboard corner of the paper: the saddle point of a quadric fitted to the image.
//!
//! ```text
//!     f(u,v) = c1 u² + c2 uv + c3 v² + c4 u + c5 v + c6
//! ```
//!
//! The corner is the stationary point, 2c1 u + c2 v + c4 = 0 and c2 u + 2c3 v + c5 = 0. It is a saddle point if the
//! determinant of the Hessian, 4 c1 c3 − c2², is negative. [`super::cone_fit`] computes the fit.

use glam::DVec2;

use super::cone_fit::{ConeFit, Powers};
use deltille_core::raster::ImageView;

/// Monomials in the order of the coefficients.
const MONOMIALS: [Powers; 6] = [(2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)];

/// Step length below which the iteration has converged, px.
const CONVERGED_PX: f64 = 0.001;

/// A saddle point found by iterating the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuadricSaddle {
    /// Position, px.
    pub position: DVec2,
    /// c1 … c3 of the last surface.
    pub form: [f64; 3],
}

/// Fits quadrics in one fixed window.
#[derive(Clone, Debug)]
pub(crate) struct QuadricFit {
    fit: ConeFit<5>,
}

impl QuadricFit {
    /// Creates a fit over offsets within `radius` + 1 px, after smoothing with a cone of that radius.
    pub(crate) fn new(radius: usize) -> Self {
        Self { fit: ConeFit::new(radius, &MONOMIALS) }
    }

    /// Iterates from `start`, at most `iterations` times. Returns `None` if the surface has no saddle point, if a step
    /// or the total displacement exceeds the radius, or if the window leaves the image.
    pub(crate) fn refine(
        &self,
        image: ImageView,
        start: DVec2,
        iterations: usize,
    ) -> Option<QuadricSaddle> {
        self.walk(image, start, iterations, CONVERGED_PX)
    }

    /// Iterates like [`Self::refine`], until a step is shorter than `converged_px`.
    pub(crate) fn walk(
        &self,
        image: ImageView,
        start: DVec2,
        iterations: usize,
        converged_px: f64,
    ) -> Option<QuadricSaddle> {
        let radius = self.fit.radius() as f64;
        let mut position = start;
        for iteration in 1.. {
            let coefficients = self.fit.coefficients(image, position)?;
            let step = stationary_point(coefficients)?;
            position += step;
            let (way2, step2) = (position.distance_squared(start), step.length_squared());
            if step2.max(way2) > radius * radius {
                return None;
            }
            if step2 < converged_px * converged_px || iteration >= iterations {
                let [c1, c2, c3, ..] = coefficients;
                return Some(QuadricSaddle { position, form: [c1, c2, c3] });
            }
        }
        None
    }

    /// Returns the step from `start` to the saddle point of the surface there; `None` if it has none.
    pub(crate) fn step(&self, image: ImageView, start: DVec2) -> Option<DVec2> {
        stationary_point(self.fit.coefficients(image, start)?)
    }
}

/// Returns the saddle point of a quadric; `None` for bowls and flat surfaces.
fn stationary_point([c1, c2, c3, c4, c5]: [f64; 5]) -> Option<DVec2> {
    let determinant = 4.0 * c1 * c3 - c2 * c2;
    let point = DVec2::new(c2 * c5 - 2.0 * c3 * c4, c2 * c4 - 2.0 * c1 * c5) / determinant;
    (determinant < 0.0 && point.is_finite()).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::raster::Gray;

    fn surface(form: impl Fn(f32, f32) -> f32) -> Gray<f32> {
        Gray::from_fn(40, 40, |x, y| form(x as f32 - 20.3, y as f32 - 18.9))
    }

    #[test]
    fn a_saddle_is_found_exactly_in_two_steps() {
        let saddle = surface(|u, v| 0.01 * (u * u - 2.0 * v * v + 0.5 * u * v) + 3.0);
        let found =
            QuadricFit::new(5).refine((&saddle).into(), DVec2::splat(20.0), 2).unwrap().position;
        assert!(found.distance(DVec2::new(20.3, 18.9)) < 1e-3, "{found}");
    }

    #[test]
    fn bowls_planes_and_borders_are_rejected() {
        let fit = QuadricFit::new(3);
        assert!(
            fit.refine((&surface(|u, v| u * u + v * v)).into(), DVec2::splat(20.0), 5).is_none()
        );
        assert!(fit.refine((&surface(|_, _| 1.0)).into(), DVec2::splat(20.0), 5).is_none());
        assert!(fit.refine((&surface(|u, v| u * v)).into(), DVec2::new(3.0, 20.0), 5).is_none());
    }
}
