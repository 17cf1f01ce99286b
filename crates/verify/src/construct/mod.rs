//! Inspection of the constructs of a file against a list of those that every viewer shows alike.
//!
//! Rendering a file proves what one program shows. Scripts, animations, rules for print, layers,
//! blend modes, vertex colours or a second scene make other programs show something else. So each
//! format has a list of the constructs that its writer here uses and the reader interprets exactly;
//! anything else is named and refused, known as harmful or not. A refused file is not rendered.

mod glb;
mod glb_json;
mod ink;
mod mtl;
mod obj;
mod pdf;
mod pdf_content;
mod png;
mod stl;
mod svg;
mod threemf;
pub(crate) mod usda;

use std::path::Path;

use flate2::{Decompress, FlushDecompress, Status};
use serde::Serialize;
use serde_json::Value;

use super::reader::Reader;
use super::{Artifact, DocumentError, Finding, Format, PageFinding};
use deltille_files::export::inlay::Body;
use deltille_files::export::mesh::extras;
use deltille_files::export::scene;
use deltille_layout::artwork::{drawn_lines, subject};
use deltille_layout::{Finish, LineKind, Printing, SheetLayout};

/// Problem of marks outside the page: some viewers show more than the page, and then these as well.
const OFF_PAGE: &str = "a mark that reaches over the edge of the page";

/// Most characters of a number: readers differ in how many they take.
const MOST_DIGITS: usize = 40;

/// Most findings that are listed for a file.
const MOST_LISTED: usize = 64;

/// A construct that is not permitted, or hidden content.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ConstructFinding {
    /// The file has a construct that not every viewer shows alike, so that other programs may show
    /// something else than is seen here.
    #[error("{place}: {construct}: not every viewer shows that alike")]
    Construct {
        /// Its place, in the terms of the format.
        place: String,
        /// The construct or problem.
        construct: String,
    },
    /// A line of a text format is not the one that the program writes.
    #[error("{place}: {found}: the file was damaged or edited since it was written: make it again")]
    OtherLine {
        /// Its place, such as `line 12`.
        place: String,
        /// What is there: how the line begins, or that the file ends.
        found: String,
    },
    /// Content that no picture of the page shows: texts that are not those of the target, or marks
    /// beside the page.
    #[error("{place}: {problem}")]
    Unseen {
        /// Its place, in the terms of the format.
        place: String,
        /// The construct or problem.
        problem: String,
    },
}

/// Constructs that are not permitted, collected while a file is inspected.
#[derive(Default)]
struct Findings(Vec<Finding>);

impl Findings {
    /// Adds a construct, such as "element <image>", and where it is, such as "line 12".
    fn add(&mut self, place: impl Into<String>, construct: impl Into<String>) {
        if !self.is_full() {
            let (place, construct) = (place.into(), construct.into());
            self.0.push(ConstructFinding::Construct { place, construct }.into());
        }
    }

    /// Adds a line that is not the one that the program writes.
    fn add_other_line(&mut self, place: String, found: String) {
        if !self.is_full() {
            self.0.push(ConstructFinding::OtherLine { place, found }.into());
        }
    }

    /// Adds a construct unless `holds`.
    fn unless(&mut self, holds: bool, place: impl Into<String>, construct: impl Into<String>) {
        if !holds {
            self.add(place, construct);
        }
    }

    /// Adds hidden content unless `holds`; the file is rendered and compared all the same.
    fn unseen_unless(&mut self, holds: bool, place: impl Into<String>, problem: impl Into<String>) {
        if !holds && !self.is_full() {
            let (place, problem) = (place.into(), problem.into());
            self.0.push(ConstructFinding::Unseen { place, problem }.into());
        }
    }

    /// Whether the file has a construct that is not permitted, so that it is not rendered.
    fn refuse(&self) -> bool {
        refuse(&self.0)
    }

    /// Whether as many findings are listed as are listed at all; more are dropped.
    fn is_full(&self) -> bool {
        self.0.len() >= MOST_LISTED
    }

    /// Adds the findings of a file that belongs to this one, such as a texture, with its name before
    /// the places.
    fn add_of(&mut self, file: &str, other: Findings) {
        for finding in other.0 {
            match finding {
                Finding::Construct(ConstructFinding::Construct { place, construct }) => {
                    self.add(format!("{file}, {place}"), construct);
                }
                Finding::Construct(ConstructFinding::Unseen { place, problem }) => {
                    self.unseen_unless(false, format!("{file}, {place}"), problem);
                }
                Finding::Construct(ConstructFinding::OtherLine { place, found }) => {
                    self.add_other_line(format!("{file}, {place}"), found);
                }
                other => self.0.push(other),
            }
        }
    }
}

