//! The operators of a PDF page that every viewer draws alike: black paths, filled by the even-odd
//! rule or stroked.

use super::{Findings, start};

/// What an operator does to the path that is being built.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Sets what paths are painted with, between paths.
    State,
    /// Begins a contour.
    Begin,
    /// Goes on with a contour.
    GoOn,
    /// Paints the path, which is then gone.
    Paint,
}

/// Operators with the number of their operands.
const OPERATORS: [(&str, usize, Role); 9] = [
    ("k", 4, Role::State),
    ("K", 4, Role::State),
    ("w", 1, Role::State),
    ("m", 2, Role::Begin),
    ("l", 2, Role::GoOn),
    ("c", 6, Role::GoOn),
    ("h", 0, Role::GoOn),
    ("f*", 0, Role::Paint),
    ("S", 0, Role::Paint),
];

/// Pure K.
const BLACK: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Coordinates beyond this are not held exactly by all viewers, points.
const FARTHEST_PT: f64 = 1e5;

/// Goes through the content of a page: numbers and operators, and nothing else.
pub(super) fn check(content: &[u8], page: &str, found: &mut Findings) {
    let Ok(content) = std::str::from_utf8(content) else {
        return found.add(page, "content other than numbers and operators");
    };
    let mut operands: Vec<f64> = Vec::new();
    let mut in_path = false;
    for (line, text) in content.lines().enumerate() {
        let place = || format!("{page}, line {}", line + 1);
        for word in text.split_ascii_whitespace() {
            if let Some(number) = super::decimal(word) {
                operands.push(number);
                continue;
            }
            let listed = OPERATORS.iter().find(|(name, ..)| *name == word);
            let Some(&(_, count, role)) = listed else {
                found.add(place(), format!("operator {}", start(word, 20)));
                operands.clear();
                continue;
            };
            found.unless(
                operands.len() == count,
                place(),
                format!("operator {word} with {} operands", operands.len()),
            );
            found.unless(
                is_listed(word, &operands),
                place(),
                format!("operator {word} with {operands:?}"),
            );
            let fits = match role {
                Role::State => !in_path,
                Role::Begin => true,
                Role::GoOn | Role::Paint => in_path,
            };
            found.unless(fits, place(), format!("operator {word} in this place"));
            in_path = match role {
                Role::Begin => true,
                Role::Paint => false,
                Role::State | Role::GoOn => in_path,
            };
            operands.clear();
        }
    }
    found.unless(operands.is_empty() && !in_path, page, "content that ends within a path");
}

/// Whether the operands of a listed operator are ones that all viewers draw alike.
fn is_listed(operator: &str, operands: &[f64]) -> bool {
    match operator {
        "k" | "K" => operands == BLACK,
        // The thinnest line that a device has is not the same on all.
        "w" => operands.iter().all(|&width| width > 0.0),
        _ => operands.iter().all(|value| value.abs() < FARTHEST_PT),
    }
}
