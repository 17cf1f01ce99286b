//! The target file (`docs/formats.md`, “Target”): reading with every field checked, and writing.

use std::collections::BTreeSet;

use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};

use super::against_spec;
use super::error::{Problem, problem};
use super::family_ref::Codes;
use crate::camera::is_rotation;
use crate::json::{self, ReadError};
use crate::lattice::{GridKind, Vertex};
use crate::quantity;
use crate::reading::in_words;
use crate::setting::Setting::TargetToJson;
use crate::targets::{FamilyRef, Fingerprint, Name, Panel, Target, TargetIdentity, TargetSpec};

/// Schema and version that this crate writes and reads.
pub const SCHEMA: &str = "deltille/target/1";

/// How far a corner may lie from its place in the lattice, in edges. Measured positions differ by far
/// less; another unit or another corner's position differs by more.
const SLACK_EDGES: f64 = 0.01;

/// How far the corner of a target that was made may lie from its place in the plan, in edges: farther off it
/// would be nearer to another one.
const MEASURED_SLACK_EDGES: f64 = 0.5;

/// How far its target position may be from that by its panel's pose, in edges: what six written digits of a
/// rotation leave on a panel of a thousand edges.
const POSE_SLACK_EDGES: f64 = 0.001;

/// How far the correlations of a covariance may be from symmetric, and from positive semidefinite: what
/// rounding leaves.
const COVARIANCE_SLACK: f64 = 1e-6;

/// What is wrong with a target file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetFileError {
    /// Not JSON, or cut off.
    #[error("not a target file: {}; make it anew with {TargetToJson}", in_words(.0))]
    Json(serde_json::Error),
    /// A file of something else.
    #[error(
        "this is a {found} file, not a target: give the .json that was written with the target"
    )]
    Kind {
        /// The schema that the file names.
        found: String,
    },
    /// Another schema, or another version of it.
    #[error("field `schema` is `{found}`, this version reads `{SCHEMA}`: make the file anew")]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// A field is missing, unknown, or holds what it must not.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field, such as `panels[0].corners[3].row`.
        field: String,
        /// What is wrong.
        problem: String,
    },
}

impl Target {
    /// Reads the text of a target file.
    ///
    /// # Errors
    /// Where it is no target file, of another version, or a field is wrong. The sheets are not looked at, see
    /// `Printing::from_json` of `deltille-layout`.
    pub fn from_json(text: &str) -> Result<Target, TargetFileError> {
        let (target, _) = read::<IgnoredAny, IgnoredAny, IgnoredAny>(text)?;
        Ok(target)
    }

    /// The text of the target file, a corner a line.
    ///
    /// ```
    /// use deltille_core::targets::{SolidShape, SolidSpec, Target};
    ///
    /// let solid = Target::new("ico", SolidSpec::new(SolidShape::Icosahedron))?;
    /// assert_eq!(Target::from_json(&solid.to_json())?, solid);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_json(&self) -> String {
        write(self, Printed::<(), (), ()> { sheets: Vec::new(), finish: None, logo: None })
    }
}

/// What a target file says of the print: sheets `S`, a finish `F` and a logo `L`.
#[doc(hidden)]
pub struct Printed<S, F, L> {
    /// Sheets in the order of printing.
    pub sheets: Vec<S>,
    /// `None` where it is plain.
    pub finish: Option<F>,
    /// `None` where there is none.
    pub logo: Option<L>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetFile<S, F, L> {
    schema: String,
    name: Name,
    /// Absent in files of earlier versions.
    fingerprint: Option<Fingerprint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plan: Option<TargetIdentity>,
    spec: TargetSpec,
    family: Option<FamilyRef>,
    panels: Vec<Panel>,
    sheets: Option<Vec<S>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    finish: Option<F>,
    #[serde(skip_serializing_if = "Option::is_none")]
    logo: Option<L>,
}

/// Reads a target, and what its file says of the print.
///
/// # Errors
/// Where the text is no target file, or describes an invalid target.
#[doc(hidden)]
pub fn read<S, F, L>(text: &str) -> Result<(Target, Printed<S, F, L>), TargetFileError>
where
    S: DeserializeOwned,
    F: DeserializeOwned,
    L: DeserializeOwned,
{
    let found = json::named_schema(text)?;
    if json::kind(&found) != json::kind(SCHEMA) {
        return Err(TargetFileError::Kind { found });
    }
    if found != SCHEMA {
        return Err(TargetFileError::Schema { found });
    }
    let file: TargetFile<S, F, L> = json::read(text)?;
    let TargetFile { name, fingerprint, plan, spec, family, panels, sheets, finish, logo, .. } =
        file;
    let target = Target { name, spec, family, panels, plan, codes: Codes::default() };
    check(&target).and_then(|()| check_identity(&target, fingerprint))?;
    Ok((target, Printed { sheets: sheets.unwrap_or_default(), finish, logo }))
}

/// The text of a target and its print.
#[doc(hidden)]
pub fn write<S: Serialize, F: Serialize, L: Serialize>(
    target: &Target,
    printed: Printed<S, F, L>,
) -> String {
    let fingerprint = Some(target.identity().fingerprint);
    let Target { name, spec, family, panels, plan, .. } = target.clone();
    let Printed { sheets, finish, logo } = printed;
    let (schema, sheets) = (SCHEMA.to_owned(), Some(sheets));
    let file =
        TargetFile { schema, name, fingerprint, plan, spec, family, panels, sheets, finish, logo };
    json::to_text(&file, 4)
}

impl From<Problem> for TargetFileError {
    fn from((field, problem): Problem) -> Self {
        Self::Field { field, problem }
    }
}

impl From<ReadError> for TargetFileError {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Json(error) => Self::Json(error),
            ReadError::Field { field, problem } => Self::Field { field, problem },
        }
    }
}