/// Whether a file has a construct that not every viewer shows alike, or another line than the program writes, so that it
/// is not rendered.
/// Hidden content alone does not prevent that.
pub(super) fn refuse(findings: &[Finding]) -> bool {
    let refuses = |finding: &Finding| {
        use ConstructFinding::{Construct, OtherLine};
        matches!(finding, Finding::Construct(Construct { .. } | OtherLine { .. }))
    };
    findings.iter().any(|finding| match finding {
        Finding::Page(PageFinding::OnPage { finding, .. }) => refuses(finding),
        finding => refuses(finding),
    })
}

/// What the texts in a file must say about the target: they are read by people and programs that do
/// not look at the picture.
struct Words {
    /// Its name.
    title: String,
    /// One line on what it is.
    subject: String,
    /// The same facts as JSON, for programs.
    extras: Value,
    /// How its pages are printed.
    finish: Finish,
    /// Number of lines to cut along on each sheet.
    cut_lines: Vec<usize>,
}

impl Words {
    /// The texts that belong to a target.
    fn of(printing: &Printing) -> Self {
        let target = &printing.target;
        let (title, finish) = (target.name.to_string(), printing.finish.clone());
        let cut = |layout: &SheetLayout| {
            drawn_lines(layout).filter(|(_, line)| line.kind == LineKind::Cut).count()
        };
        let cut_lines = printing.sheets.iter().map(cut).collect();
        Self { title, subject: subject(target), extras: extras(target), finish, cut_lines }
    }

    /// Whether data in a mesh is that of the target; any version of the program may have written it.
    fn are_extras(&self, found: &Value) -> bool {
        let creator = found["generator"].as_str().is_some_and(is_creator);
        let mut stated = self.extras.clone();
        stated["generator"] = found["generator"].clone();
        creator && stated == *found
    }
}

/// Whether words name this program in any of its versions.
fn is_creator(words: &str) -> bool {
    let version = words.strip_prefix("deltille ").unwrap_or_default();
    !version.is_empty() && version.chars().all(|c| c.is_ascii_digit() || c == '.')
}

/// Inspects a printed page, a mesh or a body: constructs that are not permitted, texts that are not
/// those of the target, and the files that belong to it, as an OBJ names them. Returns the findings
/// and the contents of those files.
///
/// # Errors
///
/// A file cannot be read at all, or exceeds the limits.
pub(super) fn check(
    reader: &Reader,
    path: &Path,
    format: Format,
    printing: &Printing,
) -> Result<(Vec<Finding>, Vec<Artifact>), DocumentError> {
    let bytes = reader.read(path)?;
    let (words, limits) = (Words::of(printing), reader.limits);
    if format == Format::Obj {
        let checked = obj::check(reader, path, &bytes, &words);
        return checked.map(|(found, parts)| (found.0, parts));
    }
    if format == Format::Usda {
        return usda::check(reader, path, &bytes, &words).map(|(found, parts)| (found.0, parts));
    }
    let found = reader.run(path, move || match format {
        Format::Svg => svg::check(&bytes, &words, &limits),
        Format::Pdf => pdf::check(&bytes, &words, &limits),
        Format::Png => png::check(&bytes, &words.title, &limits),
        Format::Glb => glb::check(&bytes, &words, &limits),
        Format::Stl => stl::check(&bytes, &words.title, &limits),
        Format::Sdf => model(&bytes, &scene::sdf(&words.title)),
        Format::Urdf => model(&bytes, &scene::urdf(&words.title)),
        Format::Mjcf => model(&bytes, &scene::mjcf(&words.title, textures_of_mjcf(&bytes))),
        // Their readers know nothing but what is written.
        Format::Obj | Format::Usda | Format::ThreeMf | Format::Dsc | Format::Dxf => {
            Ok(Findings::default())
        }
    })?;
    Ok((found.0, Vec::new()))
}

/// Inspects a 3MF that should have bodies of these names, and returns the findings, and the bodies unless there are any.
///
/// # Errors
///
/// The file cannot be read at all, or exceeds the limits.
pub(super) fn bodies(
    reader: &Reader,
    path: &Path,
    names: &'static [&str],
    printing: &Printing,
) -> Result<(Vec<Finding>, Vec<Body>), DocumentError> {
    let (bytes, words, limits) = (reader.read(path)?, Words::of(printing), reader.limits);
    let check = move || threemf::check(&bytes, names, &words, &limits);
    let (found, bodies) = reader.run(path, check)?;
    Ok((found.0, bodies))
}

