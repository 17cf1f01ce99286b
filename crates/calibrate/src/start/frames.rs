//! The start of a bundle adjustment: initial values, by frame.

use super::symmetry::LabelRotation;
use crate::excluded::Excluded;
use crate::problem::bundle::Problem;

/// A problem with values near the solution.
pub(crate) struct Start {
    pub problem: Problem,
    /// Its frames.
    pub frames: Vec<Frame>,
    /// Exclusions, each with its index among the given frames.
    pub excluded: Vec<(usize, Excluded)>,
    /// Lag of each camera in frames.
    pub delays: Vec<i32>,
    /// The rotation of each camera's labels, if a symmetry of the board makes the labels ambiguous.
    pub rotations: Vec<Option<LabelRotation>>,
}

/// A time at which images were taken.
pub(crate) struct Frame {
    pub name: String,
    /// Its index among the given frames.
    pub place: usize,
    /// The camera and the index of each of its views.
    pub views: Vec<(usize, usize)>,
}
