//! Mutations that preserve the format of a file, so that it gets past the first checks of a reader.

use super::dice::{Dice, noise};
use super::{json, pdf, png, text};

/// File formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Arbitrary bytes.
    Bytes,
    /// Lines, words and numbers.
    Text,
    /// JSON.
    Json,
    /// PNG: chunks with checksums, compressed pixels.
    Png,
    /// PDF: objects, compressed drawing instructions.
    Pdf,
    /// glTF in one file: JSON and binary numbers.
    Glb,
}

/// Mutates one thing; `None` if the file does not have the format.
pub fn change(form: Form, bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    match form {
        Form::Bytes => Some(noise(bytes, dice)),
        _ if dice.below(20) == 0 => Some(noise(bytes, dice)),
        Form::Text => text::change(bytes, dice),
        Form::Json => json::change(bytes, dice),
        Form::Png => png::change(bytes, dice),
        Form::Pdf => pdf::change(bytes, dice),
        Form::Glb => glb(bytes, dice),
    }
}

/// Mutates the JSON, or the numbers after it.
fn glb(bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    let word =
        |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let length = word(12)?;
    let mut text = bytes.get(20..20 + length)?.to_vec();
    let mut rest = bytes[20 + length..].to_vec();
    if dice.below(5) == 0 && rest.len() > 8 {
        let changed = noise(&rest[8..], dice);
        let size = (changed.len() as u32).to_le_bytes();
        rest = [&size[..], &rest[4..8], &changed].concat();
    } else {
        text = json::change(&text, dice)?;
        text.resize(text.len().next_multiple_of(4), b' ');
    }
    let all = (20 + text.len() + rest.len()) as u32;
    let head = [&b"glTF\x02\0\0\0"[..], &all.to_le_bytes(), &(text.len() as u32).to_le_bytes()];
    Some([&head.concat()[..], b"JSON", &text, &rest].concat())
}
