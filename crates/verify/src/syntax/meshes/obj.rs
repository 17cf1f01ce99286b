//! The lines of an OBJ that every viewer interprets the same way: triangles with their material, each corner with its
//! position, texture coordinate and normal.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::reading::error::DocumentError;
use crate::reading::reader::{Artifact, Reader};
use crate::syntax::findings::Findings;
use crate::syntax::meshes::mtl;
use crate::syntax::png;
use crate::syntax::text::{decimal, is_plain_file_name, start, text};
use crate::syntax::words::{Words, is_creator};
use deltille_files::export::obj::{material_name, part_name, texture_name};
use deltille_files::export::texture::MAX_TEXTURES;

/// Inspects an OBJ, its material library and its textures. Returns the findings, and these files up to the first one
/// that is rejected.
///
/// # Errors
///
/// Returns an error if a file cannot be read, is not text or not a PNG, or exceeds the limits.
pub(in crate::syntax) fn check(
    reader: &Reader,
    path: &Path,
    bytes: &[u8],
    words: &Words,
) -> Result<(Findings, Vec<Artifact>), DocumentError> {
    let text = text(bytes).map_err(|problem| DocumentError::unreadable(path, problem))?;
    let count = text.lines().count();
    let few = reader.limits.check_nodes(count);
    few.map_err(|exceeded| DocumentError::unreadable(path, exceeded.to_string()))?;
    let Lines { mut found, library, materials: used, .. } = lines(text, words);
    let mut parts = Vec::new();
    let Some(library) = library.filter(|_| !found.refuse()) else {
        found.unless(found.refuse(), "the file", "no material library");
        return Ok((found, parts));
    };
    let written = reader.read_text(&path.with_file_name(&library))?;
    let (materials, of_library) = mtl::check(&written);
    found.add_of(&library, of_library);
    let library_name = library.clone();
    parts.push(Artifact::new(library, written));
    let few = materials.len() <= MAX_TEXTURES as usize;
    found.unless(few, "the file", format!("more than {MAX_TEXTURES} materials"));
    let known = materials.iter().map(|material| &material.name).eq(used.iter());
    found.unless(known, "the file", "materials other than those of its library");
    let usual = (0..materials.len()).map(|texture| material_name(texture, materials.len()));
    let named = materials.iter().map(|material| material.name.clone()).eq(usual);
    found.unless(
        named,
        &library_name,
        "materials whose names or order differ from those that deltille writes",
    );
    for texture in materials.into_iter().filter_map(|material| material.texture) {
        if found.refuse() {
            break;
        }
        let file = path.with_file_name(&texture);
        let picture = reader.read(&file)?;
        let of_texture = png::check(&picture, &words.title, &reader.limits)
            .map_err(|problem| DocumentError::unreadable(&file, problem))?;
        found.add_of(&texture, of_texture);
        parts.push(Artifact::of(texture, picture));
    }
    Ok((found, parts))
}

/// Checks the files that a MuJoCo model with `count` textures uses beside an inspected OBJ:
/// textures with the usual names and, if there are several, a separate OBJ for each with its part
/// of the mesh.
///
/// # Errors
///
/// Returns an error if a file cannot be read or is not text.
pub(in crate::syntax) fn check_parts(
    reader: &Reader,
    path: &Path,
    count: usize,
    words: &Words,
) -> Result<Findings, DocumentError> {
    let mut found = Findings::default();
    let whole = reader.read_text(path)?;
    let library = whole.lines().find_map(|line| line.strip_prefix("mtllib ")).unwrap_or_default();
    let materials = mtl::check(&reader.read_text(&path.with_file_name(library))?).0;
    let textures = materials.into_iter().filter_map(|material| material.texture);
    let usual = (0..count).map(|texture| texture_name(&words.title, texture, count));
    found.unless(textures.eq(usual), library, "textures other than those of the model");
    let groups = groups(&whole);
    for texture in (0..count).filter(|_| count > 1) {
        let name = part_name(&words.title, texture);
        let part = reader.read_text(&path.with_file_name(&name))?;
        let Lines { found: of_part, library: of, .. } = lines(&part, words);
        found.add_of(&name, of_part);
        let same =
            self::groups(&part).iter().eq(groups.get(texture)) && of.as_deref() == Some(library);
        found.unless(same, name, "faces other than those of that texture in the mesh");
    }
    Ok(found)
}

/// Returns the materials of an OBJ, each with the positions, texture coordinates and normals of its corners as
/// written.
fn groups(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut lists = [const { Vec::new() }; 3];
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for (word, rest) in text.lines().filter_map(|line| line.split_once(' ')) {
        match word {
            "v" => lists[0].push(rest),
            "vt" => lists[1].push(rest),
            "vn" => lists[2].push(rest),
            "usemtl" => groups.push((rest, Vec::new())),
            "f" => {
                let corners =
                    rest.split(' ').flat_map(|corner| lists.iter().zip(corner.split('/')));
                let values = corners.filter_map(|(list, at)| list.get(index(at)?.checked_sub(1)?));
                if let Some((_, faces)) = groups.last_mut() {
                    faces.extend(values);
                }
            }
            _ => {}
        }
    }
    groups
}

