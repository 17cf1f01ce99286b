//! What a lens model says about itself, and what it says of points.

use glam::{DVec2, DVec3};

use crate::quantity::Range;

/// A half-line in the camera frame, along which a pixel looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, mm: zero unless the lens is not central.
    pub origin: DVec3,
    /// Its direction, a unit vector of the camera frame.
    pub direction: DVec3,
}

impl Ray {
    pub(super) fn central(direction: DVec3) -> Option<Self> {
        let direction = direction.try_normalize()?;
        Some(Self { origin: DVec3::ZERO, direction })
    }
}

/// A point of the normalised image plane with its derivatives by the point of the camera frame:
/// rows x', y'; columns X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imaged {
    /// The point (x', y'), without unit.
    pub at: DVec2,
    /// ∂(x', y')/∂(X, Y, Z), 1/mm; a row for each of x', y'.
    pub by_point: [[f64; 3]; 2],
}

/// What each model says about itself. Parameters are in the order of their names, everywhere.
pub(super) trait LensLaw {
    /// The parameters' names, such as `k1`.
    fn names(&self) -> Vec<String>;

    /// Their values.
    fn parameters(&self) -> Vec<f64>;

    /// Takes other values, as many as there are names.
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

    /// Whether a point that has an image lies in the domain of the model.
    fn covers(&self, _point: DVec3) -> bool {
        true
    }

    /// The ray that is imaged at a point of the normalised plane; `None` where there is none.
    fn ray(&self, at: DVec2) -> Option<Ray>;

    /// Radius on the normalised plane up to which it grows steadily with the angle, without fold or
    /// pole; `None` where it does so as far as the model sees.
    fn steady_radius(&self) -> Option<f64> {
        None
    }
}
