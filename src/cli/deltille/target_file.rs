//! Targets from files, and the families that they name.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};

use crate::cli::output;
use crate::detect::check_distinct;
use crate::export::dsc;
use crate::family::{self, Family};
use crate::limits::Limits;
use crate::targets::{Target, TargetSpec};

/// Reads a target: `.dsc` by its extension, JSON otherwise.
pub fn read(path: &Path, limits: &Limits) -> anyhow::Result<Target> {
    let show = || path.display().to_string();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if ["pdf", "svg", "png", "glb", "obj", "stl", "dxf", "mtl"].contains(&extension.as_str()) {
        bail!("{}: a .{extension} describes no target: give the .json written with it", show());
    }
    output::settle(output::folder_of(path))?;
    let text = limits.read_text(path)?;
    if extension == "dsc" {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        return dsc::read(&text, &stem).with_context(show);
    }
    Target::from_json(&text).with_context(show)
}

/// The targets of several files, which can be told apart.
pub fn read_all(paths: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<Target>> {
    let targets =
        paths.iter().map(|path| read(path, limits)).collect::<anyhow::Result<Vec<_>>>()?;
    check_distinct(&targets.iter().collect::<Vec<_>>())?;
    Ok(targets)
}

/// The family of each of several targets; a file that is given is that of those which name its family.
pub fn families(targets: &[Target], given: Option<&str>) -> anyhow::Result<Vec<Option<Family>>> {
    if let [only] = targets {
        return Ok(vec![family(only, given)?]);
    }
    let name = given.map(|given| family::resolve(given).context("--family")).transpose()?;
    let name = name.map(|family| family.name().to_owned());
    let names_it = |target: &Target| {
        target.family.as_ref().is_some_and(|family| Some(&family.name) == name.as_ref())
    };
    if let Some(name) = &name
        && !targets.iter().any(names_it)
    {
        bail!("--family: no target carries tags of {name}");
    }
    let own = |target: &Target| family(target, given.filter(|_| names_it(target)));
    targets.iter().map(own).collect()
}

/// The family of a target: the file given, else by the name in the target, else by the path in its
/// spec. Its codes must be those that the target was made with.
pub fn family(target: &Target, given: Option<&str>) -> anyhow::Result<Option<Family>> {
    let Some(wanted) = &target.family else {
        if given.is_some() {
            bail!("--family: {} has no tags", target.name);
        }
        return Ok(None);
    };
    let in_spec = match &target.spec {
        TargetSpec::Board(board) => board.tags.as_ref().map(|tags| tags.family.as_str()),
        TargetSpec::Solid(solid) => Some(solid.tags.family.as_str()),
        TargetSpec::Tags(tags) => Some(tags.family.as_str()),
        TargetSpec::Listed(_) => None,
    };
    let family = match given {
        Some(given) => family::resolve(given).context("--family")?,
        None => family::resolve(&wanted.name)
            .or_else(|error| in_spec.map_or(Err(error), family::resolve))
            .with_context(|| format!("{} carries tags of {}", target.name, wanted.name))
            .context("give the family's file with --family")?,
    };
    if !wanted.fingerprint.is_empty() && family.fingerprint() != wanted.fingerprint {
        return Err(anyhow!(
            "--family: {} was made with fingerprint {} of {}, this one is {}",
            target.name,
            wanted.fingerprint,
            wanted.name,
            family.fingerprint()
        ));
    }
    Ok(Some(family))
}
