//! Changes of files that keep their form, so that they get past the door of a reader.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{json, pdf, png, text};

/// How files are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Anything.
    Bytes,
    /// Lines, words and numbers.
    Text,
    /// JSON.
    Json,
    /// PNG: chunks with check sums, packed pixels.
    Png,
    /// PDF: objects, packed drawing instructions.
    Pdf,
    /// glTF in one file: JSON and numbers.
    Glb,
}

/// Numbers without an end from a seed.
#[derive(Clone, Debug)]
pub struct Dice(ChaCha8Rng);

impl Dice {
    /// Those of a seed.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// A number less than another; 0 where that is 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0.random_range(0..end.max(1))
    }

    /// One of some things.
    pub fn one_of<T: Clone>(&mut self, things: &[T]) -> T {
        things[self.below(things.len())].clone()
    }
}

/// Changes one thing; `None` for a file that has not the form.
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

/// Changes bytes wherever they are.
pub fn noise(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if bytes.is_empty() {
        return bytes;
    }
    let at = dice.below(bytes.len());
    let length = 1 + dice.below(8.min(bytes.len() - at));
    match dice.below(7) {
        0 => bytes[at] ^= 1 << dice.below(8),
        1 => bytes[at] = dice.one_of(&[0, 1, 0x7f, 0x80, 0xff]),
        2 => bytes[at..at + length].fill(0xff),
        3 => bytes.truncate(at),
        4 => drop(bytes.drain(at..at + length)),
        5 => {
            let piece = bytes[at..at + length].to_vec();
            let to = dice.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        _ if bytes.len() - at >= 4 => {
            let number = dice.one_of(&FLOATS).to_le_bytes();
            bytes[at..at + 4].copy_from_slice(&number);
        }
        _ => bytes[at] = dice.below(256) as u8,
    }
    bytes
}

const FLOATS: [f32; 8] =
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0, 1e30, -1.0];

/// Changes the JSON, or the numbers behind it.
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
