//! The meaning of file names.

use std::path::{Path, PathBuf};

/// Names a single file, or the first and last of several.
pub(crate) fn of_all(files: &[PathBuf]) -> String {
    match files {
        [first, .., last] => format!("{} to {}", file_name(first), file_name(last)),
        _ => files.iter().map(|file| file_name(file)).collect(),
    }
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the mesh or MuJoCo model that the file `name` is part of, for a material library, a texture, or a part of
/// a mesh with several textures. `target` is the name of the target.
pub fn whole_of(target: &str, name: &str) -> Option<String> {
    let number = |part: &str| {
        let (part, number) = part.rsplit_once('-')?;
        number.parse::<u32>().ok().map(|_| part.to_owned())
    };
    if let Some(part) = name.strip_suffix(".obj") {
        return number(part).filter(|mesh| mesh == target).map(|mesh| format!("{mesh}.xml"));
    }
    let picture = || {
        // A page of a target whose own name ends in `-texture` is not a texture.
        let stem = name.strip_suffix(".png").filter(|stem| *stem != target)?;
        let of = |stem: &str| stem.strip_suffix("-texture").map(str::to_owned);
        of(stem).or_else(|| of(&number(stem)?).filter(|mesh| mesh == target))
    };
    let mesh = name.strip_suffix(".mtl").map(str::to_owned).or_else(picture)?;
    Some(format!("{mesh}.obj"))
}
