//! The lines of an OBJ that every viewer takes alike: triangles with one material, each corner with
//! its position, texture coordinate and normal.

use std::path::Path;

use super::{Findings, decimal, is_plain_file_name, mtl, png, start, text};
use crate::verify::DocumentError;
use crate::verify::document::{read, read_text};

/// Goes through an OBJ, its material library and its texture.
pub(super) fn check(path: &Path, bytes: &[u8]) -> Result<Findings, DocumentError> {
    let text = text(bytes).map_err(|problem| DocumentError::unreadable(path, problem))?;
    let mut reader = Reader::default();
    for (index, line) in text.lines().enumerate() {
        reader.line(line, &format!("line {}", index + 1));
    }
    let mut found = reader.found;
    let Some(library) = reader.library.filter(|_| found.0.is_empty()) else {
        found.unless(!found.0.is_empty(), "the file", "no material library");
        return Ok(found);
    };
    let file = path.with_file_name(&library);
    let (material, of_library) = mtl::check(&read_text(&file)?);
    found.add_of(&library, of_library);
    let known = material.name.is_some() && material.name == reader.material;
    found.unless(known, "the file", "a material other than that of its library");
    if let Some(texture) = material.texture.filter(|_| found.0.is_empty()) {
        let file = path.with_file_name(&texture);
        let picture = png::check(&read(&file)?)
            .map_err(|problem| DocumentError::unreadable(&file, problem))?;
        found.add_of(&texture, picture);
    }
    Ok(found)
}

/// What was read so far.
#[derive(Default)]
struct Reader {
    found: Findings,
    library: Option<String>,
    material: Option<String>,
    /// Positions, texture coordinates and normals.
    counts: [usize; 3],
}

impl Reader {
    fn line(&mut self, line: &str, place: &str) {
        if line.trim().is_empty() || line.starts_with('#') {
            return;
        }
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let rest = rest.trim();
        let once = |slot: &mut Option<String>| slot.replace(rest.to_owned()).is_none();
        let holds = match word {
            "o" => !rest.is_empty(),
            "mtllib" => once(&mut self.library) && is_plain_file_name(rest),
            "usemtl" => once(&mut self.material),
            "v" => self.numbers(rest, 0, 3),
            "vt" => self.numbers(rest, 1, 2) && rest.split(' ').all(on_texture),
            "vn" => self.numbers(rest, 2, 3),
            "f" => {
                let dressed = self.material.is_some();
                self.found.unless(dressed, place, "a face before its material");
                self.is_triangle(rest)
            }
            _ => {
                return self.found.add(place, format!("statement {}", start(word, 20)));
            }
        };
        self.found.unless(holds, place, format!("`{}`", start(line, 60)));
    }

    /// Whether a line holds so many numbers; they are counted.
    fn numbers(&mut self, rest: &str, list: usize, count: usize) -> bool {
        self.counts[list] += 1;
        let numbers: Option<Vec<f64>> = rest.split(' ').map(decimal).collect();
        numbers.is_some_and(|numbers| numbers.len() == count)
    }

    /// Whether a face has three corners that are listed above it.
    fn is_triangle(&self, rest: &str) -> bool {
        let corners: Vec<&str> = rest.split(' ').collect();
        let listed = |corner: &str| {
            let indices: Vec<Option<usize>> = corner.split('/').map(|i| i.parse().ok()).collect();
            indices.len() == 3
                && indices
                    .iter()
                    .zip(self.counts)
                    .all(|(index, count)| index.is_some_and(|index| (1..=count).contains(&index)))
        };
        corners.len() == 3 && corners.into_iter().all(listed)
    }
}

/// Beyond the texture viewers repeat it or not.
fn on_texture(word: &str) -> bool {
    decimal(word).is_some_and(|value| (0.0..=1.0).contains(&value))
}
