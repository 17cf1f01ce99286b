use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::law::{Imaged, LensLaw, Ray};
use super::{
    BrownConrady, DoubleSphere, ExtendedUnified, KannalaBrandt, Knots, Pupil, Spline, SplineGrid,
};
use crate::quantity::Range;

/// Largest number of parameters of a lens whose parameters all affect every point; those of a spline act locally.
pub const MAX_LENS_PARAMETERS: usize = 12;

/// Defines the enum of lenses. Each line contains a type, the name of the model in camera files, names of models that a
/// file may contain instead, the name in messages, and a start value. The start value depends on the number of
/// coefficients and an optional grid.
macro_rules! lenses {
    ($($(#[$doc:meta])* $lens:ident $name:literal [$($alias:literal)*] $title:literal $given:pat => $start:expr,)*) => {
        /// Projection from the camera frame to the normalised image plane.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Lens {
            $($(#[$doc])* $lens($lens),)*
        }

        /// Kind of a lens.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum LensKind {
            $($(#[$doc])* #[serde(rename = $name, $(alias = $alias),*)] $lens,)*
        }

        impl LensKind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$lens),*];

            /// Returns the name of the model in camera files.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$lens => $name,)*
                }
            }

            /// Returns the name in messages, such as `a double sphere lens`.
            pub fn title(self) -> &'static str {
                match self {
                    $(Self::$lens => $title,)*
                }
            }

            /// Returns a lens of this kind as a start value, with `count` coefficients if their number is free. Returns
            /// `None` for a spline without a grid, or another lens with one.
            pub fn lens(self, count: usize, grid: Option<SplineGrid>) -> Option<Lens> {
                match (self, (count, grid)) {
                    $((Self::$lens, $given) => Some(Lens::$lens($start)),)*
                    _ => None,
                }
            }
        }

        impl Lens {
            fn law(&self) -> &dyn LensLaw {
                match self {
                    $(Self::$lens(lens) => lens,)*
                }
            }

            fn law_mut(&mut self) -> &mut dyn LensLaw {
                match self {
                    $(Self::$lens(lens) => lens,)*
                }
            }

            /// Returns the kind.
            pub fn kind(&self) -> LensKind {
                match self {
                    $(Self::$lens(_) => LensKind::$lens,)*
                }
            }
        }
    };
}

lenses! {
    /// Perspective with polynomial or rational distortion; sees less than 180°.
    BrownConrady "pinhole" ["radtan" "radtan5" "rational" "thin-prism"] "a perspective lens" (_, None) => BrownConrady::default(),
    /// Equidistant polynomial; sees more than 180° if its polynomial increases.
    KannalaBrandt "fisheye" ["kannala-brandt"] "a fisheye polynomial" (count, None) => KannalaBrandt { k: vec![0.0; count] },
    /// Extended unified model; sees more than 180°.
    ExtendedUnified "eucm" [] "an EUCM lens" (_, None) => ExtendedUnified::default(),
    /// Double sphere; sees more than 180°.
    DoubleSphere "double-sphere" [] "a double sphere lens" (_, None) => DoubleSphere::default(),
    /// Equidistant polynomial with a moving entrance pupil: not central.
    Pupil "pupil" [] "a fisheye with a moving pupil" (_, None) => Pupil::default(),
    /// Stereographic with a spline correction; sees more than 180°.
    Spline "spline" [] "a spline" (_, Some(grid)) => Spline::new(grid),
}

impl Lens {
    /// Returns the ranges of the first parameters; the others have the range of coefficients.
    pub fn ranges(&self) -> &'static [Range] {
        self.law().ranges()
    }

    /// Returns the minimum number of coefficients in a camera file, which omits zeros at the end.
    /// Returns `None` if a file always has all of them.
    pub fn least_coefficients(&self) -> Option<usize> {
        self.law().least_coefficients()
    }

    /// Returns the names of the parameters, for example `k1`, in the order of [`Self::parameters`].
    pub fn names(&self) -> Vec<String> {
        self.law().names()
    }

    /// Returns the values of the parameters, in the order of [`Self::names`].
    pub fn parameters(&self) -> Vec<f64> {
        self.law().parameters()
    }

    /// Returns the lens with new parameter values; `values` has one entry per parameter.
    pub fn with_parameters(&self, values: &[f64]) -> Self {
        let mut lens = self.clone();
        lens.law_mut().set_parameters(values);
        lens
    }

    /// Returns the image of a point in the camera frame with all derivatives. `by_parameters` receives one pair per
    /// parameter; a spline has none there, see [`Self::knots`]. Returns `None` if the formula has no value there that
    /// an optimiser may use. Rational lenses have a value beyond their domain too.
    pub fn image(&self, point: DVec3, by_parameters: &mut [[f64; 2]]) -> Option<Imaged> {
        self.law().image(point, by_parameters)
    }

    /// Returns the knots of a spline that affect the image of a point. Other lenses have their derivatives from
    /// [`Self::image`].
    pub fn knots(&self, point: DVec3) -> Option<Knots> {
        match self {
            Self::Spline(lens) => lens.knots_of(point),
            _ => None,
        }
    }

    /// Returns whether a point that has an image lies in the domain of the model.
    pub fn covers(&self, point: DVec3) -> bool {
        self.law().covers(point)
    }

    /// Returns the ray that is imaged at a point of the normalised plane, if there is one.
    pub fn ray(&self, at: DVec2) -> Option<Ray> {
        self.law().ray(at)
    }

    /// Returns the radius on the normalised plane up to which the radius increases monotonically
    /// with the angle, without a fold or pole. Returns `None` if it does so over the whole field of
    /// view.
    pub fn monotonic_radius(&self) -> Option<f64> {
        self.law().monotonic_radius()
    }

    /// Returns whether the lens is perspective, so that it covers the whole image.
    pub fn is_perspective(&self) -> bool {
        matches!(self, Self::BrownConrady(_))
    }
}
