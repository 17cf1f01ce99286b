//! The target file (`docs/formats.md`, “Target”): reading with checks of every field, and writing.

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

/// Schema and version that this crate reads and writes.
pub const SCHEMA: &str = "deltille/target/1";

/// Largest distance of a corner from its position in the lattice, in edges. Measured positions differ by far less; a
/// wrong unit or another corner's position differs by more.
const SLACK_EDGES: f64 = 0.01;

/// Largest distance of a measured corner from its planned position, in edges. Beyond it, the corner would be closer
/// to another one.
const MEASURED_SLACK_EDGES: f64 = 0.5;

/// Largest difference between a target position and the one from its panel's pose, in edges: the rounding of a
/// rotation written with six digits, on a panel of a thousand edges.
const POSE_SLACK_EDGES: f64 = 0.001;

/// Tolerance for the symmetry and positive semidefiniteness of a covariance's correlations: the effect of rounding.
const COVARIANCE_SLACK: f64 = 1e-6;

/// The problem with a target file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetFileError {
    /// The text is not JSON or is truncated.
    #[error("not a target file: {}; create it again with {TargetToJson}", in_words(.0))]
    Json(serde_json::Error),
    /// The file is of another kind.
    #[error(
        "this is a {found} file, not a target: pass the .json that was written with the target"
    )]
    Kind {
        /// The schema that the file names.
        found: String,
    },
    /// The schema or its version is not supported.
    #[error(
        "field `schema` is `{found}`, but this version reads `{SCHEMA}`: create the file again"
    )]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// A field is missing, unknown or invalid.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field, for example `panels[0].corners[3].row`.
        field: String,
        /// The problem.
        problem: String,
    },
}

impl Target {
    /// Parses the text of a target file.
    ///
    /// # Errors
    /// Returns an error if the text is not a target file, has another version, or a field is invalid. It does not
    /// check the sheets; see `Printing::from_json` of `deltille-layout`.
    pub fn from_json(text: &str) -> Result<Target, TargetFileError> {
        let (target, _) = read::<IgnoredAny, IgnoredAny, IgnoredAny>(text)?;
        Ok(target)
    }

