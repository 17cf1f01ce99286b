use glam::{DVec2, DVec3};

use super::law::{Imaged, LensLaw, Ray};
use super::{BrownConrady, DoubleSphere, ExtendedUnified, KannalaBrandt, Knots, Pupil, Spline};

/// Most parameters that a lens has which all matter everywhere: of a spline only some do.
pub const MAX_LENS_PARAMETERS: usize = 12;

/// How a point of the camera frame becomes a point of the normalised image plane.
#[derive(Clone, Debug, PartialEq)]
pub enum Lens {
    /// Perspective with polynomial or rational distortion; sees less than 180°.
    BrownConrady(BrownConrady),
    /// Equidistant polynomial; sees more than 180° where its polynomial grows.
    KannalaBrandt(KannalaBrandt),
    /// Extended unified model; sees more than 180°.
    ExtendedUnified(ExtendedUnified),
    /// Double sphere; sees more than 180°.
    DoubleSphere(DoubleSphere),
    /// Equidistant polynomial with a moving entrance pupil: not central.
    Pupil(Pupil),
    /// Stereographic with a correction by a spline; sees more than 180°.
    Spline(Spline),
}

impl Lens {
    fn law(&self) -> &dyn LensLaw {
        match self {
            Self::BrownConrady(lens) => lens,
            Self::KannalaBrandt(lens) => lens,
            Self::ExtendedUnified(lens) => lens,
            Self::DoubleSphere(lens) => lens,
            Self::Pupil(lens) => lens,
            Self::Spline(lens) => lens,
        }
    }

    fn law_mut(&mut self) -> &mut dyn LensLaw {
        match self {
            Self::BrownConrady(lens) => lens,
            Self::KannalaBrandt(lens) => lens,
            Self::ExtendedUnified(lens) => lens,
            Self::DoubleSphere(lens) => lens,
            Self::Pupil(lens) => lens,
            Self::Spline(lens) => lens,
        }
    }

    /// The names of its parameters, such as `k1`, in the order of [`Self::parameters`].
    pub fn names(&self) -> Vec<String> {
        self.law().names()
    }

    /// The values of its parameters, in the order of [`Self::names`].
    pub fn parameters(&self) -> Vec<f64> {
        self.law().parameters()
    }

    /// The same lens with other values of its parameters; `values` are as many as it has.
    pub fn with_parameters(&self, values: &[f64]) -> Self {
        let mut lens = self.clone();
        lens.law_mut().set_parameters(values);
        lens
    }

    /// The image of a point of the camera frame with all derivatives; `by_parameters` takes one
    /// pair for each parameter, of a spline none: see [`Self::knots`]. `None` where the formula has no value that a search may pass through;
    /// rational lenses have one beyond their domain too.
    pub fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        self.law().image(point, by_parameters)
    }

    /// The knots on which the image of a point depends, of a spline; other lenses have their derivatives from
    /// [`Self::image`].
    pub fn knots(&self, point: DVec3) -> Option<Knots> {
        match self {
            Self::Spline(lens) => lens.knots_of(point),
            _ => None,
        }
    }

    /// Whether a point that has an image lies in the domain of the model.
    pub fn covers(&self, point: DVec3) -> bool {
        self.law().covers(point)
    }

    /// The ray that is imaged at a point of the normalised plane; `None` where there is none.
    pub fn ray(&self, at: DVec2) -> Option<Ray> {
        self.law().ray(at)
    }

    /// Radius on the normalised plane up to which it grows steadily with the angle, without fold or
    /// pole; `None` where it does so as far as the model sees.
    pub fn steady_radius(&self) -> Option<f64> {
        self.law().steady_radius()
    }

    /// Whether it is perspective, and so sees all of the image.
    pub fn is_perspective(&self) -> bool {
        matches!(self, Self::BrownConrady(_))
    }
}
