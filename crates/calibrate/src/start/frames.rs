//! The start of a bundle adjustment: values near those that are sought, by frame.

use super::symmetry::LabelRotation;
use crate::excluded::Excluded;
use crate::problem::bundle::Problem;

/// A problem whose values are near those that are sought.
pub(crate) struct Start {
    pub problem: Problem,
    /// Its frames.
    pub frames: Vec<Frame>,
    /// What takes no part, with its place among the frames as they were given.
    pub excluded: Vec<(usize, Excluded)>,
    /// By how many frames each camera is late.
    pub delays: Vec<i32>,
    /// How the labels of each camera were rotated, where a symmetry of the board leaves that open.
    pub rotations: Vec<Option<LabelRotation>>,
}

/// A moment at which pictures were taken.
pub(crate) struct Frame {
    pub name: String,
    /// Its place among the frames as they were given.
    pub place: usize,
    /// The camera and the index of each of its views.
    pub views: Vec<(usize, usize)>,
}
