//! Connections between the faces of a solid on its sheets, for unfolding it in space.

use glam::DVec3;
use serde::Serialize;

use super::unfold::{Side, Sides};
use crate::Printing;
use deltille_core::angles::angle;
use deltille_core::targets::{SolidSpec, TargetSpec};

/// Maximum distance between sides that coincide on a sheet, mm.
const TOUCHING_MM: f64 = 0.01;

/// A face of a solid, and the face to which it is attached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Hinge {
    /// Index of the face.
    pub face: usize,
    /// Index of the face to which it is attached; `None` for the first face of a sheet.
    pub on: Option<usize>,
    /// Ends of the shared edge in the target frame, mm.
    pub ends_mm: [DVec3; 2],
    /// Rotation about the line from the first end to the second that moves the face into the plane of the other,
    /// radians.
    pub angle_rad: f64,
}

impl Printing {
    /// Returns how the faces of a solid are connected on its sheets. Each face follows the one to which it is attached.
    /// The list is empty if the sheets are not nets.
    ///
    /// ```
    /// use deltille_layout::Printing;
    /// use deltille_core::targets::{SolidShape, SolidSpec};
    ///
    /// let die = Printing::new("die", SolidSpec::new(SolidShape::Icosahedron))?;
    /// let hinges = die.hinges();
    /// assert_eq!(hinges.iter().filter(|hinge| hinge.on.is_none()).count(), 1);
    /// assert_eq!(hinges.len(), 20);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn hinges(&self) -> Vec<Hinge> {
        let TargetSpec::Solid(spec) = &self.target.spec else { return Vec::new() };
        if self.sheets.iter().all(|sheet| sheet.placements.len() < 2) {
            return Vec::new();
        }
        of_sheets(self, spec).unwrap_or_default()
    }
}

/// Returns the hinges of the sheets of a solid; `None` if its faces have no boards.
fn of_sheets(printing: &Printing, spec: &SolidSpec) -> Option<Vec<Hinge>> {
    let (solid, faces) = (spec.polyhedron(), spec.faces().ok()?);
    let sides = Sides::new(&solid);
    let mut hinges = Vec::with_capacity(faces.len());
    for sheet in &printing.sheets {
        // Corners of each face on the sheet.
        let mut on_sheet = vec![None; faces.len()];
        for placement in &sheet.placements {
            let face =
                printing.target.panels.iter().position(|panel| panel.id == placement.panel)?;
            let outline = faces.get(face)?.outline_mm.iter();
            let corners: Vec<_> =
                outline.map(|&corner| placement.page_from_panel(corner)).collect();
            on_sheet[face] = Some(corners);
        }
        let are_joined = |side: Side, other: Side| {
            let ends = |side: Side| {
                let corners = on_sheet[side.face].as_ref()?;
                Some([corners[side.side], corners[(side.side + 1) % corners.len()]])
            };
            let (Some([from, to]), Some([first, second])) = (ends(side), ends(other)) else {
                return false;
            };
            from.distance(second).max(to.distance(first)) < TOUCHING_MM
        };
        let first = (0..faces.len()).find(|&face| on_sheet[face].is_some())?;
        let mut is_hung = vec![false; faces.len()];
        is_hung[first] = true;
        let begin = hinges.len();
        hinges.push(Hinge { face: first, on: None, ends_mm: [DVec3::ZERO; 2], angle_rad: 0.0 });
        let mut next = begin;
        while let Some(&Hinge { face: on, .. }) = hinges.get(next) {
            next += 1;
            for side in sides.of(on) {
                let Some(own) = sides.partner(side) else { continue };
                if is_hung[own.face] || !are_joined(side, own) {
                    continue;
                }
                is_hung[own.face] = true;
                let corners = solid.corners_mm(on);
                let ends_mm = [corners[side.side], corners[(side.side + 1) % corners.len()]];
                let axis = (ends_mm[1] - ends_mm[0]).normalize_or_zero();
                let (from, to) = (solid.normal(own.face), solid.normal(on));
                let angle_rad = angle(axis.dot(from.cross(to)), from.dot(to));
                hinges.push(Hinge { face: own.face, on: Some(on), ends_mm, angle_rad });
            }
        }
    }
    Some(hinges)
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DQuat};

    use super::*;
    use deltille_core::targets::SolidShape;

    /// Rotated about their hinges, all faces lie in one plane, as on the sheet.
    #[test]
    fn unfolded_faces_lie_as_on_the_sheet() {
        use SolidShape::{Cube, Icosahedron, Octahedron, Tetrahedron};
        for shape in [Tetrahedron, Octahedron, Icosahedron, Cube] {
            let spec = SolidSpec::new(shape);
            let target = Printing::new("solid", spec.clone()).unwrap();
            let (solid, faces) = (spec.polyhedron(), spec.faces().unwrap());
            let hinges = target.hinges();
            assert_eq!(hinges.len(), faces.len());
            let mut moved = vec![DAffine3::IDENTITY; faces.len()];
            for hinge in &hinges {
                let Some(on) = hinge.on else { continue };
                let [from, to] = hinge.ends_mm;
                let turn = DQuat::from_axis_angle((to - from).normalize(), hinge.angle_rad);
                let about = DAffine3::from_translation(from)
                    * DAffine3::from_quat(turn)
                    * DAffine3::from_translation(-from);
                moved[hinge.face] = moved[on] * about;
            }
            let in_space = |face: usize| {
                solid
                    .corners_mm(face)
                    .into_iter()
                    .map(|v| moved[face].transform_point3(v))
                    .collect::<Vec<_>>()
            };
            let sheet = &target.sheets[0];
            let on_paper: Vec<_> = (0..faces.len())
                .flat_map(|face| {
                    let id = target.target.panels[face].id;
                    let placement = sheet.placements.iter().find(|p| p.panel == id).unwrap();
                    let outline = faces[face].outline_mm.iter();
                    outline.map(|&corner| placement.page_from_panel(corner)).collect::<Vec<_>>()
                })
                .collect();
            let flat: Vec<_> = (0..faces.len()).flat_map(in_space).collect();
            for (i, j) in (0..flat.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let (paper, space) = (on_paper[i].distance(on_paper[j]), flat[i].distance(flat[j]));
                assert!((paper - space).abs() < 1e-6, "{paper} and {space}");
            }
        }
    }

    #[test]
    fn targets_without_a_net_have_no_hinges() {
        let board = deltille_core::targets::BoardSpec::deltille(10, 11, 20.0);
        assert!(Printing::new("board", board).unwrap().hinges().is_empty());
    }
}
