//! Whether a target file says the same twice: its specification is enough to make its panels, and these stand beside it.
//!
//! What follows from nothing else in the file is left to the comparison with what was made: sheets, what is printed on them,
//! the finish, and of a solid the walls of its skeleton. A spacing of tags may be another one that has the same tags.

use super::error::{Problem, problem};
use super::identity::fingerprint;
use crate::family::shipped_name;
use crate::targets::boards::{aprilgrid, board, charuco, circles, tag_sheet};
use crate::targets::solids::solid;
use crate::targets::{
    Corner, FamilyRef, Fingerprint, Panel, PanelPose, TagPlacement, Target, TargetSpec,
};

/// How far an edge may be from that of the spec, mm: what written digits leave.
const SPEC_SLACK_MM: f64 = 1e-6;

/// How far a corner or a panel may be from its place in the plan, mm: what three written digits leave, and a twentieth of
/// what is noticed in print.
const PLACE_SLACK_MM: f64 = 1e-3;

/// How far the rotation of a panel may be from that in the plan: what six written digits leave.
const ROTATION_SLACK: f64 = 1e-6;

/// Compares the panels with those that the spec makes: a file in which one of them was changed
/// contradicts itself. Poses may differ once some were measured, and so may measured positions.
///
/// # Errors
/// The field at fault, and what is wrong with it.
pub(super) fn check(target: &Target) -> Result<(), Problem> {
    let Some((made, tagged)) = made(&target.spec)? else { return Ok(()) };
    check_families(target)?;
    // Those that were held where the plan has them have no covariance beside others that have.
    let is_refined = target.panels.iter().any(|panel| panel.pose.covariance.is_some());
    let differs = |field: String, found: &dyn std::fmt::Display, made: &dyn std::fmt::Display| {
        problem(field, format!("it is {found}, but that of `spec` has {made}"))
    };
    let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= SPEC_SLACK_MM,
        (a, b) => a == b,
    };
    if target.panels.len() != made.len() {
        return differs("panels.length".to_owned(), &target.panels.len(), &made.len());
    }
    if target.family.is_some() != tagged {
        return problem("family", "it must be there if, and only if, `spec.tags` is");
    }
    for (p, (panel, made)) in target.panels.iter().zip(&made).enumerate() {
        let field = |key: &str| format!("panels[{p}].{key}");
        if panel.id != made.id {
            return differs(field("id"), &panel.id, &made.id);
        }
        if (panel.edge_mm - made.edge_mm).abs() > SPEC_SLACK_MM {
            return differs(field("edge_mm"), &panel.edge_mm, &made.edge_mm);
        }
        let plain = [
            ("kind", panel.kind == made.kind),
            ("border_bits", panel.border_bits == made.border_bits),
            ("tags_in", panel.tags_in == made.tags_in),
            ("gap_edges", near(panel.gap_edges, made.gap_edges)),
            ("discs_mm", near(panel.discs_mm, made.discs_mm)),
            ("hole_mm", near(panel.hole_mm, made.hole_mm)),
            ("tag_margin_bits", near(panel.tag_margin_bits, made.tag_margin_bits)),
            ("inverted", panel.inverted == made.inverted),
            ("rim_mm", near(panel.rim_mm, made.rim_mm)),
            ("outline", panel.outline == made.outline),
            ("matrix", panel.matrix == made.matrix),
        ];
        if let Some((key, _)) = plain.iter().find(|(_, same)| !same) {
            return problem(field(key), "it is not that of `spec`");
        }
        if !is_refined && !is_same_place(&panel.pose, &made.pose) {
            let what = "it is not that of `spec`, and none was measured: there is no `covariance`";
            return problem(field("pose"), what);
        }
        if panel.corners.len() != made.corners.len() {
            let (found, made) = (panel.corners.len(), made.corners.len());
            return differs(field("corners.length"), &found, &made);
        }
        for (i, (corner, made)) in panel.corners.iter().zip(&made.corners).enumerate() {
            if (corner.id, corner.row, corner.col) != (made.id, made.row, made.col) {
                let place = |c: &Corner| format!("corner {} at row {} col {}", c.id, c.row, c.col);
                return differs(field(&format!("corners[{i}]")), &place(corner), &place(made));
            }
            if corner.panel_mm.distance(made.panel_mm) > PLACE_SLACK_MM {
                let field = field(&format!("corners[{i}].panel_mm"));
                return differs(field, &corner.panel_mm, &made.panel_mm);
            }
            let expected = if is_refined {
                panel.pose.target_from_panel(corner.panel_mm)
            } else {
                made.target_mm
            };
            if corner.target_mm.distance(expected) > PLACE_SLACK_MM {
                let field = field(&format!("corners[{i}].target_mm"));
                return differs(field, &corner.target_mm, &expected);
            }
        }
        if panel.tags.len() != made.tags.len() {
            return differs(field("tags.length"), &panel.tags.len(), &made.tags.len());
        }
        for (i, (tag, made)) in panel.tags.iter().zip(&made.tags).enumerate() {
            if tag != made {
                let place =
                    |t: &TagPlacement| format!("tag {} at row {} col {}", t.id, t.row, t.col);
                return differs(field(&format!("tags[{i}]")), &place(tag), &place(made));
            }
        }
    }
    Ok(())
}

