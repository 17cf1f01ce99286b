//! Target files, with the families that they name.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};

use crate::output::{detail, log};
use deltille::detect::check_distinct;
use deltille::family;
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::target_file::{self, TargetFamilyError};
use deltille::targets::Target;
use deltille_core::words::counted;

/// Reads a target with its sheets: `.dsc` files by their extension, JSON otherwise.
pub fn read(path: &Path, limits: &Limits) -> anyhow::Result<Printing> {
    let path = &target_file::find(path)?;
    let printing = target_file::read(path, limits)?;
    let corners: usize = printing.target.panels.iter().map(|panel| panel.corners.len()).sum();
    let panels = counted(printing.target.panels.len(), "panel");
    detail!("read {}: {panels}, {}", path.display(), counted(corners, "corner"));
    Ok(printing)
}

/// Like [`read`], for commands that need poses; warns if a `.dsc` lacks the poses of its boards.
pub fn read_placed(path: &Path, limits: &Limits) -> anyhow::Result<Printing> {
    let target = read(path, limits)?;
    warn_if_poses_missing(path, &target.target);
    Ok(target)
}

/// Like [`read_placed`], for several files, see [`read_all`].
pub fn read_all_placed(paths: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<Printing>> {
    let targets = read_each(paths, limits)?;
    paths
        .iter()
        .zip(&targets)
        .for_each(|(path, target)| warn_if_poses_missing(path, &target.target));
    Ok(targets)
}

fn warn_if_poses_missing(path: &Path, target: &Target) {
    if let Some(missing) = target_file::without_poses(path, target) {
        log!("warning: {missing}");
    }
}

/// Reads the targets of several files, which must be distinguishable.
pub fn read_all(paths: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<Target>> {
    Ok(read_each(paths, limits)?.into_iter().map(|printing| printing.target).collect())
}

fn read_each(paths: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<Printing>> {
    let targets =
        paths.iter().map(|path| read(path, limits)).collect::<anyhow::Result<Vec<_>>>()?;
    check_distinct(&targets.iter().map(|printing| &printing.target).collect::<Vec<_>>())?;
    Ok(targets)
}

/// Sets the family of each target; a given file applies to the targets that name its family.
pub fn set_families<'a>(
    targets: impl IntoIterator<Item = &'a mut Target>,
    given: Option<&str>,
) -> anyhow::Result<()> {
    let mut targets: Vec<&mut Target> = targets.into_iter().collect();
    if let [only] = targets.as_mut_slice() {
        return set_family(only, given);
    }
    let name = given.map(|given| family::resolve(given).context("--family")).transpose()?;
    let name = name.map(|family| family.name().to_owned());
    let names_it = |target: &Target| {
        target.family.as_ref().is_some_and(|family| Some(&family.name) == name.as_ref())
    };
    if let Some(name) = &name
        && !targets.iter().any(|target| names_it(target))
    {
        bail!("--family: no target has tags of {name}");
    }
    targets.iter_mut().try_for_each(|target| {
        let given = given.filter(|_| names_it(target));
        set_family(target, given)
    })
}

/// Sets the family of targets if it is given: detections from files need no codes.
pub fn set_given_family(printed: &mut [Printing], given: Option<&str>) -> anyhow::Result<()> {
    let targets = printed.iter_mut().map(|one| &mut one.target);
    given.map_or(Ok(()), |given| set_families(targets, Some(given)))
}

/// Sets the family of a target, see [`target_file::set_family`].
pub fn set_family(target: &mut Target, given: Option<&str>) -> anyhow::Result<()> {
    target_file::set_family(target, given).map_err(|error| match error {
        TargetFamilyError::Named { .. } => {
            anyhow!(error).context("set the family file with --family")
        }
        _ => anyhow!(error).context("--family"),
    })
}
