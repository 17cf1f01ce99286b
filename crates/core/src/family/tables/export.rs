//! Families as source text for other programs.

use std::fmt::Write;

use crate::family::{Family, TagWords};

/// A target language or format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportFormat {
    /// A C header with an array of `uint64_t`.
    C,
    /// A Rust module with an array of `u64`.
    Rust,
    /// A Python module with a tuple.
    Python,
    /// The family file itself.
    Json,
    /// One hexadecimal word per line.
    Text,
    /// YAML for `cv::FileStorage`: name, bits, distance, size, fingerprint and the codes as
    /// hexadecimal strings. It is
    /// not an ArUco dictionary: those contain squares with rotations by 90°. OpenCV's detector
    /// would not find triangular tags, and ArUco would not preserve their distance.
    OpenCv,
}

impl ExportFormat {
    /// Returns the usual extension of such a file.
    pub fn extension(self) -> &'static str {
        match self {
            Self::C => "h",
            Self::Rust => "rs",
            Self::Python => "py",
            Self::Json => "json",
            Self::Text => "txt",
            Self::OpenCv => "yml",
        }
    }
}

/// Returns the text of a family in a format.
pub fn export(family: &Family, format: ExportFormat) -> String {
    let words = TagWords::new(family.dimension());
    let bits = family.dimension().bits();
    let free = match family.free_cells() {
        0 => String::new(),
        free => format!(", not read {}", words.hex(free)),
    };
    let about = format!(
        "DelTag family {}: {} codes of {bits} bits, distance {}, fingerprint {}{free}",
        family.name(),
        family.len(),
        family.distance(),
        family.fingerprint()
    );
    let mut identifier: String = family.name().replace('-', "_");
    // No language allows a leading digit, and C reserves names with a leading underscore.
    if !identifier.starts_with(|c: char| c.is_ascii_alphabetic()) {
        identifier.insert_str(0, "family_");
    }
    let upper = identifier.to_uppercase();
    let list = |suffix: &str, indent: &str| {
        family.codes().iter().fold(String::new(), |mut text, &code| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{indent}{}{suffix},", words.hex(code));
            text
        })
    };
    match format {
        ExportFormat::C => format!(
            "/* {about} */\n#ifndef {upper}_H\n#define {upper}_H\n\n#include <stdint.h>\n\n\
             enum {{ {upper}_BITS = {bits}, {upper}_DISTANCE = {}, {upper}_SIZE = {} }};\n\n\
             static const uint64_t {identifier}_codes[{upper}_SIZE] = {{\n{}}};\n\n#endif\n",
            family.distance(),
            family.len(),
            list("ULL", "    ")
        ),
        ExportFormat::Rust => format!(
            "//! {about}\n\n/// Bits of a code.\npub const BITS: u32 = {bits};\n\
             /// Minimum number of cells in which any two codes differ, in any rotation.\n\
             pub const DISTANCE: u32 = {};\n/// The codes; an id is a position.\n\
             pub const CODES: [u64; {}] = [\n{}];\n",
            family.distance(),
            family.len(),
            list("", "    ")
        ),
        ExportFormat::Python => format!(
            "\"\"\"{about}\"\"\"\n\nNAME = \"{}\"\nBITS = {bits}\nDISTANCE = {}\nCODES = (\n{})\n",
            family.name(),
            family.distance(),
            list("", "    ")
        ),
        ExportFormat::Json => family.to_json(),
        ExportFormat::Text => family.codes().iter().map(|&c| words.hex(c) + "\n").collect(),
        ExportFormat::OpenCv => {
            let codes: String =
                family.codes().iter().map(|&c| format!("   - \"{}\"\n", words.hex(c))).collect();
            format!(
                "%YAML:1.0\n---\n# {about}\n# triangular tags: not an ArUco dictionary\n\
                 name: \"{}\"\nbits: {bits}\ndistance: {}\nsize: {}\n\
                 fingerprint: \"{}\"\ncodes:\n{codes}",
                family.name(),
                family.distance(),
                family.len(),
                family.fingerprint()
            )
        }
    }
}
