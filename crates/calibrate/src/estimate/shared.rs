//! The covariance of all unknowns that the frames share, with their names and units.

use crate::matrix::Matrix;

/// The covariance of everything that is estimated except the poses of frames and the offsets of corners.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SharedCovariance {
    /// The n unknowns: for each camera its estimated parameters and (ω, τ) of its pose on the rig; then (ω, τ) of panels
    /// and targets, and the shape of the board. Fixed parameters are absent.
    pub unknowns: Vec<SharedUnknown>,
    /// The covariance from the noise of the corners, n × n; each entry in the product of the units of its row and column.
    pub noise: Matrix,
    /// The covariance observed between frames, n × n; `None` with too few frames.
    pub observed: Option<Matrix>,
    /// Degrees of freedom of the observed variances.
    pub observed_freedom: Option<f64>,
}

/// An unknown of a [`SharedCovariance`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SharedUnknown {
    /// Its name, such as `left.fx`, `left.rx` (ω) and `left.tx` (τ); `panel1.rx`, where panels of all targets are counted
    /// from 0; `target.<name>.rx`; or `board.b1` … `b7`, `a1` and `a2` as in [`Shape`](crate::Shape).
    pub name: String,
    /// `px`, `rad`, `mm`, or `1` if it is dimensionless.
    pub unit: &'static str,
}
