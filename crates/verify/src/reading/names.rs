//! Names of files, and what they say.

use std::path::{Path, PathBuf};

/// The name of a file, or of the first and the last of several.
pub(crate) fn of_all(files: &[PathBuf]) -> String {
    match files {
        [first, .., last] => format!("{} to {}", file_name(first), file_name(last)),
        _ => files.iter().map(|file| file_name(file)).collect(),
    }
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The mesh, or the model for MuJoCo, with which a file is compared that is a part of it: a material library, a texture, or
/// the part of a mesh that has one. `target` is the name of the target.
pub fn whole_of(target: &str, name: &str) -> Option<String> {
    let number = |part: &str| {
        let (part, number) = part.rsplit_once('-')?;
        number.parse::<u32>().ok().map(|_| part.to_owned())
    };
    if let Some(part) = name.strip_suffix(".obj") {
        return number(part).filter(|mesh| mesh == target).map(|mesh| format!("{mesh}.xml"));
    }
    let picture = || {
        // A page of a target whose name ends so is none.
        let stem = name.strip_suffix(".png").filter(|stem| *stem != target)?;
        let of = |stem: &str| stem.strip_suffix("-texture").map(str::to_owned);
        of(stem).or_else(|| of(&number(stem)?).filter(|mesh| mesh == target))
    };
    let mesh = name.strip_suffix(".mtl").map(str::to_owned).or_else(picture)?;
    Some(format!("{mesh}.obj"))
}
