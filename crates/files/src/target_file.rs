//! Targets from files, with the families that they name.

use std::path::{Path, PathBuf};

use deltille_core::family::{Family, PAIRS_COUNTED, certify_codes};
use deltille_core::lattice::GridKind;
use deltille_core::targets::{FamilyRef, OtherFamily, Target, TargetFileError, TargetIdentity};
use deltille_layout::Printing;

use crate::export::dsc::{self, DscError};
use crate::export::staging;
use crate::export::tp::{self, TpError};
use crate::family_file::{self, FamilyFileError};
use crate::limits::{Limits, ReadError};

/// Endings of files that are made of a target and do not describe it.
const MADE: [&str; 8] = ["pdf", "svg", "png", "glb", "obj", "stl", "dxf", "mtl"];

/// Why a target cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetReadError {
    /// A file that was made of a target.
    #[error("{}: a .{extension} describes no target: give the .json written with it", path.display())]
    Made {
        /// The file.
        path: PathBuf,
        /// Its ending.
        extension: String,
    },
    /// What an interrupted run has left cannot be put in order.
    #[error(transparent)]
    Settle(std::io::Error),
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file is no `.dsc`.
    #[error("{}: {error}", path.display())]
    Dsc {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: DscError,
    },
    /// The board poses beside a `.dsc` cannot be used.
    #[error("{}: {error}", path.display())]
    Tp {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: TpError,
    },
    /// The file is no target.
    #[error("{}: {error}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: TargetFileError,
    },
}

/// Reads a target with its sheets: `.dsc` by its extension, with the poses of its boards in a `.tp` of the same stem where it has none,
/// JSON otherwise. What killed runs have left in its folder is put in order
/// before.
///
/// # Errors
/// Where the file cannot be read, or describes no target.
pub fn read(path: &Path, limits: &Limits) -> Result<Printing, TargetReadError> {
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
    Printing::from_json(&text).map_err(|error| TargetReadError::Json { path: path_of(), error })
}

/// The board that a description at a path describes, where a new text of the file would not describe its prints: they would
/// be of no use any more. `None` where there is no such description, or the new text is not one of a target.
pub fn lost_board(path: &Path, new: &[u8]) -> Option<TargetIdentity> {
    let new = Target::from_json(std::str::from_utf8(new).ok()?).ok()?;
    let there = Target::from_json(&Limits::default().read_text(path).ok()?).ok()?;
    (!new.has_prints_of(&there)).then(|| there.identity())
}

/// Where the poses of the boards of a `.dsc` are looked for: in the `.tp` of the same stem beside it.
fn poses_beside(path: &Path) -> PathBuf {
    path.with_extension("tp")
}

/// What is missing of a target that was read from a file, as a sentence without full stop: where the boards of a `.dsc`
/// are to each other. They are taken as boards that lie about then.
pub fn without_poses(path: &Path, target: &Target) -> Option<String> {
    let [one, other] = target.overlapping_boards()?;
    Some(format!(
        "{}: boards {one} and {other} are listed in the same place, so the poses of its {} boards on the target are \
         missing and each board is taken by itself; if they are fixed to each other, put {} beside it",
        path.display(),
        target.panels.len(),
        poses_beside(path).file_name().unwrap_or_default().display()
    ))
}

/// Why the family of a target cannot be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetFamilyError {
    /// The family that was given cannot be read.
    #[error(transparent)]
    Given(FamilyFileError),
    /// The family that the target names cannot be read.
    #[error("{target} carries tags of {name}: {error}")]
    Named {
        /// The target's name.
        target: String,
        /// The family's name.
        name: String,
        /// Why.
        error: Box<FamilyFileError>,
    },
    /// A family that is not what its file claims.
    #[error("{name} is not what it claims: {failure}")]
    Rejected {
        /// The family's name.
        name: String,
        /// The first claim that does not hold.
        failure: String,
    },
    /// A family with other codes.
    #[error("{target} {why}")]
    Other {
        /// The target's name.
        target: String,
        /// What is another.
        why: OtherFamily,
    },
}

/// Sets the family of a target's tags: the one given, else by the name in the target, else by the path in its spec. Its codes
/// must be those that the target was made with, perhaps with others after them, and as far apart as the family claims:
/// decoding relies on that. A target without tags needs none.
///
/// # Errors
/// Where it cannot be read, has other codes, or some that are closer than it claims, or the target has no tags.
pub fn set_family(target: &mut Target, given: Option<&str>) -> Result<(), TargetFamilyError> {
    let name = target.name.to_string();
    let other = |why| TargetFamilyError::Other { target: name, why };
    match (&target.family, given) {
        (None, None) => Ok(()),
        (None, Some(_)) => Err(other(OtherFamily::NoTags)),
        (Some(wanted), given) => {
            let family = family(target, wanted, given)?;
            target.set_family(&family).map_err(other)
        }
    }
}

/// The family that is wanted, checked.
fn family(
    target: &Target,
    wanted: &FamilyRef,
    given: Option<&str>,
) -> Result<Family, TargetFamilyError> {
    // A file that is given is that of the square tags, where it has such, and there are others.
    let given = given.map(|given| family_file::resolve(given).map_err(TargetFamilyError::Given));
    let given = given.transpose()?;
    let Some(squares) = &wanted.squares else {
        return one_family(target, wanted, target.spec.family(), given);
    };
    let (of_squares, others): (Option<Family>, Option<Family>) = match given {
        Some(given) if given.kind() == GridKind::Checker => (Some(given), None),
        given => (None, given),
    };
    let family = one_family(target, wanted, target.spec.family(), others)?;
    let squares = one_family(target, squares, target.spec.square_family(), of_squares)?;
    Ok(family.with_squares(squares))
}

/// The family by its name, or the one at the path if that is it, and it is not the one of this name.
fn named_family(
    target: &Target,
    wanted: &FamilyRef,
    path: Option<&str>,
) -> Result<Family, FamilyFileError> {
    let is_it = |family: &Family| target.check_family(wanted, family).is_ok();
    let of_name = family_file::resolve(&wanted.name);
    if of_name.as_ref().is_ok_and(is_it) {
        return of_name;
    }
    match path.map(family_file::resolve) {
        Some(Ok(family)) if of_name.is_err() || is_it(&family) => Ok(family),
        Some(Err(error)) if of_name.is_err() => Err(error),
        _ => of_name,
    }
}

/// A family of a target: the one given, else by its name, else by its path in the spec. One's own family may have the
/// name of one that ships.
fn one_family(
    target: &Target,
    wanted: &FamilyRef,
    path: Option<&str>,
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
    // Those that are shipped were compared when they were made.
    let is_shipped = Family::shipped(family.name()).is_ok_and(|shipped| shipped == family);
    if !is_shipped
        && family.len() <= PAIRS_COUNTED
        && let Some(failure) = certify_codes(&family).failures.into_iter().next()
    {
        return Err(TargetFamilyError::Rejected { name: family.name().to_owned(), failure });
    }
    Ok(family)
}