/// Checks what the types do not say; returns the field at fault and what is wrong with it.
///
/// # Errors
/// The field at fault, and what is wrong with it.
pub fn check(target: &Target) -> Result<(), Problem> {
    if target.panels.is_empty() {
        return problem("panels", "there is none");
    }
    // A family is looked for by its name, which must not lead to a file.
    let named = |family: &FamilyRef| Name::new(&family.name).map(|_| ());
    let family = target.family.as_ref();
    family.map_or(Ok(()), named).or_else(|wrong| problem("family.name", wrong))?;
    let squares = family.and_then(|family| family.squares.as_deref());
    squares.map_or(Ok(()), named).or_else(|wrong| problem("family.squares.name", wrong))?;
    if squares.is_some_and(|family| family.squares.is_some()) {
        return problem("family.squares.squares", "a family of squares has none");
    }
    if squares.is_some() != target.spec.square_family().is_some() {
        let what = "it must be there if, and only if, `spec.square_tags` is";
        return problem("family.squares", what);
    }
    let may_differ = squares.is_some();
    let (mut panels, mut corners, mut tags) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for (p, panel) in target.panels.iter().enumerate() {
        let field = format!("panels[{p}]");
        if panels.last().is_some_and(|&last| last >= panel.id) {
            return problem(format!("{field}.id"), "ids must ascend from panel to panel");
        }
        panels.insert(panel.id);
        if panel.kind != target.panels[0].kind && !may_differ {
            return problem(format!("{field}.kind"), "all panels must be of one kind");
        }
        check_panel(panel, &field)?;
        for (i, corner) in panel.corners.iter().enumerate() {
            if !corners.insert(corner.id) {
                let what = format!("{} is the id of another corner too", corner.id);
                return problem(format!("{field}.corners[{i}].id"), what);
            }
        }
        for (i, tag) in panel.tags.iter().enumerate() {
            if !tags.insert((panel.kind == GridKind::Checker, tag.id)) {
                let what = format!("{} is the id of another tag too", tag.id);
                return problem(format!("{field}.tags[{i}].id"), what);
            }
        }
        if !panel.tags.is_empty() && target.family.is_none() {
            return problem("family", "there are tags, so there must be a family");
        }
    }
    against_spec::check(target)
}

/// Checks that the corners and tags are those of the stated fingerprint, and that a plan has the same labels.
fn check_identity(target: &Target, stated: Option<Fingerprint>) -> Result<(), Problem> {
    let found = target.identity();
    if let Some(stated) = stated
        && stated != found.fingerprint
    {
        let what = format!(
            "it is {stated}, but the corners and tags have {}: the file was edited; remove the field to make it the \
             description of another target",
            found.fingerprint
        );
        return problem("fingerprint", what);
    }
    match &target.plan {
        Some(plan) if plan.labels != found.labels => {
            problem("plan.labels", "the corners or tags are not those of the plan")
        }
        Some(plan) if !against_spec::may_be_of_print(target, plan.of_print())? => {
            let what = format!("it is {}, which is not that of `spec`", plan.of_print());
            problem("plan.fingerprint", what)
        }
        _ => Ok(()),
    }
}

