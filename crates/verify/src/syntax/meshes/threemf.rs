//! The parts and lines of a 3MF that this program writes: bodies with their vertices and triangles.

use flate2::{Crc, Decompress};
use glam::DVec3;

use crate::syntax::findings::Findings;
use crate::syntax::meshes::usda::same_lines;
use crate::syntax::text::{decimal, text};
use crate::syntax::words::Words;
use crate::syntax::zlib::unpack_by;
use deltille_files::export::inlay::Body;
use deltille_files::export::threemf::{MODEL, TURN, fixed_parts, frame};
use deltille_files::limits::{Kind, Limits};

/// Number of bytes, without the name, of the record that ends a ZIP, of the entry of a part in the directory, and of
/// the header before its content.
const END: usize = 22;
const LISTED: usize = 46;
const HEADER: usize = 30;

/// Inspects a 3MF that should have bodies with these names. Returns the findings, and the bodies if there are no
/// findings.
///
/// # Errors
///
/// Returns an error if the file is not a ZIP, is damaged, refers to missing vertices, or exceeds the limits.
pub(in crate::syntax) fn check(
    file: &[u8],
    names: &[&str],
    words: &Words,
    limits: &Limits,
) -> Result<(Findings, Vec<Body>), String> {
    let mut found = Findings::default();
    let mut bodies = Vec::new();
    let mut fixed = fixed_parts().into_iter();
    let mut has_model = false;
    for (name, content) in parts(file, limits, &mut found)? {
        match fixed.next() {
            Some((stated, content_stated)) if stated == name => {
                same_lines(text(&content)?, &content_stated, str::to_owned, &mut found);
            }
            None if name == MODEL && !has_model => {
                has_model = true;
                let stated = frame(&words.title, &words.subject, names);
                bodies = model(text(&content)?, &stated, limits, &mut found)?;
            }
            _ => found.add(format!("part {name}"), "an unknown or misplaced part"),
        }
    }
    found.unless(has_model, "the file", format!("no part {MODEL}"));
    Ok((found, bodies))
}

/// Returns the parts of a ZIP with their names and contents. They must be contiguous, in the order of the directory
/// at the end of the file: programs read other files differently.
fn parts(
    file: &[u8],
    limits: &Limits,
    found: &mut Findings,
) -> Result<Vec<(String, Vec<u8>)>, String> {
    let damaged = || "not a ZIP of complete, contiguous parts".to_owned();
    let end = file.len().checked_sub(END).ok_or_else(damaged)?;
    let (before, last) = file.split_at(end);
    let directory = number(last, 16, 4).filter(|_| last.starts_with(b"PK\x05\x06"));
    let directory = directory.ok_or_else(damaged)?;
    let mut listed = before.get(directory..).ok_or_else(damaged)?;
    let (mut parts, mut place, mut left) = (Vec::new(), 0, limits.max_bytes);
    while !listed.is_empty() {
        let part = Part::of(listed, &before[..directory], place).ok_or_else(damaged)?;
        // Checked before anything is unpacked: a small file may contain a very large part.
        left = left
            .checked_sub(part.size as u64)
            .ok_or_else(|| limits.exceeded(Kind::Bytes).to_string())?;
        found.unless(
            part.is_plain,
            format!("part {}", part.name),
            "encryption, comments or additional fields",
        );
        if !part.is_plain {
            return Ok(Vec::new());
        }
        parts.push((part.name.to_owned(), part.content().ok_or_else(damaged)?));
        place = part.end;
        listed = &listed[LISTED + part.name.len()..];
    }
    match place == directory && number(last, 8, 2) == Some(parts.len()) {
        true => Ok(parts),
        false => Err(damaged()),
    }
}

/// A part of a ZIP.
struct Part<'a> {
    name: &'a str,
    packed: &'a [u8],
    is_packed: bool,
    /// Length of its content, and its checksum.
    size: usize,
    sum: usize,
    /// Whether it has neither flags, nor a comment, nor additional fields.
    is_plain: bool,
    /// Offset of its end in the file.
    end: usize,
}

