//! Robust losses for residuals.

/// Largest residual that counts in full, in standard deviations. It is exceeded by 1.1 % of
/// normally distributed corners, so data without outliers lose little information.
const SCALE_SIGMA: f64 = 3.0;

/// The loss of a corner as a function of its distance e from its prediction, in standard deviations.
///
/// ```text
///     squared  e²          Huber  e² up to c, then 2ce − c²          Cauchy  c² ln(1 + e²/c²)
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Loss {
    /// Least squares without a robust loss: every corner counts in full.
    Squared,
    /// The influence of a residual stays constant beyond 3σ.
    #[default]
    Huber,
    /// The influence of a residual is largest at 3σ and decreases beyond it.
    Cauchy,
}

/// The influence of a corner on an estimate, for the covariance of the estimate.
pub(crate) struct Influence {
    /// Its weight in the normal equations.
    pub weight: f64,
    /// The square of its influence.
    pub squared: f64,
    /// The derivative of the influence with respect to a coordinate, the mean of both axes.
    pub slope: f64,
}

impl Loss {
    /// The loss of a squared distance and its weight in the normal equations, for a standard deviation `sigma`.
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
    /// The influence w e of a corner at a squared distance.
    pub(crate) fn influence(self, squared: f64, sigma: f64) -> Influence {
        let (_, weight) = self.of(squared, sigma);
        let relative = squared / (SCALE_SIGMA * sigma).powi(2);
        // Half the divergence of the influence: w + w′ e / 2.
        let slope = match self {
            Self::Huber if relative > 1.0 => weight / 2.0,
            Self::Squared | Self::Huber => 1.0,
            Self::Cauchy => weight * weight,
        };
        Influence { weight, squared: weight * weight * squared, slope }
    }
}
