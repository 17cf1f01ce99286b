//! Mutations of text: its lines, words and numbers.

use std::ops::Range;

use super::dice::Dice;

/// Numbers that often break readers.
pub const NUMBERS: [&str; 24] = [
    "0",
    "1",
    "-1",
    "2",
    "255",
    "256",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "-0",
    "0.5",
    "1e-300",
    "1e300",
    "1e308",
    "-1e308",
    "1e999",
    "NaN",
    "inf",
    "1e-9",
    "123456789012345678901234567890",
];

/// Words that often break readers.
pub const WORDS: [&str; 12] = [
    "",
    "../../x",
    "/dev/zero",
    "\u{1b}[31m",
    "%s%n",
    "null",
    "x\0y",
    "é",
    "\u{202e}",
    "<",
    "&amp;",
    "\"",
];

/// Mutates one thing; `None` if the bytes are not text.
pub fn change(bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let changed = match dice.below(10) {
        0..5 => number(text, dice),
        5 | 6 => word(text, dice),
        _ => line(text, dice),
    };
    Some(changed.into_bytes())
}

/// Returns the ranges of the text in which all characters satisfy `is_part`.
fn pieces(text: &str, is_part: impl Fn(char) -> bool) -> Vec<Range<usize>> {
    let (mut pieces, mut start) = (Vec::new(), None);
    for (at, character) in text.char_indices().chain([(text.len(), '\0')]) {
        match (is_part(character) && at < text.len(), start) {
            (true, None) => start = Some(at),
            (false, Some(first)) => {
                pieces.push(first..at);
                start = None;
            }
            _ => {}
        }
    }
    pieces
}

fn number(text: &str, dice: &mut Dice) -> String {
    let is_part = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let numbers = pieces(text, is_part);
    if numbers.is_empty() {
        return line(text, dice);
    }
    let at = numbers[dice.below(numbers.len())].clone();
    let other = numbers[dice.below(numbers.len())].clone();
    let new = match dice.below(3) {
        0 => text[other].to_owned(),
        1 => format!("{}{}", &text[at.clone()], dice.below(10)),
        _ => dice.one_of(&NUMBERS).to_owned(),
    };
    replaced(text, at, &new)
}

fn word(text: &str, dice: &mut Dice) -> String {
    let words = pieces(text, |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '#'));
    if words.is_empty() {
        return line(text, dice);
    }
    let at = words[dice.below(words.len())].clone();
    let other = words[dice.below(words.len())].clone();
    let new = if dice.below(3) == 0 { dice.one_of(&WORDS) } else { &text[other] };
    replaced(text, at, new)
}

/// Mutates a line. Files without lines are split into elements or clauses.
fn line(text: &str, dice: &mut Dice) -> String {
    let end = dice.one_of(&['\n', '\n', '>', ' ', ',']);
    let mut lines: Vec<&str> = text.split_inclusive(end).collect();
    if lines.is_empty() {
        return text.to_owned();
    }
    let (at, other) = (dice.below(lines.len()), dice.below(lines.len()));
    match dice.below(5) {
        0 => drop(lines.remove(at)),
        1 => lines.insert(at, lines[other]),
        2 => lines.swap(at, other),
        3 => lines.truncate(at),
        // Many repetitions, up to a few kilobytes.
        _ => {
            let times = 1 + dice.below(4096 / lines[at].len().max(1)).min(200);
            lines.splice(at..at, vec![lines[at]; times]);
        }
    }
    lines.concat()
}

fn replaced(text: &str, at: Range<usize>, new: &str) -> String {
    [&text[..at.start], new, &text[at.end..]].concat()
}
