//! The lines of a material library that every viewer interprets the same way: materials that show their texture
//! unchanged.

use crate::syntax::findings::Findings;
use crate::syntax::text::{is_plain_file_name, start};
use crate::syntax::words::is_creator;

/// The required statements of a material, word for word: no ambient light, white, no gloss. Viewers assume different
/// values for an omitted statement.
const STATED: [&str; 4] = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "illum 1"];

/// A material of a library.
pub(super) struct Material {
    /// Name of the material.
    pub name: String,
    /// File name of its texture.
    pub texture: Option<String>,
}

/// Inspects a material library: a comment that names its writer, then for each material its name and each statement
/// once. Returns the materials and the findings.
pub(super) fn check(text: &str) -> (Vec<Material>, Findings) {
    let (mut materials, mut found) = (Vec::<Material>::new(), Findings::default());
    let mut stated: Vec<&str> = Vec::new();
    for (index, line) in text.split_terminator('\n').enumerate() {
        let place = format!("line {}", index + 1);
        if index == 0 {
            let creator =
                line.strip_prefix("# ").and_then(|words| words.strip_suffix(", material"));
            let construct =
                format!("`{}` instead of the comment that names deltille", start(line, 60));
            found.unless(creator.is_some_and(is_creator), place, construct);
            continue;
        }
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let of_stated = |listed: &&str| listed.split(' ').next() == Some(word);
        let holds = match word {
            "newmtl" => {
                let named = materials.iter().any(|material| material.name == rest);
                end(materials.last(), &stated, &mut found);
                stated.clear();
                materials.push(Material { name: rest.to_owned(), texture: None });
                !named
            }
            // A word that begins with a dash would be an option of the statement.
            "map_Kd" => {
                let is_plain = is_plain_file_name(rest) && !rest.starts_with('-');
                let shown =
                    materials.iter().any(|material| material.texture.as_deref() == Some(rest));
                let texture = materials.last_mut().map(|material| &mut material.texture);
                let first = texture.is_some_and(|slot| slot.replace(rest.to_owned()).is_none());
                first && is_plain && !shown
            }
            _ if STATED.iter().any(of_stated) => {
                let new = !materials.is_empty() && !stated.contains(&line);
                stated.push(line);
                new && STATED.contains(&line)
            }
            _ => {
                found.add(place, format!("statement {}", start(word, 20)));
                continue;
            }
        };
        found.unless(holds, place, format!("`{}`", start(line, 60)));
    }
    end(materials.last(), &stated, &mut found);
    found.unless(!materials.is_empty(), "the file", "no material");
    (materials, found)
}

/// Reports the statements that a material lacks.
fn end(material: Option<&Material>, stated: &[&str], found: &mut Findings) {
    let Some(material) = material else { return };
    for line in STATED {
        let word = line.split(' ').next().unwrap_or_default();
        let there = stated.iter().any(|stated| stated.split(' ').next() == Some(word));
        found.unless(there, "the file", format!("no statement {line}"));
    }
    found.unless(material.texture.is_some(), "the file", "no texture map_Kd");
}
