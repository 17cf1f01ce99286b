//! The family that a command is given, by name or as a file.

use std::path::Path;

use anyhow::bail;

use crate::output::tell;
use deltille::family::{self, Family, PAIRS_COUNTED, certify_codes, shipped_names};
use deltille::lattice::GridKind;

/// Refuses families of other tags than DelTags.
pub fn deltags(family: Family) -> anyhow::Result<Family> {
    if family.kind() != GridKind::Deltille {
        let name = family.name();
        bail!(
            "{name}: its tags are square, deltag is about triangular ones; squares carry them: \
             `deltille checkerboard --tags {name}`"
        );
    }
    if family.is_of_places() {
        let name = family.name();
        bail!("{name}: its tags tell a place together only, on boards: `deltille board --dense`");
    }
    Ok(family)
}

/// A family to make something of. The codes of a file that comes from elsewhere are compared where
/// that is a matter of a second, and a word is said where they are not what the file claims.
pub fn resolve(name_or_path: &str) -> anyhow::Result<Family> {
    let family = deltags(family::resolve(name_or_path)?)?;
    if !shipped_names().contains(&name_or_path)
        && family.len() <= PAIRS_COUNTED
        && let Some(failure) = certify_codes(&family).failures.first()
    {
        let file = Path::new(name_or_path).display();
        tell!("warning: {file} is not what it claims: {failure}");
    }
    Ok(family)
}
