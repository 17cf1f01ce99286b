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

impl Loss {
    /// What a squared distance costs, and the weight of its normal equations, where a standard
    /// deviation is `sigma`.
    pub(super) fn of(self, squared: f64, sigma: f64) -> (f64, f64) {
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
}
