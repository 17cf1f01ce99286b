//! Targets from files, with their families.

use std::path::{Path, PathBuf};

use deltille_core::family::{Family, PAIRS_COUNTED, certify_codes};
use deltille_core::lattice::GridKind;
use deltille_core::targets::{
    FamilyRef, OtherFamily, SCHEMA, Target, TargetFileError, TargetIdentity,
};
use deltille_layout::Printing;

use crate::export::dsc::{self, DscError};
use crate::export::kind::Kind;
use crate::export::staging;
use crate::export::tp::{self, TpError};
use crate::family_file::{self, FamilyFileError};
use crate::limits::{Limits, ReadError};

/// Extensions of files that are generated from a target and do not describe it.
const MADE: [&str; 10] = ["pdf", "svg", "png", "glb", "obj", "stl", "dxf", "mtl", "yaml", "yml"];

/// Error of reading a target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetReadError {
    /// A file that was generated from a target.
    #[error("{}: a .{extension} file does not describe a target: use the .json that the command for the target, such as `deltille board`, wrote", path.display())]
    Made {
        /// The file.
        path: PathBuf,
        /// Its extension.
        extension: String,
    },
    /// A folder without a target.
    #[error("{}: no description of a target in this folder: use the .json written with the target", path.display())]
    NoneIn {
        /// The folder.
        path: PathBuf,
    },
    /// A folder with several targets.
    #[error("{}: several descriptions of targets in this folder ({}): use one of them", path.display(), names.join(", "))]
    SeveralIn {
        /// The folder.
        path: PathBuf,
        /// The names of the files.
        names: Vec<String>,
    },
    /// The leftovers of an interrupted run cannot be cleaned up.
    #[error(transparent)]
    Settle(std::io::Error),
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file is not a valid `.dsc`.
    #[error("{}: {error}", path.display())]
    Dsc {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: DscError,
    },
    /// The board poses beside a `.dsc` cannot be used.
    #[error("{}: {error}", path.display())]
    Tp {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: TpError,
    },
    /// The file is not a valid target.
    #[error("{}: {error}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: TargetFileError,
    },
}

/// Returns the only description of a target in a folder: a JSON file, or a `.dsc` if there is no JSON. Other paths are returned
/// unchanged.
///
/// # Errors
/// Returns an error if the folder contains no description, or several.
pub fn find(path: &Path) -> Result<PathBuf, TargetReadError> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    staging::settle(path).map_err(TargetReadError::Settle)?;
    let entries = std::fs::read_dir(path)
        .map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    let has_extension =
        |path: &PathBuf, wanted: &str| path.extension().is_some_and(|end| end == wanted);
    let is_description = |path: &PathBuf| {
        let text = has_extension(path, "json").then(|| Limits::default().read(path).ok()).flatten();
        text.is_some_and(|text| Kind::of(&text) == Kind::of_schema(SCHEMA))
    };
    let mut found: Vec<PathBuf> =
        files.iter().filter(|path| is_description(path)).cloned().collect();
    if found.is_empty() {
        found = files.into_iter().filter(|path| has_extension(path, "dsc")).collect();
    }
    match found.as_slice() {
        [only] => Ok(only.clone()),
        [] => Err(TargetReadError::NoneIn { path: path.to_owned() }),
        several => {
            let name = |path: &PathBuf| {
                path.file_name().unwrap_or_default().to_string_lossy().into_owned()
            };
            Err(TargetReadError::SeveralIn {
                path: path.to_owned(),
                names: several.iter().map(name).collect(),
            })
        }
    }
}

