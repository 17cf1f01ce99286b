//! The fit of the paper for either tiling: a cubic surface ([`super::cubic`]) or a quadric ([`super::quadric`]), and
//! the form of its highest degree, whose zeros are the edges.

use glam::DVec2;

use super::cubic::{CubicFit, Umbilic};
use super::quadric::{QuadricFit, QuadricSaddle};
use deltille_core::lattice::GridKind;
use deltille_core::raster::ImageView;

/// Maximum iterations of the cubic fit, as in the reference detector.
const CUBIC_ITERATIONS: usize = 5;

/// Maximum iterations of the quadric fit, as in the reference detector.
const QUADRIC_ITERATIONS: usize = 20;

/// Maximum iterations of a first pass, as in the paper.
const FIND_ITERATIONS: usize = 5;

/// Step length that ends a first pass, px. The remaining error is much smaller. Comparisons of
/// corners with each other and with predictions have tolerances of tenths of a pixel.
const FOUND_PX: f64 = 0.03;

/// A fit of one degree in one window.
#[derive(Clone, Debug)]
pub(crate) enum Polynomial {
    /// For deltille corners.
    Cubic(CubicFit),
    /// For checkerboard corners.
    Quadric(QuadricFit),
}

/// The terms of the highest degree of a fitted surface, from u³ or u² to v³ or v².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Form {
    /// u³, u²v, uv², v³.
    Cubic([f64; 4]),
    /// u², uv, v².
    Quadratic([f64; 3]),
}

/// A corner found by a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FittedCorner {
    /// Position, px.
    pub position: DVec2,
    /// The form there.
    pub form: Form,
}

impl From<Umbilic> for FittedCorner {
    fn from(found: Umbilic) -> Self {
        Self { position: found.position, form: Form::Cubic(found.surface.form()) }
    }
}

impl From<QuadricSaddle> for FittedCorner {
    fn from(found: QuadricSaddle) -> Self {
        Self { position: found.position, form: Form::Quadratic(found.form) }
    }
}

impl Form {
    /// Returns the form along a unit vector: large where the image is bright. It vanishes along the edges (degree
    /// three) or near them (degree two).
    pub(crate) fn towards(&self, DVec2 { x: u, y: v }: DVec2) -> f64 {
        match *self {
            Form::Cubic([a, b, c, d]) => {
                a * u * u * u + b * u * u * v + c * u * v * v + d * v * v * v
            }
            Form::Quadratic([a, b, c]) => a * u * u + b * u * v + c * v * v,
        }
    }
}

impl Polynomial {
    /// Creates the fit for corners of a tiling, over offsets within `radius` + 1 px.
    pub(crate) fn new(kind: GridKind, radius: usize) -> Self {
        match kind {
            GridKind::Deltille => Self::Cubic(CubicFit::new(radius)),
            GridKind::Checker => Self::Quadric(QuadricFit::new(radius)),
        }
    }

    /// Returns the number of iterations of the reference detector.
    pub(crate) fn usual_iterations(&self) -> usize {
        match self {
            Self::Cubic(_) => CUBIC_ITERATIONS,
            Self::Quadric(_) => QUADRIC_ITERATIONS,
        }
    }

    /// Returns the corner that the fit reaches from `start` in at most `iterations` iterations.
    pub(crate) fn refine(
        &self,
        image: ImageView,
        start: DVec2,
        iterations: usize,
    ) -> Option<FittedCorner> {
        match self {
            Self::Cubic(fit) => fit.refine(image, start, iterations).map(FittedCorner::from),
            Self::Quadric(fit) => fit.refine(image, start, iterations).map(FittedCorner::from),
        }
    }

    /// Fits like [`Self::refine`], as accurately as a first pass needs.
    pub(crate) fn find(&self, image: ImageView, start: DVec2) -> Option<FittedCorner> {
        let (most, found_px) = (FIND_ITERATIONS, FOUND_PX);
        match self {
            Self::Cubic(fit) => fit.walk(image, start, most, found_px).map(FittedCorner::from),
            Self::Quadric(fit) => fit.walk(image, start, most, found_px).map(FittedCorner::from),
        }
    }

    /// Returns the first step of the fit, px; `None` if there is no corner.
    pub(crate) fn step(&self, image: ImageView, start: DVec2) -> Option<DVec2> {
        match self {
            Self::Cubic(fit) => fit.step(image, start),
            Self::Quadric(fit) => fit.step(image, start),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::raster::Gray;

    #[test]
    fn forms_are_bright_where_the_image_is() {
        let monkey = Gray::from_fn(64, 64, |x, y| {
            let (u, v) = (x as f32 - 32.0, y as f32 - 32.0);
            0.001 * (u * u * u - 3.0 * u * v * v)
        });
        let fit = Polynomial::new(GridKind::Deltille, 3);
        let form = fit.refine((&monkey).into(), DVec2::splat(32.0), 5).unwrap().form;
        assert!(form.towards(DVec2::X) > 0.0 && form.towards(DVec2::NEG_X) < 0.0);
        let saddle = Gray::from_fn(64, 64, |x, y| {
            let (u, v) = (x as f32 - 32.0, y as f32 - 32.0);
            0.01 * (u * u - v * v)
        });
        let fit = Polynomial::new(GridKind::Checker, 3);
        let form = fit.refine((&saddle).into(), DVec2::splat(32.0), 5).unwrap().form;
        assert!(
            form.towards(DVec2::X) > 0.0
                && form.towards(DVec2::Y) < 0.0
                && form.towards(DVec2::NEG_X) > 0.0
        );
    }
}
