//! Names of targets and cameras.

use std::fmt;
use std::ops::Deref;

use serde::{Deserialize, Serialize};

/// Longest name in characters: the name is part of the label and of file names.
const LONGEST: usize = 64;

/// The name of a target or camera: the stem of its files and part of labels. It consists of ASCII letters, digits,
/// `-`, `_` and `.`; it starts with a letter, a digit or `_`; and it is not a Windows device name. So it cannot name
/// another folder, and the label font contains all its characters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Name(String);

impl Name {
    /// Creates a name from a string.
    ///
    /// # Errors
    /// Returns an error that describes what makes the text invalid.
    pub fn new(name: &str) -> Result<Self, String> {
        if name.is_empty() || name.len() > LONGEST {
            return Err(format!("{name:?} must have 1 to {LONGEST} characters"));
        }
        if !name.chars().all(is_plain) || name.starts_with(['.', '-']) {
            return Err(format!(
                "{name:?} may contain only ASCII letters (A-Z, a-z), digits, -, _ and ., and not start with . or -"
            ));
        }
        if is_reserved(name) || name.ends_with('.') {
            return Err(format!("{name:?} is not a valid file name on every system"));
        }
        Ok(Self(name.to_owned()))
    }

    /// Creates a name without dots. Names of families have none, because other file endings follow them.
    ///
    /// # Errors
    /// Returns an error that describes what makes the text invalid.
    pub fn without_dots(name: &str) -> Result<Self, String> {
        if name.contains('.') {
            return Err(format!("{name:?} may contain only ASCII letters, digits, - and _"));
        }
        Self::new(name)
    }

    /// Makes a valid name from any string; `-` replaces invalid characters.
    pub fn like(text: &str) -> Self {
        let plain = text.trim_start_matches(['.', '-', '/', '\\']).chars().take(LONGEST);
        let name: String = plain.map(|c| if is_plain(c) { c } else { '-' }).collect();
        let name = name.trim_end_matches('.');
        Self(if name.is_empty() || is_reserved(name) { "target" } else { name }.to_owned())
    }
}

/// Returns whether a path from a file stays within its folder, on any system.
pub fn is_within(path: &str) -> bool {
    let is_drive = |part: &str| part.as_bytes().get(1) == Some(&b':');
    path.split(SEPARATORS).all(|part| !matches!(part, "" | "." | "..") && !is_drive(part))
}

/// Returns a path that stays within its folder: the path itself, or its last component.
pub fn within(path: &str) -> &str {
    let end = path.rsplit(SEPARATORS).find(|part| is_within(part));
    if is_within(path) { path } else { end.unwrap_or("picture") }
}

/// Path separators, here or on other systems.
const SEPARATORS: [char; 2] = ['/', '\\'];

/// Returns whether Windows treats a file of this name as a device.
fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let numbered = |kind| {
        let number = stem.strip_prefix(kind);
        number.is_some_and(|n| n.len() == 1 && n.as_bytes()[0].is_ascii_digit())
    };
    matches!(stem.as_str(), "con" | "prn" | "aux" | "nul") || numbered("com") || numbered("lpt")
}

fn is_plain(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_.".contains(c)
}

impl Deref for Name {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl TryFrom<String> for Name {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::new(&name)
    }
}

impl From<Name> for String {
    fn from(name: Name) -> Self {
        name.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_within_their_folder() {
        for path in ["a.png", "left/a.png", "12:30.png", "..a/b..c"] {
            assert_eq!(within(path), path);
        }
        for (path, end) in [
            ("../../etc/passwd", "passwd"),
            ("/a.png", "a.png"),
            ("a/../b.png", "b.png"),
            ("..\\..\\a.png", "a.png"),
            ("C:\\a.png", "a.png"),
            ("C:a.png", "picture"),
            ("a/..", "a"),
            ("..", "picture"),
            ("", "picture"),
        ] {
            assert!(!is_within(path) && within(path) == end, "{path}: {}", within(path));
        }
    }

    #[test]
    fn names_are_valid_file_stems() {
        for name in ["board", "2026-11-22_desk.v2", "_A"] {
            assert_eq!(&*Name::new(name).unwrap(), name);
            assert_eq!(&*Name::like(name), name);
        }
        let long = "x".repeat(LONGEST + 1);
        assert!(Name::without_dots("a_b").is_ok() && Name::without_dots("a.b").is_err());
        for (text, like) in [
            ("", "target"),
            ("nul", "target"),
            ("Com1.txt", "target"),
            ("a.", "a"),
            ("../../x", "x"),
            ("/etc/passwd", "etc-passwd"),
            ("-rf", "rf"),
            ("a\u{1b}[31mb", "a--31mb"),
            (".hidden", "hidden"),
            (long.as_str(), &long[1..]),
        ] {
            assert!(Name::new(text).is_err(), "{text:?}");
            assert_eq!(&*Name::like(text), like, "{text:?}");
            assert!(Name::new(&Name::like(text)).is_ok());
        }
    }
}