fn check_panel(panel: &Panel, field: &str) -> Result<(), Problem> {
    if panel.border_bits.is_none() && !panel.tags.is_empty() {
        return problem(format!("{field}.border_bits"), "there are tags, so there must be one");
    }
    if panel.corners.is_empty() {
        return problem(format!("{field}.corners"), "there is none");
    }
    check_rotation(&panel.pose.rotation, field)?;
    if let Some(covariance) = &panel.pose.covariance {
        check_covariance(covariance)
            .or_else(|what| problem(format!("{field}.pose.covariance"), what))?;
    }
    let slack = SLACK_EDGES * panel.edge_mm;
    let mut previous = None;
    for (i, corner) in panel.corners.iter().enumerate() {
        let field = |key: &str| format!("{field}.corners[{i}].{key}");
        let vertex = Vertex::new(corner.row, corner.col);
        if previous.is_some_and(|previous| previous >= vertex) {
            return problem(field("row"), "corners must be ordered by row, then column");
        }
        previous = Some(vertex);
        let [cols, rows] = panel.matrix.map(i64::from);
        let inside = |index: i32, size: i64| (0..size).contains(&i64::from(index));
        if !inside(corner.row, rows) || !inside(corner.col, cols) {
            let Vertex { row, col } = vertex;
            let what = format!(
                "row {row}, column {col} is outside the matrix of {rows} rows, {cols} columns"
            );
            return problem(field("row"), what);
        }
        if corner.panel_mm.distance(panel.lattice_mm(vertex)) > slack {
            let what = "it is more than 1 % of an edge away from its place in the lattice";
            return problem(field("panel_mm"), what);
        }
        if let Some(place) = &corner.measured {
            if corner.offset_mm().length() > MEASURED_SLACK_EDGES * panel.edge_mm {
                let what = "it is more than half an edge, so that another corner were nearer";
                return problem(field("measured.offset_mm"), what);
            }
            if !is_covariance(&place.covariance_mm2) {
                let what = "it is no covariance: some variance in it is negative";
                return problem(field("measured.covariance_mm2"), what);
            }
        }
        let expected = panel.pose.target_from_panel(corner.panel_mm);
        if corner.target_mm.distance(expected) > POSE_SLACK_EDGES * panel.edge_mm {
            let what = "it is more than 0.1 % of an edge away from rotation · panel + translation";
            return problem(field("target_mm"), what);
        }
    }
    let mut previous = None;
    for (i, tag) in panel.tags.iter().enumerate() {
        let vertex = Vertex::new(tag.row, tag.col);
        if previous.is_some_and(|previous| previous >= vertex) {
            let what = "tags must be ordered by row, then column";
            return problem(format!("{field}.tags[{i}].row"), what);
        }
        previous = Some(vertex);
        let corner = |v: &Vertex| panel.corner_at(*v).is_some();
        // Other programs put tags into the outermost squares as well.
        let complete =
            panel.kind == GridKind::Checker || panel.tag_tile(tag).vertices().all(|v| corner(&v));
        if !complete {
            let what = "its tile does not lie between three corners";
            return problem(format!("{field}.tags[{i}].row"), what);
        }
    }
    Ok(())
}

fn check_rotation(rotation: &[f64; 9], field: &str) -> Result<(), Problem> {
    if !is_rotation(rotation) {
        return problem(format!("{field}.pose.rotation"), "it is not a rotation");
    }
    Ok(())
}

/// Checks that it is the covariance of something.
fn check_covariance(covariance: &[[f64; 6]; 6]) -> Result<(), String> {
    let c = nalgebra::Matrix6::from_fn(|i, j| covariance[i][j]);
    for i in 0..6 {
        let in_range = quantity::pose_variance::RANGE.check(c[(i, i)]);
        in_range.map_err(|what| format!("a variance, {what}"))?;
    }
    // Turns and moves have different units.
    let correlations =
        nalgebra::Matrix6::from_fn(|i, j| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt());
    let uneven = (correlations - correlations.transpose()).amax();
    if uneven > COVARIANCE_SLACK {
        return Err("it is not symmetric".to_owned());
    }
    let least = correlations.symmetric_eigenvalues().min();
    if least < -COVARIANCE_SLACK {
        return Err("it is no covariance: some variance in it is negative".to_owned());
    }
    Ok(())
}

/// Whether the upper triangle xx, xy, xz, yy, yz, zz is that of a covariance.
fn is_covariance(&[xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> bool {
    let matrix = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    matrix.symmetric_eigenvalues().min() >= -COVARIANCE_SLACK * matrix.amax()
}
