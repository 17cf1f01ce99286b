//! Models of lenses: names, where their search starts, which parameters are free, smaller and richer ones.

use std::f64::consts::FRAC_PI_2;
use std::fmt;
use std::str::FromStr;

use glam::DVec2;

use deltille_core::camera::{
    BrownConrady, DoubleSphere, ExtendedUnified, KannalaBrandt, Lens, MAX_LENS_PARAMETERS,
    PROJECTION_PARAMETERS, Pupil, Spline, SplineGrid,
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

impl Model {
    const NAMED: [(&str, Model); 9] = [
        ("radtan", Self::Radtan),
        ("radtan5", Self::Radtan5),
        ("rational", Self::Rational),
        ("thin-prism", Self::ThinPrism),
        ("kannala-brandt", Self::KannalaBrandt(TERMS)),
        ("eucm", Self::Eucm),
        ("double-sphere", Self::DoubleSphere),
        ("pupil", Self::Pupil),
        ("spline", Self::SPLINE),
    ];

    /// A cubic spline with as many knots as it takes.
    pub const SPLINE: Self = Self::Spline { degree: SPLINE_DEGREE, knots: None };

    /// A lens of this model to start from: near the axis its radius is that of the angle.
    pub fn lens(self) -> Lens {
        match self {
            Self::Radtan | Self::Radtan5 | Self::Rational | Self::ThinPrism => {
                Lens::BrownConrady(BrownConrady::default())
            }
            Self::KannalaBrandt(terms) => {
                Lens::KannalaBrandt(KannalaBrandt { k: vec![0.0; terms] })
            }
            Self::Eucm => Lens::ExtendedUnified(ExtendedUnified::default()),
            Self::DoubleSphere => Lens::DoubleSphere(DoubleSphere::default()),
            Self::Pupil => Lens::Pupil(Pupil::default()),
            Self::Spline { degree, knots } => {
                let grid = SplineGrid::over(degree, knots.unwrap_or(SPLINE_KNOTS), DVec2::ONE);
                Lens::Spline(Spline::new(grid))
            }
        }
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
        let lens = match self {
            Self::Radtan => 4,
            Self::Radtan5 => 5,
            Self::Rational => 8,
            _ => self.lens().names().len(),
        };
        let count = PROJECTION_PARAMETERS.len();
        let free = (0..count + self.lens().names().len()).map(|i| i < count + lens).collect();
        without_gauge(&self.lens(), free)
    }

    /// The next one that has fewer of the same parameters, where there is one.
    pub fn smaller(self) -> Option<Self> {
        match self {
            Self::Radtan5 => Some(Self::Radtan),
            Self::Rational => Some(Self::Radtan5),
            Self::ThinPrism => Some(Self::Rational),
            Self::KannalaBrandt(terms) if terms > TERMS => Some(Self::KannalaBrandt(terms - 1)),
            Self::Radtan
            | Self::KannalaBrandt(_)
            | Self::Eucm
            | Self::DoubleSphere
            | Self::Pupil
            | Self::Spline { .. } => None,
        }
    }

    /// Those that may hold a lens where this one does not, the simplest first.
    pub fn richer(self) -> &'static [Self] {
        match self {
            Self::Radtan | Self::Radtan5 => {
                &[Self::Rational, Self::ThinPrism, Self::KannalaBrandt(TERMS)]
            }
            Self::Rational => &[Self::ThinPrism, Self::KannalaBrandt(TERMS)],
            Self::ThinPrism => &[Self::KannalaBrandt(TERMS)],
            Self::KannalaBrandt(terms) if terms < MORE_TERMS => {
                &[Self::KannalaBrandt(MORE_TERMS), Self::Pupil]
            }
            Self::KannalaBrandt(_) => &[Self::Pupil],
            Self::Eucm | Self::DoubleSphere => &[Self::KannalaBrandt(TERMS), Self::Pupil],
            Self::Pupil | Self::Spline { .. } => &[],
        }
    }

    /// Models to be compared with it, and it: those for lenses of its kind, fewer parameters first.
    pub(super) fn neighbours(self) -> Vec<Self> {
        let of_kind = match self.is_perspective() {
            true => [
                Self::Radtan,
                Self::Radtan5,
                Self::KannalaBrandt(4),
                Self::Rational,
                Self::ThinPrism,
            ],
            false => [
                Self::Eucm,
                Self::DoubleSphere,
                Self::KannalaBrandt(TERMS),
                Self::KannalaBrandt(MORE_TERMS),
                Self::Pupil,
            ],
        };
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
        matches!(self.lens(), Lens::BrownConrady(_))
    }
}

impl FromStr for Model {
    type Err = ModelError;

    fn from_str(text: &str) -> Result<Self, ModelError> {
        if let Some(&(_, model)) = Self::NAMED.iter().find(|(name, _)| *name == text) {
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
            None => Err(ModelError(format!(
                "`{text}` is no model: radtan, radtan5, rational, thin-prism, kannala-brandt (with 4 terms; \
                 kannala-brandt-5 and so on up to 12), eucm, double-sphere, pupil, or spline (of degree 3; spline-2; \
                 with as many knots as you say: spline-3-16x12)"
            ))),
        }
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (Self::NAMED.iter().find(|(_, model)| model == self), self) {
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
