//! Lens models: names, starting points, free parameters, and smaller and richer models.

use std::f64::consts::FRAC_PI_2;
use std::mem::discriminant;
use std::str::FromStr;
use std::{fmt, iter};

use glam::DVec2;

use deltille_core::camera::{
    DoubleSphere, Lens, LensKind, MAX_LENS_PARAMETERS, PROJECTION_PARAMETERS, SplineGrid,
};

/// Default number of terms of a Kannala–Brandt polynomial.
const TERMS: usize = 4;

/// Number of terms for fisheye lenses that [`TERMS`] do not describe; further terms do not help.
const MORE_TERMS: usize = 6;

/// Knots of a spline before the lens is known; a perspective lens with a 4 : 3 image needs about this number.
const SPLINE_KNOTS: [usize; 2] = [16, 12];

/// Default degree of a spline.
const SPLINE_DEGREE: usize = 3;

/// Starting values of ξ in the two cost valleys of the double sphere model.
const VALLEYS: [f64; 2] = [-0.3, 0.3];

/// A camera model: which parameters are estimated in addition to fx, fy, cx and cy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Model {
    /// Perspective with k1, k2, p1, p2.
    Radtan,
    /// [`Self::Radtan`] with k3.
    Radtan5,
    /// [`Self::Radtan5`] with k4, k5, k6.
    Rational,
    /// [`Self::Rational`] with s1, s2, s3, s4.
    ThinPrism,
    /// Equidistant fisheye polynomial with the given number of coefficients k1, k2, ….
    KannalaBrandt(usize),
    /// Extended unified camera model with α and β.
    Eucm,
    /// Double sphere model with ξ and α.
    DoubleSphere,
    /// Equidistant polynomial with a moving entrance pupil.
    Pupil,
    /// Stereographic projection with a spline correction, see [`deltille_core::camera::Spline`]. fx, fy, cx, cy are fixed at those of the
    /// parametric lens from which the search starts.
    Spline {
        /// Degree of the polynomials, 2 or 3.
        degree: usize,
        /// Number of knots along x and y. `None` spaces the knots by a twelfth of the longer image side in the image
        /// centre.
        knots: Option<[usize; 2]>,
    },
}

/// An unknown name of a model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ModelError(String);

/// Properties of a model.
struct Facts {
    /// The name that selects it.
    name: &'static str,
    /// The model; for models with a number, the one with the default number.
    model: Model,
    /// Its lens.
    lens: LensKind,
    /// Maximum number of lens parameters that are estimated, counted from the first; the others are
    /// zero.
    found: usize,
    /// Its description in help texts.
    help: &'static str,
    /// The forms of its name in error messages.
    forms: &'static str,
    /// See [`Model::richer`].
    richer: &'static [Model],
}

impl Facts {
    /// Whether these are the properties of this model, whatever its number of terms or knots.
    fn is_of(&self, model: Model) -> bool {
        discriminant(&self.model) == discriminant(&model)
    }
}

/// Default properties of a model.
const PLAIN: Facts = Facts {
    name: "",
    model: Model::Radtan,
    lens: LensKind::BrownConrady,
    found: usize::MAX,
    help: "",
    forms: "",
    richer: &[],
};

