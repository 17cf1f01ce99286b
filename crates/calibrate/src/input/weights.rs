//! Weights of corners.

/// The weights of corners in the adjustment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Weights {
    /// All corners have the same weight.
    Equal,
    /// Weights from the covariance of each corner plus a common variance. The covariance describes the noise of the
    /// image; the common variance, estimated from the residuals, describes errors of print, paper and lens, which are
    /// the same for all corners. Without covariances all corners have the same weight.
    #[default]
    Covariance,
}
