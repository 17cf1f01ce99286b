//! Models of lenses: names, where their search starts, which parameters are free, smaller and richer ones.

use std::f64::consts::FRAC_PI_2;
use std::mem::discriminant;
use std::str::FromStr;
use std::{fmt, iter};

use glam::DVec2;

use deltille_core::camera::{
    DoubleSphere, Lens, LensKind, MAX_LENS_PARAMETERS, PROJECTION_PARAMETERS, SplineGrid,
};

/// Terms of a Kannala–Brandt polynomial unless said otherwise.
const TERMS: usize = 4;

/// Terms that hold the fisheyes which [`TERMS`] do not; from there on it is not for want of terms.
const MORE_TERMS: usize = 6;

/// Knots of a spline whose lens is not known yet; a perspective one of 4 : 3 has about as many.
const SPLINE_KNOTS: [usize; 2] = [16, 12];

/// The degree of a spline unless said otherwise.
const SPLINE_DEGREE: usize = 3;

/// ξ in the two valleys of double sphere.
const VALLEYS: [f64; 2] = [-0.3, 0.3];

/// A camera model: which parameters are estimated beside fx, fy, cx and cy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Model {
    /// Perspective with k1, k2, p1, p2.
    Radtan,
    /// As [`Self::Radtan`], and k3.
    Radtan5,
    /// As [`Self::Radtan5`], and k4, k5, k6.
    Rational,
    /// As [`Self::Rational`], and s1, s2, s3, s4.
    ThinPrism,
    /// Equidistant fisheye polynomial with so many coefficients k1, k2, ….
    KannalaBrandt(usize),
    /// Extended unified camera model with α and β.
    Eucm,
    /// Double sphere model with ξ and α.
    DoubleSphere,
    /// Equidistant polynomial with a moving entrance pupil.
    Pupil,
    /// Stereographic with a correction by a spline, see [`Spline`]. fx, fy, cx, cy are not found: they are those of the
    /// parametric lens from which the search starts.
    Spline {
        /// Degree of the polynomials, 2 or 3.
        degree: usize,
        /// Knots along x and y; where none are said as many as it takes for them to be a twelfth of the image's longer
        /// side apart in its middle.
        knots: Option<[usize; 2]>,
    },
}

/// A text that is no model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ModelError(String);

/// What is known of a model.
struct Facts {
    /// What it is asked for by.
    name: &'static str,
    /// The model, of those with a number the one that the name alone stands for.
    model: Model,
    /// Its lens.
    lens: LensKind,
    /// How many parameters of the lens it has at most, from the first; the others are zero.
    found: usize,
    /// What help texts say of it.
    help: &'static str,
    /// What errors say of its name.
    forms: &'static str,
    /// See [`Model::richer`].
    richer: &'static [Model],
}

impl Facts {
    /// Whether they are of this model, with whatever number.
    fn is_of(&self, model: Model) -> bool {
        discriminant(&self.model) == discriminant(&model)
    }
}

/// A model of which nothing more is to be said.
const PLAIN: Facts = Facts {
    name: "",
    model: Model::Radtan,
    lens: LensKind::BrownConrady,
    found: usize::MAX,
    help: "",
    forms: "",
    richer: &[],
};

/// The models, in the order in which they are listed; those of one lens with fewer parameters first.
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
        help: "and k3",
        richer: &[Model::Rational, Model::ThinPrism, Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "rational",
        model: Model::Rational,
        lens: LensKind::BrownConrady,
        found: 8,
        help: "and k4 k5 k6",
        richer: &[Model::ThinPrism, Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "thin-prism",
        model: Model::ThinPrism,
        lens: LensKind::BrownConrady,
        help: "and s1 … s4",
        richer: &[Model::KannalaBrandt(TERMS)],
        ..PLAIN
    },
    Facts {
        name: "kannala-brandt",
        model: Model::KannalaBrandt(TERMS),
        lens: LensKind::KannalaBrandt,
        help: "4 terms; kannala-brandt-5 …",
        forms: "with 4 terms; kannala-brandt-5 and so on up to 12",
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
        help: "any smooth lens, of degree 3; spline-2; spline-3-16x12 with so many knots",
        forms: "of degree 3; spline-2; with as many knots as you say: spline-3-16x12",
        ..PLAIN
    },
];

/// Those that are tried where the model is to be chosen; of two that hold the views alike and have as many parameters,
/// the first is taken.
pub(super) const TRIED: [Model; 10] = [
    Model::Radtan,
    Model::Eucm,
    Model::DoubleSphere,
    Model::Radtan5,
    Model::KannalaBrandt(TERMS),
    Model::KannalaBrandt(MORE_TERMS),
    Model::Rational,
    Model::Pupil,
    Model::ThinPrism,
    Model::SPLINE,
];

/// The models with what is said of each, as a list in a sentence.
fn listed(said: impl Fn(&Facts) -> &'static str) -> String {
    let model = |facts: &Facts| match said(facts) {
        "" => facts.name.to_owned(),
        said => format!("{} ({said})", facts.name),
    };
    let [before @ .., last] = &MODELS.each_ref().map(model);
    format!("{}, or {last}", before.join(", "))
}

