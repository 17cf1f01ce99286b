//! The covariance of all unknowns together, with their names and units.

use crate::matrix::Matrix;

/// The covariance of everything that is estimated. Poses of frames and offsets of measured corners are included on request, see
/// [`Calibration::covariance_of_all`](crate::Calibration::covariance_of_all).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointCovariance {
    /// The n unknowns: for each camera its estimated parameters and (ω, τ) of its pose on the rig; then (ω, τ) of panels
    /// and targets, and the shape of the board; then, on request, (ω, τ) of the pose of each frame about the axes of the rig, and
    /// the offsets of corners in the frame of their panel. Fixed parameters are absent.
    pub unknowns: Vec<JointUnknown>,
    /// The number m of unknowns that all frames share; poses of frames and offsets of corners follow them.
    pub shared: usize,
    /// The covariance from the noise of the corners, n × n; each entry in the product of the units of its row and column.
    pub noise: Matrix,
    /// The covariance observed between frames, m × m for the first m unknowns; `None` with too few frames.
    pub observed: Option<Matrix>,
    /// Degrees of freedom of the observed variances.
    pub observed_freedom: Option<f64>,
}

impl JointCovariance {
    /// Largest number of unknowns with poses of frames and offsets of corners: 72 MB.
    pub const MOST_UNKNOWNS: usize = 3000;
}

/// An unknown of a [`JointCovariance`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct JointUnknown {
    /// Its name, such as `left.fx`, `left.rx` (ω) and `left.tx` (τ); `panel1.rx`, where panels of all targets are counted
    /// from 0; `target.<name>.rx`; `board.b1` … `b7`, `a1` and `a2` as in [`Shape`](crate::Shape);
    /// `frame.<name>.rx`; or `corner.<panel>.<row>.<column>.x`.
    pub name: String,
    /// `px`, `rad`, `mm`, or `1` if it is dimensionless.
    pub unit: &'static str,
}
