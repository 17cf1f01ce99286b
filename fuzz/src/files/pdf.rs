//! Mutations of a PDF: a value of an object, a drawing instruction.

use lopdf::{Dictionary, Document, Object, StringFormat};

use super::dice::Dice;
use super::text::{self, WORDS};

/// Mutates one thing; `None` if the bytes are not a PDF.
pub fn change(bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    let mut document = Document::load_mem(bytes).ok()?;
    let ids: Vec<_> = document.objects.keys().copied().collect();
    let id = *ids.get(dice.below(ids.len()))?;
    let other = Object::Reference(*ids.get(dice.below(ids.len()))?);
    let object = document.objects.get_mut(&id)?;
    match object {
        Object::Stream(stream) if dice.below(3) > 0 => {
            let packed = stream.dict.has(b"Filter");
            let content = stream.get_plain_content().ok()?;
            let changed = text::change(&content, dice).unwrap_or(content);
            stream.set_plain_content(changed);
            if packed {
                stream.compress().ok()?;
            }
        }
        Object::Stream(stream) => of_dictionary(&mut stream.dict, other, dice),
        object => of_object(object, other, dice),
    }
    let mut changed = Vec::new();
    document.save_to(&mut changed).ok()?;
    Some(changed)
}

const INTEGERS: [i64; 8] = [0, 1, -1, 2, 65_536, i32::MAX as i64, i64::MAX, i64::MIN];
const REALS: [f32; 6] = [0.0, 1e-30, 1e9, f32::MAX, f32::NAN, -1.0];

fn of_object(object: &mut Object, other: Object, dice: &mut Dice) {
    match object {
        Object::Dictionary(dictionary) => of_dictionary(dictionary, other, dice),
        Object::Array(list) if !list.is_empty() => {
            let at = dice.below(list.len());
            match dice.below(4) {
                0 => drop(list.remove(at)),
                1 => list.insert(at, other),
                _ => of_object(&mut list[at], other, dice),
            }
        }
        _ => {
            *object = match dice.below(6) {
                0 => other,
                1 => Object::Null,
                2 => Object::Name(dice.one_of(&[b"Page", b"Font", b"Type"]).to_vec()),
                3 => Object::Integer(dice.one_of(&INTEGERS)),
                4 => Object::Real(dice.one_of(&REALS)),
                _ => {
                    let word = dice.one_of(&WORDS).as_bytes().to_vec();
                    Object::String(word, StringFormat::Literal)
                }
            }
        }
    }
}

/// Keys that change a page beyond its drawn content.
const KEYS: [&str; 12] = [
    "Annots",
    "AA",
    "OpenAction",
    "Names",
    "Rotate",
    "UserUnit",
    "CropBox",
    "Group",
    "OC",
    "SMask",
    "Encrypt",
    "Kids",
];

fn of_dictionary(dictionary: &mut Dictionary, other: Object, dice: &mut Dice) {
    let keys: Vec<Vec<u8>> = dictionary.iter().map(|(key, _)| key.clone()).collect();
    let Some(key) = keys.get(dice.below(keys.len())) else { return };
    match dice.below(5) {
        0 => drop(dictionary.remove(key)),
        1 => dictionary.set(dice.one_of(&KEYS), other),
        _ => {
            if let Ok(value) = dictionary.get_mut(key) {
                of_object(value, other, dice);
            }
        }
    }
}