impl Model {
    /// A cubic spline with as many knots as it takes.
    pub const SPLINE: Self = Self::Spline { degree: SPLINE_DEGREE, knots: None };

    /// The models by name; of those with a number the one that the name alone stands for.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        MODELS.iter().map(|facts| (facts.name, facts.model))
    }

    /// What may be asked for, in words, with what each is.
    pub fn choice() -> String {
        listed(|facts| facts.help)
    }

    fn facts(self) -> &'static Facts {
        MODELS.iter().find(|facts| facts.is_of(self)).expect("every model is in the table")
    }

    /// What kind of lens it has.
    pub fn kind(self) -> LensKind {
        self.facts().lens
    }

    /// How many parameters of its lens it has, from the first; the others are zero.
    pub fn found(self) -> usize {
        self.lens().names().len().min(self.facts().found)
    }

    /// A lens of this model to start from: near the axis its radius is that of the angle.
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

    /// The lenses to start from, each with its focal length over that of an ideal camera.
    ///
    /// The cost of double sphere has two valleys, one on either side of ξ = 0, and no way between
    /// them. Near the axis its radius is fx/(1 + ξ) times the angle; with the α here it is so at 90°
    /// too:
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

    /// Which of the camera's parameters it has.
    pub fn free(self) -> Vec<bool> {
        let count = PROJECTION_PARAMETERS.len();
        let (lens, found) = (self.lens(), self.found());
        let free = (0..lens.names().len()).map(|i| i < found);
        without_gauge(&lens, iter::repeat_n(true, count).chain(free).collect())
    }

    /// The next one that has fewer of the same parameters, where there is one.
    pub fn smaller(self) -> Option<Self> {
        match self {
            Self::KannalaBrandt(terms) if terms > TERMS => Some(Self::KannalaBrandt(terms - 1)),
            _ => {
                let before = MODELS.iter().take_while(|facts| !facts.is_of(self));
                before.filter(|facts| facts.lens == self.kind()).last().map(|facts| facts.model)
            }
        }
    }

    /// Those that may hold a lens where this one does not, the simplest first.
    pub fn richer(self) -> &'static [Self] {
        match self {
            Self::KannalaBrandt(terms) if terms >= MORE_TERMS => &[Self::Pupil],
            _ => self.facts().richer,
        }
    }

    /// Models to be compared with it, and it: of those that are tried the ones for lenses of its kind, and the polynomial
    /// for any; no spline.
    pub(super) fn neighbours(self) -> Vec<Self> {
        let is_alike = |other: &Self| {
            let is_of_any = *other == Self::KannalaBrandt(TERMS);
            (other.is_perspective() == self.is_perspective() || is_of_any) && *other != Self::SPLINE
        };
        let of_kind: Vec<Self> = TRIED.into_iter().filter(is_alike).collect();
        let own = Some(self).filter(|own| !of_kind.contains(own));
        of_kind.into_iter().chain(own).collect()
    }

    /// The parameters that are found first, while poses are rough: focal lengths and the two
    /// coarsest of the lens.
    pub(super) fn coarse(self) -> Vec<bool> {
        let coarse = |i: usize| matches!(i, 0 | 1 | 4 | 5);
        (0..self.free().len()).map(coarse).collect()
    }

    /// Whether it sees no more than a half-space.
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
            // Any field of view: it is found later.
            SplineGrid::new(degree, knots.unwrap_or(SPLINE_KNOTS), 90)
                .map_err(|error| ModelError(format!("`{text}` is no model: {error}")))?;
            return Ok(Self::Spline { degree, knots });
        }
        let terms = text.strip_prefix("kannala-brandt-").and_then(|terms| terms.parse().ok());
        match terms.filter(|terms| (TERMS..=MAX_LENS_PARAMETERS).contains(terms)) {
            Some(terms) => Ok(Self::KannalaBrandt(terms)),
            None => {
                Err(ModelError(format!("`{text}` is no model: {}", listed(|facts| facts.forms))))
            }
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

/// Degree and knots of what follows `spline-`.
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

/// Which parameters of a camera are found of those that are to be, without those that others make up for.
///
/// Of a spline that is fx, fy, cx, cy; and as any turn of the camera is a spline too, three numbers hold it: the knot in
/// the middle stays where it is, and the one to its right in its row.
pub(super) fn without_gauge(lens: &Lens, mut free: Vec<bool>) -> Vec<bool> {
    let Lens::Spline(spline) = lens else { return free };
    if !free.contains(&true) {
        return free;
    }
    let (grid, of_lens) = (spline.grid(), PROJECTION_PARAMETERS.len());
    // A model does not know how many knots it takes.
    free = match free.len() == of_lens + 2 * grid.count() {
        true => free,
        false => vec![true; of_lens + 2 * grid.count()],
    };
    free[..of_lens].fill(false);
    let middle = of_lens + 2 * (grid.rows / 2 * grid.columns + grid.columns / 2);
    // dx and dy of the middle, and dy of the next.
    for held in [middle, middle + 1, middle + 3] {
        free[held] = false;
    }
    free
}
