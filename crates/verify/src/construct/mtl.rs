//! The lines of a material library that every viewer takes alike: one material that shows its
//! texture as it is.

use super::{Findings, is_creator, is_plain_file_name, start};

/// The statements about the material, word for word: no ambient light, white, no gloss. Viewers
/// differ in what they assume for an omitted statement.
const STATED: [&str; 4] = ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "illum 1"];

/// The material of a library.
#[derive(Default)]
pub(super) struct Material {
    /// Its name.
    pub name: Option<String>,
    /// File name of its texture.
    pub texture: Option<String>,
}

/// Inspects a material library, which has a comment about its writer, and then each statement once,
/// the name of the material first; returns the material and the findings.
pub(super) fn check(text: &str) -> (Material, Findings) {
    let (mut material, mut found) = (Material::default(), Findings::default());
    let mut stated: Vec<&str> = Vec::new();
    for (index, line) in text.split_terminator('\n').enumerate() {
        let place = format!("line {}", index + 1);
        if index == 0 {
            let creator =
                line.strip_prefix("# ").and_then(|words| words.strip_suffix(", material"));
            let construct = format!("`{}` instead of what wrote it", start(line, 60));
            found.unless(creator.is_some_and(is_creator), place, construct);
            continue;
        }
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let once = |slot: &mut Option<String>| slot.replace(rest.to_owned()).is_none();
        let of_stated = |listed: &&str| listed.split(' ').next() == Some(word);
        let holds = match word {
            "newmtl" => once(&mut material.name) && index == 1,
            // A word that begins with a dash would be an option of the statement.
            "map_Kd" => {
                once(&mut material.texture) && is_plain_file_name(rest) && !rest.starts_with('-')
            }
            _ if STATED.iter().any(of_stated) => {
                let new = !stated.contains(&line);
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
    for line in STATED {
        let word = line.split(' ').next().unwrap_or_default();
        let there = stated.iter().any(|stated| stated.split(' ').next() == Some(word));
        found.unless(there, "the file", format!("no statement {line}"));
    }
    found.unless(material.texture.is_some(), "the file", "no texture map_Kd");
    (material, found)
}