/// Whether this may be the fingerprint of the print of which the target was measured or refined: that of its own panels
/// without what was measured, or that of its spec.
pub(super) fn may_be_of_print(target: &Target, plan: Fingerprint) -> Result<bool, Problem> {
    let mut panels = target.panels.clone();
    for corner in panels.iter_mut().flat_map(|panel| &mut panel.corners) {
        corner.measured = None;
    }
    let family = target.family.as_ref();
    let of_spec = made(&target.spec)?.map(|(panels, _)| fingerprint(&panels, family));
    let is_refined = target.panels.iter().any(|panel| panel.pose.covariance.is_some());
    Ok(fingerprint(&panels, family) == plan || of_spec.map_or(is_refined, |own| own == plan))
}

/// The panels that a spec makes, and whether they have tags; `None` where it lists what a file of another program has.
fn made(spec: &TargetSpec) -> Result<Option<(Vec<Panel>, bool)>, Problem> {
    let (made, tagged) = match spec {
        TargetSpec::Board(spec) => {
            (spec.check().map(|()| board::untied_panels(spec)), spec.tags.is_some())
        }
        TargetSpec::Solid(spec) => (solid::untied_panels(spec), spec.tags.is_some()),
        TargetSpec::Tags(spec) => (Ok(tag_sheet::panels(spec)), true),
        TargetSpec::Charuco(spec) => (charuco::untied_panels(spec), true),
        TargetSpec::AprilGrid(spec) => (aprilgrid::untied_panels(spec), true),
        TargetSpec::Circles(spec) => (circles::untied_panels(spec), false),
        TargetSpec::Listed(_) => return Ok(None),
    };
    let made = made.or_else(|error| problem("spec", error.to_string()))?;
    Ok(Some((made, tagged)))
}

/// Whether a panel is where it is in the plan.
fn is_same_place(found: &PanelPose, made: &PanelPose) -> bool {
    let turned = found.rotation.iter().zip(&made.rotation).map(|(a, b)| (a - b).abs());
    found.translation_mm.distance(made.translation_mm) <= PLACE_SLACK_MM
        && turned.fold(0.0, f64::max) <= ROTATION_SLACK
}

