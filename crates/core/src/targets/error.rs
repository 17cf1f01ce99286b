/// Why a target cannot be made. Messages name the option of `deltille` to change; a template has
/// the same names without the dashes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// A family that is not shipped, and which are.
    #[error("{0}")]
    UnknownFamily(String),
    /// A value that is no use by itself.
    #[error("{option}: {problem}")]
    Invalid {
        /// The option.
        option: &'static str,
        /// What is wrong and what would do.
        problem: String,
    },
    /// Tags are asked for and no family was given, or another one.
    #[error("--family: the target carries tags of {wanted}, {given}")]
    Family {
        /// The family asked for.
        wanted: String,
        /// What was given instead.
        given: String,
    },
    /// More tags than codes.
    #[error(
        "--first-id: tags {first} to {last} are needed, but family {family} ends at {end}: {instead}"
    )]
    IdsRunOut {
        /// First id needed.
        first: u32,
        /// Last id needed.
        last: u64,
        /// Name of the family.
        family: String,
        /// Last id that the family has.
        end: u64,
        /// What would do: a lower first id, fewer tags, a larger family.
        instead: String,
    },
    /// Targets to be used together share ids.
    #[error("{option}: {what} {first} to {last} overlap those of `{other}`: start at {free}")]
    Overlap {
        /// The option to change.
        option: &'static str,
        /// Ids of what.
        what: &'static str,
        /// Lowest id.
        first: u32,
        /// Highest id.
        last: u32,
        /// The other target.
        other: String,
        /// Lowest id above those of the other target.
        free: u64,
    },
    /// The board is too large for the paper.
    #[error(
        "--paper: {rows} × {cols} corners with {edge} edges and what is printed around them do \
         not fit {paper}: take larger paper, fewer --rows or --cols, or {}",
        match fitting_edge_mm {
            Some(mm) => format!("an --edge of at most {mm} mm"),
            None => "a smaller --margin".to_owned(),
        }
    )]
    DoesNotFit {
        /// Rows of corners.
        rows: u32,
        /// Corners in each row.
        cols: u32,
        /// The edge, such as `20 mm`.
        edge: String,
        /// The paper, such as `A4`.
        paper: String,
        /// Largest edge in whole millimetres that fits.
        fitting_edge_mm: Option<u32>,
    },
}

impl TargetError {
    pub(super) fn invalid(option: &'static str, problem: impl Into<String>) -> Self {
        Self::Invalid { option, problem: problem.into() }
    }
}
