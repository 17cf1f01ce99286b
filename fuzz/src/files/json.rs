//! Mutations of JSON: a value, a key, an element.

use serde_json::{Map, Value, json};

use super::dice::Dice;
use super::text::{NUMBERS, WORDS};

/// Mutates one thing; `None` if the bytes are not JSON.
pub fn change(bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    let mut root: Value = serde_json::from_slice(bytes).ok()?;
    let count = count(&root);
    let other = at(&mut root, &mut dice.below(count)).cloned();
    let spot = at(&mut root, &mut dice.below(count))?;
    match dice.below(8) {
        // A value from elsewhere in the file.
        0 => *spot = other?,
        1 => *spot = dice.one_of(&[json!(null), json!(true), json!([]), json!(""), json!({})]),
        _ => inside(spot, dice),
    }
    serde_json::to_vec(&root).ok()
}

fn inside(spot: &mut Value, dice: &mut Dice) {
    match spot {
        Value::Object(map) => of_map(map, dice),
        Value::Array(list) if !list.is_empty() => {
            let (at, other) = (dice.below(list.len()), dice.below(list.len()));
            match dice.below(4) {
                0 => drop(list.remove(at)),
                1 => list.insert(at, list[other].clone()),
                2 => list.swap(at, other),
                _ => list.truncate(at),
            }
        }
        Value::String(_) => *spot = json!(dice.one_of(&WORDS)),
        // Text that is not a valid JSON number becomes a string.
        _ => {
            let number = dice.one_of(&NUMBERS);
            *spot = serde_json::from_str(number).unwrap_or_else(|_| json!(number));
        }
    }
}

fn of_map(map: &mut Map<String, Value>, dice: &mut Dice) {
    let keys: Vec<String> = map.keys().cloned().collect();
    let Some(key) = keys.get(dice.below(keys.len())) else { return };
    let value = map.remove(key).unwrap_or_default();
    match dice.below(3) {
        0 => {}
        1 => drop(map.insert(format!("{key}x"), value)),
        // The value under another key.
        _ => {
            map.insert(key.clone(), value.clone());
            map.insert(keys[dice.below(keys.len())].clone(), value);
        }
    }
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Object(map) => map.values().map(count).sum(),
        Value::Array(list) => list.iter().map(count).sum(),
        _ => 0,
    }
}

/// Returns the value at an index in depth-first order; the root has index 0.
fn at<'a>(value: &'a mut Value, number: &mut usize) -> Option<&'a mut Value> {
    if *number == 0 {
        return Some(value);
    }
    *number -= 1;
    match value {
        Value::Object(map) => map.values_mut().find_map(|value| at(value, number)),
        Value::Array(list) => list.iter_mut().find_map(|value| at(value, number)),
        _ => None,
    }
}
