//! Consistency of a target file: its specification determines its panels, and the file also contains the panels.
//!
//! Other contents are checked against the target made from the specification: the sheets, the
//! content printed on them, the finish, and the
//! skeleton walls of a solid. The spacing of tags may differ if it gives the same tags.

use std::fmt::Display;

use super::error::{Problem, problem};
use super::identity::fingerprint;
use crate::family::shipped_name;
use crate::targets::boards::{aprilgrid, board, charuco, circles, tag_sheet};
use crate::targets::solids::solid;
use crate::targets::{
    Corner, FamilyRef, Fingerprint, Panel, PanelPose, TagPlacement, Target, TargetSpec,
};

/// Tolerance of an edge, mm: the rounding of numbers in files.
const SPEC_SLACK_MM: f64 = 1e-6;

/// Tolerance of the position of a corner or panel, mm: the rounding to three decimal places, and a
/// twentieth of the
/// smallest noticeable print error.
const PLACE_SLACK_MM: f64 = 1e-3;

/// Tolerance of the rotation of a panel: the rounding of numbers with six digits.
const ROTATION_SLACK: f64 = 1e-6;

/// Compares the panels with those of the spec: a file in which one of them was changed contradicts itself. Poses and
/// corner positions may differ if some were measured.
///
/// # Errors
/// Returns the invalid field and its problem.
pub(super) fn check(target: &Target) -> Result<(), Problem> {
    let Some((made, tagged)) = made(&target.spec)? else { return Ok(()) };
    check_families(target)?;
    // Panels that were fixed at their planned pose have no covariance, although refined ones have.
    let is_refined = target.panels.iter().any(|panel| panel.pose.covariance.is_some());
    if target.panels.len() != made.len() {
        return differs("panels.length".to_owned(), &target.panels.len(), &made.len());
    }
    if target.family.is_some() != tagged {
        return problem("family", "it must be present if, and only if, `spec.tags` is");
    }
    let mut panels = target.panels.iter().zip(&made).enumerate();
    panels.try_for_each(|(p, (panel, made))| {
        check_panel(&format!("panels[{p}]"), panel, made, is_refined)
    })
}

/// Returns the error of a field whose value the spec does not give.
fn differs(field: String, found: &dyn Display, made: &dyn Display) -> Result<(), Problem> {
    problem(field, format!("it is {found}, but `spec` gives {made}"))
}

/// Compares a panel, called `name`, with that of the spec.
fn check_panel(name: &str, panel: &Panel, made: &Panel, is_refined: bool) -> Result<(), Problem> {
    let field = |key: &str| format!("{name}.{key}");
    let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() <= SPEC_SLACK_MM,
        (a, b) => a == b,
    };
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
        return problem(field(key), "it does not match `spec`");
    }
    if !is_refined && !is_same_place(&panel.pose, &made.pose) {
        let what = "it does not match `spec`, and no pose was measured (there is no `covariance`)";
        return problem(field("pose"), what);
    }
    if panel.corners.len() != made.corners.len() {
        return differs(field("corners.length"), &panel.corners.len(), &made.corners.len());
    }
    for (i, (corner, made)) in panel.corners.iter().zip(&made.corners).enumerate() {
        let pose = is_refined.then_some(&panel.pose);
        check_corner(&field(&format!("corners[{i}]")), corner, made, pose)?;
    }
    if panel.tags.len() != made.tags.len() {
        return differs(field("tags.length"), &panel.tags.len(), &made.tags.len());
    }
    for (i, (tag, made)) in panel.tags.iter().zip(&made.tags).enumerate() {
        if tag != made {
            let place = |t: &TagPlacement| format!("tag {} at row {} col {}", t.id, t.row, t.col);
            return differs(field(&format!("tags[{i}]")), &place(tag), &place(made));
        }
    }
    Ok(())
}

/// Compares a corner, called `name`, with that of the spec; `refined` is the pose of its panel if poses were measured.
fn check_corner(
    name: &str,
    corner: &Corner,
    made: &Corner,
    refined: Option<&PanelPose>,
) -> Result<(), Problem> {
    if (corner.id, corner.row, corner.col) != (made.id, made.row, made.col) {
        let place = |c: &Corner| format!("corner {} at row {} col {}", c.id, c.row, c.col);
        return differs(name.to_owned(), &place(corner), &place(made));
    }
    if corner.panel_mm.distance(made.panel_mm) > PLACE_SLACK_MM {
        return differs(format!("{name}.panel_mm"), &corner.panel_mm, &made.panel_mm);
    }
    let expected = refined.map_or(made.target_mm, |pose| pose.target_from_panel(corner.panel_mm));
    if corner.target_mm.distance(expected) > PLACE_SLACK_MM {
        return differs(format!("{name}.target_mm"), &corner.target_mm, &expected);
    }
    Ok(())
}

/// Returns whether `plan` may be the fingerprint of the print that was measured or refined: that of the target's
/// panels without the measured values, or that of its spec.
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

/// Returns the panels of a spec, and whether they have tags; `None` if the spec is a list from
/// another program.
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

/// Returns whether a panel has its planned pose.
fn is_same_place(found: &PanelPose, made: &PanelPose) -> bool {
    let turned = found.rotation.iter().zip(&made.rotation).map(|(a, b)| (a - b).abs());
    found.translation_mm.distance(made.translation_mm) <= PLACE_SLACK_MM
        && turned.fold(0.0, f64::max) <= ROTATION_SLACK
}

/// Compares the families with those in the spec. If the spec names a file, the family in it is unknown.
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

    /// Returns the error of a target file after a change of the target.
    fn message<S: Into<TargetSpec>>(spec: S, change: impl Fn(&mut Target)) -> Option<String> {
        let spec = spec.into();
        let family = Family::shipped("delTag25h7").unwrap();
        let mut target = Target::build("board", &spec, Some(&family)).unwrap();
        change(&mut target);
        Target::from_json(&target.to_json()).err().map(|error| error.to_string())
    }

    #[test]
    fn files_contradicting_their_spec_are_rejected() {
        let edit =
            |change: fn(&mut Target)| message(BoardSpec::deltille(4, 4, 20.0), change).unwrap();
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
            let message = edit(change);
            assert!(message.starts_with(&format!("field `{field}`")), "{message}");
        }
    }

    #[test]
    fn unmeasured_panels_must_match_their_spec() {
        let two = BoardSpec { two_sided_mm: Some(3.0), ..BoardSpec::deltille(4, 4, 20.0) };
        let thicker = |target: &mut Target| match &mut target.spec {
            TargetSpec::Board(spec) => spec.two_sided_mm = Some(3.002),
            _ => unreachable!(),
        };
        assert!(message(two, thicker).unwrap().starts_with("field `panels[1].pose`"));
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
            message(
                solid(),
                moved(Some(std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(
                    i == j
                ))))))
            ),
            None
        );
        assert!(message(solid(), moved(None)).unwrap().starts_with("field `panels[2].pose`"));
    }

    #[test]
    fn rounding_of_written_digits_is_accepted() {
        let rounded = |target: &mut Target| {
            for corner in target.panels.iter_mut().flat_map(|panel| &mut panel.corners) {
                corner.panel_mm = (corner.panel_mm * 1e3).round() / 1e3;
                corner.target_mm = (corner.target_mm * 1e3).round() / 1e3;
            }
        };
        assert_eq!(message(SolidSpec::new(SolidShape::Octahedron), rounded), None);
    }
}
