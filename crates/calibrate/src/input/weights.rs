//! What is known beforehand of how precise corners are.

/// What is known of the corners' precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Weights {
    /// All corners alike.
    Equal,
    /// By their covariances, and a common deviation beside them: a covariance tells what the noise
    /// of the image does, not what the print, the paper and the lens do, which is the same for all.
    /// The common deviation is found from the residuals. Without covariances all corners are alike.
    #[default]
    Covariance,
}
