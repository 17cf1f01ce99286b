//! Checks whether several targets in one image can be distinguished.

use std::collections::BTreeSet;

use deltille_core::family::positions;
use deltille_core::lattice::GridKind;
use deltille_core::setting::Setting::{BoardBoardId, TagFirstId};
use deltille_core::targets::{Target, UnknownCodes};

/// Reason why a set of targets cannot be detected together. Messages say how to fix it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No target was given.
    #[error("no target given: pass at least one target")]
    Empty,
    /// A target has circles instead of tile corners.
    #[error(
        "{name} is a circle grid, and deltille detects only corners of tiles: use OpenCV's `findCirclesGrid`"
    )]
    Circles {
        /// Name of the target.
        name: String,
    },
    /// The codes of a target's tags are unknown.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
    /// Two targets have the same name. Results identify targets by name.
    #[error("two targets have the name {name}: give each target a unique name")]
    SameName {
        /// The shared name.
        name: String,
    },
    /// Two targets contain the same tag.
    #[error(
        "{first} and {second} share tag {id} of {family}: change the ids of one target with {}",
        if family == positions::NAME { BoardBoardId } else { TagFirstId }
    )]
    SameTag {
        /// Name of the first target.
        first: String,
        /// Name of the second target.
        second: String,
        /// Id of the shared tag.
        id: u32,
        /// Name of the tag's family.
        family: String,
    },
    /// Two targets have no tags and the same outline.
    #[error(
        "{first} and {second} have no tags and the same outline: add tags to one, or change its rows or columns"
    )]
    SameOutline {
        /// Name of the first target.
        first: String,
        /// Name of the second target.
        second: String,
    },
}

/// Checks that all targets have tile corners.
///
/// # Errors
/// Returns an error if a target has circles instead of tiles.
pub(super) fn check_detectable(targets: &[&Target]) -> Result<(), SceneError> {
    let has_discs = |target: &&&Target| target.panels.iter().any(|panel| panel.discs_mm.is_some());
    match targets.iter().find(has_discs) {
        Some(target) => Err(SceneError::Circles { name: target.name.to_string() }),
        None => Ok(()),
    }
}

/// Checks that the targets can be distinguished in an image.
///
/// # Errors
/// Returns an error if `targets` is empty, or if two targets have the same name, share a tag, or have no tags and the
/// same outline.
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

/// Returns tiling, rows and columns of the panels without tags.
fn outlines(target: &Target) -> BTreeSet<(GridKind, [u32; 2], bool)> {
    let untagged = target.panels.iter().filter(|panel| panel.tags.is_empty());
    untagged.map(|panel| (panel.kind, panel.matrix, panel.inverted)).collect()
}