/// Reads a target with its sheets: a `.dsc` by its extension, otherwise JSON; from a folder, its only description. If a `.dsc` has no poses of its boards, they are
/// read from the `.tp` with the same stem. Leftovers of killed runs in the folder are cleaned up first. A family that does not
/// ship with the program is read from the path in the description, which may be relative to the current folder, to that of the
/// description or to the one around it, or else from beside the description.
///
/// # Errors
/// Returns an error if the file cannot be read, or does not describe a target.
pub fn read(path: &Path, limits: &Limits) -> Result<Printing, TargetReadError> {
    let path = &*find(path)?;
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let path_of = || path.to_owned();
    if MADE.contains(&extension.as_str()) {
        return Err(TargetReadError::Made { path: path_of(), extension });
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    staging::settle(folder.unwrap_or(Path::new("."))).map_err(TargetReadError::Settle)?;
    let text = limits.read_text(path)?;
    if extension == "dsc" {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let target = dsc::read(&text, &stem);
        let target = target.map_err(|error| TargetReadError::Dsc { path: path_of(), error })?;
        let poses = poses_beside(path);
        return match target.overlapping_boards() {
            Some(_) if poses.exists() => tp::placed(&target, &limits.read_text(&poses)?)
                .map(Printing::from)
                .map_err(|error| TargetReadError::Tp { path: poses, error }),
            _ => Ok(target.into()),
        };
    }
    let read = Printing::from_json(&text);
    let mut printing = read.map_err(|error| TargetReadError::Json { path: path_of(), error })?;
    if printing.target.family().is_err() {
        // What needs the codes will name what is missing.
        let _ = set_family_near(&mut printing.target, None, folder.unwrap_or(Path::new("")));
    }
    Ok(printing)
}

/// Returns the board described at a path if a new text of the file would no longer describe its prints, which would make them
/// useless. `None` if there is no description, or if the new text is not a target.
pub fn lost_board(path: &Path, new: &[u8]) -> Option<TargetIdentity> {
    let new = Target::from_json(std::str::from_utf8(new).ok()?).ok()?;
    let there = Target::from_json(&Limits::default().read_text(path).ok()?).ok()?;
    (!new.has_prints_of(&there)).then(|| there.identity())
}

/// The path of the board poses of a `.dsc`: the `.tp` with the same stem.
fn poses_beside(path: &Path) -> PathBuf {
    path.with_extension("tp")
}

/// Returns a warning, without a full stop, if a `.dsc` lacks the relative poses of its boards. The boards are then treated as
/// independent.
pub fn without_poses(path: &Path, target: &Target) -> Option<String> {
    let [one, other] = target.overlapping_boards()?;
    Some(format!(
        "{}: boards {one} and {other} have the same position, so the poses of its {} boards on the target are \
         missing, and each board is treated as independent; if the boards are fixed to each other, put {} beside this file",
        path.display(),
        target.panels.len(),
        poses_beside(path).file_name().unwrap_or_default().display()
    ))
}

/// Error of finding the family of a target.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetFamilyError {
    /// The given family cannot be read.
    #[error(transparent)]
    Given(FamilyFileError),
    /// The family named by the target cannot be read.
    #[error("{target} has tags of {name}: {error}")]
    Named {
        /// The target's name.
        target: String,
        /// The family's name.
        name: String,
        /// The cause.
        error: Box<FamilyFileError>,
    },
    /// A family that does not satisfy the claims of its file.
    #[error("{name} does not satisfy the claims of its file: {failure}")]
    Rejected {
        /// The family's name.
        name: String,
        /// The first false claim.
        failure: String,
    },
    /// A family with other codes.
    #[error("{target} {why}")]
    Other {
        /// The target's name.
        target: String,
        /// The difference.
        why: OtherFamily,
    },
}

/// Sets the family of a target's tags: the given one, else the one named in the target, else the one at the path in its spec.
/// The family must begin with the codes that the target was made with. Its codes must have the claimed distance, because
/// decoding relies on it. A target without tags needs no family.
///
/// # Errors
/// Returns an error if the family cannot be read, has other codes, or has codes that are closer than claimed, or if a family is
/// given for a target without tags.
pub fn set_family(target: &mut Target, given: Option<&str>) -> Result<(), TargetFamilyError> {
    if given.is_none() && target.family().is_ok() {
        return Ok(());
    }
    set_family_near(target, given, Path::new(""))
}