impl<'a> Part<'a> {
    /// Returns the part that the first entry of a directory lists and that begins at offset `place` of the file.
    /// Returns `None` if the entry and the file contradict each other.
    fn of(listed: &'a [u8], file: &'a [u8], place: usize) -> Option<Self> {
        let header = file.get(place..)?;
        let is_part = listed.starts_with(b"PK\x01\x02") && header.starts_with(b"PK\x03\x04");
        let same = listed.get(6..32)? == header.get(4..30)?;
        let name_length = number(listed, 28, 2)?;
        let name = listed.get(LISTED..)?.get(..name_length)?;
        let begin = place + HEADER + name_length;
        let end = begin.checked_add(number(listed, 20, 4)?)?;
        let method = number(listed, 10, 2)?;
        let is_whole = is_part
            && same
            && header.get(HEADER..)?.starts_with(name)
            && number(listed, 42, 4)? == place
            && matches!(method, 0 | 8);
        is_whole.then_some(Self {
            name: std::str::from_utf8(name).ok()?,
            packed: file.get(begin..end)?,
            is_packed: method == 8,
            size: number(listed, 24, 4)?,
            sum: number(listed, 16, 4)?,
            is_plain: number(listed, 8, 2)? == 0 && number(listed, 30, 4)? == 0,
            end,
        })
    }

    /// Returns the content, or `None` if it does not have the stated size and checksum.
    fn content(&self) -> Option<Vec<u8>> {
        let mut content = Vec::new();
        if self.is_packed {
            let most = self.size as u64;
            let stream = Decompress::new(false);
            unpack_by(stream, self.packed, most, |block| content.extend_from_slice(block))?;
        } else {
            content.extend_from_slice(self.packed);
        }
        let mut sum = Crc::new();
        sum.update(&content);
        (content.len() == self.size && sum.sum() as usize == self.sum).then_some(content)
    }
}

/// Reads a little-endian number of `length` bytes.
fn number(bytes: &[u8], at: usize, length: usize) -> Option<usize> {
    let bytes = bytes.get(at..at + length)?;
    Some(bytes.iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte)))
}

/// Returns the bodies of a model; everything else must be exactly as the program writes it.
fn model(
    text: &str,
    stated: &str,
    limits: &Limits,
    found: &mut Findings,
) -> Result<Vec<Body>, String> {
    let mut bodies: Vec<Body> = Vec::new();
    let mut rest = String::new();
    let mut section = "";
    let mut place = None;
    let mut nodes = 0;
    for line in text.lines() {
        // XML has no other white space in any of its versions.
        let trimmed = line.trim_start_matches(' ');
        nodes += 1;
        if nodes > limits.max_nodes {
            return Err(limits.exceeded(Kind::Nodes).to_string());
        }
        match (section, bodies.last_mut()) {
            ("<vertices>", Some(body)) if let Some(place) = vertex(trimmed) => {
                body.vertices_mm.push(place);
            }
            ("<triangles>", Some(body)) if let Some(corners) = triangle(trimmed) => {
                body.triangles.push(corners);
            }
            _ => {
                section = trimmed;
                if section == "<vertices>" {
                    bodies.push(Body::default());
                }
                let (line, numbers) = placed(line);
                place = place.or(numbers);
                rest += &line;
                rest.push('\n');
            }
        }
    }
    same_lines(&rest, stated, str::to_owned, found);
    if found.refuse() {
        return Ok(Vec::new());
    }
    let is_there = place.is_some_and(|place| is_at_origin(&bodies, place));
    found.unless(
        is_there,
        "the build item",
        "a position that does not put the smallest coordinates at 0",
    );
    if found.refuse() {
        return Ok(Vec::new());
    }
    let is_known =
        |body: &Body| body.triangles.iter().flatten().all(|&v| v < body.vertices_mm.len());
    match bodies.iter().all(is_known) {
        true => Ok(bodies),
        false => Err("a triangle refers to a missing vertex".to_owned()),
    }
}

