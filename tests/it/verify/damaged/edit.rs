//! Edits for files of all kinds.

use super::Damage;

/// Replaces the first occurrence of `from` by `to`.
pub fn swap(from: &str, to: &str) -> Damage {
    let (from, to) = (from.as_bytes().to_vec(), to.as_bytes().to_vec());
    Box::new(move |bytes| {
        let at = find(bytes, &from);
        [&bytes[..at], &to, &bytes[at + from.len()..]].concat()
    })
}

/// Inserts text before the first occurrence of `mark`.
pub fn before(mark: &str, text: &str) -> Damage {
    swap(mark, &format!("{text}{mark}"))
}

/// Adds text at the end.
pub fn append(text: &str) -> Damage {
    let text = text.as_bytes().to_vec();
    Box::new(move |bytes| [bytes, &text].concat())
}

/// Edits a whole text.
pub fn text(edit: impl Fn(&str) -> String + 'static) -> Damage {
    Box::new(move |bytes| edit(std::str::from_utf8(bytes).unwrap()).into_bytes())
}

/// Edits the first line that begins with `start`.
pub fn line(start: &'static str, edit: impl Fn(&str) -> String + 'static) -> Damage {
    text(move |text| {
        let line = text.lines().find(|line| line.starts_with(start)).unwrap();
        text.replacen(line, &edit(line), 1)
    })
}

/// Returns the position of the first occurrence of some bytes.
pub fn find(bytes: &[u8], part: &[u8]) -> usize {
    let found = bytes.windows(part.len()).position(|window| window == part);
    found.unwrap_or_else(|| panic!("`{}` is not in the file", String::from_utf8_lossy(part)))
}
