//! The lines of a material library that every viewer takes alike: one material that shows its
//! texture as it is.

use super::{Findings, decimal, is_plain_file_name, start};

/// Statements with the numbers that they must have: no light of its own, white, no gloss, opaque.
const NUMBERS: [(&str, &[f64]); 5] = [
    ("Ka", &[0.0, 0.0, 0.0]),
    ("Kd", &[1.0, 1.0, 1.0]),
    ("Ks", &[0.0, 0.0, 0.0]),
    ("illum", &[1.0]),
    ("d", &[1.0]),
];

/// The material of a library.
#[derive(Default)]
pub(super) struct Material {
    /// Its name.
    pub name: Option<String>,
    /// File name of its texture.
    pub texture: Option<String>,
}

/// Goes through a material library.
pub(super) fn check(text: &str) -> (Material, Findings) {
    let (mut material, mut found) = (Material::default(), Findings::default());
    for (index, line) in text.lines().enumerate() {
        let place = format!("line {}", index + 1);
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let rest = rest.trim();
        let once = |slot: &mut Option<String>| slot.replace(rest.to_owned()).is_none();
        let holds = match word {
            "newmtl" => once(&mut material.name),
            // A first word with a dash would be an option.
            "map_Kd" => {
                once(&mut material.texture) && is_plain_file_name(rest) && !rest.starts_with('-')
            }
            _ => match NUMBERS.iter().find(|(statement, _)| *statement == word) {
                Some((_, stated)) => {
                    let numbers: Option<Vec<f64>> = rest.split(' ').map(decimal).collect();
                    numbers.as_deref() == Some(*stated)
                }
                None => {
                    found.add(place, format!("statement {}", start(word, 20)));
                    continue;
                }
            },
        };
        found.unless(holds, place, format!("`{}`", start(line, 60)));
    }
    let white = text.lines().any(|line| line.starts_with("Kd "));
    found.unless(white, "the file", "no colour Kd 1 1 1");
    found.unless(material.texture.is_some(), "the file", "no texture map_Kd");
    (material, found)
}
