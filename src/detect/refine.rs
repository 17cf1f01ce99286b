//! The last word on a corner's position, from the raw pixels.

use super::cubic::CubicFit;
use crate::raster::{Gray, Intensity};

/// Radius of the fit, px.
const RADIUS: usize = 3;

/// Iterations of the fit; from a start that is right to a tenth of a pixel two suffice.
const ITERATIONS: usize = 5;

/// Refines corners on the image itself.
#[derive(Clone, Debug)]
pub struct Refiner {
    fit: CubicFit,
}

impl Refiner {
    /// The paper's polynomial refinement.
    pub fn new() -> Self {
        Self { fit: CubicFit::new(RADIUS) }
    }

    /// The refined position, or `start` where the fit does not apply.
    pub fn refine<T: Intensity>(&self, image: &Gray<T>, start: [f64; 2]) -> [f64; 2] {
        self.fit.refine(image, start, ITERATIONS).map_or(start, |umbilic| umbilic.position)
    }
}
