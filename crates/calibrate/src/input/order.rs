//! Sorting of frame names by the numbers in them.

use std::collections::BTreeSet;

/// Sorts names by their numbers: 2 before 10.
pub(crate) fn in_order(names: BTreeSet<&str>) -> Vec<String> {
    let mut names: Vec<&str> = names.into_iter().collect();
    names.sort_by_cached_key(|name| parts(name));
    names.into_iter().map(str::to_owned).collect()
}

/// Splits a name into alternating texts and numbers; a number is its length without leading zeros, and its digits.
fn parts(name: &str) -> Vec<(String, usize, String)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, from_number) = rest.split_at(digits);
        let end = from_number.find(|c: char| !c.is_ascii_digit()).unwrap_or(from_number.len());
        let (number, after) = from_number.split_at(end);
        let number = number.trim_start_matches('0');
        parts.push((text.to_owned(), number.len(), number.to_owned()));
        rest = after;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_sort_by_value() {
        let names = ["a10", "a9", "a100", "b1", "a010x"];
        let order = in_order(names.into_iter().collect());
        assert_eq!(order, ["a9", "a10", "a010x", "a100", "b1"]);
    }
}
