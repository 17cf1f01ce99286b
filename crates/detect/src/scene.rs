//! Several targets in one picture: whether they can be distinguished.

use std::collections::BTreeSet;

use deltille_core::family::places;
use deltille_core::lattice::GridKind;
use deltille_core::setting::Setting::{BoardBoardId, TagFirstId};
use deltille_core::targets::{Target, UnknownCodes};

/// Why targets cannot be looked for together. Messages say what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No target.
    #[error("there is no target to look for")]
    Empty,
    /// A target without corners of tiles.
    #[error(
        "{name} has circles, and detection finds corners of tiles: OpenCV's `findCirclesGrid` finds its circles"
    )]
    Circles {
        /// The target.
        name: String,
    },
    /// The codes of a target's tags are not known.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
    /// Targets of one name, by which results tell them apart.
    #[error("two targets are named {name}: give each its own name")]
    SameName {
        /// The name.
        name: String,
    },
    /// Targets that show the same tags.
    #[error(
        "{first} and {second} both show tag {id} of {family}: make one of them with other ids, by {}",
        if family == places::NAME { BoardBoardId } else { TagFirstId }
    )]
    SameTag {
        /// A target.
        first: String,
        /// Another one.
        second: String,
        /// Id of a tag that both have.
        id: u32,
        /// Name of its family.
        family: String,
    },
    /// Targets without tags and of one outline.
    #[error(
        "{first} and {second} have no tags and look alike: give one of them tags, or other rows and columns"
    )]
    SameOutline {
        /// A target.
        first: String,
        /// Another one.
        second: String,
    },
}

/// Refuses targets that detection does not find.
///
/// # Errors
/// Where one has circles instead of tiles.
pub(super) fn check_detectable(targets: &[&Target]) -> Result<(), SceneError> {
    let has_discs = |target: &&&Target| target.panels.iter().any(|panel| panel.discs_mm.is_some());
    match targets.iter().find(has_discs) {
        Some(target) => Err(SceneError::Circles { name: target.name.to_string() }),
        None => Ok(()),
    }
}

/// Refuses targets that cannot be told apart in a picture.
///
/// # Errors
/// Where there is none, or two have the same name, a tag in common, or no tags and the same outline.
pub fn check_distinct(targets: &[&Target]) -> Result<(), SceneError> {
    if targets.is_empty() {
        return Err(SceneError::Empty);
    }
    for (index, second) in targets.iter().enumerate() {
        for first in &targets[..index] {
            check_pair(first, second)?;
        }
    }
    Ok(())
}

fn check_pair(one: &Target, other: &Target) -> Result<(), SceneError> {
    let names = || (one.name.to_string(), other.name.to_string());
    if one.name == other.name {
        return Err(SceneError::SameName { name: one.name.to_string() });
    }
    for kind in one.tilings() {
        if let (Some((family, own)), Some((same, others))) =
            (one.tags_of_tiling(kind), other.tags_of_tiling(kind))
            && family.name == same.name
            && let Some(&id) = own.iter().filter(|id| others.contains(id)).min()
        {
            let (first, second) = names();
            return Err(SceneError::SameTag { first, second, id, family: family.name.clone() });
        }
    }
    if let Some((first, second)) =
        outlines(one).intersection(&outlines(other)).next().map(|_| names())
    {
        return Err(SceneError::SameOutline { first, second });
    }
    Ok(())
}

/// Tiling, rows and columns of the panels without tags.
fn outlines(target: &Target) -> BTreeSet<(GridKind, [u32; 2], bool)> {
    let untagged = target.panels.iter().filter(|panel| panel.tags.is_empty());
    untagged.map(|panel| (panel.kind, panel.matrix, panel.inverted)).collect()
}