/// Compares what the model for MuJoCo at `path` takes of the OBJ beside it, `mesh`, which was inspected: its textures, and
/// its parts where there are several.
///
/// # Errors
///
/// A file cannot be read at all.
pub(super) fn check_parts(
    reader: &Reader,
    path: &Path,
    mesh: &Path,
    printing: &Printing,
) -> Result<Vec<Finding>, DocumentError> {
    let count = textures_of_mjcf(&reader.read(path)?);
    Ok(obj::check_parts(reader, mesh, count, &Words::of(printing))?.0)
}

/// Number of textures of a model for MuJoCo.
fn textures_of_mjcf(bytes: &[u8]) -> usize {
    std::str::from_utf8(bytes).map_or(1, |text| usda::textures_by(text, "<texture "))
}

/// Inspects a model that puts the mesh of an OBJ in its place and does nothing else.
fn model(bytes: &[u8], stated: &str) -> Result<Findings, String> {
    let mut found = Findings::default();
    usda::same_lines(text(bytes)?, stated, str::to_owned, &mut found);
    Ok(found)
}

/// The content of a text file.
fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|_| "not a text file in UTF-8".to_owned())
}

/// The first characters of a text that is quoted in a finding.
fn start(text: &str, characters: usize) -> String {
    text.chars().take(characters).collect()
}

/// A decimal number as all readers take it: digits on both sides of a point, without an exponent or
/// a plus, and no more of them than any reader has room for.
fn decimal(word: &str) -> Option<f64> {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let size = word.strip_prefix('-').unwrap_or(word);
    let (whole, fraction) = size.split_once('.').unwrap_or((size, "0"));
    let plain = word.len() <= MOST_DIGITS && digits(whole) && digits(fraction);
    plain.then(|| word.parse().ok()).flatten()
}

/// Decompresses zlib data block by block and returns its length: `None` unless the stream ends with
/// the last byte, its checksum is right, and it is no longer than `most`.
fn unpack(packed: &[u8], most: u64, each: impl FnMut(&[u8])) -> Option<u64> {
    unpack_by(Decompress::new(true), packed, most, each)
}

/// Likewise by a stream that expects a head and a checksum, or none.
fn unpack_by(
    mut stream: Decompress,
    packed: &[u8],
    most: u64,
    mut each: impl FnMut(&[u8]),
) -> Option<u64> {
    let mut block = vec![0; 1 << 16];
    loop {
        let (read, before) = (stream.total_in(), stream.total_out());
        let rest = packed.get(usize::try_from(read).ok()?..)?;
        let status = stream.decompress(rest, &mut block, FlushDecompress::None).ok()?;
        let length = stream.total_out() - before;
        each(block.get(..usize::try_from(length).ok()?)?);
        if stream.total_out() > most {
            return None;
        }
        match status {
            Status::StreamEnd if stream.total_in() == packed.len() as u64 => {
                return Some(stream.total_out());
            }
            Status::StreamEnd => return None,
            // No progress: the end is missing.
            _ if length == 0 && stream.total_in() == read => return None,
            _ => {}
        }
    }
}

/// Whether a name is that of a file in the same folder on every system: without a path, a drive or
/// control characters.
fn is_plain_file_name(name: &str) -> bool {
    let listed = |c: char| !matches!(c, '/' | '\\' | ':') && !c.is_control();
    !name.is_empty() && name != ".." && name.trim() == name && name.chars().all(listed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_decimals_and_names_stay_in_the_folder() {
        assert_eq!(decimal("-0.5"), Some(-0.5));
        let long = "0".repeat(50);
        for word in
            ["1e3", "inf", "nan", "0x1", "", "-", "1.2.3", "1,5", "+1", ".5", "5.", "--1", &long]
        {
            assert_eq!(decimal(word), None, "{word}");
        }
        assert!(is_plain_file_name("t-texture.png"));
        for name in [
            "",
            "..",
            "../t.png",
            "/t.png",
            "a\\b.png",
            "c:t.png",
            "http://t/t.png",
            "t.png\r",
            "t.png ",
        ] {
            assert!(!is_plain_file_name(name), "{name}");
        }
    }
}
