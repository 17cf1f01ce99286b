use super::sheet::black_areas;
use super::{Scene, Surface};
use crate::artwork;
use crate::artwork::ArtworkError;
use deltille_core::polygon::rectangle;
use deltille_core::targets::{Panel, Target, TargetSpec};

/// Returns the scene of a target: the faces of a solid at their poses, or boards cut out along their quiet zone.
///
/// The boards of one target are loose sheets that all lie at its origin, so only a target with a
/// single board is
/// meaningful.
///
/// # Errors
/// Returns an error if the family of the tags is unknown or lacks a code.
pub fn scene_of_target(target: &Target) -> Result<Scene, ArtworkError> {
    let faces = match &target.spec {
        TargetSpec::Solid(spec) => spec.faces().ok(),
        TargetSpec::Board(_)
        | TargetSpec::Tags(_)
        | TargetSpec::Charuco(_)
        | TargetSpec::AprilGrid(_)
        | TargetSpec::Circles(_)
        | TargetSpec::Listed(_) => None,
    };
    let surface = |(index, panel): (usize, &Panel)| -> Result<Surface, ArtworkError> {
        let paper_mm = match faces.as_ref().and_then(|faces| faces.get(index)) {
            Some(face) => face.outline_mm.clone(),
            None => rectangle(panel.field_mm()).to_vec(),
        };
        let corners = panel.corners.iter().map(|c| (c.id, c.row, c.col, c.panel_mm));
        Ok(Surface {
            panel: panel.id,
            target_from_surface: panel.pose.to_pose(),
            paper_mm,
            black_mm: black_areas(&artwork::panel_shapes(target, panel)?),
            corners: corners.collect(),
        })
    };
    let surfaces = target.panels.iter().enumerate().map(surface);
    Ok(Scene { surfaces: surfaces.collect::<Result<_, _>>()? })
}