/// Sets the family like [`set_family`], for a target that is described in this folder.
fn set_family_near(
    target: &mut Target,
    given: Option<&str>,
    folder: &Path,
) -> Result<(), TargetFamilyError> {
    let name = target.name.to_string();
    let other = |why| TargetFamilyError::Other { target: name, why };
    match (&target.family, given) {
        (None, None) => Ok(()),
        (None, Some(_)) => Err(other(OtherFamily::NoTags)),
        (Some(wanted), given) => {
            let family = family(target, wanted, given, folder)?;
            target.set_family(&family).map_err(other)
        }
    }
}

/// Returns the wanted family after checking it.
fn family(
    target: &Target,
    wanted: &FamilyRef,
    given: Option<&str>,
    folder: &Path,
) -> Result<Family, TargetFamilyError> {
    // If the target also has other tags, a given file with square tags is the family of its square tags.
    let given = given.map(|given| family_file::resolve(given).map_err(TargetFamilyError::Given));
    let given = given.transpose()?;
    let file = |path: Option<&str>| path.map(|path| file_near(path, folder));
    let Some(squares) = &wanted.squares else {
        return one_family(target, wanted, file(target.spec.family()), given);
    };
    let (of_squares, others): (Option<Family>, Option<Family>) = match given {
        Some(given) if given.kind() == GridKind::Checker => (Some(given), None),
        given => (None, given),
    };
    let family = one_family(target, wanted, file(target.spec.family()), others)?;
    let squares = one_family(target, squares, file(target.spec.square_family()), of_squares)?;
    Ok(family.with_squares(squares))
}

/// Returns the first existing file that a path in a description in this folder may mean, or the path itself.
fn file_near(path: &str, folder: &Path) -> PathBuf {
    let name = Path::new(path).file_name().unwrap_or_default();
    let places = [folder.join(path), folder.join("..").join(path), folder.join(name)];
    let here = PathBuf::from(path);
    match here.exists() {
        true => here,
        false => places.into_iter().find(|place| place.is_file()).unwrap_or(here),
    }
}

/// Returns the family with the given name, or the one at the path if only that one matches.
fn named_family(
    target: &Target,
    wanted: &FamilyRef,
    path: Option<PathBuf>,
) -> Result<Family, FamilyFileError> {
    let is_it = |family: &Family| target.check_family(wanted, family).is_ok();
    let of_name = family_file::resolve(&wanted.name);
    if of_name.as_ref().is_ok_and(is_it) {
        return of_name;
    }
    match path.map(|path| family_file::resolve(&path.to_string_lossy())) {
        Some(Ok(family)) if of_name.is_err() || is_it(&family) => Ok(family),
        Some(Err(error)) if of_name.is_err() => Err(error),
        _ => of_name,
    }
}

/// Returns a family of a target: the given one, else by its name, else by its path in the spec. A user's family may have the
/// name of a shipped one.
fn one_family(
    target: &Target,
    wanted: &FamilyRef,
    path: Option<PathBuf>,
    given: Option<Family>,
) -> Result<Family, TargetFamilyError> {
    let family = match given {
        Some(given) => given,
        None => named_family(target, wanted, path).map_err(|error| TargetFamilyError::Named {
            target: target.name.to_string(),
            name: wanted.name.clone(),
            error: Box::new(error),
        })?,
    };
    target
        .check_family(wanted, &family)
        .map_err(|why| TargetFamilyError::Other { target: target.name.to_string(), why })?;
    // Shipped families were checked when they were made.
    let is_shipped = Family::shipped(family.name()).is_ok_and(|shipped| shipped == family);
    if !is_shipped
        && family.len() <= PAIRS_COUNTED
        && let Some(failure) = certify_codes(&family).failures.into_iter().next()
    {
        return Err(TargetFamilyError::Rejected { name: family.name().to_owned(), failure });
    }
    Ok(family)
}
