//! Reference to the family of a target's tags: its name, its fingerprint, and its codes if they are known.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use crate::family::Family;
use crate::lattice::GridKind;
use crate::setting::Setting::TargetSetFamily;

/// Names a family with its fingerprint, so that a changed code table is noticed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FamilyRef {
    /// The family's name, for example `delTag25h7`.
    pub name: String,
    /// The family's fingerprint, see [`crate::family::Family::fingerprint`]. It is empty if a file from another
    /// program names a family whose codes this crate does not have.
    pub fingerprint: String,
    /// The family of the square tags, if a target has faces of both tilings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub squares: Option<Box<FamilyRef>>,
}

impl FamilyRef {
    /// Returns the family of the tags in tiles of a kind; the target must have tags of this kind.
    pub fn of_tiling(&self, kind: GridKind) -> &Self {
        match (kind, &self.squares) {
            (GridKind::Checker, Some(squares)) => squares,
            _ => self,
        }
    }

    /// Creates the reference to a family.
    pub fn of(family: &Family) -> Self {
        let (name, fingerprint) = (family.name().to_owned(), family.fingerprint().to_owned());
        Self { name, fingerprint, squares: None }
    }
}

/// The codes of a target's tags, if they were given or looked up. The target identifies them by their fingerprint, so
/// targets compare equal with and without them.
#[derive(Clone, Debug, Default)]
pub(in crate::targets) struct Codes(OnceLock<Arc<Family>>);

impl Codes {
    pub(in crate::targets) fn of(family: Option<&Family>) -> Self {
        Self(family.map_or_else(OnceLock::new, |family| Arc::new(family.clone()).into()))
    }

    pub(in crate::targets) fn get(&self) -> Option<&Family> {
        self.0.get().map(Arc::as_ref)
    }

    /// Returns the known codes, or else `found`, which it stores.
    pub(in crate::targets) fn or(&self, found: Family) -> &Family {
        self.0.get_or_init(|| Arc::new(found))
    }
}

impl PartialEq for Codes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The codes of a target's tags are unknown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{target} has tags of {family}, which is not a shipped family: set the family with {TargetSetFamily}"
)]
pub struct UnknownCodes {
    /// Name of the target.
    pub target: String,
    /// Name of the family.
    pub family: String,
}

/// Why a family does not match a target's tags.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OtherFamily {
    /// The target has no tags.
    #[error("has no tags")]
    NoTags,
    /// The codes differ.
    #[error("was made with {name} of fingerprint {wanted}, but this one has fingerprint {found}")]
    Codes {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// Fingerprint of the given family.
        found: String,
    },
    /// The family has grown since, and the target has a tag that the family did not have before.
    #[error("has tag {id}, but {name} of fingerprint {wanted} has only {codes} codes")]
    Id {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// The tag.
        id: u32,
        /// Number of codes of that family.
        codes: usize,
    },
    /// The target has holes where the family has cells.
    #[error("has holes of {hole_mm} mm in its tags, but {problem}")]
    Hole {
        /// Diameter of the holes, mm.
        hole_mm: f64,
        /// Why they are not possible.
        problem: String,
    },
}