/// The models in the order of lists; models of the same lens are sorted by number of parameters.
const MODELS: [Facts; 9] = [
    Facts {
        name: "radtan",
        model: Model::Radtan,
        lens: LensKind::BrownConrady,
        found: 4,
        help: "k1 k2 p1 p2",
        richer: &[Model::Rational, Model::ThinPrism, Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "radtan5",
        model: Model::Radtan5,
        lens: LensKind::BrownConrady,
        found: 5,
        help: "radtan and k3",
        richer: &[Model::Rational, Model::ThinPrism, Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "rational",
        model: Model::Rational,
        lens: LensKind::BrownConrady,
        found: 8,
        help: "radtan5 and k4 k5 k6",
        richer: &[Model::ThinPrism, Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "thin-prism",
        model: Model::ThinPrism,
        lens: LensKind::BrownConrady,
        help: "rational and s1 … s4",
        richer: &[Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "kannala-brandt",
        model: Model::KannalaBrandt(TERMS),
        lens: LensKind::KannalaBrandt,
        help: "4 terms; kannala-brandt-5 to kannala-brandt-12 for more",
        forms: "4 terms; kannala-brandt-5 to kannala-brandt-12",
        richer: &[Model::KannalaBrandt(MORE_TERMS), Model::Pupil],
        ..PLAIN
    },
    Facts {
        name: "eucm",
        model: Model::Eucm,
        lens: LensKind::ExtendedUnified,
        richer: &[Model::KannalaBrandt(TERMS), Model::Pupil],
        ..PLAIN
    },
    Facts {
        name: "double-sphere",
        model: Model::DoubleSphere,
        lens: LensKind::DoubleSphere,
        richer: &[Model::KannalaBrandt(TERMS), Model::Pupil],
        ..PLAIN
    },
    Facts {
        name: "pupil",
        model: Model::Pupil,
        lens: LensKind::Pupil,
        help: "fisheye with a moving entrance pupil",
        ..PLAIN
    },
    Facts {
        name: "spline",
        model: Model::SPLINE,
        lens: LensKind::Spline,
        help: "any smooth lens, degree 3; spline-2 for degree 2; spline-3-16x12 for 16 × 12 knots",
        forms: "degree 3; spline-2 for degree 2; spline-3-16x12 for 16 × 12 knots",
        ..PLAIN
    },
];

/// Names in other programs: OpenCV, ROS, Kalibr, COLMAP and mrcal. Case does not matter, and `_` equals `-`.
const ELSEWHERE: [(Model, &[&str]); 7] = [
    (Model::Radtan, &["pinhole", "pinhole-radtan", "radial", "simple-radial", "opencv4"]),
    (Model::Radtan5, &["opencv", "opencv5", "plumb-bob", "brown", "brown-conrady"]),
    (Model::Rational, &["rational-polynomial", "full-opencv", "opencv8"]),
    (Model::ThinPrism, &["opencv12"]),
    (
        Model::KannalaBrandt(TERMS),
        &["fisheye", "opencv-fisheye", "equidistant", "equi", "pinhole-equi", "kb4"],
    ),
    (Model::DoubleSphere, &["ds", "ds-none"]),
    (Model::SPLINE, &["splined-stereographic"]),
];

/// The models, each with a description, as a list in a sentence.
fn listed(said: impl Fn(&Facts) -> &'static str) -> String {
    let model = |facts: &Facts| match said(facts) {
        "" => facts.name.to_owned(),
        said => format!("{} ({said})", facts.name),
    };
    let [before @ .., last] = &MODELS.each_ref().map(model);
    format!("{}, or {last}", before.join(", "))
}

impl Model {
    /// A cubic spline with an automatic number of knots.
    pub const SPLINE: Self = Self::Spline { degree: SPLINE_DEGREE, knots: None };

    /// The candidates of automatic model selection. Of two equally good models with the same number of parameters, the first
    /// is selected.
    pub const CANDIDATES: [Self; 10] = [
        Self::Radtan,
        Self::Eucm,
        Self::DoubleSphere,
        Self::Radtan5,
        Self::KannalaBrandt(TERMS),
        Self::KannalaBrandt(MORE_TERMS),
        Self::Rational,
        Self::Pupil,
        Self::ThinPrism,
        Self::SPLINE,
    ];

    /// Returns the models by name; models with a number have the default number.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        MODELS.iter().map(|facts| (facts.name, facts.model))
    }

    /// Returns the list of all models with their descriptions, for a sentence.
    pub fn choice() -> String {
        listed(|facts| facts.help)
    }

    /// Returns the model that has this name in OpenCV, ROS, Kalibr, COLMAP or mrcal; `None` for own and unknown names.
    pub fn named_elsewhere(name: &str) -> Option<Self> {
        let name = name.to_lowercase().replace('_', "-");
        let name = name.strip_prefix("lensmodel-").unwrap_or(&name);
        ELSEWHERE.iter().find(|(_, names)| names.contains(&name)).map(|(model, _)| *model)
    }

    /// Returns its name with its description, such as `radtan (k1 k2 p1 p2)`.
    pub fn described(self) -> String {
        match self.facts().help {
            "" => self.to_string(),
            help => format!("{self} ({help})"),
        }
    }

    fn facts(self) -> &'static Facts {
        MODELS.iter().find(|facts| facts.is_of(self)).expect("every model is in the table")
    }

    /// Returns the kind of its lens.
    pub fn kind(self) -> LensKind {
        self.facts().lens
    }

    /// Returns the number of estimated lens parameters, counted from the first; the others are
    /// zero.
    pub fn parameter_count(self) -> usize {
        self.lens().names().len().min(self.facts().found)
    }

    /// Returns an initial lens of this model: near the axis, its radius equals the angle.
    pub fn lens(self) -> Lens {
        let (terms, grid) = match self {
            Self::KannalaBrandt(terms) => (terms, None),
            Self::Spline { degree, knots } => {
                (0, Some(SplineGrid::over(degree, knots.unwrap_or(SPLINE_KNOTS), DVec2::ONE)))
            }
            _ => (0, None),
        };
        self.kind().lens(terms, grid).expect("a spline has a grid, and no other lens")
    }

    /// Returns the initial lenses, each with the ratio of its focal length to that of an ideal camera.
    ///
    /// The cost of the double sphere model has two valleys, one on either side of ξ = 0, separated by a
    /// barrier. Near the axis, its radius is fx/(1 + ξ) times the angle; this α gives the same ratio at
    /// 90°:
    ///
    /// ```text
    ///     (1 + ξ) / (α √(1 + ξ²) + (1 − α) ξ) = π/2
    /// ```
    pub(super) fn starts(self) -> Vec<(Lens, f64)> {
        match self {
            Self::DoubleSphere => VALLEYS
                .map(|xi| {
                    let alpha = ((1.0 + xi) / FRAC_PI_2 - xi) / ((1.0 + xi * xi).sqrt() - xi);
                    (Lens::DoubleSphere(DoubleSphere { xi, alpha }), 1.0 + xi)
                })
                .to_vec(),
            _ => vec![(self.lens(), 1.0)],
        }
    }

    /// Returns, for each camera parameter, whether the model estimates it.
    pub fn free(self) -> Vec<bool> {
        let count = PROJECTION_PARAMETERS.len();
        let (lens, found) = (self.lens(), self.parameter_count());
        let free = (0..lens.names().len()).map(|i| i < found);
        without_gauge(&lens, iter::repeat_n(true, count).chain(free).collect())
    }

    /// Returns the next smaller model with a subset of the same parameters, if there is one.
    pub fn smaller(self) -> Option<Self> {
        match self {
            Self::KannalaBrandt(terms) if terms > TERMS => Some(Self::KannalaBrandt(terms - 1)),
            _ => {
                let before = MODELS.iter().take_while(|facts| !facts.is_of(self));
                before.filter(|facts| facts.lens == self.kind()).last().map(|facts| facts.model)
            }
        }
    }

    /// Returns models that may fit a lens that this model does not fit, the simplest first.
    pub fn richer(self) -> &'static [Self] {
        match self {
            Self::KannalaBrandt(terms) if terms >= MORE_TERMS => &[Self::Pupil],
            _ => self.facts().richer,
        }
    }

    /// Returns the models to compare with this one, including it: the candidates for the same kind of lens and the fisheye
    /// polynomial, without splines.
    pub(super) fn neighbours(self) -> Vec<Self> {
        let is_alike = |other: &Self| {
            let is_of_any = *other == Self::KannalaBrandt(TERMS);
            (other.is_perspective() == self.is_perspective() || is_of_any) && *other != Self::SPLINE
        };
        let of_kind: Vec<Self> = Self::CANDIDATES.into_iter().filter(is_alike).collect();
        let own = Some(self).filter(|own| !of_kind.contains(own));
        of_kind.into_iter().chain(own).collect()
    }

    /// Returns the parameters that are estimated first, while poses are rough: focal lengths and the two
    /// most important of the lens.
    pub(super) fn coarse(self) -> Vec<bool> {
        let coarse = |i: usize| matches!(i, 0 | 1 | 4 | 5);
        (0..self.free().len()).map(coarse).collect()
    }

    /// Whether its field of view is limited to a half-space.
    pub(super) fn is_perspective(self) -> bool {
        self.kind() == LensKind::BrownConrady
    }
}

impl FromStr for Model {
    type Err = ModelError;

    fn from_str(text: &str) -> Result<Self, ModelError> {
        if let Some((_, model)) = Self::named().find(|(name, _)| *name == text) {
            return Ok(model);
        }
        if let Some((degree, knots)) = text.strip_prefix("spline-").and_then(spline) {
            // The field of view is estimated later.
            SplineGrid::new(degree, knots.unwrap_or(SPLINE_KNOTS), 90)
                .map_err(|error| ModelError(format!("invalid model `{text}`: {error}")))?;
            return Ok(Self::Spline { degree, knots });
        }
        let terms = text.strip_prefix("kannala-brandt-").and_then(|terms| terms.parse().ok());
        match terms.filter(|terms| (TERMS..=MAX_LENS_PARAMETERS).contains(terms)) {
            Some(terms) => Ok(Self::KannalaBrandt(terms)),
            None => Err(ModelError(format!(
                "unknown model `{text}`; known: {}",
                listed(|facts| facts.forms)
            ))),
        }
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (Self::named().find(|(_, model)| model == self), self) {
            (Some((name, _)), _) => f.write_str(name),
            (None, Self::KannalaBrandt(terms)) => write!(f, "kannala-brandt-{terms}"),
            (None, Self::Spline { degree, knots: None }) => write!(f, "spline-{degree}"),
            (None, Self::Spline { degree, knots: Some([columns, rows]) }) => {
                write!(f, "spline-{degree}-{columns}x{rows}")
            }
            (None, other) => write!(f, "{other:?}"),
        }
    }
}

/// Parses the degree and the knots after `spline-`.
fn spline(text: &str) -> Option<(usize, Option<[usize; 2]>)> {
    let (degree, knots) = match text.split_once('-') {
        Some((degree, knots)) => (degree, Some(knots.split_once('x')?)),
        None => (text, None),
    };
    let degree: usize = degree.parse().ok()?;
    let knots = match knots {
        Some((columns, rows)) => Some([columns.parse().ok()?, rows.parse().ok()?]),
        None => None,
    };
    Some((degree, knots))
}

/// Removes gauge parameters from the free parameters of a camera.
///
/// For a spline, these are fx, fy, cx, cy. A spline can also represent any rotation of the camera,
/// so three more numbers are fixed: both coordinates of the knot in the middle, and one of the knot
/// to its right.
pub(super) fn without_gauge(lens: &Lens, mut free: Vec<bool>) -> Vec<bool> {
    let Lens::Spline(spline) = lens else { return free };
    if !free.contains(&true) {
        return free;
    }
    let (grid, of_lens) = (spline.grid(), PROJECTION_PARAMETERS.len());
    // A model does not know the number of knots.
    free = match free.len() == of_lens + 2 * grid.count() {
        true => free,
        false => vec![true; of_lens + 2 * grid.count()],
    };
    free[..of_lens].fill(false);
    let middle = of_lens + 2 * (grid.rows / 2 * grid.columns + grid.columns / 2);
    // dx and dy of the middle, and dy of the next.
    for fixed in [middle, middle + 1, middle + 3] {
        free[fixed] = false;
    }
    free
}