/// Compares the families with those that the spec names. It may name a file, which says nothing of the family in it.
fn check_families(target: &Target) -> Result<(), Problem> {
    let families = match &target.spec {
        TargetSpec::Board(spec) => spec.tags.as_ref().map(|tags| ("tags.family", &tags.family)),
        TargetSpec::Solid(spec) => spec.tags.as_ref().map(|tags| ("tags.family", &tags.family)),
        TargetSpec::Tags(spec) => Some(("family", &spec.family)),
        TargetSpec::Charuco(spec) => Some(("dictionary", &spec.dictionary)),
        TargetSpec::AprilGrid(spec) => Some(("family", &spec.family)),
        TargetSpec::Circles(_) | TargetSpec::Listed(_) => None,
    };
    let compare = |named: &str, field: &str, family: Option<&FamilyRef>| match (
        shipped_name(named),
        family,
    ) {
        (Some(named), Some(family)) if named != family.name => problem(
            format!("spec.{field}"),
            format!("it is `{named}`, but `family` is `{}`", family.name),
        ),
        _ => Ok(()),
    };
    let family = target.family.as_ref();
    families.map_or(Ok(()), |(field, named)| compare(named, field, family))?;
    let squares = family.and_then(|family| family.squares.as_deref());
    let named = target.spec.square_family();
    named.map_or(Ok(()), |named| compare(named, "square_tags.family", squares))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::family::Family;
    use crate::targets::{BoardSpec, SolidShape, SolidSpec};

    /// What is said of a file in which something of a target was changed.
    fn said<S: Into<TargetSpec>>(spec: S, change: impl Fn(&mut Target)) -> Option<String> {
        let spec = spec.into();
        let family = Family::shipped("delTag25h7").unwrap();
        let mut target = Target::build("board", &spec, Some(&family)).unwrap();
        change(&mut target);
        Target::from_json(&target.to_json()).err().map(|error| error.to_string())
    }

    #[test]
    fn a_file_that_contradicts_its_spec_is_refused() {
        let edit = |change: fn(&mut Target)| said(BoardSpec::deltille(4, 4, 20.0), change).unwrap();
        fn spec(target: &mut Target) -> &mut BoardSpec {
            let TargetSpec::Board(spec) = &mut target.spec else { panic!("a board") };
            spec
        }
        type Edit = fn(&mut Target);
        let cases: [(Edit, &str); 8] = [
            (
                |t| {
                    t.panels[0].corners.pop();
                },
                "panels[0].corners.length",
            ),
            (|t| spec(t).rows = 11, "panels[0].matrix"),
            (|t| spec(t).edge_mm = 21.0, "panels[0].edge_mm"),
            (|t| t.panels[0].tags[0].id += 100, "panels[0].tags[0]"),
            (|t| spec(t).cols = 0, "spec"),
            (|t| t.panels[0].corners[3].panel_mm.x += 0.002, "panels[0].corners[3].panel_mm"),
            (|t| t.panels[0].corners[3].target_mm.z += 0.002, "panels[0].corners[3].target_mm"),
            (|t| spec(t).tags.as_mut().unwrap().family = "d36h9".to_owned(), "spec.tags.family"),
        ];
        for (change, field) in cases {
            let said = edit(change);
            assert!(said.starts_with(&format!("field `{field}`")), "{said}");
        }
    }

    #[test]
    fn panels_are_where_the_spec_has_them_unless_some_were_measured() {
        let two = BoardSpec { two_sided_mm: Some(3.0), ..BoardSpec::deltille(4, 4, 20.0) };
        let thicker = |target: &mut Target| match &mut target.spec {
            TargetSpec::Board(spec) => spec.two_sided_mm = Some(3.002),
            _ => unreachable!(),
        };
        assert!(said(two, thicker).unwrap().starts_with("field `panels[1].pose`"));
        let moved = |covariance| {
            move |target: &mut Target| {
                let mut poses: Vec<PanelPose> =
                    target.panels.iter().map(|panel| panel.pose).collect();
                poses[2].translation_mm += DVec3::splat(0.3);
                poses[2].covariance = covariance;
                *target = target.with_poses(&poses);
            }
        };
        let solid = || SolidSpec::new(SolidShape::Tetrahedron);
        assert_eq!(
            said(
                solid(),
                moved(Some(std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(
                    i == j
                ))))))
            ),
            None
        );
        assert!(said(solid(), moved(None)).unwrap().starts_with("field `panels[2].pose`"));
    }

    #[test]
    fn written_digits_are_not_noticed() {
        let rounded = |target: &mut Target| {
            for corner in target.panels.iter_mut().flat_map(|panel| &mut panel.corners) {
                corner.panel_mm = (corner.panel_mm * 1e3).round() / 1e3;
                corner.target_mm = (corner.target_mm * 1e3).round() / 1e3;
            }
        };
        assert_eq!(said(SolidSpec::new(SolidShape::Octahedron), rounded), None);
    }
}