/// Inspects the lines of an OBJ.
fn lines(text: &str, words: &Words) -> Lines {
    let mut lines = Lines::default();
    for (index, line) in text.split_terminator('\n').enumerate() {
        let place = format!("line {}", index + 1);
        match line.strip_prefix("# ") {
            Some(comment) => lines.comment(comment, index, words, &place),
            None => lines.line(line, &place),
        }
    }
    for (used, (what, count)) in
        lines.used.iter().zip(["v", "vt", "vn"].into_iter().zip(lines.counts))
    {
        lines.found.unless(used.len() == count, "the file", format!("an unused line {what}"));
    }
    let named = lines.object.as_deref() == Some(&*words.title);
    lines.found.unseen_unless(named, "the file", "an object other than the target's name");
    lines.found.unless(!lines.is_bare, "the file", "a material that no face uses");
    lines
}

/// The state of the inspection after some lines.
#[derive(Default)]
struct Lines {
    found: Findings,
    /// File name of the material library.
    library: Option<String>,
    /// Name of the object.
    object: Option<String>,
    /// Names of the materials.
    materials: Vec<String>,
    /// Whether no face has followed the last material.
    is_bare: bool,
    /// Number of positions, texture coordinates and normals so far.
    counts: [usize; 3],
    /// Indices of those that faces use, from 1.
    used: [BTreeSet<usize>; 3],
}

impl Lines {
    /// Inspects a comment. The first line names the program and the unit, the second describes the target as JSON;
    /// there are no others.
    fn comment(&mut self, comment: &str, index: usize, words: &Words, place: &str) {
        let holds = match index {
            0 => comment.strip_suffix(", millimetres").is_some_and(is_creator),
            1 => serde_json::from_str(comment).is_ok_and(|found: Value| {
                let rewritten = found.to_string();
                words.are_extras(&found) && rewritten == comment
            }),
            _ => false,
        };
        // After a backslash, some readers treat the next line as part of the comment.
        let listed = index < 2 && !comment.contains('\\');
        self.found.unless(listed, place, "a comment");
        self.found.unseen_unless(!listed || holds, place, "text that does not describe the target");
    }

    /// Inspects a line that is not a comment.
    fn line(&mut self, line: &str, place: &str) {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let once = |slot: &mut Option<String>| slot.replace(rest.to_owned()).is_none();
        let holds = match word {
            "o" => once(&mut self.object),
            "mtllib" => once(&mut self.library) && is_plain_file_name(rest),
            "usemtl" => {
                let first = !self.is_bare && !self.materials.iter().any(|name| name == rest);
                self.materials.push(rest.to_owned());
                self.is_bare = true;
                first
            }
            "v" => self.numbers(rest, 0, 3),
            "vt" => self.numbers(rest, 1, 2) && rest.split(' ').all(on_texture),
            "vn" => self.numbers(rest, 2, 3),
            "f" => {
                let dressed = !self.materials.is_empty();
                self.found.unless(dressed, place, "a face before its material");
                self.is_bare = false;
                self.is_triangle(rest)
            }
            _ => {
                return self.found.add(place, format!("statement {}", start(word, 20)));
            }
        };
        self.found.unless(holds, place, format!("`{}`", start(line, 60)));
    }

    /// Whether a line of one of the three lists contains `count` numbers. Counts the line.
    fn numbers(&mut self, rest: &str, list: usize, count: usize) -> bool {
        self.counts[list] += 1;
        let numbers: Option<Vec<f64>> = rest.split(' ').map(decimal).collect();
        numbers.is_some_and(|numbers| numbers.len() == count)
    }

    /// Whether a face has three corners that are listed above it.
    fn is_triangle(&mut self, rest: &str) -> bool {
        let corners: Vec<&str> = rest.split(' ').collect();
        corners.len() == 3 && corners.into_iter().all(|corner| self.is_listed(corner))
    }

    /// Whether the position, texture coordinates and normal of a corner are listed above it.
    fn is_listed(&mut self, corner: &str) -> bool {
        let indices: Vec<usize> = corner.split('/').filter_map(index).collect();
        let written = corner.split('/').count();
        let listed = indices.iter().zip(self.counts).all(|(i, count)| (1..=count).contains(i));
        indices.iter().zip(&mut self.used).for_each(|(&index, used)| {
            used.insert(index);
        });
        written == 3 && indices.len() == 3 && listed
    }
}

/// Parses an index without a sign or leading zeros. Negative indices, which count from the end, are not allowed.
fn index(word: &str) -> Option<usize> {
    word.parse().ok().filter(|index: &usize| index.to_string() == word)
}

/// Whether a coordinate is on the texture; outside it, some viewers repeat the texture.
fn on_texture(word: &str) -> bool {
    decimal(word).is_some_and(|value| (0.0..=1.0).contains(&value))
}
