//! The lines of a USD that this program writes: one mesh of triangles with its textures.

use std::path::Path;

use crate::reading::error::DocumentError;
use crate::reading::reader::{Artifact, Reader};
use crate::syntax::findings::Findings;
use crate::syntax::png;
use crate::syntax::text::{decimal, text};
use crate::syntax::words::Words;
use deltille_files::export::obj::texture_name;
use deltille_files::export::scene::{USD_LISTS, USD_SUBSET, usda_frame};
use deltille_files::export::texture::MAX_TEXTURES;

/// Inspects a USD and its textures. Returns the findings, and the textures up to the first one that is rejected.
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
    let unreadable = |problem: String| DocumentError::unreadable(path, problem);
    let text = text(bytes).map_err(unreadable)?;
    let count = textures_by(text, "def GeomSubset ");
    let (mut found, mut parts) = (Findings::default(), Vec::new());
    same_lines(text, &usda_frame(&words.title, count), list_of, &mut found);
    for texture in 0..count {
        if found.refuse() {
            break;
        }
        let texture = texture_name(&words.title, texture, count);
        let file = path.with_file_name(&texture);
        let picture = reader.read(&file)?;
        let of_texture = png::check(&picture, &words.title, &reader.limits)
            .map_err(|problem| DocumentError::unreadable(&file, problem))?;
        found.add_of(&texture, of_texture);
        parts.push(Artifact::of(texture, picture));
    }
    Ok((found, parts))
}

/// Returns the number of textures of a file from its lines that begin with `start`: with several textures, each has
/// such a line.
pub(in crate::syntax) fn textures_by(text: &str, start: &str) -> usize {
    let lines = text.lines().filter(|line| line.trim_start().starts_with(start));
    lines.count().clamp(1, MAX_TEXTURES as usize)
}

/// Adds the first line that differs from `stated`, after `plain` was applied to both. The versions of the program
/// that wrote them may differ.
pub(in crate::syntax) fn same_lines(
    text: &str,
    stated: &str,
    plain: impl Fn(&str) -> String,
    found: &mut Findings,
) {
    let plain = |line: &str| plain(&without_version(line));
    let mut lines = text.lines().map(plain);
    let mut stated = stated.lines().map(plain);
    let mut number = 0;
    loop {
        number += 1;
        match (lines.next(), stated.next()) {
            (None, None) => return,
            (line, stated) if line == stated => {}
            (line, _) => {
                let begins = |line: String| -> String { line.trim().chars().take(40).collect() };
                let there = line.map(|line| format!("`{}`", begins(line)));
                let there = there.unwrap_or_else(|| "the file ends".to_owned());
                found.add_other_line(format!("line {number}"), there);
                return;
            }
        }
    }
}

/// Returns a line without the version number after the name of this program.
fn without_version(line: &str) -> String {
    let Some((before, after)) = line.split_once("deltille ") else { return line.to_owned() };
    let version = |c: char| c.is_ascii_digit() || c == '.';
    format!("{before}deltille {}", after.trim_start_matches(version))
}

/// Returns a line without the numbers of its list, if every reader interprets all of these numbers the same way.
fn list_of(line: &str) -> String {
    let Some(_) = list(line) else { return line.to_owned() };
    let [from, to] = brackets(line);
    format!("{}{}", &line[..from], &line[to..])
}

/// Returns the range of a list in a line, including its brackets.
fn brackets(line: &str) -> [usize; 2] {
    let from = line.find("= [").map_or(0, |at| at + 2);
    let to = line.rfind(']').map_or(from, |at| at + 1);
    [from, to.max(from)]
}

/// Parses the list on a line: its name and its numbers, in tuples of the size that the type of the list requires.
pub(crate) fn list(line: &str) -> Option<(&'static str, Vec<f64>)> {
    let trimmed = line.trim_start();
    let mut names = USD_LISTS.into_iter().chain([USD_SUBSET]);
    let name = names.find(|name| trimmed.starts_with(&format!("{name} = [")))?;
    let [from, to] = brackets(line);
    let inside = line[from..to].strip_prefix('[')?.strip_suffix(']')?;
    let size = if name.starts_with("int[]") {
        1
    } else if name.starts_with("texCoord2f[]") {
        2
    } else {
        3
    };
    let whole = |word: &str| {
        let digits = word.bytes().all(|byte| byte.is_ascii_digit());
        (digits && word.len() <= MAX_DIGITS_OF_INDEX).then(|| decimal(word)).flatten()
    };
    let entry = |entry: &str| -> Option<Vec<f64>> {
        if size == 1 {
            return Some(vec![whole(entry)?]);
        }
        let words = entry.strip_prefix('(')?.strip_suffix(')')?.split(", ");
        words.map(decimal).collect::<Option<Vec<f64>>>().filter(|words| words.len() == size)
    };
    let mut numbers = Vec::new();
    let mut rest = inside;
    while !rest.is_empty() {
        let end = match size {
            1 => rest.find(',').unwrap_or(rest.len()),
            _ => rest.find(')')? + 1,
        };
        numbers.extend(entry(&rest[..end])?);
        rest = match &rest[end..] {
            "" => "",
            // A value must follow the comma.
            next => next.strip_prefix(", ").filter(|next| !next.is_empty())?,
        };
    }
    Some((name, numbers))
}

/// Maximum number of digits of an index, so that it fits into 32 bits with its sign.
const MAX_DIGITS_OF_INDEX: usize = 9;

#[cfg(test)]
mod tests {
    use super::list;

    #[test]
    fn lists_contain_tuples_of_their_type() {
        let values = |line: &str| list(line).map(|(_, values)| values);
        let good = "        point3f[] points = [(0.1, -2, 3), (4, 5, 6)]";
        assert_eq!(values(good), Some(vec![0.1, -2.0, 3.0, 4.0, 5.0, 6.0]));
        assert_eq!(values("int[] indices = [0, 12]"), Some(vec![0.0, 12.0]));
        assert_eq!(values("int[] indices = []"), Some(Vec::new()));
        for line in [
            "point3f[] points = [(0.1, -2, 3, 4, 5, 6)]",
            "point3f[] points = [(0.1, -2), (3, 4, 5, 6)]",
            "point3f[] points = [0.1, -2, 3, (4, 5, 6)]",
            "point3f[] points = [((0.1, -2, 3), (4, 5, 6))]",
            "point3f[] points = [(0.1, -2, 3) (4, 5, 6)]",
            "point3f[] points = [(0.1, -2, 3), (4, 5, 6), ]",
            "point3f[] points = [(0.1, -2, 3),, (4, 5, 6)]",
            "point3f[] points = [(0.1, -2, 3), (4, 5, 6]",
            "texCoord2f[] primvars:st = [(0, 0, 0)]",
            "int[] indices = [(0), 1]",
            "int[] indices = [0, 1,]",
            "int[] indices = [0, -1]",
            "int[] indices = [0, 4294967296]",
        ] {
            assert_eq!(values(line), None, "{line}");
        }
    }
}
