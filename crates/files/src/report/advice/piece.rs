//! A piece of advice and its importance.

/// Importance of a piece of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Weight {
    /// A check that passed.
    Good,
    /// Better results are possible.
    Hint,
    /// The figures are unreliable until this is corrected.
    Warning,
}

/// A piece of advice.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Advice {
    /// Its importance.
    pub weight: Weight,
    /// The observation and the remedy.
    pub text: String,
}