/// If a line positions the object on the printer, returns the line without its numbers, and the numbers.
fn placed(line: &str) -> (String, Option<DVec3>) {
    let numbers = || {
        let (before, rest) = line.split_once(TURN)?;
        let numbers: Vec<f64> =
            rest.strip_suffix("\"/>")?.split(' ').map(decimal).collect::<Option<_>>()?;
        let place = <[f64; 3]>::try_from(numbers).ok()?;
        Some((format!("{before}{TURN}\"/>"), DVec3::from(place)))
    };
    match numbers() {
        Some((line, place)) => (line, Some(place)),
        None => (line.to_owned(), None),
    }
}

/// Whether the object is positioned with its smallest coordinate along each axis at 0.
fn is_at_origin(bodies: &[Body], place: DVec3) -> bool {
    let vertices = bodies.iter().flat_map(|body| &body.vertices_mm);
    let least = vertices.copied().reduce(DVec3::min).unwrap_or_default();
    (least + place).abs().max_element() <= ROUNDED_MM
}

/// Rounding of coordinates, which are written with nine decimals, mm.
const ROUNDED_MM: f64 = 1e-8;

fn vertex(line: &str) -> Option<DVec3> {
    let [x, y, z] = values(line, ["<vertex x=\"", "\" y=\"", "\" z=\""])?.map(decimal);
    Some(DVec3::new(x?, y?, z?))
}

fn triangle(line: &str) -> Option<[usize; 3]> {
    let index = |word: &str| {
        let is_plain = word.len() < 10 && word.bytes().all(|byte| byte.is_ascii_digit());
        is_plain.then(|| word.parse().ok()).flatten()
    };
    let [a, b, c] = values(line, ["<triangle v1=\"", "\" v2=\"", "\" v3=\""])?.map(index);
    Some([a?, b?, c?])
}

/// Returns the three values of a line, each preceded by one of these words.
fn values<'a>(line: &'a str, words: [&str; 3]) -> Option<[&'a str; 3]> {
    let rest = line.strip_prefix(words[0])?.strip_suffix("\"/>")?;
    let (first, rest) = rest.split_once(words[1])?;
    let (second, third) = rest.split_once(words[2])?;
    Some([first, second, third])
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{BoardSpec, Target, TargetSpec};
    use deltille_files::export::inlay::InlaidBodies;
    use deltille_files::export::mesh::Meshing;
    use deltille_files::export::threemf::{INLAY, to_bytes};

    #[test]
    fn the_build_item_is_at_the_origin_and_only_xml_white_space_is_accepted() {
        let spec = BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, 4, 5, 20.0) };
        let target = Target::build("b", &TargetSpec::Board(spec), None).unwrap();
        let file = to_bytes(&InlaidBodies::new(&target, Meshing::default()).unwrap());
        let words = Words::of(&target.into());
        let stated = frame(&words.title, &words.subject, INLAY);
        let parts = parts(&file, &Limits::default(), &mut Findings::default()).unwrap();
        let good = text(&parts[2].1).unwrap();
        let holds = |text: &str| {
            let mut found = Findings::default();
            let bodies = model(text, &stated, &Limits::default(), &mut found);
            bodies.is_ok_and(|bodies| bodies.len() == 2) && !found.refuse()
        };
        assert!(holds(good));
        let (before, after) = good.split_once(TURN).unwrap();
        let (place, end) = after.split_once("\"/>").unwrap();
        let [x, y, z] = place.split(' ').collect::<Vec<_>>()[..] else { panic!("{place}") };
        let z: f64 = z.parse().unwrap();
        for place in [
            format!("{x} {y} {}", z - 3.0),
            format!("{x} {y} {}", z + 3.0),
            format!("-1 {y} {z}"),
            format!("{x} 0 {z}"),
            format!("{x} {y}"),
            format!("{x} {y} {z} 0"),
        ] {
            assert!(!holds(&format!("{before}{TURN}{place}\"/>{end}")), "{place}");
        }
        // White space that XML does not recognise.
        for space in ['\u{c}', '\u{b}', '\u{a0}', '\u{2003}'] {
            assert!(!holds(&good.replacen("<vertex", &format!("{space}<vertex"), 1)));
        }
    }
}
