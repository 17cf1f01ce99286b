//! The family of a target's tags: its name and fingerprint, and its codes where they are known.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use crate::family::Family;
use crate::lattice::GridKind;
use crate::setting::Setting::TargetSetFamily;

/// Names a family so that a changed code table cannot go unnoticed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FamilyRef {
    /// The family's name, such as `delTag25h7`.
    pub name: String,
    /// Its fingerprint, see [`crate::family::Family::fingerprint`]; empty where a file from
    /// elsewhere names a family whose codes this crate does not have.
    pub fingerprint: String,
    /// The family of its squares, where a target has faces of both tilings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub squares: Option<Box<FamilyRef>>,
}

impl FamilyRef {
    /// The family of tags in tiles of a kind, of a target that has such.
    pub fn of_tiling(&self, kind: GridKind) -> &Self {
        match (kind, &self.squares) {
            (GridKind::Checker, Some(squares)) => squares,
            _ => self,
        }
    }

    /// The name and fingerprint of a family.
    pub fn of(family: &Family) -> Self {
        let (name, fingerprint) = (family.name().to_owned(), family.fingerprint().to_owned());
        Self { name, fingerprint, squares: None }
    }
}

/// The codes of a target's tags, where they were given or looked up. The target names them by their fingerprint, so targets
/// are equal with and without them.
#[derive(Clone, Debug, Default)]
pub(in crate::targets) struct Codes(OnceLock<Arc<Family>>);

impl Codes {
    pub(in crate::targets) fn of(family: Option<&Family>) -> Self {
        Self(family.map_or_else(OnceLock::new, |family| Arc::new(family.clone()).into()))
    }

    pub(in crate::targets) fn get(&self) -> Option<&Family> {
        self.0.get().map(Arc::as_ref)
    }

    /// The codes that are known, else those that `found` is.
    pub(in crate::targets) fn or(&self, found: Family) -> &Family {
        self.0.get_or_init(|| Arc::new(found))
    }
}

impl PartialEq for Codes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The codes of a target's tags are not known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{target} has tags of {family}, and no family with its codes is shipped: set the family with {TargetSetFamily}"
)]
pub struct UnknownCodes {
    /// Name of the target.
    pub target: String,
    /// Name of the family.
    pub family: String,
}

/// Why a family is not that of a target's tags.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OtherFamily {
    /// The target has no tags.
    #[error("has no tags")]
    NoTags,
    /// It has other codes.
    #[error("was made with fingerprint {wanted} of {name}, this one is {found}")]
    Codes {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// That of the family which is there.
        found: String,
    },
    /// The family has grown since, and the target has a tag that it did not have then.
    #[error("has a tag {id}, but {name} of fingerprint {wanted} had only {codes} codes")]
    Id {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// The tag.
        id: u32,
        /// How many codes the family had.
        codes: usize,
    },
    /// The target has holes where the family needs the cells.
    #[error("has holes of {hole_mm} mm in its tags, but {problem}")]
    Hole {
        /// Their diameter, mm.
        hole_mm: f64,
        /// Why they cannot be there.
        problem: String,
    },
}
