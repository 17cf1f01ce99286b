//! The family that a command is given, by name or as a file.

use std::path::Path;

use anyhow::bail;

use crate::output::log;
use deltille::family::{self, Family, PAIRS_COUNTED, certify_codes, shipped_names};
use deltille::lattice::GridKind;

/// Rejects families whose tags are not DelTags.
pub fn deltags(family: Family) -> anyhow::Result<Family> {
    if family.kind() != GridKind::Deltille {
        let name = family.name();
        bail!(
            "{name} has square tags, but deltag works with triangular ones; for square tags, use \
             `deltille checkerboard --tags {name}`"
        );
    }
    if family.is_position_family() {
        let name = family.name();
        bail!(
            "{name} contains position codes, which work only on whole boards: use `deltille board --dense`"
        );
    }
    Ok(family)
}

/// Resolves a family to use. Compares the codes of a file that did not ship with the program if this takes less than
/// a second, and warns if they contradict its claims.
pub fn resolve(name_or_path: &str) -> anyhow::Result<Family> {
    let family = deltags(family::resolve(name_or_path)?)?;
    if !shipped_names().contains(&name_or_path)
        && family.len() <= PAIRS_COUNTED
        && let Some(failure) = certify_codes(&family).failures.first()
    {
        let file = Path::new(name_or_path).display();
        log!("warning: {file} does not have the properties that it states: {failure}");
    }
    Ok(family)
}
