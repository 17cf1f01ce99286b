//! The interface of lens models.

use glam::{DVec2, DVec3};

use crate::quantity::Range;

/// A half-line in the camera frame, along which a pixel looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point, mm: zero unless the lens is not central.
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

/// A point of the normalised image plane with its derivatives by the point in the camera frame: rows x', y'; columns
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

    /// The ranges of its parameters, from the first; those without one have that of coefficients.
    fn ranges(&self) -> &'static [Range] {
        &[]
    }

    /// How many coefficients a camera file has at least, where those left out at the end are zero; `None` where all are
    /// there.
    fn least_coefficients(&self) -> Option<usize> {
        None
    }

    /// The image of a point, and in `by_parameters` the derivatives of x', y' by each parameter;
    /// `None` where the formula has no value that a search may pass through.
    fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged>;

    /// Returns whether a point that has an image lies in the domain of the model.
    fn covers(&self, _point: DVec3) -> bool {
        true
    }

    /// Returns the ray that is imaged at a point of the normalised plane, if there is one.
    fn ray(&self, at: DVec2) -> Option<Ray>;

    /// Returns the radius on the normalised plane up to which it increases steadily with the angle, without fold or
    /// pole; `None` if it does so over the whole field of view.
    fn steady_radius(&self) -> Option<f64> {
        None
    }
}
