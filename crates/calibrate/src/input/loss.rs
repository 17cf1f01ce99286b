//! Robust loss: how a residual counts.

/// Residuals count in full up to this many standard deviations. Of normally distributed corners
/// 1.1 % lie beyond it, so that little is lost on data without outliers.
const SCALE_SIGMA: f64 = 3.0;

/// How the distance e of a corner from its prediction counts, in standard deviations.
///
/// ```text
///     squared  e²          Huber  e² up to c, then 2ce − c²          Cauchy  c² ln(1 + e²/c²)
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Loss {
    /// Every corner in full: least squares.
    Squared,
    /// Corners far off pull with a constant force.
    #[default]
    Huber,
    /// Corners far off hardly pull.
    Cauchy,
}

/// How a corner pulls at what explains it, for an estimate's covariance.
pub(crate) struct Influence {
    /// Its weight in the normal equations.
    pub weight: f64,
    /// The square of its pull.
    pub squared: f64,
    /// By how much the pull grows with a coordinate, the mean of both.
    pub slope: f64,
}

impl Loss {
    /// What a squared distance costs, and the weight of its normal equations, where a standard
    /// deviation is `sigma`.
    pub(crate) fn of(self, squared: f64, sigma: f64) -> (f64, f64) {
        let c = SCALE_SIGMA * sigma;
        match self {
            Self::Huber if squared > c * c => {
                let distance = squared.sqrt();
                (2.0 * c * distance - c * c, c / distance)
            }
            Self::Squared | Self::Huber => (squared, 1.0),
            Self::Cauchy => {
                let relative = squared / (c * c);
                (c * c * relative.ln_1p(), 1.0 / (1.0 + relative))
            }
        }
    }
    /// The pull w e of a corner at a squared distance.
    pub(crate) fn influence(self, squared: f64, sigma: f64) -> Influence {
        let (_, weight) = self.of(squared, sigma);
        let relative = squared / (SCALE_SIGMA * sigma).powi(2);
        // Half the divergence of the pull: w + e w′ / 2.
        let slope = match self {
            Self::Huber if relative > 1.0 => weight / 2.0,
            Self::Squared | Self::Huber => 1.0,
            Self::Cauchy => weight * weight,
        };
        Influence { weight, squared: weight * weight * squared, slope }
    }
}