    /// Writes the text of the target file, one corner per line.
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

/// Print information of a target file: sheets `S`, a finish `F` and a logo `L`.
#[doc(hidden)]
pub struct Printed<S, F, L> {
    /// Sheets in the order of printing.
    pub sheets: Vec<S>,
    /// Finish; `None` for a plain print.
    pub finish: Option<F>,
    /// Logo, if any.
    pub logo: Option<L>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetFile<S, F, L> {
    schema: String,
    name: Name,
    /// Missing in files of earlier versions.
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

/// Reads a target and the print information of its file.
///
/// # Errors
/// Returns an error if the text is not a target file, or describes an invalid target.
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

/// Writes the text of a target and its print information.
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

/// Checks the constraints that the types do not express.
///
/// # Errors
/// Returns the invalid field and its problem.
pub fn check(target: &Target) -> Result<(), Problem> {
    if target.panels.is_empty() {
        return problem("panels", "the list is empty");
    }
    // The family is looked up by name, so the name must not lead to a file.
    let named = |family: &FamilyRef| Name::new(&family.name).map(|_| ());
    let family = target.family.as_ref();
    family.map_or(Ok(()), named).or_else(|wrong| problem("family.name", wrong))?;
    let squares = family.and_then(|family| family.squares.as_deref());
    squares.map_or(Ok(()), named).or_else(|wrong| problem("family.squares.name", wrong))?;
    if squares.is_some_and(|family| family.squares.is_some()) {
        return problem(
            "family.squares.squares",
            "a family of squares cannot name another family of squares",
        );
    }
    if squares.is_some() != target.spec.square_family().is_some() {
        let what = "it must be present if, and only if, `spec.square_tags` is";
        return problem("family.squares", what);
    }
    let may_differ = squares.is_some();
    let (mut panels, mut corners, mut tags) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for (p, panel) in target.panels.iter().enumerate() {
        let field = format!("panels[{p}]");
        if panels.last().is_some_and(|&last| last >= panel.id) {
            return problem(format!("{field}.id"), "ids must increase from panel to panel");
        }
        panels.insert(panel.id);
        if panel.kind != target.panels[0].kind && !may_differ {
            return problem(format!("{field}.kind"), "all panels must be of one kind");
        }
        check_panel(panel, &field)?;
        for (i, corner) in panel.corners.iter().enumerate() {
            if !corners.insert(corner.id) {
                let what = format!("id {} is also used by another corner", corner.id);
                return problem(format!("{field}.corners[{i}].id"), what);
            }
        }
        for (i, tag) in panel.tags.iter().enumerate() {
            if !tags.insert((panel.kind == GridKind::Checker, tag.id)) {
                let what = format!("id {} is also used by another tag", tag.id);
                return problem(format!("{field}.tags[{i}].id"), what);
            }
        }
        if !panel.tags.is_empty() && target.family.is_none() {
            return problem("family", "the target has tags, so it needs a family");
        }
    }
    against_spec::check(target)
}

/// Checks that the corners and tags match the stated fingerprint, and that a plan has the same labels.
fn check_identity(target: &Target, stated: Option<Fingerprint>) -> Result<(), Problem> {
    let found = target.identity();
    if let Some(stated) = stated
        && stated != found.fingerprint
    {
        let what = format!(
            "it is {stated}, but the corners and tags have fingerprint {}: the file was edited; remove the field to turn it into \
             the description of another target",
            found.fingerprint
        );
        return problem("fingerprint", what);
    }
    match &target.plan {
        Some(plan) if plan.labels != found.labels => {
            problem("plan.labels", "the corners or tags differ from those of the planned target")
        }
        Some(plan) if !against_spec::may_be_of_print(target, plan.of_print())? => {
            let what = format!("it is {}, which does not match `spec`", plan.of_print());
            problem("plan.fingerprint", what)
        }
        _ => Ok(()),
    }
}

fn check_panel(panel: &Panel, field: &str) -> Result<(), Problem> {
    if panel.border_bits.is_none() && !panel.tags.is_empty() {
        return problem(format!("{field}.border_bits"), "the panel has tags, so it needs a border");
    }
    if panel.corners.is_empty() {
        return problem(format!("{field}.corners"), "the list is empty");
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
                "row {row}, column {col} is outside the matrix of {rows} rows and {cols} columns"
            );
            return problem(field("row"), what);
        }
        if corner.panel_mm.distance(panel.lattice_mm(vertex)) > slack {
            let what = "it is more than 1 % of an edge away from its position in the lattice";
            return problem(field("panel_mm"), what);
        }
        if let Some(place) = &corner.measured {
            if corner.offset_mm().length() > MEASURED_SLACK_EDGES * panel.edge_mm {
                let what = "it is more than half an edge, so another corner would be closer";
                return problem(field("measured.offset_mm"), what);
            }
            if !is_covariance(&place.covariance_mm2) {
                let what = "it is not a covariance: it has a negative variance";
                return problem(field("measured.covariance_mm2"), what);
            }
        }
        let expected = panel.pose.target_from_panel(corner.panel_mm);
        if corner.target_mm.distance(expected) > POSE_SLACK_EDGES * panel.edge_mm {
            let what =
                "it differs by more than 0.1 % of an edge from rotation · panel + translation";
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
        // Other programs also put tags into the outermost squares.
        let complete =
            panel.kind == GridKind::Checker || panel.tag_tile(tag).vertices().all(|v| corner(&v));
        if !complete {
            let what = "its tile is not enclosed by three corners";
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

/// Checks that the matrix is a valid covariance.
fn check_covariance(covariance: &[[f64; 6]; 6]) -> Result<(), String> {
    let c = nalgebra::Matrix6::from_fn(|i, j| covariance[i][j]);
    for i in 0..6 {
        let in_range = quantity::pose_variance::RANGE.check(c[(i, i)]);
        in_range.map_err(|what| format!("a variance, {what}"))?;
    }
    // Rotations and translations have different units.
    let correlations =
        nalgebra::Matrix6::from_fn(|i, j| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt());
    let uneven = (correlations - correlations.transpose()).amax();
    if uneven > COVARIANCE_SLACK {
        return Err("it is not symmetric".to_owned());
    }
    let least = correlations.symmetric_eigenvalues().min();
    if least < -COVARIANCE_SLACK {
        return Err("it is not a covariance: it has a negative variance".to_owned());
    }
    Ok(())
}

/// Returns whether the upper triangle xx, xy, xz, yy, yz, zz belongs to a valid covariance.
fn is_covariance(&[xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> bool {
    let matrix = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    matrix.symmetric_eigenvalues().min() >= -COVARIANCE_SLACK * matrix.amax()
}
