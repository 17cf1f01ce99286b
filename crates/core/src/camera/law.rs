//! The interface of lens models.

use glam::{DVec2, DVec3};

use crate::quantity::Range;

/// A half-line in the camera frame: the line of sight of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, mm; zero for a central lens.
    pub origin: DVec3,
    /// Direction, a unit vector of the camera frame.
    pub direction: DVec3,
}

impl Ray {
    pub(super) fn central(direction: DVec3) -> Option<Self> {
        let direction = direction.try_normalize()?;
        Some(Self { origin: DVec3::ZERO, direction })
    }
}

/// A point of the normalised image plane with its derivatives with respect to the point in the
/// camera frame: rows x', y'; columns
/// X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imaged {
    /// Point (x', y'), dimensionless.
    pub at: DVec2,
    /// Derivatives ∂(x', y')/∂(X, Y, Z), 1/mm, with one row each for x' and y'.
    pub by_point: [[f64; 3]; 2],
}

/// Functions that each model implements. Parameters are always in the order of their names.
pub(super) trait LensLaw {
    /// Returns the names of the parameters, for example `k1`.
    fn names(&self) -> Vec<String>;

    /// Returns the values of the parameters.
    fn parameters(&self) -> Vec<f64>;

    /// Sets the parameters; `values` has one entry per name.
    fn set_parameters(&mut self, values: &[f64]);

    /// Returns the ranges of the first parameters; the others have the range of coefficients.
    fn ranges(&self) -> &'static [Range] {
        &[]
    }

    /// Returns the minimum number of coefficients in a camera file, which omits zeros at the end. Returns `None` if a
    /// file always has all of them.
    fn least_coefficients(&self) -> Option<usize> {
        None
    }

    /// Returns the image of a point, and writes the derivatives of x', y' with respect to each
    /// parameter to `by_parameters`.
    /// Returns `None` if the formula has no value there that an optimiser may use.
    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged>;

    /// Returns whether a point that has an image lies in the domain of the model.
    fn covers(&self, _point: DVec3) -> bool {
        true
    }

    /// Returns the ray that is imaged at a point of the normalised plane, if there is one.
    fn ray(&self, at: DVec2) -> Option<Ray>;

    /// Returns the radius on the normalised plane up to which the radius increases monotonically
    /// with the angle, without a fold or pole. Returns `None` if it does so over the whole field of
    /// view.
    fn monotonic_radius(&self) -> Option<f64> {
        None
    }
}
