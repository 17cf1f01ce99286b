use deltille_core::camera::Pose;
use glam::DVec2;

/// A plane piece of a scene: white paper with black areas, in its own frame (mm, y up).
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Panel id.
    pub panel: u32,
    /// Pose of the surface: from its own frame to the target frame, mm.
    pub target_from_surface: Pose,
    /// Outline of the paper in the surface's frame, counter-clockwise, mm.
    pub paper_mm: Vec<DVec2>,
    /// Black areas in the surface's frame, mm: each a list of outlines, filled by the even-odd rule. Areas do not
    /// overlap.
    pub black_mm: Vec<Vec<Vec<DVec2>>>,
    /// Corners: id, lattice row, lattice column, and position in the surface's frame, mm.
    pub corners: Vec<(u32, i32, i32, DVec2)>,
}

impl Surface {
    /// Returns the pose of the surface in a camera with the given pose of the target.
    pub(super) fn camera_from(&self, camera_from_target: &Pose) -> Pose {
        camera_from_target.after(&self.target_from_surface)
    }
}
